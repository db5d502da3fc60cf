//! Laws that switch, jump or act at a fixed period, declared in `.ident`: exact instants, values and sensitivities.

use ident::diagnostics::render;
use ident::fit::Control;
use ident::identify::{Settings, fit};
use ident::simulation::{Compiled, Gradient, Record, Trajectory, certify, prepare, simulate};
use ident::study::{check, load_text};
use std::fs;

/// A study and its record: `times` and any values.
fn prepared(text: &str, heads: &[&str], times: &[f64], values: impl Fn(usize, f64) -> f64) -> (Compiled, Record) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut record = format!("t [s],{}\n", heads.join(","));
    for &t in times {
        let cells: Vec<String> = (0..heads.len()).map(|i| format!("{:e}", values(i, t))).collect();
        record += &format!("{t:e},{}\n", cells.join(","));
    }
    fs::write(folder.path().join("run.csv"), record).expect("writable folder");
    let loaded = load_text("events.ident", text);
    let complain = |findings: &[_]| -> ! { panic!("{}", render(findings, &loaded.sources, false)) };
    let checked = check(&loaded, None).unwrap_or_else(|findings| complain(&findings));
    let compiled = Compiled::new(checked.study).unwrap_or_else(|findings| complain(&findings));
    let (mut records, findings) = prepare(&compiled.study, folder.path(), &[]);
    if findings.iter().any(|finding| finding.is_error()) {
        complain(&findings);
    }
    (compiled, records.remove(0))
}

fn run(compiled: &Compiled, record: &Record, theta: &[f64]) -> Trajectory {
    simulate(compiled, record, theta, Gradient::AllParameters).unwrap_or_else(|failure| panic!("{failure:?}"))
}

fn grid(duration: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|k| duration * k as f64 / count as f64).collect()
}

/// The channels and their derivatives against a closed form and its differences, apart from samples near an event.
fn compare(
    own: &Trajectory,
    times: &[f64],
    theta: &[f64],
    exact: impl Fn(f64, &[f64]) -> Vec<f64>,
    is_near_event: impl Fn(f64) -> bool,
    (of_values, of_slopes): (f64, f64),
) {
    for (k, &t) in times.iter().enumerate().filter(|(_, t)| !is_near_event(**t)) {
        let values = exact(t, theta);
        for (channel, value) in own.channels.iter().zip(&values) {
            assert!((channel[k] - value).abs() < of_values, "t = {t}: {} instead of {value}", channel[k]);
        }
        for j in 0..theta.len() {
            let step = 1e-6 * theta[j].abs();
            let moved = |sign: f64| {
                let mut moved = theta.to_vec();
                moved[j] += sign * step;
                exact(t, &moved)
            };
            for (c, (high, low)) in moved(1.0).iter().zip(moved(-1.0)).enumerate() {
                let slope = (high - low) / (2.0 * step);
                let found = own.gradient[c][j * times.len() + k];
                assert!((found - slope).abs() < of_slopes, "channel {c}, parameter {j}, t = {t}: {found}, not {slope}");
            }
        }
    }
}

const BALL: &str = r#"
study bouncing_ball "A ball on a hard floor"
gravity = 9.81 m/s^2 along -z
body ball { mass = 0.2 kg }
joint fall: prismatic(z) ground -> ball
law hard_floor(x: length, v: velocity) -> force {
  param restitution: ratio
  when x < 0 m { v := -restitution * v }
  = 0 N
}
force floor: hard_floor on fall { restitution = e }
measure z [m] = fall.position
measure v [m/s] = fall.velocity
experiment drop { data = "run.csv", start = rest { fall.position = h } }
identify {
  e in 0.5 .. 1 from 0.8
  h in 0.5 .. 2 m from 1 m
}
solver { tolerance = 1e-9 }
"#;

/// Instants of the bounces, then height and velocity.
fn ball(t: f64, theta: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (e, h, g) = (theta[0], theta[1], 9.81_f64);
    let (mut begin, mut height, mut velocity) = (0.0, h, 0.0);
    let mut bounces = vec![(2.0 * h / g).sqrt()];
    while t > bounces[bounces.len() - 1] {
        begin = bounces[bounces.len() - 1];
        height = 0.0;
        velocity = if bounces.len() == 1 { e * g * begin } else { e * velocity };
        bounces.push(begin + 2.0 * velocity / g);
    }
    let s = t - begin;
    (bounces, vec![height + velocity * s - g * s * s / 2.0, velocity - g * s])
}

#[test]
fn ball_bounces_at_the_exact_instants() {
    let (times, theta) = (grid(2.0, 57), [0.8, 1.0]);
    let (compiled, record) = prepared(BALL, &["z [m]", "v [m/s]"], &times, |_, t| t.sin());
    let own = run(&compiled, &record, &theta);
    let (bounces, _) = ball(2.0, &theta);
    assert_eq!(own.work.events.len(), bounces.len() - 1);
    for ((time, _), bounce) in own.work.events.iter().zip(&bounces) {
        assert!((time - bounce).abs() < 1e-9, "bounce at {time}, exact {bounce}");
    }
    let is_near = |t: f64| bounces.iter().any(|bounce| (t - bounce).abs() < 1e-4);
    compare(&own, &times, &theta, |t, theta| ball(t, theta).1, is_near, (1e-8, 1e-6));
}

#[test]
fn restitution_and_height_are_fitted_through_the_bounces() {
    let times = grid(1.5, 300);
    let truth = [0.72, 1.13];
    let (compiled, record) =
        prepared(BALL, &["z [m]", "v [m/s]"], &times, |i, t| ball(t, &truth).1[i] + 1e-4 * (1e3 * t + i as f64).sin());
    let fitted = fit(&compiled, &[&record], &Settings::default(), &mut |_| Control::Continue)
        .unwrap_or_else(|finding| panic!("{}", finding.message));
    for (value, truth) in fitted.theta.iter().zip(truth) {
        println!("{value} instead of {truth}");
        assert!((value / truth - 1.0).abs() < 1e-3);
    }
}

/// Two bodies on one guide that hit each other: momentum stays, the relative velocity turns.
#[test]
fn impulses_act_on_everything_that_is_coupled() {
    let text = r#"
study collision
body a { mass = 2 kg }
body b { mass = 3 kg }
joint guide_a: prismatic(x) ground -> a
joint guide_b: prismatic(x) a -> b
law buffer(x: length, v: velocity) -> force {
  param restitution: ratio, gap: length
  when x < -gap { v := -restitution * v }
  = 0 N
}
force hit: buffer on guide_b { restitution = e, gap = 0.2 m }
measure va [m/s] = guide_a.velocity
measure vb [m/s] = b.velocity.x
experiment run { data = "run.csv", start = rest { guide_a.velocity = 1 m/s, guide_b.velocity = -0.7 m/s } }
identify { e in 0 .. 1 from 0.6 }
"#;
    let times = grid(0.5, 30);
    let (compiled, record) = prepared(text, &["va [m/s]", "vb [m/s]"], &times, |i, t| (t + i as f64).sin());
    let own = run(&compiled, &record, &[0.6]);
    assert!((own.work.events[0].0 - 0.2 / 0.7).abs() < 1e-12);
    // Relative velocity -0.7 m/s becomes 0.42 m/s at the same momentum 2 * 1 + 3 * 0.3.
    let after = (2.9 - 3.0 * 0.42) / 5.0;
    assert!((own.channels[0][30] - after).abs() < 1e-12, "{}", own.channels[0][30]);
    assert!((own.channels[1][30] - (after + 0.42)).abs() < 1e-12);
    assert!((own.gradient[0][30] + 3.0 * 0.7 / 5.0).abs() < 1e-12);
}

const STICK_SLIP: &str = r#"
study stick_slip "A block on a moving belt, held by a spring"
body block { mass = 1.5 kg }
joint slide: prismatic(x) ground -> block
law belt_friction(v: velocity, applied: force) -> force {
  param belt: velocity, static: force, kinetic: force
  state sticks: ratio from 1
  when sticks > 0.5 and applied < -static { sticks := 0 }
  when sticks < 0.5 and v > belt { sticks := 1, v := belt }
  = if sticks > 0.5 then -applied else kinetic
}
force spring: spring on slide { stiffness = k }
force friction: belt_friction on slide { applied = spring.force, belt = 0.1 m/s, static = Fs, kinetic = Fk }
measure x [mm] = slide.position
measure F [N] = friction.force
experiment run { data = "run.csv", start = rest { slide.velocity = 0.1 m/s } }
identify {
  k in 50 .. 200 N/m from 100 N/m
  Fs in 5 .. 20 N from 8 N
  Fk in 1 .. 10 N from 5 N
}
solver { tolerance = 1e-9 }
"#;

/// Stick until the spring reaches Fs, slip along a harmonic until the belt is caught up with, and so on.
fn stick_slip(t: f64, theta: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (k, fs, fk, v, m) = (theta[0], theta[1], theta[2], 0.1, 1.5_f64);
    let w = (k / m).sqrt();
    let amplitude = (fs - fk) / k;
    let slip_time = 2.0 / w * (std::f64::consts::PI - (amplitude * w / v).atan());
    let (mut begin, mut x) = (0.0, 0.0);
    let mut instants = Vec::new();
    loop {
        let slips = begin + (fs / k - x) / v;
        if t <= slips {
            let x = x + v * (t - begin);
            return (instants, vec![x, k * x]);
        }
        instants.push(slips);
        if t <= slips + slip_time {
            let s = w * (t - slips);
            return (instants, vec![fk / k + amplitude * s.cos() + v / w * s.sin(), fk]);
        }
        begin = slips + slip_time;
        instants.push(begin);
        x = fk / k - amplitude;
    }
}

#[test]
fn block_on_a_belt_sticks_and_slips() {
    let (times, theta) = (grid(3.0, 91), [100.0, 8.0, 5.0]);
    let (compiled, record) = prepared(STICK_SLIP, &["x [mm]", "F [N]"], &times, |i, t| (t + i as f64).sin());
    let own = run(&compiled, &record, &theta);
    let (instants, _) = stick_slip(3.0, &theta);
    assert!(instants.len() >= 4);
    assert_eq!(own.work.events.len(), instants.len(), "{:?}", own.work.events);
    for ((time, _), exact) in own.work.events.iter().zip(&instants) {
        assert!((time - exact).abs() < 1e-8, "event at {time}, exact {exact}");
    }
    let is_near = |t: f64| instants.iter().any(|instant| (t - instant).abs() < 1e-4);
    compare(&own, &times, &theta, |t, theta| stick_slip(t, theta).1, is_near, (1e-7, 1e-5));
}

const SAMPLED: &str = r#"
study sampled_control "A first-order plant under a sampled PI controller"
law plant(drive: ratio) -> ratio {
  param decay: 1/time, gain: 1/time
  state z: ratio from 0 { z' = gain * drive - decay * z }
  = z
}
law sampled_pi(error: ratio) -> ratio {
  param period: time, proportional: ratio, integral: 1/time
  state sum: ratio from 0
  state output: ratio from 0
  every period { sum := sum + integral * period * error, output := proportional * error + sum }
  = output
}
signal y: plant { drive = u, decay = a, gain = 4 1/s }
signal u: sampled_pi { error = 1 - y, period = 50 ms, proportional = kp, integral = ki }
measure level = y
measure drive = u
experiment run { data = "run.csv", start = rest }
identify {
  a in 0.1 .. 10 1/s from 2 1/s
  kp in 0 .. 5 from 0.8
  ki in 0 .. 20 1/s from 3 1/s
}
solver { tolerance = 1e-10 }
"#;

/// The plant is exact between samples, the controller a recursion.
fn sampled(t: f64, theta: &[f64]) -> Vec<f64> {
    let (a, kp, ki, gain, period) = (theta[0], theta[1], theta[2], 4.0, 0.05);
    let (mut y, mut sum, mut k) = (0.0, 0.0, 0);
    loop {
        let error = 1.0 - y;
        let output = kp * error + sum;
        sum += ki * period * error;
        let s = (t - period * f64::from(k)).min(period);
        y = y * (-a * s).exp() + gain / a * (1.0 - (-a * s).exp()) * output;
        k += 1;
        if period * f64::from(k) >= t {
            return vec![y, output];
        }
    }
}

#[test]
fn sampled_controller_is_its_recursion() {
    // Not at the samples of the controller.
    let (times, theta): (Vec<f64>, _) = ((0..60).map(|k| 0.0333 * f64::from(k)).collect(), [2.0, 0.8, 3.0]);
    let (compiled, record) = prepared(SAMPLED, &["level", "drive"], &times, |i, t| (t + i as f64).sin());
    let own = run(&compiled, &record, &theta);
    let is_near = |t: f64| t == 0.0;
    compare(&own, &times, &theta, sampled, is_near, (1e-9, 1e-7));
    // At equilibrium the controller's states keep their start values: nothing balances them.
    let at_rest = SAMPLED.replace("start = rest", "start = equilibrium");
    let (compiled, record) = prepared(&at_rest, &["level", "drive"], &times, |i, t| (t + i as f64).sin());
    let again = run(&compiled, &record, &theta);
    assert_eq!(again.channels[1][5].to_bits(), own.channels[1][5].to_bits());
}

/// Where events move with the parameters, differences of whole runs certify the gradient.
#[test]
fn gradients_through_events_have_a_certificate() {
    let times = grid(1.5, 300);
    let (compiled, record) = prepared(BALL, &["z [m]", "v [m/s]"], &times, |_, t| t.sin());
    let digits = certify(&compiled, &[&record], &[0.8, 1.0]).unwrap_or_else(|f| panic!("{f}")).expect("parameters");
    println!("{digits:.1} digits");
    assert!(digits > 5.0, "{digits}");
}
