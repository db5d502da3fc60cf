//! The optimiser of one's choice with the same result as Levenberg-Marquardt's.

use super::alternatives::{Optimiser, observed_search};
use super::constrained::{Constraints, Region, constrained};
use super::problem::{BoundState, Control, Estimate, FitError, LeastSquares, Progress, StopReason};

/// What is to search, and how far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    pub optimiser: Optimiser,
    /// Evaluations that an alternative to Levenberg-Marquardt may take; a gradient counts as one per parameter.
    pub budget: usize,
    /// Of the optimisers that draw.
    pub seed: u64,
}

impl Default for Chosen {
    fn default() -> Self {
        Self { optimiser: Optimiser::LevenbergMarquardt, budget: 2000, seed: 1 }
    }
}

/// Minimises with the chosen optimiser. Constraints hold with Levenberg-Marquardt; the alternatives know bounds only,
/// and points that violate a constraint fail for them.
///
/// # Errors
/// As [`super::levenberg_marquardt`]; for an alternative also where the best point it found has no gradient.
pub fn minimise<P: LeastSquares, C: Constraints>(
    chosen: Chosen,
    problem: &mut P,
    start: &[f64],
    region: &Region<C>,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Estimate, FitError> {
    if chosen.optimiser == Optimiser::LevenbergMarquardt {
        return constrained(problem, start, region, observer);
    }
    let Region { constraints, bounds, .. } = *region;
    let mut admitted = Admitted { problem, constraints };
    let found = observed_search(chosen, &mut admitted, start, bounds, observer);
    let (residual, gradient) = admitted.problem.residual_and_gradient(&found.theta).map_err(FitError::StartFails)?;
    let cost = residual.iter().map(|value| value * value).sum();
    let state = |j: usize| match found.theta[j] {
        value if value <= bounds.lower[j] => BoundState::AtLower,
        value if value >= bounds.upper[j] => BoundState::AtUpper,
        _ => BoundState::Interior,
    };
    Ok(Estimate {
        bound_states: (0..start.len()).map(state).collect(),
        theta: found.theta.clone(),
        cost,
        residual,
        gradient,
        cost_history: found.history.iter().map(|(_, cost)| *cost).collect(),
        stop_reason: match (found.stopped, found.converged) {
            (true, _) => StopReason::Interrupted,
            (false, true) => StopReason::CostConverged,
            (false, false) => StopReason::EvaluationLimit,
        },
        iterations: found.history.len(),
        residual_evaluations: found.work,
        gradient_evaluations: 1,
        failed_evaluations: 0,
        last_failure: None,
    })
}

/// Points that violate a constraint cannot be evaluated.
struct Admitted<'a, P, C> {
    problem: &'a mut P,
    constraints: &'a C,
}

impl<P, C: Constraints> Admitted<'_, P, C> {
    fn check(&self, theta: &[f64]) -> Result<(), super::EvaluationFailure> {
        let violated = self.constraints.evaluate(theta).0.iter().any(|value| *value > 0.0);
        if violated {
            return Err(super::EvaluationFailure {
                explanation: "a constraint between parameters does not hold".into(),
            });
        }
        Ok(())
    }
}

impl<P: LeastSquares, C: Constraints> LeastSquares for Admitted<'_, P, C> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, super::EvaluationFailure> {
        self.check(theta)?;
        self.problem.residual(theta)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), super::EvaluationFailure> {
        self.check(theta)?;
        self.problem.residual_and_gradient(theta)
    }
}
