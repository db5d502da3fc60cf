//! Orthonormal basis of a column span, and projection onto its complement.

use nalgebra::{DMatrix, DVector, Vector3};

/// Columns whose norm falls below this share of the largest, after the others were taken out, do not count.
const RANK_TOLERANCE: f64 = 1e-9;

/// Orthonormal basis of the span of some columns.
#[derive(Clone, Debug)]
pub struct Basis {
    rows: usize,
    /// rows x rank, column-major.
    columns: Vec<f64>,
}

impl Basis {
    /// From `columns`, rows x count column-major. Columns are scaled to unit length first, so their units do not
    /// matter.
    pub fn new(columns: &[f64], rows: usize) -> Self {
        let count = columns.len().checked_div(rows).unwrap_or(0);
        let mut matrix = DMatrix::from_column_slice(rows, count, columns);
        for mut column in matrix.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        let decomposition = matrix.col_piv_qr();
        let diagonal = decomposition.r().diagonal().abs();
        let largest = diagonal.iter().copied().fold(0.0, f64::max);
        let rank = diagonal.iter().filter(|&&value| value > RANK_TOLERANCE * largest && value > 0.0).count();
        let q = decomposition.q();
        Self { rows, columns: q.columns(0, rank.min(q.ncols())).iter().copied().collect() }
    }

    pub fn rank(&self) -> usize {
        self.columns.len().checked_div(self.rows).unwrap_or(0)
    }

    /// Takes the part within the span out of `vector` (length rows).
    pub fn project_out(&self, vector: &mut [f64]) {
        if self.rows == 0 {
            return;
        }
        for direction in self.columns.chunks_exact(self.rows) {
            let coefficient: f64 = direction.iter().zip(vector.iter()).map(|(d, v)| d * v).sum();
            for (value, d) in vector.iter_mut().zip(direction) {
                *value -= coefficient * d;
            }
        }
    }
}

/// Minimises `|target - columns * x|`; `columns` is rows x count column-major. Columns without any length get 0.
/// `None` where the decomposition fails (non-finite entries).
pub fn least_squares(columns: &[f64], rows: usize, target: &[f64]) -> Option<Vec<f64>> {
    if rows == 0 || columns.iter().chain(target).any(|value| !value.is_finite()) {
        return None;
    }
    let count = columns.len() / rows;
    if count == 0 {
        return Some(Vec::new());
    }
    let mut matrix = DMatrix::from_column_slice(rows, count, columns);
    let norms: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    for (mut column, &norm) in matrix.column_iter_mut().zip(&norms) {
        if norm > 0.0 {
            column /= norm;
        }
    }
    let normal = matrix.tr_mul(&matrix);
    let right = matrix.tr_mul(&DVector::from_column_slice(target));
    let decomposition = normal.svd(true, true);
    let solution = decomposition.solve(&right, RANK_TOLERANCE).ok()?;
    Some(solution.iter().zip(&norms).map(|(x, &norm)| if norm > 0.0 { x / norm } else { 0.0 }).collect())
}

/// Two unit vectors that are perpendicular to a direction in space and to each other.
pub fn perpendicular(direction: [f64; 3]) -> [[f64; 3]; 2] {
    let direction = Vector3::from(direction);
    let mut helper = Vector3::zeros();
    helper[direction.iamin()] = 1.0;
    let first = direction.cross(&helper).normalize();
    [first, direction.cross(&first).normalize()].map(Into::into)
}

#[cfg(test)]
mod tests {
    use super::{Basis, least_squares, perpendicular};

    #[test]
    fn nothing_is_fitted_by_no_columns() {
        assert_eq!(least_squares(&[], 3, &[1.0, 2.0, 3.0]), Some(Vec::new()));
    }

    #[test]
    fn projection_leaves_nothing_of_the_columns_and_keeps_the_rest() {
        let rows = 6;
        let a = [1.0, 2.0, 0.0, -1.0, 3.0, 0.5];
        let b = [0.0, 1.0, 1.0, 1.0, 0.0, 2.0];
        let combination: Vec<f64> = a.iter().zip(&b).map(|(x, y)| 1e6 * x - 2.0 * y).collect();
        let columns: Vec<f64> = [a.as_slice(), &b, &combination].concat();
        let basis = Basis::new(&columns, rows);
        assert_eq!(basis.rank(), 2, "the third column is a combination of the first two");
        let mut inside: Vec<f64> = a.iter().zip(&b).map(|(x, y)| 0.3 * x + 4.0 * y).collect();
        basis.project_out(&mut inside);
        assert!(inside.iter().all(|value| value.abs() < 1e-12), "{inside:?}");
        let mut outside = [0.3, -1.0, 2.0, 0.7, 0.1, 0.0];
        basis.project_out(&mut outside);
        for column in [a, b] {
            let product: f64 = column.iter().zip(&outside).map(|(x, y)| x * y).sum();
            assert!(product.abs() < 1e-12);
        }
        assert!(outside.iter().any(|value| value.abs() > 0.1));
    }

    #[test]
    fn no_columns_project_nothing() {
        let basis = Basis::new(&[], 3);
        let mut vector = [1.0, 2.0, 3.0];
        basis.project_out(&mut vector);
        assert_eq!(vector, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn least_squares_recovers_an_exact_combination_in_any_units() {
        let a = [1.0, 2.0, 0.0, -1.0];
        let b = [1e7, -3e7, 2e7, 1e7];
        let target: Vec<f64> = a.iter().zip(&b).map(|(x, y)| 3.0 * x - 2e-7 * y).collect();
        let solution = least_squares(&[a, b].concat(), 4, &target).expect("finite");
        assert!((solution[0] - 3.0).abs() < 1e-12 && (solution[1] + 2e-7).abs() < 1e-18, "{solution:?}");
    }

    #[test]
    fn perpendicular_directions() {
        for direction in [[0.0, 0.0, 1.0], [3.0, 0.0, 4.0], [-0.3, 2.0, 0.1]] {
            let [a, b] = perpendicular(direction);
            let product = |x: [f64; 3], y: [f64; 3]| (0..3).map(|i| x[i] * y[i]).sum::<f64>();
            for value in [product(a, direction), product(b, direction), product(a, b)] {
                assert!(value.abs() < 1e-15, "{direction:?}: {a:?}, {b:?}");
            }
            assert!((product(a, a) - 1.0).abs() < 1e-15 && (product(b, b) - 1.0).abs() < 1e-15);
        }
    }
}
