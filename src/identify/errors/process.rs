//! Levels of process and measurement noise by maximum likelihood of the innovations.

use super::kalman::{NoiseLevels, Pass, add_product, gain, predicted};
use crate::fit::{Bounds, EvaluationFailure, LeastSquares, Optimiser, search};
use crate::mechanics::VariableKind;
use crate::simulation::{Compiled, Record};

/// Largest factor between a level before and after one estimation.
const REACH: f64 = 1e4;
/// Evaluations of the likelihood per level.
const EVALUATIONS: usize = 80;
/// Lowest process noise: its effect over a whole record is this share of the noise of the measurements.
const LEAST: f64 = 1e-6;

/// States that noise drives: the velocities, where there are any.
pub(super) fn driven(compiled: &Compiled) -> Vec<usize> {
    let kind = |wanted: VariableKind| {
        let all = compiled.model.variables().iter().enumerate();
        all.filter(move |(_, variable)| variable.kind == wanted).map(|(i, _)| i).collect::<Vec<usize>>()
    };
    let velocities = kind(VariableKind::Velocity);
    if velocities.is_empty() { kind(VariableKind::Law) } else { velocities }
}

/// The levels with the largest likelihood on the filter's linearisation `passes` (made with `noise`); measurement noise
/// that the study states stays.
pub(super) fn estimate(compiled: &Compiled, records: &[&Record], passes: &[Pass], noise: &NoiseLevels) -> NoiseLevels {
    let states = driven(compiled);
    let compared = |measure: usize| records.iter().any(|record| record.measures.contains(&measure));
    let free: Vec<usize> = (0..compiled.study.measures.len())
        .filter(|&measure| compiled.study.measures[measure].noise.is_none() && compared(measure))
        .collect();
    let count = states.len() + free.len();
    if count == 0 {
        return noise.clone();
    }
    let mut likelihood = Likelihood { records, passes, noise, states: &states, free: &free };
    let bounds = Bounds::new(vec![-REACH.ln(); count], vec![REACH.ln(); count]);
    let found = search(Optimiser::Simplex, &mut likelihood, &vec![0.0; count], &bounds, EVALUATIONS * (count + 1), 1);
    likelihood.levels(&found.theta)
}

/// Logarithms of factors on the levels as parameters.
struct Likelihood<'a> {
    records: &'a [&'a Record],
    passes: &'a [Pass],
    noise: &'a NoiseLevels,
    states: &'a [usize],
    free: &'a [usize],
}

impl Likelihood<'_> {
    fn levels(&self, logarithms: &[f64]) -> NoiseLevels {
        let mut levels = self.noise.clone();
        let (process, measured) = logarithms.split_at(self.states.len());
        self.states.iter().zip(process).for_each(|(&state, value)| levels.process[state] *= value.exp());
        self.free.iter().zip(measured).for_each(|(&measure, value)| levels.measured[measure] *= value.exp());
        levels
    }

    /// -2 ln L / samples.
    fn deviance(&self, levels: &NoiseLevels) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for (record, pass) in self.records.iter().zip(self.passes) {
            sum += deviance(record, pass, levels)?;
            count += pass.innovations.len() as f64;
        }
        Some(sum / count)
    }
}

/// -2 ln L of one record (but for a constant), the filter run on its linearisation.
fn deviance(record: &Record, pass: &Pass, levels: &NoiseLevels) -> Option<f64> {
    let n = levels.process.len();
    let own: Vec<f64> = record.measures.iter().map(|&measure| levels.measured[measure]).collect();
    let m = own.len();
    let mut covariance = vec![0.0; n * n];
    // Of the estimate before the update, against that of the linearisation.
    let mut shift = vec![0.0; n];
    let mut sum = 0.0;
    for k in 0..pass.innovations.len() {
        let by_state = &pass.by_state[k];
        let innovation: Vec<f64> = (0..m)
            .map(|c| pass.innovations[k][c] - (0..n).map(|j| by_state[j * m + c] * shift[j]).sum::<f64>())
            .collect();
        let found = gain(&mut covariance, by_state, &own).ok()?;
        let mut white = vec![0.0; m];
        add_product(&mut white, &found.whitening, &innovation);
        sum += found.log_determinant + white.iter().map(|value| value * value).sum::<f64>();
        add_product(&mut shift, &found.gain, &innovation);
        let before: Vec<f64> = pass.innovations[k].iter().map(|value| -value).collect();
        add_product(&mut shift, &pass.gains[k].gain, &before);
        if let Some(transition) = pass.transitions.get(k) {
            let mut next = vec![0.0; n];
            add_product(&mut next, transition, &shift);
            shift = next;
            covariance = predicted(&covariance, transition, &levels.process, record.sample_step());
        }
    }
    sum.is_finite().then_some(sum)
}

impl LeastSquares for Likelihood<'_> {
    /// One residual whose square grows with the deviance.
    fn residual(&mut self, logarithms: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let deviance = self.deviance(&self.levels(logarithms));
        let refused = || EvaluationFailure { explanation: "the filter fails with this noise".to_owned() };
        let deviance = deviance.ok_or_else(refused)?;
        let first = (0.25 * (deviance - self.reference())).exp();
        if first.is_finite() { Ok(vec![first]) } else { Err(refused()) }
    }

    fn residual_and_gradient(&mut self, logarithms: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        Ok((self.residual(logarithms)?, vec![0.0; logarithms.len()]))
    }
}

impl Likelihood<'_> {
    /// Deviance level that keeps the exponential in range: that of the linearisation's own innovations.
    fn reference(&self) -> f64 {
        let own = |pass: &Pass| pass.gains.iter().map(|gain| gain.log_determinant).sum::<f64>();
        let count: usize = self.passes.iter().map(|pass| pass.innovations.len()).sum();
        self.passes.iter().map(own).sum::<f64>() / count.max(1) as f64
    }
}

/// Levels to begin with: measurement noise a hundredth of each channel's deviation (or as stated), process noise that
/// moves a velocity by a tenth of its course over the record.
pub(super) fn first_levels(compiled: &Compiled, records: &[&Record], courses: &[f64]) -> NoiseLevels {
    let duration: f64 = records.iter().map(|record| record.sample_step() * record.sample_count() as f64).sum();
    let mut process = vec![0.0; compiled.model.variables().len()];
    for state in driven(compiled) {
        process[state] = (0.1 * courses[state]).max(LEAST) / duration.max(f64::MIN_POSITIVE).sqrt();
    }
    let measured = (0..compiled.study.measures.len())
        .map(|measure| compiled.study.measures[measure].noise.unwrap_or_else(|| 0.01 * spread(records, measure)))
        .collect();
    NoiseLevels { process, measured }
}

/// Deviation of a measured channel from its mean, all records together; 1 where it is constant.
fn spread(records: &[&Record], measure: usize) -> f64 {
    let channels = records.iter().filter_map(|record| {
        let place = record.measures.iter().position(|other| *other == measure)?;
        Some(&record.measured[place])
    });
    let (mut squares, mut count) = (0.0, 0usize);
    for channel in channels {
        let mean = channel.iter().sum::<f64>() / channel.len().max(1) as f64;
        squares += channel.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        count += channel.len();
    }
    let deviation = (squares / count.max(1) as f64).sqrt();
    if deviation > 0.0 { deviation } else { 1.0 }
}
