//! The compiled model.

use super::InputSource;
use super::events::Events;
use super::expansion::Expansion;
use super::kinks::Kinks;
use super::program::Program;
use super::sweep::{Scratch, Sweep};
use crate::linear::SparsityPattern;
use crate::mechanics::Variable;

/// A compiled [`crate::mechanics::System`]: n variables (states, then algebraic ones), p parameters, m outputs.
///
/// Immutable; evaluate through [`super::Bound`].
#[derive(Clone, Debug)]
pub struct Model {
    /// States, then algebraic variables.
    pub(super) variables: Vec<Variable>,
    pub(super) state_count: usize,
    pub(super) curves: Vec<std::sync::Arc<crate::expression::Curve>>,
    pub(super) constraint_names: Vec<String>,
    pub(super) parameter_names: Vec<String>,
    pub(super) output_names: Vec<String>,
    pub(super) probe_names: Vec<String>,
    pub(super) differential: Vec<bool>,
    pub(super) scale: Vec<f64>,
    /// Registers before the first evaluation: constants in place, all else zero.
    pub(super) registers: Vec<f64>,
    pub(super) layout: Layout,
    /// Registers from here on are written by programs.
    pub(super) constant_end: usize,
    /// Of parameters only.
    pub(super) prologue: Program,
    /// Of time, inputs and parameters.
    pub(super) forcing: Program,
    pub(super) rates: Program,
    /// Registers of rates, then constraints. Length n.
    pub(super) rate_registers: Vec<u32>,
    pub(super) kinks: Kinks,
    pub(super) jacobian: Derivative,
    /// Per slot of `pattern`: where its value stands.
    pub(super) jacobian_sources: Sources,
    pub(super) pattern: SparsityPattern,
    /// The Jacobian with intermediate results as further unknowns, where derivatives are swept.
    pub(super) expansion: Option<Expansion>,
    /// Slots of the diagonal of differential variables in the pattern.
    pub(super) diagonal: Vec<u32>,
    /// Slots are those of `parameter_pattern`.
    pub(super) parameter_derivative: Derivative,
    pub(super) parameter_pattern: SparsityPattern,
    pub(super) parameter_sources: Sources,
    /// Runs by itself after the prologue: most measures need little of the rates.
    pub(super) outputs: Program,
    pub(super) output_registers: Vec<u32>,
    /// Runs after `outputs`: d(outputs)/d(variables) and d(outputs)/d(parameters), which share the program of the
    /// first.
    pub(super) output_by_state: Derivative,
    pub(super) output_by_parameter: Derivative,
    pub(super) events: Events,
    pub(super) probes: Program,
    pub(super) probe_registers: Vec<u32>,
    pub(super) starts: Vec<StartProgram>,
}

/// Places of the free variables in the register file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layout {
    pub parameters: usize,
    pub time: usize,
    pub variables: usize,
}

/// How derivatives are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DerivativeForm {
    /// Symbolic for small models, swept for large ones.
    Automatic,
    /// As expressions: fast to evaluate, but their number grows with the square of the model.
    Symbolic,
    /// By tangents through the linearised program.
    Swept,
}

/// Structurally non-zero elements of a matrix and what computes them: a program, or for large models a sweep.
#[derive(Clone, Debug, Default)]
pub(super) struct Derivative {
    pub program: Program,
    pub sweep: Option<Sweep>,
    pub elements: Vec<Element>,
}

impl Derivative {
    /// All elements into their registers; the programs they are derivatives of must have run.
    pub fn evaluate(&self, registers: &mut [f64], inputs: &dyn InputSource, scratch: &mut Scratch) {
        match &self.sweep {
            Some(sweep) => sweep.run(registers, inputs, scratch),
            None => self.program.execute(registers, inputs),
        }
    }

    /// Where the elements are written to.
    pub fn place(&mut self, slot: impl Fn(usize, usize) -> usize) {
        for element in &mut self.elements {
            element.slot = slot(element.row as usize, element.column as usize) as u32;
        }
    }

    fn work(&self) -> usize {
        self.sweep.as_ref().map_or(self.program.lines().len(), Sweep::work)
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Element {
    pub row: u32,
    pub column: u32,
    pub register: u32,
    /// Index into the values of the matrix this element is written to.
    pub slot: u32,
}

/// Where the values of a matrix of derivatives of the residual stand, in the order of its slots.
#[derive(Clone, Debug, Default)]
pub(super) struct Sources {
    registers: Vec<u32>,
    /// -1 in rows of states, as F = y' - rates; 1 in those of constraints; 0 where there is no element.
    signs: Vec<f64>,
}

impl Sources {
    pub fn new(elements: &[Element], slots: usize, state_count: usize) -> Self {
        let mut sources = Self { registers: vec![0; slots], signs: vec![0.0; slots] };
        for element in elements {
            sources.registers[element.slot as usize] = element.register;
            sources.signs[element.slot as usize] = if (element.row as usize) < state_count { -1.0 } else { 1.0 };
        }
        sources
    }

    pub fn gather(&self, registers: &[f64], values: &mut [f64]) {
        for ((value, &register), &sign) in values.iter_mut().zip(&self.registers).zip(&self.signs) {
            *value = if sign == 0.0 { 0.0 } else { sign * registers[register as usize] };
        }
    }
}

/// Start values of one experiment.
#[derive(Clone, Debug)]
pub(super) struct StartProgram {
    /// Runs after the prologue, with only the time set.
    pub program: Program,
    /// Per state: register of the value, `None` where equilibrium determines it.
    pub values: Vec<Option<u32>>,
    /// d(values)/d(parameters).
    pub elements: Vec<Element>,
}

impl Model {
    /// Number n of variables: states, then algebraic ones.
    pub fn dimension(&self) -> usize {
        self.variables.len()
    }

    /// Number of states, the first of the variables.
    pub fn state_count(&self) -> usize {
        self.state_count
    }

    pub fn parameter_count(&self) -> usize {
        self.parameter_names.len()
    }

    pub fn output_count(&self) -> usize {
        self.output_names.len()
    }

    pub fn probe_count(&self) -> usize {
        self.probe_names.len()
    }

    /// States, then algebraic variables.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    pub fn parameter_names(&self) -> &[String] {
        &self.parameter_names
    }

    pub fn output_names(&self) -> &[String] {
        &self.output_names
    }

    pub fn probe_names(&self) -> &[String] {
        &self.probe_names
    }

    /// True per output where a parameter occurs in its formula or in the rates of a state it (indirectly) depends on:
    /// p x m reach, row per parameter.
    pub fn parameter_reach(&self) -> Vec<Vec<bool>> {
        let (n, p, m) = (self.dimension(), self.parameter_count(), self.output_count());
        let mut needs: Vec<Vec<usize>> = vec![Vec::new(); n];
        for element in &self.jacobian.elements {
            needs[element.row as usize].push(element.column as usize);
        }
        for (element, state) in self.changes_by_events() {
            if (element.column as usize) < n {
                needs[state].push(element.column as usize);
            }
        }
        // Per variable the outputs it influences: those that contain it, or whose variables' equations contain it.
        let mut influences = vec![vec![false; m]; n];
        let mut waiting: Vec<(usize, usize)> = Vec::new();
        for element in &self.output_by_state.elements {
            waiting.push((element.column as usize, element.row as usize));
        }
        while let Some((variable, output)) = waiting.pop() {
            if !std::mem::replace(&mut influences[variable][output], true) {
                waiting.extend(needs[variable].iter().map(|&needed| (needed, output)));
            }
        }
        let add = |to: &mut Vec<bool>, from: &[bool]| to.iter_mut().zip(from).for_each(|(to, from)| *to |= from);
        let mut reach = vec![vec![false; m]; p];
        for (element, state) in self.changes_by_events() {
            if let Some(j) = (element.column as usize).checked_sub(n).filter(|j| *j < p) {
                add(&mut reach[j], &influences[state]);
            }
        }
        for element in &self.output_by_parameter.elements {
            reach[element.column as usize][element.row as usize] = true;
        }
        let of_states = self.parameter_derivative.elements.iter().chain(self.starts.iter().flat_map(|s| &s.elements));
        for element in of_states {
            add(&mut reach[element.column as usize], &influences[element.row as usize]);
        }
        reach
    }

    /// Derivatives of conditions and new values, with each state that changes along with them.
    fn changes_by_events(&self) -> Vec<(&Element, usize)> {
        let mut states_of_row: Vec<Vec<usize>> = vec![Vec::new(); self.events.registers.len()];
        let own = self.events.clocks.iter().chain(self.events.whens.iter().map(|when| &when.changes)).flatten();
        own.for_each(|change| states_of_row[change.row as usize].push(change.state as usize));
        for when in &self.events.whens {
            let states = when.changes.iter().map(|change| change.state as usize);
            states_of_row[when.condition as usize].extend(states);
        }
        let elements = self.events.derivative.elements.iter();
        elements.flat_map(|e| states_of_row[e.row as usize].iter().map(move |&state| (e, state))).collect()
    }

    /// Number of functions whose zeros are events.
    pub fn switch_count(&self) -> usize {
        self.events.whens.len()
    }

    /// Whether states change at instants.
    pub fn has_events(&self) -> bool {
        !self.events.registers.is_empty()
    }

    /// Instructions per evaluation of rates, Jacobian, parameter derivatives, outputs.
    pub fn instruction_counts(&self) -> [usize; 4] {
        [self.rates.lines().len(), self.jacobian.work(), self.parameter_derivative.work(), self.outputs.lines().len()]
    }
}
