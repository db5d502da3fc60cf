//! Switching equations against analytic solutions: instants, states, sensitivities.

use crate::scalar::{Dual, Scalar};
use crate::system::{Equations, System};
use ident::integrate::{
    Dynamics, FailureCause, MethodChoice, Options, Plan, ResetDerivatives, Start, SwitchDerivatives, integrate,
};
use ident::linear::SparsityPattern;
use std::sync::Arc;

/// Equations with modes.
trait Switching: Equations {
    fn switches<S: Scalar>(&self, t: S, y: &[S], theta: &[S]) -> Vec<S>;

    /// The state after a zero of function `k`.
    fn reset<S: Scalar>(&self, k: usize, y: &[S], theta: &[S]) -> Vec<S>;

    fn change_mode(&mut self, _k: usize) {}
}

struct Switched<E>(System<E>);

impl<E: Switching> Switched<E> {
    /// Slopes of `function` by time, every state and every parameter.
    fn slopes(&self, t: f64, y: &[f64], function: impl Fn(&E, Dual, &[Dual], &[Dual]) -> Vec<Dual>) -> Vec<Vec<f64>> {
        let theta = &self.0.theta;
        (0..1 + y.len() + theta.len())
            .map(|seed| {
                let dual = |(i, v): (usize, &f64)| Dual { value: *v, slope: f64::from(i == seed) };
                let time = Dual { value: t, slope: f64::from(seed == 0) };
                let y: Vec<Dual> = y.iter().enumerate().map(|(i, v)| dual((i + 1, v))).collect();
                let theta: Vec<Dual> = theta.iter().enumerate().map(|(i, v)| dual((i + 1 + y.len(), v))).collect();
                function(&self.0.equations, time, &y, &theta).iter().map(|v| v.slope).collect()
            })
            .collect()
    }
}

impl<E: Switching> Dynamics for Switched<E> {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }
    fn parameter_count(&self) -> usize {
        self.0.parameter_count()
    }
    fn differential(&self) -> &[bool] {
        self.0.differential()
    }
    fn scale(&self) -> &[f64] {
        self.0.scale()
    }
    fn parameter_scale(&self) -> &[f64] {
        self.0.parameter_scale()
    }
    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        self.0.residual(t, y, y_prime, residual);
    }
    fn pattern(&self) -> &SparsityPattern {
        self.0.pattern()
    }
    fn jacobian(&mut self, t: f64, y: &[f64], y_prime: &[f64], c: f64, values: &mut [f64]) {
        self.0.jacobian(t, y, y_prime, c, values);
    }
    fn parameter_derivative(&mut self, t: f64, y: &[f64], y_prime: &[f64], values: &mut [f64]) {
        self.0.parameter_derivative(t, y, y_prime, values);
    }
    fn explicit_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> bool {
        self.0.explicit_rates(t, y, rates)
    }
    fn switch_count(&self) -> usize {
        self.0.equations.switches(0.0, &vec![0.0; self.dimension()], &self.0.theta).len()
    }
    fn switches(&mut self, t: f64, y: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&self.0.equations.switches(t, y, &self.0.theta));
    }
    fn switch_derivatives(&mut self, k: usize, t: f64, y: &[f64], derivatives: &mut SwitchDerivatives) {
        let slopes = self.slopes(t, y, |e, t, y, theta| e.switches(t, y, theta));
        derivatives.by_time = slopes[0][k];
        derivatives.by_state.iter_mut().zip(&slopes[1..]).for_each(|(d, s)| *d = s[k]);
        derivatives.by_parameter.iter_mut().zip(&slopes[1 + y.len()..]).for_each(|(d, s)| *d = s[k]);
    }
    fn reset_derivatives(&mut self, k: usize, _rising: bool, t: f64, y: &[f64], derivatives: &mut ResetDerivatives) {
        let slopes = self.slopes(t, y, |e, _, y, theta| e.reset(k, y, theta));
        derivatives.by_time = slopes[0].clone();
        derivatives.by_state = slopes[1..1 + y.len()].concat();
        let columns = derivatives.by_parameter.len() / y.len();
        derivatives.by_parameter = slopes[1 + y.len()..][..columns].concat();
    }
    fn reset(&mut self, k: usize, _rising: bool, _t: f64, y: &mut [f64]) {
        y.copy_from_slice(&self.0.equations.reset(k, y, &self.0.theta));
        self.0.equations.change_mode(k);
    }
}

/// Height and velocity; parameters gravity and restitution.
struct Ball;

impl Equations for Ball {
    fn dimension(&self) -> usize {
        2
    }
    fn rates<S: Scalar>(&self, _t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        Some(vec![y[1], -theta[0]])
    }
}

impl Switching for Ball {
    fn switches<S: Scalar>(&self, _t: S, y: &[S], _theta: &[S]) -> Vec<S> {
        vec![y[0]]
    }
    fn reset<S: Scalar>(&self, _k: usize, y: &[S], theta: &[S]) -> Vec<S> {
        vec![y[0], -(theta[1] * y[1])]
    }
}

/// Instants of the first bounces from height 1, and height and velocity at `t` after `count` of them.
fn ball<S: Scalar>(t: f64, count: usize, gravity: S, restitution: S) -> (Vec<S>, [S; 2]) {
    let fall = (S::from(2.0) / gravity).sqrt();
    let (mut instants, mut speed) = (vec![fall], gravity * fall * restitution);
    for _ in 1..count {
        let last = instants[instants.len() - 1];
        instants.push(last + S::from(2.0) * speed / gravity);
        speed = speed * restitution;
    }
    let since = S::from(t) - instants[count - 1];
    (instants, [speed * since - gravity * since * since / S::from(2.0), speed - gravity * since])
}

const GRAVITY: f64 = 9.81;
const RESTITUTION: f64 = 0.7;

#[test]
fn a_ball_bounces_when_and_as_high_as_it_should() {
    for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
        let mut system = Switched(System::new(Ball, &[GRAVITY, RESTITUTION]));
        let start = system.0.start_with_sensitivity(&[1.0, 0.0]);
        let times = [0.6, 1.3, 1.7];
        let options = Options { method, relative_tolerance: 1e-9, ..Options::default() };
        let solution = integrate(&mut system, &start, &times, &[], &options).unwrap();
        let (instants, _) = ball(1.7, 3, GRAVITY, RESTITUTION);
        assert_eq!(solution.work.events.len(), 3, "{:?}", solution.work.events);
        for ((found, switch), exact) in solution.work.events.iter().zip(&instants) {
            assert!(*switch == 0 && (found - exact).abs() < 1e-7, "{method:?}: {found} {exact}");
        }
        for (k, &t) in times.iter().enumerate() {
            for j in 0..2 {
                let seed = |i: usize, value: f64| Dual { value, slope: f64::from(i == j) };
                let count = k + 1;
                let (_, exact) = ball(t, count, seed(0, GRAVITY), seed(1, RESTITUTION));
                for (i, exact) in exact.iter().enumerate() {
                    let (y, s) = (solution.y[2 * k + i], solution.sensitivity[(2 * k + j) * 2 + i]);
                    assert!((y - exact.value).abs() < 1e-6, "{method:?} t = {t}: {y} {}", exact.value);
                    assert!((s - exact.slope).abs() < 1e-5, "{method:?} t = {t}: {s} {}", exact.slope);
                }
            }
        }
    }
}

#[test]
fn bounces_without_end_are_a_failure() {
    let mut system = Switched(System::new(Ball, &[GRAVITY, 0.5]));
    let start = system.0.start(&[1.0, 0.0]);
    let failure = integrate(&mut system, &start, &[10.0], &[], &Options::default()).unwrap_err();
    let rest = 3.0 * (2.0 / GRAVITY).sqrt();
    assert_eq!(failure.cause, FailureCause::Chattering, "{failure:?}");
    assert!((failure.time - rest).abs() < 1e-5, "{} {rest}", failure.time);
    assert!(failure.work.events.len() > 20);
}

/// Mass 1 dragged over a surface by a spring whose end moves at a constant speed. Parameters: stiffness, friction at
/// rest and in motion, speed.
struct StickSlip {
    sticks: bool,
}

impl Equations for StickSlip {
    fn dimension(&self) -> usize {
        2
    }
    fn rates<S: Scalar>(&self, t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        if self.sticks {
            return Some(vec![S::from(0.0), S::from(0.0)]);
        }
        Some(vec![y[1], theta[0] * (theta[3] * S::from(t) - y[0]) - theta[2]])
    }
}

impl Switching for StickSlip {
    fn switches<S: Scalar>(&self, t: S, y: &[S], theta: &[S]) -> Vec<S> {
        if self.sticks {
            vec![S::from(1.0), theta[1] - theta[0] * (theta[3] * t - y[0])]
        } else {
            vec![y[1], S::from(1.0)]
        }
    }
    fn reset<S: Scalar>(&self, _k: usize, y: &[S], _theta: &[S]) -> Vec<S> {
        vec![y[0], S::from(0.0)]
    }
    fn change_mode(&mut self, _k: usize) {
        self.sticks = !self.sticks;
    }
}

const STICK_SLIP: [f64; 4] = [40.0, 5.0, 3.0, 0.1];

/// Duration of sticking from rest, of slipping, and of sticking again; position at `since` in the first slip.
fn stick_slip(theta: [Dual; 4], since: f64) -> ([f64; 3], Dual) {
    let [stiffness, rest, motion, speed] = theta;
    let omega = stiffness.sqrt();
    let amplitude = (rest - motion) / stiffness;
    let first = rest / (stiffness * speed);
    let slip = (2.0 * std::f64::consts::PI - 2.0 * (amplitude.value * omega.value / speed.value).atan()) / omega.value;
    let again = 2.0 * amplitude.value / speed.value;
    // Extension of the spring; the slip begins when the first sticking ends.
    let time = Dual::from(since) - first;
    let phase = omega * time;
    let extension = motion / stiffness + amplitude * phase.cos() + speed / omega * phase.sin();
    ([first.value, slip, again], speed * Dual::from(since) - extension)
}

#[test]
fn dry_friction_sticks_and_slips_when_it_should() {
    let exact = |t: f64, j: usize| {
        let theta = std::array::from_fn(|i| Dual { value: STICK_SLIP[i], slope: f64::from(i == j) });
        stick_slip(theta, t)
    };
    let ([first, slip, again], _) = exact(0.0, 9);
    let within = first + 0.6 * slip;
    // While it sticks after the slip, it stands where the slip ended: twice the overshoot further.
    let after = first + slip + 0.5 * again;
    let end = first + 2.0 * (slip + again);
    for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
        let mut system = Switched(System::new(StickSlip { sticks: false }, &STICK_SLIP));
        // The structure of the equations is that of the motion; they start at rest.
        system.0.equations.sticks = true;
        let start = Start { time: 0.0, y: vec![0.0, 0.0], y_prime: vec![0.0, 0.0], sensitivity: vec![0.0; 8] };
        let options = Options { method, relative_tolerance: 1e-9, ..Options::default() };
        let solution = integrate(&mut system, &start, &[within, after, end - 1e-3], &[], &options).unwrap();
        let events: Vec<f64> = solution.work.events.iter().map(|event| event.0).collect();
        let period = slip + again;
        let instants = [first, first + slip, first + period, first + period + slip];
        assert_eq!(events.len(), instants.len(), "{method:?}: {events:?} {instants:?}");
        for (found, exact) in events.iter().zip(instants) {
            assert!((found - exact).abs() < 1e-7, "{method:?}: {found} {exact}");
        }
        for j in 0..4 {
            let (_, position) = exact(within, j);
            assert!((solution.y[0] - position.value).abs() < 1e-7, "{method:?}");
            let ours = solution.sensitivity[2 * j];
            assert!((ours - position.slope).abs() < 1e-6 * position.slope.abs().max(1.0), "{method:?} {j}: {ours}");
        }
        // Extension after the slip: motion / stiffness - amplitude, so x = speed t2 - that, t2 the end of the slip.
        let [stiffness, rest, motion, speed] = STICK_SLIP;
        let stand = |theta: [f64; 4]| {
            let ([first, slip, _], _) = stick_slip(theta.map(Dual::from), 0.0);
            theta[3] * (first + slip) - theta[2] / theta[0] + (theta[1] - theta[2]) / theta[0]
        };
        assert!((solution.y[2] - stand([stiffness, rest, motion, speed])).abs() < 1e-7, "{method:?}");
        assert_eq!(solution.y[3], 0.0);
        for (j, value) in STICK_SLIP.iter().enumerate() {
            let step = 1e-4 * value;
            let moved =
                |sign: f64| stand(std::array::from_fn(|i| STICK_SLIP[i] + if i == j { sign * step } else { 0.0 }));
            let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            let ours = solution.sensitivity[8 + 2 * j];
            assert!((ours - difference).abs() < 1e-5 * difference.abs().max(1.0), "{j}: {ours} {difference}");
            assert_eq!(solution.sensitivity[8 + 2 * j + 1], 0.0, "at rest whatever the parameters");
        }
    }
}

#[test]
fn a_plan_does_not_fit_moving_events() {
    let mut system = Switched(System::new(Ball, &[GRAVITY, RESTITUTION]));
    let start = system.0.start(&[1.0, 0.0]);
    let options = Options { follow_plan: Some(Arc::new(Plan::default())), ..Options::default() };
    let failure = integrate(&mut system, &start, &[1.0], &[], &options).unwrap_err();
    assert_eq!(failure.cause, FailureCause::InvalidRequest);
}
