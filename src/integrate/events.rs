//! Switching functions: their zeros are located on the interpolant of a step, the state is reset there, and the
//! sensitivities are carried across.
//!
//! With `g(tau, y(tau; theta), theta) = 0` at the instant tau and the reset `y+ = R(tau, y-, theta)`:
//! `dtau/dtheta = -(g_y S- + g_theta) / (g_t + g_y y'-)` and
//! `S+ = R_y (S- + y'- dtau/dtheta) + R_theta + (R_t - y'+) dtau/dtheta` (Rozenvasser-1967).

use super::augmented::Augmented;
use super::consistent::{Consistency, make_consistent};
use super::problem::{FailureCause, ResetDerivatives, SwitchDerivatives};
use super::stepper::{Refusal, first_not_finite};

/// Points within a step at which signs are compared, besides its end.
const INNER_POINTS: usize = 3;
const MAXIMUM_ITERATIONS: usize = 100;
/// A value this small against that at the begin of the step is zero: its sign is that of its slope.
const ZERO: f64 = 1e-6;
/// Events of one switching function within this share of the run after each other ...
const TOGETHER: f64 = 1e-9;
/// ... may be this many.
const MOST_TOGETHER: usize = 5;

/// An instant at which a switching function changes its sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub time: f64,
    pub switch: usize,
}

pub(super) struct Events {
    /// Signs of the switching functions, and their values at the begin of the step.
    signs: Vec<f64>,
    at_begin: Vec<f64>,
    values: Vec<f64>,
    z: Vec<f64>,
    /// Per switching function: its last event, and how many came shortly after each other.
    last: Vec<f64>,
    together: Vec<usize>,
}

impl Events {
    pub fn new(count: usize, length: usize) -> Self {
        let empty = || vec![0.0; count];
        let (signs, at_begin, values) = (empty(), empty(), empty());
        Self {
            signs,
            at_begin,
            values,
            z: vec![0.0; length],
            last: vec![f64::NEG_INFINITY; count],
            together: vec![0; count],
        }
    }

    pub fn has_switches(&self) -> bool {
        !self.signs.is_empty()
    }

    /// Takes the signs at a start; those of zeros from their slopes.
    pub fn begin(&mut self, system: &mut Augmented, t: f64, z: &[f64], y_prime: &[f64]) {
        system.dynamics.switches(t, &z[..system.n], &mut self.values);
        for k in 0..self.values.len() {
            let zero = self.values[k] == 0.0;
            let value = if zero { derivatives(system, k, t, z).along(y_prime) } else { self.values[k] };
            self.signs[k] = sign(value);
        }
        self.at_begin.copy_from_slice(&self.values);
    }

    /// The first event in the step from `from` to `to`.
    pub fn find(
        &mut self,
        system: &mut Augmented,
        from: f64,
        to: f64,
        interpolate: impl Fn(f64, &mut [f64]),
    ) -> Option<Event> {
        let mut left = from;
        for point in 1..=INNER_POINTS + 1 {
            let right = if point > INNER_POINTS { to } else { from + (to - from) * point as f64 / 4.0 };
            interpolate(right, &mut self.z);
            system.dynamics.switches(right, &self.z[..system.n], &mut self.values);
            let mut crossed = Vec::new();
            for k in 0..self.values.len() {
                if sign(self.values[k]) * self.signs[k] < 0.0 {
                    if system.dynamics.switch_acts(k, self.signs[k] < 0.0) {
                        crossed.push(k);
                    } else {
                        self.signs[k] = sign(self.values[k]);
                    }
                }
            }
            let events = crossed.into_iter().map(|switch| {
                let time = self.locate(system, switch, left, right, &interpolate);
                Event { time, switch }
            });
            if let Some(first) = events.min_by(|a, b| a.time.total_cmp(&b.time)) {
                return Some(first);
            }
            left = right;
        }
        self.at_begin.copy_from_slice(&self.values);
        // A function that started at zero without a slope has its sign from now on.
        for (sign_of, value) in self.signs.iter_mut().zip(&self.values) {
            if *sign_of == 0.0 {
                *sign_of = sign(*value);
            }
        }
        None
    }

    /// First instant known to lie behind the zero between `left` and `right`, to rounding; bisection and false position
    /// in turn, so that neither flat nor steep functions are slow.
    fn locate(
        &mut self,
        system: &mut Augmented,
        switch: usize,
        mut left: f64,
        mut right: f64,
        interpolate: impl Fn(f64, &mut [f64]),
    ) -> f64 {
        let mut values = vec![0.0; self.values.len()];
        let mut value = |t: f64, z: &mut [f64]| {
            interpolate(t, z);
            system.dynamics.switches(t, &z[..system.n], &mut values);
            values[switch]
        };
        let (mut at_left, mut at_right) = (value(left, &mut self.z), value(right, &mut self.z));
        for iteration in 0..MAXIMUM_ITERATIONS {
            if right - left <= 2.0 * f64::EPSILON * right.abs().max(left.abs()) {
                break;
            }
            let share = if iteration % 3 == 2 { 0.5 } else { at_left / (at_left - at_right) };
            let middle = left + (right - left) * if share.is_finite() { share.clamp(1e-3, 1.0 - 1e-3) } else { 0.5 };
            if middle <= left || middle >= right {
                break;
            }
            let at_middle = value(middle, &mut self.z);
            if sign(at_middle) * self.signs[switch] < 0.0 {
                (right, at_right) = (middle, at_middle);
            } else {
                (left, at_left) = (middle, at_middle);
            }
        }
        right
    }

    /// Resets state and sensitivities (`z` holds them just before the event) and takes the new signs.
    pub fn cross(
        &mut self,
        system: &mut Augmented,
        event: Event,
        time_step: f64,
        z: &mut [f64],
    ) -> Result<(), Refusal> {
        let Event { time, switch } = event;
        self.refuse_accumulation(system, event)?;
        let rising = self.signs[switch] < 0.0;
        let at_begin = self.at_begin[switch];
        let before = slopes(system, time, time_step, z)?;
        let condition = derivatives(system, switch, time, z);
        let shift = shift_of_time(z, (system.n, system.p), &before, &condition);
        move_along(z, system.n, &before, &shift, 1.0);
        let mut fired = vec![(switch, rising)];
        let mut at = 0;
        while let Some(&(switch, rising)) = fired.get(at) {
            self.reset(system, (switch, rising), time, &shift, z, &mut fired)?;
            at += 1;
        }
        let after = slopes(system, time, time_step, z)?;
        move_along(z, system.n, &after, &shift, -1.0);
        require_finite(system, time, z)?;
        self.begin(system, time, z, &after);
        if self.values[switch].abs() <= ZERO * at_begin.abs() {
            let slope = derivatives(system, switch, time, z).along(&after);
            let crossed = if rising { 1.0 } else { -1.0 };
            self.signs[switch] = if slope == 0.0 { crossed } else { sign(slope) };
        }
        Ok(())
    }

    /// One reset; functions that it makes positive are added to those that have `fired`.
    fn reset(
        &mut self,
        system: &mut Augmented,
        (switch, rising): (usize, bool),
        time: f64,
        shift: &[f64],
        z: &mut [f64],
        fired: &mut Vec<(usize, bool)>,
    ) -> Result<(), Refusal> {
        let n = system.n;
        let jumps = system.dynamics.acts_on_jumps();
        let mut before = vec![0.0; if jumps { self.values.len() } else { 0 }];
        if jumps {
            system.dynamics.switches(time, &z[..n], &mut before);
        }
        let mut reset = ResetDerivatives::identity(n, system.p);
        system.dynamics.reset_derivatives(switch, rising, time, &z[..n], &mut reset);
        system.dynamics.reset(switch, rising, time, &mut z[..n]);
        apply(&mut z[n..], n, &reset, shift);
        if jumps {
            self.add_fired(system, time, z, &before, fired)?;
        }
        Ok(())
    }

    /// Functions that a jump has made positive.
    fn add_fired(
        &mut self,
        system: &mut Augmented,
        time: f64,
        z: &[f64],
        before: &[f64],
        fired: &mut Vec<(usize, bool)>,
    ) -> Result<(), Refusal> {
        system.dynamics.switches(time, &z[..system.n], &mut self.values);
        for (k, (&before, &value)) in before.iter().zip(&self.values).enumerate() {
            // A function that was zero up to rounding has been crossed, not jumped over.
            let was_zero = before.abs() <= ZERO * self.at_begin[k].abs();
            let jumped = before < 0.0 && !was_zero && value > ZERO * before.abs();
            if jumped && system.dynamics.switch_acts(k, true) {
                if fired.iter().filter(|(other, _)| *other == k).count() > MOST_TOGETHER {
                    return Err(Refusal::new(time, FailureCause::Chattering));
                }
                fired.push((k, true));
            }
        }
        Ok(())
    }

    /// Changes of the state where clocks tick; the instant does not depend on the parameters.
    pub fn tick(&mut self, system: &mut Augmented, clocks: &[usize], time: f64, z: &mut [f64]) -> Result<(), Refusal> {
        let n = system.n;
        let mut before = vec![0.0; self.values.len()];
        system.dynamics.switches(time, &z[..n], &mut before);
        self.at_begin.copy_from_slice(&before);
        let mut change = ResetDerivatives::identity(n, system.p);
        system.dynamics.tick_derivatives(clocks, time, &z[..n], &mut change);
        system.dynamics.tick(clocks, time, &mut z[..n]);
        let shift = vec![0.0; system.p];
        apply(&mut z[n..], n, &change, &shift);
        let mut fired = Vec::new();
        if system.dynamics.acts_on_jumps() {
            self.add_fired(system, time, z, &before, &mut fired)?;
        }
        let mut at = 0;
        while let Some(&event) = fired.get(at) {
            system.work.events.push((time, event.0));
            self.reset(system, event, time, &shift, z, &mut fired)?;
            at += 1;
        }
        require_finite(system, time, z)
    }

    /// Events without end in a finite time (a ball that comes to rest by bouncing).
    fn refuse_accumulation(&mut self, system: &Augmented, Event { time, switch }: Event) -> Result<(), Refusal> {
        let (begin, end) = system.work.span;
        let is_close = time - self.last[switch] <= TOGETHER * (end - begin);
        self.together[switch] = if is_close { self.together[switch] + 1 } else { 0 };
        self.last[switch] = time;
        if self.together[switch] > MOST_TOGETHER {
            return Err(Refusal::new(time, FailureCause::Chattering));
        }
        Ok(())
    }
}

fn sign(value: f64) -> f64 {
    if value > 0.0 {
        1.0
    } else if value < 0.0 {
        -1.0
    } else {
        0.0
    }
}

fn derivatives(system: &mut Augmented, switch: usize, t: f64, z: &[f64]) -> SwitchDerivatives {
    let mut result = SwitchDerivatives::zero(system.n, system.p);
    system.dynamics.switch_derivatives(switch, t, &z[..system.n], &mut result);
    result
}

impl SwitchDerivatives {
    /// Rate of the function along a solution with the derivative `y_prime`.
    fn along(&self, y_prime: &[f64]) -> f64 {
        self.by_time + self.by_state.iter().zip(y_prime).map(|(g, v)| g * v).sum::<f64>()
    }
}

/// Derivative of the state at a point, by the equations in force.
fn slopes(system: &mut Augmented, t: f64, time_step: f64, z: &[f64]) -> Result<Vec<f64>, Refusal> {
    let (mut z, mut z_prime) = (z.to_vec(), vec![0.0; z.len()]);
    match make_consistent(system, t, time_step, &mut z, &mut z_prime) {
        Consistency::NotFinite(component) => Err(Refusal::new(t, FailureCause::NotFinite).blaming(Some(component))),
        Consistency::Reached | Consistency::Undetermined => {
            z_prime.truncate(system.n);
            Ok(z_prime)
        }
    }
}

/// `dtau/dtheta` of an instant at which a function is zero; empty in nominal runs.
fn shift_of_time(z: &[f64], (n, p): (usize, usize), before: &[f64], condition: &SwitchDerivatives) -> Vec<f64> {
    let rate = condition.along(before);
    let s = &z[n..];
    (0..p)
        .map(|j| {
            let known: f64 = condition.by_state.iter().enumerate().map(|(i, g)| g * s[i * p + j]).sum();
            -(known + condition.by_parameter[j]) / rate
        })
        .collect()
}

/// Adds `sign y' dtau/dtheta` to the sensitivities.
fn move_along(z: &mut [f64], n: usize, slope: &[f64], shift: &[f64], sign: f64) {
    if shift.is_empty() {
        return;
    }
    for (row, slope) in z[n..].chunks_exact_mut(shift.len()).zip(slope) {
        row.iter_mut().zip(shift).for_each(|(s, shift)| *s += sign * slope * shift);
    }
}

/// `S := R_y S + R_theta + R_t dtau/dtheta`.
fn apply(s: &mut [f64], n: usize, reset: &ResetDerivatives, shift: &[f64]) {
    let p = shift.len();
    for j in 0..p {
        let column: Vec<f64> = (0..n).map(|i| s[i * p + j]).collect();
        for i in 0..n {
            let carried: f64 = column.iter().enumerate().map(|(l, m)| reset.by_state[l * n + i] * m).sum();
            s[i * p + j] = carried + reset.by_parameter[j * n + i] + reset.by_time[i] * shift[j];
        }
    }
}

fn require_finite(system: &Augmented, time: f64, z: &[f64]) -> Result<(), Refusal> {
    match first_not_finite(z) {
        Some(place) if place < system.n => Err(Refusal::new(time, FailureCause::NotFinite).blaming(Some(place))),
        Some(place) => {
            let component = (place - system.n) / system.p.max(1);
            Err(Refusal::new(time, FailureCause::NotFinite).blaming(Some(component)))
        }
        None => Ok(()),
    }
}
