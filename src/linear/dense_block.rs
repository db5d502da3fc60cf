//! LU of a dense block without exchanges, by panels: most of the work is products of matrices.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_unit_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};

/// Columns eliminated together, chosen by trial: wide enough for fast products, narrow enough to stay in the cache.
const PANEL: usize = 16;

/// The last part A of a matrix `[. B; C A]` whose first part is eliminated already: `B` and `C` hold factors of it.
#[derive(Clone, Debug, Default)]
pub(super) struct DenseBlock {
    size: usize,
    /// Number of columns eliminated before.
    before: usize,
    /// A, then its factors (size x size), column by column.
    values: Vec<f64>,
    /// Upper factors beside it (before x size) and lower ones (size x before), column by column.
    beside: Vec<f64>,
    below: Vec<f64>,
}

impl DenseBlock {
    pub fn resize(&mut self, size: usize, before: usize) {
        (self.size, self.before) = (size, before);
        self.clear();
    }

    /// All zero.
    pub fn clear(&mut self) {
        let (size, before) = (self.size, self.before);
        for (values, count) in
            [(&mut self.values, size * size), (&mut self.beside, size * before), (&mut self.below, size * before)]
        {
            values.clear();
            values.resize(count, 0.0);
        }
    }

    pub fn column_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.values[k * self.size..(k + 1) * self.size]
    }

    pub fn set_beside(&mut self, row: usize, column: usize, value: f64) {
        self.beside[column * self.before + row] = value;
    }

    pub fn set_below(&mut self, row: usize, column: usize, value: f64) {
        self.below[column * self.size + row] = value;
    }

    /// `A - C B = L U` in place, L with ones on its diagonal; false where `serves` refuses a pivot, which it sees with
    /// the largest magnitude of the column from the pivot on.
    pub fn factor(&mut self, serves: impl Fn(f64, f64) -> bool) -> bool {
        let n = self.size;
        if n > 0 && self.before > 0 {
            let below = MatRef::from_column_major_slice(&self.below, n, self.before);
            let beside = MatRef::from_column_major_slice(&self.beside, self.before, n);
            let matrix = MatMut::from_column_major_slice_mut(&mut self.values, n, n);
            matmul(matrix, Accum::Add, below, beside, -1.0, Par::Seq);
        }
        for begin in (0..n).step_by(PANEL) {
            let end = (begin + PANEL).min(n);
            if !self.factor_panel(begin, end, &serves) {
                return false;
            }
            if end == n {
                break;
            }
            let matrix = MatMut::from_column_major_slice_mut(&mut self.values, n, n);
            let (_, _, _, rest) = matrix.split_at_mut(begin, begin);
            let width = end - begin;
            let (diagonal, mut right, below, mut remaining) = rest.split_at_mut(width, width);
            solve_unit_lower_triangular_in_place(diagonal.as_ref(), right.as_mut(), Par::Seq);
            matmul(remaining.as_mut(), Accum::Add, below.as_ref(), right.as_ref(), -1.0, Par::Seq);
        }
        true
    }

    /// Solves `L U x = b` in place for `width` right-hand sides, stored row by row (size x width).
    pub fn solve(&self, right_hand_sides: &mut [f64], width: usize) {
        let n = self.size;
        if n == 0 {
            return;
        }
        let factors = MatRef::from_column_major_slice(&self.values, n, n);
        let mut x = MatMut::from_row_major_slice_mut(right_hand_sides, n, width);
        solve_unit_lower_triangular_in_place(factors, x.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(factors, x, Par::Seq);
    }

    fn factor_panel(&mut self, begin: usize, end: usize, serves: &impl Fn(f64, f64) -> bool) -> bool {
        let n = self.size;
        for k in begin..end {
            let (known, rest) = self.values.split_at_mut((k + 1) * n);
            let column = &mut known[k * n..];
            let largest = column[k..].iter().fold(0.0f64, |a, v| a.max(v.abs()));
            let pivot = column[k];
            if !serves(pivot, largest) {
                return false;
            }
            let inverse = 1.0 / pivot;
            column[k + 1..].iter_mut().for_each(|v| *v *= inverse);
            for later in rest.chunks_exact_mut(n).take(end - k - 1) {
                let factor = later[k];
                if factor != 0.0 {
                    later[k + 1..].iter_mut().zip(&column[k + 1..]).for_each(|(a, b)| *a -= factor * b);
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(i: usize, j: usize) -> f64 {
        ((i * 31 + j * 17) % 23) as f64 / 23.0 + if i == j { 8.0 } else { 0.0 }
    }

    #[test]
    fn what_is_eliminated_before_is_subtracted_and_the_rest_solved() {
        for (n, before) in [(1, 0), (5, 2), (PANEL, 3), (3 * PANEL + 7, 20)] {
            let mut block = DenseBlock::default();
            block.resize(n, before);
            (0..n).for_each(|j| (0..n).for_each(|i| block.column_mut(j)[i] = entry(i, j)));
            for k in 0..before {
                (0..n).for_each(|i| block.set_below(i, k, 0.1 * entry(i, k + 1)));
                (0..n).for_each(|j| block.set_beside(k, j, 0.1 * entry(k + 2, j)));
            }
            let product = |i: usize, j: usize| -> f64 {
                (0..before).map(|k| 0.01 * entry(i, k + 1) * entry(k + 2, j)).sum::<f64>()
            };
            assert!(block.factor(|pivot, largest| pivot.abs() >= 0.1 * largest));
            let solution = |i: usize, c: usize| (i as f64 - 2.0) / (c as f64 + 1.0);
            let mut x: Vec<f64> = (0..n * 3)
                .map(|at| (0..n).map(|j| (entry(at / 3, j) - product(at / 3, j)) * solution(j, at % 3)).sum())
                .collect();
            block.solve(&mut x, 3);
            for (at, x) in x.iter().enumerate() {
                assert!((x - solution(at / 3, at % 3)).abs() < 1e-10, "{n}, {before}: {x}");
            }
        }
    }

    #[test]
    fn a_pivot_that_does_not_serve_is_refused() {
        let mut block = DenseBlock::default();
        block.resize(2, 0);
        block.column_mut(0).copy_from_slice(&[1.0, 2.0]);
        block.column_mut(1).copy_from_slice(&[2.0, 4.0]);
        assert!(!block.factor(|pivot, _| pivot.abs() > 1e-12));
    }
}
