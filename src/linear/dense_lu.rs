//! Dense LU with scaled partial pivoting for small matrices.

use super::factorisation::{SingularMatrix, subtract_row};
use super::pattern::SparsityPattern;

/// A pivot below this share of its row's largest original entry counts as zero.
const SINGULAR: f64 = 1e-15;

/// `P A = L U`, stored row by row in one array; rows are exchanged in memory.
#[derive(Clone, Debug)]
pub(super) struct DenseLu {
    n: usize,
    /// Where entry k of the pattern sits in `lu`.
    places: Vec<usize>,
    lu: Vec<f64>,
    row_scale: Vec<f64>,
    inverse_pivot: Vec<f64>,
    exchanges: Vec<usize>,
}

/// Products are added up in this many separate sums where rows are long: one sum would wait for every addition.
const LANES: usize = 8;
/// Rows from this length on count as long.
const LONG_ROW: usize = 64;

/// Scalar product of slices of equal length; the order of additions depends on the length only.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < LONG_ROW {
        return a.iter().zip(b).map(|(a, b)| a * b).sum();
    }
    let (a_lanes, a_rest) = a.as_chunks::<LANES>();
    let (b_lanes, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

impl DenseLu {
    pub fn new(pattern: &SparsityPattern) -> Self {
        let n = pattern.column_count;
        let places = (0..n)
            .flat_map(|column| {
                pattern.rows[pattern.starts[column]..pattern.starts[column + 1]].iter().map(move |row| row * n + column)
            })
            .collect();
        Self {
            n,
            places,
            lu: vec![0.0; n * n],
            row_scale: vec![0.0; n],
            inverse_pivot: vec![0.0; n],
            exchanges: vec![0; n],
        }
    }

    pub fn factor(&mut self, values: &[f64]) -> Result<(), SingularMatrix> {
        let n = self.n;
        self.lu.fill(0.0);
        for (&place, &value) in self.places.iter().zip(values) {
            self.lu[place] = value;
        }
        for (row, scale) in self.lu.chunks_exact(n).zip(&mut self.row_scale) {
            let largest = row.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            *scale = 1.0 / largest;
        }
        for k in 0..n {
            self.bring_pivot(k)?;
            self.eliminate(k);
        }
        Ok(())
    }

    /// Exchanges rows so that row k holds the largest remaining entry of column k relative to its row.
    fn bring_pivot(&mut self, k: usize) -> Result<(), SingularMatrix> {
        let n = self.n;
        let mut best = (0.0, k);
        for row in k..n {
            let size = self.lu[row * n + k].abs() * self.row_scale[row];
            if size > best.0 {
                best = (size, row);
            }
        }
        // A non-finite entry makes `size` infinite or fails every comparison, and leaves `best` at zero.
        if !(best.0 > SINGULAR && best.0.is_finite()) {
            return Err(SingularMatrix { column: k });
        }
        let pivot_row = best.1;
        self.exchanges[k] = pivot_row;
        if pivot_row != k {
            let (low, high) = self.lu.split_at_mut(pivot_row * n);
            low[k * n..(k + 1) * n].swap_with_slice(&mut high[..n]);
            self.row_scale.swap(k, pivot_row);
        }
        self.inverse_pivot[k] = 1.0 / self.lu[k * n + k];
        Ok(())
    }

    fn eliminate(&mut self, k: usize) {
        let n = self.n;
        let inverse = self.inverse_pivot[k];
        let (upper, lower) = self.lu.split_at_mut((k + 1) * n);
        let pivot_row = &upper[k * n + k + 1..(k + 1) * n];
        for row in lower.chunks_exact_mut(n) {
            if row[k] == 0.0 {
                continue;
            }
            let factor = row[k] * inverse;
            row[k] = factor;
            for (a, b) in row[k + 1..].iter_mut().zip(pivot_row) {
                *a -= factor * b;
            }
        }
    }

    pub fn solve_block(&self, x: &mut [f64], width: usize) {
        let n = self.n;
        for k in 0..n {
            let other = self.exchanges[k];
            if other != k {
                let (low, high) = x.split_at_mut(other * width);
                low[k * width..(k + 1) * width].swap_with_slice(&mut high[..width]);
            }
        }
        if width == 1 { self.solve_one(x) } else { self.solve_rows(x, width) }
    }

    fn solve_one(&self, x: &mut [f64]) {
        let n = self.n;
        for i in 1..n {
            let row = &self.lu[i * n..i * n + i];
            let sum = dot(row, &x[..i]);
            x[i] -= sum;
        }
        for i in (0..n).rev() {
            let row = &self.lu[i * n + i + 1..(i + 1) * n];
            let sum = dot(row, &x[i + 1..n]);
            x[i] = (x[i] - sum) * self.inverse_pivot[i];
        }
    }

    fn solve_rows(&self, x: &mut [f64], width: usize) {
        let n = self.n;
        for i in 1..n {
            for j in 0..i {
                let factor = self.lu[i * n + j];
                if factor != 0.0 {
                    subtract_row(x, i, j, width, factor);
                }
            }
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                let factor = self.lu[i * n + j];
                if factor != 0.0 {
                    subtract_row(x, i, j, width, factor);
                }
            }
            for value in &mut x[i * width..(i + 1) * width] {
                *value *= self.inverse_pivot[i];
            }
        }
    }
}
