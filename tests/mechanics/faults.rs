//! Mechanical faults are named with element and code.

use crate::build::{Builder, GROUND, along};
use ident::diagnostics::{Code, Diagnostic};
use ident::mechanics::derive;
use ident::study::*;

const Z: Option<AxisMotion> = Some(AxisMotion::Shift([0.0, 0.0, 1.0]));
const TURN: Option<AxisMotion> = Some(AxisMotion::Turn([0.6, 0.0, 0.8]));

fn faults(b: &Builder) -> Vec<Diagnostic> {
    derive(&b.study).expect_err("must be refused")
}

#[track_caller]
fn assert_only(b: &Builder, code: Code, words: &[&str]) {
    let found = faults(b);
    assert_eq!(found.iter().map(|fault| fault.code).collect::<Vec<_>>(), [code]);
    for word in words {
        assert!(found[0].message.contains(word), "`{word}` is missing in `{}`", found[0].message);
    }
    assert!(found[0].span().is_some() && !found[0].help.is_empty());
}

/// `bodies` one after the other on joints of `kind`.
fn chain(kind: Option<AxisMotion>, bodies: &[(f64, f64)]) -> Builder {
    let mut b = Builder::new();
    let mut inner = GROUND;
    for (i, &(mass, inertia)) in bodies.iter().enumerate() {
        let body = b.body(&format!("body{i}"), mass, [0.0; 3], [inertia, inertia, inertia, 0.0, 0.0, 0.0]);
        let (near, far) = (b.attach(inner, [0.1, 0.2, 0.3]), b.attach(Some(body), [0.0; 3]));
        b.joint(&format!("joint{i}"), kind, near, far);
        inner = Some(body);
    }
    b
}

#[test]
fn a_body_without_joint_is_unconnected() {
    let mut b = chain(Z, &[(1.0, 0.0)]);
    b.body("lonely", 1.0, [0.0; 3], [0.0; 6]);
    assert_only(&b, Code::UNCONNECTED_BODY, &["lonely"]);
}

#[test]
fn a_loop_that_leaves_no_freedom_cannot_move() {
    let mut b = chain(TURN, &[(1.0, 1.0)]);
    let (near, far) = (b.attach(GROUND, [0.1, 1.2, 0.3]), b.attach(Some(0), [0.0, 1.0, 0.0]));
    let closing = b.joint("closing", TURN, near, far);
    b.study.joints[closing].closes_loop = true;
    assert_only(&b, Code::CANNOT_MOVE, &["closing"]);
}

#[test]
fn a_massless_end_is_named_with_its_joint() {
    assert_only(&chain(Z, &[(1.0, 0.0), (0.0, 0.0)]), Code::NO_INERTIA, &["joint1", "body1", "mass"]);
    // A point mass on the axis cannot resist turning, also where rounding leaves a trace of inertia.
    assert_only(&chain(TURN, &[(1.0, 1.0), (3.0, 0.0)]), Code::NO_INERTIA, &["joint1", "body1", "moment of inertia"]);
}

#[test]
fn a_massless_body_between_is_fine_across_axes_but_not_along_one() {
    let mut b = chain(Z, &[(0.0, 0.0), (1.0, 0.0)]);
    assert_only(&b, Code::NO_INERTIA, &["joint0", "body0"]);
    b.study.joints[1].axes[0].motion = AxisMotion::Shift([0.0, 0.6, 0.8]);
    let system = derive(&b.study).expect("two directions of one mass");
    assert_eq!(system.states.len(), 4);
}

#[test]
fn coincident_points_need_a_direction() {
    let mut b = chain(Z, &[(1.0, 0.0)]);
    let (first, second) = (b.attach(GROUND, [0.1, 0.2, 0.3]), b.attach(Some(0), [0.0; 3]));
    let place = |along| ForcePlace::Between { first, second, along, free_length: None };
    b.force("strut", place(None), |_, x, _| x);
    assert_only(&b, Code::COINCIDENT_POINTS, &["strut"]);
    b.study.forces[0].place = place(along([0.0, 0.0, 1.0]));
    assert!(derive(&b.study).is_ok());
}

#[test]
fn a_load_may_not_depend_on_an_acceleration() {
    let mut b = chain(Z, &[(1.0, 0.0)]);
    let acceleration = b.study.graph.variable(b.symbols(0).acceleration);
    b.force("added_mass", ForcePlace::Joint { joint: 0, axis: 0 }, |_, _, _| acceleration);
    assert_only(&b, Code::ACCELERATION_IN_LOAD, &["added_mass", "joint0.acceleration"]);
}

#[test]
fn a_force_on_a_fixed_joint_is_refused() {
    let mut b = chain(None, &[(1.0, 0.0)]);
    b.force("push", ForcePlace::Joint { joint: 0, axis: 0 }, |_, x, _| x);
    assert_only(&b, Code::FORCE_ON_FIXED_JOINT, &["push", "joint0"]);
}

#[test]
fn circular_and_undetermined_start_values_are_refused() {
    let mut b = chain(Z, &[(1.0, 0.0)]);
    let symbols = b.symbols(0);
    let [x, v] = [symbols.position, symbols.velocity].map(|symbol| b.study.graph.variable(symbol));
    b.experiment(Start { base: StartBase::Rest, overrides: vec![(symbols.position, v), (symbols.velocity, x)] });
    assert_eq!(faults(&b).iter().map(|fault| fault.code).collect::<Vec<_>>(), [Code::UNKNOWN_START; 2]);
    b.study.experiments[0].start = Start { base: StartBase::Equilibrium, overrides: vec![(symbols.velocity, x)] };
    assert_only(&b, Code::UNKNOWN_START, &["joint0.velocity", "joint0.position"]);
}

#[test]
fn a_quantity_that_nothing_defines_is_named() {
    let mut b = chain(Z, &[(1.0, 0.0)]);
    let stray = b.study.graph.named("stray");
    b.measure("m", stray);
    assert_only(&b, Code::UNKNOWN_QUANTITY, &["stray", "measure `m`"]);
}

#[test]
fn all_faults_come_at_once() {
    let mut b = chain(None, &[(1.0, 0.0)]);
    b.force("push", ForcePlace::Joint { joint: 0, axis: 0 }, |_, x, _| x);
    b.force("pull", ForcePlace::Joint { joint: 0, axis: 0 }, |_, x, _| x);
    assert_eq!(faults(&b).len(), 2);
}
