//! Filter error: the parameters whose one-step predictions by an extended Kalman filter are best (Jategaonkar-2015).
//!
//! Gains and weights are frozen while the parameters move, then renewed with the noise levels of largest likelihood,
//! until neither changes: at the end the innovations are white and the weights their inverse deviations.

use super::super::fitting::Fitted;
use super::kalman::{NoiseLevels, Pass, pass};
use super::process::{estimate, first_levels};
use crate::diagnostics::Diagnostic;
use crate::fit::{Estimate, EvaluationFailure, LeastSquares};
use crate::simulation::{Compiled, Record, State, Stretches};
use rayon::prelude::*;

/// Renewals of gains and noise levels.
const ROUNDS: usize = 12;
/// Levels that change by less than this share, and parameters by less than this share of their bounds, are settled.
const LEVEL_CHANGE: f64 = 0.02;
const PARAMETER_CHANGE: f64 = 1e-5;
/// Process noise below this share of the first guess is none: the guess moves a velocity by a tenth of its course.
const LEAST: f64 = 1e-4;

/// Residuals of one record, and their gradient (rows x p column-major).
type Rows = (Vec<f64>, Vec<f64>);

/// A search from a start with frozen gains.
type Search<'a> = dyn FnMut(&mut FilterProblem, &[f64]) -> Result<Estimate, Diagnostic> + 'a;

/// Innovations with frozen gains, whitened; layout as of the output error.
#[derive(Clone)]
pub struct FilterProblem<'a> {
    compiled: &'a Compiled,
    records: &'a [&'a Record],
    passes: Vec<Pass>,
    pub simulations: usize,
    pub failures: usize,
}

impl FilterProblem<'_> {
    fn rows(&self) -> usize {
        self.records.iter().map(|record| record.sample_count() * record.measures.len()).sum()
    }

    /// Per record.
    fn evaluate(&mut self, theta: &[f64], derivatives: bool) -> Result<Vec<Rows>, EvaluationFailure> {
        self.simulations += self.records.len();
        let (compiled, passes) = (self.compiled, &self.passes);
        let outcomes: Vec<_> = self
            .records
            .par_iter()
            .zip(passes)
            .map(|(record, pass)| follow(compiled, record, pass, theta, derivatives))
            .collect();
        let outcomes: Result<Vec<_>, String> = outcomes.into_iter().collect();
        outcomes.map_err(|explanation| {
            self.failures += 1;
            EvaluationFailure { explanation }
        })
    }
}

/// Whitened innovations of one record along the frozen gains, channel by channel.
fn follow(
    compiled: &Compiled,
    record: &Record,
    pass: &Pass,
    theta: &[f64],
    derivatives: bool,
) -> Result<(Vec<f64>, Vec<f64>), String> {
    let (p, m, samples) = (theta.len(), record.measures.len(), record.sample_count());
    let mut stretches = Stretches::new(compiled, record, theta);
    let mut state = stretches.start()?;
    let n = state.y.len();
    if record.first > 0 {
        state = last(stretches.advance(&state, 0, record.first, derivatives)?.states)?;
    }
    let mut residual = vec![0.0; m * samples];
    let mut gradient = vec![0.0; if derivatives { m * samples * p } else { 0 }];
    for k in 0..samples {
        let at = record.first + k;
        let observation = stretches.observe(&state.y, at, derivatives);
        let gain = &pass.gains[k];
        let innovation: Vec<f64> = (0..m).map(|c| record.measured[c][k] - observation.values[c]).collect();
        let white = |values: &[f64], r: usize| (0..=r).map(|c| gain.whitening[c * m + r] * values[c]).sum::<f64>();
        (0..m).for_each(|r| residual[r * samples + k] = white(&innovation, r));
        super::kalman::add_product(&mut state.y, &gain.gain, &innovation);
        for j in 0..if derivatives { p } else { 0 } {
            let own = &mut state.sensitivity[j * n..(j + 1) * n];
            let slopes: Vec<f64> = (0..m)
                .map(|c| {
                    let through: f64 = (0..n).map(|i| observation.by_state[i * m + c] * own[i]).sum();
                    -(through + observation.by_parameter[j * m + c])
                })
                .collect();
            (0..m).for_each(|r| gradient[j * m * samples + r * samples + k] = white(&slopes, r));
            super::kalman::add_product(own, &gain.gain, &slopes);
        }
        if k + 1 < samples {
            state = last(stretches.advance(&state, at, at + 1, derivatives)?.states)?;
        }
    }
    if residual.iter().chain(&gradient).any(|value| !value.is_finite()) {
        return Err(format!("{}: the predictions became infinite or not a number", record.name));
    }
    Ok((residual, gradient))
}

fn last(mut states: Vec<State>) -> Result<State, String> {
    states.pop().ok_or_else(|| "a stretch without samples".to_owned())
}

impl LeastSquares for FilterProblem<'_> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        Ok(self.evaluate(theta, false)?.into_iter().flat_map(|(residual, _)| residual).collect())
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let (rows, parts) = (self.rows(), self.evaluate(theta, true)?);
        let mut gradient = vec![0.0; rows * theta.len()];
        let mut first = 0;
        for (residual, own) in &parts {
            for (j, column) in own.chunks_exact(residual.len().max(1)).enumerate() {
                gradient[j * rows + first..j * rows + first + residual.len()].copy_from_slice(column);
            }
            first += residual.len();
        }
        Ok((parts.into_iter().flat_map(|(residual, _)| residual).collect(), gradient))
    }
}

/// The filter-error estimate: the last search's result, the noise levels, simulations and failures.
///
/// `minimise` searches from a start with the gains of a problem; `failed` makes a diagnostic of what went wrong.
///
/// # Errors
/// A simulation or search that fails, in words.
pub fn filter_error(
    compiled: &Compiled,
    records: &[&Record],
    start: &[f64],
    minimise: &mut Search,
    failed: &dyn Fn(String) -> Diagnostic,
) -> Result<(Estimate, NoiseLevels, usize, usize), Diagnostic> {
    let scales: Vec<f64> = compiled.study.parameters.iter().map(crate::study::Parameter::scale).collect();
    let mut theta = start.to_vec();
    let first = first_levels(compiled, records, &courses(compiled, records, start).map_err(failed)?);
    let mut noise = first.clone();
    let (mut simulations, mut failures) = (0, 0);
    let mut round = 0;
    loop {
        let passes = |noise: &NoiseLevels| -> Result<Vec<Pass>, String> {
            records.par_iter().map(|record| pass(compiled, record, &theta, noise)).collect()
        };
        let mut next = estimate(compiled, records, &passes(&noise).map_err(failed)?, &noise);
        next.process.iter_mut().zip(&first.process).for_each(|(level, first)| *level = level.max(LEAST * first));
        simulations += 2 * records.len();
        let mut problem =
            FilterProblem { compiled, records, passes: passes(&next).map_err(failed)?, simulations: 0, failures: 0 };
        let settled_noise = settled(&noise, &next);
        noise = next;
        let found = minimise(&mut problem, &theta)?;
        simulations += problem.simulations;
        failures += problem.failures;
        let moved = found.theta.iter().zip(&theta).zip(&scales).map(|((a, b), scale)| (a - b).abs() / scale);
        let settled = settled_noise && moved.fold(0.0, f64::max) < PARAMETER_CHANGE;
        theta.clone_from(&found.theta);
        round += 1;
        if settled || round == ROUNDS {
            return Ok((found, noise, simulations, failures));
        }
    }
}

/// The problem that the last search of a filter-error fit solved: gains and weights frozen at its estimate.
///
/// # Errors
/// What ended the filter's pass, in words.
pub fn frozen_filter<'a>(
    compiled: &'a Compiled,
    records: &'a [&'a Record],
    fitted: &Fitted,
) -> Result<FilterProblem<'a>, String> {
    let level =
        |name: &str| fitted.process_noise.iter().find(|(state, _)| state == name).map_or(0.0, |(_, level)| *level);
    let measured = fitted.noise_levels.clone().unwrap_or_default();
    let noise = NoiseLevels {
        process: compiled.model.variables().iter().map(|variable| level(&variable.name)).collect(),
        // Measures without a level are compared nowhere.
        measured: measured.into_iter().map(|level| level.unwrap_or(1.0)).collect(),
    };
    let passes: Result<Vec<Pass>, String> =
        records.par_iter().map(|record| pass(compiled, record, &fitted.theta, &noise)).collect();
    Ok(FilterProblem { compiled, records, passes: passes?, simulations: 0, failures: 0 })
}

fn settled(before: &NoiseLevels, after: &NoiseLevels) -> bool {
    let close = |(a, b): (&f64, &f64)| (a - b).abs() <= LEVEL_CHANGE * a.abs().max(b.abs());
    before.measured.iter().zip(&after.measured).all(close) && before.process.iter().zip(&after.process).all(close)
}

/// Largest deviation of every state from its start over a free simulation of the records.
pub(super) fn courses(compiled: &Compiled, records: &[&Record], theta: &[f64]) -> Result<Vec<f64>, String> {
    let mut largest = vec![0.0_f64; compiled.model.variables().len()];
    for record in records {
        let mut stretches = Stretches::new(compiled, record, theta);
        let mut state = stretches.start()?;
        state.sensitivity.clear();
        for found in stretches.advance(&state, 0, record.times.len() - 1, false)?.states {
            let moved = found.y.iter().zip(&state.y).map(|(a, b)| (a - b).abs());
            largest.iter_mut().zip(moved).for_each(|(course, value)| *course = course.max(value));
        }
    }
    Ok(largest)
}
