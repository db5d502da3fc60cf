//! Reproducible normal samples.

use super::normal_quantile;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Standard normal numbers; one stream per purpose (sample, start, replicate), so that the digits depend neither on the
/// order nor on the thread in which streams are used.
#[derive(Clone, Debug)]
pub struct NormalStream {
    generator: ChaCha8Rng,
}

impl NormalStream {
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self { generator }
    }

    /// Uniform in the open interval 0 .. 1.
    pub fn uniform(&mut self) -> f64 {
        ((self.generator.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        normal_quantile(self.uniform())
    }

    pub fn normals(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.normal()).collect()
    }
}

/// A matrix square root L (size x size, column-major, `L L^T = matrix`) of a symmetric positive semidefinite matrix:
/// its eigenvectors times the roots of the eigenvalues. `scale` (positive) makes rows comparable first.
///
/// # Errors
/// When the matrix holds a number that is not finite.
pub fn covariance_root(matrix: &[f64], scale: &[f64]) -> Result<Vec<f64>, crate::linear::DecompositionError> {
    let size = scale.len();
    let scaled: Vec<f64> =
        matrix.iter().enumerate().map(|(k, value)| value / (scale[k % size] * scale[k / size])).collect();
    let decomposition = crate::linear::SingularValueDecomposition::new(size, size, &scaled)?;
    let mut root = vec![0.0; size * size];
    for (k, value) in decomposition.singular_values.iter().enumerate() {
        for (i, entry) in decomposition.right(k).iter().enumerate() {
            root[k * size + i] = scale[i] * entry * value.max(0.0).sqrt();
        }
    }
    Ok(root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_normal_independent_and_reproducible() {
        let draw = |stream| NormalStream::new(7, stream).normals(20_000);
        let (a, b) = (draw(0), draw(1));
        assert_eq!(a, draw(0));
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / 20_000.0;
        assert!(mean(&mut a.iter().copied()).abs() < 0.03);
        assert!((mean(&mut a.iter().map(|v| v * v)) - 1.0).abs() < 0.03);
        assert!(mean(&mut a.iter().zip(&b).map(|(x, y)| x * y)).abs() < 0.03);
        assert!((mean(&mut a.iter().map(|v| f64::from(v.abs() < 1.96))) - 0.95).abs() < 0.006);
    }

    #[test]
    fn the_root_of_a_singular_covariance_multiplies_back() {
        let matrix = [4.0, 2e-3, 2e-3, 1e-6];
        let root = covariance_root(&matrix, &[2.0, 1e-3]).unwrap();
        for i in 0..2 {
            for j in 0..2 {
                let value: f64 = (0..2).map(|k| root[k * 2 + i] * root[k * 2 + j]).sum();
                assert!((value - matrix[j * 2 + i]).abs() < 1e-12 * matrix[0], "{value}");
            }
        }
    }
}
