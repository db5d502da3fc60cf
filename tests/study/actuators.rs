//! Actuators and signals with states against their equations integrated in this file, and their limits.

use crate::evaluate::study;
use ident::simulation::{Compiled, Gradient, excitation, simulate};
use std::f64::consts::TAU;

const STEP: f64 = 0.01;
const DURATION: f64 = 1.0;

/// Measures of a study with one manoeuvre, every 10 ms.
fn channels(text: &str) -> Vec<Vec<f64>> {
    let study = study(&format!("study s\n{text}\nsolver {{ tolerance = 1e-9 }}"));
    let record = excitation(&study, 0, STEP);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure}")).channels
}

/// The same instants by the classical Runge-Kutta method in fine steps.
fn by_hand<const N: usize>(start: [f64; N], rate: impl Fn(f64, [f64; N]) -> [f64; N]) -> Vec<[f64; N]> {
    let inner = 500;
    let h = STEP / f64::from(inner);
    let moved = |y: [f64; N], k: [f64; N], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let mut y = start;
    let mut all = vec![y];
    for outer in 0..(DURATION / STEP).round() as i32 {
        for k in 0..inner {
            let t = f64::from(outer) * STEP + f64::from(k) * h;
            let a = rate(t, y);
            let b = rate(t + h / 2.0, moved(y, a, h / 2.0));
            let c = rate(t + h / 2.0, moved(y, b, h / 2.0));
            let d = rate(t + h, moved(y, c, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        all.push(y);
    }
    all
}

fn agree(found: &[f64], expected: impl Iterator<Item = f64>, what: &str) {
    let expected: Vec<f64> = expected.collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    let size = expected.iter().fold(0.0f64, |size, value| size.max(value.abs()));
    for (k, (a, b)) in found.iter().zip(&expected).enumerate() {
        assert!((a - b).abs() < 2e-6 * size, "{what} at {} s: {a} instead of {b}", k as f64 * STEP);
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

const COMMAND: &str = "manoeuvre m { u = 50 mm * sin(12 rad/s * t), start = rest, for 1 s }";

fn command(t: f64) -> f64 {
    0.05 * (12.0 * t).sin()
}

/// Every limit is reached in turn, and none is exceeded.
#[test]
fn a_servo_obeys_its_limits() {
    let case = |stroke: f64, rate: f64, acceleration: f64, force: f64| {
        let text = format!(
            "input u [mm]\nbody b {{ mass = 3 kg }}\njoint j: prismatic(x) ground -> b\n\
             actuator a: servo on j {{ command = u, frequency = 10 Hz, damping = 0.8, stroke = {stroke} m,
               rate_limit = {rate} m/s, acceleration_limit = {acceleration} m/s^2, force_limit = {force} N }}\n\
             measure z [m] = j.position\nmeasure v [m/s] = j.velocity\nmeasure F [N] = a.force\n{COMMAND}"
        );
        let found = channels(&text);
        let omega = TAU * 10.0;
        let load = |t: f64, x: f64, v: f64| {
            let reference = command(t).clamp(-stroke, stroke);
            let wanted = rate * (omega / 1.6 * (reference - x) / rate).tanh();
            let demand = acceleration * (1.6 * omega * (wanted - v) / acceleration).tanh();
            force * (3.0 * demand / force).tanh()
        };
        let expected = by_hand([0.0, 0.0], |t, [x, v]| [v, load(t, x, v) / 3.0]);
        agree(&found[0], expected.iter().map(|y| y[0]), "position");
        agree(&found[1], expected.iter().map(|y| y[1]), "rate");
        found
    };
    let free = case(1e3, 1e3, 1e5, 1e6);
    // Far from the limits: the second-order system.
    let omega = TAU * 10.0;
    let linear = by_hand([0.0, 0.0], |t, [x, v]| [v, omega * omega * (command(t) - x) - 1.6 * omega * v]);
    agree(&free[0], linear.iter().map(|y| y[0]), "linear");
    let stroke = case(0.01, 1e3, 1e5, 1e6);
    // From one end of the stroke to the other it overshoots by 1.5 % of the way.
    assert!(largest(&free[0]) > 0.045 && largest(&stroke[0]) < 0.01 + 0.016 * 0.02 && largest(&stroke[0]) > 0.01);
    let rate = case(1e3, 0.2, 1e5, 1e6);
    assert!(largest(&free[1]) > 0.5 && largest(&rate[1]) < 0.2 && largest(&rate[1]) > 0.19);
    let acceleration = case(1e3, 1e3, 4.0, 1e6);
    assert!(largest(&free[2]) > 15.0 && largest(&acceleration[2]) < 12.0 && largest(&acceleration[2]) > 11.0);
    let force = case(1e3, 1e3, 1e5, 6.0);
    assert!(largest(&force[2]) <= 6.0 && largest(&force[2]) > 5.9, "{}", largest(&force[2]));
}

#[test]
fn drives_and_actuators_of_first_and_second_order() {
    let found = channels(&format!(
        "input u [mm]\nbody b {{ mass = 3 kg }}\njoint j: prismatic(x) ground -> b\n\
         actuator a: pt1_drive on j {{ command = u, gain = 200 N/m, lag = 40 ms }}\n\
         actuator e: limited_pt1_drive on j {{ command = u, gain = 200 N/m, lag = 40 ms, force_limit = 8 N,
           rate_limit = 60 N/s }}\n\
         signal p: limited_pt1 {{ u = u, lag = 20 ms, stroke = 40 mm, rate_limit = 0.3 m/s }}\n\
         signal q: limited_pt2 {{ u = u, frequency = 8 Hz, damping = 0.6, stroke = 40 mm, rate_limit = 0.4 m/s,
           acceleration_limit = 9 m/s^2 }}\n\
         signal d: pade_delay {{ u = u, delay = 50 ms }}\n\
         measure F_a [N] = a.force\nmeasure F_e [N] = e.force\nmeasure p_ [mm] = p\nmeasure q_ [mm] = q\n\
         measure w_ [m/s] = q.w\nmeasure d_ [mm] = d\n{COMMAND}"
    ));
    let lag = by_hand([0.0], |t, [z]| [(200.0 * command(t) - z) / 0.04]);
    agree(&found[0], lag.iter().map(|y| y[0]), "pt1_drive");
    let limited = by_hand([0.0], |t, [z]| {
        let wanted = (200.0 * command(t)).clamp(-8.0, 8.0);
        [60.0 * ((wanted - z) / 0.04 / 60.0).tanh()]
    });
    agree(&found[1], limited.iter().map(|y| y[0]), "limited_pt1_drive");
    let lag = by_hand([0.0], |t, [z]| [0.3 * ((command(t).clamp(-0.04, 0.04) - z) / 0.02 / 0.3).tanh()]);
    agree(&found[2], lag.iter().map(|y| y[0]), "limited_pt1");
    let omega = TAU * 8.0;
    let second = by_hand([0.0, 0.0], |t, [z, w]| {
        let wanted = 0.4 * (omega / 1.2 * (command(t).clamp(-0.04, 0.04) - z) / 0.4).tanh();
        [w, 9.0 * (1.2 * omega * (wanted - w) / 9.0).tanh()]
    });
    agree(&found[3], second.iter().map(|y| y[0]), "limited_pt2");
    assert!(largest(&found[4]) < 0.4 && largest(&found[4]) > 0.37, "{}", largest(&found[4]));
    // Settled, the delay of 50 ms at 12 rad/s is that of the formula but for 1.07e-4 rad of phase.
    for (k, value) in found[5].iter().enumerate().skip(60) {
        let t = k as f64 * STEP;
        assert!((value - command(t - 0.05)).abs() < 1.1e-4 * 0.05, "{t}: {value}");
    }
}

/// Controllers: the integral of a sine, the lagged rate, the clipped signal.
#[test]
fn controllers() {
    let found = channels(&format!(
        "input u [mm]\n\
         signal i: pid {{ reference = u, position = 2 * u, velocity = 3 * derivative(u), proportional = 5 V/m,
           integral = 70 V/(m*s), derivative = 2 V*s/m }}\n\
         signal c: cascade {{ reference = u, position = 3 * u, velocity = derivative(u), position_gain = 20 1/s,
           velocity_gain = 4 V*s/m }}\n\
         signal l: limiter {{ u = u, limit = 20 mm }}\nsignal r: lagged_rate {{ u = u, lag = 10 ms }}\n\
         signal f: pt2_filter {{ u = u, frequency = 5 Hz, damping = 0.7 }}\nsignal g: pt1 {{ u = u, lag = 30 ms }}\n\
         body b {{ mass = 1 kg }}\njoint j: prismatic(x) ground -> b\nforce k: spring on j {{ stiffness = 1 N/m }}\n\
         measure i_ [V] = i\nmeasure c_ [V] = c\nmeasure l_ [m] = l\nmeasure r_ [m/s] = r\nmeasure f_ [m] = f\n\
         measure g_ [m] = g\n{COMMAND}"
    ));
    let rate = |t: f64| 0.6 * (12.0 * t).cos();
    let times = || (0..=100).map(|k| f64::from(k) * STEP);
    // The integral of -u is (cos - 1) 0.05 / 12.
    agree(
        &found[0],
        times().map(|t| -5.0 * command(t) + 70.0 * 0.05 / 12.0 * ((12.0 * t).cos() - 1.0) - 6.0 * rate(t)),
        "pid",
    );
    agree(&found[1], times().map(|t| 4.0 * (-40.0 * command(t) - rate(t))), "cascade");
    agree(&found[2], times().map(|t| command(t).clamp(-0.02, 0.02)), "limiter");
    let lagged = by_hand([0.0], |t, [z]| [(command(t) - z) / 0.01]);
    agree(&found[3], times().zip(&lagged).map(|(t, z)| (command(t) - z[0]) / 0.01), "lagged_rate");
    let omega = TAU * 5.0;
    let filter = by_hand([0.0, 0.0], |t, [z, w]| [w, omega * omega * (command(t) - z) - 1.4 * omega * w]);
    agree(&found[4], filter.iter().map(|y| y[0]), "pt2_filter");
    let lagged = by_hand([0.0], |t, [z]| [(command(t) - z) / 0.03]);
    agree(&found[5], lagged.iter().map(|y| y[0]), "pt1");
}
