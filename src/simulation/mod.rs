//! Runs an experiment: start values, integration, measured channels and their gradient.
//!
//! *In*: a compiled model, a prepared [`Record`], parameter values. *Out*: a [`Trajectory`] at the record's compared
//! samples, or a [`Failure`] in the study's words. *Must not happen here*: comparison with the measurement, decisions
//! about parameters.

mod branching;
mod cautions;
mod certificate;
mod delay;
mod failure;
mod inputs;
mod involved;
mod manoeuvre;
mod prepare;
mod run;
mod singular_joint;
mod slowness;
mod stretch;
mod tangent;

pub use branching::Branching;
pub use cautions::{cautions, cautions_about, needs_caution};
pub use certificate::certify;
pub use failure::{Detail, Failure};
pub use inputs::RecordInputs;
pub use manoeuvre::{excitation, manoeuvre};
pub use prepare::{Record, prepare};
pub use run::{Compiled, Gradient, Moved, Trajectory, probe, simulate, slowness};
pub use slowness::{Limit, Slowness};
pub use stretch::{Observation, State, Stretch, Stretches, stretches_refused};
