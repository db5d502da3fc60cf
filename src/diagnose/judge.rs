//! Judgement of refitted candidates: information criterion, transfer to held-out records, plausibility, groups.

use super::candidates::{Candidate, UnknownRole};
use super::refit::Refitted;
use super::round::{Round, deviance, effective_counts};
use super::{Candidate as Reported, FULL_REFITS, Refit, Strength};
use crate::fit::LeastSquares;
use crate::identify::{Fitted, Problem, confidence, prefilters};
use crate::simulation::{Compiled, Record};
use crate::statistics::{ErrorChange, block_length, chi_square_p, error_change};

/// A held-out error must fall by more than this, % (measured to give no false alarm in empty cases).
const MINIMUM_HELD_OUT_GAIN: f64 = 1.0;
/// Evidence needed before an extension is believed (Kass-Raftery-1995: above 10 is very strong).
pub(super) const MINIMUM_BIC_GAIN: f64 = 10.0;
/// Refits whose criterion differs by less than this cannot be told apart (Kass-Raftery-1995).
const INDISTINGUISHABLE_BIC: f64 = 6.0;
/// Refits closer than this are the same but for rounding.
const EQUIVALENT_BIC: f64 = 0.1;
/// Family-wise level of a screen.
const LEVEL: f64 = 0.05;
/// An extension that changes no channel by more than this share of its deviation is below what sensors and simulation
/// can be trusted with, unless the study states the noise.
const MINIMUM_VISIBLE_CHANGE: f64 = 1e-3;

/// Bootstrap of held-out changes.
const REPLICATES: usize = 999;
pub(super) const INTERVAL: f64 = 0.95;
/// Several refits of a round are held against the same record, and several rounds: 5 % over all of a round's.
const DECIDING_INTERVAL: f64 = 1.0 - LEVEL / FULL_REFITS as f64;
const SEED: u64 = 1;

/// Held-out residuals of the round's model, to compare candidates with.
pub(super) struct HeldOut<'a> {
    records: Vec<&'a Record>,
    residual: Vec<f64>,
    magnitudes: f64,
}

/// What the judgement says of one refit.
pub(super) struct Judged {
    pub refitted: Refitted,
    pub bic: f64,
    pub report: Refit,
    /// Relative change of the held-out error; `None` without held-out records.
    pub held_out_change: Option<f64>,
    /// Largest change of a simulated channel, as a share of the channel's deviation.
    pub visible_change: f64,
}

impl Judged {
    pub(super) fn accepted(&self) -> bool {
        self.report.objection.is_none()
    }
}

impl<'a> HeldOut<'a> {
    /// `None` where there are no held-out records or the current model cannot simulate them.
    pub(super) fn new(compiled: &Compiled, fitted: &Fitted, records: &[&'a Record]) -> Option<Self> {
        Self::with_weights(compiled, fitted, &fitted.weighting.weights, records)
    }

    /// The same, weighted as another model's fit.
    pub(super) fn with_weights(
        compiled: &Compiled,
        fitted: &Fitted,
        weights: &[f64],
        records: &[&'a Record],
    ) -> Option<Self> {
        if records.is_empty() {
            return None;
        }
        let residual = held_out_residual(compiled, fitted, weights, records)?;
        let magnitudes = mean_free_squares(compiled, records, weights);
        Some(Self { records: records.to_vec(), residual, magnitudes })
    }

    /// Relative change of the held-out sum of squares with its interval; `None` where there is nothing to compare.
    pub(super) fn change(&self, residual: &[f64], interval: f64) -> Option<ErrorChange> {
        let mut records = Vec::new();
        let mut offset = 0;
        for record in &self.records {
            let samples = record.sample_count();
            let channels = record.measures.len();
            let sum = |values: &[f64]| -> Vec<f64> {
                (0..samples).map(|k| (0..channels).map(|c| values[offset + c * samples + k].powi(2)).sum()).collect()
            };
            records.push((sum(&self.residual), sum(residual)));
            offset += samples * channels;
        }
        let difference: Vec<f64> =
            records.iter().flat_map(|(before, after)| before.iter().zip(after).map(|(b, a)| a - b)).collect();
        error_change(&records, block_length(&difference), REPLICATES, interval, SEED)
    }

    /// Discrepancy index of the held-out records, %.
    fn discrepancy(&self, residual: &[f64]) -> f64 {
        100.0 * squares(residual) / self.magnitudes
    }
}

fn squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

pub(super) fn held_out_residual(
    compiled: &Compiled,
    fitted: &Fitted,
    weights: &[f64],
    records: &[&Record],
) -> Option<Vec<f64>> {
    let filters = prefilters(compiled, records).ok()?;
    let mut problem = Problem::new(compiled, records.to_vec(), filters, weights.to_vec());
    problem.residual(&fitted.theta).ok()
}

fn mean_free_squares(compiled: &Compiled, records: &[&Record], weights: &[f64]) -> f64 {
    let filters = prefilters(compiled, records).unwrap_or_default();
    let problem = Problem::new(compiled, records.to_vec(), filters, weights.to_vec());
    problem.mean_squares().iter().sum()
}

/// Judges all refits of a round. Sorted by information criterion, best first.
pub(super) fn judge(
    round: &Round,
    candidates: &[Candidate],
    refits: Vec<Refitted>,
    held_out: Option<&HeldOut>,
) -> Vec<Judged> {
    let Some(best) = refits.iter().min_by(|a, b| a.deviance.total_cmp(&b.deviance)) else {
        return Vec::new();
    };
    // One effective sample size for all: that of the residual nearest to noise.
    let measures = round.compiled.study.measures.len();
    let effective = effective_counts(measures, round.fitted, &best.fitted.residual);
    let total: f64 = effective.iter().sum();
    let base_bic =
        deviance(round.fitted, &round.fitted.residual, &effective) + round.fitted.theta.len() as f64 * total.ln();
    let mut judged: Vec<Judged> = refits
        .into_iter()
        .map(|refitted| {
            let candidate = &candidates[refitted.candidate];
            judge_one(round, candidate, refitted, held_out, &effective, base_bic, candidates.len())
        })
        .collect();
    // Equivalent candidates (one effect at two elements between the same bodies) differ by rounding only: the order of
    // the catalogue decides then.
    let key = |entry: &Judged| ((entry.bic / EQUIVALENT_BIC).round(), entry.refitted.candidate);
    judged.sort_by(|a, b| key(a).0.total_cmp(&key(b).0).then(key(a).1.cmp(&key(b).1)));
    judged
}

fn judge_one(
    round: &Round,
    candidate: &Candidate,
    refitted: Refitted,
    held_out: Option<&HeldOut>,
    effective: &[f64],
    base_bic: f64,
    screened: usize,
) -> Judged {
    let total: f64 = effective.iter().sum();
    let own_deviance = deviance(&refitted.fitted, &refitted.fitted.residual, effective);
    let bic = own_deviance + refitted.fitted.theta.len() as f64 * total.ln();
    let gain = deviance(round.fitted, &round.fitted.residual, effective) - own_deviance;
    let single = chi_square_p(gain.max(0.0), candidate.unknowns.len());
    let p_value = 1.0 - (1.0 - single).powi(i32::try_from(screened).unwrap_or(i32::MAX));
    let parameters = candidate_parameters(&refitted, candidate);
    let plausible = implausibility(&refitted, candidate).is_none();
    let held_out_residual = held_out.and_then(|reference| {
        held_out_residual(&refitted.compiled, &refitted.fitted, &round.fitted.weighting.weights, &reference.records)
    });
    let change_within = |interval: f64| {
        held_out.zip(held_out_residual.as_ref()).and_then(|(reference, residual)| reference.change(residual, interval))
    };
    let change = change_within(INTERVAL);
    let objection =
        objection(candidate, &refitted, bic - base_bic, p_value, held_out.is_some(), change_within(DECIDING_INTERVAL));
    let report = Refit {
        estimation_discrepancy: refitted.fitted.discrepancy(),
        validation_discrepancy: held_out.zip(held_out_residual.as_ref()).map(|(h, residual)| h.discrepancy(residual)),
        validation_change: change.map(|change| (100.0 * change.lower, 100.0 * change.upper)),
        bic_difference: bic - base_bic,
        p_value,
        parameters,
        plausible,
        objection,
    };
    let visible_change = visible_change(round, &refitted);
    Judged { refitted, bic, report, held_out_change: change.map(|change| change.estimate), visible_change }
}

/// How far the extension moves the simulated channels, relative to the channels' deviation.
fn visible_change(round: &Round, refitted: &Refitted) -> f64 {
    let mut largest: f64 = 0.0;
    for (block, &deviation) in round.fitted.blocks.iter().zip(&round.fitted.mean_squares) {
        let before = &round.fitted.residual[block.rows.clone()];
        let after = &refitted.fitted.residual[block.rows.clone()];
        let change: f64 = before.iter().zip(after).map(|(b, a)| (b - a) * (b - a)).sum();
        if deviation > 0.0 {
            largest = largest.max((change / deviation).sqrt());
        }
    }
    largest
}

fn candidate_parameters(refitted: &Refitted, candidate: &Candidate) -> Vec<Strength> {
    let confidence = confidence(&refitted.compiled, &refitted.fitted);
    candidate
        .unknowns
        .iter()
        .filter_map(|unknown| {
            let index = refitted.compiled.study.parameters.iter().position(|p| p.name == unknown.target)?;
            let parameter = &refitted.compiled.study.parameters[index];
            let interval = confidence
                .interval(index)
                .map(|(low, high)| (parameter.unit.from_si(low), parameter.unit.from_si(high)));
            let value = parameter.unit.from_si(refitted.fitted.theta[index]);
            Some((parameter.name.clone(), value, interval, parameter.unit.symbol.clone()))
        })
        .collect()
}

/// Why the fitted strength cannot be meant physically.
fn implausibility(refitted: &Refitted, candidate: &Candidate) -> Option<String> {
    for unknown in &candidate.unknowns {
        let index = refitted.compiled.study.parameters.iter().position(|p| p.name == unknown.target)?;
        let value = refitted.fitted.theta[index];
        let is_strength = matches!(unknown.role, UnknownRole::Amplitude | UnknownRole::FiniteAmplitude(_));
        if is_strength && refitted.fitted.at_bound[index] && value != unknown.neutral {
            return Some(format!("{} runs into its bound", unknown.target));
        }
        if is_strength && value == unknown.neutral && candidate.unknowns.len() == 1 {
            return Some(format!("{} vanishes", unknown.target));
        }
    }
    None
}

fn objection(
    candidate: &Candidate,
    refitted: &Refitted,
    bic_difference: f64,
    p_value: f64,
    has_held_out: bool,
    change: Option<ErrorChange>,
) -> Option<String> {
    if bic_difference > -MINIMUM_BIC_GAIN || p_value > LEVEL {
        return Some("the gain is within what chance gives a screen of this size".to_owned());
    }
    if let Some(reason) = implausibility(refitted, candidate) {
        return Some(reason);
    }
    match change {
        Some(change) if !transfers(&change) => Some(super::TRANSFERS_NOT.to_owned()),
        None if has_held_out => Some("the held-out record cannot be simulated with it".to_owned()),
        _ => None,
    }
}

/// Whether the held-out error falls by more than chance and rounding let it.
pub(super) fn transfers(change: &ErrorChange) -> bool {
    100.0 * change.estimate <= -MINIMUM_HELD_OUT_GAIN && change.is_improvement()
}

/// Candidates that cannot be told from `judged[chosen]`: their criterion is as good within what the data can tell, and
/// none was refused for its plausibility. The chosen one comes first.
pub(super) fn indistinguishable(judged: &[Judged], chosen: usize, candidates: &[Candidate]) -> Vec<String> {
    let name = |position: usize| candidates[judged[position].refitted.candidate].name.clone();
    let mut group = vec![name(chosen)];
    group.extend(candidates[judged[chosen].refitted.candidate].aliases.iter().cloned());
    group.extend(rivals(judged, chosen).into_iter().map(name));
    group
}

/// Positions of other accepted refits that are as good.
pub(super) fn rivals(judged: &[Judged], chosen: usize) -> Vec<usize> {
    let close = |entry: &Judged| (entry.bic - judged[chosen].bic).abs() < INDISTINGUISHABLE_BIC;
    let others = judged.iter().enumerate().filter(|(position, _)| *position != chosen);
    others.filter(|(_, entry)| close(entry) && entry.accepted()).map(|(position, _)| position).collect()
}

/// True where the candidate would be accepted but moves the measured channels by less than can be trusted.
pub(super) fn below_visibility(round: &Round, chosen: &Judged) -> bool {
    let stated = round.compiled.study.measures.iter().any(|measure| measure.noise.is_some());
    !stated && chosen.visible_change < MINIMUM_VISIBLE_CHANGE
}

/// The judged refits as entries of the reported ranking.
pub(super) fn report(judged: &[Judged], reported: &mut [Reported], position_of: impl Fn(usize) -> Option<usize>) {
    let Some(best) = judged.first().map(|entry| entry.bic) else {
        return;
    };
    let weights: Vec<f64> = judged.iter().map(|entry| (-0.5 * (entry.bic - best)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    for (entry, weight) in judged.iter().zip(weights) {
        if let Some(position) = position_of(entry.refitted.candidate) {
            reported[position].confidence = Some(weight / sum);
            reported[position].refit = Some(entry.report.clone());
        }
    }
}
