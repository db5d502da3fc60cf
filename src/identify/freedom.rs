//! How well the covariance itself is known: degrees of freedom behind the intervals (Satterthwaite-1946).
//!
//! The covariance is linear in the level of every channel's noise and smooth in the coefficients of its colour, both of
//! which are estimates. The variance of a variance V then gives the number of independent samples that would leave it
//! as uncertain, 2 V^2 over its variance.

use super::fitting::Fitted;
use super::noise::{NoiseModel, combined, every};
use crate::linear::SingularValueDecomposition;

/// Change of the covariance with one standard deviation of every independent quantity of the noise models, p x p each.
#[derive(Clone, Debug, Default)]
pub(super) struct Spread {
    parts: Vec<Vec<f64>>,
}

impl Spread {
    /// `inverse`: Xi^+, p x p.
    pub fn new(fitted: &Fitted, models: &[NoiseModel], inverse: &[f64]) -> Self {
        let (count, rows) = (fitted.theta.len(), fitted.residual.len());
        // What the parameters have taken is no sample of the noise.
        let left = (1.0 - count as f64 / rows.max(count + 1) as f64).max(0.0);
        let mut parts = Vec::new();
        for (block, noise) in fitted.blocks.iter().zip(models) {
            let samples = (left * block.rows.len() as f64 / noise.stride as f64).max(1.0);
            let column = |j: usize| {
                let mut own = fitted.gradient[j * rows + block.rows.start..j * rows + block.rows.end].to_vec();
                fitted.filters[block.record].apply(&mut own);
                own
            };
            let columns = combined(&(0..count).map(column).collect::<Vec<_>>(), inverse);
            let shaped: Vec<Vec<Vec<f64>>> = (0..noise.stride)
                .map(|phase| columns.iter().map(|own| noise.model.colour(&every(own, phase, noise.stride))).collect())
                .collect();
            let level = (2.0 / samples).sqrt();
            parts.push(products(&shaped, &shaped, 0).iter().map(|value| level * value).collect());
            parts.extend(by_colour(noise, &shaped, samples));
        }
        Self { parts }
    }

    /// Degrees of freedom of the variance of a linear function of the parameters with this gradient; infinite where it
    /// has none.
    pub fn freedom(&self, covariance: &[f64], gradient: &[f64]) -> f64 {
        let count = gradient.len();
        let form = |matrix: &[f64]| -> f64 {
            let row = |j: usize| (0..count).map(|i| gradient[i] * matrix[j * count + i]).sum::<f64>();
            (0..count).map(|j| row(j) * gradient[j]).sum()
        };
        if covariance.len() != count * count {
            return f64::INFINITY;
        }
        let variance: f64 = self.parts.iter().map(|part| form(part).powi(2)).sum();
        let freedom = 2.0 * form(covariance).powi(2) / variance;
        if freedom.is_finite() { freedom.max(1.0) } else { f64::INFINITY }
    }
}

/// One part per independent combination of a model's coefficients; `shaped`: per phase the columns as the model shapes
/// them.
fn by_colour(noise: &NoiseModel, shaped: &[Vec<Vec<f64>>], samples: f64) -> Vec<Vec<f64>> {
    let order = noise.model.order();
    // Cov(a) = R^-1 / n, R the autocovariance relative to the variance of the innovations.
    let Ok(directions) = SingularValueDecomposition::new(order, order, &relative_covariance(noise)) else {
        return Vec::new();
    };
    let again: Vec<Vec<Vec<f64>>> =
        shaped.iter().map(|phase| phase.iter().map(|own| recursed(own, &noise.model.coefficients)).collect()).collect();
    let slopes: Vec<Vec<f64>> = (1..=order).map(|lag| symmetric(&products(shaped, &again, lag))).collect();
    let part = |(k, size): (usize, &f64)| {
        let mut part = vec![0.0; slopes[0].len()];
        for (entry, slope) in directions.right(k).iter().zip(&slopes) {
            let factor = entry / (size * samples).sqrt();
            part.iter_mut().zip(slope).for_each(|(sum, value)| *sum += factor * value);
        }
        part
    };
    directions.singular_values.iter().enumerate().filter(|(_, size)| **size > 0.0).map(part).collect()
}

/// `x / A`: what follows a change of a coefficient, one step later per lag.
fn recursed(x: &[f64], coefficients: &[f64]) -> Vec<f64> {
    let mut y: Vec<f64> = Vec::with_capacity(x.len());
    for (t, value) in x.iter().enumerate() {
        let memory: f64 = coefficients.iter().enumerate().take(t).map(|(k, a)| a * y[t - 1 - k]).sum();
        y.push(value + memory);
    }
    y
}

/// p x p: scalar products of columns with those of `b` so many steps earlier, all phases together.
fn products(a: &[Vec<Vec<f64>>], b: &[Vec<Vec<f64>>], lag: usize) -> Vec<f64> {
    let count = a.first().map_or(0, Vec::len);
    let mut sum = vec![0.0; count * count];
    for (a, b) in a.iter().zip(b) {
        for j in 0..count {
            for i in 0..count {
                // Columns settle at lengths of their own; what is missing is negligible.
                let pairs = a[i].iter().skip(lag).zip(&b[j]);
                sum[j * count + i] += pairs.map(|(x, y)| x * y).sum::<f64>();
            }
        }
    }
    sum
}

/// `M + M^T`.
fn symmetric(matrix: &[f64]) -> Vec<f64> {
    let count = matrix.len().isqrt();
    (0..count * count).map(|k| matrix[k] + matrix[(k % count) * count + k / count]).collect()
}

/// Autocovariance matrix of the model's process at the lags below its order, relative to the innovations' variance.
fn relative_covariance(noise: &NoiseModel) -> Vec<f64> {
    let order = noise.model.order();
    let impulse = noise.model.colour(&[1.0]);
    let lag =
        |lag: usize| impulse.iter().skip(lag).zip(&impulse).map(|(a, b)| a * b).sum::<f64>() / noise.model.variance;
    let lags: Vec<f64> = (0..order).map(lag).collect();
    (0..order * order).map(|k| lags[(k % order).abs_diff(k / order)]).collect()
}
