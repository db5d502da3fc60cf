//! The order of instructions: equal ones together, neighbours in registers side by side, so that runs become vector
//! instructions.

use super::compile::{Assembler, Dependence};
use super::program::{Instruction, Line};
use crate::expression::{Binary, Node, Operation};
use std::collections::{BTreeMap, HashMap};

/// Runs of operands in consecutive registers are set apart from this length on; shorter ones cost more to start than
/// they save (both lengths as timed on processors with registers of four numbers).
const SHORTEST_CHAIN: usize = 6;
/// From this length on they need no copies to be as fast.
const LONG_CHAIN: usize = 24;

/// An instruction whose operands are ready.
#[derive(Clone, Copy)]
struct Candidate {
    operands: [u32; 3],
    /// True per operand that only parameters determine.
    fixed: [bool; 3],
    index: usize,
}

impl Assembler<'_> {
    /// Assigns registers in an order in which equal instructions follow each other: always all ready nodes of the
    /// instruction that has most of them. With `copies`, operands that only parameters determine may be copied to where
    /// they are neighbours; [`Assembler::take_copies`] tells these.
    pub(super) fn schedule(&mut self, nodes: &[Node], copies: bool) -> Vec<Vec<Line>> {
        let mut position = vec![usize::MAX; nodes.last().map_or(0, |node| node.index() + 1)];
        nodes.iter().enumerate().for_each(|(i, node)| position[node.index()] = i);
        let mut waiting = vec![0_usize; nodes.len()];
        // Readers of each node as linked lists in one vector of (reader, next).
        let mut first_reader = vec![usize::MAX; nodes.len()];
        let mut readers: Vec<(usize, usize)> = Vec::with_capacity(2 * nodes.len());
        let mut ready: BTreeMap<Instruction, Vec<usize>> = BTreeMap::new();
        for (i, &node) in nodes.iter().enumerate() {
            let operation = self.graph.operation(node);
            for child in operation.children() {
                let child = position[child.index()];
                if child != usize::MAX {
                    waiting[i] += 1;
                    readers.push((i, first_reader[child]));
                    first_reader[child] = readers.len() - 1;
                }
            }
            if waiting[i] == 0
                && let Some(instruction) = instruction(operation)
            {
                ready.entry(instruction).or_default().push(i);
            }
        }
        let mut groups = Vec::new();
        while let Some(instruction_now) = most_ready(&ready) {
            let batch = ready.remove(&instruction_now).unwrap_or_default();
            let candidates = batch.into_iter().map(|i| self.candidate(nodes[i], i)).collect();
            for chain in chains(candidates, copies) {
                let mut lines: Vec<Line> = Vec::new();
                for candidate in self.with_copies(chain) {
                    let i = candidate.index;
                    let target = self.next as u32;
                    lines.push(Line { instruction: instruction_now, target, operands: candidate.operands });
                    self.registers[nodes[i].index()] = target;
                    self.next += 1;
                    let mut edge = first_reader[i];
                    while edge != usize::MAX {
                        let (reader, next_edge) = readers[edge];
                        edge = next_edge;
                        waiting[reader] -= 1;
                        if waiting[reader] == 0
                            && let Some(next) = instruction(self.graph.operation(nodes[reader]))
                        {
                            ready.entry(next).or_default().push(reader);
                        }
                    }
                }
                groups.push(lines);
            }
        }
        groups
    }

    fn candidate(&self, node: Node, index: usize) -> Candidate {
        let mut candidate = Candidate { operands: [0; 3], fixed: [false; 3], index };
        for (k, child) in self.graph.operation(node).children().enumerate() {
            candidate.operands[k] = self.registers[child.index()];
            candidate.fixed[k] = self.dependence[child.index()] == Dependence::Parameters;
        }
        let commutes = matches!(self.graph.operation(node), Operation::Binary(Binary::Add | Binary::Multiply, ..));
        if commutes && candidate.fixed[1] && !candidate.fixed[0] {
            candidate.operands.swap(0, 1);
            candidate.fixed.swap(0, 1);
        }
        candidate
    }

    /// Replaces the operand to be copied by consecutive copies.
    fn with_copies(&mut self, chain: Chain) -> Vec<Candidate> {
        let mut candidates = chain.candidates;
        if let Some(operand) = chain.copied {
            let mut copies = Vec::with_capacity(candidates.len());
            for candidate in &mut candidates {
                let (target, source) = (self.next as u32, candidate.operands[operand]);
                copies.push(Line { instruction: Instruction::Copy, target, operands: [source, 0, 0] });
                candidate.operands[operand] = target;
                self.next += 1;
            }
            self.copies.push(copies);
        }
        candidates
    }

    /// What to execute after the prologue, once per parameter vector.
    pub(super) fn take_copies(&mut self) -> Vec<Vec<Line>> {
        std::mem::take(&mut self.copies)
    }
}

/// Candidates whose operands are neighbours, or a rest.
struct Chain {
    candidates: Vec<Candidate>,
    /// The operand to be copied into consecutive registers.
    copied: Option<usize>,
}

/// Splits a batch of one instruction into chains and a rest.
fn chains(batch: Vec<Candidate>, copies: bool) -> Vec<Chain> {
    let mut found = Vec::new();
    let mut rest = batch;
    if copies {
        rest = neighbours(rest, LONG_CHAIN, &mut found);
        for operand in 0..2 {
            rest = beside_fixed(rest, operand, &mut found);
        }
    }
    rest = neighbours(rest, SHORTEST_CHAIN, &mut found);
    found.push(Chain { candidates: rest, copied: None });
    found
}

/// Chains in which every operand stays the same or goes on to the next register; returns what is in none.
fn neighbours(mut batch: Vec<Candidate>, shortest: usize, found: &mut Vec<Chain>) -> Vec<Candidate> {
    batch.sort_unstable_by_key(|candidate| (candidate.operands, candidate.index));
    let place: HashMap<[u32; 3], usize> = batch.iter().enumerate().map(|(at, c)| (c.operands, at)).collect();
    let mut taken = vec![false; batch.len()];
    let mut rest = Vec::new();
    for first in 0..batch.len() {
        if taken[first] {
            continue;
        }
        let follow = |step: [u32; 3]| -> Vec<usize> {
            let mut chain = vec![first];
            let mut operands = batch[first].operands;
            loop {
                operands = std::array::from_fn(|k| operands[k] + step[k]);
                match place.get(&operands) {
                    Some(&next) if !taken[next] => chain.push(next),
                    _ => return chain,
                }
            }
        };
        let steps = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 1], [0, 1, 1]];
        let longest = steps.map(follow).into_iter().rev().max_by_key(Vec::len).unwrap_or_default();
        if longest.len() >= shortest {
            longest.iter().for_each(|&at| taken[at] = true);
            found.push(Chain { candidates: longest.into_iter().map(|at| batch[at]).collect(), copied: None });
        } else {
            taken[first] = true;
            rest.push(batch[first]);
        }
    }
    rest
}

/// Chains of two operands in which `operand` is fixed, the other not, and goes on to the next register; returns what is
/// in none.
fn beside_fixed(rest: Vec<Candidate>, operand: usize, found: &mut Vec<Chain>) -> Vec<Candidate> {
    let other = 1 - operand;
    let (mut suitable, mut others): (Vec<Candidate>, Vec<Candidate>) =
        rest.into_iter().partition(|c| c.fixed[operand] && !c.fixed[other] && c.operands[2] == 0);
    suitable.sort_unstable_by_key(|candidate| (candidate.operands[other], candidate.operands[operand]));
    // The same register may stand beside several fixed ones: a chain takes the first of them, the next chain the
    // second.
    while !suitable.is_empty() {
        let mut layer: Vec<Candidate> = Vec::new();
        let mut later = Vec::new();
        for candidate in suitable {
            if layer.last().is_some_and(|last| last.operands[other] == candidate.operands[other]) {
                later.push(candidate);
            } else {
                layer.push(candidate);
            }
        }
        for chain in layer.chunk_by(|a, b| a.operands[other] + 1 == b.operands[other]) {
            if chain.len() >= SHORTEST_CHAIN {
                found.push(Chain { candidates: chain.to_vec(), copied: Some(operand) });
            } else {
                others.extend_from_slice(chain);
            }
        }
        suitable = later;
    }
    others
}

fn most_ready(ready: &BTreeMap<Instruction, Vec<usize>>) -> Option<Instruction> {
    // The last of equals wins in `max_by_key`; reversed, ties go to the first instruction.
    ready.iter().rev().max_by_key(|(_, nodes)| nodes.len()).map(|(&instruction, _)| instruction)
}

fn instruction(operation: Operation) -> Option<Instruction> {
    match operation {
        Operation::Constant(_) | Operation::Symbol(_) => None,
        Operation::Unary(function, _) => Some(Instruction::Unary(function)),
        Operation::Binary(function, _, _) => Some(Instruction::Binary(function)),
        Operation::Select { .. } => Some(Instruction::Select),
        Operation::Sample { input, order, .. } => Some(Instruction::Sample { input, order }),
    }
}
