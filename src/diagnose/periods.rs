//! The periods of something that repeats along a motion (cogging, an eccentric wheel): a coarse grid would miss them
//! between two values.
//!
//! The wavenumber is scanned as a periodogram's frequency is: many copies of the candidate act in one simulation, each
//! with a period and strengths of its own, and what a copy explains to first order is its power.

use super::candidates::{Candidate, Unknown, UnknownRole};
use super::round::Round;
use super::screen::explained_by;
use crate::fit::LeastSquares;
use crate::linear::least_squares;
use crate::quantities::Unit;

/// Step of the wavenumber in units of the inverse typical magnitude: a motion of that root mean square tells apart what
/// lies further from each other (between two values a wave keeps three quarters of its correlation).
const STEP: f64 = 0.25;
/// Waves in one simulation.
const BATCH: usize = 25;
/// Peaks that are tried at finite strengths.
const PEAKS: usize = 3;
const DIGITS: usize = 9;

/// Periods at which the candidate explains most, best first, and the number of simulations that took.
pub(super) fn periods(round: &Round, candidate: &Candidate, shape: usize, magnitude: f64) -> (Vec<f64>, usize) {
    let unknown = &candidate.unknowns[shape];
    let step = STEP / magnitude;
    let first = (1.0 / unknown.upper / step).ceil().max(1.0) as usize;
    let last = (1.0 / unknown.lower / step).floor() as usize;
    let all: Vec<f64> = (first..=last).map(|k| 1.0 / (k as f64 * step)).collect();
    let batches: Vec<&[f64]> = all.chunks(BATCH).collect();
    let powers: Vec<f64> = batches.iter().flat_map(|periods| powers(round, candidate, shape, periods)).collect();
    (best(&all, &powers), batches.len())
}

/// What a wave of each period explains; nothing where they cannot be simulated.
fn powers(round: &Round, candidate: &Candidate, shape: usize, periods: &[f64]) -> Vec<f64> {
    let strengths: Vec<&Unknown> =
        candidate.unknowns.iter().filter(|unknown| unknown.role == UnknownRole::Amplitude).collect();
    let nothing = || vec![0.0; periods.len()];
    let copies = copies(candidate, &strengths, shape, periods);
    let neutral = copies.neutral();
    let Some(compiled) = round.compile(&copies, &neutral, true) else { return nothing() };
    let Ok((residual, gradient)) = round.problem(&compiled).residual_and_gradient(&neutral) else { return nothing() };
    let rows = residual.len();
    gradient
        .chunks(rows * strengths.len())
        .map(|columns| {
            let mut projected: Vec<f64> = columns.iter().map(|slope| -slope).collect();
            projected.chunks_mut(rows).for_each(|column| {
                round.basis.project_out(column);
            });
            let target = &round.projected_residual;
            least_squares(&projected, rows, target)
                .map_or(0.0, |estimate| explained_by(&projected, rows, &estimate, target))
        })
        .collect()
}

/// One copy of the candidate per period, all in one variant.
fn copies(candidate: &Candidate, strengths: &[&Unknown], shape: usize, periods: &[f64]) -> Candidate {
    let unit = Unit::coherent(candidate.unknowns[shape].dimension);
    let mut changes = Vec::new();
    let mut unknowns = Vec::new();
    for (index, &period) in periods.iter().enumerate() {
        let element = format!("{}_{index}", candidate.element);
        let own = |target: &str| target.replacen(&candidate.element, &element, 1);
        let number = unit.format(period, DIGITS);
        let change = candidate.change.replace(&candidate.element, &element);
        changes.push(change.replace(&own(&candidate.unknowns[shape].target), &number));
        unknowns.extend(strengths.iter().map(|unknown| Unknown { target: own(&unknown.target), ..(*unknown).clone() }));
    }
    Candidate { unknowns, change: changes.join("\n  add "), ..candidate.clone() }
}

/// The periods of the highest peaks.
fn best(periods: &[f64], powers: &[f64]) -> Vec<f64> {
    let power = |k: Option<usize>| k.and_then(|k| powers.get(k)).copied().unwrap_or(0.0);
    let is_peak = |&k: &usize| power(Some(k)) > power(k.checked_sub(1)) && power(Some(k)) >= power(Some(k + 1));
    let mut peaks: Vec<usize> = (0..powers.len()).filter(is_peak).collect();
    peaks.sort_by(|&a, &b| powers[b].total_cmp(&powers[a]));
    peaks.truncate(PEAKS);
    peaks.into_iter().map(|k| periods[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::best;

    #[test]
    fn peaks_come_in_the_order_of_their_height() {
        let periods = [6.0, 5.0, 4.0, 3.0, 2.0, 1.0];
        assert_eq!(best(&periods, &[0.1, 0.5, 0.2, 0.3, 0.9, 0.1]), [2.0, 5.0]);
        assert_eq!(best(&periods, &[2.0, 0.5, 0.2, 0.1, 0.0, 0.4]), [6.0, 1.0]);
        assert!(best(&periods, &[0.0; 6]).is_empty());
    }
}
