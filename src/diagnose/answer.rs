//! The answer of a diagnosis, as data. Everything a report shows is in here.

use crate::identify::Identification;
use schemars::JsonSchema;
use serde::Serialize;

/// What is wrong, why, and what the extension gains.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Answer {
    pub study: String,
    /// The study file as it was given.
    pub file: String,
    pub title: String,
    pub verdict: Verdict,
    /// One or two sentences for the top of a page.
    pub summary: String,
    /// How records were used, e.g. `sweep: fitted and screened; kerb: decided`.
    pub roles: String,
    /// The fit of the model as it stands.
    pub base: Identification,
    /// The fit of the extended model; equal to `base` where nothing was accepted.
    pub extended: Identification,
    pub anatomy: Vec<ChannelAnatomy>,
    /// What the base model misses, as a force over the place's motion.
    pub missing_forces: Vec<MissingForce>,
    /// One per round of screening; the last one found nothing further (or the limit was reached).
    pub steps: Vec<Step>,
    /// Text of the variant in the study's language; `None` where nothing was accepted.
    pub extension: Option<String>,
    /// Candidates that this data cannot judge.
    pub cannot_judge: Vec<String>,
    pub remarks: Vec<String>,
    pub simulations: usize,
}

#[derive(Clone, Debug, JsonSchema, Serialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    NothingWrongFound,
    /// What is left is not white noise, and no candidate explains it.
    NoCauseFound,
    CauseNamed,
    GroupOfCauses,
    ShapeWithoutName,
    CannotBeJudged,
}

/// The residual of one channel of one record, taken apart.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct ChannelAnatomy {
    pub experiment: String,
    pub channel: String,
    pub unit: String,
    /// rms of the residual and of the noise reference, in the channel's unit.
    pub residual_rms: f64,
    pub noise_rms: f64,
    pub noise_source: String,
    /// p-value of the Ljung-Box test.
    pub whiteness_p: f64,
    /// Share of the residual's power per frequency band: (from Hz, to Hz, share 0..1).
    pub bands: Vec<(f64, f64, f64)>,
    /// Correlation of the residual with simple functions of the motion, strongest first: (`sign(slide.velocity)`, r).
    pub correlations: Vec<(String, f64)>,
}

/// The force that the model lacks at a place, estimated from the residual, over the place's motion.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct MissingForce {
    pub place: String,
    /// `N` or `N*m`.
    pub unit: String,
    /// Coordinate and rate with their units, at the estimated instants.
    pub coordinate: Vec<f64>,
    pub coordinate_unit: String,
    pub rate: Vec<f64>,
    pub rate_unit: String,
    pub time: Vec<f64>,
    pub force: Vec<f64>,
    /// The accepted extension's force at the same instants; empty where it acts elsewhere or nothing was accepted.
    pub explained: Vec<f64>,
    /// Share of the residual's sum of squares that a force at this place can explain, 0..1.
    pub share: f64,
}

/// One round: screen, refit, judge.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Step {
    /// Candidates screened, best first.
    pub ranking: Vec<Candidate>,
    /// Number of candidates screened in all (the ranking may be cut).
    pub screened: usize,
    /// Index into `ranking` of the accepted candidate.
    pub accepted: Option<usize>,
    /// Names of candidates that this data cannot tell from the accepted (or best) one, itself included.
    pub indistinguishable: Vec<String>,
    /// Why the best was accepted or refused, in words.
    pub judgement: String,
}

impl Step {
    /// What this data cannot tell apart, itself included, without further names of the same force.
    pub fn rivals(&self) -> Vec<&str> {
        let is_other_name = |name: &str| {
            let has = |candidate: &Candidate| candidate.same_as.iter().any(|other| other == name);
            self.accepted.and_then(|index| self.ranking.get(index)).is_some_and(has)
        };
        self.indistinguishable.iter().map(String::as_str).filter(|name| !is_other_name(name)).collect()
    }
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Candidate {
    /// `dry_friction at slide`, `slide.mass set free`.
    pub name: String,
    pub effect: String,
    pub place: String,
    /// Names under which this very force would appear, too: elements between the same points, or on the same joint.
    pub same_as: Vec<String>,
    /// In words, from the declaration's documentation.
    pub title: String,
    /// Score statistic (chi-square scale) and its degrees of freedom; absent where there is no score at zero strength.
    pub score: Option<(f64, usize)>,
    /// Visibility |s~|/|W s| of the effect beside the fitted parameters, 0..1.
    pub visibility: Option<f64>,
    /// Share of the cost that the scan predicts to disappear, 0..1.
    pub predicted_gain: f64,
    /// After refit: discrepancies in %, BIC difference to the step's base (negative is better).
    pub refit: Option<Refit>,
    /// Posterior weight among the refitted, 0..1 (from BIC).
    pub confidence: Option<f64>,
    /// Smallest strength this data would show, as text with unit.
    pub smallest_detectable: Option<String>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Refit {
    pub estimation_discrepancy: f64,
    pub validation_discrepancy: Option<f64>,
    /// 95 % interval of the relative change of the held-out error, % (negative is better).
    pub validation_change: Option<(f64, f64)>,
    pub bic_difference: f64,
    /// Likelihood-ratio p-value with effective sample size, family-wise over the screen.
    pub p_value: f64,
    /// Strengths and shapes after the refit.
    pub parameters: Vec<Strength>,
    pub plausible: bool,
    /// Why it was refused, if it was.
    pub objection: Option<String>,
}

/// A fitted strength or shape of an effect: (name, value, 95 % interval, unit).
pub type Strength = (String, f64, Option<(f64, f64)>, String);
