//! When to leave the explicit method, and when to come back to it.
//!
//! Steps at the bound of stability (Hairer-Wanner-1996, IV.2) alone do not make the implicit method cheaper: with a
//! friction law that is stiff for short times only, its many short steps cost more. So stiffness starts a trial: the
//! implicit method is kept if it advances further per unit of work. Work is counted in evaluations, not in seconds, so
//! that every run takes the same decisions. Once the implicit steps have been short enough for the explicit method for
//! some time, stiffness has gone.

use super::problem::Work;

/// Steps near the bound of stability before a trial; this many others in between start the count anew.
const STIFF_STEPS: usize = 15;
const CALM_STEPS: usize = 6;
/// Steps of a trial: the first ones build up the order and do not count.
const WARM_UP: usize = 40;
const TRIAL: usize = 100;
/// The implicit method must advance this much further per unit of work.
const GAIN: f64 = 1.5;
/// Explicit steps before the next trial after a failed one, and their growth per failure.
const FIRST_PAUSE: usize = 500;
const PAUSE_GROWTH: usize = 4;

/// Implicit steps within the stability of the explicit method before the return to it, and their growth per return.
const MILD_STEPS: usize = 30;
const MILD_GROWTH: usize = 2;

/// What the last step says about stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stiffness {
    /// An explicit step far from the bound of stability, or an implicit one well beyond it.
    Unremarkable,
    /// An explicit step near the bound of stability.
    NearBound,
    /// An implicit step that an explicit method could take.
    Mild,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Advice {
    Stay,
    /// Try the implicit method from here.
    Try,
    /// The trial has failed, or stiffness has gone: go back.
    Return,
}

#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    time: f64,
    cost: usize,
    steps: usize,
}

impl Mark {
    fn new(time: f64, work: &Work) -> Self {
        Self { time, cost: work.residuals + work.jacobians + work.factorisations, steps: work.steps }
    }

    /// Time advanced per unit of work since `self`.
    fn rate_until(&self, later: &Mark) -> f64 {
        (later.time - self.time) / (later.cost - self.cost).max(1) as f64
    }
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    Explicit,
    WarmUp { begin: Mark },
    Trial { begin: Mark },
    Implicit,
}

pub(super) struct Monitor {
    phase: Phase,
    stiff: usize,
    calm: usize,
    /// First of the steps counted as stiff.
    stiff_since: Mark,
    explicit_rate: f64,
    gain: f64,
    pause: usize,
    no_trial_before: usize,
    mild: usize,
    mild_needed: usize,
    has_gone: bool,
}

impl Default for Monitor {
    fn default() -> Self {
        Self {
            phase: Phase::Explicit,
            stiff: 0,
            calm: 0,
            stiff_since: Mark::default(),
            explicit_rate: 0.0,
            gain: 0.0,
            pause: FIRST_PAUSE,
            no_trial_before: 0,
            mild: 0,
            mild_needed: MILD_STEPS,
            has_gone: false,
        }
    }
}

impl Monitor {
    /// To be called after every step with the time reached and the work so far.
    pub fn observe(&mut self, time: f64, stiffness: Stiffness, work: &Work) -> Advice {
        let now = Mark::new(time, work);
        match self.phase {
            Phase::Explicit => self.observe_explicit(now, stiffness == Stiffness::NearBound),
            Phase::WarmUp { begin } => {
                if now.steps - begin.steps >= WARM_UP {
                    self.phase = Phase::Trial { begin: now };
                }
                Advice::Stay
            }
            Phase::Trial { begin } => self.observe_trial(begin, now),
            Phase::Implicit => self.observe_implicit(stiffness == Stiffness::Mild),
        }
    }

    fn observe_explicit(&mut self, now: Mark, near_stability: bool) -> Advice {
        if !near_stability {
            self.calm += 1;
            if self.calm >= CALM_STEPS {
                self.stiff = 0;
            }
            return Advice::Stay;
        }
        self.calm = 0;
        if self.stiff == 0 {
            self.stiff_since = now;
        }
        self.stiff += 1;
        if self.stiff < STIFF_STEPS || now.steps < self.no_trial_before {
            return Advice::Stay;
        }
        self.explicit_rate = self.stiff_since.rate_until(&now);
        self.stiff = 0;
        self.phase = Phase::WarmUp { begin: now };
        Advice::Try
    }

    fn observe_implicit(&mut self, mild: bool) -> Advice {
        self.mild = if mild { self.mild + 1 } else { 0 };
        if self.mild < self.mild_needed {
            return Advice::Stay;
        }
        self.mild = 0;
        self.mild_needed *= MILD_GROWTH;
        self.has_gone = true;
        self.phase = Phase::Explicit;
        Advice::Return
    }

    fn observe_trial(&mut self, begin: Mark, now: Mark) -> Advice {
        if now.steps - begin.steps < TRIAL - WARM_UP {
            return Advice::Stay;
        }
        self.gain = begin.rate_until(&now) / self.explicit_rate;
        if self.gain >= GAIN {
            self.phase = Phase::Implicit;
            return Advice::Stay;
        }
        self.has_gone = false;
        self.phase = Phase::Explicit;
        self.no_trial_before = now.steps + self.pause;
        self.pause *= PAUSE_GROWTH;
        Advice::Return
    }

    /// In words, after advice to change.
    pub fn reason(&self) -> String {
        match self.phase {
            Phase::Explicit if self.has_gone => {
                "stiffness has gone: the implicit steps were short enough for the explicit method".to_owned()
            }
            Phase::Explicit => format!(
                "stability limits the explicit steps at times, but the implicit method advanced only {:.2} times as far per evaluation",
                self.gain
            ),
            _ => "stability limits the explicit steps, the implicit method advances further per evaluation".to_owned(),
        }
    }
}
