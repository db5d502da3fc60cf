//! Many starts inside the bounds, deterministically.

use super::levenberg_marquardt::levenberg_marquardt;
use super::problem::{Bounds, Control, Estimate, FitError, LeastSquares, Options, Progress};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// `count` points in [0,1]^dimension, one in every one of `count` slices of each axis (McKay-1979); the same for the
/// same seed on every machine.
pub fn latin_hypercube(count: usize, dimension: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut points = vec![vec![0.0; dimension]; count];
    for axis in 0..dimension {
        let mut slices: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            slices.swap(last, (generator.next_u64() % (last as u64 + 1)) as usize);
        }
        for (point, slice) in points.iter_mut().zip(slices) {
            let inside = (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            point[axis] = (slice as f64 + inside) / count as f64;
        }
    }
    points
}

/// Minimises from `start` and from `further_starts` points of a Latin hypercube over the bounded parameters (those
/// without two finite bounds keep their start), and returns the results sorted by cost, best first (ties: the earlier
/// start). Starts that cannot be evaluated are left out; an error only when none can.
pub fn multi_start<P: LeastSquares + ?Sized>(
    problem: &mut P,
    start: &[f64],
    bounds: &Bounds,
    options: &Options,
    further_starts: usize,
    seed: u64,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Vec<Estimate>, FitError> {
    let mut estimates = Vec::new();
    let mut first_error = None;
    let further = latin_hypercube(further_starts, start.len(), seed);
    let starts = std::iter::once(start.to_vec()).chain(further.iter().map(|point| inside(point, start, bounds)));
    for point in starts {
        match levenberg_marquardt(problem, &point, bounds, options, observer) {
            Ok(estimate) => estimates.push(estimate),
            Err(error @ FitError::StartFails(_)) => first_error = first_error.or(Some(error)),
            Err(error) => return Err(error),
        }
    }
    estimates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    match first_error {
        Some(error) if estimates.is_empty() => Err(error),
        _ => Ok(estimates),
    }
}

fn inside(point: &[f64], start: &[f64], bounds: &Bounds) -> Vec<f64> {
    (0..start.len())
        .map(|j| {
            let (low, high) = (bounds.lower[j], bounds.upper[j]);
            if low.is_finite() && high.is_finite() { low + point[j] * (high - low) } else { start[j] }
        })
        .collect()
}
