//! Execution of runs, compiled once per width of vector registers; the widest that the processor has is chosen at run
//! time.

use super::InputSource;
use super::elementary;
use super::program::{Form, Instruction, Run};
use crate::expression::{Binary, Unary};
use multiversion::multiversion;

/// Executes runs one after the other.
///
/// # Safety
///
/// All operands and targets must be among the `registers`, the former with room for [`LANES`] numbers per block behind
/// the first of consecutive ones; lists must name as many registers as the blocks of their run have numbers.
#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) unsafe fn execute(runs: &[Run], listed: &[u32], registers: &mut [f64], inputs: &dyn InputSource) {
    for run in runs {
        let kernel = Kernel { run, listed, registers: registers.as_mut_ptr() };
        match run.instruction {
            Instruction::Unary(function) => unary(function, kernel),
            Instruction::Binary(function) => binary(function, kernel),
            Instruction::Copy => kernel.map_one(|a| a),
            Instruction::Select => select(kernel),
            Instruction::Sample { input, order } => kernel.map_one_out_of_line(|t| inputs.sample(input, order, t)),
        }
    }
}

#[inline(always)]
fn unary(function: Unary, kernel: Kernel) {
    match function {
        Unary::Negate => kernel.map_one(|a| -a),
        Unary::Sqrt => kernel.map_one(f64::sqrt),
        Unary::Abs => kernel.map_one(f64::abs),
        Unary::Sin if kernel.is_within(elementary::LARGEST_ANGLE) => kernel.map_one(elementary::sin),
        Unary::Cos if kernel.is_within(elementary::LARGEST_ANGLE) => kernel.map_one(elementary::cos),
        Unary::Sin => kernel.map_one_out_of_line(elementary::sin_of_any),
        Unary::Cos => kernel.map_one_out_of_line(elementary::cos_of_any),
        Unary::Tanh => kernel.map_one(elementary::tanh),
        Unary::Exp => kernel.map_one(elementary::exp),
        other => kernel.map_one_out_of_line(|a| other.evaluate(a)),
    }
}

#[inline(always)]
fn binary(function: Binary, kernel: Kernel) {
    match function {
        Binary::Add => kernel.map_two(|a, b| a + b),
        Binary::Subtract => kernel.map_two(|a, b| a - b),
        Binary::Multiply => kernel.map_two(|a, b| a * b),
        Binary::Divide => kernel.map_two(|a, b| a / b),
        Binary::Less => kernel.map_two(|a, b| if a < b { 1.0 } else { 0.0 }),
        other => kernel.map_two_out_of_line(|a, b| other.evaluate(a, b)),
    }
}

#[inline(always)]
fn select(kernel: Kernel) {
    kernel.map_three(|condition, then, otherwise| if condition != 0.0 { then } else { otherwise });
}

/// Numbers computed at a time. The last ones of a run may stand for nothing: they are not stored.
pub(super) const LANES: usize = 8;

type Block = [f64; LANES];

/// An operand of all instructions of a run, block by block.
trait Operand: Copy {
    /// # Safety
    ///
    /// The run must have the block, and what [`execute`] asks for must hold.
    unsafe fn block(self, index: usize) -> Block;
}

#[derive(Clone, Copy)]
struct Consecutive(*const f64);

impl Operand for Consecutive {
    #[inline(always)]
    unsafe fn block(self, index: usize) -> Block {
        // SAFETY: the file of registers reaches beyond the last block.
        unsafe { self.0.add(LANES * index).cast::<Block>().read() }
    }
}

#[derive(Clone, Copy)]
struct Same(f64);

impl Operand for Same {
    #[inline(always)]
    unsafe fn block(self, _: usize) -> Block {
        [self.0; LANES]
    }
}

#[derive(Clone, Copy)]
struct Listed {
    registers: *const f64,
    list: *const u32,
}

impl Operand for Listed {
    #[inline(always)]
    unsafe fn block(self, index: usize) -> Block {
        // SAFETY: lists are as long as the blocks of their run and name registers of the file.
        let list = unsafe { self.list.add(LANES * index).cast::<[u32; LANES]>().read() };
        let mut block = [0.0; LANES];
        for lane in 0..LANES {
            // SAFETY: the same.
            block[lane] = unsafe { *self.registers.add(list[lane] as usize) };
        }
        block
    }
}

/// Calls a function with the operand of a run in its form.
macro_rules! with_operand {
    ($kernel:ident, $index:literal, $operand:ident => $call:expr) => {
        match $kernel.run.forms[$index] {
            Form::Consecutive => {
                let $operand = Consecutive($kernel.at($kernel.run.operands[$index]));
                $call
            }
            Form::Same => {
                let $operand = Same($kernel.value($kernel.run.operands[$index]));
                $call
            }
            Form::Listed => {
                let $operand = $kernel.listed($kernel.run.operands[$index]);
                $call
            }
        }
    };
}

/// A run over a file of registers.
#[derive(Clone, Copy)]
struct Kernel<'a> {
    run: &'a Run,
    listed: &'a [u32],
    registers: *mut f64,
}

impl Kernel<'_> {
    #[inline(always)]
    fn at(self, register: u32) -> *mut f64 {
        // SAFETY: registers of the program exist ([`execute`]).
        unsafe { self.registers.add(register as usize) }
    }

    #[inline(always)]
    fn value(self, register: u32) -> f64 {
        // SAFETY: the same.
        unsafe { *self.at(register) }
    }

    #[inline(always)]
    fn listed(self, first: u32) -> Listed {
        // SAFETY: lists are as long as their runs ([`execute`]).
        Listed { registers: self.registers, list: unsafe { self.listed.as_ptr().add(first as usize) } }
    }

    #[inline(always)]
    fn count(self) -> usize {
        self.run.count as usize
    }

    #[inline(always)]
    fn read(self, operand: usize, offset: usize) -> f64 {
        let first = self.run.operands[operand];
        match self.run.forms[operand] {
            Form::Consecutive => self.value(first + offset as u32),
            Form::Same => self.value(first),
            Form::Listed => self.value(self.listed[first as usize + offset]),
        }
    }

    /// Whether all of the first operand are at most `limit` in size.
    #[inline(always)]
    fn is_within(self, limit: f64) -> bool {
        let is_small = |value: f64| value.abs() <= limit;
        if self.run.forms[0] == Form::Consecutive {
            let first = self.at(self.run.operands[0]);
            // SAFETY: operands stand in the file.
            let values = unsafe { std::slice::from_raw_parts(first, self.count()) };
            return values.iter().fold(true, |within, value| within & is_small(*value));
        }
        (0..self.count()).all(|offset| is_small(self.read(0, offset)))
    }

    /// Computes block by block; operands are read before results are written, so that blocks may reach into them.
    #[inline(always)]
    fn store(self, function: impl Fn(usize) -> Block) {
        let (whole, rest) = (self.count() / LANES, self.count() % LANES);
        let target = self.at(self.run.first_target);
        for index in 0..whole {
            let block = function(index);
            // SAFETY: results stand in the file.
            unsafe { target.add(LANES * index).cast::<Block>().write(block) };
        }
        if rest > 0 {
            let block = function(whole);
            let (mut from, mut to) = (block.as_ptr(), target.wrapping_add(LANES * whole));
            // In halves: a loop over what is left would become a call.
            // SAFETY: the same; the parts together are as long as the rest.
            unsafe {
                if rest & 4 != 0 {
                    to.cast::<[f64; 4]>().write(from.cast::<[f64; 4]>().read());
                    (from, to) = (from.add(4), to.add(4));
                }
                if rest & 2 != 0 {
                    to.cast::<[f64; 2]>().write(from.cast::<[f64; 2]>().read());
                    (from, to) = (from.add(2), to.add(2));
                }
                if rest & 1 != 0 {
                    to.write(from.read());
                }
            }
        }
    }

    #[inline(always)]
    fn map_one(self, function: impl Fn(f64) -> f64 + Copy) {
        with_operand!(self, 0, a => self.store(#[inline(always)] |index| {
            // SAFETY: `store` asks for the run's blocks.
            let a = unsafe { a.block(index) };
            let mut results = [0.0; LANES];
            for lane in 0..LANES {
                results[lane] = function(a[lane]);
            }
            results
        }));
    }

    #[inline(always)]
    fn map_two(self, function: impl Fn(f64, f64) -> f64 + Copy) {
        with_operand!(self, 0, a => with_operand!(self, 1, b => self.store(#[inline(always)] |index| {
            // SAFETY: `store` asks for the run's blocks.
            let (a, b) = unsafe { (a.block(index), b.block(index)) };
            let mut results = [0.0; LANES];
            for lane in 0..LANES {
                results[lane] = function(a[lane], b[lane]);
            }
            results
        })));
    }

    #[inline(always)]
    fn map_three(self, function: impl Fn(f64, f64, f64) -> f64 + Copy) {
        with_operand!(self, 0, a => with_operand!(self, 1, b => with_operand!(self, 2, c => self.store(#[inline(always)] |index| {
            // SAFETY: `store` asks for the run's blocks.
            let (a, b, c) = unsafe { (a.block(index), b.block(index), c.block(index)) };
            let mut results = [0.0; LANES];
            for lane in 0..LANES {
                results[lane] = function(a[lane], b[lane], c[lane]);
            }
            results
        }))));
    }

    /// For functions that are calls anyway.
    #[inline(always)]
    fn map_one_out_of_line(self, function: impl Fn(f64) -> f64) {
        for offset in 0..self.count() {
            // SAFETY: results stand in the file.
            unsafe { *self.at(self.run.first_target + offset as u32) = function(self.read(0, offset)) };
        }
    }

    #[inline(always)]
    fn map_two_out_of_line(self, function: impl Fn(f64, f64) -> f64) {
        for offset in 0..self.count() {
            let value = function(self.read(0, offset), self.read(1, offset));
            // SAFETY: results stand in the file.
            unsafe { *self.at(self.run.first_target + offset as u32) = value };
        }
    }
}
