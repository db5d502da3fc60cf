//! Prior knowledge as further residual rows (method 3.16, 3.35).

use super::{EvaluationFailure, LeastSquares};

/// One row `sum_j weight_j theta_j - target`: a normal prior of one parameter, or a row of what an
/// independent result knows.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorRow {
    /// (index of the parameter, weight)
    pub weights: Vec<(usize, f64)>,
    pub target: f64,
    /// Taken from the linearisation of another result, whose undetermined directions turn with the parameters.
    pub linearised: bool,
    /// Of the row's error: 1, or more where the row is scaled up beside data that count more than they know.
    pub variance: f64,
}

impl PriorRow {
    /// A normal prior of parameter `index`.
    pub fn gaussian(index: usize, mean: f64, standard_deviation: f64) -> Self {
        Self {
            weights: vec![(index, 1.0 / standard_deviation)],
            target: mean / standard_deviation,
            linearised: false,
            variance: 1.0,
        }
    }

    /// The same knowledge as a row whose error has this variance.
    pub fn with_variance(&self, variance: f64) -> Self {
        let factor = (variance / self.variance).sqrt();
        let weights = self.weights.iter().map(|&(j, weight)| (j, factor * weight)).collect();
        Self { weights, target: factor * self.target, linearised: self.linearised, variance }
    }

    pub fn residual(&self, theta: &[f64]) -> f64 {
        self.weights.iter().map(|&(j, weight)| weight * theta[j]).sum::<f64>() - self.target
    }

    /// Derivative by parameter `index`.
    pub fn slope(&self, index: usize) -> f64 {
        self.weights.iter().filter(|(j, _)| *j == index).map(|(_, weight)| weight).sum()
    }
}

/// A problem with the rows of prior knowledge after its own.
///
/// The problem's residuals must then be weighted by noise standard deviations, or the two costs are not comparable.
#[derive(Clone, Debug)]
pub struct WithPriors<'a, P> {
    pub problem: P,
    pub rows: &'a [PriorRow],
}

impl<P: LeastSquares> LeastSquares for WithPriors<'_, P> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let mut residual = self.problem.residual(theta)?;
        residual.extend(self.rows.iter().map(|row| row.residual(theta)));
        Ok(residual)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let (mut residual, gradient) = self.problem.residual_and_gradient(theta)?;
        let rows = residual.len();
        residual.extend(self.rows.iter().map(|row| row.residual(theta)));
        let mut extended = Vec::with_capacity(residual.len() * theta.len());
        for j in 0..theta.len() {
            extended.extend_from_slice(&gradient[j * rows..(j + 1) * rows]);
            extended.extend(self.rows.iter().map(|row| row.slope(j)));
        }
        Ok((residual, extended))
    }
}
