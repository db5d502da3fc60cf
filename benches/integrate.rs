//! The integrators on a quarter vehicle with dry friction (problem P1 of the shared benchmarks), its right-hand side
//! written by hand: what the integrators cost, apart from the evaluation of compiled models.

use criterion::{Criterion, criterion_group, criterion_main};
use ident::integrate::{Dynamics, MethodChoice, Options, Start, integrate};
use ident::linear::SparsityPattern;
use std::f64::consts::PI;
use std::hint::black_box;

const SPRUNG_MASS: f64 = 400.0;
const TYRE_DAMPING: f64 = 150.0;
const NORMAL_FORCE: f64 = 2000.0;
const CREEP: f64 = 1e-3;
const ACTUATOR: f64 = 2.0 * PI * 25.0;
const ACTUATOR_DAMPING: f64 = 0.7;
const LARGEST_ACCELERATION: f64 = 60.0;

/// (za, va, zu, vu, zs, vs); parameters k_s, k_t, m_u, then slope, knee and ratio of extension and compression, mu.
struct QuarterVehicle {
    theta: [f64; 10],
    sines: Vec<(f64, f64, f64)>,
    pattern: SparsityPattern,
    parameter_pattern: SparsityPattern,
}

/// Intermediate values shared by rates and derivatives.
struct Forces {
    actuator_acceleration: f64,
    actuator_slope: f64,
    tyre: f64,
    strut: f64,
    rate: f64,
    root: f64,
    friction: f64,
}

impl QuarterVehicle {
    fn new() -> Self {
        let golden = 0.6180339887498949;
        let sines = (1..=16)
            .map(|i| {
                let frequency = 0.5 * 50f64.powf((i - 1) as f64 / 15.0);
                (0.012 / frequency, 2.0 * PI * frequency, 2.0 * PI * (i as f64 * golden).fract())
            })
            .collect();
        let by_state = [
            (0, 0),
            (0, 1),
            (1, 0),
            (1, 1),
            (2, 2),
            (2, 3),
            (3, 0),
            (3, 1),
            (3, 2),
            (3, 3),
            (3, 4),
            (3, 5),
            (4, 4),
            (4, 5),
            (5, 2),
            (5, 3),
            (5, 4),
            (5, 5),
        ];
        let by_parameter = [
            (3, 0),
            (5, 0),
            (3, 1),
            (3, 2),
            (3, 3),
            (5, 3),
            (3, 4),
            (5, 4),
            (3, 5),
            (5, 5),
            (3, 6),
            (5, 6),
            (3, 7),
            (5, 7),
            (3, 8),
            (5, 8),
            (3, 9),
            (5, 9),
        ];
        Self {
            theta: [20000.0, 200000.0, 40.0, 3000.0, 0.12, 0.25, 1500.0, 0.15, 0.30, 0.05],
            sines,
            pattern: SparsityPattern::from_entries(6, 6, &by_state),
            parameter_pattern: SparsityPattern::from_entries(6, 10, &by_parameter),
        }
    }

    /// Slope, knee and ratio of the branch in charge, and its first parameter.
    fn branch(&self, rate: f64) -> ([f64; 3], usize) {
        let first = if rate >= 0.0 { 3 } else { 6 };
        ([self.theta[first], self.theta[first + 1], self.theta[first + 2]], first)
    }

    fn forces(&self, t: f64, y: &[f64]) -> Forces {
        let command: f64 = self.sines.iter().map(|(a, w, phase)| a * (w * t + phase).sin()).sum();
        let demand =
            (ACTUATOR * ACTUATOR * (command - y[0]) - 2.0 * ACTUATOR_DAMPING * ACTUATOR * y[1]) / LARGEST_ACCELERATION;
        let saturated = demand.tanh();
        let rate = y[5] - y[3];
        let ([slope, knee, ratio], _) = self.branch(rate);
        let root = 1.0 / (1.0 + (rate / knee) * (rate / knee)).sqrt();
        let friction = (rate / CREEP).tanh();
        Forces {
            actuator_acceleration: LARGEST_ACCELERATION * saturated,
            actuator_slope: 1.0 - saturated * saturated,
            tyre: self.theta[1] * (y[0] - y[2]) + TYRE_DAMPING * (y[1] - y[3]),
            strut: self.theta[0] * (y[4] - y[2])
                + slope * rate * (ratio + (1.0 - ratio) * root)
                + self.theta[9] * NORMAL_FORCE * friction,
            rate,
            root,
            friction,
        }
    }

    fn rates(&self, y: &[f64], forces: &Forces, rates: &mut [f64]) {
        let acceleration = (forces.tyre + forces.strut) / self.theta[2];
        rates.copy_from_slice(&[
            y[1],
            forces.actuator_acceleration,
            y[3],
            acceleration,
            y[5],
            -forces.strut / SPRUNG_MASS,
        ]);
    }

    fn jacobian_values(&self, forces: &Forces, c: f64, values: &mut [f64]) {
        let ([slope, knee, ratio], _) = self.branch(forces.rate);
        let relative = forces.rate / knee;
        let by_rate = slope
            * (ratio + (1.0 - ratio) * forces.root * (1.0 - relative * relative * forces.root * forces.root))
            + self.theta[9] * NORMAL_FORCE * (1.0 - forces.friction * forces.friction) / CREEP;
        let (ks, kt, m) = (self.theta[0], self.theta[1], self.theta[2]);
        let actuator = forces.actuator_slope * ACTUATOR;
        values.copy_from_slice(&[
            c,
            actuator * ACTUATOR,
            -kt / m,
            -1.0,
            c + 2.0 * actuator * ACTUATOR_DAMPING,
            -TYRE_DAMPING / m,
            c,
            (kt + ks) / m,
            -ks / SPRUNG_MASS,
            -1.0,
            c + (TYRE_DAMPING + by_rate) / m,
            -by_rate / SPRUNG_MASS,
            -ks / m,
            c,
            ks / SPRUNG_MASS,
            -by_rate / m,
            -1.0,
            c + by_rate / SPRUNG_MASS,
        ]);
    }

    fn parameter_values(&self, y: &[f64], forces: &Forces, values: &mut [f64]) {
        let ([slope, knee, ratio], first) = self.branch(forces.rate);
        let m = self.theta[2];
        let relative = forces.rate / knee;
        let by_knee = slope * forces.rate * (1.0 - ratio) * forces.root.powi(3) * relative * relative / knee;
        let branch =
            [forces.rate * (ratio + (1.0 - ratio) * forces.root), by_knee, slope * forces.rate * (1.0 - forces.root)];
        let mut strut = [0.0; 10];
        strut[0] = y[4] - y[2];
        strut[first..first + 3].copy_from_slice(&branch);
        strut[9] = NORMAL_FORCE * forces.friction;
        values[0] = -strut[0] / m;
        values[1] = strut[0] / SPRUNG_MASS;
        values[2] = -(y[0] - y[2]) / m;
        values[3] = (forces.tyre + forces.strut) / (m * m);
        for j in 3..10 {
            values[4 + 2 * (j - 3)] = -strut[j] / m;
            values[5 + 2 * (j - 3)] = strut[j] / SPRUNG_MASS;
        }
    }
}

impl Dynamics for QuarterVehicle {
    fn dimension(&self) -> usize {
        6
    }

    fn parameter_count(&self) -> usize {
        10
    }

    fn differential(&self) -> &[bool] {
        &[true; 6]
    }

    fn scale(&self) -> &[f64] {
        &[0.01, 0.1, 0.01, 0.1, 0.01, 0.1]
    }

    fn parameter_scale(&self) -> &[f64] {
        &self.theta
    }

    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        self.explicit_rates(t, y, residual);
        residual.iter_mut().zip(y_prime).for_each(|(r, d)| *r = d - *r);
    }

    fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    fn jacobian(&mut self, t: f64, y: &[f64], _y_prime: &[f64], c: f64, values: &mut [f64]) {
        let forces = self.forces(t, y);
        self.jacobian_values(&forces, c, values);
    }

    fn parameter_derivative(&mut self, t: f64, y: &[f64], y_prime: &[f64], values: &mut [f64]) {
        let mut entries = [0.0; 18];
        self.parameter_entries(t, y, y_prime, &mut entries);
        values.fill(0.0);
        for ((row, column), value) in self.parameter_pattern.entries().zip(entries) {
            values[column * 6 + row] = value;
        }
    }

    fn parameter_pattern(&self) -> Option<&SparsityPattern> {
        Some(&self.parameter_pattern)
    }

    fn parameter_entries(&mut self, t: f64, y: &[f64], _y_prime: &[f64], values: &mut [f64]) {
        let forces = self.forces(t, y);
        self.parameter_values(y, &forces, values);
    }

    fn explicit_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> bool {
        let forces = self.forces(t, y);
        self.rates(y, &forces, rates);
        true
    }

    fn linearised_rates(
        &mut self,
        t: f64,
        y: &[f64],
        rates: &mut [f64],
        jacobian: &mut [f64],
        parameter: &mut [f64],
    ) -> bool {
        let forces = self.forces(t, y);
        self.rates(y, &forces, rates);
        self.jacobian_values(&forces, 0.0, jacobian);
        self.parameter_values(y, &forces, parameter);
        true
    }
}

fn start(with_sensitivity: bool) -> Start {
    let sensitivity = if with_sensitivity { vec![0.0; 60] } else { Vec::new() };
    Start { time: 0.0, y: vec![0.0; 6], y_prime: vec![0.0; 6], sensitivity }
}

fn times() -> Vec<f64> {
    (0..=10_000).map(|i| i as f64 * 1e-3).collect()
}

/// Outputs zs - zu, zu - za, vs, vu of a row of states.
fn outputs(y: &[f64]) -> [f64; 4] {
    [y[4] - y[2], y[2] - y[0], y[5], y[3]]
}

/// Errors of outputs and of their scaled gradient against a run with a far tighter tolerance, as the shared benchmarks
/// measure them.
fn errors(vehicle: &mut QuarterVehicle, options: &Options, reference: &(Vec<f64>, Vec<f64>)) -> (f64, f64, String) {
    let times = times();
    let solution = integrate(vehicle, &start(true), &times, &[], options).expect("the problem can be solved");
    let nominal = integrate(vehicle, &start(false), &times, &[], options).expect("the problem can be solved");
    let of = |y: &[f64]| -> Vec<[f64; 4]> { y.chunks_exact(6).map(outputs).collect() };
    let (ours, exact) = (of(&nominal.y), of(&reference.0));
    let state = (0..4).map(|c| {
        let size = exact.iter().fold(0.0f64, |a, y| a.max(y[c].abs()));
        ours.iter().zip(&exact).fold(0.0f64, |a, (y, e)| a.max((y[c] - e[c]).abs())) / size
    });
    let mut worst = 0.0f64;
    for c in 0..4 {
        let column = |s: &[f64], j: usize| -> Vec<f64> {
            s.chunks_exact(60).map(|block| outputs(&block[j * 6..j * 6 + 6])[c] * vehicle.theta[j]).collect()
        };
        let exact: Vec<Vec<f64>> = (0..10).map(|j| column(&reference.1, j)).collect();
        let sizes: Vec<f64> = exact.iter().map(|e| e.iter().fold(0.0f64, |a, v| a.max(v.abs()))).collect();
        let largest = sizes.iter().fold(0.0f64, |a, v| a.max(*v));
        for j in 0..10 {
            let ours = column(&solution.sensitivity, j);
            let error = ours.iter().zip(&exact[j]).fold(0.0f64, |a, (x, e)| a.max((x - e).abs()));
            worst = worst.max(error / sizes[j].max(1e-3 * largest));
        }
    }
    let work = &solution.work;
    let counts = format!(
        "{} + {} steps nominal, {} + {} with gradient, {}, switches {:?}",
        nominal.work.steps, nominal.work.rejected_error, work.steps, work.rejected_error, work.reason, work.switches
    );
    (state.fold(0.0, f64::max), worst, counts)
}

fn report_errors(vehicle: &mut QuarterVehicle) {
    let tight = Options { relative_tolerance: 1e-11, method: MethodChoice::RungeKutta, ..Options::default() };
    let reference = integrate(vehicle, &start(true), &times(), &[], &tight).expect("the problem can be solved");
    let reference = (reference.y, reference.sensitivity);
    for method in [MethodChoice::Automatic, MethodChoice::Bdf] {
        for tolerance in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
            let options = Options { relative_tolerance: tolerance, method, ..Options::default() };
            let began = std::time::Instant::now();
            let (state, gradient, counts) = errors(vehicle, &options, &reference);
            println!(
                "{method:?} {tolerance:.0e}: output error {state:.1e}, gradient error {gradient:.1e}; {counts}; both runs {:?}",
                began.elapsed()
            );
        }
    }
}

fn quarter_vehicle(criterion: &mut Criterion) {
    let mut vehicle = QuarterVehicle::new();
    if std::env::var_os("IDENT_BENCH_ERRORS").is_some() {
        report_errors(&mut vehicle);
    }
    let times = times();
    let mut group = criterion.benchmark_group("quarter vehicle");
    group.sample_size(20);
    group.bench_function("rates", |b| {
        let mut rates = [0.0; 6];
        b.iter(|| vehicle.explicit_rates(black_box(1.234), &[0.01, 0.1, 0.01, 0.2, 0.005, 0.1], &mut rates));
    });
    for (name, gradient, tolerance) in [
        ("nominal 1e-6", false, 1e-6),
        ("gradient 1e-6", true, 1e-6),
        ("nominal 1e-4", false, 1e-4),
        ("gradient 1e-4", true, 1e-4),
    ] {
        let options = Options { relative_tolerance: tolerance, ..Options::default() };
        group.bench_function(name, |b| b.iter(|| integrate(&mut vehicle, &start(gradient), &times, &[], &options)));
    }
    let options = Options { method: MethodChoice::Bdf, ..Options::default() };
    group.bench_function("BDF nominal 1e-6", |b| {
        b.iter(|| integrate(&mut vehicle, &start(false), &times, &[], &options))
    });
    group.finish();
}

criterion_group!(benches, quarter_vehicle);
criterion_main!(benches);
