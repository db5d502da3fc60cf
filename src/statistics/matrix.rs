//! Small dense symmetric algebra on column-major slices.

use crate::linear::{DecompositionError, SingularValueDecomposition, rounding_threshold};

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// A^T B for A (rows x a) and B (rows x b): a x b column-major.
pub(super) fn transposed_product(rows: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    let columns = |matrix: &[f64]| matrix.len() / rows.max(1);
    let (left, right) = (columns(a), columns(b));
    let mut product = Vec::with_capacity(left * right);
    for j in 0..right {
        for i in 0..left {
            product.push(dot(&a[i * rows..(i + 1) * rows], &b[j * rows..(j + 1) * rows]));
        }
    }
    product
}

/// A B for square p x p matrices.
pub(super) fn product(size: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut result = vec![0.0; size * size];
    for j in 0..size {
        for k in 0..size {
            let factor = b[j * size + k];
            for i in 0..size {
                result[j * size + i] += a[k * size + i] * factor;
            }
        }
    }
    result
}

pub(super) fn trace_of_product(size: usize, a: &[f64], b: &[f64]) -> f64 {
    let mut trace = 0.0;
    for i in 0..size {
        for k in 0..size {
            trace += a[k * size + i] * b[i * size + k];
        }
    }
    trace
}

/// Pseudo-inverse of a symmetric positive semidefinite matrix, and an orthonormal basis of its null space (below
/// `threshold` times the largest eigenvalue).
pub(super) fn pseudo_inverse(size: usize, matrix: &[f64], threshold: f64) -> Result<PseudoInverse, DecompositionError> {
    let decomposition = SingularValueDecomposition::new(size, size, matrix)?;
    let rank = decomposition.rank(threshold.max(rounding_threshold(size, size)));
    Ok(truncated_inverse(&decomposition, rank))
}

/// The same with the rank known.
pub(super) fn pseudo_inverse_of_rank(
    size: usize,
    matrix: &[f64],
    rank: usize,
) -> Result<PseudoInverse, DecompositionError> {
    let decomposition = SingularValueDecomposition::new(size, size, matrix)?;
    let nonzero = decomposition.singular_values.iter().filter(|&&value| value > 0.0).count();
    Ok(truncated_inverse(&decomposition, rank.min(nonzero)))
}

pub(super) struct PseudoInverse {
    /// size x size.
    pub matrix: Vec<f64>,
    /// Orthonormal basis of the null space.
    pub null: Vec<Vec<f64>>,
}

fn truncated_inverse(decomposition: &SingularValueDecomposition, rank: usize) -> PseudoInverse {
    let size = decomposition.column_count;
    let mut matrix = vec![0.0; size * size];
    for k in 0..rank {
        let (left, right) = (decomposition.left(k), decomposition.right(k));
        for j in 0..size {
            for i in 0..size {
                matrix[j * size + i] += right[i] * left[j] / decomposition.singular_values[k];
            }
        }
    }
    let null = (rank..size).map(|k| decomposition.right(k).to_vec()).collect();
    PseudoInverse { matrix, null }
}

/// Minimum-norm solution of `A x = b`, A square with a positive diagonal (rows and columns are scaled by it first).
pub(super) fn solve(size: usize, matrix: &[f64], right_side: &[f64]) -> Result<Vec<f64>, DecompositionError> {
    let scale: Vec<f64> = (0..size)
        .map(|i| matrix[i * size + i].abs().sqrt())
        .map(|value| if value > 0.0 { value } else { 1.0 })
        .collect();
    let scaled: Vec<f64> =
        matrix.iter().enumerate().map(|(k, value)| value / (scale[k % size] * scale[k / size])).collect();
    let inverse = pseudo_inverse(size, &scaled, 0.0)?.matrix;
    Ok((0..size)
        .map(|i| (0..size).map(|j| inverse[j * size + i] * right_side[j] / (scale[i] * scale[j])).sum())
        .collect())
}
