//! A record simulated stretch by stretch from given states, with derivatives by those states.

use super::prepare::Record;
use super::run::{Compiled, options, start};
use crate::integrate::{self, Dynamics, Options, Start};
use crate::linear::SparsityPattern;
use crate::mechanics::Variable;
use crate::study::Parameter;
use crate::tape::Bound;

/// State at one sample of a record: y (length n) and its derivatives by all p parameters, n x p column-major (empty
/// where they were not asked for).
#[derive(Clone, Debug, Default)]
pub struct State {
    pub y: Vec<f64>,
    pub sensitivity: Vec<f64>,
}

/// A stretch: states at the samples behind its first one.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    pub states: Vec<State>,
    /// Per sample dy/d(first state), n x n column-major; empty where derivatives were not asked for.
    pub transitions: Vec<Vec<f64>>,
}

/// What a record measures at one sample.
#[derive(Clone, Debug, Default)]
pub struct Observation {
    /// Per compared measure.
    pub values: Vec<f64>,
    /// dh/dy, measures x n column-major.
    pub by_state: Vec<f64>,
    /// dh/dtheta at fixed state, measures x p column-major.
    pub by_parameter: Vec<f64>,
}

/// One record with one parameter vector.
pub struct Stretches<'a> {
    dynamics: Seeded<'a>,
    record: &'a Record,
    options: Options,
    compiled: &'a Compiled,
}

/// Why a model cannot be taken stretch by stretch: its states are not free.
pub fn stretches_refused(compiled: &Compiled) -> Option<&'static str> {
    if compiled.study.measures.iter().any(|measure| measure.delay.is_some()) {
        return Some("a measure has a delay: what it shows is no function of the present state");
    }
    if compiled.model.state_count() < compiled.model.dimension() {
        return Some(
            "the mechanism has closed loops: its states depend on each other and cannot be moved or corrected one by one",
        );
    }
    (compiled.model.switch_count() > 0).then_some(
        "laws switch: which mode they are in follows from the past and is no state that could be moved or corrected",
    )
}

impl<'a> Stretches<'a> {
    /// `theta`: SI, length p.
    pub fn new(compiled: &'a Compiled, record: &'a Record, theta: &[f64]) -> Self {
        let bound = Bound::new(&compiled.model, &record.inputs, theta);
        let states = compiled.model.variables().iter().map(|variable| variable.scale);
        let scale = compiled.study.parameters.iter().map(Parameter::scale).chain(states).collect();
        Self { dynamics: Seeded { bound, scale }, record, options: options(&compiled.study), compiled }
    }

    pub fn variables(&self) -> &'a [Variable] {
        self.compiled.model.variables()
    }

    /// The state with which the record's simulation starts, as the study says.
    ///
    /// # Errors
    /// What prevents it, in words.
    pub fn start(&mut self) -> Result<State, String> {
        let found = start(self.compiled, &mut self.dynamics.bound, self.record, true);
        let found = found.map_err(|failure| self.blame(&failure))?;
        Ok(State { y: found.y, sensitivity: found.sensitivity })
    }

    /// From `state` at sample `from` (counted from the start of the simulation) to all samples up to `to`.
    ///
    /// # Errors
    /// What ended the integration, in words.
    pub fn advance(&mut self, state: &State, from: usize, to: usize, derivatives: bool) -> Result<Stretch, String> {
        let (n, p) = (self.dynamics.dimension(), self.dynamics.bound.parameter_count());
        let time = self.record.times[from];
        let mut y_prime = vec![0.0; n];
        self.dynamics.bound.explicit_rates(time, &state.y, &mut y_prime);
        let sensitivity = if derivatives {
            let identity = (0..n * n).map(|k| if k % (n + 1) == 0 { 1.0 } else { 0.0 });
            state.sensitivity.iter().copied().chain(identity).collect()
        } else {
            Vec::new()
        };
        let start = Start { time, y: state.y.clone(), y_prime, sensitivity };
        let times = &self.record.times[from + 1..=to];
        let solution = integrate::integrate(&mut self.dynamics, &start, times, &self.record.breakpoints, &self.options)
            .map_err(|failure| self.blame(&failure))?;
        let mut stretch = Stretch::default();
        for k in 0..times.len() {
            let mut own = State { y: solution.y[k * n..(k + 1) * n].to_vec(), sensitivity: Vec::new() };
            if derivatives {
                let block = &solution.sensitivity[k * n * (p + n)..(k + 1) * n * (p + n)];
                own.sensitivity = block[..n * p].to_vec();
                stretch.transitions.push(block[n * p..].to_vec());
            }
            stretch.states.push(own);
        }
        Ok(stretch)
    }

    /// What is measured in state `y` at sample `at` (counted from the start of the simulation).
    pub fn observe(&mut self, y: &[f64], at: usize, derivatives: bool) -> Observation {
        let bound = &mut self.dynamics.bound;
        let model = bound.model();
        let (n, p, m) = (model.dimension(), model.parameter_count(), model.output_count());
        let time = self.record.times[at];
        let mut values = vec![0.0; m];
        bound.outputs(time, y, &mut values);
        let measures = &self.record.measures;
        let mut observation =
            Observation { values: measures.iter().map(|&measure| values[measure]).collect(), ..Observation::default() };
        if derivatives {
            let (mut by_state, mut by_parameter) = (vec![0.0; m * n], vec![0.0; m * p]);
            bound.output_derivatives(time, y, &mut by_state, &mut by_parameter);
            let pick = |matrix: &[f64]| -> Vec<f64> {
                matrix.chunks_exact(m).flat_map(|column| measures.iter().map(|&measure| column[measure])).collect()
            };
            observation.by_state = pick(&by_state);
            observation.by_parameter = pick(&by_parameter);
        }
        observation
    }

    /// Rates of the states at sample `at`, and their derivatives by the parameters at fixed state, n x p column-major.
    pub fn rates(&mut self, y: &[f64], at: usize) -> (Vec<f64>, Vec<f64>) {
        let (n, p) = (self.dynamics.dimension(), self.dynamics.bound.parameter_count());
        let time = self.record.times[at];
        let (mut rates, mut slopes) = (vec![0.0; n], vec![0.0; n * p]);
        self.dynamics.bound.explicit_rates(time, y, &mut rates);
        self.dynamics.bound.parameter_derivative(time, y, &rates, &mut slopes);
        // Those of the residual y' - f.
        slopes.iter_mut().for_each(|value| *value = -*value);
        (rates, slopes)
    }

    fn blame(&self, failure: &integrate::Failure) -> String {
        let bound = &self.dynamics.bound;
        let name = |i: usize| bound.component_name(i);
        let equation = |i: usize| bound.equation_name(i);
        super::Failure::from_integration(&self.record.title(), failure, name, equation).to_string()
    }
}

/// The start state as n further parameters behind the p real ones.
struct Seeded<'a> {
    bound: Bound<'a>,
    scale: Vec<f64>,
}

impl Dynamics for Seeded<'_> {
    fn dimension(&self) -> usize {
        self.bound.dimension()
    }

    fn parameter_count(&self) -> usize {
        self.bound.parameter_count() + self.bound.dimension()
    }

    fn differential(&self) -> &[bool] {
        self.bound.differential()
    }

    fn scale(&self) -> &[f64] {
        self.bound.scale()
    }

    fn parameter_scale(&self) -> &[f64] {
        &self.scale
    }

    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        self.bound.residual(t, y, y_prime, residual);
    }

    fn pattern(&self) -> &SparsityPattern {
        self.bound.pattern()
    }

    fn jacobian(&mut self, t: f64, y: &[f64], y_prime: &[f64], c: f64, values: &mut [f64]) {
        self.bound.jacobian(t, y, y_prime, c, values);
    }

    fn parameter_derivative(&mut self, t: f64, y: &[f64], y_prime: &[f64], values: &mut [f64]) {
        let own = self.bound.dimension() * self.bound.parameter_count();
        self.bound.parameter_derivative(t, y, y_prime, &mut values[..own]);
        values[own..].fill(0.0);
    }

    fn explicit_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> bool {
        self.bound.explicit_rates(t, y, rates)
    }

    fn kink_count(&self) -> usize {
        self.bound.kink_count()
    }

    fn kinks(&mut self, t: f64, y: &[f64], values: &mut [f64]) {
        self.bound.kinks(t, y, values);
    }

    fn hold_sides(&mut self, sides: Option<&[bool]>) {
        self.bound.hold_sides(sides);
    }

    fn component_name(&self, i: usize) -> String {
        self.bound.component_name(i)
    }

    fn equation_name(&self, i: usize) -> String {
        self.bound.equation_name(i)
    }
}
