//! How large an error is, measured by the tolerances.

use super::augmented::Augmented;
use super::problem::Options;

const GUESS_SHARE: f64 = 0.01;
/// Keeps the weights of columns that are still zero finite.
const SMALLEST_COLUMN: f64 = 1e-150;

/// A last correction of the multipliers by this multiple of the relative tolerance may stay: they are one
/// differentiation away from the velocities, which err by the tolerance itself. Chosen by trial: with less, steps grow
/// to where the velocities between them miss the constraints by more than ten times the tolerance; with more,
/// multipliers err by percents now and then.
const MULTIPLIER_SHARE: f64 = 2e4;

/// What a step leaves of the amplitude of a component, and the share of it that counts as its size. Chosen by trial on
/// oscillations with dry friction: 5 % fewer evaluations of the state and 10 % fewer of its sensitivities for the same
/// error; a larger share makes errors scatter.
const AMPLITUDE_MEMORY: f64 = 0.999;
const AMPLITUDE_SHARE: f64 = 0.3;

/// Weights of the error control: component i of the state may err by `relative |y_i| + absolute_i`, the sensitivity of
/// component i to parameter j by `relative |S_ij| + absolute_i / parameter_scale_j`. Instead of the value a share of
/// its recent amplitude counts, where it is larger ([`ErrorNorm::by_amplitude`]).
///
/// The error of the state and of each sensitivity column is the root mean square of the scaled errors of the
/// differential components; the norm is the largest of these. Algebraic components do not count: their error follows
/// the others', and in an index-2 system it is not small of the order of the method (Brenan-Campbell-Petzold-1996).
pub(super) struct ErrorNorm {
    n: usize,
    p: usize,
    relative: f64,
    absolute: Vec<f64>,
    /// 1 / parameter scale; grown from the columns themselves where `adaptive`.
    column_scale: Vec<f64>,
    adaptive: bool,
    /// Columns that have had an accepted value other than zero.
    seen: Vec<bool>,
    inverse_scale: Vec<f64>,
    differential: Vec<bool>,
    is_multiplier: Vec<bool>,
    all_differential: bool,
    inverse_count: f64,
    /// 1 / weight of each element of z.
    inverse_weight: Vec<f64>,
    columns: Vec<f64>,
    /// Recent amplitude of each element of z, and what a step leaves of it.
    amplitude: Vec<f64>,
    memory: f64,
}

/// An error by the norm, and who is to blame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    /// Infinite where the error is not a finite number.
    pub norm: f64,
    /// Component with the largest scaled error (of the state).
    pub component: usize,
}

impl ErrorNorm {
    /// `p`: number of sensitivity columns under control.
    pub fn new(system: &Augmented, options: &Options, p: usize) -> Self {
        let dynamics = &*system.dynamics;
        let n = dynamics.dimension();
        let differential = dynamics.differential().to_vec();
        let count = differential.iter().filter(|d| **d).count().max(1);
        let parameter_scale = dynamics.parameter_scale();
        let adaptive = parameter_scale.is_empty();
        let column_scale = if adaptive { vec![0.0; p] } else { parameter_scale[..p].iter().map(|s| 1.0 / s).collect() };
        Self {
            n,
            p,
            relative: options.relative_tolerance,
            absolute: dynamics
                .scale()
                .iter()
                .map(|s| options.relative_tolerance * options.absolute_factor * s)
                .collect(),
            column_scale,
            adaptive,
            seen: vec![false; p],
            inverse_scale: dynamics.scale().iter().map(|s| 1.0 / s).collect(),
            all_differential: differential.iter().all(|d| *d),
            differential,
            is_multiplier: system.structure.is_multiplier.clone(),
            inverse_count: 1.0 / count as f64,
            inverse_weight: vec![0.0; n * (1 + p)],
            columns: vec![0.0; p],
            amplitude: vec![0.0; n * (1 + p)],
            memory: 0.0,
        }
    }

    /// Measures errors by recent amplitudes, too: a component that swings through zero is no more exact there than
    /// elsewhere.
    pub fn by_amplitude(mut self) -> Self {
        self.memory = AMPLITUDE_MEMORY;
        self
    }

    /// Where the scale of the columns is not known, a first guess of it from their slopes: their size after a hundredth
    /// of the span.
    pub fn guess_column_scale(&mut self, z_prime: &[f64], span: f64) {
        if self.adaptive && self.p > 0 {
            let grown: Vec<f64> = z_prime[self.n..].iter().map(|v| GUESS_SHARE * span * v).collect();
            self.grow_column_scale(&vec![0.0; grown.len()], &grown);
        }
    }

    /// Whether the weights depend on the solution at the end of the step.
    pub fn is_adaptive(&self) -> bool {
        self.adaptive && self.p > 0
    }

    /// Sets the weights for values about `z`.
    pub fn set_weights(&mut self, z: &[f64]) {
        self.set_weights_between(z, z);
    }

    /// Sets the weights by the larger of two values per element.
    pub fn set_weights_between(&mut self, old: &[f64], new: &[f64]) {
        let n = self.n;
        if self.adaptive && self.p > 0 {
            self.grow_column_scale(&old[n..], &new[n..]);
        }
        for (amplitude, value) in self.amplitude.iter_mut().zip(old) {
            *amplitude = value.abs().max(self.memory * *amplitude);
        }
        let (amplitudes, of_columns) = self.amplitude.split_at(n);
        let size = |old: f64, new: f64, amplitude: f64| old.abs().max(new.abs()).max(AMPLITUDE_SHARE * amplitude);
        let states = self.absolute.iter().zip(old).zip(new).zip(amplitudes);
        for (weight, (((absolute, old), new), amplitude)) in self.inverse_weight[..n].iter_mut().zip(states) {
            *weight = 1.0 / (self.relative * size(*old, *new, *amplitude) + absolute);
        }
        if self.p == 0 {
            return;
        }
        let rows = self.inverse_weight[n..].chunks_exact_mut(self.p).zip(of_columns.chunks_exact(self.p));
        let values = old[n..].chunks_exact(self.p).zip(new[n..].chunks_exact(self.p));
        for (((weights, amplitudes), absolute), (old, new)) in rows.zip(&self.absolute).zip(values) {
            let elements = self.column_scale.iter().zip(old).zip(new).zip(amplitudes);
            for (weight, (((scale, old), new), amplitude)) in weights.iter_mut().zip(elements) {
                *weight = 1.0 / (self.relative * size(*old, *new, *amplitude) + absolute * scale);
            }
        }
    }

    /// Grows the scale of the columns by accepted values. A rejected attempt may be far off, so attempted values count
    /// only for columns that have been zero so far: their onset has no other measure.
    fn grow_column_scale(&mut self, accepted: &[f64], attempted: &[f64]) {
        let rows = accepted.chunks_exact(self.p).zip(attempted.chunks_exact(self.p)).zip(&self.inverse_scale);
        for ((accepted, attempted), inverse_scale) in rows {
            let columns = self.column_scale.iter_mut().zip(&mut self.seen);
            for (((scale, seen), accepted), attempted) in columns.zip(accepted).zip(attempted) {
                *seen |= *accepted != 0.0;
                let value = if *seen { accepted } else { attempted };
                let size = value.abs() * inverse_scale;
                if size.is_finite() {
                    *scale = scale.max(size).max(SMALLEST_COLUMN);
                }
            }
        }
    }

    pub fn relative(&self) -> f64 {
        self.relative
    }

    pub fn state_weights(&self) -> &[f64] {
        &self.inverse_weight[..self.n]
    }

    /// Size of the state part of an error, algebraic components left out.
    pub fn of_state(&self, error: &[f64]) -> Size {
        let (mut sum, mut largest, mut component) = (0.0, 0.0, 0);
        let elements = error.iter().zip(&self.inverse_weight).zip(&self.differential);
        for (i, ((e, w), differential)) in elements.enumerate() {
            let scaled = e * w;
            let square = if *differential { scaled * scaled } else { 0.0 };
            sum += square;
            if square > largest {
                largest = square;
                component = i;
            }
        }
        Size { norm: finite_root(sum * self.inverse_count), component }
    }

    /// Root mean square of a correction of the state, for the convergence of Newton's method. Multipliers of
    /// constraints do not count: the rounding errors of a step of length h appear in them divided by h
    /// (Hairer-Lubich-Roche-1989).
    pub fn of_correction(&self, correction: &[f64]) -> f64 {
        let elements = correction[..self.n].iter().zip(&self.inverse_weight).zip(&self.is_multiplier);
        let sum: f64 =
            elements.filter(|(_, is_multiplier)| !**is_multiplier).map(|((e, w), _)| (e * w) * (e * w)).sum();
        finite_root(sum / self.n as f64)
    }

    /// Whether a correction moves the multipliers by little of the largest of them. What an iteration leaves in them
    /// the prediction of the next step multiplies; where constraints hold the states all the same, nothing else would
    /// stop it from growing.
    pub fn multipliers_rest(&self, correction: &[f64], y: &[f64]) -> bool {
        let (mut moved, mut size) = (0.0_f64, 1.0_f64);
        let elements = correction.iter().zip(y).zip(&self.inverse_scale).zip(&self.is_multiplier);
        for (((d, y), inverse_scale), _) in elements.filter(|(_, is_multiplier)| **is_multiplier) {
            moved = moved.max(d.abs() * inverse_scale);
            size = size.max(y.abs() * inverse_scale);
        }
        moved <= MULTIPLIER_SHARE * self.relative * size
    }

    /// As [`ErrorNorm::of_correction`], multipliers included.
    pub fn of_whole_correction(&self, correction: &[f64]) -> f64 {
        let sum: f64 = correction[..self.n].iter().zip(&self.inverse_weight).map(|(e, w)| (e * w) * (e * w)).sum();
        finite_root(sum / self.n as f64)
    }

    /// Size of an error of the state and of the sensitivities under control.
    pub fn of(&mut self, error: &[f64]) -> Size {
        let state = self.of_state(error);
        if self.p == 0 || !state.norm.is_finite() {
            return state;
        }
        self.columns.fill(0.0);
        let rows = error[self.n..].chunks_exact(self.p).zip(self.inverse_weight[self.n..].chunks_exact(self.p));
        for (i, (error, weight)) in rows.enumerate() {
            if !self.all_differential && !self.differential[i] {
                continue;
            }
            for ((sum, e), w) in self.columns.iter_mut().zip(error).zip(weight) {
                let scaled = e * w;
                *sum += scaled * scaled;
            }
        }
        // A sum is finite only if all its terms are; the maximum alone would lose a NaN.
        let total: f64 = self.columns.iter().sum();
        if !total.is_finite() {
            return Size { norm: f64::INFINITY, ..state };
        }
        let (mut largest, mut column) = (0.0, 0);
        for (j, &sum) in self.columns.iter().enumerate() {
            if sum > largest {
                (largest, column) = (sum, j);
            }
        }
        let norm = (largest * self.inverse_count).sqrt();
        if norm <= state.norm { state } else { Size { norm, component: self.worst_of_column(error, column) } }
    }

    fn worst_of_column(&self, error: &[f64], column: usize) -> usize {
        let (mut largest, mut component) = (0.0, 0);
        for i in (0..self.n).filter(|&i| self.differential[i]) {
            let place = self.n + i * self.p + column;
            let size = (error[place] * self.inverse_weight[place]).abs();
            if size > largest {
                (largest, component) = (size, i);
            }
        }
        component
    }
}

fn finite_root(mean_square: f64) -> f64 {
    if mean_square.is_finite() { mean_square.sqrt() } else { f64::INFINITY }
}
