//! What both methods have in common.

use super::augmented::Augmented;
use super::problem::{Failure, FailureCause, Options, Work};

/// A step smaller than this share of the time cannot be resolved.
const SMALLEST_STEP: f64 = 16.0 * f64::EPSILON;
/// Near time zero the time counts as this share of the end: first steps of stiff systems can be that short.
const TIME_AT_ZERO: f64 = 1e-25;
/// The last step before a forced time is stretched by up to this factor rather than leaving a sliver.
const STRETCH: f64 = 1.01;

/// Why a method gave up, and where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refusal {
    pub time: f64,
    pub cause: FailureCause,
    pub component: Option<usize>,
    pub equation: Option<usize>,
}

impl Refusal {
    pub fn new(time: f64, cause: FailureCause) -> Self {
        Self { time, cause, component: None, equation: None }
    }

    pub fn blaming(self, component: Option<usize>) -> Self {
        Self { component, ..self }
    }

    pub fn with_work(self, state: Vec<f64>, work: Work) -> Failure {
        let equations = self.equation.into_iter().collect();
        let (time, cause, component) = (self.time, self.cause, self.component);
        Failure { time, cause, component, equations, state, work: Box::new(work) }
    }
}

/// Limits of the steps of one run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub maximum_steps: usize,
    pub maximum_step: f64,
    pub initial_step: Option<f64>,
}

impl Limits {
    pub fn new(options: &Options) -> Self {
        Self {
            maximum_steps: options.maximum_steps,
            maximum_step: options.maximum_step.unwrap_or(f64::INFINITY),
            initial_step: options.initial_step,
        }
    }

    /// The step to take from `t` so as not to pass `end`: (step, whether it reaches the end).
    pub fn fit(&self, step: f64, t: f64, end: f64) -> (f64, bool) {
        let step = step.min(self.maximum_step);
        if t + STRETCH * step >= end { (end - t, true) } else { (step, false) }
    }

    /// Refuses further attempts once the budget is used up or the step has shrunk to rounding level.
    pub fn check(
        &self,
        system: &Augmented,
        t: f64,
        step: f64,
        end: f64,
        trouble: (FailureCause, Option<usize>),
    ) -> Result<(), Refusal> {
        let work = &system.work;
        if work.steps + work.rejected_error + work.rejected_newton >= self.maximum_steps {
            return Err(Refusal::new(t, FailureCause::TooManySteps).blaming(trouble.1));
        }
        let too_small = step <= SMALLEST_STEP * t.abs().max(TIME_AT_ZERO * end.abs()) && t + step < end;
        if !step.is_finite() || too_small {
            return Err(Refusal::new(t, trouble.0).blaming(trouble.1));
        }
        Ok(())
    }
}

/// First component that is not a finite number.
pub(super) fn first_not_finite(values: &[f64]) -> Option<usize> {
    values.iter().position(|v| !v.is_finite())
}
