//! Solution of initial value problems with sensitivities in step.
//!
//! *In*: [`Dynamics`] (a compiled model with inputs and parameters bound), start values and their sensitivities,
//! requested times. *Out*: a [`Solution`] at exactly the requested times, or a [`Failure`] as a value.
//! *Must not happen here*: knowledge of bodies, laws, measurements or data.

mod augmented;
mod bdf;
mod bdf_history;
mod choice;
mod consistent;
mod dormand_prince;
mod equilibrium;
mod equilibrium_sparse;
mod events;
mod iteration_matrix;
mod kinks;
mod newton;
mod norm;
mod problem;
mod recorder;
mod run;
mod runge_kutta;
mod segments;
mod start;
mod stepper;
mod structure;
mod tsitouras;

pub use equilibrium::{Equilibrium, equilibrium};
pub use problem::*;
pub use start::consistent_start;

use run::Run;
use segments::{first_clocks, segments};

/// Integrates from `start` and returns the solution at `times` (ascending, none before the start).
///
/// `breakpoints` are times at which the right-hand side may jump (steps of an input): a step ends exactly there and the
/// method starts anew. Right-hand sides are taken as continuous from the right; up to a breakpoint they are evaluated
/// just before it. At the zeros of switching functions the state is reset and the method starts anew likewise; a
/// requested time that coincides with an event gets the values before it, also where a clock ticks
/// ([`Dynamics::tick`]). Requested times do not shorten steps. Sensitivities are computed where `start.sensitivity` is
/// given, as exact derivatives of the discrete solution for the steps taken.
///
/// # Errors
///
/// A [`Failure`] with time, cause, component to blame and the work so far.
pub fn integrate(
    dynamics: &mut dyn Dynamics,
    start: &Start,
    times: &[f64],
    breakpoints: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    check(dynamics, start, times, options)?;
    if dynamics.dimension() == 0 {
        return Ok(without_states(times, options));
    }
    let mut run = Run::new(dynamics, start, times, options);
    if !run.is_possible() {
        return Err(invalid(start.time, None));
    }
    let mut planned = 0;
    let periods = run.system.dynamics.clock_periods().to_vec();
    let Some(segments) = segments(start.time, times, breakpoints, &periods, options.maximum_steps) else {
        return Err(Failure { cause: FailureCause::TooManySteps, ..invalid(start.time, None) });
    };
    let outcome = run
        .take_start(segments.first().map_or(start.time, |segment| segment.end))
        .and_then(|()| run.tick(&first_clocks(start.time, &periods)));
    if let Err(refusal) = outcome {
        return Err(refusal.with_work(run.state(), run.system.work));
    }
    for segment in segments {
        let (end, discontinuous) = (segment.end, segment.discontinuous);
        let outcome = match &options.follow_plan {
            Some(plan) => run.follow(plan, planned, end, discontinuous).map(|next| planned = next),
            None => run.segment(end, discontinuous),
        };
        run.release_kinks();
        if let Err(refusal) = outcome.and_then(|()| run.tick(&segment.clocks)) {
            return Err(refusal.with_work(run.state(), run.system.work));
        }
    }
    Ok(run.recorder.finish(run.system.work))
}

/// Where every motion is prescribed there is nothing to integrate.
fn without_states(times: &[f64], options: &Options) -> Solution {
    let work =
        Work { method: "none", reason: "every motion is a given function of time".to_owned(), ..Work::default() };
    Solution { times: times.to_vec(), work, plan: options.record_plan.then(Plan::default), ..Solution::default() }
}

fn check(dynamics: &dyn Dynamics, start: &Start, times: &[f64], options: &Options) -> Result<(), Failure> {
    let (n, p) = (dynamics.dimension(), dynamics.parameter_count());
    let positive = |values: &[f64]| values.iter().position(|v| !(*v > 0.0 && v.is_finite()));
    if let Some(component) = positive(dynamics.scale()) {
        return Err(invalid(start.time, Some(component)));
    }
    let lengths = start.y.len() == n
        && start.y_prime.len() == n
        && dynamics.scale().len() == n
        && dynamics.differential().len() == n
        && positive(dynamics.clock_periods()).is_none()
        && (start.sensitivity.is_empty() || start.sensitivity.len() == n * p)
        && (dynamics.parameter_scale().is_empty() || dynamics.parameter_scale().len() == p);
    let order = start.time.is_finite()
        && times.first().is_none_or(|t| *t >= start.time)
        && times.windows(2).all(|w| w[0] <= w[1])
        && times.last().is_none_or(|t| t.is_finite());
    let tolerances = positive(&[options.relative_tolerance, options.absolute_factor]).is_none()
        && options.initial_step.is_none_or(|h| h > 0.0)
        && options.maximum_step.is_none_or(|h| h > 0.0)
        && positive(dynamics.parameter_scale()).is_none();
    let can_follow = options.follow_plan.is_none() || dynamics.switch_count() == 0;
    if !(lengths && order && tolerances && can_follow) {
        return Err(invalid(start.time, None));
    }
    match start.y.iter().position(|v| !v.is_finite()) {
        Some(component) => {
            Err(Failure { cause: FailureCause::InconsistentStart, ..invalid(start.time, Some(component)) })
        }
        None => Ok(()),
    }
}

fn invalid(time: f64, component: Option<usize>) -> Failure {
    Failure {
        time,
        cause: FailureCause::InvalidRequest,
        component,
        equations: Vec::new(),
        state: Vec::new(),
        work: Box::default(),
    }
}
