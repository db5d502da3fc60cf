//! Shows what the simulation gets wrong, names the cause, extends the model and measures the gain.
//!
//! *In*: a loaded study and its records. *Out*: an [`Answer`]. *Must not happen here*: printing; any knowledge of a
//! particular effect (candidates come from the catalogue written in the language).
//!
//! The steps follow the literature on screening by scores (Breusch-Pagan-1980), choice by information criterion
//! (Schwarz-1978) and judgement on data not used to choose.

mod anatomy;
mod answer;
mod candidates;
mod course;
mod eliminate;
mod extension;
mod judge;
mod missing_force;
mod periods;
mod records;
mod refit;
mod round;
mod screen;
mod sensors;
mod telling;
mod typical;
mod unnamed;

pub use answer::*;

use crate::diagnostics::Diagnostic;
use crate::fit::Control;
use crate::identify::{Fitted, Settings, fit, identification};
use crate::simulation::{Compiled, Record};
use crate::statistics::ErrorChange;
use crate::study::{self, Loaded};
use course::Course;
use judge::{HeldOut, Judged};
use rayon::prelude::*;
use records::Roles;
use refit::Refitted;
use round::Round;

/// Candidates that get a short refit after the screen, and those of them that get a full one.
const SHORT_REFITS: usize = 16;
const FULL_REFITS: usize = 8;
/// Besides, so many get a short one whose score promises much though no finite strength kept it in the screen, where
/// fitted parameters move along to first order only; and the least score that counts as a promise.
const PROMISING_REFITS: usize = 2;
const PROMISING_SCORE: f64 = 25.0;
const SHORT_ITERATIONS: usize = 3;
const FULL_ITERATIONS: usize = 30;

/// Share of the held-out error that causes must explain to be called that, where what they leave has a colour.
const LEAST_EXPLAINED: f64 = 0.5;
/// Rounds of the search per extension that may be accepted.
const ROUNDS: usize = 2;
const TRANSFERS_NOT: &str = "improves the fit, does not transfer to the held-out record";

/// What to diagnose and how far to go.
#[derive(Clone, Debug)]
pub struct Options {
    /// Variant that is the model under suspicion; `base` for the study as it stands.
    pub variant: String,
    /// Extensions added one after the other at most.
    pub maximum_extensions: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { variant: "base".to_owned(), maximum_extensions: 4 }
    }
}

/// What is going on, for progress displays.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    Fitting { variant: &'a str },
    Fitted { variant: &'a str, discrepancy: f64 },
    Screening { candidates: usize },
    Screened { candidate: &'a str },
    Refitting { candidates: usize },
    Refitted { candidate: &'a str },
    Accepted { candidate: &'a str },
}

/// Receives events from several threads.
pub type Observer<'a> = &'a (dyn Fn(Event<'_>) + Sync);

/// One accepted model after the other, starting with the model as it stands.
struct Model {
    loaded: Loaded,
    variant: String,
    compiled: Compiled,
    fitted: Fitted,
    /// Parameters that are strengths of accepted effects, with the value at which the effect vanishes.
    strengths: Vec<(String, f64)>,
    /// What was accepted on the way here, in order.
    accepted: Vec<Accepted>,
}

/// An accepted candidate and the variant that adds it to those before.
#[derive(Clone)]
struct Accepted {
    candidate: candidates::Candidate,
    variant: String,
}

/// Diagnoses a study with its measured records.
///
/// # Errors
/// The study is wrong, or the base model cannot be fitted.
pub fn diagnose(
    loaded: &Loaded,
    records: &[Record],
    options: &Options,
    observer: Observer,
) -> Result<Answer, Vec<Diagnostic>> {
    let study = study::check(loaded, Some(&options.variant))?.study;
    let compiled = Compiled::new(study)?;
    let roles = Roles::assign(records);
    let first = first_model(loaded, &options.variant, compiled, &roles, observer)?;
    let base = identification(&first.compiled, &first.fitted, &roles.all());
    let anatomy = anatomy::anatomy(&first.compiled, &first.fitted, &roles.estimation());
    let file = loaded.sources.name(loaded.study_file()).unwrap_or_default().to_owned();
    let mut course = Course::new(file);
    let (mut named, mut model) = (Vec::new(), first);
    // A cause that was taken out must not come back and be taken out for ever.
    while course.accepted() < options.maximum_extensions && course.steps.len() < ROUNDS * options.maximum_extensions {
        let Some(next) = extend(&model, &roles, &mut course, observer)? else { break };
        named.push(std::mem::replace(&mut model, next));
        if course.accepted() > 1 {
            model = eliminate::eliminate(&named[0], model, &roles, &mut course)?;
        }
        course.limit_reached = course.accepted() == options.maximum_extensions;
    }
    if options.maximum_extensions > 0 {
        let start = named.first().unwrap_or(&model);
        if let Some(curve) = unnamed::unnamed(start, &model, &roles, &mut course, observer)? {
            named.push(std::mem::replace(&mut model, curve));
        }
    }
    course.unexplained = unnamed::unexplained(&model);
    if course.unexplained && !named.is_empty() && !course.limit_reached {
        let gain = gain(&named[0], &model, &roles);
        if gain < LEAST_EXPLAINED {
            course.dismiss(gain);
            model = named.swap_remove(0);
        }
    }
    if course.unexplained {
        course.sensors = sensors::remarks(&model.compiled, &model.fitted, &roles.estimation());
    }
    let source = missing_force::Source {
        compiled: &model.compiled,
        theta: &model.fitted.theta,
        weighting: &model.fitted.weighting,
        strengths: &model.strengths,
    };
    let missing_forces = missing_force::missing_forces(&source, &roles.estimation());
    let extended = identification(&model.compiled, &model.fitted, &roles.all());
    Ok(course.answer(&model.compiled, base, extended, anatomy, missing_forces, &roles))
}

fn first_model(
    loaded: &Loaded,
    variant: &str,
    compiled: Compiled,
    roles: &Roles,
    observer: Observer,
) -> Result<Model, Vec<Diagnostic>> {
    observer(Event::Fitting { variant });
    let fitted = fit(&compiled, &roles.estimation(), &Settings::default(), &mut |_| Control::Continue)
        .map_err(|diagnostic| vec![diagnostic])?;
    observer(Event::Fitted { variant, discrepancy: fitted.discrepancy() });
    Ok(Model {
        loaded: loaded.clone(),
        variant: variant.to_owned(),
        compiled,
        fitted,
        strengths: Vec::new(),
        accepted: Vec::new(),
    })
}

/// Share of the error that `extended` takes away from `model`: of the records that were not fitted, else of those that
/// were.
fn gain(model: &Model, extended: &Model, roles: &Roles) -> f64 {
    let change = change(model, extended, roles).map(|change| change.estimate);
    -change.unwrap_or_else(|| extended.fitted.discrepancy() / model.fitted.discrepancy() - 1.0)
}

/// What the fitted extension changes in the records that were not fitted, both under its own weights.
fn change(model: &Model, extended: &Model, roles: &Roles) -> Option<ErrorChange> {
    let (validation, weights) = (roles.validation(), &extended.fitted.weighting.weights);
    let before = HeldOut::with_weights(&model.compiled, &model.fitted, weights, &validation)?;
    let after = judge::held_out_residual(&extended.compiled, &extended.fitted, weights, &validation)?;
    before.change(&after, judge::INTERVAL)
}

/// One round: screen, refit, judge. The extended model where an extension was accepted.
fn extend(
    model: &Model,
    roles: &Roles,
    course: &mut Course,
    observer: Observer,
) -> Result<Option<Model>, Vec<Diagnostic>> {
    let records = roles.estimation();
    let round = Round::new(&model.loaded, &model.variant, &model.compiled, &records, &model.fitted);
    let mut candidates = candidates::candidates(
        &model.compiled.study,
        &typical::typical(&model.compiled, &records, &model.fitted.theta),
    );
    let mut screened = screen_all(&round, &candidates, observer);
    course.simulations += screened.iter().flatten().map(|entry| entry.simulations).sum::<usize>();
    screen::merge_equal(&mut candidates, &mut screened, round.current_deviance());
    let refits = refit_best(&round, &candidates, &screened, observer);
    let validation = roles.validation();
    let held_out = HeldOut::new(&model.compiled, &model.fitted, &validation);
    let mut judged = judge::judge(&round, &candidates, refits, held_out.as_ref());
    course.simulations += judged.iter().map(|entry| entry.refitted.fitted.simulations).sum::<usize>();
    let mut chosen = judged.iter().position(Judged::accepted);
    if chosen.is_some_and(|position| judge::below_visibility(&round, &judged[position])) {
        course.below_visibility = course.accepted() == 0;
        chosen = None;
    }
    let mut next = None;
    if let Some(position) = chosen {
        let refitted = &judged[position].refitted;
        let adopted = adopt(model, &candidates[refitted.candidate], refitted, &records)?;
        // With weights of its own the fit is another one.
        if change(model, &adopted.0, roles).is_some_and(|change| change.estimate >= 0.0) {
            judged[position].report.objection = Some(TRANSFERS_NOT.to_owned());
            chosen = None;
        } else {
            next = Some(adopted);
        }
    }
    course.record(&round, &candidates, &screened, &judged, chosen);
    let (Some((next, text)), Some(chosen)) = (next, chosen) else { return Ok(None) };
    observer(Event::Accepted { candidate: &candidates[judged[chosen].refitted.candidate].name });
    course.texts.push(text);
    Ok(Some(next))
}

fn screen_all(
    round: &Round,
    candidates: &[candidates::Candidate],
    observer: Observer,
) -> Vec<Option<screen::Screened>> {
    observer(Event::Screening { candidates: candidates.len() });
    candidates
        .par_iter()
        .map(|candidate| {
            let screened = screen::screen(round, candidate);
            observer(Event::Screened { candidate: &candidate.name });
            screened
        })
        .collect()
}

/// Short refits of the most promising, full ones of the best of these.
fn refit_best(
    round: &Round,
    candidates: &[candidates::Candidate],
    screened: &[Option<screen::Screened>],
    observer: Observer,
) -> Vec<Refitted> {
    let all = screened.iter().enumerate().filter_map(|(index, entry)| entry.as_ref().map(|entry| (index, entry)));
    let (mut order, mut others): (Vec<_>, Vec<_>) =
        all.partition(|(_, entry)| entry.deviance < round.current_deviance());
    order.sort_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
    others.extend(order.split_off(order.len().min(SHORT_REFITS)));
    let score = |entry: &screen::Screened| entry.score.map_or(0.0, |(statistic, _)| statistic);
    others.retain(|(_, entry)| score(entry) > PROMISING_SCORE);
    others.sort_by(|a, b| score(b.1).total_cmp(&score(a.1)));
    let promising: Vec<(usize, screen::Screened)> = others
        .into_iter()
        .take(PROMISING_REFITS)
        .map(|(index, entry)| (index, entry.without_strength(&candidates[index])))
        .collect();
    order.extend(promising.iter().map(|(index, entry)| (*index, entry)));
    observer(Event::Refitting { candidates: order.len() });
    let mut short: Vec<Refitted> = order
        .par_iter()
        .filter_map(|&(index, entry)| {
            let refitted = refit::refit(round, index, &candidates[index], entry, None, SHORT_ITERATIONS);
            observer(Event::Refitted { candidate: &candidates[index].name });
            refitted
        })
        .collect();
    let penalty = round.effective_total().max(2.0).ln();
    let criterion = |r: &Refitted| r.deviance + penalty * r.fitted.theta.len() as f64;
    short.sort_by(|a, b| criterion(a).total_cmp(&criterion(b)));
    short.truncate(FULL_REFITS);
    short
        .into_par_iter()
        .filter_map(|previous| {
            let index = previous.candidate;
            let entry = screened[index].as_ref()?;
            refit::refit(round, index, &candidates[index], entry, Some(previous), FULL_ITERATIONS)
        })
        .collect()
}

/// The model with the accepted extension, refitted with weights of its own.
fn adopt(
    model: &Model,
    candidate: &candidates::Candidate,
    refitted: &Refitted,
    records: &[&Record],
) -> Result<(Model, String), Vec<Diagnostic>> {
    let name = extension::variant_name(&model.compiled.study, candidate);
    let (start, theta) = (&refitted.compiled, &refitted.fitted.theta);
    let text = extension::variant_text(&name, &model.variant, candidate, start, theta);
    let loaded = model.loaded.with_text(&text);
    let compiled = Compiled::new(study::check(&loaded, Some(&name))?.study)?;
    let start = Some(refitted.fitted.theta.clone());
    // Under the channels' magnitudes as weights the way from there may lead to another minimum.
    let first_weights = Some(refitted.fitted.weighting.clone());
    let settings = Settings { start, first_weights, ..Settings::default() };
    let fitted =
        fit(&compiled, records, &settings, &mut |_| Control::Continue).map_err(|diagnostic| vec![diagnostic])?;
    let mut strengths = model.strengths.clone();
    strengths.extend(candidate.strengths());
    let mut accepted = model.accepted.clone();
    accepted.push(Accepted { candidate: candidate.clone(), variant: name.clone() });
    Ok((Model { loaded, variant: name, compiled, fitted, strengths, accepted }, text))
}
