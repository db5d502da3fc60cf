//! One square matrix of fixed structure, factorised many times and solved for many right-hand sides.

use super::dense_lu::DenseLu;
use super::pattern::SparsityPattern;
use super::sparse_lu::SparseLu;

/// No pivot could be found: the matrix is singular to working precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SingularMatrix {
    /// Column (unknown) that the columns eliminated before it already determine.
    pub column: usize,
}

/// Up to this dimension the dense method needs less time even for nearly empty matrices.
const DENSE_DIMENSION: usize = 20;
/// Above this share of structural entries a sparse method gains nothing.
const DENSE_FILL: f64 = 0.4;

/// LU factors of a square matrix, dense or sparse, chosen once by size and share of entries.
#[derive(Clone, Debug)]
pub struct Factorisation {
    method: Method,
    dimension: usize,
}

#[derive(Clone, Debug)]
enum Method {
    Dense(DenseLu),
    Sparse(Box<SparseLu>),
}

impl Factorisation {
    /// Analyses the structure; the values come with [`Factorisation::factor`]. The pattern must be square.
    pub fn new(pattern: &SparsityPattern) -> Self {
        Self::of_leading(pattern, pattern.column_count)
    }

    /// As [`Factorisation::new`], for right-hand sides that are zero and solutions that nobody reads behind the first
    /// `wanted` elements; what a solution leaves there is arbitrary.
    pub fn of_leading(pattern: &SparsityPattern, wanted: usize) -> Self {
        let n = pattern.column_count;
        let dense = n <= DENSE_DIMENSION || pattern.len() as f64 > DENSE_FILL * (n * n) as f64;
        let method = if dense {
            Method::Dense(DenseLu::new(pattern))
        } else {
            Method::Sparse(Box::new(SparseLu::new(pattern, wanted)))
        };
        Self { method, dimension: n }
    }

    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Factorises the matrix with these values, in the order of the pattern. After an error the factors are unusable.
    pub fn factor(&mut self, values: &[f64]) -> Result<(), SingularMatrix> {
        match &mut self.method {
            Method::Dense(lu) => lu.factor(values),
            Method::Sparse(lu) => lu.factor(values),
        }
    }

    /// Solves in place for one right-hand side of length n.
    pub fn solve(&mut self, right_hand_side: &mut [f64]) {
        self.solve_block(right_hand_side, 1);
    }

    /// Solves in place for `width` right-hand sides, stored row by row (n x width): the inner loops run along the
    /// rows, so that one pass over the factors serves every column.
    pub fn solve_block(&mut self, right_hand_sides: &mut [f64], width: usize) {
        match &mut self.method {
            Method::Dense(lu) => lu.solve_block(right_hand_sides, width),
            Method::Sparse(lu) => lu.solve_block(right_hand_sides, width),
        }
    }
}

/// `x[target] -= factor * x[source]` for rows of length `width`; the rows must differ.
#[inline]
pub(super) fn subtract_row(x: &mut [f64], target: usize, source: usize, width: usize, factor: f64) {
    let (to, from) = if target < source {
        let (low, high) = x.split_at_mut(source * width);
        (&mut low[target * width..][..width], &high[..width])
    } else {
        let (low, high) = x.split_at_mut(target * width);
        (&mut high[..width], &low[source * width..][..width])
    };
    for (a, b) in to.iter_mut().zip(from) {
        *a -= factor * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn product(pattern: &SparsityPattern, values: &[f64], x: &[f64], width: usize) -> Vec<f64> {
        let mut result = vec![0.0; pattern.row_count * width];
        for column in 0..pattern.column_count {
            for k in pattern.starts[column]..pattern.starts[column + 1] {
                for c in 0..width {
                    result[pattern.rows[k] * width + c] += values[k] * x[column * width + c];
                }
            }
        }
        result
    }

    fn band(n: usize, offsets: &[i64]) -> SparsityPattern {
        let entries: Vec<_> = (0..n as i64)
            .flat_map(|column| offsets.iter().map(move |o| (column + o, column)))
            .filter(|(row, _)| (0..n as i64).contains(row))
            .map(|(row, column)| (row as usize, column as usize))
            .collect();
        SparsityPattern::from_entries(n, n, &entries)
    }

    fn check(pattern: &SparsityPattern, values: &[f64], width: usize, tolerance: f64) {
        let n = pattern.column_count;
        let solution: Vec<f64> = (0..n * width).map(|i| ((i * 37 % 101) as f64 - 50.0) / 50.0).collect();
        let mut x = product(pattern, values, &solution, width);
        let mut factorisation = Factorisation::new(pattern);
        factorisation.factor(values).unwrap();
        factorisation.solve_block(&mut x, width);
        for (a, b) in x.iter().zip(&solution) {
            assert!((a - b).abs() < tolerance, "{a} {b}");
        }
    }

    proptest! {
        #[test]
        fn solves_random_matrices(n in 1usize..60, seed in prop::collection::vec(-1.0f64..1.0, 600), width in 1usize..5) {
            let pattern = band(n, &[-7, -1, 0, 1, 2, 11]);
            let mut values: Vec<f64> = (0..pattern.len()).map(|k| seed[k % seed.len()]).collect();
            for column in 0..n {
                let entries = pattern.starts[column]..pattern.starts[column + 1];
                let diagonal = pattern.rows[entries.clone()].iter().position(|&row| row == column).unwrap();
                values[entries][diagonal] += 4.0;
            }
            check(&pattern, &values, width, 1e-9);
        }
    }

    #[test]
    fn pivots_past_zero_diagonals_when_values_change() {
        for n in [8, 40] {
            let pattern = band(n, &[-1, 0, 1]);
            let value = |diagonal: f64| -> Vec<f64> {
                (0..n)
                    .flat_map(|column| (pattern.starts[column]..pattern.starts[column + 1]).map(move |k| (k, column)))
                    .map(|(k, column)| if pattern.rows[k] == column { diagonal } else { 1.0 + (k % 3) as f64 })
                    .collect()
            };
            let mut factorisation = Factorisation::new(&pattern);
            // The pivot order found for a dominant diagonal is useless for a zero one.
            for diagonal in [100.0, 0.0, 100.0] {
                let values = value(diagonal);
                factorisation.factor(&values).unwrap();
                let solution: Vec<f64> = (0..n).map(|i| i as f64).collect();
                let mut x = product(&pattern, &values, &solution, 1);
                factorisation.solve(&mut x);
                assert!(x.iter().zip(&solution).all(|(a, b)| (a - b).abs() < 1e-9), "{x:?}");
            }
        }
    }

    #[test]
    fn names_the_undetermined_column() {
        for n in [6, 50] {
            let pattern = band(n, &[0, 1]);
            let mut values = vec![1.0; pattern.len()];
            let last = n - 1;
            values[pattern.starts[last]] = 0.0;
            assert_eq!(Factorisation::new(&pattern).factor(&values), Err(SingularMatrix { column: last }));
            values[0] = f64::NAN;
            assert!(Factorisation::new(&pattern).factor(&values).is_err());
        }
    }

    #[test]
    fn long_rows_are_solved() {
        let offsets: Vec<i64> = (-149..150).collect();
        let pattern = band(150, &offsets);
        let values: Vec<f64> = (0..pattern.len()).map(|k| ((k * k * 31 % 1009) as f64 - 500.0) / 500.0).collect();
        check(&pattern, &values, 1, 1e-9);
        check(&pattern, &values, 3, 1e-9);
    }
}
