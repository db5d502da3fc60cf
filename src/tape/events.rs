//! Evaluation of events: switching functions, new values of states, and the derivatives of both.

use super::bound::Bound;
use super::model::Derivative;
use super::program::Program;
use crate::integrate::{ResetDerivatives, SwitchDerivatives};

/// What computes the events of a model. Rows of the derivative: all conditions and new values; its columns: variables,
/// parameters, time.
#[derive(Clone, Debug, Default)]
pub(super) struct Events {
    /// Runs after the rates.
    pub program: Program,
    /// Register per row.
    pub registers: Vec<u32>,
    pub derivative: Derivative,
    pub whens: Vec<When>,
    pub clocks: Vec<Vec<Change>>,
    /// Per clock, s.
    pub periods: Vec<f64>,
}

#[derive(Clone, Debug)]
pub(super) struct When {
    /// Row of the condition.
    pub condition: u32,
    pub changes: Vec<Change>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Change {
    pub state: u32,
    /// Row of its new value.
    pub row: u32,
}

impl Events {
    /// What changes where these clocks tick together.
    pub fn changes_of_clocks(&self, clocks: &[usize]) -> Vec<Change> {
        clocks.iter().flat_map(|&clock| self.clocks[clock].iter().copied()).collect()
    }
}

impl Bound<'_> {
    fn update_events(&mut self, t: f64, y: &[f64]) {
        self.update(t, y);
        self.model.events.program.execute(&mut self.registers, &self.inputs);
    }

    pub(super) fn evaluate_switches(&mut self, t: f64, y: &[f64], values: &mut [f64]) {
        self.update_events(t, y);
        let events = &self.model.events;
        for (value, when) in values.iter_mut().zip(&events.whens) {
            *value = self.registers[events.registers[when.condition as usize] as usize];
        }
    }

    pub(super) fn evaluate_switch_derivatives(&mut self, k: usize, t: f64, y: &[f64], into: &mut SwitchDerivatives) {
        let Some(when) = self.model.events.whens.get(k) else { return };
        let SwitchDerivatives { by_time, by_state, by_parameter } = into;
        self.rows_of_events(t, y, &[when.condition], |_, column, value| match column {
            Column::Variable(i) => by_state[i] = value,
            Column::Parameter(j) => by_parameter.get_mut(j).into_iter().for_each(|slope| *slope = value),
            Column::Time => *by_time = value,
        });
    }

    pub(super) fn evaluate_changes(&mut self, changes: &[Change], t: f64, y: &mut [f64]) {
        self.update_events(t, y);
        for change in changes {
            let register = self.model.events.registers[change.row as usize];
            y[change.state as usize] = self.registers[register as usize];
        }
    }

    pub(super) fn evaluate_change_derivatives(
        &mut self,
        changes: &[Change],
        t: f64,
        y: &[f64],
        into: &mut ResetDerivatives,
    ) {
        let n = y.len();
        for change in changes {
            into.by_state[change.state as usize * (n + 1)] = 0.0;
        }
        let rows: Vec<u32> = changes.iter().map(|change| change.row).collect();
        let ResetDerivatives { by_time, by_state, by_parameter } = into;
        self.rows_of_events(t, y, &rows, |at, column, value| {
            let state = changes[at].state as usize;
            match column {
                Column::Variable(i) => by_state[i * n + state] = value,
                Column::Parameter(j) => {
                    by_parameter.get_mut(j * n + state).into_iter().for_each(|slope| *slope = value);
                }
                Column::Time => by_time[state] = value,
            }
        });
    }

    /// Calls `take` with the structurally non-zero derivatives of these rows: position in `rows`, column, value.
    fn rows_of_events(&mut self, t: f64, y: &[f64], rows: &[u32], mut take: impl FnMut(usize, Column, f64)) {
        self.update_events(t, y);
        let model = self.model;
        model.events.derivative.evaluate(&mut self.registers, &self.inputs, &mut self.scratch);
        let (n, p) = (model.dimension(), model.parameter_count());
        for element in &model.events.derivative.elements {
            let Some(at) = rows.iter().position(|row| *row == element.row) else { continue };
            let column = match element.column as usize {
                i if i < n => Column::Variable(i),
                j if j < n + p => Column::Parameter(j - n),
                _ => Column::Time,
            };
            take(at, column, self.registers[element.register as usize]);
        }
    }
}

enum Column {
    Variable(usize),
    Parameter(usize),
    Time,
}
