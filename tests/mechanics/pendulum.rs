//! Pendulums against Lagrangian equations derived by hand.

use crate::build::{Builder, GROUND, NoInputs, Random, assert_close};
use ident::integrate::Dynamics;
use ident::mechanics::derive;
use ident::study::AxisMotion;
use ident::tape::{Bound, Model};

type Rotation = [[f64; 3]; 3];

/// Right-handed axes whose third is `z`, as columns.
fn axes_around(z: [f64; 3]) -> Rotation {
    let helper = if z[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let x = cross(helper, z);
    let length = x.iter().map(|c| c * c).sum::<f64>().sqrt();
    let x = x.map(|c| c / length);
    let y = cross(z, x);
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}

fn apply(r: Rotation, v: [f64; 3]) -> [f64; 3] {
    r.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[derive(Clone, Copy)]
struct Arm {
    mass: f64,
    /// Joint to centre of gravity, joint to next joint.
    centre: f64,
    length: f64,
    /// About the centre of gravity and the axis.
    inertia: f64,
}

const ARMS: [Arm; 2] = [
    Arm { mass: 1.7, centre: 0.4, length: 0.9, inertia: 0.21 },
    Arm { mass: 0.8, centre: 0.55, length: 1.0, inertia: 0.07 },
];
const GRAVITY: f64 = 9.81;

/// Double pendulum in the plane of the first two columns of `r`, hanging along -y at angle zero; angles relative.
fn chain(r: Rotation, arms: &[Arm]) -> Builder {
    let mut b = Builder::new();
    let axis = [r[0][2], r[1][2], r[2][2]];
    b.gravity(apply(r, [0.0, -GRAVITY, 0.0]));
    let mut parent = b.attach(GROUND, apply(r, [0.3, -0.2, 0.5]));
    for (i, arm) in arms.iter().enumerate() {
        // The origin of the body's axes lies somewhere else than joint and centre of gravity.
        let origin = [0.1 * i as f64, 0.05, -0.3];
        let place = |y: f64| apply(r, [-origin[0], y - origin[1], -origin[2]]);
        // Isotropic about any axis in the plane, so that only the value about the joint axis matters.
        let inertia = std::array::from_fn(|k| if k < 3 { arm.inertia } else { 0.0 });
        let body = b.body(&format!("arm{i}"), arm.mass, place(-arm.centre), inertia);
        let child = b.attach(Some(body), place(0.0));
        b.joint(&format!("hinge{i}"), Some(AxisMotion::Turn(axis)), parent, child);
        parent = b.attach(Some(body), place(-arm.length));
    }
    b
}

fn accelerations(b: &Builder, y: &[f64]) -> Vec<f64> {
    let system = derive(&b.study).expect("derivable");
    let model = Model::compile(&system);
    let mut bound = Bound::new(&model, &NoInputs, &[]);
    let mut rates = vec![0.0; y.len()];
    assert!(bound.explicit_rates(0.0, y, &mut rates));
    assert_close(&rates[..y.len() / 2], &y[y.len() / 2..], 0.0);
    rates[y.len() / 2..].to_vec()
}

fn double_pendulum_by_lagrange(q: [f64; 2], v: [f64; 2]) -> Vec<f64> {
    let [a, b] = ARMS;
    // Absolute angles from the vertical: th1 = q1, th2 = q1 + q2.
    let (th, om) = ([q[0], q[0] + q[1]], [v[0], v[0] + v[1]]);
    let difference: f64 = th[0] - th[1];
    let m11 = a.inertia + a.mass * a.centre.powi(2) + b.mass * a.length.powi(2);
    let m22 = b.inertia + b.mass * b.centre.powi(2);
    let coupling = b.mass * a.length * b.centre;
    let m12 = coupling * difference.cos();
    let f1 =
        -coupling * difference.sin() * om[1].powi(2) - GRAVITY * (a.mass * a.centre + b.mass * a.length) * th[0].sin();
    let f2 = coupling * difference.sin() * om[0].powi(2) - GRAVITY * b.mass * b.centre * th[1].sin();
    let determinant = m11 * m22 - m12 * m12;
    let alpha = [(f1 * m22 - f2 * m12) / determinant, (f2 * m11 - f1 * m12) / determinant];
    vec![alpha[0], alpha[1] - alpha[0]]
}

#[test]
fn pendulum_swings_as_lagrange_says() {
    let mut random = Random(1);
    for frame in [axes_around([0.0, 0.0, 1.0]), axes_around([0.0, 1.0, 0.0]), axes_around(random.unit())] {
        let b = chain(frame, &ARMS[..1]);
        for _ in 0..10 {
            let y = random.state(2);
            let arm = ARMS[0];
            let moved = arm.inertia + arm.mass * arm.centre.powi(2);
            let expected = -arm.mass * GRAVITY * arm.centre * y[0].sin() / moved;
            assert_close(&accelerations(&b, &y), &[expected], 1e-13);
        }
    }
}

#[test]
fn double_pendulum_swings_as_lagrange_says() {
    let mut random = Random(2);
    for frame in [axes_around([0.0, 0.0, 1.0]), axes_around([1.0, 0.0, 0.0]), axes_around(random.unit())] {
        let b = chain(frame, &ARMS);
        for _ in 0..10 {
            let y: Vec<f64> = random.state(4).iter().map(|x| 3.0 * x).collect();
            let expected = double_pendulum_by_lagrange([y[0], y[1]], [y[2], y[3]]);
            assert_close(&accelerations(&b, &y), &expected, 1e-11);
        }
    }
}

#[test]
fn aligned_double_pendulum_has_few_instructions() {
    let system = derive(&chain(axes_around([0.0, 0.0, 1.0]), &ARMS).study).expect("derivable");
    let [rates, ..] = Model::compile(&system).instruction_counts();
    println!("double pendulum: {rates} instructions for the rates");
    // Written by hand the Lagrangian form takes about 50 operations.
    assert!(rates < 120, "structural zeros did not vanish: {rates} instructions");
}
