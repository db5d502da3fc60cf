//! Many starts inside the bounds, deterministically.

use super::levenberg_marquardt::levenberg_marquardt;
use super::problem::{Bounds, Control, Estimate, FitError, LeastSquares, Options, Progress};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// `count` points in `[0,1]^dimension`, one in every one of `count` slices of each axis (McKay-1979); the same for the
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
    for point in parallel_starts(start, bounds, further_starts, seed) {
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

/// The start itself and `further_starts` points as [`multi_start`] takes them, for searches that run beside each other.
pub fn parallel_starts(start: &[f64], bounds: &Bounds, further_starts: usize, seed: u64) -> Vec<Vec<f64>> {
    let further = latin_hypercube(further_starts, start.len(), seed);
    std::iter::once(start.to_vec()).chain(further.iter().map(|point| inside(point, start, bounds))).collect()
}

fn inside(point: &[f64], start: &[f64], bounds: &Bounds) -> Vec<f64> {
    (0..start.len())
        .map(|j| {
            let (low, high) = (bounds.lower[j], bounds.upper[j]);
            if low.is_finite() && high.is_finite() { low + point[j] * (high - low) } else { start[j] }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{EvaluationFailure, PriorRow, WithPriors};

    /// One slice per start on every axis, and the same points again.
    #[test]
    fn the_hypercube_fills_every_slice() {
        let points = latin_hypercube(16, 3, 42);
        for axis in 0..3 {
            let mut slices: Vec<usize> = points.iter().map(|point| (point[axis] * 16.0) as usize).collect();
            slices.sort_unstable();
            assert_eq!(slices, (0..16).collect::<Vec<_>>());
        }
        assert_eq!(points, latin_hypercube(16, 3, 42));
        assert_ne!(points, latin_hypercube(16, 3, 43));
    }

    /// Measurements of sin(w t): a frequency has many local minima.
    struct Frequency;

    impl LeastSquares for Frequency {
        fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
            Ok(self.residual_and_gradient(theta)?.0)
        }

        fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
            if theta[0] > 26.0 {
                return Err(EvaluationFailure { explanation: "too fast".to_owned() });
            }
            let times = (0..60).map(|k| 0.02 * f64::from(k));
            Ok(times.map(|t| ((theta[0] * t).sin() - (17.0 * t).sin(), t * (theta[0] * t).cos())).unzip())
        }
    }

    #[test]
    fn many_starts_find_the_global_minimum() {
        let bounds = Bounds::new(vec![1.0], vec![30.0]);
        let mut quiet = |_: &Progress| Control::Continue;
        let alone = levenberg_marquardt(&mut Frequency, &[4.0], &bounds, &Options::default(), &mut quiet).unwrap();
        assert!((alone.theta[0] - 17.0).abs() > 1.0, "{:?}", alone.theta);
        let all = multi_start(&mut Frequency, &[4.0], &bounds, &Options::default(), 12, 1, &mut quiet).unwrap();
        assert!((all[0].theta[0] - 17.0).abs() < 1e-4, "{:?}", all[0].theta);
        assert!(all.len() < 13, "a start that cannot be evaluated is left out");
        assert!(all.windows(2).all(|pair| pair[0].cost <= pair[1].cost));
    }

    /// y = theta with variance 1 and a prior 3 +- 0.5: the posterior mean is (y + 4 * 3) / 5.
    #[test]
    fn priors_are_weighted_rows() {
        struct One;
        impl LeastSquares for One {
            fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
                Ok(vec![theta[0] - 1.0])
            }
            fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
                Ok((vec![theta[0] - 1.0], vec![1.0, 0.0]))
            }
        }
        let rows = [PriorRow::gaussian(0, 3.0, 0.5), PriorRow::gaussian(1, 7.0, 2.0)];
        let mut problem = WithPriors { problem: &mut One, rows: &rows };
        let mut quiet = |_: &Progress| Control::Continue;
        let bounds = Bounds::none(2);
        let estimate =
            levenberg_marquardt(&mut problem, &[0.0, 0.0], &bounds, &Options::default(), &mut quiet).unwrap();
        assert!(
            (estimate.theta[0] - 13.0 / 5.0).abs() < 1e-7 && (estimate.theta[1] - 7.0).abs() < 1e-6,
            "{:?}",
            estimate.theta
        );
        assert_eq!(estimate.gradient, [1.0, 2.0, 0.0, 0.0, 0.0, 0.5]);
    }
}
