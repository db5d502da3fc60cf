//! A failed simulation as a value.

use super::slowness::Slowness;
use std::fmt;

/// Why a record could not be simulated with these parameters, in the study's words.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// Experiment or manoeuvre, with its kind: [`super::Record::title`].
    pub record: String,
    /// s
    pub time: f64,
    /// One clause, e.g. `the step size shrank to rounding level`.
    pub cause: String,
    /// State to blame, e.g. `slide.velocity`.
    pub component: Option<String>,
    pub detail: Box<Detail>,
    pub help: String,
}

/// More about a failure.
#[derive(Clone, Debug, PartialEq)]
pub struct Detail {
    /// Equations that contradict or repeat each other.
    pub equations: Vec<String>,
    /// What the run had cost until then, and who limited its steps.
    pub slowness: Slowness,
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {} at t = {:.6} s", self.record, self.cause, self.time)?;
        if let Some(component) = &self.component {
            write!(formatter, ", limited by {component}")?;
        }
        if !self.detail.equations.is_empty() {
            write!(formatter, ": {}", self.detail.equations.join(", "))?;
        }
        if let Some(foremost) = self.detail.slowness.foremost() {
            write!(formatter, " (after {} steps; steps limited by {foremost})", self.detail.slowness.steps)?;
        }
        Ok(())
    }
}

impl Failure {
    /// From the integrator's failure, with component names put in.
    pub fn from_integration(
        record: &str,
        failure: &crate::integrate::Failure,
        name: impl Fn(usize) -> String,
        equation: impl Fn(usize) -> String,
    ) -> Self {
        use crate::integrate::FailureCause as Cause;
        let (cause, help) = match failure.cause {
            Cause::StepTooSmall => (
                "the step size shrank to rounding level",
                "look for a law that jumps, or a parameter start value far from reality; a larger creep or knee makes a law smoother",
            ),
            Cause::NoConvergence => (
                "the equations of a step could not be solved",
                "look for a law that jumps or has a vertical slope; a larger creep or knee makes a law smoother",
            ),
            Cause::InvalidRequest => {
                ("the simulation was asked for impossible times", "check the record's time column")
            }
            Cause::TooManySteps => (
                "the number of steps exceeded its limit",
                "the model is much faster than the record; check stiffnesses and masses, or loosen `solver { tolerance = .. }`",
            ),
            Cause::Chattering => (
                "a law switches without end",
                "it switches to and fro at one instant or ever faster; make it smooth, or give it a hysteresis",
            ),
            Cause::NotFinite => (
                "the solution became infinite or not a number",
                "the model is unstable with these parameters (wrong sign, missing damping, division by zero), or a table ends in `error` there; narrow the bounds",
            ),
            Cause::SingularMatrix if failure.component.is_some_and(|i| name(i).contains(".reaction")) => (
                "the equations are singular",
                "the loops branch here, or hold by a constraint that was left out as redundant at the start: give a joint of the loop more freedom (`universal`, `spherical`)",
            ),
            Cause::SingularMatrix => {
                ("the equations are singular", "a mass, inertia or law leaves this state undetermined")
            }
            Cause::InconsistentStart => {
                ("no consistent start values exist", "the start values contradict each other; give fewer of them")
            }
            Cause::RedundantConstraints => (
                "constraints repeat each other, so that the forces in them are not determined",
                "this is a position in which the loop could go on in two ways, such as a parallelogram stretched out flat: start \
                 beside it, `start = rest { crank.position = 10 deg }`, or let a coupling decide, `coupling same: \
                 crank_1.position = crank_2.position`",
            ),
            Cause::NoEquilibrium => (
                "no equilibrium was found",
                "something can move without restoring force, a load beyond its limit cannot balance what it carries, or the start \
                 states too much: use `start = rest { .. }` with values, or state less",
            ),
        };
        Self {
            record: record.to_owned(),
            time: failure.time,
            cause: cause.to_owned(),
            component: failure.component.map(&name),
            detail: Box::new(Detail {
                equations: failure.equations.iter().map(|&i| equation(i)).collect(),
                slowness: Slowness::new(&failure.work, name),
            }),
            help: help.to_owned(),
        }
    }
}
