//! Refit of promising candidates with all parameters free.

use super::candidates::Candidate;
use super::round::Round;
use super::screen::Screened;
use crate::fit::Control;
use crate::identify::{Fitted, Settings, fit};
use crate::simulation::Compiled;

/// A candidate after its refit.
pub(super) struct Refitted {
    /// Index into the round's list of candidates.
    pub candidate: usize,
    pub compiled: Compiled,
    pub fitted: Fitted,
    pub deviance: f64,
}

/// Fits the extended model from the screen's best point (or from where an earlier, shorter refit ended).
pub(super) fn refit(
    round: &Round,
    index: usize,
    candidate: &Candidate,
    screened: &Screened,
    previous: Option<Refitted>,
    maximum_iterations: usize,
) -> Option<Refitted> {
    let (compiled, start) = match previous {
        Some(previous) => (previous.compiled, previous.fitted.theta),
        None => {
            let compiled = round.compile(candidate, &screened.values, false)?;
            let start = round.start(&compiled, candidate, &screened.values);
            (compiled, start)
        }
    };
    let settings = Settings {
        start: Some(start),
        weights: Some(round.fitted.weighting.clone()),
        maximum_iterations: Some(maximum_iterations),
        ..Settings::default()
    };
    let fitted = fit(&compiled, round.records, &settings, &mut |_| Control::Continue).ok()?;
    let deviance = round.deviance(&fitted.residual);
    Some(Refitted { candidate: index, compiled, fitted, deviance })
}
