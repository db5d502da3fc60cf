//! Explicit Runge-Kutta method of order 5 with error control, interpolation and exact derivatives of its stages.

use super::augmented::Augmented;
use super::norm::{ErrorNorm, Size};
use super::problem::{Dynamics, FailureCause, PlannedStep};
use super::stepper::{Limits, Refusal, first_not_finite};
use super::tsitouras as method;

/// Controller of step sizes with memory of the last error (Hairer-Norsett-Wanner-1993, IV.2 of Hairer-Wanner-1996).
const SAFETY: f64 = 0.9;
const MEMORY: f64 = 0.04;
const EXPONENT: f64 = 0.2 - 0.75 * MEMORY;
const SMALLEST_FACTOR: f64 = 0.2;
const LARGEST_FACTOR: f64 = 10.0;
/// A step whose result is not finite is retried at this share.
const RETREAT: f64 = 0.1;
/// Step and largest eigenvalue, as found from the last two stages, together indicate stiffness above this share of the
/// stability bound (Hairer-Wanner-1996, IV.2).
const NEAR_STABILITY: f64 = 0.94;

/// State of the method between two steps.
pub(super) struct RungeKutta {
    time: f64,
    /// Length of the last step.
    last_step: f64,
    next_step: f64,
    last_error: f64,
    norm: ErrorNorm,
    stages: [Vec<f64>; method::STAGES],
    /// Solution at the start and at the end of the last step, and at the end of the attempted one.
    before: Vec<f64>,
    current: Vec<f64>,
    candidate: Vec<f64>,
    /// The solution handed to the stages 2 to 6.
    argument: Vec<f64>,
    error: Vec<f64>,
    zero: Vec<f64>,
    /// The last step came close to the bound of stability.
    pub near_stability: bool,
    /// Cause and component of the last rejection.
    trouble: (FailureCause, Option<usize>),
}

impl RungeKutta {
    pub fn new(length: usize, norm: ErrorNorm) -> Self {
        Self {
            time: 0.0,
            last_step: 0.0,
            next_step: 0.0,
            last_error: 1e-4,
            norm,
            stages: std::array::from_fn(|_| vec![0.0; length]),
            before: vec![0.0; length],
            current: vec![0.0; length],
            candidate: vec![0.0; length],
            argument: vec![0.0; length],
            error: vec![0.0; length],
            zero: vec![0.0; length],
            near_stability: false,
            trouble: (FailureCause::StepTooSmall, None),
        }
    }

    pub fn time(&self) -> f64 {
        self.time
    }

    pub fn solution(&self) -> &[f64] {
        &self.current
    }

    /// Starts anew at a point, with a first step by Hairer-Norsett-Wanner-1993, II.4.
    pub fn restart<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        t: f64,
        z: &[f64],
        limits: &Limits,
        end: f64,
    ) -> Result<(), Refusal> {
        self.time = t;
        self.last_error = 1e-4;
        self.current.copy_from_slice(z);
        system.rates(t, z, &mut self.stages[6]);
        if let Some(place) = first_not_finite(&self.stages[6]) {
            return Err(not_finite(t, place, system));
        }
        self.next_step = match limits.initial_step {
            Some(step) => step,
            None => self.first_step(system, end - t),
        };
        Ok(())
    }

    fn first_step<D: Dynamics + ?Sized>(&mut self, system: &mut Augmented<D>, span: f64) -> f64 {
        let [second, .., first] = &mut self.stages;
        self.norm.guess_column_scale(first, span);
        self.norm.set_weights(&self.current);
        let size = self.norm.of_state(&self.current).norm;
        let slope = self.norm.of(first).norm;
        let guess = if size < 1e-5 || slope < 1e-5 { 1e-6 * span } else { (0.01 * size / slope).min(span) };
        combine(&mut self.argument, &self.current, guess, [1.0], [first]);
        system.rates(self.time + guess, &self.argument, second);
        for (a, b) in second.iter_mut().zip(first.iter()) {
            *a -= b;
        }
        let curvature = self.norm.of(second).norm / guess;
        let largest = slope.max(curvature);
        let step = if largest <= 1e-15 { 1e-3 * guess } else { (0.01 / largest).powf(0.2) };
        if step.is_finite() && step > 0.0 { step.min(100.0 * guess).min(span) } else { guess }
    }

    /// One accepted step that does not pass `end`.
    pub fn step<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        limits: &Limits,
        end: f64,
    ) -> Result<PlannedStep, Refusal> {
        // The last stage of a step is the first of the next one.
        self.stages.swap(0, 6);
        let mut rejected = false;
        loop {
            let (step, reaches_end) = limits.fit(self.next_step, self.time, end);
            limits.check(system, self.time, step, end, self.trouble)?;
            self.attempt(system, step);
            let error = self.measure(step);
            if error.norm <= 1.0 {
                let growth = self.growth(error.norm, if rejected { 1.0 } else { LARGEST_FACTOR });
                // A step cut short by a forced end says nothing against the step planned before.
                self.next_step = if reaches_end { (step * growth).max(self.next_step) } else { step * growth };
                system.blame(error.component, self.time);
                self.accept(system, step, if reaches_end { end } else { self.time + step });
                return Ok(PlannedStep { end: self.time, order: 0 });
            }
            rejected = true;
            system.work.rejected_error += 1;
            self.next_step = step * self.shrink(error, system);
        }
    }

    /// One step to exactly `end`, without error control.
    pub fn follow<D: Dynamics + ?Sized>(&mut self, system: &mut Augmented<D>, end: f64) -> Result<(), Refusal> {
        self.stages.swap(0, 6);
        let step = end - self.time;
        self.attempt(system, step);
        if let Some(place) = self.not_finite_place() {
            return Err(not_finite(self.time, place, system));
        }
        self.accept(system, step, end);
        Ok(())
    }

    /// All stages of a step; the new solution is left in `candidate`.
    fn attempt<D: Dynamics + ?Sized>(&mut self, system: &mut Augmented<D>, h: f64) {
        let t = self.time;
        let [k1, k2, k3, k4, k5, k6, k7] = &mut self.stages;
        let (base, argument) = (&self.current, &mut self.argument);
        combine(argument, base, h, method::STAGE_2, [k1]);
        system.rates(t + method::NODES[1] * h, argument, k2);
        combine(argument, base, h, method::STAGE_3, [k1, k2]);
        system.rates(t + method::NODES[2] * h, argument, k3);
        combine(argument, base, h, method::STAGE_4, [k1, k2, k3]);
        system.rates(t + method::NODES[3] * h, argument, k4);
        combine(argument, base, h, method::STAGE_5, [k1, k2, k3, k4]);
        system.rates(t + method::NODES[4] * h, argument, k5);
        combine(argument, base, h, method::STAGE_6, [k1, k2, k3, k4, k5]);
        system.rates(t + h, argument, k6);
        combine(&mut self.candidate, base, h, method::WEIGHTS, [k1, k2, k3, k4, k5, k6]);
        system.rates(t + h, &self.candidate, k7);
    }

    fn measure(&mut self, h: f64) -> Size {
        let [k1, k2, k3, k4, k5, k6, k7] = &self.stages;
        combine(&mut self.error, &self.zero, h, method::ERROR, [k1, k2, k3, k4, k5, k6, k7]);
        self.norm.set_weights_between(&self.current, &self.candidate);
        self.norm.of(&self.error)
    }

    fn growth(&mut self, error: f64, largest: f64) -> f64 {
        let factor = SAFETY * error.max(1e-10).powf(-EXPONENT) * self.last_error.powf(MEMORY);
        self.last_error = error.max(1e-4);
        factor.clamp(SMALLEST_FACTOR, largest)
    }

    fn shrink<D: Dynamics + ?Sized>(&mut self, error: Size, system: &Augmented<D>) -> f64 {
        if error.norm.is_finite() {
            self.trouble = (FailureCause::StepTooSmall, Some(error.component));
            (SAFETY * error.norm.powf(-EXPONENT)).clamp(SMALLEST_FACTOR, 1.0)
        } else {
            let component = self.not_finite_place().map(|place| component_of(place, system));
            self.trouble = (FailureCause::NotFinite, component);
            RETREAT
        }
    }

    fn not_finite_place(&self) -> Option<usize> {
        first_not_finite(&self.candidate).or(first_not_finite(&self.stages[6]))
    }

    fn accept<D: Dynamics + ?Sized>(&mut self, system: &mut Augmented<D>, step: f64, end: f64) {
        system.work.steps += 1;
        self.near_stability = self.eigenvalue_times_step(system.n, step) > NEAR_STABILITY * method::STABILITY;
        std::mem::swap(&mut self.before, &mut self.current);
        std::mem::swap(&mut self.current, &mut self.candidate);
        self.time = end;
        self.last_step = step;
    }

    /// Estimate of h |lambda| for the largest eigenvalue of f_y, from the last two stages, both at the end of the step.
    fn eigenvalue_times_step(&self, n: usize, step: f64) -> f64 {
        let [.., k6, k7] = &self.stages;
        let weights = self.norm.state_weights();
        let (mut rates, mut states) = (0.0, 0.0);
        for i in 0..n {
            let square = weights[i] * weights[i];
            rates += (k7[i] - k6[i]) * (k7[i] - k6[i]) * square;
            states += (self.candidate[i] - self.argument[i]) * (self.candidate[i] - self.argument[i]) * square;
        }
        if states > 0.0 { step * (rates / states).sqrt() } else { 0.0 }
    }

    /// The solution at a time within the last step.
    pub fn interpolate(&self, t: f64, z: &mut [f64]) {
        let share = 1.0 - (self.time - t) / self.last_step;
        let [k1, k2, k3, k4, k5, k6, k7] = &self.stages;
        combine(z, &self.before, self.last_step, method::interpolation(share), [k1, k2, k3, k4, k5, k6, k7]);
    }
}

fn component_of<D: Dynamics + ?Sized>(place: usize, system: &Augmented<D>) -> usize {
    if place < system.n { place } else { (place - system.n) / system.p }
}

fn not_finite<D: Dynamics + ?Sized>(time: f64, place: usize, system: &Augmented<D>) -> Refusal {
    Refusal::new(time, FailureCause::NotFinite).blaming(Some(component_of(place, system)))
}

/// `out = base + h sum_s coefficients[s] stages[s]`
#[inline]
fn combine<const S: usize>(out: &mut [f64], base: &[f64], h: f64, coefficients: [f64; S], stages: [&Vec<f64>; S]) {
    let length = out.len();
    let base = &base[..length];
    let stages = stages.map(|stage| &stage[..length]);
    for i in 0..length {
        let mut sum = 0.0;
        for s in 0..S {
            sum += coefficients[s] * stages[s][i];
        }
        out[i] = base[i] + h * sum;
    }
}
