//! Impulses in mechanisms with closed loops, and friction by the reaction of a joint of the tree.

use crate::build::NoInputs;
use crate::run::{checked, run};
use ident::integrate::Dynamics;
use ident::mechanics::derive;
use ident::tape::{Bound, Model};
use nalgebra::{DMatrix, DVector, Vector2};

const BASE: f64 = 0.2;
const UPPER: f64 = 0.25;
const LOWER: f64 = 0.35;
const RESTITUTION: f64 = 0.4;
/// Mass and inertia about the centre of gravity, in the middle of each link.
const LINKS: [(f64, f64, f64); 4] = [(0.4, 2e-3, UPPER), (0.7, 5e-3, LOWER), (0.5, 3e-3, UPPER), (0.6, 7e-3, LOWER)];

const STOP: &str = "law hard_stop(x: length, v: velocity) -> force {
       param limit: length, restitution: ratio
       when x > limit { v := -restitution * v }
       = 0 N
     }\n";

/// Two arms of two links on a common base, joined at their ends: two freedoms; a stop at the first elbow, aslant.
fn five_bar() -> String {
    let mut text = "study five_bar\n".to_owned() + STOP;
    for (name, (mass, inertia, length)) in ["l1", "l2", "r1", "r2"].into_iter().zip(LINKS) {
        let middle = length / 2.0;
        text += &format!(
            "body {name} {{ mass = {mass} kg, inertia = {inertia} kg*m^2, centre_of_gravity = ({middle} m, 0 m, 0 m), point e = ({length} m, 0 m, 0 m) }}\n"
        );
    }
    text + &format!(
        "body base {{ mass = 1 kg, point left = (0 m, 0 m, 0 m), point right = ({BASE} m, 0 m, 0 m) }}
         joint bolt: fixed ground -> base
         joint m1: revolute(z) base.left -> l1\njoint k1: revolute(z) l1.e -> l2
         joint m2: revolute(z) base.right -> r1\njoint k2: revolute(z) r1.e -> r2
         joint tool: revolute(z) l2.e -> r2.e
         force stop: hard_stop ground -> l2.e along (0.6, 0.8, 0) {{ limit = 1 m, restitution = {RESTITUTION} }}
         measure x [m] = l2.e.position.x
         manoeuvre go {{ for 0.1 s, start = rest {{ m1.position = 2.2, m2.position = 0.9 }} }}
         criterion c = max(l2.e.position.x) in go\n"
    )
}

/// Of an arm with the angles a and a + b: where it ends, and the derivatives of the end and of both centres of gravity.
fn arm([a, b]: [f64; 2], root: f64) -> (Vector2<f64>, [[Vector2<f64>; 2]; 3]) {
    let along = |angle: f64, length: f64| Vector2::new(length * angle.cos(), length * angle.sin());
    let across = |angle: f64, length: f64| Vector2::new(-length * angle.sin(), length * angle.cos());
    let end = Vector2::new(root, 0.0) + along(a, UPPER) + along(a + b, LOWER);
    let levers = |length: f64| [across(a, UPPER) + across(a + b, length), across(a + b, length)];
    let first = [across(a, UPPER / 2.0), Vector2::zeros()];
    (end, [levers(LOWER), first, levers(LOWER / 2.0)])
}

/// Joint angles (left two, right two) at which both arms end at the same point.
fn closed(left: f64, right: f64) -> [f64; 4] {
    let (mut b, mut d) = (-1.2, 1.2);
    for _ in 0..60 {
        let ((p, dp), (q, dq)) = (arm([left, b], 0.0), arm([right, d], BASE));
        let matrix = nalgebra::Matrix2::from_columns(&[dp[0][1], -dq[0][1]]);
        let step = matrix.lu().solve(&(p - q)).expect("regular");
        (b, d) = (b - step.x, d - step.y);
    }
    [left, b, right, d]
}

/// Lagrange's equations for the jump: `M dv = J^T L + r P`, `J dv = 0`, `r (v + dv) = -e r v`.
fn jump(q: [f64; 4], v: &DVector<f64>) -> DVector<f64> {
    let ((_, left), (_, right)) = (arm([q[0], q[1]], 0.0), arm([q[2], q[3]], BASE));
    let mut mass = DMatrix::zeros(4, 4);
    for (at, levers) in [(0, left), (2, right)] {
        for (link, turning) in [(0, [1.0, 0.0]), (1, [1.0, 1.0])] {
            let (m, inertia, _) = LINKS[at + link];
            for i in 0..2 {
                for j in 0..2 {
                    mass[(at + i, at + j)] +=
                        m * levers[1 + link][i].dot(&levers[1 + link][j]) + inertia * turning[i] * turning[j];
                }
            }
        }
    }
    let end = [left[0][0], left[0][1], -right[0][0], -right[0][1]];
    let direction = Vector2::new(0.6, 0.8);
    let mut rows = DMatrix::zeros(3, 4);
    for (i, lever) in end.iter().enumerate() {
        (rows[(0, i)], rows[(1, i)]) = (lever.x, lever.y);
        rows[(2, i)] = if i < 2 { lever.dot(&direction) } else { 0.0 };
    }
    let mut whole = DMatrix::zeros(7, 7);
    whole.view_mut((0, 0), (4, 4)).copy_from(&mass);
    whole.view_mut((4, 0), (3, 4)).copy_from(&rows);
    whole.view_mut((0, 4), (4, 3)).copy_from(&rows.transpose());
    let mut right_side = DVector::zeros(7);
    right_side[6] = -(1.0 + RESTITUTION) * (rows.row(2) * v)[0];
    whole.lu().solve(&right_side).expect("regular").rows(0, 4).into_owned()
}

#[test]
fn an_impact_in_a_loop_changes_all_velocities_as_the_constraints_allow() {
    let study = checked(&five_bar(), &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let model = Model::compile(&derive(&study).unwrap_or_else(|findings| panic!("{findings:?}")));
    let mut bound = Bound::new(&model, &NoInputs, &[]);
    let place = |name: &str| model.variables().iter().position(|v| v.name == name).unwrap_or_else(|| panic!("{name}"));
    let joints = ["m1", "k1", "m2", "k2"];
    for (left, right, first, second) in [(2.2, 0.9, 1.0, -2.0), (1.9, 1.1, -3.0, 0.5), (2.5, 0.3, 0.7, 0.8)] {
        let q = closed(left, right);
        let ((_, dp), (_, dq)) = (arm([q[0], q[1]], 0.0), arm([q[2], q[3]], BASE));
        let matrix = nalgebra::Matrix2::from_columns(&[dp[0][1], -dq[0][1]]);
        let others = matrix.lu().solve(&(second * dq[0][0] - first * dp[0][0])).expect("regular");
        let v = DVector::from_vec(vec![first, others.x, second, others.y]);
        let mut y: Vec<f64> = model.variables().iter().map(|variable| variable.reference).collect();
        for (i, joint) in joints.iter().enumerate() {
            y[place(&format!("{joint}.position"))] = q[i];
            y[place(&format!("{joint}.velocity"))] = v[i];
        }
        bound.reset(0, true, 0.0, &mut y);
        let expected = jump(q, &v);
        for (i, joint) in joints.iter().enumerate() {
            let own = y[place(&format!("{joint}.velocity"))] - v[i];
            assert!((own - expected[i]).abs() < 1e-10 * expected.amax(), "{joint}: {own} instead of {}", expected[i]);
            assert_eq!(y[place(&format!("{joint}.position"))], q[i]);
        }
        assert!(expected.amax() > 0.1, "{expected}");
    }
}

/// A slider-crank without losses whose slider meets a stop: the only freedom turns back, and the energy stays.
#[test]
fn a_run_goes_on_behind_the_impact() {
    let text = format!(
        "study slider_crank\n{STOP}
         body crank {{ mass = 1 kg, inertia = 5e-3 kg*m^2, point pin = (0 m, 0 m, 0.1 m) }}
         body rod {{ mass = 0.5 kg, inertia = 4e-3 kg*m^2, centre_of_gravity = (0.14 m, 0 m, -0.05 m), point small = (0.28 m, 0 m, -0.1 m) }}
         body slider {{ mass = 0.8 kg }}
         joint shaft: revolute(y) ground -> crank\njoint big: revolute(y) crank.pin -> rod
         joint small: revolute(y) rod.small -> slider\njoint guide: prismatic(x) ground -> slider
         force stop: hard_stop on guide {{ limit = 0.36 m, restitution = 1 }}
         measure x [m] = guide.position\nmeasure w [rad/s] = shaft.velocity
         measure E [J] = 0.5 * (0.005 kg*m^2 * shaft.velocity^2 + 0.8 kg * guide.velocity^2
           + 0.5 kg * (rod.centre_of_gravity.velocity.x^2 + rod.centre_of_gravity.velocity.z^2) + 0.004 kg*m^2 * rod.angular_velocity.y^2)
         manoeuvre go {{ for 2 s, step = 10 ms, start = rest {{ shaft.velocity = 4 rad/s }} }}
         criterion c = max(guide.position) in go\nsolver {{ tolerance = 1e-9 }}\n"
    );
    let own = &run(&text, &[])[0];
    let (energy, rate, way) = (&own["E"], &own["w"], &own["x"]);
    assert!(way.iter().all(|x| *x < 0.36 + 1e-9) && way.iter().any(|x| *x > 0.35), "{way:?}");
    assert!(rate.iter().any(|w| *w > 1.0) && rate.iter().any(|w| *w < -1.0), "it must turn back");
    for e in energy {
        assert!((e / energy[0] - 1.0).abs() < 1e-6, "{e} instead of {}", energy[0]);
    }
}

/// Friction in proportion to what the guide of a spatial slider-crank transmits, the crank being driven: the slider's
/// own equation of motion holds, with a normal force that the friction itself changes through the connecting rod.
#[test]
fn friction_by_the_reaction_of_a_driven_spatial_loop() {
    let text = "study slider_crank
        gravity = 9.81 m/s^2 along -z
        body crank { mass = 1 kg, inertia = 5e-3 kg*m^2, point pin = (0 m, 0 m, 0.05 m) }
        body rod { mass = 0.5 kg, inertia = (1e-5, 4e-3, 4e-3 kg*m^2), centre_of_gravity = (0.15 m, 0 m, 0 m), point small = (0.3 m, 0 m, 0 m) }
        body slider { mass = 0.8 kg }
        joint shaft: revolute(0, 0.8, 0.6) ground -> crank { motion = 20 rad/s * t }
        joint big: spherical crank.pin -> rod\njoint small: spherical rod.small -> slider
        joint guide: prismatic(x) ground -> slider
        law dry(v: velocity, normal: force, mu: ratio) -> force { = -mu * normal * tanh(v / (10 mm/s)) }
        force friction: dry on guide { normal = sqrt(guide.reaction.force.y^2 + guide.reaction.force.z^2 + (0.1 N)^2), mu = 0.2 }
        measure a [m/s^2] = guide.acceleration\nmeasure v [m/s] = guide.velocity
        measure F [N] = small.reaction.force.x\nmeasure y [N] = guide.reaction.force.y\nmeasure z [N] = guide.reaction.force.z
        measure M [N*m] = shaft.reaction.moment.y
        measure py [N] = small.reaction.force.y\nmeasure pz [N] = small.reaction.force.z
        manoeuvre go { for 0.5 s, step = 10 ms, start = rest }
        criterion c = max(guide.position) in go\n";
    let own = &run(text, &[])[0];
    for (k, acceleration) in own["a"].iter().enumerate() {
        let at = |name: &str| own[name][k];
        let normal = (at("y").powi(2) + at("z").powi(2) + 0.01).sqrt();
        let friction = -0.2 * normal * (at("v") / 0.01).tanh();
        assert!((0.8 * acceleration - at("F") - friction).abs() < 1e-6 * (1.0 + at("F").abs()), "{k}: {friction}");
        // The guide holds what the rod brings, and the weight.
        assert!((at("y") + at("py")).abs() < 1e-6 * (1.0 + at("y").abs()), "{k}");
        assert!((at("z") + at("pz") - 0.8 * 9.81).abs() < 1e-6 * (1.0 + at("z").abs()), "{k}");
    }
    assert!(own["F"].iter().fold(0.0_f64, |most, f| most.max(f.abs())) > 10.0);
}
