//! Directional derivatives by dual numbers: every instruction carries a slope along with its value.
//!
//! An independent check of the symbolic derivatives; slower than them and not used to compute answers.

use super::program::{Instruction, Program};
use super::slopes::{slope as slope_of, slopes as slopes_of};
use super::{Bound, InputSource};

impl Program {
    /// Slopes of all results from the slopes of what they read; `values` hold the program's results already.
    fn tangent(&self, values: &[f64], slopes: &mut [f64], inputs: &dyn InputSource) {
        for line in self.lines() {
            let value = |i: usize| values[line.operands[i] as usize];
            let slope = |i: usize| slopes[line.operands[i] as usize];
            let target = line.target as usize;
            slopes[target] = match line.instruction {
                Instruction::Unary(function) => slope_of(function, value(0), values[target]) * slope(0),
                Instruction::Binary(function) => {
                    carried(slopes_of(function, [value(0), value(1)], values[target]), [slope(0), slope(1)])
                }
                Instruction::Copy => slope(0),
                Instruction::Select => slope(if value(0) != 0.0 { 1 } else { 2 }),
                Instruction::Sample { input, order } if slope(0) != 0.0 => {
                    inputs.sample(input, order + 1, value(0)) * slope(0)
                }
                Instruction::Sample { .. } => 0.0,
            };
        }
    }
}

/// What the operands' slopes `da`, `db` give; an operand that does not move adds nothing, even where its factor is
/// infinite.
fn carried(factors: [f64; 2], slopes: [f64; 2]) -> f64 {
    factors.into_iter().zip(slopes).filter(|(_, slope)| *slope != 0.0).map(|(factor, slope)| factor * slope).sum()
}

/// Slopes of all registers for one direction of the parameters.
pub struct Tangent {
    slopes: Vec<f64>,
    time: Option<u64>,
}

impl Bound<'_> {
    /// Prepares directional derivatives along `direction` (length p) of the parameters.
    pub fn tangent(&mut self, direction: &[f64]) -> Tangent {
        let mut slopes = vec![0.0; self.registers.len()];
        let first = self.model.layout.parameters;
        slopes[first..first + direction.len()].copy_from_slice(direction);
        self.model.prologue.tangent(&self.registers, &mut slopes, &self.inputs);
        Tangent { slopes, time: None }
    }

    /// Rates of the states and residuals of the constraints (length n) into `values`, and their directional derivatives
    /// into `slopes` for slopes `y_slopes` of the variables.
    pub fn rates_tangent(
        &mut self,
        tangent: &mut Tangent,
        t: f64,
        (y, y_slopes): (&[f64], &[f64]),
        (values, slopes): (&mut [f64], &mut [f64]),
    ) {
        self.update(t, y);
        if tangent.time != Some(t.to_bits()) {
            self.model.forcing.tangent(&self.registers, &mut tangent.slopes, &self.inputs);
            tangent.time = Some(t.to_bits());
        }
        let first = self.model.layout.variables;
        tangent.slopes[first..first + y_slopes.len()].copy_from_slice(y_slopes);
        self.model.rates.tangent(&self.registers, &mut tangent.slopes, &self.inputs);
        for ((value, slope), &register) in values.iter_mut().zip(slopes).zip(&self.model.rate_registers) {
            *value = self.registers[register as usize];
            *slope = tangent.slopes[register as usize];
        }
    }

    /// Directional derivatives of the measured channels (length m) into `slopes`.
    pub fn outputs_tangent(
        &mut self,
        tangent: &mut Tangent,
        t: f64,
        (y, y_slopes): (&[f64], &[f64]),
        slopes: &mut [f64],
    ) {
        self.update_outputs(t, y);
        let first = self.model.layout.variables;
        tangent.slopes[first..first + y_slopes.len()].copy_from_slice(y_slopes);
        self.model.outputs.tangent(&self.registers, &mut tangent.slopes, &self.inputs);
        for (slope, &register) in slopes.iter_mut().zip(&self.model.output_registers) {
            *slope = tangent.slopes[register as usize];
        }
    }
}
