//! Inequality constraints between parameters by an augmented Lagrangian (Hestenes-1969, Powell-1969).

use super::levenberg_marquardt::levenberg_marquardt;
use super::problem::{
    Bounds, Control, Estimate, EvaluationFailure, FitError, LeastSquares, Options, Progress, StopReason,
};

/// Constraints `c(theta) <= 0`.
pub trait Constraints {
    /// Values, and gradient dc/dtheta per constraint.
    fn evaluate(&self, theta: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>);
}

/// Where a minimum is sought, and how far.
pub struct Region<'a, C> {
    pub constraints: &'a C,
    pub bounds: &'a Bounds,
    pub options: &'a Options,
}

/// Largest violation that counts as none, in units of the constraint's change over the bounds.
const TOLERANCE: f64 = 1e-8;
const OUTER_ITERATIONS: usize = 20;
/// First penalty relative to the curvature of the cost, both per parameter scaled by its bounds.
const FIRST_PENALTY: f64 = 10.0;
/// The penalty grows by this factor where the violation does not fall to a quarter.
const GROWTH: f64 = 10.0;

/// As [`levenberg_marquardt`], subject to constraints. Where the minimum without them satisfies them, that is the
/// answer. The rows of the result are those of the problem.
///
/// # Errors
/// As [`levenberg_marquardt`].
pub fn constrained<P: LeastSquares, C: Constraints>(
    problem: &mut P,
    start: &[f64],
    region: &Region<C>,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Estimate, FitError> {
    let Region { constraints, bounds, options } = *region;
    let mut estimate = levenberg_marquardt(problem, start, bounds, options, observer)?;
    let (values, gradients) = constraints.evaluate(&estimate.theta);
    let scales: Vec<f64> = gradients.iter().map(|gradient| change_over_bounds(gradient, bounds)).collect();
    let violation = |values: &[f64]| values.iter().zip(&scales).map(|(c, scale)| c / scale).fold(0.0, f64::max);
    let mut before = violation(&values);
    let mut multipliers = vec![0.0; values.len()];
    let mut penalty = FIRST_PENALTY * curvature(&estimate, bounds);
    for _ in 0..OUTER_ITERATIONS {
        if before <= TOLERANCE || estimate.stop_reason == StopReason::Interrupted {
            break;
        }
        let mut penalised =
            Penalised { problem: &mut *problem, constraints, scales: &scales, multipliers: &multipliers, penalty };
        let next = levenberg_marquardt(&mut penalised, &estimate.theta, bounds, options, observer)?;
        estimate = merged(estimate, next, values.len());
        let (values, _) = constraints.evaluate(&estimate.theta);
        for (multiplier, (value, scale)) in multipliers.iter_mut().zip(values.iter().zip(&scales)) {
            *multiplier = (*multiplier + penalty * value / scale).max(0.0);
        }
        let after = violation(&values);
        if after > 0.25 * before {
            penalty *= GROWTH;
        }
        before = after;
    }
    Ok(estimate)
}

/// Mean squared length of the gradient's columns, scaled by the bounds; 1 where nothing has influence.
fn curvature(estimate: &Estimate, bounds: &Bounds) -> f64 {
    let rows = estimate.residual.len().max(1);
    let squares = estimate
        .gradient
        .chunks_exact(rows)
        .enumerate()
        .map(|(j, column)| column.iter().map(|value| (value * bounds.scale(j)).powi(2)).sum::<f64>());
    let mean = squares.sum::<f64>() / bounds.len().max(1) as f64;
    if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
}

/// |dc/dtheta scaled by the bounds|.
fn change_over_bounds(gradient: &[f64], bounds: &Bounds) -> f64 {
    let length = gradient.iter().enumerate().map(|(j, slope)| (slope * bounds.scale(j)).powi(2)).sum::<f64>().sqrt();
    if length > 0.0 { length } else { 1.0 }
}

/// The later estimate with the work of both, and without its last `extra` rows.
fn merged(earlier: Estimate, mut later: Estimate, extra: usize) -> Estimate {
    let all = later.residual.len();
    let rows = all - extra;
    later.gradient = later.gradient.chunks_exact(all.max(1)).flat_map(|column| &column[..rows]).copied().collect();
    later.residual.truncate(rows);
    later.cost = later.residual.iter().map(|value| value * value).sum();
    later.iterations += earlier.iterations;
    later.residual_evaluations += earlier.residual_evaluations;
    later.gradient_evaluations += earlier.gradient_evaluations;
    later.failed_evaluations += earlier.failed_evaluations;
    later.cost_history = earlier.cost_history.into_iter().chain(later.cost_history).collect();
    later
}

/// One further row `sqrt(penalty) max(0, c + multiplier / penalty)` per constraint.
struct Penalised<'a, P, C> {
    problem: &'a mut P,
    constraints: &'a C,
    scales: &'a [f64],
    multipliers: &'a [f64],
    penalty: f64,
}

impl<P: LeastSquares, C: Constraints> Penalised<'_, P, C> {
    fn rows(&self, theta: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (values, gradients) = self.constraints.evaluate(theta);
        let root = self.penalty.sqrt();
        let shifted = |k: usize, value: f64| value / self.scales[k] + self.multipliers[k] / self.penalty;
        let residuals = values.iter().enumerate().map(|(k, value)| root * shifted(k, *value).max(0.0)).collect();
        let slopes = gradients.iter().enumerate().map(|(k, gradient)| {
            let factor = if shifted(k, values[k]) > 0.0 { root / self.scales[k] } else { 0.0 };
            gradient.iter().map(|slope| factor * slope).collect()
        });
        (residuals, slopes.collect())
    }
}

impl<P: LeastSquares, C: Constraints> LeastSquares for Penalised<'_, P, C> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let mut residual = self.problem.residual(theta)?;
        residual.extend(self.rows(theta).0);
        Ok(residual)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let (mut residual, gradient) = self.problem.residual_and_gradient(theta)?;
        let rows = residual.len();
        let (extra, slopes) = self.rows(theta);
        residual.extend(extra);
        let extended = (0..theta.len())
            .flat_map(|j| {
                let own = gradient[j * rows..(j + 1) * rows].iter().copied();
                own.chain(slopes.iter().map(move |slope| slope[j])).collect::<Vec<f64>>()
            })
            .collect();
        Ok((residual, extended))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Rosenbrock;

    impl LeastSquares for Rosenbrock {
        fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
            Ok(vec![10.0 * (theta[1] - theta[0] * theta[0]), 1.0 - theta[0]])
        }

        fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
            Ok((self.residual(theta)?, vec![-20.0 * theta[0], -1.0, 10.0, 0.0]))
        }
    }

    /// theta_0 + theta_1 <= limit
    struct SumBelow(f64);

    impl Constraints for SumBelow {
        fn evaluate(&self, theta: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
            (vec![theta[0] + theta[1] - self.0], vec![vec![1.0, 1.0]])
        }
    }

    fn minimum(limit: f64) -> Estimate {
        let bounds = Bounds::new(vec![-3.0; 2], vec![3.0; 2]);
        let observer = &mut |_: &Progress| Control::Continue;
        let region = Region { constraints: &SumBelow(limit), bounds: &bounds, options: &Options::default() };
        constrained(&mut Rosenbrock, &[-1.2, 1.0], &region, observer).unwrap()
    }

    /// The minimum on the line theta_0 + theta_1 = 1, found by a fine search along it.
    #[test]
    fn an_active_constraint_holds_and_the_cost_is_minimal_on_it() {
        let estimate = minimum(1.0);
        let on_line = |x: f64| (10.0 * (1.0 - x - x * x)).powi(2) + (1.0 - x).powi(2);
        let smallest = (0..600_000).map(|k| on_line(-3.0 + 1e-5 * f64::from(k))).fold(f64::INFINITY, f64::min);
        assert!(estimate.theta[0] + estimate.theta[1] <= 1.0 + 1e-7, "{:?}", estimate.theta);
        assert!((estimate.cost - smallest).abs() < 1e-5 * smallest, "{} {smallest}", estimate.cost);
        assert_eq!((estimate.residual.len(), estimate.gradient.len()), (2, 4));
    }

    #[test]
    fn an_inactive_constraint_changes_nothing() {
        let estimate = minimum(2.5);
        assert!((estimate.theta[0] - 1.0).abs() < 1e-6 && (estimate.theta[1] - 1.0).abs() < 1e-6);
    }
}
