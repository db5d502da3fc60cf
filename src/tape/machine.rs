//! Programs as machine code (Cranelift): short runs become single instructions, long ones stay calls of the
//! interpreter's vector kernels, so that neither dispatch nor the lack of vector instructions costs time.
//!
//! The code performs the same operations in the same order as [`super::kernels`], with the same functions: results
//! agree to the last bit. Where no code can be made - an unknown processor, a system that forbids it - the interpreter
//! does the work.

use super::InputSource;
use super::program::{Instruction, Line, Run};
use super::{elementary, kernels};
use crate::expression::{Binary, Unary};
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::{F64, I32, I64};
use cranelift_codegen::ir::{AbiParam, InstBuilder, MemFlagsData, SigRef, Signature, Value};
use cranelift_codegen::isa::{CallConv, TargetFrontendConfig};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{Module, default_libcall_names};
use std::collections::HashMap;

/// The registers, and the inputs as a pointer to a reference.
type Entry = unsafe extern "C" fn(*mut f64, *const &dyn InputSource);

/// From about these lengths on a run is faster in a kernel: of arithmetic, and of functions that are calls as single
/// instructions.
const LONG_RUN: usize = 12;
const LONG_RUN_OF_CALLS: usize = 3;

/// Long programs spill more values than the guard page of a stack holds: their frames are probed.
const SETTINGS: [(&str, &str); 5] = [
    ("opt_level", "speed"),
    ("is_pic", "false"),
    ("use_colocated_libcalls", "false"),
    ("enable_probestack", "true"),
    ("probestack_strategy", "inline"),
];

/// A program in executable memory.
pub(super) struct Machine {
    entry: Entry,
    /// What the code refers to by address.
    _runs: Box<Runs>,
    /// Owns the memory; taken when it is freed.
    module: Option<JITModule>,
}

// SAFETY: after it has been made the code is only executed; it has no state of its own.
unsafe impl Send for Machine {}
// SAFETY: the same.
unsafe impl Sync for Machine {}

impl Drop for Machine {
    fn drop(&mut self) {
        if let Some(module) = self.module.take() {
            // SAFETY: the entry is private to `self` and called only while `self` is borrowed.
            unsafe { module.free_memory() }
        }
    }
}

impl std::fmt::Debug for Machine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Machine")
    }
}

/// The program's runs: long ones are executed by kernels, short ones' functions are called.
struct Runs {
    runs: Vec<Run>,
    listed: Vec<u32>,
    register_count: usize,
}

impl Machine {
    /// Code for a program of `lines` in `runs` with their lists over `register_count` registers; none where the system
    /// does not allow it.
    pub fn new(lines: &[Line], (runs, listed): (&[Run], &[u32]), register_count: usize) -> Option<Self> {
        let owned = Box::new(Runs { runs: runs.to_vec(), listed: listed.to_vec(), register_count });
        let mut flags = settings::builder();
        for (name, value) in SETTINGS {
            flags.set(name, value).ok()?;
        }
        let isa = cranelift_native::builder().ok()?.finish(settings::Flags::new(flags)).ok()?;
        let mut module = JITModule::new(JITBuilder::with_isa(isa, default_libcall_names()));
        let pointer = module.target_config().pointer_type();
        if pointer != I64 {
            return None;
        }
        let mut context = module.make_context();
        context.func.signature.params = vec![AbiParam::new(pointer); 2];
        let mut memory = FunctionBuilderContext::new();
        let builder = FunctionBuilder::new(&mut context.func, &mut memory);
        Translation::new(builder, module.isa().default_call_conv()).translate(lines, &owned, module.target_config());
        let function = module.declare_anonymous_function(&context.func.signature).ok()?;
        module.define_function(function, &mut context).ok()?;
        module.finalize_definitions().ok()?;
        let address = module.get_finalized_function(function);
        // SAFETY: the function has been defined with this signature.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
        Some(Self { entry, _runs: owned, module: Some(module) })
    }

    /// # Safety
    ///
    /// `registers` must hold all operands and targets of the lines.
    pub unsafe fn execute(&self, registers: &mut [f64], inputs: &dyn InputSource) {
        // SAFETY: what the caller promises.
        unsafe { (self.entry)(registers.as_mut_ptr(), &raw const inputs) }
    }
}

/// The function under construction.
struct Translation<'f> {
    builder: FunctionBuilder<'f>,
    registers: Value,
    inputs: Value,
    /// Values that this function has computed or read already.
    known: HashMap<u32, Value>,
    of_one: SigRef,
    of_two: SigRef,
    of_input: SigRef,
    of_kernel: SigRef,
}

impl<'f> Translation<'f> {
    fn new(mut builder: FunctionBuilder<'f>, convention: CallConv) -> Self {
        let block = builder.create_block();
        builder.append_block_params_for_function_params(block);
        builder.switch_to_block(block);
        builder.seal_block(block);
        let (registers, inputs) = (builder.block_params(block)[0], builder.block_params(block)[1]);
        let mut signature = |parameters: &[_], results: &[_]| {
            let mut signature = Signature::new(convention);
            signature.params = parameters.iter().map(|kind| AbiParam::new(*kind)).collect();
            signature.returns = results.iter().map(|kind| AbiParam::new(*kind)).collect();
            builder.import_signature(signature)
        };
        let (of_one, of_two) = (signature(&[I64, F64], &[F64]), signature(&[I64, F64, F64], &[F64]));
        let (of_input, of_kernel) = (signature(&[I64, I32, I32, F64], &[F64]), signature(&[I64; 4], &[]));
        Self { builder, registers, inputs, known: HashMap::new(), of_one, of_two, of_input, of_kernel }
    }

    fn translate(mut self, lines: &[Line], program: &Runs, target: TargetFrontendConfig) {
        let mut rest = lines;
        for (index, run) in program.runs.iter().enumerate() {
            let (of_run, others) = rest.split_at(run.count as usize);
            rest = others;
            if of_run.len() >= shortest_long_run(run.instruction) {
                self.call_kernel(program, index);
            } else {
                of_run.iter().for_each(|line| self.single(line, &run.instruction));
            }
        }
        self.builder.ins().return_(&[]);
        self.builder.finalize(target);
    }

    /// The results stay in the registers until they are read.
    fn call_kernel(&mut self, program: &Runs, index: usize) {
        let program = self.address(program);
        let index = self.builder.ins().iconst(I64, index as i64);
        let address = self.builder.ins().iconst(I64, kernel as *const u8 as i64);
        let arguments = [program, index, self.registers, self.inputs];
        self.builder.ins().call_indirect(self.of_kernel, address, &arguments);
    }

    /// `instruction`: that of the line, at an address that lives as long as the code.
    fn single(&mut self, line: &Line, instruction: &Instruction) {
        let value = self.value(line, instruction);
        self.builder.ins().store(MemFlagsData::trusted(), value, self.registers, offset(line.target));
        self.known.insert(line.target, value);
    }

    fn read(&mut self, register: u32) -> Value {
        if let Some(value) = self.known.get(&register) {
            return *value;
        }
        let value = self.builder.ins().load(F64, MemFlagsData::trusted(), self.registers, offset(register));
        self.known.insert(register, value);
        value
    }

    fn value(&mut self, line: &Line, instruction: &Instruction) -> Value {
        let operands: Vec<Value> = line.operands().iter().map(|register| self.read(*register)).collect();
        match (instruction, &operands[..]) {
            (Instruction::Unary(function), [a]) => self.unary(function, *a),
            (Instruction::Binary(function), [a, b]) => self.binary(function, *a, *b),
            (Instruction::Select, [condition, then, otherwise]) => {
                let zero = self.builder.ins().f64const(0.0);
                let holds = self.builder.ins().fcmp(FloatCC::NotEqual, *condition, zero);
                self.builder.ins().select(holds, *then, *otherwise)
            }
            (Instruction::Sample { input, order }, [time]) => {
                let input = self.builder.ins().iconst(I32, i64::from(*input));
                let order = self.builder.ins().iconst(I32, i64::from(*order));
                self.call(self.of_input, sample as *const u8, &[self.inputs, input, order, *time])
            }
            (_, operands) => operands[0],
        }
    }

    fn unary(&mut self, function: &Unary, a: Value) -> Value {
        let called: extern "C" fn(&Unary, f64) -> f64 = match function {
            Unary::Negate => return self.builder.ins().fneg(a),
            Unary::Sqrt => return self.builder.ins().sqrt(a),
            Unary::Abs => return self.builder.ins().fabs(a),
            Unary::Sin => sine,
            Unary::Cos => cosine,
            Unary::Tanh => hyperbolic_tangent,
            Unary::Exp => exponential,
            _ => unary,
        };
        let function = self.address(function);
        self.call(self.of_one, called as *const u8, &[function, a])
    }

    fn binary(&mut self, function: &Binary, a: Value, b: Value) -> Value {
        match function {
            Binary::Add => self.builder.ins().fadd(a, b),
            Binary::Subtract => self.builder.ins().fsub(a, b),
            Binary::Multiply => self.builder.ins().fmul(a, b),
            Binary::Divide => self.builder.ins().fdiv(a, b),
            Binary::Less => {
                let less = self.builder.ins().fcmp(FloatCC::LessThan, a, b);
                let (one, zero) = (self.builder.ins().f64const(1.0), self.builder.ins().f64const(0.0));
                self.builder.ins().select(less, one, zero)
            }
            _ => {
                let function = self.address(function);
                self.call(self.of_two, binary as *const u8, &[function, a, b])
            }
        }
    }

    fn address<T>(&mut self, of: &T) -> Value {
        self.builder.ins().iconst(I64, std::ptr::from_ref(of) as i64)
    }

    fn call(&mut self, signature: SigRef, function: *const u8, arguments: &[Value]) -> Value {
        let address = self.builder.ins().iconst(I64, function as i64);
        let call = self.builder.ins().call_indirect(signature, address, arguments);
        self.builder.inst_results(call)[0]
    }
}

fn shortest_long_run(instruction: Instruction) -> usize {
    match instruction {
        Instruction::Unary(Unary::Sin | Unary::Cos | Unary::Tanh | Unary::Exp) => LONG_RUN_OF_CALLS,
        _ => LONG_RUN,
    }
}

extern "C" fn kernel(program: *const Runs, index: usize, registers: *mut f64, inputs: *const &dyn InputSource) {
    // SAFETY: the machine owns the runs; its caller has promised the registers and the inputs.
    unsafe {
        let program = &*program;
        let registers = std::slice::from_raw_parts_mut(registers, program.register_count);
        kernels::execute(&program.runs[index..=index], &program.listed, registers, *inputs);
    }
}

fn offset(register: u32) -> i32 {
    8 * register as i32
}

extern "C" fn sine(_: &Unary, a: f64) -> f64 {
    elementary::sin_of_any(a)
}

extern "C" fn cosine(_: &Unary, a: f64) -> f64 {
    elementary::cos_of_any(a)
}

extern "C" fn hyperbolic_tangent(_: &Unary, a: f64) -> f64 {
    elementary::tanh_of_one(a)
}

extern "C" fn exponential(_: &Unary, a: f64) -> f64 {
    elementary::exp_of_one(a)
}

extern "C" fn unary(function: &Unary, a: f64) -> f64 {
    function.evaluate(a)
}

extern "C" fn binary(function: &Binary, a: f64, b: f64) -> f64 {
    function.evaluate(a, b)
}

extern "C" fn sample(inputs: *const &dyn InputSource, input: u32, order: u32, time: f64) -> f64 {
    // SAFETY: [`Machine::execute`] hands over a reference that lives during the call.
    unsafe { (*inputs).sample(input, order as u8, time) }
}
