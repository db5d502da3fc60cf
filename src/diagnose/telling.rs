//! Which test would tell causes apart that this data cannot (T-optimality to first order, Atkinson-2007, chapter 20).

use super::candidates::Candidate;
use super::judge::Judged;
use super::round::Round;
use crate::linear::Basis;
use crate::quantities::format_number;
use crate::simulation::{Compiled, Gradient, Trajectory, excitation, simulate};
use rayon::prelude::*;

/// Chi-square distance from which on a test decides between two causes: one in a thousand by chance.
const DECISIVE: f64 = 11.0;

/// Offered tests (the study's manoeuvres) against the accepted cause and its strongest rival, in words; `group` holds
/// positions in
/// `judged`, the accepted one first.
pub(super) fn telling(round: &Round, candidates: &[Candidate], judged: &[Judged], group: &[usize]) -> Option<String> {
    let (&accepted, &rival) = (group.first()?, group.get(1)?);
    let name = |position: usize| candidates[judged[position].refitted.candidate].name.as_str();
    let (first, second) = (name(accepted), name(rival));
    let offered = round.compiled.study.manoeuvres.len();
    if offered == 0 {
        return Some(format!(
            "to tell {first} from {second}: declare the tests that could be made as manoeuvres, and the next diagnosis says which one tells"
        ));
    }
    let distances: Vec<(f64, String)> = (0..offered)
        .into_par_iter()
        .filter_map(|index| {
            let distance = distance(round, &judged[accepted], &judged[rival], index)?;
            Some((distance, round.compiled.study.manoeuvres[index].name.clone()))
        })
        .collect();
    advice([first, second], &distances)
}

/// The test that tells two causes apart best, in words. A test repeated n times has n times its distance.
fn advice([first, second]: [&str; 2], distances: &[(f64, String)]) -> Option<String> {
    let (distance, best) = distances.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let value = format_number(*distance, 2);
    Some(if *distance >= DECISIVE {
        format!(
            "of the offered tests `{best}` tells {first} from {second} best: chi-square distance {value}, {DECISIVE} decides"
        )
    } else {
        let times = format_number((DECISIVE / distance.max(f64::MIN_POSITIVE)).ceil(), 3);
        format!(
            "no offered test tells {first} from {second} by itself: `{best}` comes nearest with a chi-square distance of {value}, {times} repetitions of it would decide"
        )
    })
}

/// Squared difference between the two models' channels in units of the noise, without what the rival's parameters could
/// absorb.
fn distance(round: &Round, accepted: &Judged, rival: &Judged, manoeuvre: usize) -> Option<f64> {
    let run = |judged: &Judged, gradient: Gradient| -> Option<(Trajectory, Vec<usize>)> {
        let compiled: &Compiled = &judged.refitted.compiled;
        let step = compiled.study.manoeuvres[manoeuvre].step;
        let record = excitation(&compiled.study, manoeuvre, step);
        let trajectory = simulate(compiled, &record, &judged.refitted.fitted.theta, gradient).ok()?;
        Some((trajectory, record.measures))
    };
    let (expected, measures) = run(accepted, Gradient::None)?;
    let (other, _) = run(rival, Gradient::AllParameters)?;
    let weights = &round.fitted.weighting.weights;
    let weight = |c: usize| weights.get(measures[c]).copied().unwrap_or(0.0);
    let mut difference = Vec::new();
    for (c, (a, b)) in expected.channels.iter().zip(&other.channels).enumerate() {
        difference.extend(a.iter().zip(b).map(|(a, b)| weight(c) * (a - b)));
    }
    let parameters = rival.refitted.fitted.theta.len();
    let mut gradient = Vec::with_capacity(parameters * difference.len());
    for j in 0..parameters {
        for (c, (columns, channel)) in other.gradient.iter().zip(&other.channels).enumerate() {
            let samples = channel.len();
            gradient.extend(columns[j * samples..(j + 1) * samples].iter().map(|value| weight(c) * value));
        }
    }
    let distance = beyond(&gradient, &mut difference);
    distance.is_finite().then_some(distance)
}

/// Squared length of what the columns of `gradient` cannot absorb of `difference`.
fn beyond(gradient: &[f64], difference: &mut [f64]) -> f64 {
    Basis::new(gradient, difference.len()).project_out(difference);
    difference.iter().map(|value| value * value).sum()
}

#[cfg(test)]
mod tests {
    use super::{advice, beyond};

    /// The causes predict `a t` and `b t^2` at 0, 1 .. n; the rival's `b` is free. What it cannot absorb of `a t` is
    /// `a^2 (S2 - S3^2 / S4)` with the sums of powers in closed form (n = 10: 385, 3025, 25333).
    #[test]
    fn the_distance_is_what_the_rival_cannot_absorb() {
        let times: Vec<f64> = (0..=10).map(f64::from).collect();
        let squares: Vec<f64> = times.iter().map(|t| t * t).collect();
        for b in [0.0, 0.3, 7.0] {
            let mut difference: Vec<f64> = times.iter().map(|t| 0.5 * t - b * t * t).collect();
            let distance = beyond(&squares, &mut difference);
            let expected = 0.25 * (385.0 - 3025.0 * 3025.0 / 25333.0);
            assert!((distance / expected - 1.0).abs() < 1e-10, "{distance} {expected}");
        }
    }

    #[test]
    fn the_best_test_is_named_and_how_often_it_is_needed() {
        let offered = |distances: [f64; 2]| {
            let named = distances.into_iter().zip(["slow", "fast"]);
            named.map(|(distance, name)| (distance, name.to_owned())).collect::<Vec<_>>()
        };
        let one = advice(["drag", "friction"], &offered([3.0, 40.0])).unwrap_or_default();
        assert_eq!(
            one,
            "of the offered tests `fast` tells drag from friction best: chi-square distance 40, 11 decides"
        );
        let several = advice(["drag", "friction"], &offered([2.5, 0.1])).unwrap_or_default();
        assert_eq!(
            several,
            "no offered test tells drag from friction by itself: `slow` comes nearest with a chi-square distance of 2.5, 5 repetitions of it would decide"
        );
        assert_eq!(advice(["drag", "friction"], &[]), None);
    }
}
