//! Structures side by side: criteria with common counts, tests against the first one, held-out error (method 9).

use super::fitting::{Fitted, prefilters};
use super::problem::Problem;
use super::result::Structure;
use crate::fit::LeastSquares;
use crate::signal::effective_count;
use crate::simulation::{Compiled, Record};
use crate::statistics::{block_length, chi_square_p, error_change, normal_probability};
use crate::study::Role;

/// Of the bootstrap of the held-out error.
const REPLICATES: usize = 2000;
const LEVEL: f64 = 0.95;
const SEED: u64 = 7;

/// A fitted structure with all records of its study.
#[derive(Clone, Copy)]
pub struct Candidate<'a> {
    pub compiled: &'a Compiled,
    pub fitted: &'a Fitted,
    pub records: &'a [Record],
}

/// One [`Structure`] per candidate, compared with the first. Empty where the candidates do not compare the same
/// samples.
///
/// All count their residuals alike: what a sample is worth is taken from the candidate whose residual is most coloured,
/// so that a better model is not favoured for the whiter residual it leaves.
pub fn structures(candidates: &[Candidate]) -> Vec<Structure> {
    let Some(base) = candidates.first() else { return Vec::new() };
    let rows = |candidate: &Candidate| {
        candidate.fitted.blocks.iter().map(|b| (b.record, b.measure, b.rows.clone())).collect::<Vec<_>>()
    };
    if candidates.iter().any(|candidate| rows(candidate) != rows(base)) {
        return Vec::new();
    }
    let counts: Vec<f64> = base
        .fitted
        .blocks
        .iter()
        .map(|block| {
            let own = candidates.iter().map(|c| effective_count(&c.fitted.residual[block.rows.clone()]));
            own.fold(f64::INFINITY, f64::min)
        })
        .collect();
    candidates.iter().map(|candidate| structure(base, candidate, &counts)).collect()
}

/// Mean square of a block's residual, SI.
fn variance(candidate: &Candidate, block: usize) -> f64 {
    let block = &candidate.fitted.blocks[block];
    let squares: f64 = candidate.fitted.residual[block.rows.clone()].iter().map(|value| value * value).sum();
    let weight = candidate.fitted.weighting.weights[block.measure];
    (squares / block.rows.len().max(1) as f64 / (weight * weight)).max(f64::MIN_POSITIVE)
}

fn structure(base: &Candidate, candidate: &Candidate, counts: &[f64]) -> Structure {
    let deviance = |of: &Candidate| -> f64 {
        counts.iter().enumerate().map(|(block, count)| count * variance(of, block).ln()).sum()
    };
    let all: f64 = counts.iter().sum();
    let parameters = |of: &Candidate| of.fitted.theta.len() as f64;
    // The channels' variances are parameters too.
    let k = parameters(candidate) + counts.len() as f64;
    let remaining = all - k - 1.0;
    let correction = if remaining > 0.0 { 2.0 * k * (k + 1.0) / remaining } else { f64::INFINITY };
    let (own, first) = (deviance(candidate), deviance(base));
    let added = candidate.fitted.theta.len() as i64 - base.fitted.theta.len() as i64;
    let nested = is_nested(base, candidate);
    let is_base = std::ptr::eq(base.fitted, candidate.fitted);
    let (vuong_z, vuong_p) = match (is_base || nested).then_some(()) {
        Some(()) => (None, None),
        None => vuong(base, candidate, all).map_or((None, None), |(z, p)| (Some(z), Some(p))),
    };
    Structure {
        aicc: own + 2.0 * k + correction,
        bic: own + k * all.max(1.0).ln(),
        likelihood_ratio: (!is_base).then_some(first - own),
        likelihood_ratio_p: (!is_base && nested && added > 0)
            .then(|| chi_square_p((first - own).max(0.0), added as usize)),
        vuong_z,
        vuong_p,
        held_out_change: if is_base { None } else { held_out_change(base, candidate) },
    }
}

/// Every parameter of the base is one of the candidate's.
fn is_nested(base: &Candidate, candidate: &Candidate) -> bool {
    let names = |of: &Candidate| of.compiled.study.parameters.iter().map(|p| p.name.clone()).collect::<Vec<_>>();
    let own = names(candidate);
    own.len() > base.fitted.theta.len() && names(base).iter().all(|name| own.contains(name))
}

/// Test of two structures of which neither contains the other, with Schwarz's correction (Vuong-1989): z is positive
/// where the candidate is better; the variance counts every sample as what it is worth.
fn vuong(base: &Candidate, candidate: &Candidate, all: f64) -> Option<(f64, f64)> {
    let mut ratios = Vec::new();
    for (index, block) in base.fitted.blocks.iter().enumerate() {
        let (before, after) = (variance(base, index), variance(candidate, index));
        let shift = 0.5 * (before / after).ln();
        let square = |of: &Candidate, k: usize, variance: f64| {
            let weight = of.fitted.weighting.weights[block.measure];
            (of.fitted.residual[k] / weight).powi(2) / variance
        };
        ratios
            .extend(block.rows.clone().map(|k| shift + 0.5 * (square(base, k, before) - square(candidate, k, after))));
    }
    let count = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / count.max(1.0);
    let spread = (ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / count.max(1.0)).sqrt();
    let worth = effective_count(&ratios).min(all);
    if !(spread > 0.0 && worth > 2.0) {
        return None;
    }
    let difference = candidate.fitted.theta.len() as f64 - base.fitted.theta.len() as f64;
    let z = (worth * mean - 0.5 * difference * worth.ln()) / (worth.sqrt() * spread);
    Some((z, 2.0 * normal_probability(-z.abs())))
}

/// Relative change of the root of the held-out sum of squares against the base, with its 95 % interval by a
/// moving-block bootstrap: (change, low, high).
fn held_out_change(base: &Candidate, candidate: &Candidate) -> Option<(f64, f64, f64)> {
    let held_out = |of: &Candidate| -> Option<Vec<Vec<f64>>> {
        let records: Vec<&Record> = of.records.iter().filter(|record| record.role == Role::Validation).collect();
        let filters = prefilters(of.compiled, &records).ok()?;
        // The base's weights for both.
        let weights = base.fitted.weighting.weights.clone();
        let mut problem = Problem::new(of.compiled, records.clone(), filters, weights);
        let residual = problem.residual(&of.fitted.theta).ok()?;
        let mut sums: Vec<Vec<f64>> = records.iter().map(|record| vec![0.0; record.sample_count()]).collect();
        for block in problem.blocks() {
            let own = &residual[block.rows.clone()];
            sums[block.record].iter_mut().zip(own).for_each(|(sum, value)| *sum += value * value);
        }
        Some(sums)
    };
    let (before, after) = (held_out(base)?, held_out(candidate)?);
    let pairs: Vec<(Vec<f64>, Vec<f64>)> = before.into_iter().zip(after).collect();
    if pairs.is_empty() || pairs.iter().any(|(a, b)| a.len() != b.len()) {
        return None;
    }
    let difference: Vec<f64> = pairs.iter().flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| b - a)).collect();
    let change = error_change(&pairs, block_length(&difference), REPLICATES, LEVEL, SEED)?.of_norm();
    Some((change.estimate, change.lower, change.upper))
}
