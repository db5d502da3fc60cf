//! An elastic arm on a driven hub, with a payload at its end, turning in a horizontal plane: finite elements of the
//! beam (cubic shapes) in axes that turn with the hub.
//!
//! Kinetic energy to second order in the deflection `w`: `J t'^2 / 2 + t' (m . w') + w' M w' / 2 + t'^2 w (M - G) w /
//! 2` with the hub's angle `t`; `G` is what the centrifugal tension stiffens (Schwertassek-Wallrapp-1999).

use super::excitation::Multisine;
use super::random::Random;
use super::record::{NOISE, Record, rms, rounded};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

pub const LENGTH: f64 = 0.8;
pub const MASS: f64 = 0.42;
/// Bending stiffness that the drawing promises, N m^2.
pub const STIFFNESS: f64 = 16.0;
/// The arm's frequencies are these times those of the drawing.
pub const FREQUENCY_SCALE: f64 = 0.94;
/// Of the first two modes of the clamped arm.
pub const DAMPING_RATIO: f64 = 0.012;
pub const HUB_INERTIA: f64 = 0.06;
pub const HUB_DAMPING: f64 = 0.5;
pub const PAYLOAD: f64 = 0.18;
/// Of the payload about the arm's end, kg m^2.
pub const PAYLOAD_INERTIA: f64 = 1.5e-4;

const ELEMENTS: usize = 6;
const SAMPLING: f64 = 200.0;
const DURATION: f64 = 5.0;
const SUBSTEPS: usize = 40;
const TORQUE: f64 = 1.2;

/// Matrices of the clamped arm with its payload; deflection and slope at every node but the first.
struct Arm {
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
    tension: DMatrix<f64>,
    /// Of the hub's acceleration on the deflections.
    coupling: DVector<f64>,
    /// Of the undeformed arm with hub and payload.
    inertia: f64,
    inverse: Cholesky<f64, Dyn>,
}

/// Values, first and second derivatives of the four cubic shapes of an element of length `h` at `s` of 0 .. 1.
fn shapes(s: f64, h: f64) -> [[f64; 4]; 3] {
    let values = [
        1.0 - 3.0 * s * s + 2.0 * s.powi(3),
        h * (s - 2.0 * s * s + s.powi(3)),
        3.0 * s * s - 2.0 * s.powi(3),
        h * (s.powi(3) - s * s),
    ];
    let slopes =
        [(6.0 * s * s - 6.0 * s) / h, 1.0 - 4.0 * s + 3.0 * s * s, (6.0 * s - 6.0 * s * s) / h, 3.0 * s * s - 2.0 * s];
    let bends = [(12.0 * s - 6.0) / h / h, (6.0 * s - 4.0) / h, (6.0 - 12.0 * s) / h / h, (6.0 * s - 2.0) / h];
    [values, slopes, bends]
}

/// Gauss's four points on 0 .. 1: exact for every integral here.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

impl Arm {
    fn new(payload: f64) -> Self {
        let size = 2 * ELEMENTS;
        let (h, density) = (LENGTH / ELEMENTS as f64, MASS / LENGTH);
        let bending = STIFFNESS * FREQUENCY_SCALE * FREQUENCY_SCALE;
        let mut mass = DMatrix::zeros(size, size);
        let mut stiffness = mass.clone();
        let mut tension = mass.clone();
        let mut coupling = DVector::zeros(size);
        for element in 0..ELEMENTS {
            for (s, weight) in GAUSS {
                let [values, slopes, bends] = shapes(s, h);
                let x = (element as f64 + s) * h;
                let pull = density * (LENGTH * LENGTH - x * x) / 2.0 + payload * LENGTH;
                for i in (0..4).filter(|i| 2 * element + i >= 2) {
                    let row = 2 * element + i - 2;
                    coupling[row] += weight * h * density * x * values[i];
                    for j in (0..4).filter(|j| 2 * element + j >= 2) {
                        let column = 2 * element + j - 2;
                        mass[(row, column)] += weight * h * density * values[i] * values[j];
                        stiffness[(row, column)] += weight * h * bending * bends[i] * bends[j];
                        tension[(row, column)] += weight * h * pull * slopes[i] * slopes[j];
                    }
                }
            }
        }
        // Damping in proportion to mass and stiffness of the arm alone, equal for its first two modes.
        let first = (bending / density).sqrt() * (1.875_104 / LENGTH).powi(2);
        let second = (bending / density).sqrt() * (4.694_091 / LENGTH).powi(2);
        let share = 2.0 * DAMPING_RATIO / (first + second);
        let damping = share * first * second * &mass + share * &stiffness;
        let payload_inertia = PAYLOAD_INERTIA * payload / PAYLOAD;
        let (end, slope) = (size - 2, size - 1);
        mass[(end, end)] += payload;
        mass[(slope, slope)] += payload_inertia;
        coupling[end] += payload * LENGTH;
        coupling[slope] += payload_inertia;
        let inertia = HUB_INERTIA + MASS * LENGTH * LENGTH / 3.0 + payload * LENGTH * LENGTH + payload_inertia;
        let inverse = Cholesky::new(mass.clone()).expect("a mass matrix");
        Self { mass, stiffness, damping, tension, coupling, inertia, inverse }
    }

    /// Accelerations of hub and deflections.
    fn accelerations(&self, state: &State, torque: f64) -> (f64, DVector<f64>) {
        let softer = (&self.mass - &self.tension) * &state.w;
        let load = state.spin * state.spin * &softer - &self.stiffness * &state.w - &self.damping * &state.rate;
        let (by_load, by_hub) = (self.inverse.solve(&load), self.inverse.solve(&self.coupling));
        let coriolis = 2.0 * state.spin * softer.dot(&state.rate);
        let driving = torque - HUB_DAMPING * state.spin - coriolis - self.coupling.dot(&by_load);
        let hub = driving / (self.inertia + softer.dot(&state.w) - self.coupling.dot(&by_hub));
        (hub, by_load - hub * by_hub)
    }
}

#[derive(Clone)]
struct State {
    angle: f64,
    spin: f64,
    w: DVector<f64>,
    rate: DVector<f64>,
}

impl State {
    fn moved(&self, rates: &State, h: f64) -> State {
        State {
            angle: self.angle + h * rates.angle,
            spin: self.spin + h * rates.spin,
            w: &self.w + h * &rates.w,
            rate: &self.rate + h * &rates.rate,
        }
    }
}

/// Angle of the hub in deg, lateral acceleration of the payload in its own axes, bending moment at the root.
fn measured(arm: &Arm, state: &State, torque: f64) -> [f64; 3] {
    let (hub, bending) = arm.accelerations(state, torque);
    let (end, slope) = (2 * ELEMENTS - 2, 2 * ELEMENTS - 1);
    let (w, rate) = (state.w[end], state.rate[end]);
    let across = LENGTH * hub + bending[end] - state.spin * state.spin * w;
    let along = -LENGTH * state.spin * state.spin - 2.0 * state.spin * rate - hub * w;
    let turned = state.w[slope];
    let root = torque - HUB_DAMPING * state.spin - HUB_INERTIA * hub;
    [state.angle.to_degrees(), across * turned.cos() - along * turned.sin(), root]
}

/// Classical Runge-Kutta at fixed fine steps from rest.
pub fn turning(seed: u64, level: f64) -> Record {
    let arm = Arm::new(PAYLOAD);
    let torque = Multisine::new(seed, (0.4, 12.0), 20, 0.3, level * TORQUE, 0.4);
    let rest = DVector::zeros(2 * ELEMENTS);
    let mut state = State { angle: 0.0, spin: 0.0, w: rest.clone(), rate: rest };
    let rates = |t: f64, state: &State| {
        let (hub, bending) = arm.accelerations(state, torque.value(t));
        State { angle: state.spin, spin: hub, w: state.rate.clone(), rate: bending }
    };
    let h = 1.0 / (SAMPLING * SUBSTEPS as f64);
    let samples = (DURATION * SAMPLING) as usize + 1;
    let (mut time, mut command) = (vec![], vec![]);
    let mut noise_free = vec![vec![]; 3];
    for k in 0..samples {
        let t = k as f64 / SAMPLING;
        time.push(t);
        command.push(rounded(torque.value(t), 7));
        for (channel, value) in noise_free.iter_mut().zip(measured(&arm, &state, torque.value(t))) {
            channel.push(value);
        }
        for step in 0..SUBSTEPS {
            let t = t + step as f64 * h;
            let a = rates(t, &state);
            let b = rates(t + h / 2.0, &state.moved(&a, h / 2.0));
            let c = rates(t + h / 2.0, &state.moved(&b, h / 2.0));
            let d = rates(t + h, &state.moved(&c, h));
            for (rates, share) in [(&a, 1.0), (&b, 2.0), (&c, 2.0), (&d, 1.0)] {
                state = state.moved(rates, h * share / 6.0);
            }
        }
    }
    let mut random = Random::new(seed ^ 0x05EE_D0F4_015E);
    let mut columns = vec![time, command];
    for values in &noise_free {
        let deviation = NOISE * rms(values);
        columns.push(values.iter().map(|value| rounded(value + deviation * random.normal(), 5)).collect());
    }
    let heads = ["t [s]", "torque [N*m]", "angle [deg]", "a_tip [m/s^2]", "M_root [N*m]"].map(str::to_owned).to_vec();
    Record { heads, columns, noise_free }
}

/// Frequencies (Hz) of the elements, clamped and without payload, ascending.
pub fn frequencies_of_elements() -> Vec<f64> {
    let arm = Arm::new(0.0);
    let mut squares: Vec<f64> =
        arm.inverse.solve(&arm.stiffness).complex_eigenvalues().iter().map(|value| value.re).collect();
    squares.sort_by(f64::total_cmp);
    squares.into_iter().map(|square| square.sqrt() / std::f64::consts::TAU).collect()
}

/// The modes of the clamped arm as its drawing has them, from the solution of Euler and Bernoulli: the file that the
/// study reads.
pub fn modes(count: usize) -> String {
    let mut text = format!(
        "# Uniform arm of {LENGTH} m and {MASS} kg along x, EI = {STIFFNESS} N*m^2, clamped at its origin, bending along y.\n\
         mode,frequency [Hz],participation_x [kg],participation_y [kg],participation_z [kg],moment_x [kg*m],moment_y [kg*m],\
         moment_z [kg*m],tip.shift_x,tip.shift_y,tip.shift_z,tip.turn_x [rad/m],tip.turn_y [rad/m],tip.turn_z [rad/m]\n"
    );
    for mode in 1..=count {
        let b = wave_number(mode);
        let sigma = (b.cosh() + b.cos()) / (b.sinh() + b.sin());
        let size = 1.0 / MASS.sqrt();
        let frequency = b * b / (LENGTH * LENGTH) * (STIFFNESS * LENGTH / MASS).sqrt() / std::f64::consts::TAU;
        let participation = MASS * size * 2.0 * sigma / b;
        let moment = MASS * size * 2.0 * LENGTH / (b * b);
        let tip = size * (b.cosh() - b.cos() - sigma * (b.sinh() - b.sin()));
        let turn = size * b / LENGTH * (b.sinh() + b.sin() - sigma * (b.cosh() - b.cos()));
        let row = [frequency, 0.0, participation, 0.0, 0.0, 0.0, moment, 0.0, tip, 0.0, 0.0, 0.0, turn];
        let cells: Vec<String> = row.iter().map(|value| rounded(*value, 10).to_string()).collect();
        text += &format!("{mode},{}\n", cells.join(","));
    }
    text
}

/// Roots of `cos b cosh b = -1`.
fn wave_number(mode: usize) -> f64 {
    let mut b = (mode as f64 - 0.5) * std::f64::consts::PI;
    for _ in 0..50 {
        let value = b.cos() + 1.0 / b.cosh();
        b += value / (b.sin() + b.tanh() / b.cosh());
    }
    b
}
