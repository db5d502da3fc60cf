//! Linkages and gears of textbooks against the relations that their inventors wanted, and where they could branch.

use crate::run::{Channels, checked, run};
use ident::mechanics::derive;
use ident::simulation::{Compiled, cautions, manoeuvre, probe};
use std::f64::consts::PI;

fn one(text: &str) -> Channels {
    run(text, &[]).swap_remove(0)
}

fn compiled(text: &str) -> Compiled {
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"))
}

#[track_caller]
fn assert_near(channel: &[f64], accuracy: f64, expected: impl Fn(usize) -> f64) {
    assert!(channel.len() > 50);
    for (k, value) in channel.iter().enumerate() {
        let expected = expected(k);
        assert!((value - expected).abs() < accuracy, "sample {k}: {value} instead of {expected}");
    }
}

/// Peaucellier's inversor draws a straight line: the product of the distances of its two ends from the pivot is that of
/// the links' squares. More is stated than its one freedom: the first of it is kept, the rest says which way it stands.
#[test]
fn peaucellier_draws_a_straight_line() {
    let short =
        |name: &str| format!("body {name} {{ mass = 1 kg, inertia = 0.1 kg*m^2, point tip = (1.2 m, 0 m, 0 m) }}\n");
    let long =
        |name: &str| format!("body {name} {{ mass = 1 kg, inertia = 0.4 kg*m^2, point tip = (3.5 m, 0 m, 0 m) }}\n");
    let links: String = ["s1", "s2", "s3", "s4"].map(short).into_iter().chain(["l1", "l2"].map(long)).collect();
    let own = one(&format!(
        "study inversor\ngravity = 9.81 m/s^2 along -y\nsolver {{ tolerance = 1e-9 }}\n{links}
         body ground {{ point centre = (1.5 m, 0 m, 0 m) }}
         body crank {{ mass = 1 kg, inertia = 0.1 kg*m^2, point tip = (1.5 m, 0 m, 0 m) }}
         joint motor: revolute(z) ground.centre -> crank
         joint o1: revolute(z) ground -> l1\njoint o2: revolute(z) ground -> l2
         joint a1: revolute(z) crank.tip -> s1\njoint a2: revolute(z) crank.tip -> s2
         joint b1: revolute(z) s1.tip -> l1.tip\njoint b2: revolute(z) s2.tip -> l2.tip
         joint p1: revolute(z) l1.tip -> s3\njoint p2: revolute(z) l2.tip -> s4
         joint p: revolute(z) s3.tip -> s4.tip
         measure angle [rad] = motor.position\nmeasure x [m] = s3.tip.position.x\nmeasure y [m] = s3.tip.position.y
         measure left [rad] = o1.position
         manoeuvre go {{ for 0.5 s, step = 5 ms, start = rest {{ motor.position = 0.2 rad, motor.velocity = 1 rad/s
           o1.position = 24 deg, o2.position = -15 deg, p1.position = -90 deg }} }}
         criterion c = max(x) in go\n"
    ));
    let power = 3.5_f64.powi(2) - 1.2_f64.powi(2);
    assert!((own["angle"][0] - 0.2).abs() < 1e-9, "the first stated position is kept: {}", own["angle"][0]);
    // Mirrored, the links would stand at about 25 and -14 degrees the other way round.
    assert!((own["left"][0] - 24_f64.to_radians()).abs() < 0.05, "{}", own["left"][0]);
    assert_near(&own["x"], 1e-7, |_| power / 3.0);
    // The crank's end is seen from the pivot under half its angle.
    assert_near(&own["y"], 1e-7, |k| power / 3.0 * (own["angle"][k] / 2.0).tan());
    assert!(crate::run::drift(&own["y"]) > 0.05);
}

/// Two Hooke joints between parallel shafts: of constant ratio where the yokes of the shaft between lie in one plane;
/// else its irregularity twice.
#[test]
fn double_hooke_joint_depends_on_its_phase() {
    let bend = 20.0_f64.to_radians();
    let (sine, cosine) = bend.sin_cos();
    let shafts = |axes: &str| {
        one(&format!(
            "study hooke\nsolver {{ tolerance = 1e-9 }}
             body ground {{ point far = ({} m, {} m, 0 m) }}
             body input {{ mass = 1 kg, inertia = 0.01 kg*m^2, point end = (0.2 m, 0 m, 0 m) }}
             body shaft {{ mass = 1 kg, inertia = 0.01 kg*m^2, point end = (0.3 m, 0 m, 0 m) }}
             body output {{ mass = 1 kg, inertia = 0.02 kg*m^2 }}
             joint motor: revolute(x) ground -> input {{ motion = 5 rad/s * t }}
             joint first: universal(y, z) input.end -> shaft {{ orientation = (0 deg, 0 deg, 20 deg) }}
             joint second: universal({axes}) shaft.end -> output {{ orientation = (0 deg, 0 deg, -20 deg) }}
             joint bearing: axes(shift x, turn x) output -> ground.far
             measure angle [rad] = motor.position
             measure between [rad/s] = shaft.angular_velocity.x * {cosine} + shaft.angular_velocity.y * {sine}
             measure speed [rad/s] = output.angular_velocity.x
             manoeuvre go {{ for 2 s, step = 10 ms, start = rest }}\ncriterion c = max(t / 1 s) in go\n",
            0.2 + 0.3 * cosine,
            0.3 * sine
        ))
    };
    let aligned = shafts(&format!("z, ({sine}, {cosine}, 0)"));
    let ratio = |angle: f64| cosine / (1.0 - (sine * angle.cos()).powi(2));
    assert_near(&aligned["between"], 1e-7, |k| 5.0 * ratio(aligned["angle"][k]));
    assert_near(&aligned["speed"], 1e-9, |_| 5.0);
    let crossed = shafts("y, z");
    let [least, most] = [f64::min, f64::max].map(|pick| crossed["speed"].iter().copied().fold(5.0, pick));
    assert!(
        (least - 5.0 * cosine * cosine).abs() < 1e-2 && (most - 5.0 / cosine / cosine).abs() < 1e-2,
        "{least} {most}"
    );
}

/// A plate on six driven legs: every leg has the length that its drive prescribes.
#[test]
fn six_legs_carry_a_plate() {
    let at = |radius: f64, degrees: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        [radius * cosine, radius * sine]
    };
    let (feet, heads) = ([-10.0, 10.0, 110.0, 130.0, 230.0, 250.0], [-50.0, 50.0, 70.0, 170.0, 190.0, 290.0]);
    let height = 1.2;
    let (mut legs, mut ground, mut plate, mut drawn) = (String::new(), String::new(), String::new(), Vec::new());
    for i in 0..6 {
        let ([x, y], [u, v]) = (at(1.0, feet[i]), at(0.6, heads[i]));
        let leg = nalgebra::Vector3::new(u - x, v - y, height);
        let length = leg.norm();
        let along = leg / length;
        let across = along.cross(&nalgebra::Vector3::z()).normalize();
        let third = along.cross(&across);
        let axis = |a: nalgebra::Vector3<f64>| format!("({}, {}, {})", a.x, a.y, a.z);
        ground += &format!("point f{i} = ({x} m, {y} m, 0 m)\n");
        plate += &format!("point h{i} = ({u} m, {v} m, 0 m)\n");
        legs += &format!(
            "body low{i} {{ mass = 2 kg, inertia = 0.05 kg*m^2 }}
             body rod{i} {{ mass = 1 kg, inertia = 0.03 kg*m^2, point top = ({} m, {} m, {} m) }}
             joint foot{i}: universal({}, {}) ground.f{i} -> low{i}
             joint leg{i}: prismatic{} low{i} -> rod{i} {{ motion = {} m * sin({} rad/s * t) }}
             joint head{i}: spherical rod{i}.top -> plate.h{i}\n",
            leg.x,
            leg.y,
            leg.z,
            axis(across),
            axis(third),
            axis(along),
            0.02 * (i + 1) as f64,
            2.0 + 0.5 * i as f64
        );
        for axis in ["x", "y", "z"] {
            legs += &format!("measure h{i}_{axis} [m] = plate.h{i}.position.{axis}\n");
        }
        drawn.push((x, y, length));
    }
    let own = one(&format!(
        "study hexapod\ngravity = 9.81 m/s^2 along -z\nsolver {{ tolerance = 1e-9 }}\nbody ground {{\n{ground}}}
         body plate {{ mass = 20 kg, inertia = (1.2, 1.3, 2 kg*m^2), centre_of_gravity = (0.02 m, 0.01 m, 0.05 m)\n{plate}}}
         {legs}measure time [s] = t\nmanoeuvre go {{ for 1 s, step = 10 ms, start = rest }}\ncriterion c = max(t / 1 s) in go\n"
    ));
    for (i, (x, y, length)) in drawn.into_iter().enumerate() {
        let reach = |k: usize| {
            let head = |axis: &str| own[&format!("h{i}_{axis}")][k];
            ((head("x") - x).powi(2) + (head("y") - y).powi(2) + head("z").powi(2)).sqrt()
        };
        let reached: Vec<f64> = (0..own["time"].len()).map(reach).collect();
        assert_near(&reached, 1e-8, |k| {
            length + 0.02 * (i + 1) as f64 * ((2.0 + 0.5 * i as f64) * own["time"][k]).sin()
        });
    }
}

/// A rotor of prescribed spin in two gimbals, its mass off the pivot: Lagrange's equations of the two angles, by Runge
/// and Kutta, and the torque that holds the spin.
#[test]
fn a_gyroscope_in_gimbals_precesses_and_nods() {
    let own = one("study gimbals\ngravity = 9.81 m/s^2 along -z\nsolver { tolerance = 1e-10 }
         body outer { mass = 1 kg, inertia = (0.01, 0.01, 0.02 kg*m^2) }
         body inner { mass = 1 kg, inertia = (0.005, 0.008, 0.006 kg*m^2) }
         body rotor { mass = 2 kg, inertia = (0.02, 0.012, 0.012 kg*m^2), centre_of_gravity = (0.1 m, 0 m, 0 m) }
         joint yaw: revolute(z) ground -> outer\njoint pitch: revolute(y) outer -> inner
         joint spin: revolute(x) inner -> rotor { motion = 100 rad/s * t }
         measure yaw_angle [rad] = yaw.position\nmeasure pitch_angle [rad] = pitch.position
         measure drive [N*m] = spin.reaction.moment.x * inner.axis_x.x + spin.reaction.moment.y * inner.axis_x.y + spin.reaction.moment.z * inner.axis_x.z
         manoeuvre go { for 2 s, step = 4 ms, start = rest { pitch.position = 0.3 rad } }\ncriterion c = max(t / 1 s) in go\n");
    let (spin, polar, across) = (100.0, 0.02, 0.012 + 2.0 * 0.1 * 0.1);
    let rates = |[_, pitch, yaw_rate, pitch_rate]: [f64; 4]| {
        let (sine, cosine) = pitch.sin_cos();
        let about_yaw = 0.02 + (0.005 + polar) * sine * sine + (0.006 + across) * cosine * cosine;
        let slope = 2.0 * sine * cosine * (0.005 + polar - 0.006 - across);
        let yaw = (polar * spin * cosine * pitch_rate - slope * pitch_rate * yaw_rate) / about_yaw;
        let weight = 2.0 * 9.81 * 0.1 * cosine;
        let nod = (0.5 * slope * yaw_rate * yaw_rate - polar * spin * cosine * yaw_rate + weight) / (0.008 + across);
        [yaw_rate, pitch_rate, yaw, nod]
    };
    let (mut state, parts) = ([0.0, 0.3, 0.0, 0.0], 40);
    let h = 4e-3 / f64::from(parts);
    for (k, shown) in own["yaw_angle"].iter().enumerate() {
        let [yaw, pitch, yaw_rate, pitch_rate] = state;
        assert!((shown - yaw).abs() < 1e-8 && (own["pitch_angle"][k] - pitch).abs() < 1e-8, "sample {k}");
        let torque = -polar * (pitch.cos() * pitch_rate * yaw_rate + pitch.sin() * rates(state)[2]);
        assert!((own["drive"][k] - torque).abs() < 1e-7, "sample {k}: {} instead of {torque}", own["drive"][k]);
        for _ in 0..parts {
            let moved = |by: [f64; 4], share: f64| std::array::from_fn(|i| state[i] + share * h * by[i]);
            let k1 = rates(state);
            let k2 = rates(moved(k1, 0.5));
            let k3 = rates(moved(k2, 0.5));
            let k4 = rates(moved(k3, 1.0));
            state = std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
    }
}

fn parallelogram(more: &str, start: &str) -> String {
    format!(
        "study branching\ngravity = 9.81 m/s^2 along -y\nsolver {{ tolerance = 1e-8 }}
         body ground {{ point far = (0.5 m, 0 m, 0 m) }}
         body c1 {{ mass = 1 kg, inertia = 0.01 kg*m^2, centre_of_gravity = (0.05 m, 0 m, 0 m), point tip = (0.1 m, 0 m, 0 m) }}
         body c2 {{ mass = 1 kg, inertia = 0.01 kg*m^2, centre_of_gravity = (0.05 m, 0 m, 0 m), point tip = (0.1 m, 0 m, 0 m) }}
         body rod {{ mass = 1 kg, inertia = 0.05 kg*m^2, centre_of_gravity = (0.25 m, 0 m, 0 m), point tip = (0.5 m, 0 m, 0 m) }}
         joint crank_1: revolute(z) ground -> c1\njoint crank_2: revolute(z) ground.far -> c2
         joint a: revolute(z) c1.tip -> rod\njoint b: revolute(z) rod.tip -> c2.tip\n{more}
         measure angle_1 [rad] = crank_1.position\nmeasure angle_2 [rad] = crank_2.position
         manoeuvre go {{ for 1 s, step = 2 ms, start = rest {{ {start} }} }}\ncriterion c = max(t / 1 s) in go\n"
    )
}

const TURNING: &str = "crank_1.position = 1 rad, crank_1.velocity = 20 rad/s";

/// Every passage of the flat position is found at its instant; nothing is said of a loop that a coupling decides.
#[test]
fn a_parallelogram_branches_where_it_is_flat() {
    let free = compiled(&parallelogram("", TURNING));
    let mut record = manoeuvre(&free.study, 0);
    record.measures = vec![0, 1];
    let trajectory = probe(&free, &record, &[]).expect("a run");
    let angle = &trajectory.channels[0];
    let mut passages = Vec::new();
    for (k, pair) in angle.windows(2).enumerate() {
        if (pair[0] / PI).floor() != (pair[1] / PI).floor() {
            let share = ((pair[1] / PI).floor() * PI - pair[0]) / (pair[1] - pair[0]);
            passages.push(2e-3 * (k as f64 + share));
        }
    }
    let found: Vec<f64> = trajectory.branchings.iter().map(|branching| branching.time).collect();
    assert!(passages.len() >= 6 && found.len() == passages.len(), "{found:?} instead of {passages:?}");
    for (found, passage) in found.iter().zip(&passages) {
        assert!((found - passage).abs() < 2e-4, "{found} instead of {passage}");
    }
    let told = cautions(&free, &record, &[]);
    assert!(told.len() == 1 && told[0].message.contains("`b`") && told[0].message.contains("6 times more"), "{told:?}");

    let held = compiled(&parallelogram("coupling same: crank_1.position = crank_2.position", TURNING));
    assert!(cautions(&held, &manoeuvre(&held.study, 0), &[]).is_empty());
}

/// A coupling that decides in the flat position is not called redundant, and needs no other start values than one
/// crank's, flat or not.
#[test]
fn a_coupling_leads_a_parallelogram_through_its_flat_position() {
    let same = "coupling same: crank_1.position = crank_2.position";
    for start in [TURNING, "crank_1.velocity = 20 rad/s"] {
        let text = parallelogram(same, start);
        let warnings = derive(&checked(&text, &[]).expect("a study")).expect("it moves").warnings;
        assert!(warnings.iter().all(|warning| !warning.message.contains("`same`")), "{warnings:?}");
        let own = one(&text);
        let (first, second) = (&own["angle_1"], &own["angle_2"]);
        assert!(first.iter().zip(second).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(first.last().expect("samples") - first[0] > 10.0);
        // Both cranks and the rod, which shifts only, as one pendulum.
        let inertia = 2.0 * (0.01 + 0.05 * 0.05) + 0.1 * 0.1;
        let weight = 9.81 * (2.0 * 0.05 + 0.1);
        let energy = |angle: f64, rate: f64| 0.5 * inertia * rate * rate + weight * angle.sin();
        let all = energy(first[0], 20.0);
        // By the mean rate over two samples: the energy to the order of the step squared.
        for k in 1..first.len() - 1 {
            let rate = (first[k + 1] - first[k - 1]) / 4e-3;
            assert!((energy(first[k], rate) - all).abs() < 1e-3 * all, "sample {k}");
        }
    }
    let flat = compiled(&parallelogram("", "crank_1.velocity = 20 rad/s"));
    let failure = probe(&flat, &manoeuvre(&flat.study, 0), &[]).expect_err("two ways");
    assert!(failure.help.contains("two ways") && failure.help.contains("coupling"), "{failure} {}", failure.help);
}

/// A shift, a turn and a shift, drawn so that both shifts coincide: the joint is named as the cause.
#[test]
fn joints_with_motions_that_fall_together_are_named() {
    let lost = compiled(
        "study lost\ngravity = 9.81 m/s^2 along -y\nbody a { mass = 1 kg, inertia = 0.1 kg*m^2 }
         joint slide: axes(shift x, turn z, shift x) ground -> a\nmeasure x [m] = slide.shift_x.position
         manoeuvre go { for 1 s, start = rest }\ncriterion c = max(x) in go\n",
    );
    let failure = probe(&lost, &manoeuvre(&lost.study, 0), &[]).expect_err("nothing holds one of the shifts");
    assert!(failure.help.contains("joint `slide` are not independent"), "{}", failure.help);
}

/// A rod whose tube axis runs through its ball spins about itself only: the crank cannot move, and a start that says it
/// does is told.
#[test]
fn a_start_speed_that_the_loops_do_not_allow_is_told() {
    let locked = compiled(
        "study locked\ngravity = 9.81 m/s^2 along -z\nbody ground { point far = (0.4 m, 0.1 m, 0.05 m) }
         body crank { mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }
         body rod { mass = 1 kg, inertia = (0.002, 0.02, 0.02 kg*m^2) }
         body rocker { mass = 2 kg, inertia = 0.03 kg*m^2, point tip = (0 m, 0 m, 0.2 m) }
         joint motor: revolute(z) ground -> crank\njoint ball: spherical crank.tip -> rod
         joint foot: revolute(0.2, 1, 0.1) ground.far -> rocker\njoint tube: cylindrical(1, 0.1, 0.3) rod -> rocker.tip
         measure angle [rad] = motor.position
         manoeuvre go { for 0.2 s, step = 2 ms, start = rest { motor.velocity = 10 rad/s } }\ncriterion c = max(angle) in go\n",
    );
    let told = cautions(&locked, &manoeuvre(&locked.study, 0), &[]);
    let [warning] = told.as_slice() else { panic!("one warning: {told:?}") };
    assert!(
        warning.message.ends_with("`motor.velocity` starts at 0.0000 rad/s instead of 10.0000 rad/s"),
        "{warning:?}"
    );
}

/// A guide that cannot turn is not closed with its axes exchanged, where its angles vanish just as well.
#[test]
fn a_guide_does_not_close_with_its_axes_exchanged() {
    let text = "study guided\nbody a { mass = 1 kg, inertia = 0.1 kg*m^2 }
         joint float: free ground -> a\njoint guide: prismatic(z) ground -> a\nmeasure x = a.axis_x.x
         manoeuvre go { for 1 s, start = rest { float.quaternion.w = 0.49, float.quaternion.x = 0.5, \
         float.quaternion.y = 0.51, float.quaternion.z = 0.5 } }\n";
    for start in ["w = 0.49", "w = 0.9", "w = -0.52"] {
        assert_near(&one(&text.replace("w = 0.49", start))["x"], 1e-9, |_| 1.0);
    }
}

/// The cure for a redundant joint that slides as well keeps its own slide beside what is let go.
#[test]
fn the_cure_of_a_redundant_joint_keeps_its_freedom() {
    let text = "study slot\nbody ground { point pin = (0.4 m, 0 m, 0.3 m) }
         body crank { mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }
         body lever { mass = 1 kg, inertia = 0.05 kg*m^2 }
         joint motor: revolute(y) ground -> crank\njoint hinge: revolute(y) ground.pin -> lever
         joint slot: axes(shift x, turn y) lever -> crank.tip\nmeasure angle = motor.position
         manoeuvre go { for 1 s, start = rest { motor.position = 0.5 rad } }\ncriterion c = max(angle) in go\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let warnings = derive(&study).expect("it moves").warnings;
    let cure = |warning: &ident::diagnostics::Diagnostic| {
        warning.help.iter().find(|help| help.contains("`joint slot")).cloned()
    };
    let cures: Vec<String> = warnings.iter().filter_map(cure).collect();
    let [cure] = cures.as_slice() else { panic!("one cure: {warnings:?}") };
    assert!(cure.contains("axes(shift x, shift y, turn x, turn y, turn z)"), "{cure}");
    let cured = text.replace("axes(shift x, turn y)", "axes(shift x, shift y, turn x, turn y, turn z)");
    let study = checked(&cured, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let left = derive(&study).expect("it moves").warnings;
    assert!(left.iter().all(|warning| !warning.message.contains("already")), "{left:?}");
}
