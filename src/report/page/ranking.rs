//! The ranking of causes, one table per round of screening.

use crate::diagnose::{Answer, Candidate, Refit, Step, Strength};
use crate::report::chart::{Bar, Style, Whisker, bars, whisker};
use crate::report::{number, words};
use serde::Serialize;

#[derive(Serialize)]
pub struct RoundView {
    pub number: usize,
    pub screened: usize,
    pub judgement: String,
    pub open: bool,
    pub rows: Vec<CandidateRow>,
    /// Ends of the scale on which changes of the held-out error are drawn, %.
    pub change_scale: (String, String),
    /// Candidates behind those shown.
    pub more: usize,
}

#[derive(Serialize)]
pub struct CandidateRow {
    pub place: usize,
    pub name: String,
    pub title: String,
    /// `accepted`, `group` or empty.
    pub class: &'static str,
    pub standing: String,
    pub strengths: Vec<String>,
    pub gain: String,
    pub gain_svg: String,
    pub visibility: String,
    pub bic: String,
    pub estimation: String,
    pub validation: String,
    pub change: String,
    pub change_svg: String,
    pub confidence: String,
    pub confidence_svg: String,
}

/// Rows shown per round.
const SHOWN: usize = 15;

pub fn rounds(answer: &Answer) -> Vec<RoundView> {
    let view = |(index, step): (usize, &Step)| {
        let scale = change_scale(step);
        RoundView {
            number: index + 1,
            screened: step.screened,
            judgement: step.judgement.clone(),
            open: index == 0 || step.accepted.is_some(),
            rows: (0..step.ranking.len().min(SHOWN)).filter_map(|place| row(step, place, scale)).collect(),
            change_scale: (number::fixed(scale.0, 0), number::signed(scale.1, number::fixed(scale.1, 0))),
            more: step.screened.saturating_sub(step.ranking.len().min(SHOWN)),
        }
    };
    answer.steps.iter().enumerate().map(view).collect()
}

/// A scale for the changes, % (never narrower than -10 .. 10, never beyond -100 .. 100).
fn change_scale(step: &Step) -> (f64, f64) {
    let intervals = || step.ranking.iter().filter_map(|candidate| candidate.refit.as_ref()?.validation_change);
    let low = intervals().map(|(low, _)| low).filter(|low| low.is_finite()).fold(-10.0, f64::min);
    let high = intervals().map(|(_, high)| high).filter(|high| high.is_finite()).fold(10.0, f64::max);
    (10.0 * (low.max(-100.0) / 10.0).floor(), 10.0 * (high.min(100.0) / 10.0).ceil())
}

fn row(step: &Step, place: usize, scale: (f64, f64)) -> Option<CandidateRow> {
    let candidate: &Candidate = step.ranking.get(place)?;
    let refit = candidate.refit.as_ref();
    let rivals = step.rivals();
    let in_group = rivals.len() > 1 && rivals.contains(&candidate.name.as_str());
    let style = if step.accepted == Some(place) { Style::After } else { Style::Measured };
    let share_bar = |share: f64| bars(&[Bar { value: share, style }], 1.0, 76.0);
    Some(CandidateRow {
        place: place + 1,
        name: candidate.name.clone(),
        title: candidate.title.clone(),
        class: if step.accepted == Some(place) {
            "accepted"
        } else if in_group {
            "group"
        } else {
            ""
        },
        standing: words::standing(step, place),
        strengths: refit.map_or(Vec::new(), strengths),
        gain: number::percent(100.0 * candidate.predicted_gain),
        gain_svg: share_bar(candidate.predicted_gain),
        visibility: candidate.visibility.map_or(String::new(), |visibility| number::fixed(visibility, 2)),
        bic: refit.map_or(String::new(), |refit| {
            number::signed(refit.bic_difference, number::fixed(refit.bic_difference, 0))
        }),
        estimation: refit.map_or(String::new(), |refit| number::percent(refit.estimation_discrepancy)),
        validation: refit.and_then(|refit| refit.validation_discrepancy).map_or(String::new(), number::percent),
        change: refit.and_then(words::held_out_change).unwrap_or_default(),
        change_svg: refit.and_then(|refit| refit.validation_change).map_or(String::new(), |(low, high)| {
            let drawn = Whisker { value: 0.5 * (low + high), interval: Some((low, high)), style };
            whisker(&[drawn], scale.0, scale.1, Some(0.0), 120.0)
        }),
        confidence: candidate.confidence.map_or(String::new(), |weight| number::fixed(weight, 2)),
        confidence_svg: candidate.confidence.map_or(String::new(), share_bar),
    })
}

fn strengths(refit: &Refit) -> Vec<String> {
    let text = |(name, value, interval, unit): &Strength| {
        let deviation = interval.map(|(low, high)| (high - low) / 3.92);
        let value = number::with_deviation(*value, deviation);
        format!("{name} = {value} {unit} ({})", number::interval_text(*interval))
    };
    refit.parameters.iter().map(text).collect()
}
