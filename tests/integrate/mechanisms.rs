//! Mechanisms with loops in Gear-Gupta-Leimkuhler form (index 2): positions, velocities, and the multipliers of the
//! constraints on both levels.

use crate::scalar::Scalar;
use crate::system::Equations;

/// Andrews' squeezing mechanism: seven angles, six loop conditions.
pub struct Andrews;

pub const ANDREWS_ANGLES: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.45527981916307038,
    0.22266839016588588,
    0.48736497954384255,
    -0.22266839016588588,
    1.2305474445498212,
];

const MASS: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const INERTIA: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
const A: [f64; 2] = [-0.06934, -0.00227];
const B: [f64; 2] = [-0.03635, 0.03273];
const C: [f64; 2] = [0.014, 0.072];
const CRANK: f64 = 0.007;
const RA: f64 = 0.00092;
const D: f64 = 0.028;
const DA: f64 = 0.0115;
const SS: f64 = 0.035;
const SA: f64 = 0.01874;
const SB: f64 = 0.01043;
const SC: f64 = 0.018;
const SD: f64 = 0.02;
const E: f64 = 0.02;
const EA: f64 = 0.01421;
const ZT: f64 = 0.04;
const TA: f64 = 0.02308;
const TB: f64 = 0.00916;
const ZF: f64 = 0.02;
const FA: f64 = 0.01421;
const U: f64 = 0.04;
const UA: f64 = 0.01228;
const UB: f64 = 0.00449;
const STIFFNESS: f64 = 4530.0;
const FREE_LENGTH: f64 = 0.07785;
const TORQUE: f64 = 0.033;

impl Andrews {
    fn mass_times<S: Scalar>(q: &[S], a: &[S]) -> Vec<S> {
        let k = S::from;
        let [m, i] = [MASS, INERTIA];
        let (e, f) = (E - EA, ZF - FA);
        let cos_theta = q[1].cos();
        let (sin_phi, sin_omega) = (q[3].sin(), q[5].sin());
        let m11 =
            k(m[0] * RA * RA + m[1] * (CRANK * CRANK + DA * DA) + i[0] + i[1]) - k(2.0 * m[1] * DA * CRANK) * cos_theta;
        let m12 = k(m[1] * DA * DA + i[1]) - k(m[1] * DA * CRANK) * cos_theta;
        let m22 = k(m[1] * DA * DA + i[1]);
        let m33 = k(m[2] * (SA * SA + SB * SB) + i[2]);
        let m44 = k(m[3] * e * e + i[3]);
        let m45 = k(m[3] * e * e + i[3]) + k(m[3] * ZT * e) * sin_phi;
        let m55 =
            k(m[3] * (ZT * ZT + e * e) + m[4] * (TA * TA + TB * TB) + i[3] + i[4]) + k(2.0 * m[3] * ZT * e) * sin_phi;
        let m66 = k(m[5] * f * f + i[5]);
        let m67 = k(m[5] * f * f + i[5]) - k(m[5] * U * f) * sin_omega;
        let m77 =
            k(m[5] * (f * f + U * U) + m[6] * (UA * UA + UB * UB) + i[5] + i[6]) - k(2.0 * m[5] * U * f) * sin_omega;
        vec![
            m11 * a[0] + m12 * a[1],
            m12 * a[0] + m22 * a[1],
            m33 * a[2],
            m44 * a[3] + m45 * a[4],
            m45 * a[3] + m55 * a[4],
            m66 * a[5] + m67 * a[6],
            m67 * a[5] + m77 * a[6],
        ]
    }

    fn force<S: Scalar>(q: &[S], v: &[S]) -> Vec<S> {
        let k = S::from;
        let (sin_gamma, cos_gamma) = (q[2].sin(), q[2].cos());
        let dx = k(SD) * cos_gamma + k(SC) * sin_gamma + k(B[0] - C[0]);
        let dy = k(SD) * sin_gamma - k(SC) * cos_gamma + k(B[1] - C[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let pull = -(k(STIFFNESS) * (length - k(FREE_LENGTH)) / length);
        let (fx, fy) = (pull * dx, pull * dy);
        let (e, f) = (E - EA, ZF - FA);
        let two = k(2.0);
        vec![
            k(TORQUE) - k(MASS[1] * DA * CRANK) * v[1] * (v[1] + two * v[0]) * q[1].sin(),
            k(MASS[1] * DA * CRANK) * v[0] * v[0] * q[1].sin(),
            fx * (k(SC) * cos_gamma - k(SD) * sin_gamma) + fy * (k(SD) * cos_gamma + k(SC) * sin_gamma),
            k(MASS[3] * ZT * e) * v[4] * v[4] * q[3].cos(),
            -(k(MASS[3] * ZT * e) * v[3] * (v[3] + two * v[4]) * q[3].cos()),
            -(k(MASS[5] * U * f) * v[6] * v[6] * q[5].cos()),
            k(MASS[5] * U * f) * v[5] * (v[5] + two * v[6]) * q[5].cos(),
        ]
    }

    fn constraints<S: Scalar>(q: &[S]) -> Vec<S> {
        let k = S::from;
        let (turned, swing, lift) = (q[0] + q[1], q[3] + q[4], q[5] + q[6]);
        let ex = k(CRANK) * q[0].cos() - k(D) * turned.cos();
        let ey = k(CRANK) * q[0].sin() - k(D) * turned.sin();
        vec![
            ex - k(SS) * q[2].sin() - k(B[0]),
            ey + k(SS) * q[2].cos() - k(B[1]),
            ex - k(E) * swing.sin() - k(ZT) * q[4].cos() - k(A[0]),
            ey + k(E) * swing.cos() - k(ZT) * q[4].sin() - k(A[1]),
            ex - k(ZF) * lift.cos() - k(U) * q[6].sin() - k(A[0]),
            ey - k(ZF) * lift.sin() + k(U) * q[6].cos() - k(A[1]),
        ]
    }

    /// dg/dq, six rows of seven.
    fn directions<S: Scalar>(q: &[S]) -> Vec<Vec<S>> {
        let k = S::from;
        let o = k(0.0);
        let (turned, swing, lift) = (q[0] + q[1], q[3] + q[4], q[5] + q[6]);
        let (ex_theta, ey_theta) = (k(D) * turned.sin(), -(k(D) * turned.cos()));
        let (ex_beta, ey_beta) = (ex_theta - k(CRANK) * q[0].sin(), ey_theta + k(CRANK) * q[0].cos());
        let (swing_x, swing_y) = (-(k(E) * swing.cos()), -(k(E) * swing.sin()));
        let (lift_x, lift_y) = (k(ZF) * lift.sin(), -(k(ZF) * lift.cos()));
        vec![
            vec![ex_beta, ex_theta, -(k(SS) * q[2].cos()), o, o, o, o],
            vec![ey_beta, ey_theta, -(k(SS) * q[2].sin()), o, o, o, o],
            vec![ex_beta, ex_theta, o, swing_x, swing_x + k(ZT) * q[4].sin(), o, o],
            vec![ey_beta, ey_theta, o, swing_y, swing_y - k(ZT) * q[4].cos(), o, o],
            vec![ex_beta, ex_theta, o, o, o, lift_x, lift_x - k(U) * q[6].cos()],
            vec![ey_beta, ey_theta, o, o, o, lift_y, lift_y - k(U) * q[6].sin()],
        ]
    }
}

/// `sum_i multipliers_i directions_i`
fn combine<S: Scalar>(directions: &[Vec<S>], multipliers: &[S], column: usize) -> S {
    directions.iter().zip(multipliers).fold(S::from(0.0), |sum, (row, &l)| sum + row[column] * l)
}

fn along<S: Scalar>(direction: &[S], v: &[S]) -> S {
    direction.iter().zip(v).fold(S::from(0.0), |sum, (&g, &v)| sum + g * v)
}

impl Equations for Andrews {
    fn dimension(&self) -> usize {
        26
    }

    fn differential(&self) -> Vec<bool> {
        (0..26).map(|i| i < 14).collect()
    }

    fn scale(&self) -> Vec<f64> {
        (0..26).map(|i| [1.0, 100.0, 100.0, 1.0][if i < 14 { i / 7 } else { 2 + (i - 14) / 6 }]).collect()
    }

    fn residual<S: Scalar>(&self, _t: f64, y: &[S], d: &[S], _theta: &[S]) -> Vec<S> {
        let (q, v, force, shift) = (&y[..7], &y[7..14], &y[14..20], &y[20..26]);
        let directions = Self::directions(q);
        let (inertial, applied) = (Self::mass_times(q, &d[7..14]), Self::force(q, v));
        let kinematic = (0..7).map(|i| d[i] - v[i] + combine(&directions, shift, i));
        let dynamic = (0..7).map(|i| inertial[i] - applied[i] + combine(&directions, force, i));
        let velocity = directions.iter().map(|row| along(row, v));
        kinematic.chain(dynamic).chain(Self::constraints(q)).chain(velocity).collect()
    }
}

/// Car axis on a bumpy road: two masses, two constraints, all stiff.
pub struct CarAxis;

const LENGTH: f64 = 1.0;
const HALF_MASS: f64 = 5e-4;
const SPRING_LENGTH: f64 = 0.5;
const BUMP: f64 = 0.1;
const FREQUENCY: f64 = 10.0;

impl Equations for CarAxis {
    fn dimension(&self) -> usize {
        12
    }

    fn differential(&self) -> Vec<bool> {
        (0..12).map(|i| i < 8).collect()
    }

    fn scale(&self) -> Vec<f64> {
        vec![1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1e-2, 1e-2, 1.0, 1.0]
    }

    fn residual<S: Scalar>(&self, t: f64, y: &[S], d: &[S], _theta: &[S]) -> Vec<S> {
        let k = S::from;
        let (yb, yb_rate) = (BUMP * (FREQUENCY * t).sin(), BUMP * FREQUENCY * (FREQUENCY * t).cos());
        let xb = (LENGTH * LENGTH - yb * yb).sqrt();
        let xb_rate = -yb * yb_rate / xb;
        let (p, v, force, shift) = (&y[..4], &y[4..8], &y[8..10], &y[10..12]);
        let spring = |x: S, y: S| (k(SPRING_LENGTH) / (x * x + y * y).sqrt()) - k(1.0);
        let (left, right) = (spring(p[0], p[1]), spring(p[2] - k(xb), p[3] - k(yb)));
        let weight = k(HALF_MASS);
        let applied = [left * p[0], left * p[1] - weight, right * (p[2] - k(xb)), right * (p[3] - k(yb)) - weight];
        let (dx, dy) = (p[0] - p[2], p[1] - p[3]);
        let two = k(2.0);
        let directions = vec![vec![k(xb), k(yb), k(0.0), k(0.0)], vec![two * dx, two * dy, -(two * dx), -(two * dy)]];
        let kinematic = (0..4).map(|i| d[i] - v[i] + combine(&directions, shift, i));
        let dynamic = (0..4).map(|i| weight * d[4 + i] - applied[i] - combine(&directions, force, i));
        let position = [p[0] * k(xb) + p[1] * k(yb), dx * dx + dy * dy - k(LENGTH * LENGTH)];
        let velocity = [along(&directions[0], v) + p[0] * k(xb_rate) + p[1] * k(yb_rate), along(&directions[1], v)];
        kinematic.chain(dynamic).chain(position).chain(velocity).collect()
    }
}
