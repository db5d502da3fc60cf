//! What counts as error between model and measurement, beside the output error of a free simulation.
//!
//! | definition | noise | simulation |
//! | --- | --- | --- |
//! | output error | in the measurements | free, from the experiment's start |
//! | equation error | none in the regressors | none: measured states in the equations of motion, one linear step |
//! | filter error | in the process too | a state estimator that follows the measurements (extended Kalman filter) |
//! | multiple shooting | in the measurements | free in stretches that the fit joins |

mod advice;
mod equation;
mod filter;
mod kalman;
mod process;
mod shooting;

pub use advice::{ErrorReport, OtherError, error_report};
pub use equation::{EquationFit, equation_error};
pub(super) use filter::{filter_error, frozen_filter};
pub(super) use shooting::{Joined, shooting};
