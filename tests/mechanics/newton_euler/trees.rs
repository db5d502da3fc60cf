//! Trees of every kind of joint, free and driven.

use super::*;

#[test]
fn trees_of_every_kind_of_joint() {
    let body = |name: &str| {
        format!(
            "body {name} {{ mass = 1.5 kg, inertia = (0.3, 0.4, 0.5, 0.02, -0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, -0.2 m, 0.15 m), point tip = (0.3 m, 0.1 m, -0.2 m) }}\n"
        )
    };
    let joints = [
        (
            "universal(x, z)",
            "{ orientation = (20 deg, 30 deg, -50 deg) }",
            "turn_x.velocity = 2 rad/s, j.turn_z.velocity = -1 rad/s",
        ),
        (
            "cylindrical(0, 0.6, 0.8)",
            "{ orientation = (10 deg, -40 deg, 5 deg) }",
            "turn_2.velocity = 3 rad/s, j.shift_1.velocity = 0.4 m/s",
        ),
        ("planar(0.6, 0, 0.8)", "", "turn_3.velocity = 3 rad/s, j.shift_1.velocity = -0.5 m/s"),
        (
            "spherical",
            "{ orientation = (0 deg, 70 deg, 0 deg) }",
            "angular_velocity.x = 3 rad/s, j.angular_velocity.z = 1 rad/s",
        ),
        ("free", "", "angular_velocity.y = 3 rad/s, j.shift_z.velocity = 1 m/s"),
        ("axes(shift (0, 0.6, 0.8), turn z, turn x)", "", "turn_x.velocity = 2 rad/s, j.turn_z.velocity = 1 rad/s"),
        (
            "axes(turn (0.6, 0, 0.8), shift y)",
            "{ orientation = (0 deg, 0 deg, 30 deg) }",
            "turn_1.velocity = 2 rad/s, j.shift_y.velocity = 1 m/s",
        ),
        // Euler angles; the third has a name of its own.
        (
            "axes(turn z, turn x, turn z)",
            "{ orientation = (5 deg, 0 deg, 0 deg) }",
            "turn_x.position = 0.9, j.turn_z.velocity = 1 rad/s, j.turn_3.velocity = -2 rad/s",
        ),
        (
            "cylindrical(z)",
            "{ motion = { turn_z = 3 rad/s * t + 0.2 * sin(8 rad/s * t) } }",
            "shift_z.velocity = 0.4 m/s",
        ),
    ];
    for (number, (kind, fields, start)) in joints.iter().enumerate() {
        for is_reversed in [false, true] {
            let ends = if is_reversed { "outer.tip -> inner.tip" } else { "inner.tip -> outer.tip" };
            let head = format!(
                "{}{}joint root: revolute(0, 0.6, 0.8) ground -> inner\njoint j: {kind} {ends} {fields}\n",
                body("inner"),
                body("outer"),
            );
            let start = format!("{GO} {{ root.velocity = 2.5 rad/s, j.{start} }} }}\n");
            prove(&format!("tree_{number}_{is_reversed}"), &format!("{head}{start}"), 1e-9);
            let study = checked(&format!("study s\n{head}"), &[]).unwrap_or_else(|findings| panic!("{findings}"));
            let elements: String = study.joints[1]
                .axes
                .iter()
                .enumerate()
                .map(|(at, axis)| {
                    let gain = if matches!(axis.motion, AxisMotion::Turn(_)) { "9 N*m" } else { "400 N/m" };
                    format!("force on_{at}: holding on {} {{ gain = {gain} }}\n", axis.name)
                })
                .collect();
            if !elements.is_empty() {
                prove(&format!("held_{number}_{is_reversed}"), &format!("{head}{HOLDING}{elements}{start}"), 1e-9);
            }
        }
    }
}

/// Every coordinate of every kind of joint may follow a prescribed motion, walked outwards and inwards, bodies turned.
#[test]
fn every_coordinate_of_a_tree_may_be_driven() {
    let body = |name: &str| {
        format!(
            "body {name} {{ mass = 1.5 kg, inertia = (0.3, 0.4, 0.5, 0.02, -0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, -0.2 m, 0.15 m), point tip = (0.3 m, 0.1 m, -0.2 m) }}\n"
        )
    };
    let kinds = [
        ("prismatic(0, 0.6, 0.8)", "orientation = (0 deg, 40 deg, 0 deg)"),
        ("revolute(0.6, 0, 0.8)", "orientation = (10 deg, 0 deg, 0 deg)"),
        ("cylindrical(x)", ""),
        ("universal(x, z)", "orientation = (20 deg, 30 deg, -50 deg)"),
        ("planar(y)", "orientation = (0 deg, 0 deg, 25 deg)"),
        ("axes(turn x, shift y, turn z)", ""),
        ("free", "orientation = (0 deg, 70 deg, 0 deg)"),
    ];
    for (kind, fields) in kinds {
        for ends in ["inner.tip -> outer.tip", "outer.tip -> inner.tip"] {
            let bodies = body("inner") + &body("outer") + "joint root: revolute(0, 0.6, 0.8) ground -> inner\n";
            let bare = checked(&format!("study s\n{bodies}joint j: {kind} {ends}\n"), &[]).expect("a study");
            let axes = &bare.joints[1].axes;
            for axis in axes {
                let size = if matches!(axis.motion, AxisMotion::Turn(_)) { "0.4" } else { "0.1 m" };
                let motion = format!("{size} * sin(9 rad/s * t + 0.3) + {size} * t / 1 s");
                let motion = match axis.name.strip_prefix("j.") {
                    Some(name) if axes.len() > 1 => format!("{{ {name} = {motion} }}"),
                    _ => motion,
                };
                let text = format!(
                    "{bodies}joint j: {kind} {ends} {{ motion = {motion}, {fields} }}\n{GO} {{ root.velocity = 2 rad/s }} }}\n"
                );
                prove(
                    &format!("driven {kind} {ends} {}", axis.name)
                        .replace(' ', "_")
                        .replace(|c: char| !c.is_alphanumeric(), "_"),
                    &text,
                    1e-9,
                );
            }
        }
    }
}
