//! Random spatial trees of bodies against constrained Newton-Euler equations, finite differences and energy.

use crate::build::{Builder, GROUND, NoInputs, Random, along, assert_close};
use crate::maximal::{Mechanism, V};
use ident::integrate::Dynamics;
use ident::mechanics::derive;
use ident::study::*;
use ident::tape::{Bound, Model};

const STIFFNESS: f64 = 13.0;
const DAMPING: f64 = 0.7;

/// A spring of `STIFFNESS`, a damper of `damping`.
fn spring(b: &mut Builder, name: &str, place: ForcePlace, damping: f64) {
    b.force(name, place, |graph, x, v| {
        let [k, d] = [-STIFFNESS, -damping].map(|value| graph.constant(value));
        let (by_x, by_v) = (graph.multiply(k, x), graph.multiply(d, v));
        graph.add(by_x, by_v)
    });
}

/// Positive definite and such that the triangle inequalities of inertia hold.
fn random_inertia(random: &mut Random) -> [f64; 6] {
    let d = random.vector().map(|x| 1.0 + 0.3 * x);
    let o = random.vector().map(|x| 0.15 * x);
    [d[0], d[1], d[2], o[0], o[1], o[2]]
}

/// Bodies on joints of all kinds, branching, partly declared from the outer to the inner body; force elements of
/// all kinds; motion of a point of every body measured.
fn random_tree(random: &mut Random, kinds: &[usize], damping: f64) -> Builder {
    let mut b = Builder::new();
    b.gravity([0.3, -0.8, -9.7]);
    for (i, kind) in kinds.iter().enumerate() {
        let body = b.body(&format!("body{i}"), 1.5 + random.next(), random.vector(), random_inertia(random));
        let inner = match ((random.next() + 1.0) / 2.0 * (i as f64 + 1.0)) as usize {
            0 => GROUND,
            k => Some(k - 1),
        };
        let axis = random.unit();
        let kind = match kind {
            0 => None,
            1 => Some(AxisMotion::Shift(axis)),
            _ => Some(AxisMotion::Turn(axis)),
        };
        let near = b.attach(inner, random.vector());
        let far = b.attach(Some(body), random.vector());
        let (parent, child) = if random.next() < 0.0 { (near, far) } else { (far, near) };
        let joint = b.joint(&format!("joint{i}"), kind, parent, child);
        if kind.is_some() && random.next() > 0.0 {
            spring(&mut b, &format!("in_joint{i}"), ForcePlace::Joint { joint, axis: 0 }, damping);
        }
        let point = b.attach(Some(body), random.vector());
        for motion in [PointMotion::Position, PointMotion::Velocity, PointMotion::Acceleration] {
            b.measure_point(&format!("p{i}"), point, motion);
        }
    }
    let n = kinds.len();
    for k in 0..n {
        let along = if k % 2 == 1 { along(random.unit()) } else { None };
        let free_length = (k % 4 == 0).then(|| b.number(0.8));
        let other = if k == 0 { GROUND } else { Some((k + n / 2) % n) };
        let (first, second) = (b.attach(other, random.vector()), b.attach(Some(k), random.vector()));
        spring(&mut b, &format!("link{k}"), ForcePlace::Between { first, second, along, free_length }, damping);
    }
    b
}

/// The tests' view of a state: coordinates and rates per joint of the study.
fn mechanism<'a>(study: &'a Study, y: &[f64]) -> Mechanism<'a> {
    let mut moving = 0;
    let total = y.len() / 2;
    let (q, v) = study
        .joints
        .iter()
        .map(|joint| {
            if joint.axes.is_empty() {
                return (0.0, 0.0);
            }
            moving += 1;
            (y[moving - 1], y[total + moving - 1])
        })
        .unzip();
    Mechanism { study, q, v }
}

fn loads(mechanism: &Mechanism, damping: f64) -> Vec<f64> {
    let load = |force: &Force| {
        let (x, v) = mechanism.elongation(force);
        -STIFFNESS * x - damping * v
    };
    mechanism.study.forces.iter().map(load).collect()
}

const TREES: [&[usize]; 8] =
    [&[2], &[1, 1], &[2, 2], &[2, 2, 2], &[1, 2, 1, 2], &[2, 0, 1, 2], &[0, 2, 1, 0, 2, 2], &[2, 1, 2, 0, 2, 1, 2]];

#[test]
fn random_trees_accelerate_as_newton_and_euler_say() {
    let mut random = Random(11);
    for kinds in TREES.iter().cycle().take(24) {
        let b = random_tree(&mut random, kinds, DAMPING);
        let system = derive(&b.study).expect("derivable");
        let model = Model::compile(&system);
        let mut bound = Bound::new(&model, &NoInputs, &[]);
        let n = model.dimension();
        for _ in 0..3 {
            let y = random.state(n);
            let mut rates = vec![0.0; n];
            assert!(bound.explicit_rates(0.0, &y, &mut rates));
            let reference = mechanism(&b.study, &y);
            let (expected, origins) = reference.accelerations(&loads(&reference, DAMPING));
            let moving = b.study.joints.iter().zip(expected).filter(|(joint, _)| !joint.axes.is_empty());
            let expected: Vec<f64> = moving.map(|(_, a)| a).collect();
            assert_close(&rates[n / 2..], &expected, 1e-9);

            let mut outputs = vec![0.0; model.output_count()];
            bound.outputs(0.0, &y, &mut outputs);
            let poses = reference.poses();
            let measured: Vec<f64> = (0..kinds.len())
                .flat_map(|body| {
                    let p = b.study.point_quantities[9 * body].point;
                    let (position, velocity) = reference.end(&poses, &p);
                    let (alpha, a) = origins[body];
                    let (w, arm): (V, V) = (poses[body].w, crate::maximal::sub(position, poses[body].o));
                    let spin = crate::maximal::cross(w, crate::maximal::cross(w, arm));
                    let acceleration =
                        crate::maximal::add(crate::maximal::add(a, spin), crate::maximal::cross(alpha, arm));
                    [position, velocity, acceleration].concat()
                })
                .collect();
            assert_close(&outputs, &measured, 1e-9);
        }
    }
}

#[test]
fn energy_changes_by_what_dampers_take() {
    let mut random = Random(12);
    for damping in [0.0, DAMPING] {
        let b = random_tree(&mut random, &[2, 1, 2, 2, 0, 2], damping);
        let model = Model::compile(&derive(&b.study).expect("derivable"));
        let mut bound = Bound::new(&model, &NoInputs, &[]);
        let n = model.dimension();
        let y = random.state(n);
        let mut rates = vec![0.0; n];
        assert!(bound.explicit_rates(0.0, &y, &mut rates));
        let energy = |h: f64| {
            let moved: Vec<f64> = y.iter().zip(&rates).map(|(y, rate)| y + h * rate).collect();
            let mechanism = mechanism(&b.study, &moved);
            let springs = b.study.forces.iter().map(|force| 0.5 * STIFFNESS * mechanism.elongation(force).0.powi(2));
            mechanism.kinetic_energy() + mechanism.gravity_energy() + springs.sum::<f64>()
        };
        let h = 1e-5;
        let power = (energy(h) - energy(-h)) / (2.0 * h);
        let now = mechanism(&b.study, &y);
        let taken: f64 = b.study.forces.iter().map(|force| damping * now.elongation(force).1.powi(2)).sum();
        let scale = energy(0.0).abs();
        assert!((power + taken).abs() < 1e-7 * scale.max(taken), "power {power}, dampers take {taken}");
    }
}

#[test]
fn point_velocity_and_acceleration_are_derivatives_of_position() {
    let mut random = Random(13);
    let b = random_tree(&mut random, &[2, 1, 2, 2], DAMPING);
    let model = Model::compile(&derive(&b.study).expect("derivable"));
    let mut bound = Bound::new(&model, &NoInputs, &[]);
    let n = model.dimension();
    let y = random.state(n);
    let mut rates = vec![0.0; n];
    assert!(bound.explicit_rates(0.0, &y, &mut rates));
    let mut outputs = |h: f64| {
        let moved: Vec<f64> = y.iter().zip(&rates).map(|(y, rate)| y + h * rate).collect();
        let mut out = vec![0.0; model.output_count()];
        bound.outputs(0.0, &moved, &mut out);
        out
    };
    let h = 1e-5;
    let (now, before, after) = (outputs(0.0), outputs(-h), outputs(h));
    for point in now.chunks(9).zip(before.chunks(9)).zip(after.chunks(9)) {
        let ((now, before), after) = point;
        let slope: Vec<f64> = (0..6).map(|i| (after[i] - before[i]) / (2.0 * h)).collect();
        assert_close(&slope, &now[3..], 1e-7);
    }
}

#[test]
fn joint_inertia_is_what_moves_rigidly_with_the_joint() {
    let mut b = Builder::new();
    let carriage = b.body("carriage", 3.0, [0.0; 3], [0.0; 6]);
    let load = b.body("load", 2.0, [0.0; 3], [0.0; 6]);
    let wheel = b.body("wheel", 4.0, [0.5, 0.0, 0.0], [0.0, 0.0, 0.25, 0.0, 0.0, 0.0]);
    let place = |b: &mut Builder, body| b.attach(body, [0.0; 3]);
    let ends =
        [place(&mut b, GROUND), place(&mut b, Some(carriage)), place(&mut b, Some(load)), place(&mut b, Some(wheel))];
    let slide = b.joint("slide", Some(AxisMotion::Shift([1.0, 0.0, 0.0])), ends[0], ends[1]);
    b.joint("weld", None, ends[1], ends[2]);
    let hub = b.joint("hub", Some(AxisMotion::Turn([0.0, 0.0, 1.0])), ends[2], ends[3]);
    for joint in [slide, hub] {
        let node = b.study.graph.variable(b.study.joints[joint].axes[0].symbols.inertia);
        b.measure("inertia", node);
    }
    let model = Model::compile(&derive(&b.study).expect("derivable"));
    let mut outputs = [0.0; 2];
    Bound::new(&model, &NoInputs, &[]).outputs(0.0, &[0.1, 0.2, 0.3, 0.4], &mut outputs);
    assert_close(&outputs, &[5.0, 0.25 + 4.0 * 0.25], 1e-14);
}
