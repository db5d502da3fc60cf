//! Kinks in explicit steps: they are met by the end of a step.

use super::{Branches, Pair, RungeKutta};
use crate::integrate::augmented::Augmented;
use crate::integrate::kinks::{Kink, Kinks};
use crate::integrate::tsitouras;
use crate::linear::combine;
use std::sync::Arc;

/// A kink whose effect in a step is this small, measured as an error, may lie within it.
const HARMLESS: f64 = 0.1;
/// A kink at a smaller share of a step is the one at which it starts: the solution does not leave it.
const SMALLEST_SHARE: f64 = 1e-6;
/// A kink that is missed by at most this share of the step is met, once the step is corrected by it.
const REACHED: f64 = 1e-6;
/// Attempts to come closer to a kink.
pub(super) const MOST_CORRECTIONS: u32 = 3;
/// Steps in which values decide on sides where the solution stays at a kink.
const FREE_STEPS: u32 = 10;

/// A kink at which the step is to end.
pub(super) struct Aim {
    pub kink: Kink,
    /// Length of the step that would have crossed it.
    pub step: f64,
    /// Error per time by which the end of the step misses the kink.
    pub jump: f64,
    /// Attempts still allowed to come closer.
    pub corrections: u32,
}

impl Aim {
    /// At a kink that is located already: the end of the step needs no correction.
    fn located(kink: Kink, step: f64) -> Self {
        Self { kink, step, jump: 0.0, corrections: 0 }
    }
}

/// Kinks in an attempt.
pub(super) enum Crossing {
    None,
    /// To the sides given, without effect on the error.
    Harmless(Arc<[bool]>),
    /// With the jump per time, as an error.
    At(Kink, f64),
    /// The sides change, but where they do cannot be told.
    Unclear,
}

impl RungeKutta {
    /// The branches of the next step: those of the last one unless it ended at a kink or kinks are left to the values.
    pub(super) fn next_branches(&mut self, system: &mut Augmented) -> Branches {
        self.free_steps = self.free_steps.saturating_sub(1);
        if !self.kinks.exist() || self.free_steps > 0 {
            return Branches::Free;
        }
        match (self.beyond.take(), &self.branches) {
            (Some(beyond), _) => Branches::Held(beyond),
            (None, Branches::Held(sides)) => Branches::Held(sides.clone()),
            (None, _) => Branches::Held(self.kinks.sides(system, self.time, &self.current[..system.n])),
        }
    }

    /// What kinks do in an attempt of length `h` whose error is small.
    pub(super) fn crossing(&mut self, system: &mut Augmented, h: f64) -> Crossing {
        let Branches::Held(sides) = &self.branches else { return Crossing::None };
        let sides = sides.clone();
        let beyond = self.kinks.sides(system, self.time + h, &self.candidate[..system.n]);
        if beyond == sides {
            return Crossing::None;
        }
        let jump = self.jump(system, h, &sides);
        if jump <= HARMLESS {
            return Crossing::Harmless(beyond);
        }
        let found = self.with_kinks(|kinks, method| {
            kinks.find(system, (method.time, h), &sides, |share, y| method.interpolate_attempt(share, h, y))
        });
        match found {
            Some(kink) if kink.share >= SMALLEST_SHARE => {
                self.kinks.mark_harmful(&kink);
                Crossing::At(kink, jump / h)
            }
            _ => Crossing::Unclear,
        }
    }

    /// By which factor an attempt of length `h` should be longer to end at the kink; none if it is close enough.
    pub(super) fn correction(&mut self, system: &mut Augmented, aim: &mut Aim, h: f64) -> Option<f64> {
        let share = self.with_kinks(|kinks, method| {
            let interpolate = |share: f64, y: &mut [f64]| method.interpolate_attempt(share, h, y);
            kinks.near_end(system, (method.time, h), &aim.kink, interpolate)
        });
        let is_close = (share - 1.0).abs() * h * aim.jump <= HARMLESS || aim.corrections == 0;
        aim.corrections = aim.corrections.saturating_sub(1);
        (!is_close).then_some(share)
    }

    /// Difference of the right-hand side on the sides held and on those by the values at the end of an attempt, as an
    /// error.
    fn jump(&mut self, system: &mut Augmented, h: f64, held: &Arc<[bool]>) -> f64 {
        self.set_branches(system, Branches::Free);
        system.rates(self.time + h, &self.candidate, &mut self.error);
        self.set_branches(system, Branches::Held(held.clone()));
        let last = &self.stages[self.last()];
        self.error.iter_mut().zip(last).for_each(|(rate, held)| *rate = h * (*rate - held));
        self.norm.of(&self.error).norm
    }

    /// Lets values decide on sides for some steps, beginning with the one that is attempted.
    pub(super) fn free(&mut self, system: &mut Augmented) {
        self.set_branches(system, Branches::Freed);
        self.free_steps = FREE_STEPS;
        system.rates(self.time, &self.current, &mut self.stages[0]);
    }

    /// Works on the kinks with the rest of the method at hand.
    fn with_kinks<T>(&mut self, work: impl FnOnce(&mut Kinks, &mut Self) -> T) -> T {
        let mut kinks = std::mem::take(&mut self.kinks);
        let result = work(&mut kinks, self);
        self.kinks = kinks;
        result
    }

    /// The state within the attempted step, at a share of it.
    fn interpolate_attempt(&self, share: f64, h: f64, y: &mut [f64]) {
        match self.pair {
            Pair::Five => {
                combine(y, &self.current[..y.len()], h, &tsitouras::interpolation(share), &self.stages);
            }
            // By Hermite's cubic: the method's own interpolant needs further stages.
            Pair::Eight => {
                let rest = 1.0 - share;
                let (first, last) = (&self.stages[0], &self.stages[self.last()]);
                for (i, value) in y.iter_mut().enumerate() {
                    let (start, end) = (self.current[i], self.candidate[i]);
                    let change = end - start;
                    let bend = rest * (h * first[i] - change) + share * (change - h * last[i]);
                    *value = start + share * (change + rest * bend);
                }
            }
        }
    }

    /// A kink that the next step, of length `h`, will probably cross, located by a step of the state alone:
    /// sensitivities follow once its length is known.
    pub(super) fn look_ahead(&mut self, system: &mut Augmented, h: f64) -> Option<Aim> {
        let Branches::Held(sides) = &self.branches else { return None };
        if !self.kinks.expects_crossing(h, sides) {
            return None;
        }
        let sides = sides.clone();
        self.attempt_state(system, h);
        self.with_kinks(|kinks, method| {
            let interpolate = |share: f64, y: &mut [f64]| method.interpolate_attempt(share, h, y);
            let mut kink = kinks.find(system, (method.time, h), &sides, interpolate)?;
            if kink.share < SMALLEST_SHARE {
                return None;
            }
            for _ in 0..MOST_CORRECTIONS {
                let length = kink.share * h;
                method.attempt_state(system, length);
                let interpolate = |share: f64, y: &mut [f64]| method.interpolate_attempt(share, length, y);
                let factor = kinks.near_end(system, (method.time, length), &kink, interpolate);
                kink.share *= factor;
                if (factor - 1.0).abs() <= REACHED {
                    return (kink.share <= 1.0).then(|| Aim::located(kink, h));
                }
            }
            None
        })
    }

    /// All stages of a step of the state without its sensitivities.
    fn attempt_state(&mut self, system: &mut Augmented, h: f64) {
        let (n, last) = (system.n, self.last());
        for stage in 1..=last {
            let (known, new) = self.stages.split_at_mut(stage);
            let target = if stage == last { &mut self.candidate[..n] } else { &mut self.argument[..n] };
            combine(target, &self.current[..n], h, self.pair.row(stage), known);
            system.rates_of_state(self.time + self.pair.node(stage) * h, target, &mut new[0][..n]);
        }
    }
}
