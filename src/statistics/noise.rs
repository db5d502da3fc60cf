//! Variance of the measurement noise from the filtered residual (method 4.5 - 4.7).

use super::matrix::{product, pseudo_inverse, solve, trace_of_product, transposed_product};
use crate::linear::DecompositionError;

/// Residual of one channel in one record at the optimum.
#[derive(Clone, Copy, Debug)]
pub struct NoiseChannel<'a> {
    /// Blocks with the same number share one noise variance (a channel in several records).
    pub channel: usize,
    /// Weighted and filtered, length n.
    pub residual: &'a [f64],
    /// Weighted and filtered gradient, n x p column-major, of the parameters that were free.
    pub gradient: &'a [f64],
    /// Factor from the unweighted residual.
    pub weight: f64,
    /// trace(F^T F) for n samples: `Prefilter::trace(n)`, or n without a filter.
    pub trace: f64,
}

/// Variance of white noise from the filtered residual's sum of squares, without the share of the fitted parameters
/// (method 4.6).
pub fn noise_variance(sum_of_squares: f64, trace: f64) -> f64 {
    sum_of_squares / trace
}

/// Unbiased noise variances per channel (unweighted, before the filter), the share that the fitted parameters have
/// taken included (method 4.5, for several channels at once).
///
/// With P the stacked gradient and X = P^T P, the residual of block i is F d_i - P_i X^+ sum_j P_j^T F d_j; its
/// expected square is linear in the channels' variances, which solves for them. Returns one variance per channel number
/// 0 ..= largest. `filter` applies the prefilter of a block (by its place in `blocks`) to a column; a zero-phase filter
/// is its own transpose but for the ends.
/// `prior_information`: p x p Gram matrix of prior rows, if any. Undetermined directions (below `threshold`, scaled by
/// `scale`) count as not fitted.
pub fn noise_variances(
    blocks: &[NoiseChannel],
    scale: &[f64],
    prior_information: Option<&[f64]>,
    threshold: f64,
    filter: &dyn Fn(usize, &mut [f64]),
) -> Result<Vec<f64>, DecompositionError> {
    let count = scale.len();
    let scaling = |gram: Vec<f64>| -> Vec<f64> {
        gram.iter().enumerate().map(|(k, value)| value * scale[k % count] * scale[k / count]).collect()
    };
    let grams: Vec<Vec<f64>> = blocks
        .iter()
        .map(|block| scaling(transposed_product(block.residual.len(), block.gradient, block.gradient)))
        .collect();
    let coloured: Vec<Vec<f64>> = blocks
        .iter()
        .enumerate()
        .map(|(i, block)| scaling(filtered_gram(block, &|column| filter(i, column))))
        .collect();
    let prior = prior_information.map(|gram| scaling(gram.to_vec()));
    let mut information = prior.clone().unwrap_or_else(|| vec![0.0; count * count]);
    grams.iter().for_each(|gram| information.iter_mut().zip(gram).for_each(|(sum, value)| *sum += value));
    // Singular values of the gradient are square roots of those of its Gram matrix.
    let inverse = pseudo_inverse(count, &information, threshold * threshold)?.matrix;

    let channels = blocks.iter().map(|block| block.channel + 1).max().unwrap_or(0);
    let mut system = vec![0.0; channels * channels];
    let mut right_side = vec![0.0; channels];
    for (i, block) in blocks.iter().enumerate() {
        let row = block.channel;
        let spread = product(count, &product(count, &inverse, &grams[i]), &inverse);
        let own = block.trace - 2.0 * trace_of_product(count, &inverse, &coloured[i]);
        system[row * channels + row] += block.weight * block.weight * own;
        for (j, other) in blocks.iter().enumerate() {
            system[other.channel * channels + row] +=
                other.weight * other.weight * trace_of_product(count, &spread, &coloured[j]);
        }
        let energy: f64 = block.residual.iter().map(|value| value * value).sum();
        let from_prior = prior.as_ref().map_or(0.0, |gram| trace_of_product(count, &spread, gram));
        right_side[row] += energy - from_prior;
    }
    Ok(solve(channels, &system, &right_side)?.into_iter().map(|variance| variance.max(0.0)).collect())
}

/// (F^T P)^T (F^T P).
fn filtered_gram(block: &NoiseChannel, filter: &dyn Fn(&mut [f64])) -> Vec<f64> {
    let rows = block.residual.len();
    let mut columns = block.gradient.to_vec();
    columns.chunks_exact_mut(rows.max(1)).for_each(filter);
    transposed_product(rows, &columns, &columns)
}
