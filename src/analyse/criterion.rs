//! Criteria: scalars of a manoeuvre and their gradient.

use crate::simulation::{Compiled, Failure, Gradient, Record, manoeuvre, simulate};
use crate::study::{Statistic, Study};
use rayon::prelude::*;

/// Values of all criteria of a study at one parameter vector, SI.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CriterionValues {
    pub values: Vec<f64>,
    /// dJ/dtheta per criterion, each of length p; empty where not asked for.
    pub gradients: Vec<Vec<f64>>,
}

/// The manoeuvres that criteria look at, ready to simulate.
pub(super) fn manoeuvres(study: &Study) -> Vec<Record> {
    (0..study.manoeuvres.len())
        .filter(|&index| study.criteria.iter().any(|criterion| criterion.manoeuvre == index))
        .map(|index| manoeuvre(study, index))
        .collect()
}

/// Simulates the manoeuvres with parameters `theta` (SI) and takes the criteria from them. The gradient is that of the
/// discrete solution (internal differentiation), also where a criterion is an extreme value: the instant of the extreme
/// is stationary.
///
/// # Errors
/// The first manoeuvre (in order) that cannot be simulated.
pub fn evaluate(compiled: &Compiled, theta: &[f64], gradient: Gradient) -> Result<CriterionValues, Failure> {
    evaluate_on(compiled, &manoeuvres(&compiled.study), theta, gradient)
}

pub(super) fn evaluate_on(
    compiled: &Compiled,
    manoeuvres: &[Record],
    theta: &[f64],
    gradient: Gradient,
) -> Result<CriterionValues, Failure> {
    let study = &compiled.study;
    let count = study.criteria.len();
    let mut result = CriterionValues { values: vec![f64::NAN; count], gradients: Vec::new() };
    if gradient == Gradient::AllParameters {
        result.gradients = vec![vec![0.0; theta.len()]; count];
    }
    let trajectories: Vec<_> =
        manoeuvres.par_iter().map(|record| simulate(compiled, record, theta, gradient)).collect();
    for (record, trajectory) in manoeuvres.iter().zip(trajectories) {
        let trajectory = trajectory?;
        for (c, &output) in record.measures.iter().enumerate() {
            let index = output - study.measures.len();
            let functional = Functional::new(study.criteria[index].statistic, &trajectory.channels[c]);
            result.values[index] = functional.value;
            if let Some(target) = result.gradients.get_mut(index) {
                let samples = record.sample_count();
                for (slope, column) in target.iter_mut().zip(trajectory.gradient[c].chunks_exact(samples)) {
                    *slope = functional.weights.iter().map(|&(k, weight)| weight * column[k]).sum();
                }
            }
        }
    }
    Ok(result)
}

/// A statistic of a sampled history and its derivative by the samples.
struct Functional {
    value: f64,
    /// (sample, dJ/d sample)
    weights: Vec<(usize, f64)>,
}

impl Functional {
    fn new(statistic: Statistic, history: &[f64]) -> Self {
        match statistic {
            Statistic::Maximum => Self::extreme(history, 1.0),
            Statistic::Minimum => Self::extreme(history, -1.0),
            Statistic::Final => Self::combination(history, vec![(history.len() - 1, 1.0)]),
            Statistic::Mean => Self::combination(history, trapezoid(history.len())),
            Statistic::RootMeanSquare => Self::root_mean_square(history),
        }
    }

    fn combination(history: &[f64], weights: Vec<(usize, f64)>) -> Self {
        Self { value: weights.iter().map(|&(k, weight)| weight * history[k]).sum(), weights }
    }

    fn root_mean_square(history: &[f64]) -> Self {
        let weights = trapezoid(history.len());
        let square: f64 = weights.iter().map(|&(k, weight)| weight * history[k] * history[k]).sum();
        let value = square.sqrt();
        let slope = |(k, weight): (usize, f64)| (k, if value > 0.0 { weight * history[k] / value } else { 0.0 });
        Self { value, weights: weights.into_iter().map(slope).collect() }
    }

    /// The vertex of the parabola through the largest sample (of `sign` times the history) and its neighbours.
    fn extreme(history: &[f64], sign: f64) -> Self {
        let largest = |best: usize, k: usize| if sign * history[k] > sign * history[best] { k } else { best };
        let k = (0..history.len()).fold(0, largest);
        if k == 0 || k + 1 == history.len() {
            return Self::combination(history, vec![(k, 1.0)]);
        }
        let (before, at, after) = (history[k - 1], history[k], history[k + 1]);
        let curvature = before - 2.0 * at + after;
        let s = if curvature == 0.0 { 0.0 } else { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) };
        let weights = vec![(k - 1, 0.5 * s * (s - 1.0)), (k, 1.0 - s * s), (k + 1, 0.5 * s * (s + 1.0))];
        Self::combination(history, weights)
    }
}

/// Weights of the mean over equidistant samples.
fn trapezoid(count: usize) -> Vec<(usize, f64)> {
    if count == 1 {
        return vec![(0, 1.0)];
    }
    let inner = 1.0 / (count - 1) as f64;
    (0..count).map(|k| (k, if k == 0 || k + 1 == count { 0.5 * inner } else { inner })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// sin(t) over half a period: maximum 1 at pi/2 (between samples), mean 2/pi, rms 1/sqrt(2), end 0.
    #[test]
    fn statistics_of_a_half_wave() {
        let count = 1000;
        let history: Vec<f64> =
            (0..count).map(|k| (std::f64::consts::PI * k as f64 / (count - 1) as f64).sin()).collect();
        let value = |statistic| Functional::new(statistic, &history).value;
        assert!((value(Statistic::Maximum) - 1.0).abs() < 1e-11);
        assert!((value(Statistic::Mean) - 2.0 / std::f64::consts::PI).abs() < 1e-6);
        assert!((value(Statistic::RootMeanSquare) - 0.5_f64.sqrt()).abs() < 1e-6);
        assert!(value(Statistic::Minimum).abs() < 1e-12 && value(Statistic::Final).abs() < 1e-12);
    }

    /// The weights are the derivative by every sample, also where the extreme moves.
    #[test]
    fn derivatives_agree_with_differences() {
        let history: Vec<f64> =
            (0..40).map(|k| (0.21 * f64::from(k)).sin() + 0.3 * (0.5 * f64::from(k)).cos()).collect();
        for (_, statistic) in Statistic::NAMES {
            let functional = Functional::new(statistic, &history);
            for k in 0..history.len() {
                let moved = |h: f64| {
                    let mut history = history.clone();
                    history[k] += h;
                    Functional::new(statistic, &history).value
                };
                let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                let weight: f64 = functional.weights.iter().filter(|(at, _)| *at == k).map(|(_, weight)| weight).sum();
                assert!((difference - weight).abs() < 1e-7, "{statistic:?} {k}: {difference} {weight}");
            }
        }
    }
}
