//! Joints of every kind that close a loop: driven, and with elements on them.

use super::*;

/// Loops closed by joints of every kind that can: of one chain of five single joints.
#[test]
fn every_kind_of_joint_closes_a_loop() {
    let closing = [
        ("axes(turn z, shift x)", "arm.tip -> slider", ""),
        ("axes(turn z, shift x)", "slider -> arm.tip", "{ orientation = (0 deg, 10 deg, 20 deg) }"),
        ("cylindrical(x)", "arm.tip -> slider", ""),
        ("universal(x, y)", "slider -> arm.tip", "{ orientation = (10 deg, 0 deg, 30 deg) }"),
        ("planar(z)", "arm.tip -> slider", "{ orientation = (5 deg, 0 deg, 10 deg) }"),
        ("spherical", "slider -> arm.tip", ""),
        ("axes(shift x, turn z, turn y)", "slider -> arm.tip", "{ orientation = (0 deg, 0 deg, 20 deg) }"),
        ("axes(turn y, turn z, shift (0.6, 0, 0.8))", "slider -> arm.tip", ""),
        ("axes(shift x, shift (0.6, 0.8, 0), turn z, turn y)", "slider -> arm.tip", ""),
    ];
    let link = |name: &str| {
        format!(
            "body {name} {{ mass = 1 kg, inertia = (0.02, 0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, 0.05 m, 0 m), point tip = (0.4 m, 0 m, 0 m) }}\n"
        )
    };
    for (number, (kind, ends, fields)) in closing.iter().enumerate() {
        let text = format!(
            "{}body ground {{ point rail = (0.35 m, -0.1 m, 0.05 m) }}
             joint hinge: revolute(z) ground -> first
             joint tilt: revolute(y) first -> arm
             joint rail: prismatic(1, 0.1, 0) ground.rail -> run
             joint roll: revolute(x) run -> third {{ orientation = (5 deg, 0 deg, 10 deg) }}
             joint nod: revolute(0, 1, 0.2) third -> slider
             joint pin: {kind} {ends} {fields}
             {GO} {{ hinge.velocity = 1 rad/s }} }}\n",
            ["first", "arm", "run", "third", "slider"].map(link).concat()
        );
        prove(&format!("closing_{number}"), &text, 1e-8);
    }
}

/// Three bodies on three joints, each with a prescribed motion: one of them closes the loop.
fn driven_loop(kind: &str, ends: &str, fields: &str, (element, head): (&str, &str)) -> String {
    let link = |name: &str| {
        format!(
            "body {name} {{ mass = 1.2 kg, inertia = (0.02, 0.03, 0.04, 0.002, -0.001, 0.003 kg*m^2), centre_of_gravity = (0.1 m, 0.05 m, -0.02 m), point tip = (0.4 m, 0.05 m, 0 m) }}\n"
        )
    };
    format!(
        "{}{}body ground {{ point home = (0.35 m, 0.1 m, 0.05 m) }}
         {HOLDING}         joint lift: cylindrical(z) ground -> a {{ motion = {{ shift_z = 0.05 m * sin(7 rad/s * t) }} }}
         joint head: axes(turn x, turn y, turn z) a.tip -> b {{ motion = {{ {head} = 0.3 * sin(9 rad/s * t) }}, orientation = (10 deg, 0 deg, 20 deg) }}
         joint pin: {kind} {ends} {{ {fields} }}
         {element}
         {GO} {{ lift.turn_z.velocity = 1 rad/s }} }}\n",
        link("a"),
        link("b")
    )
}

#[test]
fn closing_joints_may_be_driven() {
    let shift = "0.04 m * sin(6 rad/s * t)";
    let turn = "0.3 * sin(5 rad/s * t)";
    let cases = [
        ("axes(shift x, shift y, shift z, turn z, turn x)", format!("motion = {{ shift_y = {shift} }}")),
        ("axes(shift x, shift y, shift z, turn z, turn x)", format!("motion = {{ turn_z = {turn} }}")),
        (
            "axes(shift x, shift y, shift z, turn z, turn x)",
            format!("motion = {{ turn_x = {turn} }}, orientation = (0 deg, 0 deg, 15 deg)"),
        ),
        ("axes(turn z, turn y, shift x, shift y, shift z)", format!("motion = {{ turn_z = {turn} }}")),
        ("axes(turn z, turn y, shift x, shift y, shift z)", format!("motion = {{ shift_x = {shift} }}")),
        ("axes(turn z, turn y, shift (0.6, 0, 0.8), shift y, shift z)", format!("motion = {{ shift_y = {shift} }}")),
        (
            "axes(shift x, turn z, turn x, turn y, shift (0.6, 0, 0.8))",
            format!("motion = {{ turn_y = {turn} }}, orientation = (0 deg, 0 deg, 15 deg)"),
        ),
        ("free", format!("motion = {{ shift_x = {shift}, shift_z = {shift} }}")),
    ];
    for (number, (kind, fields)) in cases.iter().enumerate() {
        for (way, ends) in [("out", "b.tip -> ground.home"), ("in", "ground.home -> b.tip")] {
            // What the pin turns about x, the head does not.
            let head = if fields.contains("turn_x =") { "turn_z" } else { "turn_x" };
            prove(&format!("driven_{number}_{way}"), &driven_loop(kind, ends, fields, ("", head)), 1e-8);
        }
    }
}

/// Elements on every coordinate of a joint that closes a loop do there what they do anywhere.
#[test]
fn closing_joints_carry_elements_on_all_coordinates() {
    let cases = [
        (
            "axes(shift x, shift (0.6, 0.8, 0), shift z, turn z, turn (1, 0, 1))",
            "shift_x shift_2 shift_z",
            "turn_z turn_5",
        ),
        ("axes(turn z, turn x, shift x, shift y, shift (0, 0.6, 0.8))", "shift_x shift_y shift_5", "turn_z turn_x"),
        ("axes(shift x, shift z, turn z, turn x, shift y)", "shift_x shift_y shift_z", "turn_z turn_x"),
        ("axes(shift x, shift y, turn z, turn y, turn x)", "shift_x shift_y", "turn_x turn_y turn_z"),
    ];
    for (number, (kind, shifts, turns)) in cases.iter().enumerate() {
        let on = |axes: &str, gain: &str| -> String {
            let lines = axes
                .split_whitespace()
                .map(|axis| format!("force on_{axis}: holding on pin.{axis} {{ gain = {gain} }}\n"));
            lines.collect()
        };
        let elements = on(shifts, "300 N/m") + &on(turns, "4 N*m");
        for (way, ends) in [("out", "b.tip -> ground.home"), ("in", "ground.home -> b.tip")] {
            prove(&format!("carrying_{number}_{way}"), &driven_loop(kind, ends, "", (&elements, "turn_x")), 1e-8);
        }
    }
}
