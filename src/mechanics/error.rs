//! What can be wrong with a study's mechanics.

use crate::diagnostics::Span;

/// A mechanical fault of a study: what, where, and the likely fix.
#[derive(Clone, Debug, PartialEq)]
pub struct MechanicsError {
    /// Of the catalogue, `E03xx`.
    pub code: &'static str,
    pub message: String,
    /// Places in the study, the one to blame first, each with what is to say about it.
    pub labels: Vec<(Span, String)>,
    pub help: String,
}

pub(super) const UNCONNECTED_BODY: &str = "E0301";
pub(super) const CLOSED_LOOP: &str = "E0302";
pub(super) const NO_INERTIA: &str = "E0303";
pub(super) const COINCIDENT_POINTS: &str = "E0304";
pub(super) const ACCELERATION_IN_LOAD: &str = "E0305";
pub(super) const UNKNOWN_START: &str = "E0306";
pub(super) const UNKNOWN_SYMBOL: &str = "E0307";
pub(super) const FORCE_ON_FIXED_JOINT: &str = "E0308";
