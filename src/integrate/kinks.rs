//! Kinks of the right-hand side within explicit steps.
//!
//! A step across a kink has an error that falls with the size of the step only, not with its order; sensitivities,
//! whose right-hand side jumps there, suffer most. So a step that would cross a kink ends at it, and the next one
//! begins on its other side (Hairer-Norsett-Wanner-1993, II.6).

use super::augmented::Augmented;
use std::sync::Arc;

/// Points within a step at which sides are compared, as shares of it.
const POINTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
const MAXIMUM_ITERATIONS: usize = 40;
/// Zeros are located to this share of the step.
const LOCATED: f64 = 1e-7;
/// Crossings are expected in so many times the next step.
const FAR: f64 = 1.3;
/// Distance of differences, as a share of a step.
const SHORT: f64 = 1e-3;

/// A zero of a kink function within a step.
pub(super) struct Kink {
    /// Which function.
    index: usize,
    /// Where, as a share of the step.
    pub share: f64,
    /// The sides behind it.
    pub beyond: Arc<[bool]>,
}

#[derive(Default)]
pub(super) struct Kinks {
    /// Where they were evaluated last.
    values: Vec<f64>,
    /// Values at the end of the last step, and their slopes over it: as far as known.
    at_start: Option<Vec<f64>>,
    slopes: Option<Vec<f64>>,
    /// Kinks that did harm when they were crossed.
    harmful: Vec<bool>,
    /// Values at the ends of the interval that holds the zero.
    at_left: Vec<f64>,
    at_right: Vec<f64>,
    y: Vec<f64>,
}

impl Kinks {
    pub fn new(count: usize, n: usize) -> Self {
        let values = vec![0.0; count];
        Self {
            at_start: None,
            slopes: None,
            harmful: vec![false; count],
            at_left: values.clone(),
            at_right: values.clone(),
            values,
            y: vec![0.0; n],
        }
    }

    pub fn exist(&self) -> bool {
        !self.values.is_empty()
    }

    /// The sides at a point.
    pub fn sides(&mut self, system: &mut Augmented, t: f64, y: &[f64]) -> Arc<[bool]> {
        system.dynamics.kinks(t, y, &mut self.values);
        self.values.iter().map(|value| *value < 0.0).collect()
    }

    /// Takes the end of a step of length `h` as the start of the next one; `known`: the last evaluation was there.
    pub fn advance(&mut self, h: f64, known: bool) {
        if !known || !self.exist() {
            self.forget();
            return;
        }
        if let Some(at_start) = &mut self.at_start {
            let slopes = self.slopes.get_or_insert_with(|| vec![0.0; self.values.len()]);
            for ((slope, start), end) in slopes.iter_mut().zip(at_start.iter_mut()).zip(&self.values) {
                *slope = (end - *start) / h;
                *start = *end;
            }
        } else {
            self.at_start = Some(self.values.clone());
        }
    }

    /// Forgets the course of the values.
    pub fn forget(&mut self) {
        self.at_start = None;
        self.slopes = None;
    }

    /// Whether a kink that did harm before will probably be crossed in the next step, of length `h`.
    pub fn expects_crossing(&self, h: f64, sides: &[bool]) -> bool {
        let (Some(at_start), Some(slopes)) = (&self.at_start, &self.slopes) else { return false };
        let courses = at_start.iter().zip(slopes).zip(sides).zip(&self.harmful);
        courses
            .filter(|(_, harmful)| **harmful)
            .any(|(((start, slope), side), _)| (start + FAR * h * slope < 0.0) != *side)
    }

    pub fn mark_harmful(&mut self, kink: &Kink) {
        self.harmful[kink.index] = true;
    }

    /// The first change of `sides` in a step of length `h` from `t`; `interpolate` gives the state at a share of the
    /// step.
    pub fn find(
        &mut self,
        system: &mut Augmented,
        (t, h): (f64, f64),
        sides: &[bool],
        interpolate: impl Fn(f64, &mut [f64]),
    ) -> Option<Kink> {
        let Self { values, at_left, at_right, y, .. } = self;
        let mut evaluate = |share: f64, values: &mut [f64]| {
            interpolate(share, y);
            system.dynamics.kinks(t + share * h, y, values);
        };
        let changes = |values: &[f64]| values.iter().zip(sides).any(|(value, side)| (*value < 0.0) != *side);
        evaluate(0.0, at_left);
        let mut left = 0.0;
        let mut right = None;
        for point in POINTS {
            evaluate(point, at_right);
            if changes(at_right) {
                right = Some(point);
                break;
            }
            left = point;
            std::mem::swap(at_left, at_right);
        }
        let mut right = right?;
        for iteration in 0..MAXIMUM_ITERATIONS {
            // False position for the kink that seems to come first, and bisection in turn.
            let (first, zero) = earliest(at_left, at_right, sides)?;
            let span = (at_left[first] - at_right[first]).abs();
            let inner = if iteration % 4 == 3 { 0.5 } else { zero.clamp(1e-3, 1.0 - 1e-3) };
            let middle = left + inner * (right - left);
            evaluate(middle, values);
            let is_zero = values[first].abs() <= LOCATED * span;
            if is_zero || right - left <= LOCATED {
                let beyond = (0..sides.len()).map(|k| if k == first { !sides[k] } else { values[k] < 0.0 }).collect();
                return Some(Kink { index: first, share: middle, beyond });
            }
            if changes(values) {
                right = middle;
                std::mem::swap(values, at_right);
            } else {
                left = middle;
                std::mem::swap(values, at_left);
            }
        }
        None
    }

    /// The zero of a kink near the end of a step, as a share of it, by a step of Newton's method from the end.
    pub fn near_end(
        &mut self,
        system: &mut Augmented,
        (t, h): (f64, f64),
        kink: &Kink,
        interpolate: impl Fn(f64, &mut [f64]),
    ) -> f64 {
        let Self { values, y, .. } = self;
        let [before, end] = [1.0 - SHORT, 1.0].map(|share| {
            interpolate(share, y);
            system.dynamics.kinks(t + share * h, y, values);
            values[kink.index]
        });
        let share = 1.0 - SHORT * end / (end - before);
        if share.is_finite() { share.clamp(0.5, 1.5) } else { 1.0 }
    }
}

/// The kink whose zero seems to come first in an interval, and where, as a share of it.
fn earliest(at_left: &[f64], at_right: &[f64], sides: &[bool]) -> Option<(usize, f64)> {
    let changed = (0..sides.len()).filter(|&k| (at_right[k] < 0.0) != sides[k]);
    let zeros = changed.map(|k| (k, at_left[k] / (at_left[k] - at_right[k])));
    let finite = zeros.map(|(k, share)| (k, if share.is_finite() { share } else { 0.5 }));
    finite.min_by(|a, b| a.1.total_cmp(&b.1))
}
