//! Moving-block bootstrap of the change of a held-out error.

use crate::signal::effective_count;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Relative change of the cost V from the base to the extended model: -0.3 means 30 % less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorChange {
    pub estimate: f64,
    pub lower: f64,
    pub upper: f64,
}

impl ErrorChange {
    /// The same as change of the error's norm (root mean square) instead of its square.
    pub fn of_norm(&self) -> Self {
        let root = |change: f64| (1.0 + change).max(0.0).sqrt() - 1.0;
        Self { estimate: root(self.estimate), lower: root(self.lower), upper: root(self.upper) }
    }

    /// The error falls, and the interval excludes that it does not.
    pub fn is_improvement(&self) -> bool {
        self.upper < 0.0
    }
}

/// Percentile interval of the relative change of the summed squared residuals (Kunsch-1989): blocks of
/// `block_length` successive samples are drawn with replacement within each record, the same for both models and for
/// all channels. Deterministic: the same seed gives the same digits on every machine.
///
/// `records`: per record the squared residuals of (base, extended), summed over weighted channels, per sample. `None`
/// without samples, or where the base model has no error at all.
pub fn error_change(
    records: &[(Vec<f64>, Vec<f64>)],
    block_length: usize,
    replicates: usize,
    level: f64,
    seed: u64,
) -> Option<ErrorChange> {
    let sums: Vec<Running> = records.iter().filter_map(|(base, extended)| Running::new(base, extended)).collect();
    let total = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
        pairs.fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1))
    };
    let (base, extended) = total(&mut sums.iter().map(Running::all));
    if base.is_nan() || base <= 0.0 || replicates == 0 {
        return None;
    }
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut changes: Vec<f64> = (0..replicates)
        .map(|_| {
            let (base, extended) = total(&mut sums.iter().map(|record| record.draw(block_length, &mut generator)));
            if base > 0.0 { extended / base - 1.0 } else { 0.0 }
        })
        .collect();
    changes.sort_by(f64::total_cmp);
    let quantile = |probability: f64| changes[((replicates - 1) as f64 * probability).round() as usize];
    let tail = 0.5 * (1.0 - level);
    Some(ErrorChange { estimate: extended / base - 1.0, lower: quantile(tail), upper: quantile(1.0 - tail) })
}

/// Length of blocks that keep the dependence of a series: twice its correlation time (N over the effective count), at
/// least the cube root of N, at most an eighth of it.
pub fn block_length(series: &[f64]) -> usize {
    let count = series.len();
    let correlated = 2.0 * count as f64 / effective_count(series).max(1.0);
    let shortest = (count as f64).cbrt();
    (correlated.max(shortest).ceil() as usize).clamp(1, (count / 8).max(1))
}

/// Cumulated squared residuals of one record.
struct Running {
    base: Vec<f64>,
    extended: Vec<f64>,
}

impl Running {
    fn new(base: &[f64], extended: &[f64]) -> Option<Self> {
        let cumulated = |values: &[f64]| {
            let mut sums = vec![0.0];
            values.iter().for_each(|value| sums.push(sums[sums.len() - 1] + value));
            sums
        };
        let count = base.len().min(extended.len());
        (count > 0).then(|| Self { base: cumulated(&base[..count]), extended: cumulated(&extended[..count]) })
    }

    fn count(&self) -> usize {
        self.base.len() - 1
    }

    fn all(&self) -> (f64, f64) {
        (self.base[self.count()], self.extended[self.count()])
    }

    /// Sums over as many drawn samples as the record has; the last block is cut.
    fn draw(&self, block_length: usize, generator: &mut ChaCha8Rng) -> (f64, f64) {
        let count = self.count();
        let length = block_length.clamp(1, count);
        let mut remaining = count;
        let (mut base, mut extended) = (0.0, 0.0);
        while remaining > 0 {
            let taken = length.min(remaining);
            let first = (generator.next_u64() % (count - length + 1) as u64) as usize;
            base += self.base[first + taken] - self.base[first];
            extended += self.extended[first + taken] - self.extended[first];
            remaining -= taken;
        }
        (base, extended)
    }
}
