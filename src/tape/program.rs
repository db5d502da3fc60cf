//! A tape: runs of equal instructions over a file of registers.

use super::InputSource;
use crate::expression::{Binary, Unary};

/// What an instruction computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Instruction {
    Unary(Unary),
    Binary(Binary),
    /// Operands: condition, then, otherwise.
    Select,
    /// Operand: time.
    Sample {
        input: u32,
        order: u8,
    },
}

impl Instruction {
    pub fn operand_count(self) -> usize {
        match self {
            Instruction::Unary(_) | Instruction::Sample { .. } => 1,
            Instruction::Binary(_) => 2,
            Instruction::Select => 3,
        }
    }
}

/// `count` times the same instruction; results go to consecutive registers.
///
/// Dispatch is paid per run instead of per instruction: a loop over operands of one kind of arithmetic comes close
/// to compiled code.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub instruction: Instruction,
    pub first_target: usize,
    pub count: usize,
    pub first_operand: usize,
}

/// A verified straight-line program. Instructions may read every register below their own target.
#[derive(Clone, Debug, Default)]
pub(super) struct Program {
    runs: Vec<Run>,
    operands: Vec<u32>,
    /// Registers that must exist.
    register_count: usize,
}

impl Program {
    /// Appends an instruction that writes `target`.
    ///
    /// # Panics
    ///
    /// If an operand is not below `target` or their number is wrong: a fault of the compiler, never of a study.
    pub fn push(&mut self, instruction: Instruction, target: usize, operands: &[u32]) {
        assert_eq!(operands.len(), instruction.operand_count());
        assert!(operands.iter().all(|&operand| (operand as usize) < target));
        let continued = self
            .runs
            .last()
            .is_some_and(|run| run.instruction == instruction && run.first_target + run.count == target);
        if continued && let Some(run) = self.runs.last_mut() {
            run.count += 1;
        } else {
            let first_operand = self.operands.len();
            self.runs.push(Run { instruction, first_target: target, count: 1, first_operand });
        }
        self.operands.extend_from_slice(operands);
        self.register_count = self.register_count.max(target + 1);
    }

    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    pub fn operands(&self, run: &Run) -> &[u32] {
        let length = run.count * run.instruction.operand_count();
        &self.operands[run.first_operand..run.first_operand + length]
    }

    pub fn instruction_count(&self) -> usize {
        self.runs.iter().map(|run| run.count).sum()
    }

    /// Executes the program.
    pub fn execute(&self, registers: &mut [f64], inputs: &dyn InputSource) {
        assert!(registers.len() >= self.register_count);
        for run in &self.runs {
            let operands = self.operands(run);
            let target = run.first_target;
            match run.instruction {
                Instruction::Unary(function) => unary(function, registers, target, operands),
                Instruction::Binary(function) => binary(function, registers, target, operands),
                Instruction::Select => select(registers, target, operands),
                Instruction::Sample { input, order } => {
                    map_one(registers, target, operands, |t| inputs.sample(input, order, t));
                }
            }
        }
    }
}

fn unary(function: Unary, registers: &mut [f64], target: usize, operands: &[u32]) {
    match function {
        Unary::Negate => map_one(registers, target, operands, |a| -a),
        Unary::Sqrt => map_one(registers, target, operands, f64::sqrt),
        Unary::Abs => map_one(registers, target, operands, f64::abs),
        Unary::Sin => map_one(registers, target, operands, f64::sin),
        Unary::Cos => map_one(registers, target, operands, f64::cos),
        Unary::Tanh => map_one(registers, target, operands, f64::tanh),
        Unary::Exp => map_one(registers, target, operands, f64::exp),
        other => map_one(registers, target, operands, |a| other.evaluate(a)),
    }
}

fn binary(function: Binary, registers: &mut [f64], target: usize, operands: &[u32]) {
    match function {
        Binary::Add => map_two(registers, target, operands, |a, b| a + b),
        Binary::Subtract => map_two(registers, target, operands, |a, b| a - b),
        Binary::Multiply => map_two(registers, target, operands, |a, b| a * b),
        Binary::Divide => map_two(registers, target, operands, |a, b| a / b),
        other => map_two(registers, target, operands, |a, b| other.evaluate(a, b)),
    }
}

#[inline(always)]
fn map_one(registers: &mut [f64], target: usize, operands: &[u32], function: impl Fn(f64) -> f64) {
    for (offset, &operand) in operands.iter().enumerate() {
        // SAFETY: `Program::push` admits only operands below their target, targets below `register_count`, and
        // `Program::execute` asserts that so many registers exist.
        unsafe {
            let a = *registers.get_unchecked(operand as usize);
            *registers.get_unchecked_mut(target + offset) = function(a);
        }
    }
}

#[inline(always)]
fn map_two(registers: &mut [f64], target: usize, operands: &[u32], function: impl Fn(f64, f64) -> f64) {
    for (offset, pair) in operands.as_chunks::<2>().0.iter().enumerate() {
        // SAFETY: as in `map_one`.
        unsafe {
            let a = *registers.get_unchecked(pair[0] as usize);
            let b = *registers.get_unchecked(pair[1] as usize);
            *registers.get_unchecked_mut(target + offset) = function(a, b);
        }
    }
}

fn select(registers: &mut [f64], target: usize, operands: &[u32]) {
    for (offset, &[condition, then, otherwise]) in operands.as_chunks::<3>().0.iter().enumerate() {
        let chosen = if registers[condition as usize] != 0.0 { then } else { otherwise };
        registers[target + offset] = registers[chosen as usize];
    }
}
