//! Sparse LU that reuses its symbolic part (Davis-Palamadai-2010): columns are ordered once by approximate minimum
//! degree, the first factorisation finds pivots and the structure of the factors by Gilbert-Peierls-1988, and every
//! further one only recomputes the numbers, until a pivot has become too small and pivots are sought anew.

use super::dense_block::DenseBlock;
use super::factorisation::SingularMatrix;
use super::pattern::SparsityPattern;
use super::products::{TriangularRows, eliminate_entries, eliminate_rows};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use std::ops::Range;

/// The diagonal entry is taken as pivot while it is at least this share of the column's largest entry.
const PREFER_DIAGONAL: f64 = 0.1;
/// A reused pivot below this share of its column's largest remaining entry asks for new pivots.
const REUSE_PIVOT: f64 = 1e-3;
/// A column whose largest remaining scaled entry is below this counts as dependent.
const SINGULAR: f64 = 1e-15;
/// From the position on from which the factors are this full they are stored and eliminated without gaps; chosen by
/// trial.
const DENSE_SHARE: f64 = 0.6;
const NONE: usize = usize::MAX;

/// `P R A Q = L U` with row scaling R, row exchanges P and column order Q.
#[derive(Clone, Debug)]
pub(super) struct SparseLu {
    wanted: usize,
    forward: Pass,
    backward: Pass,
    pattern: SparsityPattern,
    /// Position k holds column `columns[k]`.
    columns: Vec<usize>,
    /// Position of each row as pivot.
    position: Vec<usize>,
    /// Row that is pivot at each position.
    pivot_row: Vec<usize>,
    lower: Triangle,
    upper: Triangle,
    inverse_pivot: Vec<f64>,
    row_scale: Vec<f64>,
    /// Positions from here on are eliminated as a dense block.
    tail: usize,
    dense: DenseBlock,
    /// Per column before the tail: where its lower entries in rows of the tail begin.
    near_end: Vec<usize>,
    /// Dense column (by original row), zero between uses.
    work: Vec<f64>,
    block: Vec<f64>,
    has_structure: bool,
}

/// Strictly triangular factor by columns.
#[derive(Clone, Debug, Default)]
struct Triangle {
    starts: Vec<usize>,
    /// Lower: original rows during factorisation. Upper: positions, in an order in which they can be eliminated.
    rows: Vec<usize>,
    /// Lower only: positions of `rows`, known when all pivots are.
    positions: Vec<usize>,
    values: Vec<f64>,
}

impl Triangle {
    fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.rows.clear();
        self.values.clear();
    }

    fn column(&self, k: usize) -> Range<usize> {
        self.starts[k]..self.starts[k + 1]
    }
}

impl SparseLu {
    /// For right-hand sides and solutions of which only the first `wanted` elements count.
    pub fn new(pattern: &SparsityPattern, wanted: usize) -> Self {
        let n = pattern.column_count;
        Self {
            wanted,
            forward: Pass::default(),
            backward: Pass::default(),
            pattern: pattern.clone(),
            columns: minimum_degree(pattern),
            position: vec![NONE; n],
            pivot_row: vec![NONE; n],
            lower: Triangle::default(),
            upper: Triangle::default(),
            inverse_pivot: vec![0.0; n],
            row_scale: vec![0.0; n],
            tail: n,
            dense: DenseBlock::default(),
            near_end: Vec::new(),
            work: vec![0.0; n],
            block: Vec::new(),
            has_structure: false,
        }
    }

    pub fn factor(&mut self, values: &[f64]) -> Result<(), SingularMatrix> {
        self.row_scale.fill(0.0);
        for (&row, value) in self.pattern.rows.iter().zip(values) {
            self.row_scale[row] = self.row_scale[row].max(value.abs());
        }
        for scale in &mut self.row_scale {
            *scale = 1.0 / *scale;
        }
        if !(self.has_structure && self.refactor(values)) {
            self.has_structure = false;
            self.work.fill(0.0);
            self.find_structure(values)?;
            self.plan_tail();
            self.plan_passes();
            self.has_structure = true;
        }
        self.forward.take_values(&self.lower, None);
        self.backward.take_values(&self.upper, Some(&self.inverse_pivot));
        Ok(())
    }

    /// Numbers only, with the pivots of before; false when one of them has become unsuitable.
    fn refactor(&mut self, values: &[f64]) -> bool {
        for k in 0..self.tail {
            self.scatter(k, values);
            self.eliminate(k, false);
            let pivot = std::mem::take(&mut self.work[self.pivot_row[k]]);
            let largest = self.lower.column(k).fold(pivot.abs(), |a, l| a.max(self.work[self.lower.rows[l]].abs()));
            if !serves(pivot, largest) {
                return false;
            }
            self.inverse_pivot[k] = 1.0 / pivot;
            for l in self.lower.column(k) {
                self.lower.values[l] = std::mem::take(&mut self.work[self.lower.rows[l]]) * self.inverse_pivot[k];
            }
        }
        self.dense.clear();
        for k in self.tail..self.columns.len() {
            self.scatter(k, values);
            self.eliminate(k, true);
            self.take_dense_column(k);
        }
        for k in 0..self.tail {
            for l in self.near_end[k]..self.lower.starts[k + 1] {
                self.dense.set_below(self.lower.positions[l] - self.tail, k, self.lower.values[l]);
            }
        }
        let is_sound = self.dense.factor(serves);
        if is_sound {
            self.spread_dense_block();
        }
        is_sound
    }

    /// Subtracts from the work column what the columns before it contribute; `near` only to rows before the tail: to
    /// those of the tail a product of matrices does it at once.
    fn eliminate(&mut self, k: usize, near: bool) {
        for u in self.upper.column(k) {
            let j = self.upper.rows[u];
            if j >= self.tail {
                continue;
            }
            let factor = std::mem::take(&mut self.work[self.pivot_row[j]]);
            self.upper.values[u] = factor;
            if factor == 0.0 {
                continue;
            }
            let end = if near { self.near_end[j] } else { self.lower.starts[j + 1] };
            let below = self.lower.starts[j]..end;
            for (&row, value) in self.lower.rows[below.clone()].iter().zip(&self.lower.values[below]) {
                self.work[row] -= value * factor;
            }
        }
    }

    /// Moves the work column to column k of the dense block, and its factors before the tail beside it.
    fn take_dense_column(&mut self, k: usize) {
        let column = self.dense.column_mut(k - self.tail);
        for (value, &row) in column.iter_mut().zip(&self.pivot_row[self.tail..]) {
            *value = std::mem::take(&mut self.work[row]);
        }
        for u in self.upper.column(k).filter(|&u| self.upper.rows[u] < self.tail) {
            self.dense.set_beside(self.upper.rows[u], k - self.tail, self.upper.values[u]);
        }
    }

    /// Decides on the tail; entries of columns before it are put in order, those of rows before it first.
    fn plan_tail(&mut self) {
        self.tail = self.dense_tail();
        let size = self.columns.len() - self.tail;
        self.dense.resize(size, self.tail);
        self.near_end.clear();
        for k in 0..self.tail {
            let entries = self.lower.column(k);
            let (near, far): (Vec<usize>, Vec<usize>) =
                entries.clone().partition(|&l| self.lower.positions[l] < self.tail);
            self.near_end.push(entries.start + near.len());
            let order = [near, far].concat();
            let sorted = |from: &[usize]| -> Vec<usize> { order.iter().map(|&l| from[l]).collect() };
            let (rows, positions) = (sorted(&self.lower.rows), sorted(&self.lower.positions));
            let values: Vec<f64> = order.iter().map(|&l| self.lower.values[l]).collect();
            self.lower.rows[entries.clone()].copy_from_slice(&rows);
            self.lower.positions[entries.clone()].copy_from_slice(&positions);
            self.lower.values[entries].copy_from_slice(&values);
        }
        for k in self.tail..self.columns.len() {
            let tail = self.tail;
            let column = self.dense.column_mut(k - tail);
            column[k - tail] = 1.0 / self.inverse_pivot[k];
            self.lower.column(k).for_each(|l| column[self.lower.positions[l] - tail] = self.lower.values[l]);
            for u in self.upper.column(k) {
                if let Some(at) = self.upper.rows[u].checked_sub(tail) {
                    column[at] = self.upper.values[u];
                }
            }
        }
    }

    /// The factors of the dense block to where those of the whole matrix stand.
    fn spread_dense_block(&mut self) {
        let tail = self.tail;
        for k in tail..self.columns.len() {
            let column = self.dense.column_mut(k - tail);
            self.inverse_pivot[k] = 1.0 / column[k - tail];
            for l in self.lower.column(k) {
                self.lower.values[l] = column[self.lower.positions[l] - tail];
            }
            for u in self.upper.column(k) {
                if let Some(at) = self.upper.rows[u].checked_sub(tail) {
                    self.upper.values[u] = column[at];
                }
            }
        }
    }

    /// Puts scaled column k of the matrix into the work column.
    fn scatter(&mut self, k: usize, values: &[f64]) {
        let column = self.columns[k];
        let entries = self.pattern.starts[column]..self.pattern.starts[column + 1];
        for (&row, value) in self.pattern.rows[entries.clone()].iter().zip(&values[entries]) {
            self.work[row] = value * self.row_scale[row];
        }
    }

    /// Pivots and structure along with the numbers. Structural entries are kept even where their value is zero now.
    fn find_structure(&mut self, values: &[f64]) -> Result<(), SingularMatrix> {
        let n = self.columns.len();
        self.position.fill(NONE);
        self.lower.clear();
        self.upper.clear();
        let mut reached = vec![NONE; n];
        let mut order = Vec::with_capacity(n);
        for k in 0..n {
            order.clear();
            let column = self.columns[k];
            for entry in self.pattern.starts[column]..self.pattern.starts[column + 1] {
                self.reach(self.pattern.rows[entry], k, &mut reached, &mut order);
            }
            self.scatter(k, values);
            for &row in order.iter().rev() {
                let j = self.position[row];
                if j == NONE {
                    continue;
                }
                let factor = std::mem::take(&mut self.work[row]);
                self.upper.rows.push(j);
                self.upper.values.push(factor);
                for l in self.lower.column(j) {
                    self.work[self.lower.rows[l]] -= self.lower.values[l] * factor;
                }
            }
            self.upper.starts.push(self.upper.rows.len());
            self.choose_pivot(k, &order)?;
        }
        self.lower.positions = self.lower.rows.iter().map(|&row| self.position[row]).collect();
        Ok(())
    }

    /// Depth-first search: appends every row that elimination makes non-zero, dependants first.
    fn reach(&self, start: usize, k: usize, reached: &mut [usize], order: &mut Vec<usize>) {
        if reached[start] == k {
            return;
        }
        reached[start] = k;
        let mut stack = vec![(start, 0)];
        while let Some((row, next)) = stack.pop() {
            let below = match self.position[row] {
                NONE => 0..0,
                j => self.lower.column(j),
            };
            match below.clone().skip(next).find(|&l| reached[self.lower.rows[l]] != k) {
                Some(l) => {
                    stack.push((row, l - below.start + 1));
                    reached[self.lower.rows[l]] = k;
                    stack.push((self.lower.rows[l], 0));
                }
                None => order.push(row),
            }
        }
    }

    fn choose_pivot(&mut self, k: usize, order: &[usize]) -> Result<(), SingularMatrix> {
        let column = self.columns[k];
        let mut best = (0.0, NONE);
        for &row in order.iter().rev().filter(|&&row| self.position[row] == NONE) {
            let size = self.work[row].abs();
            if !size.is_finite() {
                return Err(SingularMatrix { column });
            }
            if size > best.0 {
                best = (size, row);
            }
        }
        if best.0 <= SINGULAR {
            return Err(SingularMatrix { column });
        }
        let diagonal = self.position[column] == NONE && self.work[column].abs() >= PREFER_DIAGONAL * best.0;
        let row = if diagonal { column } else { best.1 };
        self.position[row] = k;
        self.pivot_row[k] = row;
        self.inverse_pivot[k] = 1.0 / std::mem::take(&mut self.work[row]);
        for &below in order.iter().rev().filter(|&&row| self.position[row] == NONE) {
            self.lower.rows.push(below);
            self.lower.values.push(std::mem::take(&mut self.work[below]) * self.inverse_pivot[k]);
        }
        self.lower.starts.push(self.lower.rows.len());
        Ok(())
    }

    pub fn solve_block(&mut self, x: &mut [f64], width: usize) {
        if width == 1 {
            return self.solve_one(x);
        }
        let n = self.columns.len();
        self.block.clear();
        self.block.resize(n * width, 0.0);
        for (k, &row) in self.pivot_row.iter().enumerate().filter(|(_, row)| **row < self.wanted) {
            let scale = self.row_scale[row];
            for (a, b) in self.block[k * width..(k + 1) * width].iter_mut().zip(&x[row * width..(row + 1) * width]) {
                *a = b * scale;
            }
        }
        eliminate_rows(self.forward.rows(), &mut self.block, width, None);
        self.dense.solve(&mut self.block[self.tail * width..], width);
        eliminate_rows(self.backward.rows(), &mut self.block, width, Some(&self.inverse_pivot));
        for (k, &column) in self.columns.iter().enumerate().filter(|(_, column)| **column < self.wanted) {
            x[column * width..(column + 1) * width].copy_from_slice(&self.block[k * width..(k + 1) * width]);
        }
    }

    fn solve_one(&mut self, x: &mut [f64]) {
        let given = |row: &usize| if *row < self.wanted { x[*row] * self.row_scale[*row] } else { 0.0 };
        self.block.clear();
        self.block.extend(self.pivot_row.iter().map(given));
        self.forward.run_scattered(&mut self.block);
        self.forward.run_dense(&mut self.block, None);
        self.backward.run_dense(&mut self.block, Some(&self.inverse_pivot));
        for (value, inverse) in self.block.iter_mut().zip(&self.inverse_pivot[..self.tail]) {
            *value *= inverse;
        }
        self.backward.run_scattered(&mut self.block);
        for (&column, value) in self.columns.iter().zip(&self.block) {
            if column < self.wanted {
                x[column] = *value;
            }
        }
    }

    /// Which parts of the factors a solution needs: what right-hand sides reach, and what wanted elements depend on.
    fn plan_passes(&mut self) {
        let n = self.columns.len();
        let tail = self.tail;
        let mut is_reached: Vec<bool> = self.pivot_row.iter().map(|&row| row < self.wanted).collect();
        self.forward.clear();
        let mut entries = Vec::new();
        for k in 0..n {
            if is_reached[k] {
                for l in self.lower.column(k) {
                    is_reached[self.lower.positions[l]] = true;
                }
                let column = self.lower.column(k).map(|l| (self.lower.positions[l], l));
                if k < tail {
                    entries.extend(column.map(|(target, from)| Entry { target, source: k, from }));
                } else {
                    self.forward.add_dense(k, column, k + 1..n);
                }
            }
        }
        self.forward.add_rows(by_target(&entries, 0..n).filter(|(_, entries)| !entries.is_empty()));
        self.forward.add_scattered(entries);
        let mut is_needed: Vec<bool> = self.columns.iter().map(|&column| column < self.wanted).collect();
        for k in 0..n {
            is_needed[k] |= k >= tail || self.upper.column(k).any(|u| is_needed[self.upper.rows[u]]);
        }
        self.backward.clear();
        let mut entries = Vec::new();
        for k in (0..n).rev().filter(|&k| is_needed[k]) {
            let column = self.upper.column(k).map(|u| (self.upper.rows[u], u)).filter(|(row, _)| is_needed[*row]);
            let (near, far): (Vec<_>, Vec<_>) = column.partition(|(row, _)| *row < tail);
            entries.extend(near.into_iter().map(|(target, from)| Entry { target, source: k, from }));
            if k >= tail {
                self.backward.add_dense(k, far.into_iter(), tail..k);
            }
        }
        self.backward.add_rows(by_target(&entries, (0..tail).rev()).filter(|(row, _)| is_needed[*row]));
        self.backward.add_scattered(entries);
    }

    /// First position from which on both factors together are mostly full.
    fn dense_tail(&self) -> usize {
        let n = self.columns.len();
        let mut begins = vec![0_usize; n + 1];
        for k in 0..n {
            // Entries of a lower column lie behind it, those of an upper one before: each counts where its block
            // begins.
            begins[k] += self.lower.column(k).len();
            self.upper.column(k).for_each(|u| begins[self.upper.rows[u]] += 1);
        }
        let (mut entries, mut tail) = (0, n);
        for k in (0..n).rev() {
            entries += begins[k];
            let size = n - k;
            if entries as f64 >= DENSE_SHARE * (size * (size - 1)) as f64 {
                tail = k;
            }
        }
        tail
    }
}

/// Whether a pivot found before may be used again, with the largest entry left in its column.
fn serves(pivot: f64, largest: f64) -> bool {
    pivot.abs() > SINGULAR && pivot.abs() >= REUSE_PIVOT * largest && largest.is_finite()
}

/// An entry of a triangular factor: the value at `source`, when it is final, is subtracted from `target`.
#[derive(Clone, Copy, Debug)]
struct Entry {
    target: usize,
    source: usize,
    /// Index in the triangle.
    from: usize,
}

/// Targets in the order given, each with (source, index in the triangle) of its entries.
fn by_target(entries: &[Entry], order: impl Iterator<Item = usize>) -> impl Iterator<Item = (usize, Vec<(u32, u32)>)> {
    let count = entries.iter().map(|entry| entry.target + 1).max().unwrap_or(0);
    let mut rows = vec![Vec::new(); count];
    for entry in entries {
        rows[entry.target].push((entry.source as u32, entry.from as u32));
    }
    order.map(move |position| (position, rows.get_mut(position).map(std::mem::take).unwrap_or_default()))
}

/// A triangular factor in the order in which a solution reads it.
#[derive(Clone, Debug, Default)]
struct Pass {
    /// For one right-hand side: (target, source) of the entries outside the dense block, sources before what depends on
    /// them and entries that do not wait for each other side by side.
    scattered: Vec<[u32; 2]>,
    from: Vec<u32>,
    values: Vec<f64>,
    /// Columns of the dense block, and the indices of their entries in the triangle, `ABSENT` for zeros.
    sources: Vec<Source>,
    dense_from: Vec<u32>,
    dense_values: Vec<f64>,
    /// The rows that a block of right-hand sides needs outside the dense block, as [`TriangularRows`], and where their
    /// values come from.
    rows: Vec<[u32; 2]>,
    columns: Vec<u32>,
    row_from: Vec<u32>,
    row_values: Vec<f64>,
}

/// A position of the dense block whose value is subtracted from a range without gaps.
#[derive(Clone, Copy, Debug)]
struct Source {
    position: u32,
    begin: u32,
    length: u32,
}

const ABSENT: u32 = u32::MAX;

impl Pass {
    fn clear(&mut self) {
        *self = Self::default();
    }

    fn add_dense(&mut self, position: usize, entries: impl Iterator<Item = (usize, usize)>, range: Range<usize>) {
        let first = self.dense_from.len();
        self.dense_from.resize(first + range.len(), ABSENT);
        for (target, from) in entries {
            self.dense_from[first + target - range.start] = from as u32;
        }
        let (begin, length) = (range.start as u32, range.len() as u32);
        self.sources.push(Source { position: position as u32, begin, length });
    }

    /// Entries whose sources come in an order in which they can be eliminated.
    fn add_scattered(&mut self, entries: Vec<Entry>) {
        let count = entries.iter().map(|entry| entry.target.max(entry.source) + 1).max().unwrap_or(0);
        // How many entries must follow one after the other before a position is final.
        let mut depth = vec![0_usize; count];
        for entry in &entries {
            depth[entry.target] = depth[entry.target].max(depth[entry.source] + 1);
        }
        // Entries of the same depth meet at a target in turns.
        let mut met = std::collections::HashMap::new();
        let mut order: Vec<(usize, usize, Entry)> = entries
            .into_iter()
            .map(|entry| {
                let turn: &mut usize = met.entry((depth[entry.source], entry.target)).or_default();
                *turn += 1;
                (depth[entry.source], *turn, entry)
            })
            .collect();
        order.sort_by_key(|(depth, turn, _)| (*depth, *turn));
        self.scattered = order.iter().map(|(_, _, entry)| [entry.target as u32, entry.source as u32]).collect();
        self.from = order.iter().map(|(_, _, entry)| entry.from as u32).collect();
    }

    /// Takes the numbers of a factorisation; those of scattered entries times the inverse pivots of their targets,
    /// where given.
    fn take_values(&mut self, triangle: &Triangle, inverse_pivot: Option<&[f64]>) {
        let factor = |target: u32| inverse_pivot.map_or(1.0, |inverse| inverse[target as usize]);
        let places = self.scattered.iter().zip(&self.from);
        self.values.clear();
        self.values.extend(places.map(|([target, _], &from)| triangle.values[from as usize] * factor(*target)));
        let value = |&from: &u32| if from == ABSENT { 0.0 } else { triangle.values[from as usize] };
        self.dense_values.clear();
        self.dense_values.extend(self.dense_from.iter().map(value));
        self.row_values.clear();
        self.row_values.extend(self.row_from.iter().map(|&from| triangle.values[from as usize]));
    }

    /// Adds rows in the order given: their positions with (column, index in the triangle) of their entries.
    fn add_rows(&mut self, rows: impl Iterator<Item = (usize, Vec<(u32, u32)>)>) {
        for (position, entries) in rows {
            self.columns.extend(entries.iter().map(|(column, _)| column));
            self.row_from.extend(entries.iter().map(|(_, from)| from));
            self.rows.push([position as u32, self.columns.len() as u32]);
        }
    }

    fn run_scattered(&self, x: &mut [f64]) {
        eliminate_entries(&self.scattered, &self.values, x);
    }

    fn run_dense(&self, x: &mut [f64], inverse_pivot: Option<&[f64]>) {
        let mut rest = self.dense_values.as_slice();
        for source in &self.sources {
            let (position, begin, length) = (source.position as usize, source.begin as usize, source.length as usize);
            let (factors, others) = rest.split_at(length);
            rest = others;
            if let Some(inverse) = inverse_pivot {
                x[position] *= inverse[position];
            }
            let value = x[position];
            for (target, factor) in x[begin..begin + length].iter_mut().zip(factors) {
                *target -= factor * value;
            }
        }
    }

    fn rows(&self) -> TriangularRows<'_> {
        (&self.rows, &self.columns, &self.row_values)
    }
}

/// Column order by approximate minimum degree of `A + A^T`; the natural order where none can be computed.
fn minimum_degree(pattern: &SparsityPattern) -> Vec<usize> {
    let n = pattern.column_count;
    let symbolic = SymbolicSparseColMatRef::new_checked(n, n, &pattern.starts, None, &pattern.rows);
    let mut order = vec![0usize; n];
    let mut inverse = vec![0usize; n];
    let mut memory = MemBuffer::new(amd::order_maybe_unsorted_scratch::<usize>(n, pattern.len()));
    let stack = MemStack::new(&mut memory);
    match amd::order_maybe_unsorted(&mut order, &mut inverse, symbolic, amd::Control::default(), stack) {
        Ok(_) => order,
        Err(_) => (0..n).collect(),
    }
}
