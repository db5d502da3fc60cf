//! Angles between what two groups of columns can explain.

use super::matrix::{dot, transposed_product};
use crate::linear::{DecompositionError, SingularValueDecomposition, rounding_threshold};

/// Principal angles (rad, ascending) between the column spans of `a` and `b` (both N x any, column-major), by
/// Bjorck-Golub-1973; accurate for small angles too. As many as the smaller dimension; empty where a span is empty.
pub fn principal_angles(rows: usize, a: &[f64], b: &[f64]) -> Result<Vec<f64>, DecompositionError> {
    let (first, second) = (orthonormal(rows, a)?, orthonormal(rows, b)?);
    let (larger, smaller) = if first.len() >= second.len() { (first, second) } else { (second, first) };
    let dimension = smaller.len() / rows.max(1);
    if dimension == 0 {
        return Ok(Vec::new());
    }
    let cosines = transposed_product(rows, &larger, &smaller);
    let decomposition = SingularValueDecomposition::new(larger.len() / rows, dimension, &cosines)?;
    let mut angles: Vec<f64> = (0..dimension)
        .map(|k| {
            let mut vector = combined(rows, &smaller, decomposition.right(k));
            for column in larger.chunks_exact(rows) {
                let share = dot(column, &vector);
                vector.iter_mut().zip(column).for_each(|(value, entry)| *value -= share * entry);
            }
            dot(&vector, &vector).sqrt().atan2(decomposition.singular_values[k])
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    Ok(angles)
}

/// Basis of the span, columns scaled to length one before its rank is judged.
fn orthonormal(rows: usize, columns: &[f64]) -> Result<Vec<f64>, DecompositionError> {
    let mut scaled = columns.to_vec();
    for column in scaled.chunks_exact_mut(rows.max(1)) {
        let length = dot(column, column).sqrt();
        if length > 0.0 {
            column.iter_mut().for_each(|value| *value /= length);
        }
    }
    let count = scaled.len() / rows.max(1);
    let decomposition = SingularValueDecomposition::new(rows, count, &scaled)?;
    let nonzero = decomposition.singular_values.first().is_some_and(|&largest| largest > 0.0);
    let rank = if nonzero { decomposition.rank(rounding_threshold(rows, count)) } else { 0 };
    Ok(decomposition.u[..rank * rows].to_vec())
}

fn combined(rows: usize, columns: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; rows];
    for (column, weight) in columns.chunks_exact(rows).zip(weights) {
        sum.iter_mut().zip(column).for_each(|(value, entry)| *value += weight * entry);
    }
    sum
}
