//! Where the named causes leave something: does a force of free shape over the motion of one place explain more?
//!
//! Effects whose amplitudes are `unnamed` are points of such a shape. They are tried last, since a flexible curve fits
//! a bit better than almost any law: alone against the chain of named causes (does one curve explain more than all of
//! them together?), then behind it.

use super::candidates::{self, Candidate};
use super::course::Course;
use super::judge::{self, HeldOut, Judged};
use super::records::Roles;
use super::round::Round;
use super::screen::{self, Screened};
use super::{Event, FULL_ITERATIONS, Model, Observer, adopt, refit, typical};
use crate::diagnostics::Diagnostic;
use crate::identify::{Fitted, predicted_shares};
use crate::signal::effective_count;
use crate::simulation::Record;
use crate::statistics::ErrorChange;
use rayon::prelude::*;

/// A residual with fewer independent samples than this share is not noise alone.
const NOISE_SHARE: f64 = 0.9;
/// Where a channel's residual predicts more than this share of its own power something is wrong, whatever the
/// candidates say.
const UNEXPLAINED: f64 = 0.3;
/// Share of the held-out error of the named causes by which a curve must do better than they.
const LEAST_GAIN: f64 = 0.5;
/// Share of the held-out error that a curve must take: so many points follow the shadow of something else a little way.
const LEAST_SHARE: f64 = 0.25;
/// Curves at two places that explain the same but for this share of it are as good.
const SAME_GAIN: f64 = 0.99;
/// A search that was asked to end before so many causes may not have come to what it would name.
const CHAIN: usize = 3;
/// Curves refitted after the screen, and in how many iterations: beside a misfit that other parameters have bent to,
/// the screen's linear estimate says little about a curve. The best of these are fitted to the end.
const REFITTED: usize = 12;
const ITERATIONS: usize = 6;
const FULL_REFITS: usize = 2;

/// The model extended by a curve, in place of the chain of named causes or behind it; `None` where none is needed or
/// none helps.
pub(super) fn unnamed(
    first: &Model,
    last: &Model,
    roles: &Roles,
    course: &mut Course,
    observer: Observer,
) -> Result<Option<Model>, Vec<Diagnostic>> {
    let is_cut_short = course.limit_reached && course.accepted() < CHAIN;
    if course.below_visibility || is_cut_short || !coloured(&last.fitted) && course.crowded().is_none() {
        return Ok(None);
    }
    let is_extended = course.accepted() > 0;
    let alone = trial(first, roles, course, observer, is_extended.then_some(last))?;
    if alone.is_some() || !is_extended || course.limit_reached {
        return Ok(alone);
    }
    trial(last, roles, course, observer, None)
}

/// Whether some channel's residual is more than white noise.
fn coloured(fitted: &Fitted) -> bool {
    fitted.blocks.iter().any(|block| {
        let residual = &fitted.residual[block.rows.clone()];
        effective_count(residual) < NOISE_SHARE * residual.len() as f64
    })
}

/// Whether some channel's residual is certainly not white noise, where the study promises that the noise is.
pub(super) fn unexplained(model: &Model) -> bool {
    !model.compiled.study.solver.coloured_noise
        && predicted_shares(&model.fitted).into_iter().any(|share| share > UNEXPLAINED)
}

/// Curves at all places on `model`; the best one where it is accepted and beats `rival`.
fn trial(
    model: &Model,
    roles: &Roles,
    course: &mut Course,
    observer: Observer,
    rival: Option<&Model>,
) -> Result<Option<Model>, Vec<Diagnostic>> {
    let records = roles.estimation();
    let round = Round::new(&model.loaded, &model.variant, &model.compiled, &records, &model.fitted);
    let mut candidates =
        candidates::unnamed(&model.compiled.study, &typical::typical(&model.compiled, &records, &model.fitted.theta));
    let mut screened = super::screen_all(&round, &candidates, observer);
    course.simulations += screened.iter().flatten().map(|entry| entry.simulations).sum::<usize>();
    screen::merge_equal(&mut candidates, &mut screened, round.current_deviance());
    let refits = refitted(&round, &candidates, &screened, observer);
    let validation = roles.validation();
    let held_out = HeldOut::new(&model.compiled, &model.fitted, &validation);
    let judged = judge::judge(&round, &candidates, refits, held_out.as_ref());
    course.simulations += judged.iter().map(|entry| entry.refitted.fitted.simulations).sum::<usize>();
    let chosen = judged.iter().position(Judged::accepted).filter(|position| {
        let index = judged[*position].refitted.candidate;
        let is_patchwork =
            course.crowded().is_some_and(|place| serves_at(&place, index, &candidates, &screened, &round));
        let wins = |rival: &Model| beats(&judged[*position], rival, &validation, is_patchwork);
        let shows = judged[*position].held_out_change.is_none_or(|change| change <= -LEAST_SHARE);
        shows && !judge::below_visibility(&round, &judged[*position]) && rival.is_none_or(wins)
    });
    let Some(position) = chosen else {
        if rival.is_none() {
            course.remarks.extend(judged.first().map(|best| refused(best, &candidates)));
        }
        return Ok(None);
    };
    let entry = &judged[position];
    let candidate = &candidates[entry.refitted.candidate];
    observer(Event::Accepted { candidate: &candidate.name });
    let (next, text) = adopt(model, candidate, &entry.refitted, &records)?;
    if rival.is_some() {
        course.withdraw(&candidate.name);
    }
    course.unnamed = rival.is_some() || course.accepted() == 0;
    course.record(&round, &candidates, &screened, &judged, Some(position));
    course.texts.push(text);
    Ok(Some(next))
}

/// Whether the screen saw the curve of a candidate explain as much at `place`: places that move alike differ by
/// rounding only.
fn serves_at(
    place: &str,
    index: usize,
    candidates: &[Candidate],
    screened: &[Option<Screened>],
    round: &Round,
) -> bool {
    let gain = |entry: &Screened| round.current_deviance() - entry.deviance;
    let own = screened[index].as_ref().map_or(f64::INFINITY, gain);
    candidates.iter().zip(screened).any(|(candidate, entry)| {
        let serves = |entry: &Screened| gain(entry) >= SAME_GAIN * own;
        candidate.place == place && candidate.effect == candidates[index].effect && entry.as_ref().is_some_and(serves)
    })
}

/// Why no curve was taken, for readers who wonder about what is left.
fn refused(best: &Judged, candidates: &[Candidate]) -> String {
    let name = &candidates[best.refitted.candidate].name;
    let otherwise = match best.held_out_change {
        Some(change) if change > -LEAST_SHARE => "it explains too little of the held-out record",
        _ => "the named causes explain more of the held-out record",
    };
    let reason = best.report.objection.as_deref().unwrap_or(otherwise);
    format!("what is left is more than white noise; a free curve was tried, too (best: {name}): {reason}")
}

fn refitted(
    round: &Round,
    candidates: &[Candidate],
    screened: &[Option<Screened>],
    observer: Observer,
) -> Vec<refit::Refitted> {
    let mut order: Vec<(usize, &Screened)> =
        screened.iter().enumerate().filter_map(|(index, entry)| Some((index, entry.as_ref()?))).collect();
    order.retain(|(_, entry)| entry.deviance.is_finite());
    order.sort_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
    order.truncate(REFITTED);
    observer(Event::Refitting { candidates: order.len() });
    let mut short: Vec<refit::Refitted> = order
        .par_iter()
        .filter_map(|&(index, entry)| {
            let refitted = refit::refit(round, index, &candidates[index], entry, None, ITERATIONS);
            observer(Event::Refitted { candidate: &candidates[index].name });
            refitted
        })
        .collect();
    short.sort_by(|a, b| a.deviance.total_cmp(&b.deviance));
    short.truncate(FULL_REFITS);
    short
        .into_par_iter()
        .filter_map(|previous| {
            let (index, entry) = (previous.candidate, screened[previous.candidate].as_ref()?);
            refit::refit(round, index, &candidates[index], entry, Some(previous), FULL_ITERATIONS)
        })
        .collect()
}

/// Whether the curve explains more than `rival` of the records that were not fitted: a chain of wrong causes follows
/// the fitted ones ever better and the others ever worse. Names tell more than a curve that does a little better. Where
/// the rival is a patchwork of causes at the curve's own place, as much is enough.
fn beats(curve: &Judged, rival: &Model, validation: &[&Record], is_patchwork: bool) -> bool {
    let own = &curve.refitted.fitted;
    let weights = &own.weighting.weights;
    match (
        HeldOut::with_weights(&rival.compiled, &rival.fitted, weights, validation),
        judge::held_out_residual(&curve.refitted.compiled, own, weights, validation),
    ) {
        (Some(before), Some(after)) => {
            let much_better = |change: &ErrorChange| change.is_improvement() && change.estimate <= -LEAST_GAIN;
            before
                .change(&after, judge::INTERVAL)
                .is_some_and(|change| much_better(&change) || is_patchwork && change.lower <= 0.0)
        }
        (before, after) => before.is_none() && after.is_some(),
    }
}
