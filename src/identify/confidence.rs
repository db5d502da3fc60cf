//! Covariance of the estimate from its gradient and the autocorrelation of its residual (method 7).

use super::fitting::Fitted;
use crate::signal::{autocovariance, effective_count};
use crate::simulation::Compiled;
use crate::statistics::{Covariance, confidence_interval, identifiability, stationary_noise_gamma};
use crate::study::Parameter;

/// Level of all intervals.
const LEVEL: f64 = 0.95;
/// Singular values below this share of the largest belong to directions that the data do not determine. The gradient is
/// accurate to about the integrator's tolerance, so smaller values are not distinguishable from zero.
const RANK_THRESHOLD: f64 = 1e-6;
/// Lags of the residual's autocovariance that enter the covariance, as a share of the record.
const LAG_SHARE: f64 = 0.02;

/// What is known about the parameters after a fit.
#[derive(Clone, Debug, Default)]
pub struct Confidence {
    /// p x p, symmetric, SI; finite part only.
    pub covariance: Vec<f64>,
    pub correlation: Vec<Vec<f64>>,
    /// Of the weighted gradient scaled by the parameters' bounds, descending.
    pub singular_values: Vec<f64>,
    /// In words, one per undetermined direction.
    pub undetermined: Vec<String>,
    /// Per parameter, relative to the largest (0..1).
    pub identifiability: Vec<f64>,
    pub effective_count: f64,
    /// Bayesian information criterion with unknown variances per channel (Schwarz-1978).
    pub bic: f64,
    /// Directions of infinite variance: orthonormal in parameters scaled by [`Parameter::scale`].
    pub directions: Vec<Vec<f64>>,
    standard_deviations: Vec<Option<f64>>,
    estimate: Vec<f64>,
}

impl Confidence {
    /// `None` where the data leave the parameter undetermined.
    pub fn standard_deviation(&self, index: usize) -> Option<f64> {
        self.standard_deviations.get(index).copied().flatten()
    }

    /// 95 % interval; `None` where the data leave the parameter undetermined.
    pub fn interval(&self, index: usize) -> Option<(f64, f64)> {
        Some(confidence_interval(self.estimate[index], self.standard_deviation(index)?, self.freedom(), LEVEL))
    }

    /// Degrees of freedom of the noise estimate behind the intervals.
    pub fn freedom(&self) -> f64 {
        (self.effective_count - self.estimate.len() as f64).max(1.0)
    }
}

/// Covariance `Xi^-1 Gamma Xi^-1` (method 3.30) with the pseudo-inverse over the determined directions, Gamma from the
/// residual's autocovariance under a Bartlett window (Newey-West-1987): coloured residuals widen the intervals.
pub fn confidence(compiled: &Compiled, fitted: &Fitted) -> Confidence {
    let parameters = &compiled.study.parameters;
    let count = fitted.theta.len();
    let effective: Vec<f64> =
        fitted.blocks.iter().map(|block| effective_count(&fitted.residual[block.rows.clone()])).collect();
    let mut confidence = Confidence {
        correlation: vec![vec![0.0; count]; count],
        identifiability: vec![0.0; count],
        effective_count: effective.iter().sum(),
        bic: information_criterion(fitted, &effective),
        standard_deviations: vec![None; count],
        estimate: fitted.theta.clone(),
        ..Confidence::default()
    };
    if count == 0 {
        return confidence;
    }
    let scales: Vec<f64> = parameters.iter().map(Parameter::scale).collect();
    let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let gradient = gradient_with_priors(compiled, fitted);
    let noise: Vec<(usize, Vec<f64>)> = fitted
        .blocks
        .iter()
        .map(|block| (block.rows.len(), bartlett_autocovariance(fitted, block.rows.clone())))
        .collect();
    let gamma = stationary_noise_gamma(&gradient, count, &noise);
    if let Ok(analysis) = identifiability(&gradient, &scales, &fitted.theta, &names, RANK_THRESHOLD) {
        confidence.undetermined = analysis.undetermined.iter().map(|direction| direction.description.clone()).collect();
        confidence.identifiability = analysis.measures;
        confidence.singular_values = analysis.singular_values;
    }
    if let Ok(covariance) = Covariance::new(&gradient, &scales, 1.0, Some(&gamma), RANK_THRESHOLD) {
        confidence.correlation = covariance.correlation().chunks(count).map(<[f64]>::to_vec).collect();
        confidence.standard_deviations.clone_from(&covariance.standard_deviations);
        confidence.directions = covariance.undetermined;
        confidence.covariance = covariance.matrix;
    }
    confidence
}

/// The gradient with prior knowledge as further rows, so that a prior determines what the data leave open.
fn gradient_with_priors(compiled: &Compiled, fitted: &Fitted) -> Vec<f64> {
    let priors: Vec<(usize, f64)> = compiled
        .study
        .parameters
        .iter()
        .enumerate()
        .filter_map(|(j, parameter)| Some((j, 1.0 / parameter.prior?.standard_deviation)))
        .collect();
    let rows = fitted.residual.len().max(1);
    fitted
        .gradient
        .chunks_exact(rows)
        .enumerate()
        .flat_map(|(j, column)| {
            let extra = priors.iter().map(move |&(k, weight)| if k == j { weight } else { 0.0 });
            column.iter().copied().chain(extra)
        })
        .collect()
}

/// Autocovariance of the weighted residual about zero (a mean left in it is misfit, not noise level) with Bartlett
/// weights and the fitted parameters' share (method 4.5).
fn bartlett_autocovariance(fitted: &Fitted, rows: std::ops::Range<usize>) -> Vec<f64> {
    let count = fitted.theta.len();
    let free = 1.0 - count as f64 / fitted.residual.len().max(count + 1) as f64;
    let residual = &fitted.residual[rows];
    let lags = ((residual.len() as f64 * LAG_SHARE) as usize).min(residual.len().saturating_sub(1));
    let mean = residual.iter().sum::<f64>() / residual.len().max(1) as f64;
    autocovariance(residual, lags)
        .into_iter()
        .enumerate()
        .map(|(lag, value)| (value + mean * mean) / free * (1.0 - lag as f64 / (lags + 1) as f64))
        .collect()
}

/// `sum over channels n_eff log(RSS / n) + p log(sum n_eff)`.
fn information_criterion(fitted: &Fitted, effective: &[f64]) -> f64 {
    let fit: f64 = fitted
        .blocks
        .iter()
        .zip(effective)
        .map(|(block, count)| {
            let squares: f64 = fitted.residual[block.rows.clone()].iter().map(|value| value * value).sum();
            count * (squares / block.rows.len().max(1) as f64).max(f64::MIN_POSITIVE).ln()
        })
        .sum();
    fit + fitted.theta.len() as f64 * effective.iter().sum::<f64>().max(1.0).ln()
}
