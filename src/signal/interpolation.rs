//! Sampled inputs as functions of time.

use crate::expression::polynomial;
use crate::study::Interpolation;

/// A column of samples as a function of time.
///
/// Inside the record: the held sample, straight lines, or the cubic spline with continuous second derivative and
/// not-a-knot ends (deBoor-2001; with three samples a parabola, with two a line). Outside the record the first or
/// last sample is held, and all derivatives are zero. At a knot the piece to its right counts, at the last one the
/// piece to its left.
#[derive(Clone, Debug)]
pub struct Interpolant {
    start: f64,
    step: f64,
    /// Of piece k: value and derivatives divided by the factorial, in powers of (t - t_k); four per piece.
    coefficients: Vec<[f64; 4]>,
    first: f64,
    last: f64,
    end: f64,
    kind: Interpolation,
}

impl Interpolant {
    /// `values[k]` is the sample at `start + k * step`; at least one sample, `step > 0`.
    ///
    /// # Panics
    /// Without samples.
    pub fn new(start: f64, step: f64, values: &[f64], kind: Interpolation) -> Self {
        let count = values.len();
        let coefficients = match kind {
            _ if count < 2 => Vec::new(),
            Interpolation::Hold => values[..count - 1].iter().map(|&value| [value, 0.0, 0.0, 0.0]).collect(),
            Interpolation::Linear => lines(values, step),
            Interpolation::Cubic => spline(values, step),
        };
        let end = start + (count - 1) as f64 * step;
        Self { start, step, coefficients, first: values[0], last: values[count - 1], end, kind }
    }

    /// The derivative of the given order (0: the value) at time `t`. Any order; beyond the third it is zero.
    pub fn evaluate(&self, t: f64, order: usize) -> f64 {
        if t.is_nan() {
            return f64::NAN;
        }
        // A time that is a sample time but for rounding means that sample.
        const ROUNDING: f64 = 1e-9;
        let position = (t - self.start) / self.step + ROUNDING;
        let outside_value = |value: f64| if order == 0 { value } else { 0.0 };
        if position < 0.0 || self.coefficients.is_empty() {
            return outside_value(self.first);
        }
        if position >= self.coefficients.len() as f64
            && (self.kind == Interpolation::Hold || t > self.end + ROUNDING * self.step)
        {
            return outside_value(self.last);
        }
        let piece = (position as usize).min(self.coefficients.len() - 1);
        let local = t - self.start - piece as f64 * self.step;
        polynomial(&self.coefficients[piece], local, order)
    }

    pub fn start(&self) -> f64 {
        self.start
    }

    pub fn end(&self) -> f64 {
        self.end
    }

    /// Times in the open interval (`from`, `to`) at which the value (held samples) or its first derivative (lines)
    /// jumps, ascending; a smooth input has none. Integrators should not step across them blindly.
    pub fn breakpoints(&self, from: f64, to: f64) -> Vec<f64> {
        let order = match self.kind {
            Interpolation::Hold => 0,
            Interpolation::Linear => 1,
            Interpolation::Cubic => return Vec::new(),
        };
        let mut times = Vec::new();
        for k in 1..self.coefficients.len() {
            if self.coefficients[k][order] != self.coefficients[k - 1][order] {
                times.push(self.start + k as f64 * self.step);
            }
        }
        if order == 0 && self.coefficients.last().is_some_and(|piece| piece[0] != self.last) {
            times.push(self.end);
        }
        times.retain(|&time| time > from && time < to);
        times
    }
}

fn lines(values: &[f64], step: f64) -> Vec<[f64; 4]> {
    values.windows(2).map(|pair| [pair[0], (pair[1] - pair[0]) / step, 0.0, 0.0]).collect()
}

/// Not-a-knot spline through equidistant samples, from its second derivatives at the knots.
fn spline(values: &[f64], step: f64) -> Vec<[f64; 4]> {
    let curvatures = match values.len() {
        2 => return lines(values, step),
        3 => vec![(values[0] - 2.0 * values[1] + values[2]) / (step * step); 3],
        _ => curvatures(values, step),
    };
    (0..values.len() - 1)
        .map(|k| {
            let (left, right) = (curvatures[k], curvatures[k + 1]);
            let slope = (values[k + 1] - values[k]) / step - step * (2.0 * left + right) / 6.0;
            [values[k], slope, left / 2.0, (right - left) / (6.0 * step)]
        })
        .collect()
}

/// Second derivatives m at the knots: m_{k-1} + 4 m_k + m_{k+1} = 6 (y_{k-1} - 2 y_k + y_{k+1}) / step^2 inside; the
/// third derivative is continuous at the second and the last but one knot: m_0 = 2 m_1 - m_2 and likewise at the end.
fn curvatures(values: &[f64], step: f64) -> Vec<f64> {
    let count = values.len();
    let inner = count - 2;
    let mut right_side: Vec<f64> =
        values.windows(3).map(|v| 6.0 * ((v[2] - v[1]) - (v[1] - v[0])) / (step * step)).collect();
    let mut diagonal = vec![4.0; inner];
    let mut upper = vec![1.0; inner];
    let mut lower = vec![1.0; inner];
    // Substituting the end conditions leaves 6 m_1 and 6 m_{n-2} alone on their rows.
    (diagonal[0], upper[0]) = (6.0, 0.0);
    (diagonal[inner - 1], lower[inner - 1]) = (6.0, 0.0);
    for k in 1..inner {
        let factor = lower[k] / diagonal[k - 1];
        diagonal[k] -= factor * upper[k - 1];
        right_side[k] -= factor * right_side[k - 1];
    }
    let mut solution = vec![0.0; count];
    for k in (0..inner).rev() {
        let above = if k + 1 < inner { upper[k] * solution[k + 2] } else { 0.0 };
        solution[k + 1] = (right_side[k] - above) / diagonal[k];
    }
    solution[0] = 2.0 * solution[1] - solution[2];
    solution[count - 1] = 2.0 * solution[count - 2] - solution[count - 3];
    solution
}
