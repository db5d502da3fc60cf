//! Singular value decomposition of dense, mostly tall, matrices.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Mat, MatRef, Par};

/// `A = U diag(sigma) V^T` with k = min(m, n) singular values.
#[derive(Clone, Debug, PartialEq)]
pub struct SingularValueDecomposition {
    /// Orthonormal columns, m x k column-major.
    pub u: Vec<f64>,
    /// Length k, descending, non-negative.
    pub singular_values: Vec<f64>,
    /// Orthonormal columns, n x k column-major; column j belongs to `singular_values[j]`.
    pub v: Vec<f64>,
    pub row_count: usize,
    pub column_count: usize,
}

/// Why there is no decomposition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecompositionError {
    /// The matrix contains an infinite number or none at all (NaN).
    NotFinite,
    NoConvergence,
}

impl SingularValueDecomposition {
    /// Thin decomposition of the `row_count` x `column_count` column-major `matrix`. Sequential, so that the digits
    /// do not depend on the number of threads.
    ///
    /// # Panics
    /// If `matrix.len() != row_count * column_count`.
    pub fn new(row_count: usize, column_count: usize, matrix: &[f64]) -> Result<Self, DecompositionError> {
        assert_eq!(matrix.len(), row_count * column_count, "shape of the matrix");
        if matrix.iter().any(|value| !value.is_finite()) {
            return Err(DecompositionError::NotFinite);
        }
        let size = row_count.min(column_count);
        let mut u = Mat::<f64>::zeros(row_count, size);
        let mut v = Mat::<f64>::zeros(column_count, size);
        let mut sigma = faer::diag::Diag::<f64>::zeros(size);
        let thin = ComputeSvdVectors::Thin;
        let scratch = svd_scratch::<f64>(row_count, column_count, thin, thin, Par::Seq, Default::default());
        svd(
            MatRef::from_column_major_slice(matrix, row_count, column_count),
            sigma.as_mut(),
            Some(u.as_mut()),
            Some(v.as_mut()),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        )
        .map_err(|_| DecompositionError::NoConvergence)?;
        let singular_values: Vec<f64> = sigma.column_vector().iter().map(|value| value.max(0.0)).collect();
        Ok(Self { u: column_major(&u), singular_values, v: column_major(&v), row_count, column_count })
    }

    /// Number of singular values above `relative_threshold` times the largest.
    pub fn rank(&self, relative_threshold: f64) -> usize {
        let largest = self.singular_values.first().copied().unwrap_or(0.0);
        self.singular_values.iter().filter(|&&value| value > relative_threshold * largest).count()
    }

    /// Column j of U, length m.
    pub fn left(&self, j: usize) -> &[f64] {
        &self.u[j * self.row_count..(j + 1) * self.row_count]
    }

    /// Column j of V, length n.
    pub fn right(&self, j: usize) -> &[f64] {
        &self.v[j * self.column_count..(j + 1) * self.column_count]
    }
}

/// Singular values below this multiple of the largest are rounding errors (Golub-VanLoan-2013, 5.4.1).
pub fn rounding_threshold(row_count: usize, column_count: usize) -> f64 {
    row_count.max(column_count) as f64 * f64::EPSILON
}

fn column_major(matrix: &Mat<f64>) -> Vec<f64> {
    matrix.col_iter().flat_map(|column| column.iter().copied().collect::<Vec<_>>()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hilbert-like tall matrix: reproduces A, orthonormal factors.
    #[test]
    fn reproduces_the_matrix() {
        let (m, n) = (40, 6);
        let matrix: Vec<f64> = (0..n).flat_map(|j| (0..m).map(move |i| 1.0 / (1.0 + i as f64 + j as f64))).collect();
        let decomposition = SingularValueDecomposition::new(m, n, &matrix).unwrap();
        for j in 0..n {
            for i in 0..m {
                let product: f64 = (0..n)
                    .map(|k| decomposition.left(k)[i] * decomposition.singular_values[k] * decomposition.right(k)[j])
                    .sum();
                assert!((product - matrix[j * m + i]).abs() < 1e-14);
            }
        }
        for a in 0..n {
            for b in 0..n {
                let inner: f64 = decomposition.left(a).iter().zip(decomposition.left(b)).map(|(x, y)| x * y).sum();
                assert!((inner - f64::from(a == b)).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn wide_and_rank_deficient() {
        let matrix = [1.0, 2.0, 2.0, 4.0, 3.0, 6.0];
        let decomposition = SingularValueDecomposition::new(2, 3, &matrix).unwrap();
        assert_eq!(decomposition.rank(1e-12), 1);
        assert!((decomposition.singular_values[0] - (5.0_f64 * 14.0).sqrt()).abs() < 1e-13);
    }

    #[test]
    fn refuses_what_is_not_finite() {
        assert_eq!(SingularValueDecomposition::new(2, 1, &[1.0, f64::NAN]), Err(DecompositionError::NotFinite));
    }
}
