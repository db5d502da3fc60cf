//! Combination of independent results for the same parameters (method 3.17, 3.35).

use super::matrix::{pseudo_inverse, pseudo_inverse_of_rank};
use crate::linear::DecompositionError;

/// A result as its parameters and their information (inverse covariance), which is zero in directions that the data did
/// not determine.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// Length p.
    pub theta: Vec<f64>,
    /// p x p, symmetric, unscaled parameters.
    pub matrix: Vec<f64>,
}

/// The combined result.
#[derive(Clone, Debug, PartialEq)]
pub struct Combined {
    pub theta: Vec<f64>,
    /// Finite part of the covariance, p x p.
    pub covariance: Vec<f64>,
    /// Sum of the two informations.
    pub information: Vec<f64>,
    /// Directions that neither result determines: orthonormal in scaled parameters.
    pub undetermined: Vec<Vec<f64>>,
}

impl Information {
    /// From the weighted gradient (N x p column-major) and the variance of the weighted noise.
    pub fn from_gradient(theta: &[f64], gradient: &[f64], noise_variance: f64) -> Self {
        let rows = gradient.len() / theta.len().max(1);
        let gram = super::matrix::transposed_product(rows, gradient, gradient);
        Self { theta: theta.to_vec(), matrix: gram.iter().map(|value| value / noise_variance).collect() }
    }

    /// From a covariance as another study wrote it: finite part (p x p) and undetermined directions (each of length p,
    /// in scaled parameters). `scale` as in that result.
    pub fn from_covariance(
        theta: &[f64],
        covariance: &[f64],
        undetermined: &[Vec<f64>],
        scale: &[f64],
    ) -> Result<Self, DecompositionError> {
        let count = theta.len();
        let mut scaled = covariance.to_vec();
        (0..count * count).for_each(|k| scaled[k] /= scale[k % count] * scale[k / count]);
        let rank = count.saturating_sub(undetermined.len());
        let mut matrix = pseudo_inverse_of_rank(count, &scaled, rank)?.matrix;
        (0..count * count).for_each(|k| matrix[k] /= scale[k % count] * scale[k / count]);
        Ok(Self { theta: theta.to_vec(), matrix })
    }
}

/// `C12^-1 = C1^-1 + C2^-1`, `theta12 = C12 (C1^-1 theta1 + C2^-1 theta2)`; in directions that neither determines the
/// first result's parameters stay. `scale` (widths of the bounds) and `threshold` decide what is undetermined.
pub fn combine(
    first: &Information,
    second: &Information,
    scale: &[f64],
    threshold: f64,
) -> Result<Combined, DecompositionError> {
    let count = scale.len();
    let information: Vec<f64> = first.matrix.iter().zip(&second.matrix).map(|(a, b)| a + b).collect();
    let scaled: Vec<f64> =
        information.iter().enumerate().map(|(k, value)| value * scale[k % count] * scale[k / count]).collect();
    // Eigenvalues of the information are squares of singular values of the gradient.
    let inverse = pseudo_inverse(count, &scaled, threshold * threshold)?;
    let (mut covariance, undetermined) = (inverse.matrix, inverse.null);
    covariance.iter_mut().enumerate().for_each(|(k, value)| *value *= scale[k % count] * scale[k / count]);
    let difference: Vec<f64> = second.theta.iter().zip(&first.theta).map(|(b, a)| b - a).collect();
    let apply = |matrix: &[f64], vector: &[f64]| -> Vec<f64> {
        (0..count).map(|i| (0..count).map(|j| matrix[j * count + i] * vector[j]).sum()).collect()
    };
    let step = apply(&covariance, &apply(&second.matrix, &difference));
    let theta = first.theta.iter().zip(&step).map(|(value, change)| value + change).collect();
    Ok(Combined { theta, covariance, information, undetermined })
}
