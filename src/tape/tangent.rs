//! Directional derivatives by dual numbers: every instruction carries a slope along with its value.
//!
//! An independent check of the symbolic derivatives; slower than them and not used to compute answers.

use super::program::{Instruction, Program};
use super::{Bound, InputSource};
use crate::expression::{Binary, Unary};

impl Program {
    /// Slopes of all results from the slopes of what they read; `values` hold the program's results already.
    fn tangent(&self, values: &[f64], slopes: &mut [f64], inputs: &dyn InputSource) {
        for run in self.runs() {
            let count = run.instruction.operand_count();
            for (k, operands) in self.operands(run).chunks_exact(count).enumerate() {
                let value = |i: usize| values[operands[i] as usize];
                let slope = |i: usize| slopes[operands[i] as usize];
                let target = run.first_target + k;
                slopes[target] = match run.instruction {
                    Instruction::Unary(function) => unary(function, value(0), values[target]) * slope(0),
                    Instruction::Binary(function) => {
                        binary(function, [value(0), value(1)], [slope(0), slope(1)], values[target])
                    }
                    Instruction::Select => slope(if value(0) != 0.0 { 1 } else { 2 }),
                    Instruction::Sample { input, order } if slope(0) != 0.0 => {
                        inputs.sample(input, order + 1, value(0)) * slope(0)
                    }
                    Instruction::Sample { .. } => 0.0,
                };
            }
        }
    }
}

/// Derivative of a function at `a`, where it has the value `result`.
fn unary(function: Unary, a: f64, result: f64) -> f64 {
    match function {
        Unary::Negate => -1.0,
        Unary::Sin => a.cos(),
        Unary::Cos => -a.sin(),
        Unary::Tan => 1.0 + result * result,
        Unary::Asin => 1.0 / (1.0 - a * a).sqrt(),
        Unary::Acos => -1.0 / (1.0 - a * a).sqrt(),
        Unary::Atan => 1.0 / (1.0 + a * a),
        Unary::Sinh => a.cosh(),
        Unary::Cosh => a.sinh(),
        Unary::Tanh => 1.0 - result * result,
        Unary::Exp => result,
        Unary::Log => 1.0 / a,
        Unary::Sqrt => 0.5 / result,
        Unary::Abs => a.signum() * f64::from(a != 0.0),
        Unary::Sign | Unary::Floor => 0.0,
    }
}

fn binary(function: Binary, [a, b]: [f64; 2], [da, db]: [f64; 2], result: f64) -> f64 {
    match function {
        Binary::Add => da + db,
        Binary::Subtract => da - db,
        Binary::Multiply => da * b + a * db,
        Binary::Divide => (da - result * db) / b,
        Binary::Power => {
            let by_base = if da == 0.0 { 0.0 } else { b * a.powf(b - 1.0) * da };
            let by_exponent = if db == 0.0 { 0.0 } else { result * a.ln() * db };
            by_base + by_exponent
        }
        Binary::Minimum => {
            if a < b {
                da
            } else {
                db
            }
        }
        Binary::Maximum => {
            if a > b {
                da
            } else {
                db
            }
        }
        Binary::Atan2 => (da * b - a * db) / (a * a + b * b),
        Binary::Less => 0.0,
    }
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
        self.model.prologue.tangent(&self.registers, &mut slopes, self.inputs);
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
            self.model.forcing.tangent(&self.registers, &mut tangent.slopes, self.inputs);
            tangent.time = Some(t.to_bits());
        }
        let first = self.model.layout.variables;
        tangent.slopes[first..first + y_slopes.len()].copy_from_slice(y_slopes);
        self.model.rates.tangent(&self.registers, &mut tangent.slopes, self.inputs);
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
        let n = self.model.dimension();
        let (mut values, mut rates) = (vec![0.0; n], vec![0.0; n]);
        self.rates_tangent(tangent, t, (y, y_slopes), (&mut values, &mut rates));
        self.model.outputs.execute(&mut self.registers, self.inputs);
        self.model.outputs.tangent(&self.registers, &mut tangent.slopes, self.inputs);
        for (slope, &register) in slopes.iter_mut().zip(&self.model.output_registers) {
            *slope = tangent.slopes[register as usize];
        }
    }
}
