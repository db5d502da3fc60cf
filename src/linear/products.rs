//! Products and sums over long rows, compiled once per width of vector registers.

use super::SparsityPattern;
use multiversion::multiversion;

/// Calls a function over a range of columns in blocks of constant width, the widest that fit.
macro_rules! in_blocks {
    ($length:expr, $widest:literal, $($narrower:literal),+; $block:ident $arguments:tt) => {{
        let mut first = 0;
        while first + $widest <= $length {
            $block::<$widest>(first, $arguments);
            first += $widest;
        }
        let mut rest = $length - first;
        $(if rest >= $narrower {
            $block::<$narrower>($length - rest, $arguments);
            rest -= $narrower;
        })+
        debug_assert_eq!(rest, 0);
    }};
}

/// The order in which a sparse matrix is multiplied row by row, for values in the order of its pattern.
#[derive(Clone, Debug, Default)]
pub struct RowOrder {
    /// Entries of row i are `entries[starts[i]..starts[i + 1]]`.
    starts: Vec<usize>,
    /// Index among the values, column.
    entries: Vec<(u32, u32)>,
}

impl RowOrder {
    pub fn new(pattern: &SparsityPattern) -> Self {
        let mut rows = vec![Vec::new(); pattern.row_count];
        for (index, (row, column)) in pattern.entries().enumerate() {
            rows[row].push((index as u32, column as u32));
        }
        let mut order = Self { starts: vec![0], entries: Vec::with_capacity(pattern.len()) };
        for row in rows {
            order.entries.extend(row);
            order.starts.push(order.entries.len());
        }
        order
    }

    /// `result -= A V` for row-major `V` and `result` of `width` columns; values in the order of the pattern.
    pub fn subtract_product(&self, values: &[f64], v: &[f64], result: &mut [f64], width: usize) {
        subtract_product(&self.starts, &self.entries, values, v, result, width);
    }
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn subtract_product(
    starts: &[usize],
    entries: &[(u32, u32)],
    values: &[f64],
    v: &[f64],
    result: &mut [f64],
    width: usize,
) {
    if width == 0 {
        return;
    }
    for (range, target) in starts.windows(2).zip(result.chunks_exact_mut(width)) {
        let row = &entries[range[0]..range[1]];
        in_blocks!(width, 32, 16, 8, 4, 2, 1; subtract_block (row, values, v, width, &mut *target));
    }
}

/// Entries of a row of the matrix, its values, the other factor with the length of its rows, the row of the result.
type RowProduct<'a> = (&'a [(u32, u32)], &'a [f64], &'a [f64], usize, &'a mut [f64]);

/// The part of a row of the product from column `first` on, accumulated in registers.
#[inline(always)]
fn subtract_block<const W: usize>(first: usize, (row, values, v, width, target): RowProduct) {
    let target = &mut target[first..first + W];
    let mut sum: [f64; W] = std::array::from_fn(|k| target[k]);
    for &(index, column) in row {
        let value = values[index as usize];
        let of_column = &v[column as usize * width + first..][..W];
        for k in 0..W {
            sum[k] = (-value).mul_add(of_column[k], sum[k]);
        }
    }
    target.copy_from_slice(&sum);
}

/// Rows of a triangular matrix in the order in which a solution takes them: position of each and the end of its
/// entries; per entry the position that it multiplies, and its value.
pub(super) type TriangularRows<'a> = (&'a [[u32; 2]], &'a [u32], &'a [f64]);

/// `x_i = (x_i - sum_j a_ij x_j) factor_i` row by row of `x`, which has `width` columns; factors of one where none are
/// given.
pub(super) fn eliminate_rows(triangle: TriangularRows, x: &mut [f64], width: usize, factors: Option<&[f64]>) {
    eliminate_all_rows(triangle, x, width, factors);
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn eliminate_all_rows((rows, columns, values): TriangularRows, x: &mut [f64], width: usize, factors: Option<&[f64]>) {
    let mut begin = 0;
    for &[position, end] in rows {
        let (position, entries) = (position as usize, begin..end as usize);
        begin = end as usize;
        let factor = factors.map_or(1.0, |factors| factors[position]);
        let row = (&columns[entries.clone()], &values[entries]);
        in_blocks!(width, 32, 16, 8, 4, 2, 1; eliminate_block (row, &mut *x, width, position, factor));
    }
}

/// Entries of a row, the whole of `x`, its width, the position of the row, its factor.
type RowElimination<'a> = ((&'a [u32], &'a [f64]), &'a mut [f64], usize, usize, f64);

#[inline(always)]
fn eliminate_block<const W: usize>(first: usize, ((columns, values), x, width, position, factor): RowElimination) {
    let mut sum: [f64; W] = std::array::from_fn(|k| x[position * width + first..][..W][k]);
    for (&column, value) in columns.iter().zip(values) {
        let of_column = &x[column as usize * width + first..][..W];
        for k in 0..W {
            sum[k] = (-value).mul_add(of_column[k], sum[k]);
        }
    }
    for (target, sum) in x[position * width + first..][..W].iter_mut().zip(sum) {
        *target = factor * sum;
    }
}

/// `x_target -= value x_source` for all entries (target, source), one after the other.
pub(super) fn eliminate_entries(entries: &[[u32; 2]], values: &[f64], x: &mut [f64]) {
    eliminate_all_entries(entries, values, x);
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn eliminate_all_entries(entries: &[[u32; 2]], values: &[f64], x: &mut [f64]) {
    for (&[target, source], value) in entries.iter().zip(values) {
        x[target as usize] = (-value).mul_add(x[source as usize], x[target as usize]);
    }
}

/// `out = base + factor sum_s coefficient_s vectors[index_s]` for the listed (index, coefficient).
///
/// # Panics
///
/// If a vector is shorter than `out`.
pub fn combine(out: &mut [f64], base: &[f64], factor: f64, terms: &[(usize, f64)], vectors: &[Vec<f64>]) {
    combine_all(out, base, factor, terms, vectors);
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn combine_all(out: &mut [f64], base: &[f64], factor: f64, terms: &[(usize, f64)], vectors: &[Vec<f64>]) {
    in_blocks!(out.len(), 16, 8, 4, 2, 1; combine_block (&mut *out, base, factor, terms, vectors));
}

/// The arguments of [`combine`].
type Combination<'a> = (&'a mut [f64], &'a [f64], f64, &'a [(usize, f64)], &'a [Vec<f64>]);

#[inline(always)]
fn combine_block<const W: usize>(first: usize, (out, base, factor, terms, vectors): Combination) {
    let mut sum = [0.0; W];
    for &(index, coefficient) in terms {
        let vector = &vectors[index][first..first + W];
        for k in 0..W {
            sum[k] = coefficient.mul_add(vector[k], sum[k]);
        }
    }
    let (out, base) = (&mut out[first..first + W], &base[first..first + W]);
    for k in 0..W {
        out[k] = factor.mul_add(sum[k], base[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_single_elements() {
        let entries = [(0, 1), (2, 0), (1, 2), (0, 2), (2, 2)];
        let pattern = SparsityPattern::from_entries(3, 3, &entries);
        let values: Vec<f64> = (0..pattern.len()).map(|k| 0.5 + k as f64).collect();
        for width in [0, 1, 3, 4, 7, 8, 16, 31, 34, 63] {
            let v: Vec<f64> = (0..3 * width).map(|k| (k as f64).sin()).collect();
            let start: Vec<f64> = (0..3 * width).map(|k| (k as f64).cos()).collect();
            let mut expected = start.clone();
            for (value, (row, column)) in values.iter().zip(pattern.entries()) {
                (0..width).for_each(|j| expected[row * width + j] -= value * v[column * width + j]);
            }
            let mut result = start;
            RowOrder::new(&pattern).subtract_product(&values, &v, &mut result, width);
            assert!(result.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14), "width {width}");
        }
    }

    #[test]
    fn combinations_are_those_of_single_elements() {
        for length in [0, 1, 3, 6, 8, 11, 16, 35] {
            let vectors: Vec<Vec<f64>> =
                (0..3).map(|s| (0..length).map(|k| ((s + 3 * k) as f64).sin()).collect()).collect();
            let base: Vec<f64> = (0..length).map(|k| k as f64).collect();
            let mut out = vec![f64::NAN; length];
            combine(&mut out, &base, 0.5, &[(2, 3.0), (0, -1.0)], &vectors);
            for k in 0..length {
                let expected = base[k] + 0.5 * (3.0 * vectors[2][k] - vectors[0][k]);
                assert!((out[k] - expected).abs() < 1e-14);
            }
        }
    }
}
