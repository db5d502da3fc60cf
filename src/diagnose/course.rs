//! From the rounds that were run to the answer.

use super::candidates::Candidate;
use super::judge::{self, Judged};
use super::records::Roles;
use super::round::Round;
use super::screen::Screened;
use super::telling;
use super::{Accepted, Answer, Candidate as Reported, ChannelAnatomy, MissingForce, Step, Verdict};
use crate::identify::Identification;
use crate::quantities::{Unit, format_number};
use crate::simulation::Compiled;
use crate::study::ErrorDefinition;

/// Candidates shown in the ranking of a step.
const SHOWN: usize = 20;
/// An effect whose sensitivity keeps less than this share beside the fitted parameters cannot be judged.
const MINIMUM_VISIBILITY: f64 = 0.02;

/// Causes at one place from here on make a curve, not a cause.
const PATCHWORK: usize = 3;

/// What was done so far.
#[derive(Default)]
pub(super) struct Course {
    /// The study file.
    pub file: String,
    pub steps: Vec<Step>,
    pub texts: Vec<String>,
    pub simulations: usize,
    pub below_visibility: bool,
    /// What the last model leaves has a colour that the study does not say its noise has.
    pub unexplained: bool,
    /// What the sensors themselves show of it.
    pub sensors: Vec<String>,
    /// Whether any accepted candidate belongs to the catalogue's shapes without a name.
    pub unnamed: bool,
    /// The search ended because enough extensions were accepted, not because nothing further was found.
    pub limit_reached: bool,
    /// Of each step, in their order.
    notes: Vec<Note>,
    /// What else the search has to say.
    pub remarks: Vec<String>,
    cannot_judge: Vec<String>,
}

/// What a step adds to the answer as long as its cause stays accepted.
#[derive(Default)]
struct Note {
    /// The cause has rivals besides other names of the same force.
    ambiguous: bool,
    /// Which test would tell them apart.
    telling: Option<String>,
    /// Shape parameters of the effect.
    shapes: Vec<String>,
}

impl Course {
    pub(super) fn new(file: String) -> Self {
        Self { file, ..Self::default() }
    }

    pub(super) fn accepted(&self) -> usize {
        self.texts.len()
    }

    /// The place at which so many causes were accepted one after the other that they are pieces of a curve.
    pub(super) fn crowded(&self) -> Option<String> {
        let places = self.steps.iter().filter_map(|step| Some(&step.ranking[step.accepted?].place));
        let places: Vec<&String> = places.collect();
        let crowded = |place: &&&String| places.iter().filter(|other| *other == *place).count() >= PATCHWORK;
        places.iter().find(crowded).map(|place| (*place).clone())
    }

    /// Takes back all that was accepted: `curve` explains more by itself.
    pub(super) fn withdraw(&mut self, curve: &str) {
        for step in self.steps.iter_mut().filter(|step| step.accepted.is_some()) {
            step.accepted = None;
            step.judgement = format!("{}; withdrawn, since {curve} alone explains more", step.judgement);
        }
        self.texts.clear();
        self.notes.iter_mut().for_each(|note| *note = Note::default());
        self.limit_reached = false;
    }

    /// Takes back the `index`th of the causes accepted so far; `texts` are the variants that add the others.
    pub(super) fn eliminate(&mut self, index: usize, texts: &[String], accepted: &[Accepted]) {
        let Some(position) = (0..self.steps.len()).filter(|&at| self.steps[at].accepted.is_some()).nth(index) else {
            return;
        };
        let beside: Vec<&str> = accepted[index + 1..].iter().map(|other| other.candidate.name.as_str()).collect();
        let step = &mut self.steps[position];
        step.accepted = None;
        step.judgement = format!("{}; taken out again: not needed beside {}", step.judgement, beside.join(" and "));
        self.notes[position] = Note::default();
        self.texts = texts.to_vec();
    }

    /// Takes back all that was accepted: beside what it leaves unexplained, its share of the held-out error, `gain`, is
    /// small.
    pub(super) fn dismiss(&mut self, gain: f64) {
        let mut names = Vec::new();
        for step in &mut self.steps {
            let Some(position) = step.accepted.take() else { continue };
            names.push(step.ranking[position].name.clone());
            step.judgement = format!("{}; dismissed in the end, since most stays unexplained", step.judgement);
        }
        self.remarks.push(format!(
            "{} would explain {} % of the error and leave the rest, which is no noise: rather the shadow of another cause than the cause",
            names.join(", then "),
            format_number(100.0 * gain, 2)
        ));
        self.texts.clear();
        self.notes.iter_mut().for_each(|note| *note = Note::default());
        self.unnamed = false;
    }

    /// Notes a round. `chosen` indexes `judged`.
    pub(super) fn record(
        &mut self,
        round: &Round,
        candidates: &[Candidate],
        screened: &[Option<Screened>],
        judged: &[Judged],
        chosen: Option<usize>,
    ) {
        let order = ranking_order(candidates.len(), screened, judged);
        let mut reported: Vec<Reported> =
            order.iter().map(|&index| entry(round, &candidates[index], screened[index].as_ref())).collect();
        judge::report(judged, &mut reported, |index| order.iter().position(|&other| other == index));
        let reference = chosen.or(if judged.is_empty() { None } else { Some(0) });
        let indistinguishable =
            reference.map(|position| judge::indistinguishable(judged, position, candidates)).unwrap_or_default();
        if self.steps.is_empty() {
            self.cannot_judge = invisible(candidates, screened);
        }
        let accepted =
            chosen.and_then(|position| order.iter().position(|&index| index == judged[position].refitted.candidate));
        let note = |position: usize| {
            let rivals = judge::rivals(judged, position);
            let ambiguous = !rivals.is_empty();
            let group: Vec<usize> = std::iter::once(position).chain(rivals).collect();
            let telling = telling::telling(round, candidates, judged, &group);
            let shapes = candidates[judged[position].refitted.candidate].shapes().collect();
            Note { ambiguous, telling, shapes }
        };
        self.notes.push(chosen.map(note).unwrap_or_default());
        let judgement = judgement(judged, chosen, candidates, self.below_visibility);
        reported.truncate(SHOWN);
        self.steps.push(Step {
            screened: screened.iter().flatten().count(),
            ranking: reported,
            accepted,
            indistinguishable,
            judgement,
        });
    }

    pub(super) fn answer(
        self,
        compiled: &Compiled,
        base: Identification,
        extended: Identification,
        anatomy: Vec<ChannelAnatomy>,
        missing_forces: Vec<MissingForce>,
        roles: &Roles,
    ) -> Answer {
        let verdict = self.verdict();
        let summary = self.summary(&verdict, &base, &extended);
        let simulations = self.simulations + base.simulations + extended.simulations;
        let mut remarks = base.remarks.clone();
        remarks.extend(extended.remarks.iter().filter(|remark| !base.remarks.contains(remark)).cloned());
        // A shape at the end of its grid range (a creep velocity too small to be resolved) is no structural error.
        remarks.retain(|remark| {
            !self
                .notes
                .iter()
                .flat_map(|note| &note.shapes)
                .any(|shape| remark.starts_with(&format!("{shape} is at its bound")))
        });
        let telling = self.notes.iter().filter_map(|note| note.telling.as_ref());
        remarks.extend(telling.chain(&self.remarks).cloned());
        if verdict != Verdict::NoCauseFound {
            remarks.extend(self.sensors.iter().cloned());
        }
        if compiled.study.solver.error != ErrorDefinition::Output {
            remarks.push(format!(
                "the study asks for the {} error; causes are looked for with the output error, to which noise in the process looks like one",
                compiled.study.solver.error.name()
            ));
        }
        if let Some(place) = self.crowded() {
            remarks.push(format!(
                "several causes in a row at {place} may be pieces of one law that the catalogue does not have: see the missing force there"
            ));
        }
        if self.unexplained && !self.texts.is_empty() {
            remarks.push(
                "what is left is still not white noise: some of what was named may be the shadow of a cause that the catalogue does not have"
                    .to_owned(),
            );
        }
        if self.limit_reached {
            remarks.push(format!("stopped after {} extensions as asked; `--extensions N` goes on", self.accepted()));
        }
        Answer {
            study: compiled.study.name.clone(),
            file: self.file,
            title: compiled.study.title.clone(),
            verdict,
            summary,
            roles: roles.description.clone(),
            base,
            extended,
            anatomy,
            missing_forces,
            extension: (!self.texts.is_empty()).then(|| self.texts.join("\n")),
            steps: self.steps,
            cannot_judge: self.cannot_judge,
            remarks,
            simulations,
        }
    }

    fn verdict(&self) -> Verdict {
        if self.below_visibility {
            return Verdict::CannotBeJudged;
        }
        if self.texts.is_empty() {
            return if self.unexplained { Verdict::NoCauseFound } else { Verdict::NothingWrongFound };
        }
        if self.unnamed {
            return Verdict::ShapeWithoutName;
        }
        if self.notes.iter().any(|note| note.ambiguous) { Verdict::GroupOfCauses } else { Verdict::CauseNamed }
    }

    fn summary(&self, verdict: &Verdict, base: &Identification, extended: &Identification) -> String {
        let level = |fit: &Identification| match fit.validation_discrepancy {
            Some(held_out) => format!("{:.3} % estimation, {held_out:.3} % held out", fit.estimation_discrepancy),
            None => format!("{:.3} % estimation", fit.estimation_discrepancy),
        };
        let accepted = self.steps.iter().filter_map(|step| Some(step.ranking[step.accepted?].name.clone()));
        let named = counted(accepted);
        match verdict {
            Verdict::NothingWrongFound => format!(
                "Nothing wrong found: no candidate improves the held-out record beyond chance (discrepancy {}).",
                level(base)
            ),
            Verdict::NoCauseFound if !self.sensors.is_empty() => format!(
                "No cause in the mechanism explains what is left (discrepancy {}), but {}.",
                level(base),
                self.sensors.join("; ")
            ),
            Verdict::NoCauseFound => format!(
                "Nothing in the catalogue explains what is left, and that is not white noise (discrepancy {}). Either the sensors' noise \
                 has a colour (then say so: `noise = coloured` in the solver), or something acts that the catalogue does not have: see \
                 where, when and in which band it is left.",
                level(base)
            ),
            Verdict::CannotBeJudged => format!(
                "Cannot be judged with these channels: even the best candidate changes them by less than 0.1 % of their \
                 deviation (discrepancy {}). Measure a quantity that depends on the cause, such as a force, or state the \
                 sensor's noise.",
                level(base)
            ),
            Verdict::CauseNamed => {
                format!("Missing: {}. Discrepancy {} -> {}.", named.join(", then "), level(base), level(extended))
            }
            Verdict::ShapeWithoutName => format!(
                "Missing: {}. No law of the catalogue has its shape. Discrepancy {} -> {}.",
                named.join(", then "),
                level(base),
                level(extended)
            ),
            Verdict::GroupOfCauses => {
                let accepted = self.steps.iter().filter(|step| step.accepted.is_some());
                let groups = counted(accepted.map(|step| step.rivals().join(" or ")));
                format!(
                    "Missing: {} (this data cannot tell the members of a group apart). Discrepancy {} -> {}.",
                    groups.join(", then "),
                    level(base),
                    level(extended)
                )
            }
        }
    }
}

/// Names in the order in which they first come; those that come several times once, with how often.
fn counted(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for name in names {
        match counts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    let told = |(name, count): (String, usize)| if count > 1 { format!("{name} ({count} times)") } else { name };
    counts.into_iter().map(told).collect()
}

/// Refitted candidates in the order of their criterion, then the others in the order of the screen.
fn ranking_order(count: usize, screened: &[Option<Screened>], judged: &[Judged]) -> Vec<usize> {
    let mut order: Vec<usize> = judged.iter().map(|entry| entry.refitted.candidate).collect();
    let mut rest: Vec<usize> =
        (0..count).filter(|index| !order.contains(index) && screened[*index].is_some()).collect();
    let deviance = |index: usize| screened[index].as_ref().map_or(f64::INFINITY, |entry| entry.deviance);
    rest.sort_by(|&a, &b| deviance(a).total_cmp(&deviance(b)));
    order.extend(rest);
    order
}

fn entry(round: &Round, candidate: &Candidate, screened: Option<&Screened>) -> Reported {
    let gain = screened.map_or(0.0, |entry| {
        let difference = (round.current_deviance() - entry.deviance).max(0.0);
        1.0 - (-difference / round.effective_total().max(1.0)).exp()
    });
    Reported {
        name: candidate.name.clone(),
        effect: candidate.effect.clone(),
        place: candidate.place.clone(),
        same_as: candidate.aliases.clone(),
        title: candidate.title.clone(),
        score: screened.and_then(|entry| entry.score),
        visibility: screened.and_then(|entry| entry.visibility),
        predicted_gain: gain,
        refit: None,
        confidence: None,
        smallest_detectable: screened.and_then(|entry| entry.smallest_detectable).and_then(|strength| {
            let unknown = candidate.unknowns.first()?;
            Some(Unit::coherent(unknown.dimension).format(strength, 2))
        }),
    }
}

fn invisible(candidates: &[Candidate], screened: &[Option<Screened>]) -> Vec<String> {
    candidates
        .iter()
        .zip(screened)
        .filter(|(_, entry)| {
            entry.as_ref().and_then(|entry| entry.visibility).is_some_and(|visibility| visibility < MINIMUM_VISIBILITY)
        })
        .map(|(candidate, _)| candidate.name.clone())
        .collect()
}

fn judgement(judged: &[Judged], chosen: Option<usize>, candidates: &[Candidate], below_visibility: bool) -> String {
    let name = |entry: &Judged| candidates[entry.refitted.candidate].name.as_str();
    if below_visibility {
        return "no candidate changes the measured channels enough to be judged".to_owned();
    }
    match (chosen, judged.first()) {
        (_, None) => "no candidate lowers the misfit".to_owned(),
        (None, Some(best)) => {
            let reason = best.report.objection.clone().unwrap_or_default();
            format!("nothing accepted; best was {}: {reason}", name(best))
        }
        (Some(position), _) => {
            let entry = &judged[position];
            let change = entry.report.validation_change.map_or(String::new(), |(low, high)| {
                format!(", held-out error changes by {low:.1} to {high:.1} % (95 %)")
            });
            let passed: Vec<String> = judged[..position]
                .iter()
                .map(|other| format!("{} ({})", name(other), other.report.objection.clone().unwrap_or_default()))
                .collect();
            let before =
                if passed.is_empty() { String::new() } else { format!("; passed over: {}", passed.join(", ")) };
            format!("{} accepted: BIC {:+.0}{change}{before}", name(entry), entry.report.bic_difference)
        }
    }
}
