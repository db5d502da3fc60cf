//! Covariance of the estimate from its gradient and the autocorrelation of its residual (method 7).

use super::fitting::Fitted;
use super::freedom::Spread;
use super::knowledge::straightened;
use super::noise;
use crate::signal::effective_count;
use crate::simulation::Compiled;
use crate::statistics::{Covariance, confidence_interval, identifiability};
use crate::study::{ErrorDefinition, Parameter};

/// Level of all intervals.
const LEVEL: f64 = 0.95;
/// Singular values below this share of the largest belong to directions that the data do not determine. The gradient is
/// accurate to about the integrator's tolerance, so smaller values are not distinguishable from zero.
pub(super) const RANK_THRESHOLD: f64 = 1e-6;

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
    /// Per measure of the study: standard deviation of the noise before the prefilter, SI, the fitted parameters' share
    /// included (method 4.5); `None` where nothing is compared.
    pub noise: Vec<Option<f64>>,
    /// Order of the autoregressive noise model of each block of the residual; 0 is white.
    pub noise_orders: Vec<usize>,
    standard_deviations: Vec<Option<f64>>,
    estimate: Vec<f64>,
    /// How well the covariance is known.
    spread: Spread,
}

impl Confidence {
    /// `None` where the data leave the parameter undetermined.
    pub fn standard_deviation(&self, index: usize) -> Option<f64> {
        self.standard_deviations.get(index).copied().flatten()
    }

    /// 95 % interval; `None` where the data leave the parameter undetermined.
    pub fn interval(&self, index: usize) -> Option<(f64, f64)> {
        Some(confidence_interval(self.estimate[index], self.standard_deviation(index)?, self.freedom_of(index), LEVEL))
    }

    /// Smallest degrees of freedom of the noise estimate behind any parameter's interval.
    pub fn freedom(&self) -> f64 {
        let all = (0..self.estimate.len()).map(|index| self.freedom_of(index)).fold(f64::INFINITY, f64::min);
        if all.is_finite() { all } else { (self.effective_count - self.estimate.len() as f64).max(1.0) }
    }

    /// Degrees of freedom of the noise estimate behind a parameter's interval; infinite where it is undetermined.
    pub fn freedom_of(&self, index: usize) -> f64 {
        let unit: Vec<f64> = (0..self.estimate.len()).map(|j| if j == index { 1.0 } else { 0.0 }).collect();
        self.freedom_along(&unit)
    }

    /// The same for a linear function of the parameters with this gradient.
    pub fn freedom_along(&self, gradient: &[f64]) -> f64 {
        self.spread.freedom(&self.covariance, gradient)
    }
}

/// Covariance `Xi^-1 Gamma Xi^-1` (method 3.30) with the pseudo-inverse over the determined directions, Gamma from an
/// autoregressive model of each channel's residual: coloured residuals widen the intervals.
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
    let gradient = gradient_with_priors(fitted, &scales);
    let models = noise::models(fitted);
    confidence.noise_orders = models.iter().map(noise::NoiseModel::order).collect();
    let levels = fitted.noise_levels.clone();
    confidence.noise =
        levels.unwrap_or_else(|| noise::deviations(compiled, fitted, &gradient, &scales, RANK_THRESHOLD));
    let inverse = Covariance::new(&gradient, &scales, 1.0, None, RANK_THRESHOLD).map(|covariance| covariance.matrix);
    let inverse = inverse.unwrap_or_else(|_| vec![0.0; count * count]);
    let mut completed = models;
    noise::complete(fitted, &mut completed, &inverse);
    let gamma = noise::gamma(fitted, &gradient, &completed, &inverse);
    confidence.spread = Spread::new(fitted, &completed, &inverse);
    if let Ok(analysis) = identifiability(&gradient, &scales, &fitted.theta, &names, RANK_THRESHOLD) {
        confidence.undetermined = analysis.undetermined.iter().map(|direction| direction.description.clone()).collect();
        confidence.identifiability = analysis.measures;
        confidence.singular_values = analysis.singular_values;
    }
    if let Ok(covariance) = Covariance::new(&gradient, &scales, 1.0, Some(&gamma), RANK_THRESHOLD) {
        confidence.correlation = covariance.correlation().chunks(count).map(<[f64]>::to_vec).collect();
        if fitted.error != ErrorDefinition::Equation {
            // Noise in the regressors biases the equation error by an unknown amount.
            confidence.standard_deviations.clone_from(&covariance.standard_deviations);
        }
        confidence.directions = covariance.undetermined;
        confidence.covariance = covariance.matrix;
    }
    confidence
}

/// The gradient with prior knowledge as further rows, so that it determines what the data leave open.
fn gradient_with_priors(fitted: &Fitted, scales: &[f64]) -> Vec<f64> {
    let rows = fitted.residual.len().max(1);
    let priors = straightened(&fitted.prior_rows, &fitted.theta, &fitted.gradient, scales);
    let columns = fitted.gradient.chunks_exact(rows).enumerate();
    columns.flat_map(|(j, column)| column.iter().copied().chain(priors.iter().map(move |row| row.slope(j)))).collect()
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
