//! Every law of the prelude against its formula written by hand; laws with states against a fixed-step integration in
//! this file, along a prescribed motion.

use crate::evaluate::{close, study, value};
use ident::simulation::{Compiled, Gradient, excitation, simulate};
use ident::study::{Study, load_text};
use ident::syntax::ItemKind;
use std::f64::consts::TAU;

/// The load of a law on a slide and on a hinge at some elongation and rate; they must agree.
fn load(law: &str, fields: &str, x: f64, v: f64) -> f64 {
    let fields =
        |units: [(&str, &str); 2]| units.iter().fold(fields.to_owned(), |text, (from, to)| text.replace(from, to));
    let at = |text: &str, joint: &str| {
        let study = study(text);
        let force = study.forces.iter().find(|force| force.name == "f").expect("the force");
        value(&study, force.load, &[(&format!("{joint}.position"), x), (&format!("{joint}.velocity"), v), ("t", 0.4)])
    };
    let slide = format!(
        "study s\nbody b {{ mass = 2 kg }}\njoint slide: prismatic(x) ground -> b\nforce f: {law} on slide {{ {} }}",
        fields([("LOAD", "N"), ("LENGTH", "m")])
    );
    let hinge = format!(
        "study s\nbody b {{ mass = 2 kg, inertia = 1 kg*m^2 }}\njoint hinge: revolute(x) ground -> b\n\
         force f: {law} on hinge {{ {} }}",
        fields([("LOAD", "N*m"), ("LENGTH", "rad")])
    );
    let translational = at(&slide, "slide");
    if fields([("LOAD", ""), ("LENGTH", "")]) != fields([("", ""), ("", "")]) {
        close(at(&hinge, "hinge"), translational);
    }
    translational
}

const PLACES: [(f64, f64); 9] = [
    (0.0, 0.0),
    (0.013, 0.2),
    (-0.013, 0.2),
    (0.021, -0.4),
    (-0.021, -1.3),
    (0.004, 0.0005),
    (-0.1, -0.0007),
    (0.3, 2.0),
    (0.0, -3.0),
];

fn compare(law: &str, fields: &str, by_hand: impl Fn(f64, f64) -> f64) {
    for (x, v) in PLACES {
        let (found, expected) = (load(law, fields, x, v), by_hand(x, v));
        let size = expected.abs().max(1e-9);
        assert!((found - expected).abs() < 1e-11 * size, "{law} at {x}, {v}: {found} instead of {expected}");
    }
}

#[test]
fn springs_and_dampers() {
    compare("spring", "stiffness = 3000 LOAD/LENGTH", |x, _| -3000.0 * x);
    compare("damper", "damping = 40 LOAD*s/LENGTH", |_, v| -40.0 * v);
    compare("spring_damper", "stiffness = 3000 LOAD/LENGTH, damping = 40 LOAD*s/LENGTH", |x, v| -3000.0 * x - 40.0 * v);
    compare("cubic_spring", "stiffness = 3000 LOAD/LENGTH, cubic = 7e5 LOAD/LENGTH^3", |x, _| {
        -3000.0 * x - 7e5 * x * x * x
    });
    compare("quadratic_drag", "factor = 7 LOAD*s^2/LENGTH^2", |_, v| if v > 0.0 { -7.0 * v * v } else { 7.0 * v * v });
    compare("external_load", "value = 20 LOAD * t / (1 s)", |_, _| 8.0);
    let saturating = "compression = { slope = 1100 LOAD*s/LENGTH, knee = 0.15 LENGTH/s, ratio = 0.3 }
        rebound = { slope = 2300 LOAD*s/LENGTH, knee = 0.2 LENGTH/s, ratio = 0.25 }";
    compare("saturating_damper", saturating, |_, v| {
        let (slope, knee, ratio) = if v < 0.0 { (1100.0, 0.15, 0.3) } else { (2300.0, 0.2, 0.25) };
        let speed = v.abs();
        let size = slope * ratio * speed + slope * (1.0 - ratio) * speed / (1.0 + speed * speed / knee / knee).sqrt();
        if v < 0.0 { size } else { -size }
    });
}

/// Half a cubic metre of water per metre and second: rho/2 c A v^2 = 500 * 0.4 * 0.5 v^2.
#[test]
fn drag_in_a_stream() {
    let fields = "drag_coefficient = 0.4, area = 0.5 m^2, density = 1000 kg/m^3, wind = 0.5 m/s";
    compare("aerodynamic_drag", fields, |_, v| {
        let against = v - 0.5;
        if against > 0.0 { -100.0 * against * against } else { 100.0 * against * against }
    });
    // A car of 0.7 m^2 drag area at 40 m/s in air of 1.225 kg/m^3: 686 N.
    close(load("aerodynamic_drag", "drag_coefficient = 0.35, area = 2 m^2", 0.0, 40.0), -686.0);
}

/// tanh by exponentials.
fn smooth_sign(ratio: f64) -> f64 {
    if ratio.abs() > 300.0 { ratio.signum() } else { 1.0 - 2.0 / ((2.0 * ratio).exp() + 1.0) }
}

#[test]
fn friction() {
    compare("coulomb_glide", "friction = 0.3, normal = 1000 LOAD, creep = 1e-3 LENGTH/s", |_, v| {
        -300.0 * smooth_sign(v / 1e-3)
    });
    compare("dry_friction", "friction = 200 LOAD, creep = 0.01 LENGTH/s", |_, v| -200.0 * smooth_sign(v / 0.01));
    let fields = "sliding = 200 LOAD, breakaway = 300 LOAD, decay = 0.01 LENGTH/s, creep = 0.001 LENGTH/s";
    compare("stribeck_friction", fields, |_, v| {
        let curve = 200.0 + 100.0 / (v / 0.01).powi(2).exp();
        -curve * smooth_sign(v / 0.001)
    });
    // The published shape: beyond some creep speeds the load falls from nearly breakaway to sliding.
    assert!(load("stribeck_friction", fields, 0.0, 0.003) < -270.0);
    close(load("stribeck_friction", fields, 0.0, 1.0), -200.0);
}

#[test]
fn stops_and_play() {
    let fields = "lower = -0.01 LENGTH, upper = 0.015 LENGTH, stiffness = 5e5 LOAD/LENGTH, damping = 2 s/LENGTH";
    compare("end_stop", fields, |x, v| {
        if x > 0.015 {
            -5e5 * (x - 0.015) * (1.0 + 2.0 * v).max(0.0)
        } else if x < -0.01 {
            5e5 * (-0.01 - x) * (1.0 - 2.0 * v).max(0.0)
        } else {
            0.0
        }
    });
    compare("end_stop", "lower = -0.01 LENGTH, upper = 0.015 LENGTH, stiffness = 5e5 LOAD/LENGTH", |x, _| {
        if x > 0.015 {
            -5e5 * (x - 0.015)
        } else if x < -0.01 {
            -5e5 * (x + 0.01)
        } else {
            0.0
        }
    });
    compare("backlash", "stiffness = 1e5 LOAD/LENGTH, gap = 0.01 LENGTH", |x, _| {
        if x > 0.005 {
            -1e5 * (x - 0.005)
        } else if x < -0.005 {
            -1e5 * (x + 0.005)
        } else {
            0.0
        }
    });
    compare("gas_spring", "preload = 500 LOAD, column = 0.2 LENGTH, exponent = 1.4", |x, _| {
        500.0 * (0.2 / (0.2 + x)).powf(1.4)
    });
    // Isothermal: half the column, twice the load.
    close(load("gas_spring", "preload = 500 LOAD, column = 0.2 LENGTH, exponent = 1", -0.1, 0.0), 1000.0);
}

const AMPLITUDE: f64 = 0.02;
const OMEGA: f64 = 3.0;
const DURATION: f64 = 4.0;
const STEP: f64 = 0.05;

fn prescribed(law: &str, fields: &str) -> Study {
    let text = format!(
        "study s\nbody b {{ mass = 1 kg }}\njoint j: prismatic(x) ground -> b {{ motion = 20 mm * sin(3 rad/s * t) }}\n\
         force f: {law} on j {{ {fields} }}\nmeasure F [N] = f.force\nmanoeuvre m {{ start = rest, for 4 s }}\n\
         solver {{ tolerance = 1e-10 }}"
    );
    study(&text)
}

/// The law's load along the motion, from the tool.
fn history(law: &str, fields: &str) -> Vec<f64> {
    let study = prescribed(law, fields);
    let record = excitation(&study, 0, STEP);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure}")).channels.remove(0)
}

/// The same from states integrated by the classical Runge-Kutta method: `rate(x, v, z)`, `load(x, v, z)`.
fn by_hand(z0: f64, rate: impl Fn(f64, f64, f64) -> f64, load: impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
    let at = |t: f64| (AMPLITUDE * (OMEGA * t).sin(), AMPLITUDE * OMEGA * (OMEGA * t).cos());
    let steps = 4000;
    let h = STEP / f64::from(steps);
    let mut z = z0;
    let mut loads = Vec::new();
    for k in 0..=(DURATION / STEP).round() as i32 {
        let (x, v) = at(f64::from(k) * STEP);
        loads.push(load(x, v, z));
        for inner in 0..steps {
            let t = f64::from(k) * STEP + f64::from(inner) * h;
            let slope = |t: f64, z: f64| {
                let (x, v) = at(t);
                rate(x, v, z)
            };
            let a = slope(t, z);
            let b = slope(t + h / 2.0, z + h / 2.0 * a);
            let c = slope(t + h / 2.0, z + h / 2.0 * b);
            let d = slope(t + h, z + h * c);
            z += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
    }
    loads
}

fn agree(law: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(0.0f64, |size, value| size.max(value.abs()));
    assert!(size > 10.0, "{law}: loads of {size} N show nothing");
    for (k, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() < 1e-6 * size, "{law} at {} s: {a} instead of {b}", k as f64 * STEP);
    }
}

#[test]
fn hysteresis_and_bristles_along_a_motion() {
    let fields = "bristle_stiffness = 1e5 N/m, bristle_damping = 300 N*s/m, viscous = 400 N*s/m,
        sliding = 200 N, breakaway = 300 N, decay = 10 mm/s";
    let limit = |v: f64| 200.0 + 100.0 / (v / 0.01).powi(2).exp();
    let rate = |_: f64, v: f64, z: f64| v - 1e5 * v.abs() / limit(v) * z;
    let lugre = by_hand(0.0, rate, |x, v, z| -(1e5 * z + 300.0 * rate(x, v, z) + 400.0 * v));
    agree("lugre_friction", &history("lugre_friction", fields), &lugre);

    // Canudas de Wit's steady state: g(v) sign(v) + viscous part; at the fastest point the bristles have settled.
    let steady = limit(0.06) + 400.0 * 0.06;
    assert!((lugre[0] + 300.0 * 0.06 + 400.0 * 0.06).abs() < 1e-9);
    let fastest = (TAU / OMEGA / STEP).round() as usize;
    assert!((lugre[fastest] + steady).abs() < 0.02 * steady, "{} {steady}", lugre[fastest]);

    let fields = "stiffness = 1e4 N/m, hysteresis = 300 N, width = 3 mm, sharpness = 2.5";
    let rate =
        |_: f64, v: f64, z: f64| (v - 0.5 * v.abs() * z * z.abs().powf(1.5) - 0.5 * v * z.abs().powf(2.5)) / 0.003;
    agree("bouc_wen", &history("bouc_wen", fields), &by_hand(0.0, rate, |x, _, z| -1e4 * x - 300.0 * z));

    let rate = |_: f64, v: f64, z: f64| (v - v.abs() * z) / 0.002;
    let dahl = by_hand(0.0, rate, |_, _, z| -300.0 * z);
    agree("dahl_friction", &history("dahl_friction", "friction = 300 N, width = 2 mm"), &dahl);
    // Dahl's solution on the first way out: 1 - exp(-x / width).
    close(dahl[4], -300.0 * (1.0 - (-AMPLITUDE * (OMEGA * 0.2).sin() / 0.002).exp()));
}

/// A branch k, d in series under A sin(w t) carries, once settled, k A (w T)/(1 + (w T)^2) (w T sin + cos), T = d/k.
#[test]
fn branches_with_dampers_settle_to_their_complex_stiffness() {
    let (k, d) = (1e4, 4e3);
    let product = OMEGA * d / k;
    let settled = |t: f64| {
        let decay = (-t * k / d).exp();
        let gain = k * AMPLITUDE * product / (1.0 + product * product);
        gain * (product * (OMEGA * t).sin() + (OMEGA * t).cos() - decay)
    };
    let times: Vec<f64> = (0..=80).map(|k| f64::from(k) * STEP).collect();
    let branch: Vec<f64> = times.iter().map(|t| -settled(*t)).collect();
    agree("maxwell", &history("maxwell", "stiffness = 10 kN/m, damping = 4 kN*s/m"), &branch);
    let both: Vec<f64> = times.iter().map(|t| -settled(*t) - 3e3 * AMPLITUDE * (OMEGA * t).sin()).collect();
    let fields = "static_stiffness = 3 kN/m, stiffness = 10 kN/m, damping = 4 kN*s/m";
    agree("relaxing_spring", &history("relaxing_spring", fields), &both);
}

/// A trace of 1e-20 decays over an intermediate: b = a_0 (exp(-t) - exp(-2 t)). By its unit the error of a ratio is
/// measured by 1e-4 near zero, and the trace would pass for nothing.
#[test]
fn states_far_from_their_unit_state_their_nominal_size() {
    let errors = ["", " nominal 1e-20"].map(|nominal| {
        let study = study(&format!(
            "study s\nlaw decay() -> ratio {{\n\
             state a: ratio from 1e-20{nominal} {{ a' = -1 1/s * a }}\n\
             state b: ratio from 0{nominal} {{ b' = 1 1/s * a - 2 1/s * b }}\n = b }}\n\
             signal trace: decay {{}}\nmeasure b [1] = trace\nmanoeuvre m {{ start = rest, for 4 s }}\n\
             solver {{ tolerance = 1e-8 }}"
        ));
        let record = excitation(&study, 0, STEP);
        let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
        let run = simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure}"));
        let exact = |k: usize| (-(k as f64) * STEP).exp() - (-2.0 * k as f64 * STEP).exp();
        let deviations = run.channels[0].iter().enumerate().map(|(k, b)| (1e20 * b - exact(k)).abs());
        deviations.fold(0.0, f64::max)
    });
    assert!(errors[1] < 1e-7, "{errors:?}");
    assert!(errors[0] > 1e-4, "the size makes no difference: {errors:?}");
}

/// The sharpness can be identified: its derivative is finite where the state passes zero.
#[test]
fn the_sharpness_of_a_hysteresis_has_a_gradient() {
    let text = "study s\nbody b { mass = 1 kg }\n\
        joint j: prismatic(x) ground -> b { motion = 20 mm * sin(3 rad/s * t) }\n\
        force f: bouc_wen on j { stiffness = 1 kN/m, hysteresis = 300 N, width = 3 mm, sharpness = n }\n\
        measure F [N] = f.force\nmanoeuvre m { start = rest, for 4 s }\nsolver { tolerance = 1e-9 }\n\
        identify { n in 1 .. 10 from 2 }";
    let study = study(text);
    let record = excitation(&study, 0, STEP);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let at = |n: f64| simulate(&compiled, &record, &[n], Gradient::AllParameters).unwrap_or_else(|f| panic!("{f}"));
    let (middle, above, below) = (at(2.0), at(2.001), at(1.999));
    let largest = middle.gradient[0].iter().fold(0.0f64, |size, slope| size.max(slope.abs()));
    for (k, slope) in middle.gradient[0].iter().enumerate() {
        let difference = (above.channels[0][k] - below.channels[0][k]) / 0.002;
        assert!((slope - difference).abs() < 1e-3 * largest, "{k}: {slope} {difference}");
    }
}

/// A part about an axis: the same laws for torsion, on a hinge and between bodies.
#[test]
fn a_torsion_spring_swings_with_its_frequency() {
    let study = study(
        "study s\nbody b { mass = 1 kg, inertia = 0.5 kg*m^2 }\njoint h: revolute(z) ground -> b\n\
         force f: spring ground -> b about z { stiffness = 8 N*m/rad }\nmeasure a [rad] = h.position\n\
         manoeuvre m { start = rest { h.velocity = 0.4 rad/s }, for 3 s }\nsolver { tolerance = 1e-10 }",
    );
    let record = excitation(&study, 0, STEP);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let angles = simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|f| panic!("{f}")).channels.remove(0);
    for (k, angle) in angles.iter().enumerate() {
        assert!((angle - 0.1 * (4.0 * k as f64 * STEP).sin()).abs() < 1e-7, "{k}: {angle}");
    }
}

/// Between two shafts that turn on and on: the twist is that of the two flywheels against each other, not cut at half a
/// turn.
#[test]
fn a_torsion_spring_between_turning_shafts_sees_the_twist_alone() {
    let study = study(
        "study s\nbody a { mass = 1 kg, inertia = 0.5 kg*m^2 }\nbody b { mass = 1 kg, inertia = 0.5 kg*m^2 }\n\
         joint p: revolute(z) ground -> a\njoint q: revolute(-z) ground -> b\n\
         force f: spring a -> b about z { stiffness = 8 N*m/rad }\nmeasure twist [rad] = f.elongation\n\
         manoeuvre m { start = rest { p.velocity = 10.2 rad/s, q.velocity = -9.8 rad/s }, for 3 s }\n\
         solver { tolerance = 1e-10 }",
    );
    let record = excitation(&study, 0, STEP);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let twist = simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|f| panic!("{f}")).channels.remove(0);
    let frequency = 32_f64.sqrt();
    for (k, twist) in twist.iter().enumerate() {
        let expected = -0.4 / frequency * (frequency * k as f64 * STEP).sin();
        assert!((twist - expected).abs() < 1e-7, "{k}: {twist} {expected}");
    }
}

/// Every law says where it comes from, and its source is in the bibliography.
#[test]
fn laws_have_sources() {
    let bibliography = include_str!("../../README.md");
    let loaded = load_text("empty", "study s");
    let mut count = 0;
    for (tree, _) in loaded.trees().filter(|(_, is_prelude)| *is_prelude) {
        for item in &tree.items {
            let name = match &item.kind {
                ItemKind::Law(law) => &law.name.text,
                ItemKind::Effect(effect) if item.documentation.contains("Source:") => &effect.name.text,
                _ => continue,
            };
            let about = item.documentation.replace('\n', " ");
            let Some((_, rest)) = about.split_once("Source: ") else { panic!("`{name}` has no source") };
            let key = rest.split(|c: char| !(c.is_alphanumeric() || c == '-')).next().unwrap_or_default();
            assert!(bibliography.contains(&format!("| {key} |")), "`{name}`: `{key}` is not in the bibliography");
            count += 1;
        }
    }
    assert!(count > 20, "{count}");
}
