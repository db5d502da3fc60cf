//! Comparison of model structures: information criteria, residuals block by block.

use super::significance::student_quantile;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Bayesian information criterion with unknown variance: `n ln(V / N) + p ln n`, n the effective and N the plain count
/// of residuals (Schwarz-1978). Smaller is better.
pub fn bic(cost: f64, count: usize, effective_count: f64, parameters: usize) -> f64 {
    effective_count * (cost / count as f64).ln() + parameters as f64 * effective_count.ln()
}

/// Corrected Akaike criterion with unknown variance (Hurvich-Tsai-1989); infinite where there are too few residuals.
pub fn aicc(cost: f64, count: usize, effective_count: f64, parameters: usize) -> f64 {
    // The variance is a parameter too.
    let k = parameters as f64 + 1.0;
    let remaining = effective_count - k - 1.0;
    if remaining <= 0.0 {
        return f64::INFINITY;
    }
    effective_count * (cost / count as f64).ln() + 2.0 * k + 2.0 * k * (k + 1.0) / remaining
}

/// Two residual records of the same data compared in consecutive blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockComparison {
    /// Sum of squares of (base, extended) per block.
    pub costs: Vec<(f64, f64)>,
    /// Blocks in which the extended model is better.
    pub wins: usize,
    /// Mean over the blocks of ln(extended / base); negative is better.
    pub mean_log_ratio: f64,
    /// 95 % interval of that mean, blocks taken as independent.
    pub interval: (f64, f64),
    /// Two-sided p-value that the mean is zero.
    pub p_value: f64,
}

/// Compares residuals of equal length (weighted, filtered; one slice of samples per channel) in `blocks` blocks of
/// time. Blocks without any error in one of the two are left out of the mean. `None` for fewer than two blocks.
pub fn compare_blocks(base: &[&[f64]], extended: &[&[f64]], blocks: usize) -> Option<BlockComparison> {
    let samples = base.iter().chain(extended).map(|channel| channel.len()).min()?;
    if blocks < 2 || samples < blocks {
        return None;
    }
    let energy = |channels: &[&[f64]], from: usize, to: usize| {
        channels.iter().flat_map(|channel| &channel[from..to]).map(|value| value * value).sum::<f64>()
    };
    let costs: Vec<(f64, f64)> = (0..blocks)
        .map(|k| (k * samples / blocks, (k + 1) * samples / blocks))
        .map(|(from, to)| (energy(base, from, to), energy(extended, from, to)))
        .collect();
    let ratios: Vec<f64> = costs.iter().filter(|(a, b)| *a > 0.0 && *b > 0.0).map(|(a, b)| (b / a).ln()).collect();
    if ratios.len() < 2 {
        return None;
    }
    let count = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / count;
    let variance = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = (variance / count).sqrt();
    let half_width = student_quantile(0.975, count - 1.0) * error;
    let p_value = if error > 0.0 {
        StudentsT::new(0.0, 1.0, count - 1.0).map_or(f64::NAN, |student| 2.0 * student.sf((mean / error).abs()))
    } else {
        f64::from(mean == 0.0)
    };
    Some(BlockComparison {
        wins: costs.iter().filter(|(a, b)| b < a).count(),
        costs,
        mean_log_ratio: mean,
        interval: (mean - half_width, mean + half_width),
        p_value,
    })
}
