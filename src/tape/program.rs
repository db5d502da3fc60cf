//! A tape: runs of equal instructions over a file of registers.

use super::InputSource;
use super::kernels;
use super::machine::Machine;
use crate::expression::{Binary, Unary};
use std::collections::HashSet;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

/// From this number of instructions per run on the interpreter is as fast as machine code.
const LONG_RUNS: usize = 24;
/// Longer programs take too long to translate.
const MOST_LINES: usize = 5000;
/// Translation takes about as long as this many executions save.
const MANY_EXECUTIONS: u32 = 10_000;

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
/// Dispatch is paid per run instead of per instruction, and a run is a loop of independent operations: vector
/// instructions.
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
    translation: Arc<Translation>,
}

/// Machine code of a program that has been executed often, shared by its copies.
#[derive(Debug, Default)]
struct Translation {
    executions: AtomicU32,
    /// None where the interpreter is as fast, or no machine code possible.
    machine: OnceLock<Option<Machine>>,
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
        self.translation = Arc::default();
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
        let numbers = count.next_multiple_of(kernels::LANES);
        for k in 0..instruction.operand_count() {
            let registers = lines.iter().map(|line| line.operands[k]);
            run.forms[k] = form(registers.clone());
            if run.forms[k] == Form::Listed {
                run.operands[k] = self.listed.len() as u32;
                self.listed.extend(registers);
                self.listed.resize(run.operands[k] as usize + numbers, head.operands[k]);
            }
        }
        // Operands stand below the target.
        self.register_count = self.register_count.max(head.target as usize + numbers);
        self.runs.push(run);
    }

    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    pub fn run_count(&self) -> usize {
        self.runs.len()
    }

    /// The program without the instructions that compute `registers`.
    pub fn without(&self, registers: &[u32]) -> Self {
        let registers: HashSet<u32> = registers.iter().copied().collect();
        let mut rest = &self.lines[..];
        let mut groups = Vec::with_capacity(self.runs.len());
        for run in &self.runs {
            let (lines, others) = rest.split_at(run.count as usize);
            rest = others;
            groups.push(lines.iter().filter(|line| !registers.contains(&line.target)).copied().collect());
        }
        Self::new(groups)
    }

    /// Executes the program.
    pub fn execute(&self, registers: &mut [f64], inputs: &dyn InputSource) {
        assert!(registers.len() >= self.register_count);
        match self.machine() {
            // SAFETY: the registers exist; operands stand below targets.
            Some(machine) => unsafe { machine.execute(registers, inputs) },
            // SAFETY: the registers exist; `add_run` has made sure of the operands and filled the lists.
            None => unsafe { kernels::execute(&self.runs, &self.listed, registers, inputs) },
        }
    }

    /// The machine code, once enough executions have shown that making it pays. Results do not depend on who executes.
    #[inline]
    fn machine(&self) -> Option<&Machine> {
        let translation = &*self.translation;
        if let Some(machine) = translation.machine.get() {
            return machine.as_ref();
        }
        // Executions of other threads may get lost in this count, which does no harm and costs less than to count them
        // all.
        let executions = translation.executions.load(Ordering::Relaxed);
        translation.executions.store(executions + 1, Ordering::Relaxed);
        if executions < MANY_EXECUTIONS { None } else { translation.machine.get_or_init(|| self.translate()).as_ref() }
    }

    fn translate(&self) -> Option<Machine> {
        let has_short_runs = self.lines.len() < LONG_RUNS * self.runs.len();
        if has_short_runs && self.lines.len() <= MOST_LINES { self.machine_code() } else { None }
    }

    fn machine_code(&self) -> Option<Machine> {
        Machine::new(&self.lines, (&self.runs, &self.listed), self.register_count)
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Ramps;

    impl InputSource for Ramps {
        fn sample(&self, input: u32, order: u8, t: f64) -> f64 {
            f64::from(input) + (1.0 + f64::from(order)) * t
        }
    }

    const CONSTANTS: usize = 6;

    fn instruction() -> impl Strategy<Value = Instruction> {
        use Binary::{Add, Atan2, Divide, Less, Maximum, Minimum, Multiply, Power, Subtract};
        use Unary::{Abs, Acos, Asin, Atan, Cos, Cosh, Exp, Floor, Log, Negate, Sign, Sin, Sinh, Sqrt, Tan, Tanh};
        let unary = prop::sample::select(vec![
            Negate, Sin, Cos, Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Exp, Log, Sqrt, Abs, Sign, Floor,
        ]);
        let binary = prop::sample::select(vec![Add, Subtract, Multiply, Divide, Power, Minimum, Maximum, Atan2, Less]);
        prop_oneof![
            5 => binary.prop_map(Instruction::Binary),
            4 => unary.prop_map(Instruction::Unary),
            1 => Just(Instruction::Copy),
            1 => Just(Instruction::Select),
            1 => (0..3_u32, 0..2_u8).prop_map(|(input, order)| Instruction::Sample { input, order }),
        ]
    }

    /// Programs in which every line reads any registers below its own, in groups as the scheduler makes them.
    fn program() -> impl Strategy<Value = Program> {
        let lines = prop::collection::vec((instruction(), any::<[prop::sample::Index; 3]>(), 1..16_usize), 1..30);
        lines.prop_map(|lines| {
            let mut next = CONSTANTS;
            let group = |(instruction, indices, count): (Instruction, [prop::sample::Index; 3], usize)| {
                let below = next;
                let line = |k: usize| {
                    let mut operands = [0; 3];
                    for (operand, index) in operands.iter_mut().zip(indices).take(instruction.operand_count()) {
                        *operand = ((index.index(below) + k) % below) as u32;
                    }
                    Line { instruction, target: (below + k) as u32, operands }
                };
                next += count;
                (0..count).map(line).collect()
            };
            Program::new(lines.into_iter().map(group).collect())
        })
    }

    /// Registers after the interpreter and after machine code.
    fn both(program: &Program, constants: &[f64]) -> [Vec<f64>; 2] {
        let mut interpreted = constants.to_vec();
        interpreted.resize(program.register_count.max(CONSTANTS), 0.0);
        let mut executed = interpreted.clone();
        let machine = program.machine_code().expect("machine code on this processor");
        // SAFETY: the registers exist; the program has been built by `Program::new`.
        unsafe {
            kernels::execute(&program.runs, &program.listed, &mut interpreted, &Ramps);
            machine.execute(&mut executed, &Ramps);
        }
        [interpreted, executed]
    }

    /// Many values at the same time, more than a processor has registers.
    #[test]
    fn long_programs_give_the_same_digits() {
        let line = |target: usize| {
            let function = if target.is_multiple_of(2) { Binary::Add } else { Binary::Multiply };
            let operands = [(target / 2) as u32, (target - 1 - target % 5) as u32, 0];
            vec![Line { instruction: Instruction::Binary(function), target: target as u32, operands }]
        };
        let program = Program::new((CONSTANTS..CONSTANTS + MOST_LINES).map(line).collect());
        let [interpreted, executed] = both(&program, &[0.3, -0.7, 0.9, 0.2, -0.1, 0.5]);
        assert_eq!(interpreted, executed);
        assert!(program.translate().is_some());
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn machine_code_gives_the_digits_of_the_interpreter(
            program in program(),
            constants in prop::array::uniform6(prop_oneof![9 => -3.0..3.0, 1 => Just(0.0), 1 => -1e7..1e7]),
        ) {
            let [interpreted, executed] = both(&program, &constants);
            for (line, (a, b)) in program.lines().iter().zip(interpreted.iter().zip(&executed).skip(CONSTANTS)) {
                // The sign of a NaN is nobody's.
                prop_assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "{line:?}: {a:e} and {b:e}");
            }
        }
    }
}
