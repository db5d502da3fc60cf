//! Couplings of positions against equations of motion in the least coordinates, solved by hand.

use crate::run::{Channels, checked, run};
use ident::mechanics::derive;
use ident::simulation::{Compiled, Gradient, certify, prepare, simulate};
use ident::study::{check, load};

const BODIES: &str = "study coupled \"Coupled joints\"\n\
    gravity = 10 m/s^2 along -z\n\
    solver { tolerance = 1e-9 }\n";

fn one(text: &str) -> Channels {
    run(&format!("{BODIES}{text}"), &[]).swap_remove(0)
}

/// A channel is this function of time, sample by sample; `size` is what the tolerance refers to.
fn assert_follows(channels: &Channels, name: &str, size: f64, exact: impl Fn(f64) -> f64) {
    let (times, values) = (&channels["time"], &channels[name]);
    assert!(times.len() > 100);
    for (t, value) in times.iter().zip(values) {
        assert!((value - exact(*t)).abs() < 1e-6 * size, "{name} at {t} s: {value} instead of {}", exact(*t));
    }
}

/// Motor and wheel on a reduction of 4, a spring on the wheel: inertia and stiffness at the motor divided by the ratio
/// squared. The friction in the gears takes a share of the torque that they transmit.
#[test]
fn a_reduction_reflects_inertia_and_stiffness() {
    let (j_motor, j_wheel, torque, ratio, stiffness) = (2e-3, 0.08, 0.5, 4.0, 1.6);
    let channels = one(
        "body motor { mass = 1 kg, inertia = 0.002 kg*m^2 }\nbody wheel { mass = 5 kg, inertia = 0.08 kg*m^2 }\n\
        joint shaft: revolute(z) ground -> motor\njoint axle: revolute(z) ground -> wheel\n\
        coupling gears: shaft.position = 4 * axle.position\n\
        force drive: external_load on shaft { value = 0.5 N*m }\nforce holding: spring on axle { stiffness = 1.6 N*m/rad }\n\
        measure time [s] = t\nmeasure angle [rad] = shaft.position\nmeasure wheel_angle [rad] = axle.position\n\
        measure tooth [N*m] = gears.torque\nmeasure bearing [N*m] = axle.reaction.moment.z\n\
        manoeuvre turn { start = rest, step = 1 ms, for 0.5 s }\n",
    );
    let inertia = j_motor + j_wheel / ratio / ratio;
    let k: f64 = stiffness / ratio / ratio;
    let omega = (k / inertia).sqrt();
    let angle = |t: f64| torque / k * (1.0 - (omega * t).cos());
    let acceleration = |t: f64| torque / inertia * (omega * t).cos();
    assert_follows(&channels, "angle", 5.0, angle);
    assert_follows(&channels, "wheel_angle", 5.0, |t| angle(t) / ratio);
    // Multipliers are no part of what the error control looks at: about four digits here.
    assert_follows(&channels, "tooth", 200.0, |t| j_motor * acceleration(t) - torque);
    // Spring and gears together give the wheel its acceleration.
    assert_follows(&channels, "bearing", 200.0, |t| j_wheel * acceleration(t) / ratio);
}

/// Friction in proportion to what the gears transmit.
#[test]
fn laws_may_depend_on_what_a_coupling_transmits() {
    let channels =
        one("body motor { mass = 1 kg, inertia = 0.002 kg*m^2 }\nbody wheel { mass = 5 kg, inertia = 0.08 kg*m^2 }\n\
        law tooth_friction(transmitted: torque) -> torque { param share: ratio\n  = -share * abs(transmitted) }\n\
        joint shaft: revolute(z) ground -> motor\njoint axle: revolute(z) ground -> wheel\n\
        coupling gears: shaft.position = 4 * axle.position\n\
        force drive: external_load on shaft { value = 0.5 N*m }\n\
        force loss: tooth_friction on shaft { transmitted = gears.torque, share = 0.1 }\n\
        measure time [s] = t\nmeasure angle [rad] = shaft.position\n\
        manoeuvre turn { start = rest, step = 1 ms, for 0.2 s }\n");
    let acceleration = 0.5 / (0.002 + 1.1 * 0.08 / 16.0);
    assert_follows(&channels, "angle", 1.0, |t| 0.5 * acceleration * t * t);
}

/// Sun, ring and carrier with 24 and 60 teeth (Willis): two freedoms of three. By the multiplier of the one constraint.
#[test]
fn a_planetary_gear_obeys_willis() {
    let channels = one(
        "body sun { mass = 1 kg, inertia = 0.01 kg*m^2 }\nbody ring { mass = 1 kg, inertia = 0.05 kg*m^2 }\n\
        body carrier { mass = 1 kg, inertia = 0.03 kg*m^2 }\n\
        joint at_sun: revolute(z) ground -> sun\njoint at_ring: revolute(z) ground -> ring\n\
        joint at_carrier: revolute(z) ground -> carrier\n\
        coupling planets: 24 * at_sun.position + 60 * at_ring.position = 84 * at_carrier.position\n\
        force drive: external_load on at_sun { value = 2 N*m }\nforce brake: external_load on at_ring { value = -1 N*m }\n\
        measure time [s] = t\nmeasure sun_angle [rad] = at_sun.position\nmeasure ring_angle [rad] = at_ring.position\n\
        measure carrier_angle [rad] = at_carrier.position\nmeasure held [N*m] = planets.torque\n\
        manoeuvre turn { start = rest, step = 1 ms, for 0.2 s }\n",
    );
    let (inertias, loads, row) = ([0.01, 0.05, 0.03], [2.0, -1.0, 0.0], [24.0, 60.0, -84.0]);
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    let by_inertia = |a: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] / inertias[i]) };
    let multiplier = -dot(row, by_inertia(loads)) / dot(row, by_inertia(row));
    for (i, name) in ["sun_angle", "ring_angle", "carrier_angle"].into_iter().enumerate() {
        let acceleration = (loads[i] + row[i] * multiplier) / inertias[i];
        assert_follows(&channels, name, 1.0, |t| 0.5 * acceleration * t * t);
    }
    assert_follows(&channels, "held", 1.0, |_| multiplier);
}

/// A rack falls and turns its pinion; a rope over a turning pulley carries two weights (Atwood); a screw presses.
#[test]
fn racks_ropes_and_screws_carry_weights() {
    let channels = one("body rack { mass = 3 kg }\nbody pinion { mass = 1 kg, inertia = 0.004 kg*m^2 }\n\
        joint slide: prismatic(z) ground -> rack\njoint turn: revolute(y) ground -> pinion\n\
        coupling teeth: slide.position = 4 cm * turn.position\n\
        body light { mass = 2 kg }\nbody heavy { mass = 3 kg }\nbody pulley { mass = 1 kg, inertia = 0.002 kg*m^2 }\n\
        joint left: prismatic(z) ground -> light\njoint right: prismatic(z) ground -> heavy\n\
        joint bearing: revolute(y) ground -> pulley\n\
        coupling rope_left: left.position = 5 cm * bearing.position\n\
        coupling rope_right: right.position = -5 cm * bearing.position\n\
        body nut { mass = 4 kg }\nbody spindle { mass = 1 kg, inertia = 1e-4 kg*m^2 }\n\
        joint guide: prismatic(z) ground -> nut\njoint thread: revolute(z) ground -> spindle\n\
        coupling screw: guide.position = 5 mm / (2 * pi) * thread.position\n\
        measure time [s] = t\nmeasure z_rack [m] = slide.position\nmeasure tooth [N] = teeth.force\n\
        measure z_light [m] = left.position\nmeasure pull_left [N] = rope_left.force\nmeasure pull_right [N] = rope_right.force\n\
        measure z_nut [m] = guide.position\nmeasure thrust [N] = screw.force\n\
        manoeuvre fall { start = rest, step = 1 ms, for 0.3 s }\n");
    let g = 10.0;
    let rack = -3.0 * g / (3.0 + 0.004 / 0.04_f64.powi(2));
    assert_follows(&channels, "z_rack", 1.0, |t| 0.5 * rack * t * t);
    assert_follows(&channels, "tooth", 30.0, |_| 3.0 * (rack + g));
    let rope = (3.0 - 2.0) * g / (5.0 + 0.002 / 0.05_f64.powi(2));
    assert_follows(&channels, "z_light", 1.0, |t| 0.5 * rope * t * t);
    assert_follows(&channels, "pull_left", 30.0, |_| 2.0 * (g + rope));
    assert_follows(&channels, "pull_right", 30.0, |_| 3.0 * (g - rope));
    let lead = 0.005 / std::f64::consts::TAU;
    let nut = -4.0 * g / (4.0 + 1e-4 / lead / lead);
    assert_follows(&channels, "z_nut", 1e-2, |t| 0.5 * nut * t * t);
    assert_follows(&channels, "thrust", 40.0, |_| 4.0 * (nut + g));
}

/// A driven cam lifts a follower on a spring; its drive bears the torque, the joint transmitting it and the cam's share
/// together. A rope of given length over a fixed peg, by points.
#[test]
fn cams_and_ropes_are_relations_of_any_form() {
    let channels = one(
        "body ground { point peg = (0 m, 0 m, 2 m) }\nbody cam { mass = 1 kg, inertia = 0.01 kg*m^2 }\nbody follower { mass = 0.5 kg }\n\
        joint shaft: revolute(y) ground -> cam { motion = 20 rad/s * t }\njoint lift: prismatic(z) ground -> follower\n\
        coupling profile: lift.position = 10 mm * (1 - cos(shaft.position))\n\
        force closing: spring on lift { stiffness = 800 N/m }\n\
        body load { mass = 2 kg }\nbody trolley { mass = 1 kg }\n\
        joint hook: prismatic(z) ground -> load\njoint rail: prismatic(x) ground -> trolley\n\
        constant height = 2 m\n\
        coupling rope: load.position.z = sqrt(trolley.position.x^2 + height^2) - height\n\
        measure time [s] = t\nmeasure z [m] = lift.position\nmeasure contact [N] = profile.force\n\
        measure drive [N*m] = shaft.reaction.moment.y + profile.force * 10 mm * sin(shaft.position)\n\
        measure energy [J] = 0.5 * 2 kg * hook.velocity^2 + 0.5 * 1 kg * rail.velocity^2 + 2 kg * 10 m/s^2 * hook.position\n\
        measure apart [m] = hook.position - sqrt(rail.position^2 + height^2) + height\n\
        manoeuvre turn { start = rest { rail.velocity = 4 m/s, rail.position = 0.5 m }, step = 1 ms, for 1 s }\n",
    );
    let omega = 20.0_f64;
    let contact = |t: f64| {
        let (cosine, lift) = ((omega * t).cos(), 0.01 * (1.0 - (omega * t).cos()));
        0.5 * 0.01 * omega * omega * cosine + 800.0 * lift + 0.5 * 10.0
    };
    assert_follows(&channels, "z", 0.1, |t| 0.01 * (1.0 - (omega * t).cos()));
    assert_follows(&channels, "contact", 20.0, contact);
    assert_follows(&channels, "drive", 1.0, |t| contact(t) * 0.01 * (omega * t).sin());
    let energy = channels["energy"][0];
    assert_follows(&channels, "energy", 10.0 * energy, |_| energy);
    assert_follows(&channels, "apart", 1.0, |_| 0.0);
}

/// Couplings that say the same are told, those that contradict each other leave no motion; a start that does not fit is
/// moved.
#[test]
fn couplings_that_do_not_fit_are_named() {
    let shafts = "body a { mass = 1 kg, inertia = 1 kg*m^2 }\nbody b { mass = 1 kg, inertia = 1 kg*m^2 }\n\
        joint at_a: revolute(z) ground -> a\njoint at_b: revolute(z) ground -> b\n\
        coupling first: at_a.position = 2 * at_b.position\n";
    let derived = |more: &str| {
        let text = format!("{BODIES}{shafts}{more}manoeuvre turn {{ start = rest, for 1 s }}\n");
        derive(&checked(&text, &[]).unwrap_or_else(|findings| panic!("{findings}")))
    };
    let same = derived("coupling second: 4 * at_b.position = 2 * at_a.position\n").expect("a mechanism that moves");
    assert!(same.warnings.iter().any(|warning| warning.message.contains("`second`")), "{:?}", same.warnings);
    let other = derived("coupling second: at_b.position = 2 * at_a.position\n").expect_err("nothing moves");
    assert!(other[0].message.contains("`first`, `second`"), "{other:?}");
    let moved = Compiled::new(
        checked(&format!("{BODIES}{shafts}measure x [rad] = at_b.position\nmanoeuvre turn {{ start = rest {{ at_a.position = 1 rad }}, for 1 s }}\n"), &[])
            .unwrap_or_else(|findings| panic!("{findings}")),
    );
    assert!(moved.is_ok());
}

/// The ratio of a gear and the radius of a pinion identified: the angle's slopes by them are those of the closed form,
/// and the gradient that of the discrete solution.
#[test]
fn ratios_have_exact_gradients() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows: Vec<String> = (0..=200).map(|k| format!("{},{k}\n", f64::from(k) * 2.5e-3)).collect();
    std::fs::write(folder.path().join("run.csv"), format!("t [s],angle [rad]\n{}", rows.concat())).expect("written");
    let text = "study geared \"Ratio identified\"\n\
        body motor { mass = 1 kg, inertia = 0.002 kg*m^2 }\nbody wheel { mass = 5 kg, inertia = 0.08 kg*m^2 }\nbody rack { mass = 2 kg }\n\
        joint shaft: revolute(z) ground -> motor\njoint axle: revolute(z) ground -> wheel\njoint slide: prismatic(x) ground -> rack\n\
        coupling gears: shaft.position = ratio * axle.position\ncoupling teeth: slide.position = radius * axle.position\n\
        force drive: external_load on shaft { value = 0.5 N*m }\nforce holding: spring on axle { stiffness = 1.6 N*m/rad }\n\
        measure angle [rad] = shaft.position\n\
        identify { ratio in 2 .. 8 from 4\n radius in 20 .. 200 mm from 100 mm }\n\
        solver { tolerance = 1e-8 }\n\
        experiment run { data = \"run.csv\", start = rest }\n";
    let path = folder.path().join("study.ident");
    std::fs::write(&path, text).expect("written");
    let study = check(&load(&path), None).unwrap_or_else(|findings| panic!("{findings:?}")).study;
    let (records, findings) = prepare(&study, folder.path(), &[]);
    assert!(findings.is_empty(), "{findings:?}");
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let theta = [4.0, 0.1];
    let run = simulate(&compiled, &records[0], &theta, Gradient::AllParameters).expect("a run");
    let angle = |t: f64, [ratio, radius]: [f64; 2]| {
        let inertia = 0.002 + (0.08 + 2.0 * radius * radius) / ratio / ratio;
        let stiffness = 1.6 / ratio / ratio;
        0.5 / stiffness * (1.0 - ((stiffness / inertia).sqrt() * t).cos())
    };
    let samples = run.channels[0].len();
    for k in 0..samples {
        let t = k as f64 * 2.5e-3;
        assert!((run.channels[0][k] - angle(t, theta)).abs() < 1e-5);
        for j in 0..2 {
            let step = 1e-5 * theta[j];
            let moved = |sign: f64| std::array::from_fn(|i| if i == j { theta[i] + sign * step } else { theta[i] });
            let slope = (angle(t, moved(1.0)) - angle(t, moved(-1.0))) / (2.0 * step);
            let found = run.gradient[0][j * samples + k];
            assert!((found - slope).abs() < 1e-4 * (1.0 + slope.abs()), "{found} instead of {slope} at {t} s");
        }
    }
    let digits = certify(&compiled, &[&records[0]], &theta).expect("a run").expect("parameters");
    println!("coupled: {digits:.1} digits");
    assert!(digits > 8.0, "{digits} digits");
}
