//! Snapshots of the emitted text.

use crate::build::{Builder, GROUND, along};
use ident::expression::Unary;
use ident::mechanics::{derive, emit_equations, emit_latex, emit_model, emit_tree};
use ident::study::*;
use ident::tape::{Model, emit_tape};

/// Wheel and chassis on a shaken table; the tyre a spring, the strut a spring with a saturating damper.
fn quarter_vehicle() -> Study {
    let mut b = Builder::new();
    b.study.name = "quarter_vehicle".into();
    let [c, d] = [("c_strut", 22e3), ("d_strut", 1.2e3)].map(|(name, start)| b.parameter(name, start));
    let u = b.input("u");
    let z = Some(AxisMotion::Shift([0.0, 0.0, 1.0]));
    let ground = b.attach(GROUND, [0.0; 3]);
    let mut ends = Vec::new();
    for (name, mass, height) in [("wheel", 45.0, 0.3), ("chassis", 320.0, 0.8)] {
        let body = b.body(name, mass, [0.0; 3], [0.0; 6]);
        let place = b.attach(GROUND, [0.0, 0.0, height]);
        let end = b.attach(Some(body), [0.0; 3]);
        b.joint(&format!("{name}_guide"), z, place, end);
        ends.push(end);
    }
    let along = along([0.0, 0.0, 1.0]);
    let t = b.study.graph.variable(b.study.time);
    let tyre = ForcePlace::Between { first: ground, second: ends[0], along, free_length: None };
    b.force("tyre", tyre, |g, x, _| {
        let [stiffness, command] = [g.constant(-180e3), g.sample(u, 0, t)];
        let stretch = g.subtract(x, command);
        g.multiply(stiffness, stretch)
    });
    let strut = ForcePlace::Between { first: ends[0], second: ends[1], along, free_length: None };
    b.force("strut", strut, |g, x, v| {
        let knee = g.constant(0.2);
        let slip = g.divide(v, knee);
        let slip = g.unary(Unary::Tanh, slip);
        let damping = g.multiply(d, slip);
        let spring = g.multiply(c, x);
        let sum = g.add(spring, damping);
        g.negate(sum)
    });
    let z_body = b.study.graph.variable(b.symbols(1).position);
    b.measure("z_body", z_body);
    let a_axle = b.study.graph.variable(b.symbols(0).acceleration);
    b.measure("a_axle", a_axle);
    let load = b.study.forces[0].load;
    b.measure("F_tyre", load);
    b.experiment(Start { base: StartBase::Equilibrium, overrides: vec![] });
    b.study
}

/// A crane: trolley, rope arm with a welded hook, and a second arm declared the other way round.
fn crane() -> Study {
    let mut b = Builder::new();
    b.study.name = "crane".into();
    b.gravity([0.0, 0.0, -9.81]);
    let trolley = b.body("trolley", 4.0, [0.0; 3], [0.0; 6]);
    let arm = b.body("arm", 1.0, [0.0, 0.0, -0.5], [0.1, 0.1, 0.0, 0.0, 0.0, 0.0]);
    let hook = b.body("hook", 2.0, [0.0; 3], [0.0; 6]);
    let tail = b.body("tail", 0.5, [0.2, 0.0, 0.0], [0.01, 0.02, 0.03, 0.0, 0.0, 0.0]);
    let [ground, on_trolley, top] = [GROUND, Some(trolley), Some(arm)].map(|body| b.attach(body, [0.0; 3]));
    let tip = b.attach(Some(arm), [0.0, 0.0, -1.0]);
    let [eye, tail_end] = [Some(hook), Some(tail)].map(|body| b.attach(body, [0.0; 3]));
    b.joint("rail", Some(AxisMotion::Shift([1.0, 0.0, 0.0])), ground, on_trolley);
    b.joint("pivot", Some(AxisMotion::Turn([0.0, 1.0, 0.0])), on_trolley, top);
    b.joint("weld", None, tip, eye);
    b.joint("tail_joint", Some(AxisMotion::Turn([0.0, 1.0, 0.0])), tail_end, eye);
    b.measure_point("hook", eye, PointMotion::Position);
    b.study
}

#[test]
fn quarter_vehicle_text() {
    let study = quarter_vehicle();
    let system = derive(&study).expect("derivable");
    insta::assert_snapshot!("quarter_vehicle_tree", emit_tree(&study).expect("connected"));
    insta::assert_snapshot!("quarter_vehicle_model", emit_model(&study, &system));
    insta::assert_snapshot!("quarter_vehicle_equations", emit_equations(&study, &system));
    insta::assert_snapshot!("quarter_vehicle_tape", emit_tape(&Model::compile(&system)));
}

#[test]
fn crane_text() {
    let study = crane();
    let system = derive(&study).expect("derivable");
    insta::assert_snapshot!("crane_tree", emit_tree(&study).expect("connected"));
    insta::assert_snapshot!("crane_equations", emit_equations(&study, &system));
    insta::assert_snapshot!("crane_latex", emit_latex(&study, &system));
}
