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
use crate::simulation::{Compiled, Record, probe};
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
const SHORT_ITERATIONS: usize = 3;
const FULL_ITERATIONS: usize = 30;

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
    let mut course = Course::default();
    let (mut named, mut model) = (Vec::new(), first);
    while course.accepted() < options.maximum_extensions {
        let Some(next) = extend(&model, &roles, &mut course, observer)? else { break };
        named.push(std::mem::replace(&mut model, next));
        course.limit_reached = course.accepted() == options.maximum_extensions;
    }
    if options.maximum_extensions > 0 {
        let start = named.first().unwrap_or(&model);
        if let Some(curve) = unnamed::unnamed(start, &model, &roles, &mut course, observer)? {
            model = curve;
        }
    }
    course.unexplained = unnamed::unexplained(&model);
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
    Ok(Model { loaded: loaded.clone(), variant: variant.to_owned(), compiled, fitted, strengths: Vec::new() })
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
    let probed: Vec<_> =
        records.iter().filter_map(|record| probe(&model.compiled, record, &model.fitted.theta).ok()).collect();
    let mut candidates = candidates::candidates(&model.compiled.study, &typical::typical(&model.compiled, &probed));
    let mut screened = screen_all(&round, &candidates, observer);
    course.simulations += screened.iter().flatten().map(|entry| entry.simulations).sum::<usize>();
    screen::merge_equal(&mut candidates, &mut screened, round.current_deviance());
    let refits = refit_best(&round, &candidates, &screened, observer);
    let validation = roles.validation();
    let held_out = HeldOut::new(&model.compiled, &model.fitted, &validation);
    let judged = judge::judge(&round, &candidates, refits, held_out.as_ref());
    course.simulations += judged.iter().map(|entry| entry.refitted.fitted.simulations).sum::<usize>();
    let mut chosen = judged.iter().position(Judged::accepted);
    if chosen.is_some_and(|position| judge::below_visibility(&round, &judged[position])) {
        course.below_visibility = course.accepted() == 0;
        chosen = None;
    }
    course.record(&round, &candidates, &screened, &judged, chosen);
    let Some(chosen) = chosen else {
        return Ok(None);
    };
    let entry = &judged[chosen];
    let candidate = &candidates[entry.refitted.candidate];
    observer(Event::Accepted { candidate: &candidate.name });
    let next = adopt(model, candidate, &entry.refitted, &records)?;
    course.texts.push(next.1);
    Ok(Some(next.0))
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
    let mut order: Vec<(usize, &screen::Screened)> = screened
        .iter()
        .enumerate()
        .filter_map(|(index, entry)| entry.as_ref().map(|entry| (index, entry)))
        .filter(|(_, entry)| entry.deviance < round.current_deviance())
        .collect();
    order.sort_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
    order.truncate(SHORT_REFITS);
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
    let text = extension::variant_text(&name, &model.variant, candidate, refitted);
    let loaded = model.loaded.with_text(&text);
    let compiled = Compiled::new(study::check(&loaded, Some(&name))?.study)?;
    let start = Some(refitted.fitted.theta.clone());
    let settings = Settings { start, ..Settings::default() };
    let fitted =
        fit(&compiled, records, &settings, &mut |_| Control::Continue).map_err(|diagnostic| vec![diagnostic])?;
    let mut strengths = model.strengths.clone();
    strengths.extend(candidate.strengths());
    Ok((Model { loaded, variant: name, compiled, fitted, strengths }, text))
}
