//! The derivative of a run in one direction of the parameters by dual numbers: a model and its variation as one system
//! of twice the size, along a recorded sequence of steps.

use super::delay::Schedule;
use super::failure::Failure;
use super::prepare::Record;
use super::run::{Compiled, no_schedule, options, start};
use crate::integrate::{self, Dynamics, Options, Plan, Start};
use crate::linear::SparsityPattern;
use crate::tape::{Bound, Tangent};
use std::sync::Arc;

/// Share of the direction for differences of the start values, and weights at one, two and three shares.
const DISTANCE: f64 = 1e-4;
const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// Derivative of the record's channels along `direction`, the steps of `plan` held.
///
/// # Errors
/// [`Failure`] of the start or of a step.
pub(super) fn tangent(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    direction: &[f64],
    plan: Arc<Plan>,
) -> Result<Vec<Vec<f64>>, Failure> {
    let blame = |bound: &Bound, failure: integrate::Failure| {
        let n = compiled.model.dimension();
        let name = |i: usize| compiled.model.variables()[i % n].name.clone();
        Failure::from_integration(&record.title(), &failure, name, |i| bound.equation_name(i % n))
    };
    let mut bound = Bound::new(&compiled.model, &record.inputs, theta);
    let start = doubled_start(compiled, record, theta, direction).map_err(|failure| blame(&bound, failure))?;
    let variation = bound.tangent(direction);
    let mut doubled = Doubled::new(&mut bound, variation);
    let options = Options { follow_plan: Some(plan), ..options(&compiled.study) };
    let schedule = Schedule::new(&compiled.delays, record, theta).ok_or_else(|| no_schedule(record, start.time))?;
    let outcome = integrate::integrate(&mut doubled, &start, &schedule.times, &record.breakpoints, &options);
    let mut solution = outcome.map_err(|failure| blame(doubled.bound, failure))?;
    let Doubled { bound, mut variation, .. } = doubled;
    let n = compiled.model.dimension();
    for (&time, values) in solution.times.iter().zip(solution.y.chunks_exact_mut(2 * n)) {
        if time == start.time {
            values.copy_from_slice(&start.y);
        }
    }
    let mut slopes = vec![0.0; compiled.model.output_count()];
    let mut values = slopes.clone();
    let mut channels = vec![vec![0.0; record.sample_count()]; record.measures.len()];
    for (c, (channel, &measure)) in channels.iter_mut().zip(&record.measures).enumerate() {
        for (k, value) in channel.iter_mut().enumerate() {
            let row = schedule.row(c, k);
            let (y, s) = solution.y[2 * n * row..2 * n * (row + 1)].split_at(n);
            bound.outputs_tangent(&mut variation, solution.times[row], (y, s), &mut slopes);
            let through_delay = schedule.slopes(c, k, |row| {
                bound.outputs(solution.times[row], &solution.y[2 * n * row..2 * n * row + n], &mut values);
                values[measure]
            });
            let moved: f64 =
                through_delay.map_or(0.0, |slopes| slopes.iter().zip(direction).map(|(slope, d)| slope * d).sum());
            *value = slopes[measure] + moved;
        }
    }
    Ok(channels)
}

/// Start values with the constraint forces there, and their derivative by differences.
fn doubled_start(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    direction: &[f64],
) -> Result<Start, integrate::Failure> {
    let at = |share: f64| -> Result<Start, integrate::Failure> {
        let moved: Vec<f64> = theta.iter().zip(direction).map(|(t, d)| t + share * d).collect();
        let mut bound = Bound::new(&compiled.model, &record.inputs, &moved);
        let start = start(compiled, &mut bound, record, false)?;
        let first = integrate::integrate(&mut bound, &start, &[start.time], &[], &options(&compiled.study))?;
        Ok(Start { y: first.y, ..start })
    };
    let nominal = at(0.0)?;
    let mut slopes = vec![0.0; nominal.y.len()];
    for (k, weight) in WEIGHTS.iter().enumerate() {
        for sign in [1.0, -1.0] {
            let moved = at(sign * (k + 1) as f64 * DISTANCE)?;
            slopes.iter_mut().zip(&moved.y).for_each(|(s, y)| *s += sign * weight * y / DISTANCE);
        }
    }
    let y = [nominal.y, slopes].concat();
    Ok(Start { time: nominal.time, y_prime: vec![0.0; y.len()], y, sensitivity: Vec::new() })
}

/// `y' = f(t, y, w)`, `0 = g(t, y, w)` and their derivatives along the direction: those of the rates and constraints by
/// dual numbers.
struct Doubled<'b, 'm> {
    bound: &'b mut Bound<'m>,
    variation: Tangent,
    scale: Vec<f64>,
    differential: Vec<bool>,
    pattern: SparsityPattern,
    half: Vec<f64>,
}

impl<'b, 'm> Doubled<'b, 'm> {
    fn new(bound: &'b mut Bound<'m>, variation: Tangent) -> Self {
        let n = bound.dimension();
        let entries: Vec<(usize, usize)> = bound.pattern().entries().collect();
        let both: Vec<(usize, usize)> =
            entries.iter().copied().chain(entries.iter().map(|(row, column)| (row + n, column + n))).collect();
        Self {
            scale: bound.scale().repeat(2),
            differential: bound.differential().repeat(2),
            pattern: SparsityPattern::from_entries(2 * n, 2 * n, &both),
            half: vec![0.0; entries.len()],
            variation,
            bound,
        }
    }

    fn rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) {
        let n = self.bound.dimension();
        let (values, slopes) = rates.split_at_mut(n);
        self.bound.rates_tangent(&mut self.variation, t, y.split_at(n), (values, slopes));
    }
}

impl Dynamics for Doubled<'_, '_> {
    fn dimension(&self) -> usize {
        self.scale.len()
    }

    fn parameter_count(&self) -> usize {
        0
    }

    fn differential(&self) -> &[bool] {
        &self.differential
    }

    fn scale(&self) -> &[f64] {
        &self.scale
    }

    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        self.rates(t, y, residual);
        let rows = residual.iter_mut().zip(y_prime).zip(&self.differential);
        rows.filter(|(_, differential)| **differential).for_each(|((r, derivative), _)| *r = derivative - *r);
    }

    fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Without the effect of y on s': Newton's method finds s once it has y, as s enters linearly.
    fn jacobian(&mut self, t: f64, y: &[f64], y_prime: &[f64], c: f64, values: &mut [f64]) {
        let n = self.bound.dimension();
        self.bound.jacobian(t, &y[..n], &y_prime[..n], c, &mut self.half);
        let (first, second) = values.split_at_mut(self.half.len());
        first.copy_from_slice(&self.half);
        second.copy_from_slice(&self.half);
    }

    fn parameter_derivative(&mut self, _t: f64, _y: &[f64], _y_prime: &[f64], _values: &mut [f64]) {}

    fn hold_sides(&mut self, sides: Option<&[bool]>) {
        self.bound.hold_sides(sides);
    }

    fn explicit_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> bool {
        let is_explicit = self.differential.iter().all(|differential| *differential);
        if is_explicit {
            self.rates(t, y, rates);
        }
        is_explicit
    }
}
