//! Test problems.

use crate::scalar::Scalar;
use crate::system::Equations;

/// `x'' + 2 d w x' + w^2 x = 0` with parameters (w, d).
pub struct Oscillator;

impl Equations for Oscillator {
    fn dimension(&self) -> usize {
        2
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        let (w, d) = (theta[0], theta[1]);
        Some(vec![y[1], -(S::from(2.0) * d * w * y[1]) - w * w * y[0]])
    }
}

impl Oscillator {
    /// Position for x(0) = 1, x'(0) = 0.
    pub fn exact<S: Scalar>(t: f64, w: S, d: S) -> S {
        let damped = w * (S::from(1.0) - d * d).sqrt();
        let phase = damped * S::from(t);
        (-(d * w * S::from(t))).exp() * (phase.cos() + d * w / damped * phase.sin())
    }
}

/// The oscillator with its velocity and its force as algebraic components (index 1).
pub struct OscillatorWithForce;

impl Equations for OscillatorWithForce {
    fn dimension(&self) -> usize {
        3
    }

    fn differential(&self) -> Vec<bool> {
        vec![true, true, false]
    }

    fn residual<S: Scalar>(&self, _t: f64, y: &[S], y_prime: &[S], theta: &[S]) -> Vec<S> {
        let (w, d) = (theta[0], theta[1]);
        vec![y_prime[0] - y[1], y_prime[1] - y[2], y[2] + S::from(2.0) * d * w * y[1] + w * w * y[0]]
    }
}

pub struct Robertson;

impl Equations for Robertson {
    fn dimension(&self) -> usize {
        3
    }

    fn scale(&self) -> Vec<f64> {
        vec![1e-4, 1e-10, 1.0]
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        let (a, b, c) = (theta[0] * y[0], theta[1] * y[1] * y[2], theta[2] * y[1] * y[1]);
        Some(vec![b - a, a - b - c, c])
    }
}

pub const ROBERTSON: [f64; 3] = [0.04, 1e4, 3e7];

pub struct Hires;

impl Equations for Hires {
    fn dimension(&self) -> usize {
        8
    }

    fn scale(&self) -> Vec<f64> {
        vec![1e-3; 8]
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        let k = S::from;
        let meeting = k(280.0) * y[5] * y[7];
        Some(vec![
            k(-1.71) * y[0] + k(0.43) * y[1] + k(8.32) * y[2] + k(0.0007),
            k(1.71) * y[0] - k(8.75) * y[1],
            k(-10.03) * y[2] + k(0.43) * y[3] + k(0.035) * y[4],
            k(8.32) * y[1] + k(1.71) * y[2] - k(1.12) * y[3],
            k(-1.745) * y[4] + k(0.43) * y[5] + k(0.43) * y[6],
            k(0.69) * y[3] + k(1.71) * y[4] - k(0.43) * y[5] + k(0.69) * y[6] - meeting,
            meeting - k(1.81) * y[6],
            k(1.81) * y[6] - meeting,
        ])
    }
}

pub struct Pollution;

/// Rate constants and the one or two reactants of each reaction (counted from 1; 0: none).
const REACTIONS: [(f64, usize, usize); 25] = [
    (0.350, 1, 0),
    (0.266e2, 2, 4),
    (0.123e5, 5, 2),
    (0.860e-3, 7, 0),
    (0.820e-3, 7, 0),
    (0.150e5, 7, 6),
    (0.130e-3, 9, 0),
    (0.240e5, 9, 6),
    (0.165e5, 11, 2),
    (0.900e4, 11, 1),
    (0.220e-1, 13, 0),
    (0.120e5, 10, 2),
    (0.188e1, 14, 0),
    (0.163e5, 1, 6),
    (0.480e7, 3, 0),
    (0.350e-3, 4, 0),
    (0.175e-1, 4, 0),
    (0.100e9, 16, 0),
    (0.444e12, 16, 0),
    (0.124e4, 17, 6),
    (0.210e1, 19, 0),
    (0.578e1, 19, 0),
    (0.474e-1, 1, 4),
    (0.178e4, 19, 1),
    (0.312e1, 20, 0),
];

/// Per component the reactions that consume (negative) and make it; 4 and 18 count twice where listed twice.
const BALANCE: [&[i32]; 20] = [
    &[-1, -10, -14, -23, -24, 2, 3, 9, 11, 12, 22, 25],
    &[-2, -3, -9, -12, 1, 21],
    &[-15, 1, 17, 19, 22],
    &[-2, -16, -17, -23, 15],
    &[-3, 4, 4, 6, 7, 13, 20],
    &[-6, -8, -14, -20, 3, 18, 18],
    &[-4, -5, -6, 13],
    &[4, 5, 6, 7],
    &[-7, -8],
    &[-12, 7, 9],
    &[-9, -10, 8, 11],
    &[9],
    &[-11, 10],
    &[-13, 12],
    &[14],
    &[-18, -19, 16],
    &[-20],
    &[20],
    &[-21, -22, -24, 23, 25],
    &[-25, 24],
];

impl Pollution {
    pub fn initial() -> Vec<f64> {
        let mut y = vec![0.0; 20];
        for (component, value) in [(2, 0.2), (4, 0.04), (7, 0.1), (8, 0.3), (9, 0.01), (17, 0.007)] {
            y[component - 1] = value;
        }
        y
    }
}

impl Equations for Pollution {
    fn dimension(&self) -> usize {
        20
    }

    fn scale(&self) -> Vec<f64> {
        vec![
            1e-1, 1e-1, 1e-8, 1e-2, 1e-6, 1e-6, 1e-1, 1e-1, 1e-2, 1e-7, 1e-7, 1e-3, 1e-3, 1e-4, 1e-2, 1e-17, 1e-2,
            1e-4, 1e-5, 1e-4,
        ]
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        let reaction = |&(k, a, b): &(f64, usize, usize)| {
            let rate = S::from(k) * y[a - 1];
            if b == 0 { rate } else { rate * y[b - 1] }
        };
        let rates: Vec<S> = REACTIONS.iter().map(reaction).collect();
        let sum = |terms: &&[i32]| {
            terms.iter().fold(S::from(0.0), |sum, &j| {
                let rate = rates[j.unsigned_abs() as usize - 1];
                if j > 0 { sum + rate } else { sum - rate }
            })
        };
        Some(BALANCE.iter().map(sum).collect())
    }
}

/// Scaled form, parameter eps.
pub struct VanDerPol;

impl Equations for VanDerPol {
    fn dimension(&self) -> usize {
        2
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        Some(vec![y[1], ((S::from(1.0) - y[0] * y[0]) * y[1] - y[0]) / theta[0]])
    }
}

/// Seven bodies; x, y, x', y'.
pub struct Pleiades;

impl Pleiades {
    pub fn initial() -> Vec<f64> {
        let x = [3.0, 3.0, -1.0, -3.0, 2.0, -2.0, 2.0];
        let y = [3.0, -3.0, 2.0, 0.0, 0.0, -4.0, 4.0];
        let u = [0.0, 0.0, 0.0, 0.0, 0.0, 1.75, -1.5];
        let v = [0.0, 0.0, 0.0, -1.25, 1.0, 0.0, 0.0];
        [x, y, u, v].concat()
    }
}

impl Equations for Pleiades {
    fn dimension(&self) -> usize {
        28
    }

    fn rates<S: Scalar>(&self, _t: f64, z: &[S], _theta: &[S]) -> Option<Vec<S>> {
        let mut rates = z[14..].to_vec();
        rates.resize(28, S::from(0.0));
        for i in 0..7 {
            for j in (0..7).filter(|&j| j != i) {
                let (dx, dy) = (z[j] - z[i], z[7 + j] - z[7 + i]);
                let square = dx * dx + dy * dy;
                let factor = S::from((j + 1) as f64) / (square * square.sqrt());
                rates[14 + i] = rates[14 + i] + factor * dx;
                rates[21 + i] = rates[21 + i] + factor * dy;
            }
        }
        Some(rates)
    }
}

/// Eight node voltages, singular mass matrix.
pub struct TransistorAmplifier;

impl TransistorAmplifier {
    pub const Y: [f64; 8] = [0.0, 3.0, 3.0, 6.0, 3.0, 3.0, 6.0, 0.0];
    pub const Y_PRIME: [f64; 8] =
        [51.338775, 51.338775, -166.666667, -24.9757667, -24.9757667, -83.333333, -10.00564453, -10.00564453];
}

impl Equations for TransistorAmplifier {
    fn dimension(&self) -> usize {
        8
    }

    fn residual<S: Scalar>(&self, t: f64, y: &[S], d: &[S], _theta: &[S]) -> Vec<S> {
        let k = S::from;
        let diode = |u: S| k(1e-6) * ((u / k(0.026)).exp() - k(1.0));
        let source = k(0.1 * (200.0 * std::f64::consts::PI * t).sin());
        let c = |i: f64| k(i * 1e-6);
        let r = k(9000.0);
        let two = k(2.0);
        let (first, second) = (diode(y[1] - y[2]), diode(y[4] - y[5]));
        vec![
            c(1.0) * (d[1] - d[0]) + (source - y[0]) / k(1000.0),
            c(1.0) * (d[0] - d[1]) + k(6.0) / r - two * y[1] / r + k(0.99 - 1.0) * first,
            first - y[2] / r - c(2.0) * d[2],
            c(3.0) * (d[4] - d[3]) + (k(6.0) - y[3]) / r - k(0.99) * first,
            c(3.0) * (d[3] - d[4]) + k(6.0) / r - two * y[4] / r + k(0.99 - 1.0) * second,
            second - y[5] / r - c(4.0) * d[5],
            c(5.0) * (d[7] - d[6]) + (k(6.0) - y[6]) / r - k(0.99) * second,
            c(5.0) * (d[6] - d[7]) - y[7] / r,
        ]
    }
}

/// Pendulum of length 1 and parameter g in Gear-Gupta-Leimkuhler form: position, velocity, force and velocity
/// multipliers (index 2).
pub struct Pendulum;

impl Equations for Pendulum {
    fn dimension(&self) -> usize {
        6
    }

    fn differential(&self) -> Vec<bool> {
        vec![true, true, true, true, false, false]
    }

    fn residual<S: Scalar>(&self, _t: f64, y: &[S], d: &[S], theta: &[S]) -> Vec<S> {
        let (px, py, vx, vy, force, shift) = (y[0], y[1], y[2], y[3], y[4], y[5]);
        vec![
            d[0] - vx + px * shift,
            d[1] - vy + py * shift,
            d[2] + px * force,
            d[3] + py * force + theta[0],
            (px * px + py * py - S::from(1.0)) * S::from(0.5),
            px * vx + py * vy,
        ]
    }
}

/// Chemical Akzo Nobel problem, index 1 (Mazzia-Magherini-2008); one equation is algebraic.
pub struct AkzoNobel;

impl AkzoNobel {
    pub fn initial() -> Vec<f64> {
        vec![0.444, 0.00123, 0.0, 0.007, 0.0, 115.83 * 0.444 * 0.007]
    }

    /// At t = 180 min, as published with the problem.
    pub const END: [f64; 6] = [
        0.1150794920661702,
        0.1203831471567715e-2,
        0.1611562887407974,
        0.3656156421249283e-3,
        0.1708010885264404e-1,
        0.4873531310307455e-2,
    ];
}

impl Equations for AkzoNobel {
    fn dimension(&self) -> usize {
        6
    }

    fn differential(&self) -> Vec<bool> {
        vec![true, true, true, true, true, false]
    }

    fn scale(&self) -> Vec<f64> {
        vec![1e-3; 6]
    }

    fn residual<S: Scalar>(&self, _t: f64, y: &[S], d: &[S], _theta: &[S]) -> Vec<S> {
        let k = S::from;
        let root = y[1].sqrt();
        let square = y[0] * y[0];
        let r1 = k(18.7) * square * square * root;
        let r2 = k(0.58) * y[2] * y[3];
        let r3 = k(0.58 / 34.4) * y[0] * y[4];
        let r4 = k(0.09) * y[0] * y[3] * y[3];
        let r5 = k(0.42) * y[5] * y[5] * root;
        let inflow = k(3.3) * (k(0.9 / 737.0) - y[1]);
        let rates = [
            -(k(2.0) * r1) + r2 - r3 - r4,
            inflow - k(0.5) * r1 - r4 - k(0.5) * r5,
            r1 - r2 + r3,
            r3 - r2 - k(2.0) * r4,
            r2 - r3 + r5,
        ];
        let mut rows: Vec<S> = (0..5).map(|i| d[i] - rates[i]).collect();
        rows.push(k(115.83) * y[0] * y[3] - y[5]);
        rows
    }
}
