//! Solution of initial value problems with sensitivities in step.
//!
//! *In*: [`Dynamics`] (a compiled model with inputs and parameters bound), start values and their sensitivities,
//! requested times. *Out*: a [`Solution`] at exactly the requested times, or a [`Failure`] as a value.
//! *Must not happen here*: knowledge of bodies, laws, measurements or data.

mod problem;

pub use problem::*;
