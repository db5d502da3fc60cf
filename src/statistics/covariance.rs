//! Covariance of the estimates and intervals (method 3.30, 4.11, 4.16).

use super::identifiability::{full_directions, scaled_gradient};
use super::matrix::{product, transposed_product};
use super::significance::student_quantile;
use crate::linear::{DecompositionError, rounding_threshold};

/// Covariance by the pseudo-inverse, always together with the directions in which the variance is infinite.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    /// p x p, symmetric, unscaled parameters; finite part only.
    pub matrix: Vec<f64>,
    /// Directions of infinite variance: orthonormal in scaled parameters, each of length p.
    pub undetermined: Vec<Vec<f64>>,
    /// Square roots of the diagonal; `None` for parameters that take part in an undetermined direction.
    pub standard_deviations: Vec<Option<f64>>,
}

/// A parameter takes part in a unit direction with more than this share.
const PARTICIPATION: f64 = 1e-3;

impl Covariance {
    /// From the weighted gradient (N x p column-major, unscaled parameters; rows of priors included, which are rows
    /// of the gradient like any other).
    ///
    /// `gamma`: Phi^T S^T S Cov(D) S^T S Phi, p x p, of the weighted noise (method 3.30); without it the weighted noise
    /// is white with variance `noise_variance`, which makes Cov = variance * (Phi^T S^T S Phi)^+.
    /// `scale`, `threshold` as for [`super::identifiability`].
    pub fn new(
        gradient: &[f64],
        scale: &[f64],
        noise_variance: f64,
        gamma: Option<&[f64]>,
        threshold: f64,
    ) -> Result<Self, DecompositionError> {
        let count = scale.len();
        let rows = gradient.len() / count.max(1);
        let (sigma, directions) = full_directions(rows, count, &scaled_gradient(gradient, scale))?;
        let limit = threshold.max(rounding_threshold(rows, count)) * sigma.first().copied().unwrap_or(0.0);
        let rank = sigma.iter().filter(|&&value| value > limit).count();
        let inverse = spectral_inverse(count, &directions, &sigma[..rank], scale);
        let matrix = match gamma {
            Some(gamma) => product(count, &product(count, &inverse, gamma), &inverse),
            None => inverse.iter().map(|value| noise_variance * value).collect(),
        };
        let undetermined: Vec<Vec<f64>> =
            (rank..count).map(|k| directions[k * count..(k + 1) * count].to_vec()).collect();
        let standard_deviations = (0..count)
            .map(|j| {
                let takes_part = undetermined.iter().any(|direction| direction[j].abs() > PARTICIPATION);
                (!takes_part).then(|| matrix[j * count + j].max(0.0).sqrt())
            })
            .collect();
        Ok(Self { matrix, undetermined, standard_deviations })
    }

    /// Correlation matrix p x p; 1 on the diagonal, 0 with every parameter that is not determined.
    pub fn correlation(&self) -> Vec<f64> {
        let count = self.standard_deviations.len();
        let mut correlation = vec![0.0; count * count];
        for j in 0..count {
            for i in 0..count {
                let deviations = (self.standard_deviations[i], self.standard_deviations[j]);
                if let (Some(a), Some(b)) = deviations
                    && a > 0.0
                    && b > 0.0
                {
                    correlation[j * count + i] = (self.matrix[j * count + i] / (a * b)).clamp(-1.0, 1.0);
                }
            }
            correlation[j * count + j] = 1.0;
        }
        correlation
    }

    /// Variance of a linear function with the gradient `r` (method 4.19); `None` where `r` is not orthogonal to an
    /// undetermined direction (4.20). `scale` as given to [`Covariance::new`].
    pub fn variance_of(&self, r: &[f64], scale: &[f64]) -> Option<f64> {
        let count = r.len();
        let scaled: Vec<f64> = r.iter().zip(scale).map(|(value, width)| value * width).collect();
        let length = super::matrix::dot(&scaled, &scaled).sqrt();
        let touches = |direction: &Vec<f64>| super::matrix::dot(direction, &scaled).abs() > PARTICIPATION * length;
        if self.undetermined.iter().any(touches) {
            return None;
        }
        let variance: f64 = (0..count)
            .flat_map(|i| (0..count).map(move |j| (i, j)))
            .map(|(i, j)| r[i] * self.matrix[j * count + i] * r[j])
            .sum();
        Some(variance.max(0.0))
    }
}

/// scale V Sigma^-2 V^T scale.
fn spectral_inverse(count: usize, directions: &[f64], sigma: &[f64], scale: &[f64]) -> Vec<f64> {
    let mut inverse = vec![0.0; count * count];
    for (k, value) in sigma.iter().enumerate() {
        let direction = &directions[k * count..(k + 1) * count];
        for j in 0..count {
            for i in 0..count {
                inverse[j * count + i] += scale[i] * direction[i] * direction[j] * scale[j] / (value * value);
            }
        }
    }
    inverse
}

/// value +- t * standard deviation, with Student's quantile of `degrees_of_freedom` (normal where they are infinite);
/// `level` e.g. 0.95.
pub fn confidence_interval(value: f64, standard_deviation: f64, degrees_of_freedom: f64, level: f64) -> (f64, f64) {
    let half_width = student_quantile(0.5 + 0.5 * level, degrees_of_freedom) * standard_deviation;
    (value - half_width, value + half_width)
}

/// Gamma of filtered white noise: sum over blocks of w^2 alpha |F^T S Phi|^2.
///
/// `gradient`: N x p, weighted and filtered, rows in `blocks` of (row count, variance of the weighted noise before the
/// filter: weight^2 * noise variance). `transposed_filter` applies F^T to a column of a block; a zero-phase filter is
/// its own transpose but for the ends. Rows after the last block (priors) count with variance one, unfiltered.
pub fn filtered_noise_gamma(
    gradient: &[f64],
    parameters: usize,
    blocks: &[(usize, f64)],
    transposed_filter: &dyn Fn(&mut [f64]),
) -> Vec<f64> {
    sum_of_blocks(gradient, parameters, blocks, &|_, column| transposed_filter(column))
}

/// Gamma of stationary coloured noise: sum over blocks of (S Phi)^T R (S Phi), R the Toeplitz matrix of the block's
/// autocovariance (of the weighted noise; lags beyond those given count as zero).
pub fn stationary_noise_gamma(gradient: &[f64], parameters: usize, blocks: &[(usize, Vec<f64>)]) -> Vec<f64> {
    let rows = gradient.len() / parameters.max(1);
    let mut gamma = vec![0.0; parameters * parameters];
    let mut first = 0;
    for (length, autocovariance) in blocks {
        let block = rows_of(gradient, rows, first, *length);
        let mut correlated = vec![0.0; block.len()];
        for (source, target) in block.chunks_exact(*length).zip(correlated.chunks_exact_mut(*length)) {
            for (i, sum) in target.iter_mut().enumerate() {
                let reach = autocovariance.len() - 1;
                let (from, to) = (i.saturating_sub(reach), (i + reach).min(length - 1));
                *sum = (from..=to).map(|k| autocovariance[i.abs_diff(k)] * source[k]).sum();
            }
        }
        add(&mut gamma, &transposed_product(*length, &block, &correlated), 1.0);
        first += length;
    }
    let rest = rows_of(gradient, rows, first, rows - first);
    add(&mut gamma, &transposed_product(rows - first, &rest, &rest), 1.0);
    gamma
}

fn sum_of_blocks(
    gradient: &[f64],
    parameters: usize,
    blocks: &[(usize, f64)],
    transform: &dyn Fn(usize, &mut [f64]),
) -> Vec<f64> {
    let rows = gradient.len() / parameters.max(1);
    let mut gamma = vec![0.0; parameters * parameters];
    let mut first = 0;
    for (index, (length, variance)) in blocks.iter().enumerate() {
        let mut block = rows_of(gradient, rows, first, *length);
        block.chunks_exact_mut((*length).max(1)).for_each(|column| transform(index, column));
        add(&mut gamma, &transposed_product(*length, &block, &block), *variance);
        first += length;
    }
    let rest = rows_of(gradient, rows, first, rows - first);
    add(&mut gamma, &transposed_product(rows - first, &rest, &rest), 1.0);
    gamma
}

fn rows_of(gradient: &[f64], rows: usize, first: usize, length: usize) -> Vec<f64> {
    gradient.chunks_exact(rows.max(1)).flat_map(|column| column[first..first + length].iter().copied()).collect()
}

fn add(sum: &mut [f64], matrix: &[f64], factor: f64) {
    sum.iter_mut().zip(matrix).for_each(|(value, entry)| *value += factor * entry);
}
