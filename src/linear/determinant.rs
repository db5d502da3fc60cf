//! On which side of the singular matrices a matrix lies.

use nalgebra::DMatrix;

/// 1, -1, or 0 for a singular matrix; `matrix` is size x size, column-major.
pub fn sign_of_determinant(size: usize, matrix: &[f64]) -> f64 {
    let determinant = DMatrix::from_column_slice(size, size, matrix).lu().determinant();
    if determinant == 0.0 { 0.0 } else { determinant.signum() }
}

#[cfg(test)]
mod tests {
    use super::sign_of_determinant;

    #[test]
    fn an_exchange_of_rows_turns_the_sign() {
        assert_eq!(sign_of_determinant(2, &[2.0, 1.0, 1.0, 3.0]), 1.0);
        assert_eq!(sign_of_determinant(2, &[1.0, 2.0, 3.0, 1.0]), -1.0);
        assert_eq!(sign_of_determinant(2, &[1.0, 2.0, 2.0, 4.0]), 0.0);
        assert_eq!(sign_of_determinant(3, &[0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0]), 1.0);
    }
}
