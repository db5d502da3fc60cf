//! How exact the gradient is: that of a run against an independent derivative along the same steps.
//!
//! Along a recorded sequence of steps the solution is a function of the parameters, whose exact derivative the gradient
//! claims to be. Models are differentiated anew by dual numbers, the variation integrated as part of the state; those
//! with clocks, and loops where dual numbers cannot start, by central differences of sixth order. Neither shares code
//! with the gradient beyond the model itself: sensitivity equations, symbolic derivatives of the model, of the start
//! and of the measures are left out.

use super::failure::Failure;
use super::prepare::Record;
use super::run::{Compiled, Gradient, Trajectory, follow, record_plan, simulate};
use super::tangent::tangent;
use crate::integrate::Plan;
use crate::study::Parameter;
use rayon::prelude::*;
use std::sync::Arc;

/// Random directions tried.
const DIRECTIONS: usize = 2;
/// Distances of the differences as shares of the parameters' typical variation, tried until the digits suffice; what
/// fits best counts. A far distance serves smooth models; laws with a sharp bend need a near one, where rounding
/// limits.
const DISTANCES: [f64; 6] = [3e-4, 1e-3, 3e-5, 1e-6, 1e-7, 1e-8];
const SUFFICIENT: f64 = 9.0;
/// Tolerance of whole runs that are differenced.
const TIGHT: f64 = 1e-11;
/// Weights of central differences of sixth order at one, two and three distances.
const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];
/// An influence below this share of a channel's own size is not judged by itself.
const NEGLIGIBLE: f64 = 1e-6;

/// Digits to which the gradient of `records` at `theta` agrees with an independent derivative along the same steps, in
/// random directions: the worst of all records, channels and directions. Where events move with the parameters no steps
/// can be held: there differences of whole runs at a tight tolerance tell, to fewer digits. None where there is no
/// parameter.
///
/// # Errors
/// [`Failure`] of the run itself.
pub fn certify(compiled: &Compiled, records: &[&Record], theta: &[f64]) -> Result<Option<f64>, Failure> {
    if theta.is_empty() || records.is_empty() {
        return Ok(None);
    }
    let has_switches = compiled.model.switch_count() > 0;
    let tight = has_switches.then(|| {
        let mut tight = compiled.clone();
        tight.study.solver.relative_tolerance = tight.study.solver.relative_tolerance.min(TIGHT);
        tight
    });
    let compiled = tight.as_ref().unwrap_or(compiled);
    let tasks: Vec<(&Record, usize)> =
        records.iter().flat_map(|&record| (0..DIRECTIONS).map(move |k| (record, k))).collect();
    let digits: Vec<Result<Option<f64>, Failure>> =
        tasks.par_iter().map(|&(record, k)| digits(compiled, record, theta, &direction(compiled, k))).collect();
    let mut worst: Option<f64> = None;
    for result in digits {
        match result? {
            Some(digits) => worst = Some(worst.map_or(digits, |w| w.min(digits))),
            None => return Ok(None),
        }
    }
    Ok(worst)
}

/// Change of every parameter by up to its typical variation; the same on every run.
fn direction(compiled: &Compiled, k: usize) -> Vec<f64> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(k as u64 + 1);
    let mut uniform = || {
        // SplitMix64 (Steele-Lea-Flood-2014).
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    };
    compiled.study.parameters.iter().map(|parameter| (2.0 * uniform() - 1.0) * Parameter::scale(parameter)).collect()
}

/// For one record and direction; none where no distance could be simulated.
fn digits(compiled: &Compiled, record: &Record, theta: &[f64], direction: &[f64]) -> Result<Option<f64>, Failure> {
    let (trajectory, plan) = record_plan(compiled, record, theta, Gradient::AllParameters)?;
    let plan = (compiled.model.switch_count() == 0).then(|| Arc::new(plan));
    let ours = directional(&trajectory, direction);
    let is_explicit = compiled.model.state_count() == compiled.model.dimension();
    let mut best = None;
    if let Some(plan) = plan.as_ref().filter(|_| !compiled.model.has_events()) {
        match tangent(compiled, record, theta, direction, Arc::clone(plan)) {
            Ok(exact) => best = Some(agreement(&trajectory, &ours, &exact)),
            Err(failure) if is_explicit => return Err(failure),
            // Differenced start values meet constraints to fewer digits than the tightest tolerances ask for.
            Err(_) => {}
        }
        if best.is_some_and(|digits| is_explicit || digits >= SUFFICIENT) {
            return Ok(best);
        }
    }
    for distance in DISTANCES {
        if let Some(exact) = differences(compiled, record, theta, direction, distance, plan.as_ref()) {
            let digits = agreement(&trajectory, &ours, &exact);
            best = Some(best.map_or(digits, |b: f64| b.max(digits)));
        }
        if best.is_some_and(|digits| digits >= SUFFICIENT) {
            break;
        }
    }
    Ok(best)
}

/// `G d` per channel.
fn directional(trajectory: &Trajectory, direction: &[f64]) -> Vec<Vec<f64>> {
    trajectory
        .gradient
        .iter()
        .zip(&trajectory.channels)
        .map(|(gradient, channel)| {
            let samples = channel.len();
            (0..samples)
                .map(|k| direction.iter().enumerate().map(|(j, d)| gradient[j * samples + k] * d).sum())
                .collect()
        })
        .collect()
}

/// Along the steps of a plan, or of whole runs.
fn differences(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    direction: &[f64],
    distance: f64,
    plan: Option<&Arc<Plan>>,
) -> Option<Vec<Vec<f64>>> {
    let mut sum: Vec<Vec<f64>> = record.measures.iter().map(|_| vec![0.0; record.sample_count()]).collect();
    for (k, weight) in WEIGHTS.iter().enumerate() {
        for sign in [1.0, -1.0] {
            let moved = |(t, d): (&f64, &f64)| t + sign * (k + 1) as f64 * distance * d;
            let theta: Vec<f64> = theta.iter().zip(direction).map(moved).collect();
            let trajectory = match plan {
                Some(plan) => follow(compiled, record, &theta, Arc::clone(plan)),
                None => simulate(compiled, record, &theta, Gradient::None),
            }
            .ok()?;
            for (sum, channel) in sum.iter_mut().zip(&trajectory.channels) {
                sum.iter_mut().zip(channel).for_each(|(s, value)| *s += sign * weight * value / distance);
            }
        }
    }
    Some(sum)
}

/// Digits of the worst channel.
fn agreement(trajectory: &Trajectory, ours: &[Vec<f64>], exact: &[Vec<f64>]) -> f64 {
    let largest = |values: &[f64]| values.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let of_channel = |((ours, exact), channel): ((&Vec<f64>, &Vec<f64>), &Vec<f64>)| {
        let size = largest(exact).max(NEGLIGIBLE * largest(channel));
        let difference = ours.iter().zip(exact).fold(0.0f64, |a, (x, y)| a.max((x - y).abs()));
        // Sixteen digits are all there are; a channel that stays zero agrees with zero.
        if difference == 0.0 { 16.0 } else { -(difference / size).log10() }
    };
    ours.iter().zip(exact).zip(&trajectory.channels).map(of_channel).fold(16.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_digit_is_seen() {
        let trajectory = Trajectory {
            channels: vec![vec![5.0, 6.0], vec![1.0, 1.0]],
            gradient: vec![vec![1.0, 2.0, 3.0, 4.0], vec![0.0; 4]],
            probes: Vec::new(),
            branchings: Vec::new(),
            moved: Vec::new(),
            work: crate::integrate::Work::default(),
        };
        let ours = directional(&trajectory, &[1.0, -1.0]);
        assert_eq!(ours, [[-2.0, -2.0], [0.0, 0.0]]);
        assert_eq!(agreement(&trajectory, &ours, &ours), 16.0);
        let wrong = vec![vec![-2.0, -2.0 + 2e-5], vec![0.0, 0.0]];
        assert!((agreement(&trajectory, &ours, &wrong) - 5.0).abs() < 1e-4);
        let small = vec![vec![-2.0, -2.0], vec![0.0, 1e-9]];
        assert!((agreement(&trajectory, &ours, &small) - 3.0).abs() < 1e-4);
    }
}
