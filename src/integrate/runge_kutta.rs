//! Explicit Runge-Kutta methods of order 5 and 8 with error control, interpolation and exact derivatives of their
//! stages.

use super::augmented::Augmented;
use super::kinks::Kinks;
use super::norm::{ErrorNorm, Size};
use super::problem::{Branches, FailureCause, PlannedStep};
use super::stepper::{Limits, Refusal, first_not_finite};
use super::{dormand_prince, tsitouras};
use crate::linear::combine;
use crossing::{Aim, Crossing};
use std::sync::Arc;

mod crossing;

/// Controller of step sizes with memory of the last error (Hairer-Norsett-Wanner-1993, IV.2 of Hairer-Wanner-1996).
const SAFETY: f64 = 0.9;
const SMALLEST_FACTOR: f64 = 0.2;
const LARGEST_FACTOR: f64 = 10.0;
/// A step whose result is not finite is retried at this share.
const RETREAT: f64 = 0.1;
/// A step over a kink at which it cannot end is retried at this share.
const RETREAT_FROM_KINK: f64 = 0.5;
/// Step and largest eigenvalue, as found from the last two stages, together indicate stiffness above this share of the
/// stability bound (Hairer-Wanner-1996, IV.2).
const NEAR_STABILITY: f64 = 0.94;

/// Share of the estimate of order 3 in the error of the method of order 8.
const THIRD_ORDER_SHARE: f64 = 0.1;
/// Its estimate is that of a method of lower order, which at equal tolerance lets the global error grow larger than the
/// method of order 5 does; this factor makes up for it.
const CAUTION: f64 = 10.0;

/// An estimate can vanish by chance where the solution bends within the step. One of lower order, which vanishes
/// elsewhere, then has grown by more than this factor since the last step, beyond what the length of the step explains;
/// chosen by trial on oscillations with dry friction, whose largest errors all came from such steps.
const SUSPICIOUS_GROWTH: f64 = 5.0;

/// Attempts among which rejections of the method of order 8 are counted, and how many of them show kinks: about a
/// smooth solution it rejects a few. Chosen by trial on smooth and on kinked problems, which lie far on either side.
const WATCHED_ATTEMPTS: u32 = 200;
const REJECTED_AT_KINKS: u32 = 60;

/// Which pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pair {
    Five,
    Eight,
}

impl Pair {
    pub fn name(self) -> &'static str {
        match self {
            Pair::Five => "Runge-Kutta 5(4)",
            Pair::Eight => "Runge-Kutta 8(5,3)",
        }
    }

    pub fn stability(self) -> f64 {
        match self {
            Pair::Five => tsitouras::STABILITY,
            Pair::Eight => dormand_prince::STABILITY,
        }
    }

    /// Mark of its steps in a plan.
    pub fn order(self) -> u8 {
        match self {
            Pair::Five => 0,
            Pair::Eight => 8,
        }
    }

    fn stages(self) -> usize {
        match self {
            Pair::Five => tsitouras::STAGES,
            Pair::Eight => dormand_prince::STAGES,
        }
    }

    /// Weights of the earlier stages in the argument of a stage; for the last one those of the solution.
    fn row(self, stage: usize) -> dormand_prince::Row {
        match self {
            Pair::Five => tsitouras::ROWS[stage - 1],
            Pair::Eight => dormand_prince::ROWS[stage - 1],
        }
    }

    fn node(self, stage: usize) -> f64 {
        match self {
            Pair::Five => tsitouras::NODES[stage],
            Pair::Eight => dormand_prince::NODES[stage],
        }
    }

    /// Exponents of the last error and of the one before it in the control of the step.
    fn exponents(self) -> (f64, f64) {
        match self {
            Pair::Five => (0.2 - 0.75 * 0.04, 0.04),
            Pair::Eight => (0.125, 0.0),
        }
    }

    fn first_exponent(self) -> f64 {
        match self {
            Pair::Five => 0.2,
            Pair::Eight => 0.125,
        }
    }
}

/// Error of a step by which that of the next one is judged.
#[derive(Clone, Copy, Debug)]
struct Judged {
    step: f64,
    error: f64,
    /// Of the state, by the estimate of order 3.
    third: f64,
}

impl Judged {
    /// Whose successor is under no suspicion.
    const NONE: Self = Self { step: 1.0, error: 0.0, third: f64::INFINITY };

    /// The error of the next step as the growth of its estimate of order 3 suggests it.
    fn suspect(&self, step: f64, third: f64) -> f64 {
        let ratio = step / self.step;
        let growth = third / (self.third * ratio.powi(4));
        let suspected = self.error * ratio.powi(5) * growth / SUSPICIOUS_GROWTH;
        if suspected.is_finite() { suspected } else { 0.0 }
    }
}

/// State of the method between two steps.
pub(super) struct RungeKutta {
    pub pair: Pair,
    time: f64,
    /// Length of the last step.
    last_step: f64,
    next_step: f64,
    last_error: f64,
    norm: ErrorNorm,
    stages: [Vec<f64>; dormand_prince::ALL_STAGES],
    /// The stages of the interpolant of order 8 belong to the last step.
    has_dense_stages: bool,
    /// Solution at the start and at the end of the last step, and at the end of the attempted one.
    before: Vec<f64>,
    current: Vec<f64>,
    candidate: Vec<f64>,
    /// The solution handed to the stages 2 to 6.
    argument: Vec<f64>,
    error: Vec<f64>,
    zero: Vec<f64>,
    /// The last step, and the attempted one.
    judged: Judged,
    judged_attempt: Judged,
    /// The last step came close to the bound of stability.
    pub near_stability: bool,
    /// Attempts and rejections since the last look at kinks.
    attempts: u32,
    rejections: u32,
    /// Cause and component of the last rejection.
    trouble: (FailureCause, Option<usize>),
    kinks: Kinks,
    /// In the last step or the attempted one.
    branches: Branches,
    /// The last step ended at a kink: the sides behind it.
    beyond: Option<Arc<[bool]>>,
    /// Steps to come in which values decide on sides.
    free_steps: u32,
}

impl RungeKutta {
    /// For solutions of this `length` and so many kink functions of the first `n` components.
    pub fn new(pair: Pair, length: usize, (kinks, n): (usize, usize), norm: ErrorNorm) -> Self {
        Self {
            pair,
            time: 0.0,
            last_step: 0.0,
            next_step: 0.0,
            last_error: 1e-4,
            norm: norm.by_amplitude(),
            stages: std::array::from_fn(|_| vec![0.0; length]),
            has_dense_stages: false,
            before: vec![0.0; length],
            current: vec![0.0; length],
            candidate: vec![0.0; length],
            argument: vec![0.0; length],
            error: vec![0.0; length],
            zero: vec![0.0; length],
            judged: Judged::NONE,
            judged_attempt: Judged::NONE,
            near_stability: false,
            attempts: 0,
            rejections: 0,
            trouble: (FailureCause::StepTooSmall, None),
            kinks: Kinks::new(kinks, n),
            branches: Branches::Free,
            beyond: None,
            free_steps: 0,
        }
    }

    pub fn time(&self) -> f64 {
        self.time
    }

    pub fn solution(&self) -> &[f64] {
        &self.current
    }

    /// Starts anew at a point, with a first step by Hairer-Norsett-Wanner-1993, II.4.
    pub fn restart(
        &mut self,
        system: &mut Augmented,
        t: f64,
        z: &[f64],
        limits: &Limits,
        end: f64,
    ) -> Result<(), Refusal> {
        self.time = t;
        self.last_error = 1e-4;
        self.judged = Judged::NONE;
        self.current.copy_from_slice(z);
        self.beyond = None;
        self.free_steps = 0;
        self.kinks.forget();
        self.set_branches(system, Branches::Free);
        let last = self.last();
        system.rates(t, z, &mut self.stages[last]);
        if let Some(place) = first_not_finite(&self.stages[last]) {
            return Err(not_finite(t, place, system));
        }
        self.next_step = match limits.initial_step {
            Some(step) => step,
            None => self.first_step(system, end - t),
        };
        Ok(())
    }

    fn first_step(&mut self, system: &mut Augmented, span: f64) -> f64 {
        let last = self.last();
        let (low, high) = self.stages.split_at_mut(last);
        let (second, first) = (&mut low[1], &mut high[0]);
        self.norm.guess_column_scale(first, span);
        self.norm.set_weights(&self.current);
        let size = self.norm.of_state(&self.current).norm;
        let slope = self.norm.of(first).norm;
        let guess = if size < 1e-5 || slope < 1e-5 { 1e-6 * span } else { (0.01 * size / slope).min(span) };
        for ((out, base), slope) in self.argument.iter_mut().zip(&self.current).zip(first.iter()) {
            *out = base + guess * slope;
        }
        system.rates(self.time + guess, &self.argument, second);
        for (a, b) in second.iter_mut().zip(first.iter()) {
            *a -= b;
        }
        let curvature = self.norm.of(second).norm / guess;
        let largest = slope.max(curvature);
        let step = if largest <= 1e-15 { 1e-3 * guess } else { (0.01 / largest).powf(self.pair.first_exponent()) };
        if step.is_finite() && step > 0.0 { step.min(100.0 * guess).min(span) } else { guess }
    }

    /// One accepted step that does not pass `end`.
    pub fn step(&mut self, system: &mut Augmented, limits: &Limits, end: f64) -> Result<PlannedStep, Refusal> {
        let branches = self.next_branches(system);
        self.begin(system, branches);
        let mut rejected = false;
        let mut aim: Option<Aim> = None;
        let mut has_missed = false;
        loop {
            let (step, reaches_end) = limits.fit(self.next_step, self.time, end);
            limits.check(system, self.time, step, end, self.trouble)?;
            if aim.is_none()
                && !rejected
                && let Some(ahead) = self.look_ahead(system, step)
            {
                self.next_step = ahead.kink.share * step;
                aim = Some(ahead);
                continue;
            }
            self.attempt(system, step);
            self.attempts += 1;
            let error = self.measure(system.n, step);
            if error.norm > 1.0 || error.norm.is_nan() {
                has_missed |= aim.take().is_some();
                rejected = true;
                self.rejections += 1;
                system.work.rejected_error += 1;
                self.next_step = step * self.shrink(error, system);
                continue;
            }
            match &mut aim {
                Some(aimed) => {
                    if let Some(share) = self.correction(system, aimed, step) {
                        system.work.rejected_error += 1;
                        let whole = aimed.step;
                        self.next_step = share * step;
                        if self.next_step > whole {
                            // Moved out of the step that crossed it: the solution hardly touches it.
                            (self.next_step, aim) = (RETREAT_FROM_KINK * whole, None);
                            self.free(system);
                        }
                        continue;
                    }
                    self.next_step = aimed.step;
                    self.beyond = Some(aimed.kink.beyond.clone());
                }
                None => match self.crossing(system, step) {
                    Crossing::At(kink, jump) if !has_missed => {
                        system.work.rejected_error += 1;
                        self.next_step = kink.share * step;
                        aim = Some(Aim { kink, step, jump, corrections: crossing::MOST_CORRECTIONS });
                        continue;
                    }
                    // Met again after an attempt to end at it failed: values decide, or it would come back without end.
                    Crossing::Unclear | Crossing::At(..) => {
                        system.work.rejected_error += 1;
                        self.free(system);
                        self.next_step = RETREAT_FROM_KINK * step;
                        continue;
                    }
                    Crossing::Harmless(beyond) => {
                        self.plan_next(error, step, reaches_end, rejected);
                        self.beyond = Some(beyond);
                    }
                    Crossing::None => self.plan_next(error, step, reaches_end, rejected),
                },
            }
            system.blame(error.component, self.time);
            self.accept(system, step, if reaches_end { end } else { self.time + step });
            return Ok(PlannedStep { end: self.time, order: self.pair.order(), branches: self.branches.clone() });
        }
    }

    /// Plans the step after an accepted one.
    fn plan_next(&mut self, error: Size, step: f64, reaches_end: bool, rejected: bool) {
        let growth = self.growth(error.norm, if rejected { 1.0 } else { LARGEST_FACTOR });
        // A step cut short by a forced end says nothing against the step planned before.
        self.next_step = if reaches_end { (step * growth).max(self.next_step) } else { step * growth };
    }

    /// Ends the hold of sides.
    pub fn release_kinks(&mut self, system: &mut Augmented) {
        self.set_branches(system, Branches::Free);
    }

    fn set_branches(&mut self, system: &mut Augmented, branches: Branches) {
        match &branches {
            Branches::Held(sides) => system.dynamics.hold_sides(Some(sides)),
            Branches::Free | Branches::Freed if matches!(self.branches, Branches::Held(_)) => {
                system.dynamics.hold_sides(None);
            }
            Branches::Free | Branches::Freed => {}
        }
        self.branches = branches;
    }

    /// One step to exactly `end`, without error control.
    pub fn follow(
        &mut self,
        system: &mut Augmented,
        PlannedStep { end, branches, .. }: &PlannedStep,
    ) -> Result<(), Refusal> {
        let end = *end;
        self.begin(system, branches.clone());
        let step = end - self.time;
        self.attempt(system, step);
        if let Some(place) = self.not_finite_place() {
            return Err(not_finite(self.time, place, system));
        }
        self.accept(system, step, end);
        Ok(())
    }

    /// Whether so many of the last attempts were rejected that a method of lower order gets further; to be asked after
    /// a step.
    pub fn meets_kinks(&mut self) -> bool {
        if self.pair == Pair::Five || self.attempts < WATCHED_ATTEMPTS {
            return false;
        }
        let (attempts, rejections) = (std::mem::take(&mut self.attempts), std::mem::take(&mut self.rejections));
        rejections * WATCHED_ATTEMPTS >= attempts * REJECTED_AT_KINKS
    }

    /// Index of the stage at the end of the step.
    fn last(&self) -> usize {
        self.pair.stages() - 1
    }

    /// The last stage of a step is the first of the next one, except where the sides of kinks change.
    fn begin(&mut self, system: &mut Augmented, branches: Branches) {
        let last = self.last();
        self.stages.swap(0, last);
        self.has_dense_stages = false;
        let changes_sides = match (&self.branches, &branches) {
            (Branches::Held(before), Branches::Held(now)) => before != now,
            (_, branches) => *branches == Branches::Freed,
        };
        self.set_branches(system, branches);
        if changes_sides {
            self.judged = Judged::NONE;
            system.rates(self.time, &self.current, &mut self.stages[0]);
        }
    }

    /// All stages of a step; the new solution is left in `candidate`.
    fn attempt(&mut self, system: &mut Augmented, h: f64) {
        let last = self.last();
        for stage in 1..=last {
            let (known, new) = self.stages.split_at_mut(stage);
            let target = if stage == last { &mut self.candidate } else { &mut self.argument };
            combine(target, &self.current, h, self.pair.row(stage), known);
            system.rates(self.time + self.pair.node(stage) * h, target, &mut new[0]);
        }
    }

    /// Error of an attempt of length `h` of a system of `n` components.
    fn measure(&mut self, n: usize, h: f64) -> Size {
        self.norm.set_weights_between(&self.current, &self.candidate);
        match self.pair {
            Pair::Five => {
                combine(&mut self.error[..n], &self.zero[..n], h, tsitouras::THIRD_ROW, &self.stages);
                let third = self.norm.of_state(&self.error[..n]).norm;
                combine(&mut self.error, &self.zero, h, tsitouras::ERROR_ROW, &self.stages);
                let size = self.norm.of(&self.error);
                // A NaN stays one.
                let suspected = self.judged.suspect(h, third);
                let size = if suspected > size.norm { Size { norm: suspected, ..size } } else { size };
                self.judged_attempt = Judged { step: h, error: size.norm, third };
                size
            }
            Pair::Eight => {
                combine(&mut self.error, &self.zero, h, dormand_prince::ERROR_3, &self.stages);
                let third = THIRD_ORDER_SHARE * self.norm.of(&self.error).norm;
                combine(&mut self.error, &self.zero, h, dormand_prince::ERROR_5, &self.stages);
                let fifth = self.norm.of(&self.error);
                let both = fifth.norm.hypot(third);
                let norm = if both > 0.0 && both.is_finite() { CAUTION * fifth.norm * fifth.norm / both } else { both };
                Size { norm, ..fifth }
            }
        }
    }

    fn growth(&mut self, error: f64, largest: f64) -> f64 {
        let (exponent, memory) = self.pair.exponents();
        let factor = SAFETY * error.max(1e-10).powf(-exponent) * self.last_error.powf(memory);
        self.last_error = error.max(1e-4);
        factor.clamp(SMALLEST_FACTOR, largest)
    }

    fn shrink(&mut self, error: Size, system: &Augmented) -> f64 {
        if error.norm.is_finite() {
            self.trouble = (FailureCause::StepTooSmall, Some(error.component));
            (SAFETY * error.norm.powf(-self.pair.exponents().0)).clamp(SMALLEST_FACTOR, 1.0)
        } else {
            let component = self.not_finite_place().map(|place| component_of(place, system));
            self.trouble = (FailureCause::NotFinite, component);
            RETREAT
        }
    }

    fn not_finite_place(&self) -> Option<usize> {
        first_not_finite(&self.candidate).or(first_not_finite(&self.stages[self.last()]))
    }

    fn accept(&mut self, system: &mut Augmented, step: f64, end: f64) {
        system.work.steps += 1;
        self.near_stability = self.eigenvalue_times_step(system.n, step) > NEAR_STABILITY * self.pair.stability();
        std::mem::swap(&mut self.before, &mut self.current);
        std::mem::swap(&mut self.current, &mut self.candidate);
        self.time = end;
        self.last_step = step;
        self.judged = self.judged_attempt;
        self.kinks.advance(step, matches!(self.branches, Branches::Held(_)));
    }

    /// Estimate of h |lambda| for the largest eigenvalue of f_y, from the last two stages, both at the end of the step.
    fn eigenvalue_times_step(&self, n: usize, step: f64) -> f64 {
        let (k6, k7) = (&self.stages[self.last() - 1], &self.stages[self.last()]);
        let weights = self.norm.state_weights();
        let (mut rates, mut states) = (0.0, 0.0);
        for i in 0..n {
            let square = weights[i] * weights[i];
            rates += (k7[i] - k6[i]) * (k7[i] - k6[i]) * square;
            states += (self.candidate[i] - self.argument[i]) * (self.candidate[i] - self.argument[i]) * square;
        }
        if states > 0.0 { step * (rates / states).sqrt() } else { 0.0 }
    }

    /// Completes what [`RungeKutta::interpolate`] needs for the last step.
    pub fn prepare_interpolation(&mut self, system: &mut Augmented) {
        if self.pair == Pair::Five || self.has_dense_stages {
            return;
        }
        let h = self.last_step;
        for stage in dormand_prince::STAGES..dormand_prince::ALL_STAGES {
            let (known, new) = self.stages.split_at_mut(stage);
            combine(&mut self.argument, &self.before, h, dormand_prince::ROWS[stage - 1], known);
            system.rates(self.time - (1.0 - dormand_prince::NODES[stage]) * h, &self.argument, &mut new[0]);
        }
        self.has_dense_stages = true;
    }

    /// The solution at a time within the last step, after [`RungeKutta::prepare_interpolation`].
    pub fn interpolate(&self, t: f64, z: &mut [f64]) {
        let share = 1.0 - (self.time - t) / self.last_step;
        match self.pair {
            Pair::Five => {
                combine(z, &self.before, self.last_step, &tsitouras::interpolation(share), &self.stages);
            }
            Pair::Eight => self.interpolate_eight(share, z),
        }
    }

    fn interpolate_eight(&self, share: f64, z: &mut [f64]) {
        let (h, rest) = (self.last_step, 1.0 - share);
        let (first, last) = (&self.stages[0], &self.stages[self.last()]);
        for (i, value) in z.iter_mut().enumerate() {
            let change = self.current[i] - self.before[i];
            let bend = h * first[i] - change;
            let twist = change - h * last[i] - bend;
            let [a, b, c, d] = dormand_prince::DENSE.map(|row| {
                h * row.iter().map(|&(stage, coefficient)| coefficient * self.stages[stage][i]).sum::<f64>()
            });
            let high = a + share * (b + rest * (c + share * d));
            *value = self.before[i] + share * (change + rest * (bend + share * (twist + rest * high)));
        }
    }
}

fn component_of(place: usize, system: &Augmented) -> usize {
    if place < system.n { place } else { (place - system.n) / system.p }
}

fn not_finite(time: f64, place: usize, system: &Augmented) -> Refusal {
    Refusal::new(time, FailureCause::NotFinite).blaming(Some(component_of(place, system)))
}
