//! Closed loops, what is redundant in them, and what keeps them from moving.

use super::*;
use crate::run::drift;

#[test]
fn spatial_four_bar_with_balls() {
    let text = format!(
        "body ground {{ point far = (0.5 m, 0.3 m, 0 m), point above = (0 m, 0 m, 1 m) }}
         body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }}
         body coupler {{ mass = 2 kg, inertia = (0.01, 0.05, 0.05 kg*m^2), centre_of_gravity = (0.3 m, 0 m, 0.02 m), point tip = (0.6 m, 0 m, 0 m) }}
         body rocker {{ mass = 1.5 kg, inertia = 0.02 kg*m^2, point tip = (0 m, 0 m, 0.4 m) }}
         joint motor: revolute(z) ground -> crank
         joint near: spherical crank.tip -> coupler
         joint foot: revolute(y) ground.far -> rocker
         joint head: spherical coupler.tip -> rocker.tip
         law linear(x: length, v: velocity) -> force {{ = -500 N/m * x - 20 N*s/m * v }}
         force strut: linear ground.above -> coupler.tip {{ free_length = 0.5 m }}
         {GO} {{ motor.velocity = 5 rad/s, near.angular_velocity.x = 8 rad/s }} }}\n"
    );
    prove("rssr", &text, 1e-8);
}

#[test]
fn slider_crank_on_universal_and_cylindrical_joints() {
    let text = format!(
        "body ground {{ point guide = (0.5 m, 0 m, 0.05 m) }}
         body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0 m, 0.1 m, 0 m) }}
         body rod {{ mass = 2 kg, inertia = (0.01, 0.05, 0.05 kg*m^2), centre_of_gravity = (0.25 m, 0 m, 0 m), point tip = (0.5 m, 0 m, 0 m) }}
         body slider {{ mass = 1.5 kg, inertia = 0.02 kg*m^2 }}
         joint motor: revolute(z) ground -> crank
         joint near: spherical crank.tip -> rod
         joint far: universal(y, z) rod.tip -> slider
         joint guide: cylindrical(x) ground.guide -> slider
         {GO} {{ motor.velocity = 10 rad/s }} }}\n"
    );
    prove("slider_crank", &text, 1e-8);
    let own =
        Mechanism::run(&format!("study s\ngravity = 9.81 m/s^2 along -z\n{text}measure angle = motor.position\n"));
    for k in 0..own.samples() {
        let angle = own.channels["angle"][k];
        let expected = -0.1 * angle.sin() + (0.25 - (0.1 * angle.cos()).powi(2) - 0.0025_f64).sqrt();
        assert!((own.channels["slider_position_x"][k] - expected).abs() < 1e-8);
    }
}

/// Three bodies on four hinges that are not parallel: by the count of freedoms it could not move.
fn bennett() -> String {
    let (alpha, beta) = (30.0_f64.to_radians(), (0.8 * 0.5_f64).asin());
    let axis = |angle: f64| format!("0, {}, {}", -angle.sin(), angle.cos());
    format!(
        "body ground {{ point far = (-0.8 m, 0 m, 0 m) }}
         body l1 {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (1 m, 0 m, 0 m) }}
         body l2 {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.8 m, 0 m, 0 m) }}
         body l3 {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (1 m, 0 m, 0 m) }}
         joint A: revolute(z) ground -> l1
         joint B: revolute({}) l1.tip -> l2 {{ orientation = (30 deg, 0 deg, 0 deg) }}
         joint C: revolute({}) l2.tip -> l3 {{ orientation = ({} deg, 0 deg, 0 deg) }}
         joint D: revolute({}) l3.tip -> ground.far {{ orientation = ({} deg, 0 deg, 0 deg) }}\n",
        axis(alpha),
        axis(beta),
        beta.to_degrees(),
        axis(alpha),
        (alpha + beta).to_degrees()
    )
}

#[test]
fn bennett_linkage_moves_and_names_what_is_redundant() {
    prove("bennett", &format!("{}{GO} {{ A.position = 1, A.velocity = 3 rad/s }} }}\n", bennett()), 1e-6);
    // Half angles of neighbouring hinges have a constant product of tangents.
    let text = format!(
        "study b\n{}measure a = A.position\nmeasure b = B.position\n{GO} {{ A.position = 1, A.velocity = 3 rad/s }} }}\ncriterion c = max(t / 1 s) in go\nsolver {{ tolerance = 1e-9 }}\n",
        bennett()
    );
    let own = &run(&text, &[])[0];
    let (alpha, beta) = (30.0_f64.to_radians(), (0.8 * 0.5_f64).asin());
    let constant = ((beta + alpha) / 2.0).sin() / ((beta - alpha) / 2.0).sin();
    for (a, b) in own["a"].iter().zip(&own["b"]) {
        let product = (a / 2.0).tan() * (b / 2.0).tan();
        assert!((product - constant).abs() < 1e-5 * constant.abs(), "{product} instead of {constant}");
    }
    let study = checked(&text, &[]).expect("a study");
    let warnings = ident::mechanics::derive(&study).expect("it moves").warnings;
    let [warning] = warnings.as_slice() else { panic!("one joint is redundant: {warnings:?}") };
    assert!(warning.message.contains("`D`") && warning.message.matches("about").count() >= 1, "{}", warning.message);
    // Five constraints of one hinge, three freedoms of the others, one is left: two are independent.
    assert_eq!(
        warning.message.split(':').nth(1).map(|held| held.split(" about ").count() + held.split(" along ").count() - 2),
        Some(3)
    );
}

/// Driven or let go it turns all round, although no two constraints of its closing hinge are independent everywhere.
/// Half angles of neighbouring hinges have a constant product of tangents, opposite hinges the opposite angle.
#[test]
fn bennett_linkage_turns_all_round() {
    let (alpha, beta) = (30.0_f64.to_radians(), (0.8 * 0.5_f64).asin());
    let constant = ((beta + alpha) / 2.0).sin() / ((beta - alpha) / 2.0).sin();
    let driven = bennett().replace("ground -> l1", "ground -> l1 { motion = 3 rad/s * t + 1 rad }");
    for (mechanism, start) in [(driven, ""), (bennett(), "{ A.position = 1, A.velocity = 6 rad/s }")] {
        let text = format!(
            "study b\n{mechanism}measure a = A.position\nmeasure b = B.position\nmeasure c = C.position
             measure energy = {ENERGY}\nmanoeuvre go {{ for 3 s, start = rest {start}, step = 10 ms }}
             criterion c = max(t / 1 s) in go\nsolver {{ tolerance = 1e-10 }}\n",
        );
        let own = &run(&text, &[])[0];
        assert!(own["a"].last().expect("samples") - own["a"][0] > 8.0, "all round and further");
        for ((a, b), c) in own["a"].iter().zip(&own["b"]).zip(&own["c"]) {
            // Multiplied by the cosines: no pole.
            let [(sa, ca), (sb, cb)] = [a, b].map(|angle| (angle / 2.0).sin_cos());
            assert!((sa * sb - constant * ca * cb).abs() < 1e-7 * constant.abs(), "at {a}, {b}");
            assert!((a + c).abs() < 1e-7, "{a} and {c}");
        }
        if !start.is_empty() {
            assert!(drift(&own["energy"]) < 1e-7 * own["energy"][0], "drift {}", drift(&own["energy"]));
        }
    }
}

/// Of the three moving links of Bennett's linkage.
const ENERGY: &str = "0.5 * ((l1.centre_of_gravity.velocity.x^2 + l1.centre_of_gravity.velocity.y^2 + l1.centre_of_gravity.velocity.z^2 \
    + l2.centre_of_gravity.velocity.x^2 + l2.centre_of_gravity.velocity.y^2 + l2.centre_of_gravity.velocity.z^2 \
    + l3.centre_of_gravity.velocity.x^2 + l3.centre_of_gravity.velocity.y^2 + l3.centre_of_gravity.velocity.z^2) / (1 m/s)^2 \
    + 0.01 * (l1.angular_velocity.x^2 + l1.angular_velocity.y^2 + l1.angular_velocity.z^2 \
    + l2.angular_velocity.x^2 + l2.angular_velocity.y^2 + l2.angular_velocity.z^2 \
    + l3.angular_velocity.x^2 + l3.angular_velocity.y^2 + l3.angular_velocity.z^2) / (1 rad/s)^2)";

/// Bricard's orthogonal six-bar with threefold symmetry: alternate hinges move alike, and neighbours such that
/// `cos a cos b + cos a + cos b = 0`.
#[test]
fn bricard_linkage_turns_all_round() {
    let hinge = |at: usize, from: &str, to: &str| {
        let (axis, angle) = if at % 2 == 1 { ("0, -1, 0", 90) } else { ("0, 1, 0", -90) };
        format!("joint j[{at}]: revolute({axis}) {from} -> {to} {{ orientation = ({angle} deg, 0 deg, 0 deg) }}\n")
    };
    let hinges: String = (1..5).map(|at| hinge(at, &format!("l[{at}].tip"), &format!("l[{}]", at + 1))).collect();
    let text = format!(
        "study b\nbody ground {{ point far = (-0.1 m, 0 m, 0 m) }}
         for i in 1 .. 5 {{ body l[i] {{ mass = 1 kg, inertia = 0.001 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }} }}
         joint j[0]: revolute(z) ground -> l[1]\n{hinges}joint j[5]: revolute(0, -1, 0) l[5].tip -> ground.far
         for i in 0 .. 4 {{ measure q[i] = j[i].position }}
         manoeuvre go {{ for 3 s, step = 10 ms, start = rest {{ j[0].position = 1.8 rad, j[1].position = 1.27 rad, j[2].position = 1.8 rad, j[0].velocity = 3 rad/s }} }}
         criterion c = max(t / 1 s) in go\nsolver {{ tolerance = 1e-10 }}\n"
    );
    let own = &run(&text, &[])[0];
    let reached = own["q[0]"].iter().fold((0.0_f64, 0.0_f64), |(low, high), q| (low.min(*q), high.max(*q)));
    assert!(reached.0 < -2.0 && reached.1 > 2.0, "both ends are passed: {reached:?}");
    let angles: Vec<&Vec<f64>> = (0..5).map(|i| &own[format!("q[{i}]").as_str()]).collect();
    for k in 0..angles[0].len() {
        let q: Vec<f64> = angles.iter().map(|values| values[k]).collect();
        let (a, b) = (q[0].cos(), q[1].cos());
        assert!((a * b + a + b).abs() < 1e-7, "{q:?}");
        assert!((q[0] - q[2]).abs() < 1e-6 && (q[1] - q[3]).abs() < 1e-6 && (q[0] - q[4]).abs() < 1e-6, "{q:?}");
    }
}

/// An upright on five rods, carried by a free joint.
pub fn suspension(centre_of_gravity: &str) -> String {
    let length = 0.408_533_964_316_309_95;
    format!(
        "body ground {{ point a1 = (0.15 m, 0.3 m, 0.2 m), point a2 = (-0.15 m, 0.3 m, 0.2 m), point b1 = (0.15 m, 0.3 m, 0.45 m), point b2 = (-0.15 m, 0.3 m, 0.45 m), point tie = (0.15 m, 0.32 m, 0.25 m), point top = (0 m, 0.4 m, 0.8 m), point home = (0 m, 0.7 m, 0.3 m) }}
         body upright {{ mass = 20 kg, inertia = (0.5, 0.6, 0.5 kg*m^2), centre_of_gravity = {centre_of_gravity}, point low = (0 m, -0.02 m, -0.1 m), point up = (0 m, -0.02 m, 0.15 m), point tie = (0.15 m, -0.05 m, -0.05 m) }}
         joint float: free ground.home -> upright
         joint r1: distance ground.a1 -> upright.low {{ length = {length} m }}
         joint r2: distance ground.a2 -> upright.low {{ length = {length} m }}
         joint r3: distance ground.b1 -> upright.up {{ length = {length} m }}
         joint r4: distance ground.b2 -> upright.up {{ length = {length} m }}
         joint r5: distance ground.tie -> upright.tie {{ length = 0.33 m }}
         law linear(x: length, v: velocity) -> force {{ = -20 kN/m * x - 1 kN*s/m * v }}
         force strut: linear ground.top -> upright.low {{ free_length = 0.7 m }}\n"
    )
}

#[test]
fn double_wishbone_on_rods() {
    prove("wishbone", &format!("{}{GO} }}\n", suspension("(0 m, 0 m, 0 m)")), 1e-8);
}

/// A planar four-bar in space whose hinge is driven: four hinges hold three directions twice.
#[test]
fn driven_four_bar_names_its_redundant_hinge() {
    let text = format!(
        "body ground {{ point far = (0.5 m, 0 m, 0 m) }}
         body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }}
         body coupler {{ mass = 2 kg, inertia = 0.03 kg*m^2, centre_of_gravity = (0.2 m, 0.01 m, 0 m), point tip = (0.42 m, 0 m, 0 m) }}
         body rocker {{ mass = 1.5 kg, inertia = 0.02 kg*m^2, point tip = (0.3 m, 0 m, 0 m) }}
         joint motor: revolute(z) ground -> crank {{ motion = 3 rad/s * t + 0.1 * sin(20 rad/s * t) }}
         joint pin: revolute(z) crank.tip -> coupler
         joint foot: revolute(z) ground.far -> rocker
         joint head: revolute(z) coupler.tip -> rocker.tip
         {GO} {{ pin.position = 0.8, foot.position = 2 }} }}\n"
    );
    prove("four_bar", &text, 1e-8);
    let study = checked(&format!("study f\n{text}"), &[]).expect("a study");
    let warnings = ident::mechanics::derive(&study).expect("it moves").warnings;
    let [warning] = warnings.as_slice() else { panic!("one joint is redundant: {warnings:?}") };
    assert_eq!(
        warning.message,
        "joint `head` holds what the rest of its loop holds already: shifting along z, turning about x, turning about y"
    );
    assert!(
        warning.help.iter().any(|help| help.contains("axes(shift z, turn x, turn y, turn z)")),
        "{:?}",
        warning.help
    );
}

/// A mechanism without equilibrium says so, with what has nothing to hold it; one that cannot move as well.
#[test]
fn no_equilibrium_and_no_freedom_are_said() {
    let text = "study falling\ngravity = 9.81 m/s^2 along -z
        body load { mass = 2 kg }\nbody guide { mass = 1 kg }
        joint rail: prismatic(x) ground -> guide\njoint lift: prismatic(z) guide -> load
        force spring_x: spring on rail { stiffness = 1 kN/m }
        measure z [m] = lift.position\nmanoeuvre go { for 1 s, start = equilibrium }\ncriterion c = max(lift.position) in go\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let compiled = ident::simulation::Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let record = ident::simulation::manoeuvre(&compiled.study, 0);
    let failure = ident::simulation::simulate(&compiled, &record, &[], ident::simulation::Gradient::None)
        .expect_err("nothing holds the load");
    let told = format!("{failure} {}", failure.help);
    assert!(told.contains("no equilibrium"), "{told}");
    assert!(told.contains("rate of `lift.velocity` (on which act gravity)"), "{told}");

    let text = "study truss\nbody ground { point far = (1 m, 0 m, 0 m) }
        body a { mass = 1 kg, inertia = 0.1 kg*m^2, point tip = (0.6 m, 0 m, 0 m) }
        body b { mass = 1 kg, inertia = 0.1 kg*m^2, point tip = (0.7 m, 0 m, 0 m) }
        joint left: revolute(y) ground -> a\njoint right: revolute(y) ground.far -> b\njoint top: revolute(y) a.tip -> b.tip
        measure angle = left.position\nmanoeuvre go { for 1 s, start = rest { left.position = -0.7, right.position = -2.5 } }
        criterion c = max(left.position) in go\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let findings = ident::mechanics::derive(&study).expect_err("two bars on two hinges");
    assert!(findings[0].message.contains("cannot move") && findings[0].message.contains("top"), "{findings:?}");
}
