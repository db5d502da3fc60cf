//! Stable text of a tape (`ident compile --emit tape`).

use super::model::{Derivative, Model};
use super::program::{Instruction, Program};
use crate::expression::{Binary, Unary};
use std::fmt::Write;

/// Number of the form of the text (docs/emitted_text.md). The optimisation of tapes changes it more often than the
/// other texts.
const TAPE_FORM: u32 = 1;

/// All programs of a model, an instruction per line. Registers are `r7`, or the name of what stands in them.
pub fn emit_tape(model: &Model) -> String {
    let registers = RegisterNames { model };
    let mut text = format!("tape, form {TAPE_FORM}\n");
    section(&mut text, "prologue (parameters only)", &model.prologue, &registers);
    section(&mut text, "forcing (time and inputs)", &model.forcing, &registers);
    section(&mut text, "rates", &model.rates, &registers);
    for (i, &register) in model.rate_registers.iter().enumerate() {
        let name = &model.variables[i].name;
        let left = if i < model.state_count { format!("{name}'") } else { "0".to_owned() };
        let _ = writeln!(text, "  {left} = {}", registers.name(register));
    }
    let rows: Vec<String> = model.variables.iter().map(|variable| variable.name.clone()).collect();
    matrix(&mut text, "d rates / d variables", &model.jacobian, [&rows, &rows], &registers);
    let parameters = &model.parameter_names;
    matrix(&mut text, "d rates / d parameters", &model.parameter_derivative, [&rows, parameters], &registers);
    section(&mut text, "outputs", &model.outputs, &registers);
    for (name, &register) in model.output_names.iter().zip(&model.output_registers) {
        let _ = writeln!(text, "  {name} = {}", registers.name(register));
    }
    let outputs = &model.output_names;
    matrix(&mut text, "d outputs / d variables", &model.output_by_state, [outputs, &rows], &registers);
    matrix(&mut text, "d outputs / d parameters", &model.output_by_parameter, [outputs, parameters], &registers);
    text
}

struct RegisterNames<'a> {
    model: &'a Model,
}

impl RegisterNames<'_> {
    fn name(&self, register: u32) -> String {
        let (layout, index) = (self.model.layout, register as usize);
        if index < layout.time {
            return self.model.parameter_names[index - layout.parameters].clone();
        }
        if index == layout.time {
            return "t".into();
        }
        match self.model.variables.get(index - layout.variables) {
            Some(variable) => variable.name.clone(),
            None if index < self.model.constant_end => format!("{}", self.model.registers[index]),
            None => format!("r{register}"),
        }
    }
}

fn section(text: &mut String, title: &str, program: &Program, registers: &RegisterNames) {
    let (count, runs) = (program.lines().len(), program.run_count());
    let _ = writeln!(text, "\n{title}: {count} instructions in {runs} runs");
    for line in program.lines() {
        let operands: Vec<String> = line.operands().iter().map(|&operand| registers.name(operand)).collect();
        let _ = writeln!(text, "  r{} = {}", line.target, instruction_text(line.instruction, &operands));
    }
}

fn instruction_text(instruction: Instruction, operands: &[String]) -> String {
    let sign = match instruction {
        Instruction::Binary(Binary::Add) => " + ",
        Instruction::Binary(Binary::Subtract) => " - ",
        Instruction::Binary(Binary::Multiply) => " * ",
        Instruction::Binary(Binary::Divide) => " / ",
        Instruction::Binary(Binary::Less) => " < ",
        Instruction::Unary(Unary::Negate) => return format!("-{}", operands[0]),
        Instruction::Unary(function) => return format!("{}({})", function.name(), operands[0]),
        Instruction::Binary(function) => return format!("{}({})", function.name(), operands.join(", ")),
        Instruction::Copy => return operands[0].clone(),
        Instruction::Select => return format!("if {} then {} else {}", operands[0], operands[1], operands[2]),
        Instruction::Sample { input, order } => {
            return format!("input {input}{}({})", "'".repeat(order.into()), operands[0]);
        }
    };
    operands.join(sign)
}

fn matrix(text: &mut String, title: &str, derivative: &Derivative, names: [&[String]; 2], registers: &RegisterNames) {
    match &derivative.sweep {
        Some(sweep) => {
            let _ = writeln!(text, "\n{title}: swept through the programs above, {} multiplications", sweep.work());
        }
        None => section(text, title, &derivative.program, registers),
    }
    for element in &derivative.elements {
        let (row, column) = (&names[0][element.row as usize], &names[1][element.column as usize]);
        let _ = writeln!(text, "  [{row}, {column}] = {}", registers.name(element.register));
    }
}
