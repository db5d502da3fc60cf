//! A tape: runs of equal instructions over a file of registers.

use super::InputSource;
use super::kernels;
use crate::expression::{Binary, Unary};

/// What an instruction computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Instruction {
    Unary(Unary),
    Binary(Binary),
    Copy,
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
            Instruction::Unary(_) | Instruction::Copy | Instruction::Sample { .. } => 1,
            Instruction::Binary(_) => 2,
            Instruction::Select => 3,
        }
    }
}

/// One instruction of a program; operands beyond the instruction's own are zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Line {
    pub instruction: Instruction,
    pub target: u32,
    pub operands: [u32; 3],
}

impl Line {
    pub fn operands(&self) -> &[u32] {
        &self.operands[..self.instruction.operand_count()]
    }
}

/// How the operands of a run's instructions lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// In consecutive registers.
    Consecutive,
    /// All in the same register.
    Same,
    /// In registers that the program lists.
    Listed,
}

/// `count` times the same instruction; results go to consecutive registers, operands stand below the first of them.
///
/// Dispatch is paid per run instead of per instruction, and a run is a loop of independent operations: vector instructions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub instruction: Instruction,
    pub forms: [Form; 3],
    pub first_target: u32,
    pub count: u32,
    /// Per operand: its first register, or where its list begins.
    pub operands: [u32; 3],
}

/// A verified straight-line program.
#[derive(Clone, Debug, Default)]
pub(super) struct Program {
    lines: Vec<Line>,
    runs: Vec<Run>,
    listed: Vec<u32>,
    /// Registers that must exist.
    register_count: usize,
}

impl Program {
    /// From lists of equal instructions that belong together.
    ///
    /// # Panics
    ///
    /// If an operand is not below its target: a fault of the compiler, never of a study.
    pub fn new(groups: Vec<Vec<Line>>) -> Self {
        let mut program = Self::default();
        program.extend(groups);
        program
    }

    /// Appends instructions.
    pub fn extend(&mut self, groups: Vec<Vec<Line>>) {
        for lines in groups {
            let mut first = 0;
            while first < lines.len() {
                let head = lines[first];
                let belongs = |(offset, line): &(usize, &Line)| {
                    line.instruction == head.instruction
                        && line.target as usize == head.target as usize + offset
                        && (*offset == 0 || line.operands().iter().all(|&operand| operand < head.target))
                };
                let count = lines[first..].iter().enumerate().take_while(belongs).count();
                self.add_run(&lines[first..first + count]);
                first += count;
            }
            self.lines.extend(lines);
        }
    }

    fn add_run(&mut self, lines: &[Line]) {
        let (head, count) = (lines[0], lines.len());
        let instruction = head.instruction;
        assert!(lines.iter().all(|line| line.operands().iter().all(|&operand| operand < head.target)));
        let mut run = Run {
            instruction,
            forms: [Form::Same; 3],
            first_target: head.target,
            count: count as u32,
            operands: head.operands,
        };
        for k in 0..instruction.operand_count() {
            let registers = lines.iter().map(|line| line.operands[k]);
            run.forms[k] = form(registers.clone());
            if run.forms[k] == Form::Listed {
                run.operands[k] = self.listed.len() as u32;
                self.listed.extend(registers);
            }
        }
        self.register_count = self.register_count.max(head.target as usize + count);
        self.runs.push(run);
    }

    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    pub fn run_count(&self) -> usize {
        self.runs.len()
    }

    /// Executes the program.
    pub fn execute(&self, registers: &mut [f64], inputs: &dyn InputSource) {
        assert!(registers.len() >= self.register_count);
        // SAFETY: the registers exist; `add_run` has made sure of the operands and filled the lists.
        unsafe { kernels::execute(&self.runs, &self.listed, registers, inputs) }
    }
}

/// How operands in these registers lie.
fn form(registers: impl Iterator<Item = u32> + Clone) -> Form {
    let first = registers.clone().next().unwrap_or(0);
    if registers.clone().all(|register| register == first) {
        Form::Same
    } else if registers.zip(first..).all(|(register, consecutive)| register == consecutive) {
        Form::Consecutive
    } else {
        Form::Listed
    }
}
