//! Prior knowledge as further residual rows (method 3.16).

use super::{EvaluationFailure, LeastSquares};

/// Normal prior of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianPrior {
    /// Index of the parameter.
    pub parameter: usize,
    pub mean: f64,
    pub standard_deviation: f64,
}

/// A problem with one further row `(theta_j - mean) / standard_deviation` per prior, after the problem's own rows.
///
/// The problem's residuals must then be weighted by noise standard deviations, or the two costs are not comparable.
#[derive(Debug)]
pub struct WithPriors<'a, P> {
    pub problem: &'a mut P,
    pub priors: &'a [GaussianPrior],
}

impl<P: LeastSquares> WithPriors<'_, P> {
    fn append_rows(&self, theta: &[f64], residual: &mut Vec<f64>) {
        residual
            .extend(self.priors.iter().map(|prior| (theta[prior.parameter] - prior.mean) / prior.standard_deviation));
    }
}

impl<P: LeastSquares> LeastSquares for WithPriors<'_, P> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let mut residual = self.problem.residual(theta)?;
        self.append_rows(theta, &mut residual);
        Ok(residual)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let (mut residual, gradient) = self.problem.residual_and_gradient(theta)?;
        let rows = residual.len();
        self.append_rows(theta, &mut residual);
        let mut extended = Vec::with_capacity(residual.len() * theta.len());
        for j in 0..theta.len() {
            extended.extend_from_slice(&gradient[j * rows..(j + 1) * rows]);
            extended.extend(
                self.priors.iter().map(|prior| if prior.parameter == j { 1.0 / prior.standard_deviation } else { 0.0 }),
            );
        }
        Ok((residual, extended))
    }
}
