//! The linearised rates as a sparse matrix that keeps intermediate results as further unknowns.
//!
//! In a mechanism every acceleration depends on every coordinate: the Jacobian of the rates is full. The recursions
//! behind it are sparse all the same, so that a matrix of coordinates *and* of the recursion's intermediate results has
//! few entries per row (Griewank-Walther-2008, 10.3). Intermediate results are eliminated here, at compile time, as
//! long as that takes no more entries than it removes; what remains is left to a sparse factorisation.

use super::InputSource;
use super::sweep::{Scratch, Sweep};
use crate::linear::SparsityPattern;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;
/// All intermediate results are eliminated where the Jacobian itself has at most this many times the entries of the
/// matrix with those that it pays to keep: factors fill in, and those of a smaller matrix fill in less.
const WORTHWHILE: usize = 2;

/// Matrix of `n` variables and m intermediate results.
#[derive(Clone, Debug, Default)]
pub(super) struct Expansion {
    pub pattern: SparsityPattern,
    slot_count: usize,
    /// Partial derivatives of instructions by their first or second operand, added into slots.
    seeds: Vec<Seed>,
    /// Slots that are one: from a rate's equation to the node that is the rate.
    ones: Vec<u32>,
    /// One after the other.
    eliminations: Vec<Elimination>,
    /// `slot[0] += outer * slot[1]`, in the order of the eliminations.
    products: Vec<[u32; 2]>,
    /// By rows of intermediate results ascending (each after what it depends on), then by rows of rates.
    entries: Vec<Entry>,
    /// Places of the ones on the diagonal of intermediate results.
    units: Vec<u32>,
    /// Places of the diagonal of differential variables.
    diagonal: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Seed {
    slot: u32,
    instruction: u32,
    operand: u32,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    row: u32,
    column: u32,
    slot: u32,
    place: u32,
}

/// The end of the products of one reader of an eliminated node, and the slot of its derivative by that node.
#[derive(Clone, Copy, Debug)]
struct Elimination {
    outer: u32,
    end: u32,
}

/// Memory of the evaluation.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    slots: Vec<f64>,
    /// Typical magnitude of every unknown.
    scale: Vec<f64>,
}

/// The computational graph while nodes are eliminated: variables, instructions, equations.
struct Nodes {
    /// What a node depends on, with the slot of the derivative.
    operands: Vec<Vec<(u32, u32)>>,
    readers: Vec<Vec<u32>>,
    slot_count: u32,
    eliminations: Vec<Elimination>,
    products: Vec<[u32; 2]>,
}

impl Nodes {
    fn new(count: usize) -> Self {
        Self {
            operands: vec![Vec::new(); count],
            readers: vec![Vec::new(); count],
            slot_count: 0,
            eliminations: Vec::new(),
            products: Vec::new(),
        }
    }

    /// The slot of d(node)/d(operand), made where there is none yet.
    fn slot(&mut self, node: u32, operand: u32) -> u32 {
        let known = self.operands[node as usize].iter().find(|(other, _)| *other == operand);
        if let Some(&(_, slot)) = known {
            return slot;
        }
        let slot = self.slot_count;
        self.slot_count += 1;
        self.operands[node as usize].push((operand, slot));
        self.readers[operand as usize].push(node);
        slot
    }

    /// Change of the number of entries by an elimination, at most.
    fn growth(&self, node: u32) -> i64 {
        let (into, out) = (self.operands[node as usize].len() as i64, self.readers[node as usize].len() as i64);
        into * out - into - out
    }

    fn eliminate(&mut self, node: u32) {
        let operands = std::mem::take(&mut self.operands[node as usize]);
        let readers = std::mem::take(&mut self.readers[node as usize]);
        for &reader in &readers {
            let list = &mut self.operands[reader as usize];
            let Some(at) = list.iter().position(|(operand, _)| *operand == node) else { continue };
            let (_, outer) = list.swap_remove(at);
            for &(operand, inner) in &operands {
                let slot = self.slot(reader, operand);
                self.products.push([slot, inner]);
            }
            self.eliminations.push(Elimination { outer, end: self.products.len() as u32 });
        }
        for (operand, _) in operands {
            self.readers[operand as usize].retain(|reader| *reader != node);
        }
    }
}

impl Expansion {
    /// Of d(`rows`)/d(`columns`) through the instructions of `sweep`; the first `state_count` rows belong to
    /// differential variables. `jacobian_entries`: structurally non-zero derivatives.
    pub fn new(
        sweep: &Sweep,
        register_count: usize,
        (columns, rows): (&[u32], &[u32]),
        (state_count, jacobian_entries): (usize, usize),
    ) -> Self {
        let n = columns.len();
        let mut node_of = vec![NONE; register_count];
        columns.iter().enumerate().for_each(|(i, &register)| node_of[register as usize] = i as u32);
        let instructions: Vec<(u32, [Option<u32>; 2])> = sweep.dependences().collect();
        let needed = needed(&instructions, register_count, rows);
        let mut active = Vec::new();
        for (index, (target, operands)) in instructions.iter().enumerate() {
            let depends = operands.iter().flatten().any(|&operand| node_of[operand as usize] != NONE);
            if depends && needed[*target as usize] {
                node_of[*target as usize] = (n + active.len()) as u32;
                active.push(index);
            }
        }
        let first_row = n + active.len();
        let mut nodes = Nodes::new(first_row + rows.len());
        let mut seeds = Vec::new();
        for (k, &index) in active.iter().enumerate() {
            for (operand, register) in instructions[index].1.iter().enumerate() {
                let Some(node) = register.map(|r| node_of[r as usize]).filter(|node| *node != NONE) else { continue };
                let slot = nodes.slot((n + k) as u32, node);
                seeds.push(Seed { slot, instruction: index as u32, operand: operand as u32 });
            }
        }
        let mut ones = Vec::new();
        for (row, &register) in rows.iter().enumerate() {
            let node = node_of[register as usize];
            if node != NONE {
                ones.push(nodes.slot((first_row + row) as u32, node));
            }
        }
        let mut is_left = vec![true; first_row];
        eliminate(&mut nodes, n, &mut is_left, 0);
        let kept: usize = nodes.operands.iter().map(Vec::len).sum();
        if jacobian_entries <= WORTHWHILE * kept {
            eliminate(&mut nodes, n, &mut is_left, i64::MAX);
        }
        let left: Vec<u32> = (n..first_row).filter(|&node| is_left[node]).map(|node| node as u32).collect();
        Self::assemble(nodes, (seeds, ones), &left, (n, first_row, state_count))
    }

    fn assemble(
        nodes: Nodes,
        (seeds, ones): (Vec<Seed>, Vec<u32>),
        left: &[u32],
        (n, first_row, state_count): (usize, usize, usize),
    ) -> Self {
        let mut unknown: Vec<u32> = (0..first_row as u32).collect();
        left.iter().enumerate().for_each(|(k, &node)| unknown[node as usize] = (n + k) as u32);
        let intermediate = left.iter().enumerate().map(|(k, &node)| (n + k, node as usize));
        let equations = intermediate.chain((0..n).map(|row| (row, first_row + row)));
        let mut entries = Vec::new();
        for (row, node) in equations {
            for &(operand, slot) in &nodes.operands[node] {
                entries.push(Entry { row: row as u32, column: unknown[operand as usize], slot, place: 0 });
            }
        }
        let size = n + left.len();
        let mut places: Vec<(usize, usize)> = entries.iter().map(|e| (e.row as usize, e.column as usize)).collect();
        places.extend((0..state_count).chain(n..size).map(|i| (i, i)));
        let pattern = SparsityPattern::from_entries(size, size, &places);
        let place = |row: usize, column: usize| {
            let start = pattern.starts[column];
            (start + pattern.rows[start..pattern.starts[column + 1]].partition_point(|&other| other < row)) as u32
        };
        for entry in &mut entries {
            entry.place = place(entry.row as usize, entry.column as usize);
        }
        let units = (n..size).map(|i| place(i, i)).collect();
        let diagonal = (0..state_count).map(|i| place(i, i)).collect();
        let slot_count = nodes.slot_count as usize;
        let Nodes { eliminations, products, .. } = nodes;
        Self { slot_count, seeds, ones, eliminations, products, entries, units, diagonal, pattern }
    }

    /// Values in the order of the pattern: rows of rates as in `c y' - rates` (constraints: `rates`), columns of
    /// variables in units of `scale`, intermediate results in units of what they are typically. The programs must have
    /// run.
    pub fn evaluate(
        &self,
        (sweep, registers, inputs): (&Sweep, &[f64], &dyn InputSource),
        (scratch, memory): (&mut Scratch, &mut Memory),
        (scale, c): (&[f64], f64),
        values: &mut [f64],
    ) {
        let (n, state_count) = (scale.len(), self.diagonal.len());
        let partials = sweep.partials(registers, inputs, scratch);
        memory.slots.clear();
        memory.slots.resize(self.slot_count, 0.0);
        let slots = &mut memory.slots[..];
        self.seeds.iter().for_each(|s| slots[s.slot as usize] += partials[s.instruction as usize][s.operand as usize]);
        self.ones.iter().for_each(|&slot| slots[slot as usize] = 1.0);
        let mut begin = 0;
        for elimination in &self.eliminations {
            let end = elimination.end as usize;
            let outer = slots[elimination.outer as usize];
            if outer != 0.0 {
                for &[target, inner] in &self.products[begin..end] {
                    slots[target as usize] += outer * slots[inner as usize];
                }
            }
            begin = end;
        }
        values.fill(0.0);
        memory.scale.clear();
        memory.scale.extend_from_slice(scale);
        for entries in self.entries.chunk_by(|a, b| a.row == b.row) {
            let row = entries[0].row as usize;
            let effect = |entry: &Entry, scale: &[f64]| slots[entry.slot as usize] * scale[entry.column as usize];
            let factor = if row >= n {
                let size = entries.iter().fold(0.0_f64, |size, entry| size.max(effect(entry, &memory.scale).abs()));
                let size = if size > 0.0 { size } else { 1.0 };
                memory.scale.push(size);
                -1.0 / size
            } else if row < state_count {
                -1.0
            } else {
                1.0
            };
            for entry in entries {
                values[entry.place as usize] = factor * effect(entry, &memory.scale);
            }
        }
        self.units.iter().for_each(|&place| values[place as usize] = 1.0);
        self.diagonal.iter().zip(scale).for_each(|(&place, scale)| values[place as usize] += c * scale);
    }
}

/// Registers that `rows` depend on.
fn needed(instructions: &[(u32, [Option<u32>; 2])], register_count: usize, rows: &[u32]) -> Vec<bool> {
    let mut needed = vec![false; register_count];
    rows.iter().for_each(|&register| needed[register as usize] = true);
    for (target, operands) in instructions.iter().rev() {
        if needed[*target as usize] {
            operands.iter().flatten().for_each(|&operand| needed[operand as usize] = true);
        }
    }
    needed
}

/// Eliminates instructions (nodes from `first` on), always one with least growth, as long as that changes the number of
/// entries by at most `largest_growth`.
fn eliminate(nodes: &mut Nodes, first: usize, is_left: &mut [bool], largest_growth: i64) {
    let end = is_left.len();
    let mut queue: BinaryHeap<Reverse<(i64, u32)>> = (first as u32..end as u32)
        .filter(|&node| is_left[node as usize])
        .map(|node| Reverse((nodes.growth(node), node)))
        .collect();
    while let Some(Reverse((growth, node))) = queue.pop() {
        if !is_left[node as usize] || nodes.growth(node) != growth {
            continue;
        }
        if growth > largest_growth {
            break;
        }
        is_left[node as usize] = false;
        let mut touched: Vec<u32> = nodes.readers[node as usize].clone();
        touched.extend(nodes.operands[node as usize].iter().map(|(operand, _)| *operand));
        nodes.eliminate(node);
        for other in touched.into_iter().filter(|&other| (first as u32..end as u32).contains(&other)) {
            queue.push(Reverse((nodes.growth(other), other)));
        }
    }
}
