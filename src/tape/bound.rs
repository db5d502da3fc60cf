//! Evaluation of a model for one parameter vector and one set of inputs.

use super::expansion::Memory;
use super::model::{Element, Model};
use super::sweep::Scratch;
use super::{InputSource, Sources};
use crate::integrate::{Dynamics, ResetDerivatives, SwitchDerivatives};
use crate::linear::SparsityPattern;

/// A model with parameters and inputs bound, and the memory of its evaluation.
///
/// `n` variables (states, then algebraic ones), `p` parameters, `m` outputs; all matrices column-major, all values SI.
pub struct Bound<'a> {
    pub(super) model: &'a Model,
    pub(super) inputs: Sources<'a>,
    pub(super) registers: Vec<f64>,
    /// Whether the registers hold the rates at the time and variables that stand in them.
    is_current: bool,
    /// Whether comparisons keep the values that stand in their registers.
    pub(super) is_held: bool,
    parameter_scale: Vec<f64>,
    pub(super) scratch: Scratch,
    memory: Memory,
}

/// Start values as far as they are given; see [`Bound::start_values`].
#[derive(Clone, Debug, PartialEq)]
pub struct StartValues {
    /// Length n; that of the reference configuration where equilibrium (or consistency) determines the value.
    pub values: Vec<f64>,
    /// d(values)/d(parameters), n x p column-major.
    pub derivatives: Vec<f64>,
    /// Length n: true where the value follows from equilibrium; algebraic variables included.
    pub equilibrium: Vec<bool>,
}

impl<'a> Bound<'a> {
    /// `theta`: parameter values (SI) in the order of [`Model::parameter_names`]; missing ones are NaN.
    pub fn new(model: &'a Model, inputs: &'a dyn InputSource, theta: &[f64]) -> Self {
        let mut bound = Self {
            model,
            inputs: Sources { curves: &model.curves, inputs },
            registers: model.registers.clone(),
            is_current: false,
            is_held: false,
            parameter_scale: Vec::new(),
            scratch: Scratch::default(),
            memory: Memory::default(),
        };
        bound.set_parameters(theta);
        bound
    }

    /// Replaces the parameter values.
    pub fn set_parameters(&mut self, theta: &[f64]) {
        let first = self.model.layout.parameters;
        for i in 0..self.model.parameter_count() {
            self.registers[first + i] = theta.get(i).copied().unwrap_or(f64::NAN);
        }
        self.model.prologue.execute(&mut self.registers, &self.inputs);
        self.is_current = false;
    }

    /// Tells typical magnitudes of the parameters (SI, positive, length p), by which the integrator judges errors of
    /// sensitivities.
    pub fn set_parameter_scale(&mut self, scale: Vec<f64>) {
        self.parameter_scale = scale;
    }

    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// The parameter values (SI).
    pub fn parameters(&self) -> &[f64] {
        let first = self.model.layout.parameters;
        &self.registers[first..first + self.model.parameter_count()]
    }

    /// Rates and constraints at (t, y) into their registers, unless they are there.
    pub(super) fn update(&mut self, t: f64, y: &[f64]) {
        let layout = self.model.layout;
        let same_time = self.is_current && self.registers[layout.time].to_bits() == t.to_bits();
        if !same_time {
            self.registers[layout.time] = t;
            self.model.forcing.execute(&mut self.registers, &self.inputs);
        }
        let variables = &mut self.registers[layout.variables..layout.variables + self.model.variables.len()];
        // Without early exit: a few vector instructions.
        let same_variables = variables.iter().zip(y).fold(0, |bits, (a, b)| bits | (a.to_bits() ^ b.to_bits())) == 0;
        if !(same_time && same_variables) {
            variables.copy_from_slice(y);
            let rates = if self.is_held { &self.model.kinks.held_rates } else { &self.model.rates };
            rates.execute(&mut self.registers, &self.inputs);
        }
        self.is_current = true;
    }

    /// Time and variables into their registers, before anything but the rates is computed.
    pub(super) fn set_point(&mut self, t: f64, y: &[f64]) {
        let layout = self.model.layout;
        self.registers[layout.time] = t;
        self.registers[layout.variables..layout.variables + self.model.variables.len()].copy_from_slice(y);
        self.forget_rates();
    }

    pub(super) fn forget_rates(&mut self) {
        self.is_current = false;
    }

    /// The outputs into their registers.
    pub(super) fn update_outputs(&mut self, t: f64, y: &[f64]) {
        self.set_point(t, y);
        self.model.outputs.execute(&mut self.registers, &self.inputs);
    }

    /// The measured channels, length m.
    pub fn outputs(&mut self, t: f64, y: &[f64], out: &mut [f64]) {
        self.update_outputs(t, y);
        self.gather(&self.model.output_registers, out);
    }

    /// d(outputs)/d(theta) along a solution with sensitivity dy/dtheta (n x p): m x p into `out`.
    pub fn output_sensitivity(&mut self, t: f64, y: &[f64], sensitivity_y: &[f64], out: &mut [f64]) {
        self.evaluate_output_derivatives(t, y);
        let (n, m) = (self.model.dimension(), self.model.output_count());
        out.fill(0.0);
        self.scatter(&self.model.output_by_parameter.elements, 1.0, out);
        if m == 0 || n == 0 {
            return;
        }
        for (of_output, of_state) in out.chunks_exact_mut(m).zip(sensitivity_y.chunks_exact(n)) {
            for element in &self.model.output_by_state.elements {
                let slope = self.registers[element.register as usize];
                of_output[element.row as usize] += slope * of_state[element.column as usize];
            }
        }
    }

    /// d(outputs)/d(y), m x n, and d(outputs)/d(theta) at fixed y, m x p.
    pub fn output_derivatives(&mut self, t: f64, y: &[f64], by_state: &mut [f64], by_parameter: &mut [f64]) {
        self.evaluate_output_derivatives(t, y);
        by_state.fill(0.0);
        self.scatter(&self.model.output_by_state.elements, 1.0, by_state);
        by_parameter.fill(0.0);
        self.scatter(&self.model.output_by_parameter.elements, 1.0, by_parameter);
    }

    fn evaluate_output_derivatives(&mut self, t: f64, y: &[f64]) {
        self.update_outputs(t, y);
        self.model.output_by_state.evaluate(&mut self.registers, &self.inputs, &mut self.scratch);
        if self.model.output_by_parameter.sweep.is_some() {
            self.model.output_by_parameter.evaluate(&mut self.registers, &self.inputs, &mut self.scratch);
        }
    }

    /// The probes of the system, in its order.
    pub fn probes(&mut self, t: f64, y: &[f64], out: &mut [f64]) {
        self.update(t, y);
        self.model.probes.execute(&mut self.registers, &self.inputs);
        self.gather(&self.model.probe_registers, out);
    }

    /// Given start values of experiment `experiment` at its first time. An experiment that the system does not have is
    /// answered as equilibrium throughout.
    pub fn start_values(&mut self, experiment: usize, t0: f64) -> StartValues {
        let (n, p) = (self.model.dimension(), self.model.parameter_count());
        let values = self.model.variables.iter().map(|variable| variable.reference).collect();
        let mut start = StartValues { values, derivatives: vec![0.0; n * p], equilibrium: vec![true; n] };
        let Some(program) = self.model.starts.get(experiment) else { return start };
        self.is_current = false;
        self.registers[self.model.layout.time] = t0;
        program.program.execute(&mut self.registers, &self.inputs);
        for (state, register) in program.values.iter().enumerate() {
            if let Some(register) = register {
                start.values[state] = self.registers[*register as usize];
                start.equilibrium[state] = false;
            }
        }
        for element in &program.elements {
            start.derivatives[element.column as usize * n + element.row as usize] =
                self.registers[element.register as usize];
        }
        start
    }

    pub(super) fn gather(&self, from: &[u32], out: &mut [f64]) {
        for (value, &register) in out.iter_mut().zip(from) {
            *value = self.registers[register as usize];
        }
    }

    fn scatter(&self, elements: &[Element], sign: f64, out: &mut [f64]) {
        for element in elements {
            out[element.slot as usize] = sign * self.registers[element.register as usize];
        }
    }
}

impl Dynamics for Bound<'_> {
    fn dimension(&self) -> usize {
        self.model.dimension()
    }

    fn parameter_count(&self) -> usize {
        self.model.parameter_count()
    }

    fn differential(&self) -> &[bool] {
        &self.model.differential
    }

    fn scale(&self) -> &[f64] {
        &self.model.scale
    }

    fn parameter_scale(&self) -> &[f64] {
        &self.parameter_scale
    }

    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        self.update(t, y);
        self.gather(&self.model.rate_registers, residual);
        for (value, derivative) in residual.iter_mut().zip(y_prime).take(self.model.state_count) {
            *value = derivative - *value;
        }
    }

    fn pattern(&self) -> &SparsityPattern {
        &self.model.pattern
    }

    fn jacobian(&mut self, t: f64, y: &[f64], _y_prime: &[f64], c: f64, values: &mut [f64]) {
        self.update(t, y);
        self.model.jacobian.evaluate(&mut self.registers, &self.inputs, &mut self.scratch);
        self.model.jacobian_sources.gather(&self.registers, values);
        for &slot in &self.model.diagonal {
            values[slot as usize] += c;
        }
    }

    fn expanded_pattern(&self) -> Option<&SparsityPattern> {
        self.model.expansion.as_ref().map(|expansion| &expansion.pattern)
    }

    fn expanded_jacobian(&mut self, t: f64, y: &[f64], c: f64, scale: &[f64], values: &mut [f64]) {
        self.update(t, y);
        if let (Some(expansion), Some(sweep)) = (&self.model.expansion, &self.model.jacobian.sweep) {
            let memory = (&mut self.scratch, &mut self.memory);
            expansion.evaluate((sweep, &self.registers, &self.inputs), memory, (scale, c), values);
        }
    }

    fn parameter_derivative(&mut self, t: f64, y: &[f64], _y_prime: &[f64], values: &mut [f64]) {
        self.update(t, y);
        self.model.parameter_derivative.evaluate(&mut self.registers, &self.inputs, &mut self.scratch);
        let n = self.model.dimension();
        values.fill(0.0);
        for element in &self.model.parameter_derivative.elements {
            let value = self.registers[element.register as usize];
            let is_state = (element.row as usize) < self.model.state_count;
            values[element.column as usize * n + element.row as usize] = if is_state { -value } else { value };
        }
    }

    fn parameter_pattern(&self) -> Option<&SparsityPattern> {
        Some(&self.model.parameter_pattern)
    }

    fn parameter_entries(&mut self, t: f64, y: &[f64], _y_prime: &[f64], values: &mut [f64]) {
        self.update(t, y);
        self.model.parameter_derivative.evaluate(&mut self.registers, &self.inputs, &mut self.scratch);
        self.model.parameter_sources.gather(&self.registers, values);
    }

    fn explicit_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> bool {
        if self.model.state_count < self.model.dimension() {
            return false;
        }
        self.update(t, y);
        self.gather(&self.model.rate_registers, rates);
        true
    }

    fn kink_count(&self) -> usize {
        self.model.kinks.comparisons.len()
    }

    fn kinks(&mut self, t: f64, y: &[f64], values: &mut [f64]) {
        self.evaluate_kinks(t, y, values);
    }

    fn hold_sides(&mut self, sides: Option<&[bool]>) {
        self.hold_comparisons(sides);
    }

    fn switch_count(&self) -> usize {
        self.model.events.whens.len()
    }

    fn switches(&mut self, t: f64, y: &[f64], values: &mut [f64]) {
        self.evaluate_switches(t, y, values);
    }

    fn switch_derivatives(&mut self, k: usize, t: f64, y: &[f64], derivatives: &mut SwitchDerivatives) {
        self.evaluate_switch_derivatives(k, t, y, derivatives);
    }

    /// Events happen when a condition becomes true; those that change nothing mark a kink, on either side.
    fn switch_acts(&self, k: usize, rising: bool) -> bool {
        rising || self.model.events.whens[k].changes.is_empty()
    }

    fn acts_on_jumps(&self) -> bool {
        true
    }

    fn reset(&mut self, k: usize, rising: bool, t: f64, y: &mut [f64]) {
        if rising {
            self.evaluate_changes(&self.model.events.whens[k].changes, t, y);
        }
    }

    fn reset_derivatives(&mut self, k: usize, rising: bool, t: f64, y: &[f64], derivatives: &mut ResetDerivatives) {
        if rising {
            self.evaluate_change_derivatives(&self.model.events.whens[k].changes, t, y, derivatives);
        }
    }

    fn clock_periods(&self) -> &[f64] {
        &self.model.events.periods
    }

    fn tick(&mut self, clocks: &[usize], t: f64, y: &mut [f64]) {
        let changes = self.model.events.changes_of_clocks(clocks);
        self.evaluate_changes(&changes, t, y);
    }

    fn tick_derivatives(&mut self, clocks: &[usize], t: f64, y: &[f64], derivatives: &mut ResetDerivatives) {
        let changes = self.model.events.changes_of_clocks(clocks);
        self.evaluate_change_derivatives(&changes, t, y, derivatives);
    }

    fn equation_name(&self, i: usize) -> String {
        match i.checked_sub(self.model.state_count).and_then(|at| self.model.constraint_names.get(at)) {
            Some(name) => name.clone(),
            None => format!("rate of `{}`", self.component_name(i)),
        }
    }

    fn component_name(&self, i: usize) -> String {
        self.model.variables.get(i).map_or_else(|| format!("y[{i}]"), |variable| variable.name.clone())
    }
}
