//! Tables as sums of harmonics, tracks over the travelled distance, sensors that are late or round.

use crate::evaluate::{close, study, value};
use ident::diagnostics::{Code, render};
use ident::simulation::{Compiled, Gradient, certify, excitation, simulate};
use ident::study::{Study, check, load, load_text};
use std::f64::consts::TAU;
use std::path::Path;

fn measure(study: &Study, name: &str, values: &[(&str, f64)]) -> f64 {
    let measure = study.measures.iter().find(|measure| measure.name == name).expect("the measure");
    value(study, measure.value, values)
}

#[test]
fn harmonics_are_sums_of_cosines() {
    let study = study(
        "study s\ntable runout(phi: angle) -> length { harmonics = ((1, 0.3 mm, 20 deg), (3, e, p), (7, -0.1 mm, 0)) }\n\
         table wave(s: length) -> length { harmonics = ((12 m, 2 mm, 90 deg), (500 mm, 1 mm, 0)) }\n\
         body b { mass = 1 kg }\njoint j: prismatic(x) ground -> b\n\
         measure r [m] = runout(j.position / (460 mm))\nmeasure w [m] = wave(j.position - 2.5 m)\n\
         measure slope [1] = derivative(wave(3 m/s * t)) / (3 m/s)\n\
         identify { e in 0 .. 1 mm from 0.2 mm, p in -1 .. 1 from 0.5 }",
    );
    for x in [0.0, 0.3, -7.0, 123.4] {
        let values = [("j.position", x), ("e", 4e-4), ("p", 0.7), ("t", x)];
        let phi: f64 = x / 0.46;
        let expected =
            3e-4 * (phi + 20f64.to_radians()).cos() + 4e-4 * (3.0 * phi + 0.7).cos() - 1e-4 * (7.0 * phi).cos();
        close(measure(&study, "r", &values), expected);
        let s = x - 2.5;
        let expected = -2e-3 * (TAU * s / 12.0).sin() + 1e-3 * (TAU * s / 0.5).cos();
        assert!((measure(&study, "w", &values) - expected).abs() < 1e-14);
        let s = 3.0 * x;
        let slope = -2e-3 * TAU / 12.0 * (TAU * s / 12.0).cos() - 1e-3 * TAU / 0.5 * (TAU * s / 0.5).sin();
        assert!((measure(&study, "slope", &values) - slope).abs() < 1e-13);
    }
}

fn random_track(seed: u32, level: f64) -> Vec<f64> {
    let study = study(&format!(
        "study s\nconstant level = {level} m\n\
         table track(s: length) -> length {{ spectrum = level / (wavenumber^2 + (0.5 1/m)^2), components = 80,\n\
           wavelengths = 1 m .. 100 m, seed = {seed} }}\n\
         body b {{ mass = 1 kg }}\njoint j: prismatic(x) ground -> b\nmeasure h [m] = track(j.position)"
    ));
    (0..600).map(|k| measure(&study, "h", &[("j.position", 1.7 * f64::from(k))])).collect()
}

/// The variance is the integral of level / (k^2 + k0^2): level / k0 (atan(k2 / k0) - atan(k1 / k0)).
#[test]
fn a_spectrum_gives_its_variance_and_is_the_same_each_time() {
    let track = random_track(3, 1e-6);
    let variance = track.iter().map(|h| h * h).sum::<f64>() / track.len() as f64;
    let expected = 1e-6 / 0.5 * ((TAU / 0.5).atan() - (TAU / 100.0 / 0.5).atan());
    assert!((variance / expected - 1.0).abs() < 0.1, "{variance} {expected}");
    assert_eq!(track, random_track(3, 1e-6));
    assert!(random_track(4, 1e-6).iter().zip(&track).any(|(a, b)| (a - b).abs() > 1e-4));
}

#[test]
fn faulty_harmonics_are_told() {
    let fields = |fields: &str, argument: &str| {
        let text = format!("study s\ntable h(s: {argument}) -> length {{ {fields} }}");
        let loaded = load_text("s", &text);
        let findings = check(&loaded, None).expect_err("a fault");
        (render(&findings, &loaded.sources, false), findings)
    };
    let spectrum = "wavelengths = 1 m .. 10 m, components = 5, seed = 1";
    for (text, argument, code, told) in [
        ("harmonics = ((1, 2 mm))", "angle", Code::TABLE_POINTS, "this one has 2 numbers"),
        ("harmonics = ((-1, 2 mm, 0))", "angle", Code::WRONG_VALUE, "must be positive"),
        ("harmonics = ((1, 2 mm, 0))", "length", Code::DIMENSION_MISMATCH, "m expected"),
        ("harmonics = ((1, 2 N, 0))", "angle", Code::DIMENSION_MISMATCH, "N"),
        (
            "harmonics = ((1, 2 mm, 0)), points = ((0, 1 mm), (1, 2 mm))",
            "angle",
            Code::TABLE_FORM,
            "points and harmonics",
        ),
        ("harmonics = ((1, 2 mm, 0)), seed = 1, spectrum = 1", "angle", Code::TABLE_FORM, "which of them"),
        ("harmonics = ((1, 2 mm, 0))", "coordinate^2", Code::DIMENSION_MISMATCH, ""),
        ("spectrum = 1 m^3", "length", Code::MISSING_FIELD, "wavelengths"),
        (
            "spectrum = 1 m^2, wavelengths = 1 m .. 10 m, components = 5, seed = 1",
            "length",
            Code::DIMENSION_MISMATCH,
            "m^3",
        ),
        ("spectrum = 1 m^3, wavelengths = 10 m .. 1 m, components = 5, seed = 1", "length", Code::BOUNDS, "shorter"),
        (
            "spectrum = 1 m^3, wavelengths = 1 m .. 9 m, components = 0, seed = 1",
            "length",
            Code::TABLE_POINTS,
            "0 harmonics",
        ),
        ("spectrum = 1 m^3, wavelengths = 1 m .. 9 m, components = 5, seed = 1.5", "length", Code::WRONG_VALUE, "seed"),
    ] {
        let (shown, findings) = fields(text, argument);
        assert!(findings.iter().any(|finding| finding.code == code), "{text}\n{shown}");
        assert!(shown.contains(told), "{text}\n{shown}");
    }
    let (shown, _) = fields(&format!("spectrum = -1 m^3, {spectrum}"), "length");
    assert!(shown.contains("not negative"), "{shown}");
}

fn rail() -> Compiled {
    let path = format!("{}/studies/rail_wheelset/rail_wheelset.ident", env!("CARGO_MANIFEST_DIR"));
    let loaded = load(Path::new(&path));
    let checked = check(&loaded, None).unwrap_or_else(|f| panic!("{}", render(&f, &loaded.sources, false)));
    Compiled::new(checked.study).unwrap_or_else(|f| panic!("{}", render(&f, &loaded.sources, false)))
}

/// At constant speed both wheels are bodies on springs over a track that is a function of time: the axle boxes'
/// accelerations of a run agree with a fixed-step integration of the same four equations; the rear one arrives late.
#[test]
fn wheels_on_an_uneven_track() {
    let compiled = rail();
    let theta: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    let record = excitation(&compiled.study, 0, 2e-3);
    let found = simulate(&compiled, &record, &theta, Gradient::None).unwrap_or_else(|failure| panic!("{failure}"));
    let signal = |name: &str| compiled.study.signals.iter().find(|signal| signal.name == name).expect("a signal").value;
    let (front, rear) = (signal("track_front"), signal("track_rear"));
    let speed = 120.0 / 3.6;
    let tread = |distance: f64, list: [(f64, f64, f64); 2]| -> f64 {
        list.iter().map(|(n, a, p)| a * (n * distance / 0.46 + p.to_radians()).cos()).sum()
    };
    let (graph, tracks) = compiled.study.graph.extract(&[front, rear]);
    let height = |t: f64| {
        let s = 1.0 + speed * t;
        let at = graph.evaluate(&tracks, |_| s, |_, _, _| f64::NAN);
        let treads = [tread(s, [(1.0, 1e-4, 0.0), (3.0, 3e-4, 40.0)]), tread(s, [(1.0, 2e-4, 90.0), (4.0, 5e-5, 0.0)])];
        [at[0] + treads[0], at[1] + treads[1]]
    };
    // Frame: heave and pitch, its ends at +-1.25 m; a turn about y by b moves the front end by -1.25 b.
    let (c, d, contact) = (theta[0], theta[1], 100e6);
    let rate = |h: [f64; 2], y: [f64; 8]| -> [f64; 8] {
        let [z, b, p, q, vz, vb, vp, vq] = y;
        let (front, rear) = (z - 1.25 * b.sin(), z + 1.25 * b.sin());
        let (front_rate, rear_rate) = (vz - 1.25 * b.cos() * vb, vz + 1.25 * b.cos() * vb);
        let lift = [c * (p - front) + d * (vp - front_rate), c * (q - rear) + d * (vq - rear_rate)];
        let wheel = |at: f64, h: f64, lift: f64| (contact * (h - at) - lift) / 900.0 - 9.81;
        let pitch = 1.25 * b.cos() * (lift[1] - lift[0]) / 2600.0;
        [vz, vb, vp, vq, (lift[0] + lift[1]) / 3000.0 - 9.81, pitch, wheel(p, h[0], lift[0]), wheel(q, h[1], lift[1])]
    };
    // Equilibrium at the begin of the run.
    let h0 = height(0.0);
    let (weight, axle) = (1500.0 * 9.81, 2400.0 * 9.81);
    let wheels = h0.map(|h| h - axle / contact);
    let ends = wheels.map(|wheel| wheel - weight / c);
    let mut y =
        [(ends[0] + ends[1]) / 2.0, ((ends[1] - ends[0]) / 2.5).asin(), wheels[0], wheels[1], 0.0, 0.0, 0.0, 0.0];
    let step = 2e-4;
    let moved = |y: [f64; 8], k: [f64; 8], h: f64| -> [f64; 8] { std::array::from_fn(|i| y[i] + h * k[i]) };
    let mut largest: f64 = 0.0;
    let mut after = height(0.0);
    for k in 0..6000 {
        let t = f64::from(k) * step;
        let heights = [after, height(t + step / 2.0), height(t + step)];
        after = heights[2];
        let a = rate(heights[0], y);
        if k % 10 == 0 {
            let sample = (k / 10) as usize;
            assert!((found.channels[0][sample] - a[6]).abs() < 2e-3, "{t}: {} {}", found.channels[0][sample], a[6]);
            // 2 ms late: one sample.
            let late = found.channels[1].get(sample + 1).copied().unwrap_or(a[7]);
            assert!((late - a[7]).abs() < 2e-3, "{t}: {late} {}", a[7]);
            largest = largest.max(a[6].abs());
        }
        let b = rate(heights[1], moved(y, a, step / 2.0));
        let c = rate(heights[1], moved(y, b, step / 2.0));
        let d = rate(heights[2], moved(y, c, step));
        y = std::array::from_fn(|i| y[i] + step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    assert!(largest > 2.0, "{largest}");
}

const OSCILLATOR: &str = "study s\nbody b { mass = 2 kg }\njoint j: prismatic(x) ground -> b\n\
    force f: spring_damper on j { stiffness = c, damping = 3 N*s/m }\nmeasure now [m] = j.position\n\
    measure late [m] = j.position { delay = 2 * T }\n\
    manoeuvre m { start = rest { j.velocity = 1 m/s }, for 2 s }\nsolver { tolerance = 1e-9 }\n\
    identify { c in 100 .. 400 N/m from 200 N/m, T in 0 .. 0.1 s from 0.0613 s }";

/// x = v / omega exp(-a t) sin(omega t): the late channel shows it exactly, with its derivatives.
#[test]
fn a_late_sensor_shows_the_past_with_its_gradient() {
    let compiled = Compiled::new(study(OSCILLATOR)).unwrap_or_else(|findings| panic!("{findings:?}"));
    let record = excitation(&compiled.study, 0, 0.01);
    let run =
        |theta: &[f64]| simulate(&compiled, &record, theta, Gradient::AllParameters).unwrap_or_else(|f| panic!("{f}"));
    let found = run(&[200.0, 0.0613]);
    let (decay, omega) = (0.75, (100.0f64 - 0.75 * 0.75).sqrt());
    let exact = |t: f64| if t < 0.0 { 0.0 } else { (-decay * t).exp() * (omega * t).sin() / omega };
    let rate = |t: f64| if t < 0.0 { 0.0 } else { (-decay * t).exp() * (omega * t).cos() - decay * exact(t) };
    let samples = found.channels[1].len();
    for k in 0..samples {
        let t = k as f64 * 0.01 - 2.0 * 0.0613;
        assert!((found.channels[1][k] - exact(t)).abs() < 1e-8, "{t}");
        let slope = found.gradient[1][samples + k];
        assert!((slope + 2.0 * rate(t)).abs() < 1e-6, "{t}: {slope} {}", -2.0 * rate(t));
        assert_eq!(found.gradient[0][samples + k], 0.0);
    }
    // The gradient by the stiffness is the undelayed one at the earlier instant.
    let (above, below) = (run(&[200.02, 0.0613]), run(&[199.98, 0.0613]));
    for k in 0..samples {
        let difference = (above.channels[1][k] - below.channels[1][k]) / 0.04;
        assert!((found.gradient[1][k] - difference).abs() < 1e-7, "{k}");
    }
    let digits = certify(&compiled, &[&record], &[200.0, 0.0613]).unwrap_or_else(|failure| panic!("{failure}"));
    assert!(digits.is_some_and(|digits| digits > 8.0), "{digits:?}");
}

#[test]
fn rounding_sensors_show_steps_and_count_as_noise() {
    let study = study(
        "study s\nbody b { mass = 2 kg }\njoint j: prismatic(x) ground -> b\n\
         measure fine [mm] = j.position { noise = 0.3 mm, quantisation = 1 mm }\n\
         measure coarse [mm] = j.position { quantisation = 5 mm }\nmeasure exact [mm] = j.position { noise = 1 mm }",
    );
    let [fine, coarse, exact] = study.measures.as_slice() else { panic!("three measures") };
    close(fine.noise.expect("noise"), (0.09f64 + 1.0 / 12.0).sqrt() * 1e-3);
    assert_eq!(coarse.noise, None);
    close(coarse.shown(0.0126), 0.015);
    close(coarse.shown(-0.0124), -0.010);
    close(exact.shown(0.012_345), 0.012_345);
    let faulty = |field: &str| {
        let text = format!(
            "study s\nbody b {{ mass = 2 kg }}\njoint j: prismatic(x) ground -> b\n\
            measure a [mm] = j.position {{ {field} }}"
        );
        check(&load_text("s", &text), None).expect_err("a fault")
    };
    assert!(faulty("delay = -1 ms").iter().any(|finding| finding.code == Code::WRONG_VALUE));
    assert!(faulty("delay = 1 mm").iter().any(|finding| finding.code == Code::DIMENSION_MISMATCH));
    assert!(faulty("quantisation = 0 mm").iter().any(|finding| finding.code == Code::WRONG_VALUE));
    assert!(faulty("quantisation = 1 s").iter().any(|finding| finding.code == Code::DIMENSION_MISMATCH));
}
