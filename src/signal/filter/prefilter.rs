//! The operator that is applied to residuals and to their gradient alike.

use super::butterworth::{Butterworth, Section};

/// Decay of the impulse response that the padding at the ends covers.
const PADDING_DECAY: f64 = 1e-3;

/// A linear operator on a column of equidistant samples: optional removal of the mean, then the low-pass forward and
/// backward (zero phase, amplitude response squared).
///
/// The ends are extended by point reflection and the filter starts in the steady state of the first extended sample, so
/// that constants pass unchanged, and lines but for a remainder of transients (Gustafsson-1996; the convention of
/// SciPy's
/// `sosfiltfilt`, with a padding that lets transients decay to a thousandth).
/// Applied to the residual it must be applied to every gradient column as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefilter {
    sections: Vec<Section>,
    /// State of each section after a constant input of 1.
    steady_states: Vec<[f64; 2]>,
    padding: usize,
    remove_mean: bool,
    design: Option<Butterworth>,
}

impl Prefilter {
    /// Without a design only the mean is removed, or nothing is done.
    pub fn new(design: Option<Butterworth>, remove_mean: bool) -> Self {
        let sections = design.as_ref().map_or(Vec::new(), |filter| filter.sections.clone());
        let steady_states = sections.iter().map(steady_state).collect();
        let padding = design.as_ref().map_or(0, |filter| filter.settling(PADDING_DECAY).max(default_padding(filter)));
        Self { sections, steady_states, padding, remove_mean, design }
    }

    /// Does nothing.
    pub fn identity() -> Self {
        Self::new(None, false)
    }

    /// With this many samples added at both ends instead of the settling time; fewer where the column is short.
    pub fn with_padding(mut self, padding: usize) -> Self {
        self.padding = padding;
        self
    }

    pub fn design(&self) -> Option<&Butterworth> {
        self.design.as_ref()
    }

    pub fn removes_mean(&self) -> bool {
        self.remove_mean
    }

    /// Filters in place.
    pub fn apply(&self, column: &mut [f64]) {
        if self.remove_mean && !column.is_empty() {
            let mean = column.iter().sum::<f64>() / column.len() as f64;
            column.iter_mut().for_each(|value| *value -= mean);
        }
        if self.sections.is_empty() || column.len() < 2 {
            return;
        }
        let padding = self.padding.min(column.len() - 1);
        let mut extended = reflect(column, padding);
        self.run(&mut extended);
        extended.reverse();
        self.run(&mut extended);
        extended.reverse();
        column.copy_from_slice(&extended[padding..padding + column.len()]);
    }

    /// Filters each of the columns of `rows` samples in place, e.g. the gradient's.
    pub fn apply_columns(&self, rows: usize, columns: &mut [f64]) {
        columns.chunks_exact_mut(rows.max(1)).for_each(|column| self.apply(column));
    }

    /// One pass over the samples, from the steady state of the first.
    fn run(&self, samples: &mut [f64]) {
        let first = samples.first().copied().unwrap_or(0.0);
        for (section, steady) in self.sections.iter().zip(&self.steady_states) {
            let ([b0, b1, b2], [a1, a2]) = (section.b, section.a);
            let (mut s1, mut s2) = (steady[0] * first, steady[1] * first);
            for sample in samples.iter_mut() {
                let input = *sample;
                let output = b0 * input + s1;
                s1 = b1 * input - a1 * output + s2;
                s2 = b2 * input - a2 * output;
                *sample = output;
            }
        }
    }

    /// Amplitude of the whole operation at a frequency (Hz).
    pub fn amplitude(&self, frequency: f64) -> f64 {
        self.design.as_ref().map_or(1.0, |filter| filter.amplitude(frequency).powi(2))
    }

    /// Sum of squares of the impulse response of the whole operation, away from the ends: the share of white noise's
    /// variance that passes (method 4.7).
    pub fn noise_gain(&self) -> f64 {
        if self.sections.is_empty() {
            return 1.0;
        }
        let response = self.interior_response();
        response.iter().map(|value| value * value).sum()
    }

    /// trace(F^T F) for columns of `count` samples, ends and removed mean included: the expected sum of squares of
    /// filtered white noise of variance one (the denominator of method 4.6). Costs as much as filtering some thousand
    /// columns where the filter is slow: keep the result.
    pub fn trace(&self, count: usize) -> f64 {
        let removed = if self.remove_mean && count > 0 { 1.0 } else { 0.0 };
        if self.sections.is_empty() || count < 2 {
            return count as f64 - removed;
        }
        let reach = self.padding + 1;
        let short = count.min(3 * reach);
        let operator = Self { remove_mean: false, ..self.clone() };
        let energy = |index: usize| {
            let mut column = vec![0.0; short];
            column[index] = 1.0;
            operator.apply(&mut column);
            column.iter().map(|value| value * value).sum::<f64>()
        };
        // Columns of F further than `reach` from both ends are shifted copies of one another (to a millionth).
        let inner = if short < 3 * reach { 0 } else { short - 2 * reach };
        let ends: f64 = if inner == 0 {
            (0..short).map(energy).sum()
        } else {
            (0..reach).chain(short - reach..short).map(energy).sum()
        };
        let interior = if inner == 0 { 0.0 } else { (count - 2 * reach) as f64 * energy(short / 2) };
        // A constant passes unchanged: taking the mean out takes exactly 1 from the trace.
        ends + interior - removed
    }

    /// Autocovariance of white noise of variance one behind the whole operation, away from the ends, at the lags
    /// 0, `stride`, .. `largest * stride`.
    pub fn noise_autocovariance(&self, largest: usize, stride: usize) -> Vec<f64> {
        if self.sections.is_empty() {
            return (0..=largest).map(|lag| if lag == 0 { 1.0 } else { 0.0 }).collect();
        }
        let response = self.interior_response();
        let product = |lag: usize| response.iter().zip(response.iter().skip(lag)).map(|(a, b)| a * b).sum();
        (0..=largest).map(|lag| product(lag * stride)).collect()
    }

    /// Impulse response of the whole operation, centred.
    fn interior_response(&self) -> Vec<f64> {
        let half = 4 * self.padding + 1;
        let mut column = vec![0.0; 2 * half + 1];
        column[half] = 1.0;
        self.run(&mut column);
        column.reverse();
        self.run(&mut column);
        column
    }
}

/// As SciPy's `sosfiltfilt`: three times the length of the equivalent transfer function.
fn default_padding(filter: &Butterworth) -> usize {
    3 * (filter.order as usize + 1)
}

/// The state of a section (transposed direct form II) that has seen the constant 1 for ever.
fn steady_state(section: &Section) -> [f64; 2] {
    let ([b0, b1, b2], [a1, a2]) = (section.b, section.a);
    let output = (b0 + b1 + b2) / (1.0 + a1 + a2);
    [output - b0, b2 - a2 * output]
}

/// The column with `padding` samples added at both ends, point-reflected at the end samples.
fn reflect(column: &[f64], padding: usize) -> Vec<f64> {
    let last = column.len() - 1;
    let mut extended = Vec::with_capacity(column.len() + 2 * padding);
    extended.extend((1..=padding).rev().map(|k| 2.0 * column[0] - column[k]));
    extended.extend_from_slice(column);
    extended.extend((1..=padding).map(|k| 2.0 * column[last] - column[last - k]));
    extended
}
