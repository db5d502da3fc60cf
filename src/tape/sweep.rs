//! Derivatives of large programs without symbolic expressions: tangents pushed forward through the linearised
//! instructions, several columns at a time (Griewank-Walther-2008, chapters 3 and 7).
//!
//! The text of a symbolic Jacobian grows with the number of columns times the length of the program; a sweep stores per
//! group of columns only the list of instructions that they reach.

use super::InputSource;
use super::model::Element;
use super::program::{Instruction, Line, Program};
use super::slopes::{slope, slopes};
use crate::expression::{Binary, Unary};

/// Columns pushed forward together.
const WIDTH: usize = 8;

type Tangent = [f64; WIDTH];

/// A matrix of derivatives of registers with respect to registers.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweep {
    instructions: Vec<Line>,
    groups: Vec<Group>,
}

#[derive(Clone, Debug)]
struct Group {
    steps: Vec<Step>,
    results: Vec<Outcome>,
}

/// `tangent = partial[0] tangents[first] + partial[1] tangents[second]`; tangent 0 is zero, the next are the seeds.
#[derive(Clone, Copy, Debug)]
struct Step {
    instruction: u32,
    first: u32,
    second: u32,
}

/// Lane of a tangent that is an element of the matrix.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    tangent: u32,
    lane: u32,
    register: u32,
}

/// Memory of a sweep.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    partials: Vec<[f64; 2]>,
    tangents: Vec<Tangent>,
}

/// Columns that a register depends on, as bits.
struct Reach {
    words: usize,
    bits: Vec<u64>,
}

impl Reach {
    fn new(registers: usize, columns: &[u32]) -> Self {
        let words = columns.len().div_ceil(64);
        let mut reach = Self { words, bits: vec![0; registers * words] };
        for (column, &register) in columns.iter().enumerate() {
            reach.bits[register as usize * words + column / 64] |= 1 << (column % 64);
        }
        reach
    }

    fn join(&mut self, target: u32, operand: u32) {
        let (to, from) = (target as usize * self.words, operand as usize * self.words);
        for word in 0..self.words {
            let bits = self.bits[from + word];
            self.bits[to + word] |= bits;
        }
    }

    fn contains(&self, register: u32, column: usize) -> bool {
        self.bits[register as usize * self.words + column / 64] >> (column % 64) & 1 == 1
    }

    /// Whether the register depends on any of the columns from `first` on, `WIDTH` of them (they share a word).
    fn touches(&self, register: u32, first: usize) -> bool {
        let mask = ((1_u64 << WIDTH) - 1) << (first % 64);
        self.bits[register as usize * self.words + first / 64] & mask != 0
    }
}

impl Sweep {
    /// d(`rows`)/d(`columns`) through `programs`, which run one after the other over a file of `register_count`
    /// registers. Every element gets a register of its own, counted up from `next`; returned with row, column and
    /// register (slot 0).
    pub fn new(
        programs: &[&Program],
        register_count: usize,
        columns: &[u32],
        rows: &[u32],
        next: &mut usize,
    ) -> (Self, Vec<Element>) {
        let instructions: Vec<Line> = programs.iter().flat_map(|program| program.lines()).copied().collect();
        let mut reach = Reach::new(register_count, columns);
        for instruction in &instructions {
            for &operand in carrying(instruction) {
                reach.join(instruction.target, operand);
            }
        }
        let mut local = vec![0_u32; register_count];
        let mut elements = Vec::new();
        let mut groups = Vec::new();
        for first in (0..columns.len()).step_by(WIDTH) {
            let members = first..(first + WIDTH).min(columns.len());
            let mut written = Vec::new();
            for (lane, column) in members.clone().enumerate() {
                local[columns[column] as usize] = lane as u32 + 1;
                written.push(columns[column]);
            }
            let mut steps = Vec::new();
            for (index, instruction) in instructions.iter().enumerate() {
                if !reach.touches(instruction.target, first) {
                    continue;
                }
                let [a, b] = tangent_operands(instruction).map(|operand| operand.map_or(0, |o| local[o as usize]));
                local[instruction.target as usize] = (1 + WIDTH + steps.len()) as u32;
                written.push(instruction.target);
                steps.push(Step { instruction: index as u32, first: a, second: b });
            }
            let mut results = Vec::new();
            for (lane, column) in members.enumerate() {
                for (row, &register) in rows.iter().enumerate() {
                    if reach.contains(register, column) {
                        let (lane, tangent) = (lane as u32, local[register as usize]);
                        results.push(Outcome { tangent, lane, register: *next as u32 });
                        elements.push(Element {
                            row: row as u32,
                            column: column as u32,
                            register: *next as u32,
                            slot: 0,
                        });
                        *next += 1;
                    }
                }
            }
            written.into_iter().for_each(|register| local[register as usize] = 0);
            groups.push(Group { steps, results });
        }
        (Self { instructions, groups }, elements)
    }

    /// Per instruction its target and the operands that carry derivatives.
    pub fn dependences(&self) -> impl Iterator<Item = (u32, [Option<u32>; 2])> {
        self.instructions.iter().map(|linear| (linear.target, tangent_operands(linear)))
    }

    /// Derivatives of every instruction by the operands of [`Sweep::dependences`]; the programs must have run.
    pub fn partials<'s>(
        &self,
        registers: &[f64],
        inputs: &dyn InputSource,
        scratch: &'s mut Scratch,
    ) -> &'s [[f64; 2]] {
        scratch.partials.clear();
        scratch.partials.extend(self.instructions.iter().map(|line| partials(line, registers, inputs)));
        &scratch.partials
    }

    /// Computes all elements into their registers; the programs must have run.
    pub fn run(&self, registers: &mut [f64], inputs: &dyn InputSource, scratch: &mut Scratch) {
        self.partials(registers, inputs, scratch);
        let longest = self.groups.iter().map(|group| group.steps.len()).max().unwrap_or(0);
        scratch.tangents.resize(1 + WIDTH + longest, [0.0; WIDTH]);
        let tangents = &mut scratch.tangents[..];
        tangents[0] = [0.0; WIDTH];
        for lane in 0..WIDTH {
            tangents[1 + lane] = std::array::from_fn(|k| if k == lane { 1.0 } else { 0.0 });
        }
        for group in &self.groups {
            for (at, step) in group.steps.iter().enumerate() {
                let [p, q] = scratch.partials[step.instruction as usize];
                // What does not depend on the columns adds nothing, even where its slope is infinite.
                let p = if step.first == 0 { 0.0 } else { p };
                let q = if step.second == 0 { 0.0 } else { q };
                let (a, b) = (tangents[step.first as usize], tangents[step.second as usize]);
                tangents[1 + WIDTH + at] = std::array::from_fn(|k| p * a[k] + q * b[k]);
            }
            for result in &group.results {
                registers[result.register as usize] = tangents[result.tangent as usize][result.lane as usize];
            }
        }
    }

    /// Multiplications per run.
    pub fn work(&self) -> usize {
        self.groups.iter().map(|group| group.steps.len()).sum()
    }
}

/// Operands whose change changes the result.
fn carrying(line: &Line) -> &[u32] {
    match line.instruction {
        Instruction::Unary(Unary::Sign | Unary::Floor) | Instruction::Binary(Binary::Less) => &[],
        Instruction::Unary(_) | Instruction::Copy | Instruction::Sample { .. } => &line.operands[..1],
        Instruction::Binary(_) => &line.operands[..2],
        Instruction::Select => &line.operands[1..3],
    }
}

fn tangent_operands(line: &Line) -> [Option<u32>; 2] {
    let carrying = carrying(line);
    [carrying.first().copied(), carrying.get(1).copied()]
}

/// Derivatives by the carrying operands, at the values in the registers.
fn partials(line: &Line, registers: &[f64], inputs: &dyn InputSource) -> [f64; 2] {
    let value = |operand: usize| registers[line.operands[operand] as usize];
    match line.instruction {
        Instruction::Unary(function) => [slope(function, value(0), registers[line.target as usize]), 0.0],
        Instruction::Binary(function) => slopes(function, [value(0), value(1)], registers[line.target as usize]),
        Instruction::Copy => [1.0, 0.0],
        Instruction::Select if value(0) != 0.0 => [1.0, 0.0],
        Instruction::Select => [0.0, 1.0],
        Instruction::Sample { input, order } => [inputs.sample(input, order + 1, value(0)), 0.0],
    }
}
