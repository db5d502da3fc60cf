//! An answer held against the truth.

use super::{Prepared, Strength};
use crate::truth::record::Record;
use ident::diagnose::{Answer, Verdict};
use ident::identify::{Identification, RecordFit};
use std::fmt::{Display, Formatter};

/// Share of the truth's held-out gain that an extension must reach.
const REQUIRED_SHARE: f64 = 0.9;

/// A case's answer in the few figures that the requirements speak of.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub title: String,
    strength: Option<(Strength, f64)>,
    pub verdict: Verdict,
    /// Causes accepted, in order.
    pub accepted: Vec<String>,
    /// Causes that the first step could not tell apart.
    pub group: Vec<String>,
    /// Whether the hidden cause came first or is in the stated group.
    pub cause_found: bool,
    /// Reduction of the held-out error by the extension, and by the truth; 0 to 1.
    pub gain: f64,
    pub true_gain: f64,
    pub simulations: usize,
}

impl Outcome {
    /// Compares the answer with what the case hides.
    pub fn judge(prepared: &Prepared, answer: &Answer) -> Self {
        let accepted: Vec<String> = answer
            .steps
            .iter()
            .filter_map(|step| step.accepted.map(|index| step.ranking[index].name.clone()))
            .collect();
        let group = answer.steps.first().map(|step| step.indistinguishable.clone()).unwrap_or_default();
        let stated = answer.verdict == Verdict::GroupOfCauses || !accepted.is_empty();
        let cause_found = prepared
            .case
            .cause()
            .is_some_and(|cause| accepted.first() == Some(&cause) || (stated && group.contains(&cause)));
        let before = held_out_error(&answer.base, &prepared.validation);
        let after = held_out_error(&answer.extended, &prepared.validation);
        let floor = prepared.validation.noise_floor().sqrt();
        Self {
            title: prepared.case.title(),
            strength: prepared.case.hidden.map(|_| (prepared.case.strength, prepared.measured_strength)),
            verdict: answer.verdict.clone(),
            accepted,
            group,
            cause_found,
            gain: 1.0 - after / before,
            true_gain: 1.0 - floor / before,
            simulations: answer.simulations,
        }
    }

    /// Whether something was named.
    pub fn raised_alarm(&self) -> bool {
        self.verdict != Verdict::NothingWrongFound
    }

    /// What the requirements on a hidden cause miss, if anything.
    pub fn failure(&self) -> Option<String> {
        let (class, measured) = self.strength?;
        if !class.contains(measured) {
            return Some(format!("{}: changes the outputs by {measured:.4}, not of its class", self.title));
        }
        if class == Strength::Weak {
            return None;
        }
        if !self.cause_found {
            return Some(format!("cause not found: {self}"));
        }
        (self.gain < REQUIRED_SHARE * self.true_gain).then(|| format!("gain too small: {self}"))
    }
}

impl Display for Outcome {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let found = if self.cause_found { "found" } else { "-" };
        write!(f, "{:<68} {found:<6} {:?} [{}]", self.title, self.verdict, self.accepted.join(", "))?;
        if self.group.len() > 1 {
            write!(f, " group of {}: {}", self.group.len(), self.group.join(", "))?;
        }
        let (gain, truth) = (100.0 * self.gain, 100.0 * self.true_gain);
        write!(f, ", held-out error -{gain:.1} % of -{truth:.1} %, {} simulations", self.simulations)
    }
}

/// Error on the held-out record in the measure of [`Record::noise_floor`], its square root, computed here from the
/// histories alone.
fn held_out_error(identification: &Identification, record: &Record) -> f64 {
    let fit: &RecordFit = identification
        .records
        .iter()
        .find(|fit| fit.role == "validation")
        .unwrap_or_else(|| panic!("the answer shows no held-out record"));
    let mut share = 0.0;
    let channels = &record.columns[2..];
    for (channel, column) in fit.channels.iter().zip(channels) {
        assert_eq!(channel.measured.len(), column.len(), "the whole record is compared");
        let mean = column.iter().sum::<f64>() / column.len() as f64;
        let power: f64 = column.iter().map(|value| (value - mean).powi(2)).sum();
        let error: f64 = channel.simulated.iter().zip(column).map(|(a, b)| (a - b).powi(2)).sum();
        share += error / power;
    }
    (share / channels.len() as f64).sqrt()
}
