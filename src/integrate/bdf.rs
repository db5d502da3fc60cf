//! Variable-order, variable-step BDF for implicit systems, with sensitivities in step.
//!
//! Control of step and order after Brenan-Campbell-Petzold-1996 as refined in Hindmarsh-2005. The sensitivities are
//! staggered (Feehery-1997): once the state of a step is found, the matrix is renewed there and one block solve gives
//! every column of the exact derivative of the discrete solution.

use super::augmented::Augmented;
use super::bdf_history::{History, MAXIMUM_ORDER};
use super::newton::{Newton, NewtonFailure, StepEnd};
use super::norm::{ErrorNorm, Size};
use super::problem::{Branches, FailureCause, PlannedStep};
use super::stepper::{Limits, Refusal, first_not_finite};

/// Share of the step kept after a failed solution of the implicit equations.
const NEWTON_RETREAT: f64 = 0.25;
/// Share of the bound of stability that leaves an explicit method room to spare.
const MILD: f64 = 0.5;
const SMALLEST_FACTOR: f64 = 0.25;
const SAFETY: f64 = 0.9;
/// Errors between the ends of steps may be larger than at the ends by the inverse of this; chosen by trial on
/// mechanisms with loops.
const INTERPOLATED_SHARE: f64 = 0.03;
/// First step: the change along the initial slope stays below this in the error norm ...
const FIRST_CHANGE: f64 = 0.5;
/// ... and the step below this share of the span.
const FIRST_SHARE: f64 = 1e-3;

/// The filtered differences of runs with sensitivities, whose matrix is another one in every step, are filtered anew
/// after so many of them, a number chosen by trial; they only choose the order.
const FILTERED_STEPS: usize = 10;

pub(super) struct Bdf {
    /// Where errors are filtered ([`Newton::filter`]), the differences carry themselves filtered behind themselves: as
    /// long as the matrix stays, filtering the correction of a step filters all of them.
    history: History,
    newton: Newton,
    norm: ErrorNorm,
    /// Predicted and then solved: z and z', and the correction between them, again with itself filtered behind it.
    z: Vec<f64>,
    z_prime: Vec<f64>,
    correction: Vec<f64>,
    scratch: Vec<f64>,
    /// Renewals of the matrix when the differences were filtered last; none since the start.
    filtered_at: Option<usize>,
    /// Doubles the step and raises the order until the first sign of error.
    growing: bool,
    trouble: (FailureCause, Option<usize>),
}

/// The state part of the step being solved; a macro so that the borrows stay apart.
macro_rules! step_end {
    ($bdf:ident, $time:expr, $n:expr) => {
        StepEnd {
            time: $time,
            leading: $bdf.history.leading,
            y: &mut $bdf.z[..$n],
            y_prime: &mut $bdf.z_prime[..$n],
            correction: &mut $bdf.correction[..$n],
        }
    };
}

/// Estimated local errors of the order used, and of the order found best for the next step.
struct OrderChoice {
    order: usize,
    error: f64,
    scaled: f64,
    scaled_below: f64,
}

enum Rejection {
    Newton(NewtonFailure),
    Error(OrderChoice),
}

impl Bdf {
    pub fn new(system: &Augmented, norm: ErrorNorm) -> Self {
        let length = system.length();
        let newton = Newton::new(system);
        let kept = if newton.filters() { 2 * length } else { length };
        Self {
            history: History::new(kept),
            newton,
            norm,
            z: vec![0.0; length],
            z_prime: vec![0.0; length],
            correction: vec![0.0; kept],
            scratch: vec![0.0; length],
            filtered_at: None,
            growing: true,
            trouble: (FailureCause::StepTooSmall, None),
        }
    }

    pub fn time(&self) -> f64 {
        self.history.time
    }

    pub fn solution(&self) -> &[f64] {
        &self.history.differences[0][..self.z.len()]
    }

    /// Derivative of the solution at the end of the last step.
    pub fn derivative(&self) -> &[f64] {
        &self.z_prime
    }

    /// Whether an explicit method of this bound of stability could take the last step with room to spare.
    pub fn is_mild(&self, stability: f64) -> bool {
        self.history.last_step * self.newton.eigenvalue_bound < MILD * stability
    }

    pub fn restart(&mut self, t: f64, z: &[f64], z_prime: &[f64], limits: &Limits, end: f64) {
        self.norm.guess_column_scale(z_prime, end - t);
        self.norm.set_weights(z);
        let slope = self.norm.of(z_prime).norm;
        let span = FIRST_SHARE * (end - t);
        let step = if slope * span > FIRST_CHANGE { FIRST_CHANGE / slope } else { span };
        self.history.restart(t, z, z_prime, limits.initial_step.unwrap_or(step).min(limits.maximum_step));
        self.newton.forget();
        self.filtered_at = None;
        self.z_prime.copy_from_slice(z_prime);
        self.growing = true;
    }

    /// One accepted step that does not pass `end`.
    pub fn step(&mut self, system: &mut Augmented, limits: &Limits, end: f64) -> Result<PlannedStep, Refusal> {
        self.norm.set_weights(&self.history.differences[0][..self.z.len()]);
        let mut error_failures = 0;
        loop {
            let (step, reaches_end) = limits.fit(self.history.step, self.history.time, end);
            limits.check(system, self.history.time, step, end, self.trouble)?;
            self.history.resize(step);
            self.history.begin();
            let step_end = if reaches_end { end } else { self.history.time + step };
            match self.attempt(system, step_end) {
                Ok((choice, size)) => {
                    system.blame(size.component, self.history.time);
                    return Ok(self.accept(system, step_end, choice));
                }
                Err(rejection) => {
                    self.history.withdraw();
                    match rejection {
                        Rejection::Newton(failure) => self.after_newton_failure(system, failure),
                        Rejection::Error(choice) => {
                            error_failures += 1;
                            self.after_error_failure(system, choice, error_failures);
                        }
                    }
                    self.growing = false;
                }
            }
        }
    }

    /// One step of given order to exactly `end`, the implicit equations solved to rounding, without error control.
    pub fn follow(&mut self, system: &mut Augmented, end: f64, order: usize) -> Result<(), Refusal> {
        let start = self.history.time;
        self.norm.set_weights(&self.history.differences[0][..self.z.len()]);
        self.history.order = order;
        self.history.resize(end - start);
        self.history.begin();
        self.history.predict(&mut self.z, &mut self.z_prime);
        self.correction.fill(0.0);
        let refuse = |failure: NewtonFailure| Refusal::new(start, failure.cause).blaming(failure.component);
        let n = system.n;
        self.newton.polish(system, &self.norm, &mut step_end!(self, end, n)).map_err(refuse)?;
        self.solve_sensitivities(system, end).map_err(refuse)?;
        system.work.steps += 1;
        self.history.accept(end, &self.correction);
        Ok(())
    }

    /// Solves for state and sensitivities at the end of the step and judges the error.
    fn attempt(&mut self, system: &mut Augmented, end: f64) -> Result<(OrderChoice, Size), Rejection> {
        let n = system.n;
        self.history.predict(&mut self.z, &mut self.z_prime);
        self.correction.fill(0.0);
        self.newton.solve(system, &self.norm, &mut step_end!(self, end, n)).map_err(Rejection::Newton)?;
        let state = self.size_of_correction(system, true);
        if self.history.error_constant * state.norm > 1.0 {
            self.trouble = (FailureCause::StepTooSmall, Some(state.component));
            return Err(Rejection::Error(self.choose_order(system, state.norm, true)));
        }
        if system.p == 0 {
            return Ok((self.choose_order(system, state.norm, true), state));
        }
        self.solve_sensitivities(system, end).map_err(Rejection::Newton)?;
        if self.norm.is_adaptive() {
            self.norm.set_weights_between(&self.history.differences[0][..self.z.len()], &self.z);
        }
        let size = self.size_of_correction(system, false);
        let choice = self.choose_order(system, size.norm, false);
        if self.history.error_constant * size.norm > 1.0 {
            self.trouble = (FailureCause::StepTooSmall, Some(size.component));
            return Err(Rejection::Error(choice));
        }
        Ok((choice, size))
    }

    /// The columns from `dF/dy S + dF/dy' S' + dF/dtheta = 0` with the matrix at the solution of the step.
    fn solve_sensitivities(&mut self, system: &mut Augmented, end: f64) -> Result<(), NewtonFailure> {
        let (n, p, c) = (system.n, system.p, self.history.leading);
        if p == 0 {
            return Ok(());
        }
        self.newton.settle(system, &self.norm, &mut step_end!(self, end, n))?;
        let length = self.z.len();
        let (y, s) = self.z.split_at_mut(n);
        let (y_prime, s_prime) = self.z_prime.split_at_mut(n);
        let known = &mut self.scratch[n..];
        for ((v, s_prime), s) in known.iter_mut().zip(s_prime.iter()).zip(s.iter()) {
            *v = s_prime - c * s;
        }
        let solved = &mut self.correction[n..length];
        system.sensitivity_right_hand_side(end, y, y_prime, c, known, solved);
        self.newton.solve_block(solved, p);
        if let Some(place) = first_not_finite(solved) {
            return Err(NewtonFailure { cause: FailureCause::NotFinite, component: Some(place / p) });
        }
        for (((s, s_prime), e), v) in s.iter_mut().zip(s_prime).zip(solved).zip(known) {
            let solution = *e;
            *e = solution - *s;
            *s = solution;
            *s_prime = *v + c * solution;
        }
        Ok(())
    }

    /// Size of the correction, which is filtered here; `state_only`: without the sensitivities.
    fn size_of_correction(&mut self, system: &Augmented, state_only: bool) -> Size {
        if self.newton.filters() {
            let part = if state_only { system.n } else { self.z.len() };
            let (correction, filtered) = self.correction.split_at_mut(self.z.len());
            filtered[..part].copy_from_slice(&correction[..part]);
            self.newton.filter(system, &mut filtered[..part]);
        }
        self.size_of_sum(system, &[], state_only)
    }

    /// Size of the correction with these differences, each times a factor, added to it.
    fn size_of_sum(&mut self, system: &Augmented, terms: &[(usize, f64)], state_only: bool) -> Size {
        if !self.newton.filters() {
            return self.size_of_part(system, terms, 0, state_only);
        }
        let at_end = self.size_of_part(system, terms, self.z.len(), state_only);
        if !self.newton.has_multipliers() {
            return at_end;
        }
        // Constraints hold at the ends of steps; what is read between them is interpolated and has the whole error.
        let between = self.size_of_part(system, terms, 0, state_only);
        if INTERPOLATED_SHARE * between.norm > at_end.norm {
            Size { norm: INTERPOLATED_SHARE * between.norm, ..between }
        } else {
            at_end
        }
    }

    fn size_of_part(&mut self, system: &Augmented, terms: &[(usize, f64)], offset: usize, state_only: bool) -> Size {
        let part = if state_only { system.n } else { self.z.len() };
        let range = offset..offset + part;
        let sum = &mut self.scratch[..part];
        sum.copy_from_slice(&self.correction[range.clone()]);
        for &(index, factor) in terms {
            let difference = &self.history.differences[index][range.clone()];
            sum.iter_mut().zip(difference).for_each(|(sum, d)| *sum += factor * d);
        }
        if state_only { self.norm.of_state(sum) } else { self.norm.of(sum) }
    }

    /// Filters the differences where the matrix has changed since.
    fn filter_differences(&mut self, system: &Augmented) {
        let renewals = self.newton.renewals;
        let patience = if system.p == 0 { 1 } else { FILTERED_STEPS };
        let is_recent = self.filtered_at.is_some_and(|last| renewals < last + patience);
        if is_recent || !self.newton.filters() {
            return;
        }
        self.filtered_at = Some(renewals);
        for difference in &mut self.history.differences[1..=(self.history.order + 1).min(MAXIMUM_ORDER)] {
            let (difference, filtered) = difference.split_at_mut(self.z.len());
            filtered.copy_from_slice(difference);
            self.newton.filter(system, filtered);
        }
    }

    /// Whether the order below would have had a smaller error; `size` is the norm of the correction.
    fn choose_order(&mut self, system: &Augmented, size: f64, state_only: bool) -> OrderChoice {
        let k = self.history.order;
        let sigma = self.history.sigma;
        let error = sigma[k] * size;
        let scaled = (k + 1) as f64 * error;
        let mut choice = OrderChoice { order: k, error, scaled, scaled_below: f64::INFINITY };
        self.filter_differences(system);
        if k == 1 {
            return choice;
        }
        let below = sigma[k - 1] * self.size_of_sum(system, &[(k, 1.0)], state_only).norm;
        choice.scaled_below = k as f64 * below;
        let lower = if k == 2 {
            choice.scaled_below <= 0.5 * scaled
        } else {
            let two_below = self.size_of_sum(system, &[(k, 1.0), (k - 1, 1.0)], state_only).norm;
            choice.scaled_below.max((k - 1) as f64 * sigma[k - 2] * two_below) <= scaled
        };
        if lower {
            choice.order = k - 1;
            choice.error = below;
        }
        choice
    }

    fn accept(&mut self, system: &mut Augmented, end: f64, choice: OrderChoice) -> PlannedStep {
        system.work.steps += 1;
        let k = self.history.order;
        let planned = PlannedStep { end, order: k as u8, branches: Branches::Free };
        let order_change = k as i64 - self.history.last_order as i64;
        let fresh = self.history.is_fresh();
        if choice.order < k || k == MAXIMUM_ORDER {
            self.growing = false;
        }
        let next = if self.growing { None } else { Some(self.next_order(system, choice, order_change)) };
        self.history.accept(end, &self.correction);
        match next {
            None if fresh => {}
            None => {
                self.history.order += 1;
                self.history.step *= 2.0;
            }
            Some((order, error)) => {
                self.history.order = order;
                let ratio = (2.0 * error + 1e-4).powf(-1.0 / (order + 1) as f64);
                if ratio >= 2.0 {
                    self.history.step *= 2.0;
                } else if ratio <= 1.0 {
                    self.history.step *= ratio.clamp(0.5, SAFETY);
                }
            }
        }
        planned
    }

    /// Order of the next step and the error to expect of it at the present length.
    fn next_order(&mut self, system: &Augmented, choice: OrderChoice, order_change: i64) -> (usize, f64) {
        let k = self.history.order;
        if choice.order < k {
            return (choice.order, choice.error);
        }
        if k == MAXIMUM_ORDER || k + 1 >= self.history.equal_steps || order_change == 1 {
            return (k, choice.error);
        }
        let above = self.size_of_sum(system, &[(k + 1, -1.0)], system.p == 0).norm / (k + 2) as f64;
        let scaled_above = (k + 2) as f64 * above;
        if k == 1 {
            return if scaled_above < 0.5 * choice.scaled { (2, above) } else { (1, choice.error) };
        }
        if choice.scaled_below <= choice.scaled.min(scaled_above) {
            (k - 1, choice.scaled_below / k as f64)
        } else if scaled_above < choice.scaled {
            (k + 1, above)
        } else {
            (k, choice.error)
        }
    }

    fn after_newton_failure(&mut self, system: &mut Augmented, failure: NewtonFailure) {
        system.work.rejected_newton += 1;
        self.trouble = (failure.cause, failure.component);
        self.history.resize(NEWTON_RETREAT * self.history.step);
    }

    fn after_error_failure(&mut self, system: &mut Augmented, choice: OrderChoice, failures: usize) {
        system.work.rejected_error += 1;
        let factor = if failures == 1 {
            let ratio = SAFETY * (2.0 * choice.error + 1e-4).powf(-1.0 / (choice.order + 1) as f64);
            ratio.clamp(SMALLEST_FACTOR, SAFETY)
        } else {
            SMALLEST_FACTOR
        };
        self.history.order = if failures < 3 { choice.order } else { 1 };
        self.history.resize(factor * self.history.step);
    }

    /// The solution at a time within the last step.
    pub fn interpolate(&self, t: f64, z: &mut [f64]) {
        self.history.interpolate(t, z);
    }
}
