//! Execution of runs, compiled once per width of vector registers; the widest that the processor has is chosen at run time.

use super::InputSource;
use super::elementary;
use super::program::{Form, Instruction, Run};
use crate::expression::{Binary, Unary};
use multiversion::multiversion;

/// Executes runs one after the other.
///
/// # Safety
///
/// `registers` must reach beyond the last target of every run; operands, `listed` ones too, must stand below the first target
/// of their run; lists must be as long as the run.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) unsafe fn execute(runs: &[Run], listed: &[u32], registers: &mut [f64], inputs: &dyn InputSource) {
    for run in runs {
        // SAFETY: what the caller promises.
        let kernel = unsafe { Kernel::new(run, listed, registers) };
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
    if kernel.run.forms == [Form::Consecutive; 3] {
        let [condition, then, otherwise] = [0, 1, 2].map(|operand| kernel.consecutive(operand));
        for (((result, c), a), b) in kernel.results.iter_mut().zip(condition).zip(then).zip(otherwise) {
            *result = if *c != 0.0 { *a } else { *b };
        }
        return;
    }
    for offset in 0..kernel.results.len() {
        let operand = if kernel.read(0, offset) != 0.0 { 1 } else { 2 };
        kernel.results[offset] = kernel.read(operand, offset);
    }
}

/// Operands and results of a run.
struct Kernel<'a> {
    run: &'a Run,
    listed: &'a [u32],
    /// The registers below the first target.
    known: &'a [f64],
    results: &'a mut [f64],
}

/// An operand in registers of a list.
struct Listed<'a> {
    known: &'a [f64],
    list: &'a [u32],
}

impl Listed<'_> {
    #[inline(always)]
    fn read(&self, offset: usize) -> f64 {
        // SAFETY: lists are as long as their run and name registers below its first target ([`execute`]).
        unsafe { *self.known.get_unchecked(*self.list.get_unchecked(offset) as usize) }
    }
}

impl<'a> Kernel<'a> {
    /// # Safety
    ///
    /// As [`execute`].
    #[inline(always)]
    unsafe fn new(run: &'a Run, listed: &'a [u32], registers: &'a mut [f64]) -> Self {
        let (first, count) = (run.first_target as usize, run.count as usize);
        // SAFETY: what the caller promises.
        let (known, rest) = unsafe { registers.split_at_mut_unchecked(first) };
        // SAFETY: the same.
        let results = unsafe { rest.get_unchecked_mut(..count) };
        Self { run, listed, known, results }
    }

    #[inline(always)]
    fn consecutive(&self, operand: usize) -> &'a [f64] {
        let first = self.run.operands[operand] as usize;
        // SAFETY: operands stand below the first target ([`execute`]).
        unsafe { self.known.get_unchecked(first..first + self.results.len()) }
    }

    #[inline(always)]
    fn same(&self, operand: usize) -> f64 {
        // SAFETY: as above.
        unsafe { *self.known.get_unchecked(self.run.operands[operand] as usize) }
    }

    #[inline(always)]
    fn listed(&self, operand: usize) -> Listed<'a> {
        let first = self.run.operands[operand] as usize;
        // SAFETY: lists are as long as their run ([`execute`]).
        let list = unsafe { self.listed.get_unchecked(first..first + self.results.len()) };
        Listed { known: self.known, list }
    }

    #[inline(always)]
    fn read(&self, operand: usize, offset: usize) -> f64 {
        match self.run.forms[operand] {
            Form::Consecutive => self.consecutive(operand)[offset],
            Form::Same => self.same(operand),
            Form::Listed => self.listed(operand).read(offset),
        }
    }

    /// Whether all of the first operand are at most `limit` in size.
    #[inline(always)]
    fn is_within(&self, limit: f64) -> bool {
        match self.run.forms[0] {
            Form::Consecutive => self.consecutive(0).iter().fold(true, |within, a| within & (a.abs() <= limit)),
            _ => (0..self.results.len()).all(|offset| self.read(0, offset).abs() <= limit),
        }
    }

    #[inline(always)]
    fn map_one(self, function: impl Fn(f64) -> f64) {
        match self.run.forms[0] {
            Form::Consecutive => {
                let a = self.consecutive(0);
                self.results.iter_mut().zip(a).for_each(|(result, a)| *result = function(*a));
            }
            Form::Same => {
                let value = function(self.same(0));
                self.results.fill(value);
            }
            Form::Listed => {
                let a = self.listed(0);
                self.results.iter_mut().enumerate().for_each(|(i, result)| *result = function(a.read(i)));
            }
        }
    }

    #[inline(always)]
    fn map_two(self, function: impl Fn(f64, f64) -> f64) {
        match (self.run.forms[0], self.run.forms[1]) {
            (Form::Consecutive, Form::Consecutive) => {
                let (a, b) = (self.consecutive(0), self.consecutive(1));
                self.results.iter_mut().zip(a).zip(b).for_each(|((result, a), b)| *result = function(*a, *b));
            }
            (Form::Consecutive, Form::Same) => {
                let (a, b) = (self.consecutive(0), self.same(1));
                self.results.iter_mut().zip(a).for_each(|(result, a)| *result = function(*a, b));
            }
            (Form::Same, Form::Consecutive) => {
                let (a, b) = (self.same(0), self.consecutive(1));
                self.results.iter_mut().zip(b).for_each(|(result, b)| *result = function(a, *b));
            }
            (Form::Consecutive, Form::Listed) => {
                let (a, b) = (self.consecutive(0), self.listed(1));
                self.results.iter_mut().zip(a).enumerate().for_each(|(i, (r, a))| *r = function(*a, b.read(i)));
            }
            (Form::Listed, Form::Consecutive) => {
                let (a, b) = (self.listed(0), self.consecutive(1));
                self.results.iter_mut().zip(b).enumerate().for_each(|(i, (r, b))| *r = function(a.read(i), *b));
            }
            (Form::Same, Form::Listed) => {
                let (a, b) = (self.same(0), self.listed(1));
                self.results.iter_mut().enumerate().for_each(|(i, result)| *result = function(a, b.read(i)));
            }
            (Form::Listed, Form::Same) => {
                let (a, b) = (self.listed(0), self.same(1));
                self.results.iter_mut().enumerate().for_each(|(i, result)| *result = function(a.read(i), b));
            }
            (Form::Listed, Form::Listed) => {
                let (a, b) = (self.listed(0), self.listed(1));
                self.results.iter_mut().enumerate().for_each(|(i, result)| *result = function(a.read(i), b.read(i)));
            }
            (Form::Same, Form::Same) => {
                let value = function(self.same(0), self.same(1));
                self.results.fill(value);
            }
        }
    }

    /// For functions that are calls anyway.
    #[inline(always)]
    fn map_one_out_of_line(self, function: impl Fn(f64) -> f64) {
        for offset in 0..self.results.len() {
            self.results[offset] = function(self.read(0, offset));
        }
    }

    #[inline(always)]
    fn map_two_out_of_line(self, function: impl Fn(f64, f64) -> f64) {
        for offset in 0..self.results.len() {
            self.results[offset] = function(self.read(0, offset), self.read(1, offset));
        }
    }
}
