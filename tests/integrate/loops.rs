//! Constraints (index 2): consistent starts, forces at the start, long runs, sensitivities, equilibria, and what is
//! impossible.

use crate::mechanisms::*;
use crate::problems::Pendulum;
use crate::scalar::Scalar;
use crate::sensitivities::difference_to_frozen;
use crate::system::{Equations, System};
use ident::integrate::{FailureCause, Options, Solution, Start, consistent_start, equilibrium, integrate};

/// Pendulum with parameters gravity and length, in the order of [`Pendulum`]; `copies` of both constraints.
struct Rod {
    copies: usize,
}

impl Equations for Rod {
    fn dimension(&self) -> usize {
        4 + 2 * self.copies
    }

    fn differential(&self) -> Vec<bool> {
        (0..self.dimension()).map(|i| i < 4).collect()
    }

    fn residual<S: Scalar>(&self, _t: f64, y: &[S], d: &[S], theta: &[S]) -> Vec<S> {
        let (px, py, vx, vy) = (y[0], y[1], y[2], y[3]);
        let sum = |first: usize| (0..self.copies).fold(S::from(0.0), |sum, k| sum + y[first + k]);
        let (force, shift) = (sum(4), sum(4 + self.copies));
        let mut rows = vec![d[0] - vx + px * shift, d[1] - vy + py * shift];
        rows.extend([d[2] + px * force, d[3] + py * force + theta[0]]);
        rows.extend((0..self.copies).map(|_| (px * px + py * py - theta[1] * theta[1]) * S::from(0.5)));
        rows.extend((0..self.copies).map(|_| px * vx + py * vy));
        rows
    }
}

const GRAVITY: f64 = 9.81;
const LENGTH: f64 = 1.3;

fn rod() -> System<Rod> {
    System::new(Rod { copies: 1 }, &[GRAVITY, LENGTH])
}

fn assert_near(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < tolerance, "{a} {b}");
    }
}

/// A point far from the circle, which moves with the length: value and derivative.
const GIVEN: [f64; 4] = [0.8, -0.7, 0.5, 0.9];
const GIVEN_SLOPE: [f64; 4] = [0.3, 0.2, -0.1, 0.4];

/// Nearest point on the circle and nearest velocity along it, with their derivatives by the length.
fn nearest() -> ([f64; 4], [f64; 4]) {
    let [x, y, vx, vy] = GIVEN;
    let [dx, dy, dvx, dvy] = GIVEN_SLOPE;
    let radius = x.hypot(y);
    let u = [x / radius, y / radius];
    let along = u[0] * dx + u[1] * dy;
    let du = [(dx - along * u[0]) / radius, (dy - along * u[1]) / radius];
    let normal = u[0] * vx + u[1] * vy;
    let dnormal = du[0] * vx + du[1] * vy + u[0] * dvx + u[1] * dvy;
    let value = [LENGTH * u[0], LENGTH * u[1], vx - normal * u[0], vy - normal * u[1]];
    let slope = [
        u[0] + LENGTH * du[0],
        u[1] + LENGTH * du[1],
        dvx - dnormal * u[0] - normal * du[0],
        dvy - dnormal * u[1] - normal * du[1],
    ];
    (value, slope)
}

fn start_on_circle(system: &mut System<Rod>) -> Start {
    let mut y = GIVEN.to_vec();
    y.resize(6, 0.0);
    let mut sensitivity = vec![0.0; 12];
    sensitivity[6..10].copy_from_slice(&GIVEN_SLOPE);
    consistent_start(system, 0.0, &y, &sensitivity, &[false; 6]).unwrap()
}

#[test]
fn the_start_is_the_nearest_point_and_depends_on_the_parameters_as_that_does() {
    let start = start_on_circle(&mut rod());
    let (value, slope) = nearest();
    assert_near(&start.y[..4], &value, 1e-12);
    assert_near(&start.sensitivity[..4], &[0.0; 4], 1e-12);
    assert_near(&start.sensitivity[6..10], &slope, 1e-9);
}

#[test]
fn fixed_values_stay_and_the_others_follow() {
    let y = [0.5, -0.7, 0.4, 0.1, 0.0, 0.0];
    let fixed = [true, false, true, false, false, false];
    let start = consistent_start(&mut rod(), 0.0, &y, &[], &fixed).unwrap();
    let height = -(LENGTH * LENGTH - 0.25f64).sqrt();
    assert_near(&start.y[..4], &[0.5, height, 0.4, -0.5 * 0.4 / height], 1e-12);
}

#[test]
fn multipliers_at_the_start_follow_from_the_motion_with_their_sensitivities() {
    let mut system = rod();
    let start = start_on_circle(&mut system);
    let solution = integrate(&mut system, &start, &[0.0, 1e-3], &[], &Options::default()).unwrap();
    let ([_, y, vx, vy], [_, dy, dvx, dvy]) = nearest();
    let square = LENGTH * LENGTH;
    let force = (vx * vx + vy * vy - GRAVITY * y) / square;
    let slope = (2.0 * (vx * dvx + vy * dvy) - GRAVITY * dy) / square - 2.0 * force / LENGTH;
    assert_near(&solution.y[4..6], &[force, 0.0], 1e-10);
    assert_near(&[solution.sensitivity[4], solution.sensitivity[10]], &[-y / square, slope], 1e-6);
    assert_near(&[solution.sensitivity[5], solution.sensitivity[11]], &[0.0, 0.0], 1e-6);
}

#[test]
fn published_forces_at_the_start_of_andrews_mechanism_and_the_car_axis_are_met() {
    let mut y = ANDREWS_ANGLES.to_vec();
    y.resize(26, 0.0);
    let start = Start { time: 0.0, y, y_prime: vec![0.0; 26], sensitivity: Vec::new() };
    let solution = integrate(&mut System::new(Andrews, &[]), &start, &[0.0, 1e-6], &[], &Options::default()).unwrap();
    assert_near(&solution.y[14..16], &[98.566_870_396_241_09, -6.122_688_344_255_662], 1e-8);
    assert_near(&solution.y[16..26], &[0.0; 10], 1e-8);

    let y = vec![0.0, 0.5, 1.0, 0.5, -0.5, 0.0, -0.5, 0.0, 7.0, 7.0, 7.0, 7.0];
    let start = Start { time: 0.0, y, y_prime: vec![0.0; 12], sensitivity: Vec::new() };
    let solution = integrate(&mut System::new(CarAxis, &[]), &start, &[0.0, 1e-6], &[], &Options::default()).unwrap();
    assert_near(&solution.y[8..12], &[0.0; 4], 1e-9);
}

#[test]
fn a_start_off_the_constraints_is_refused_with_the_equation() {
    let start = Start { time: 0.0, y: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0], y_prime: vec![0.0; 6], sensitivity: vec![] };
    let failure = integrate(&mut rod(), &start, &[1.0], &[], &Options::default()).unwrap_err();
    assert_eq!((failure.cause, failure.equations), (FailureCause::InconsistentStart, vec![4]));
}

#[test]
fn contradicting_values_are_refused_with_the_equation() {
    let y = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let fixed = [true, true, false, false, false, false];
    let failure = consistent_start(&mut rod(), 0.0, &y, &[], &fixed).unwrap_err();
    assert_eq!((failure.cause, failure.equations), (FailureCause::InconsistentStart, vec![4]));
    // The circle has no point this far out.
    let fixed = [true, false, false, false, false, false];
    let failure = consistent_start(&mut rod(), 0.0, &[2.0, 0.1, 0.0, 0.0, 0.0, 0.0], &[], &fixed).unwrap_err();
    assert_eq!((failure.cause, failure.equations), (FailureCause::InconsistentStart, vec![4]));
}

#[test]
fn constraints_that_repeat_each_other_are_named() {
    let mut system = System::new(Rod { copies: 2 }, &[GRAVITY, LENGTH]);
    let failure = consistent_start(&mut system, 0.0, &[1.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], &[], &[false; 8]);
    let failure = failure.unwrap_err();
    assert_eq!((failure.cause, failure.equations), (FailureCause::RedundantConstraints, vec![4, 5]));
}

#[test]
fn a_hanging_rod_is_in_equilibrium_with_its_force() {
    let mut system = rod();
    let y = [0.4, -1.0, 0.0, 0.0, 0.0, 0.0];
    let rest = equilibrium(&mut system, 0.0, &y, &[0.0; 12], &[true; 6]).unwrap();
    assert_near(&rest.y, &[0.0, -LENGTH, 0.0, 0.0, GRAVITY / LENGTH, 0.0], 1e-9);
    let by_gravity = [0.0, 0.0, 0.0, 0.0, 1.0 / LENGTH, 0.0];
    let by_length = [0.0, -1.0, 0.0, 0.0, -GRAVITY / (LENGTH * LENGTH), 0.0];
    assert_near(&rest.sensitivity[..6], &by_gravity, 1e-9);
    assert_near(&rest.sensitivity[6..], &by_length, 1e-9);
}

#[test]
fn a_statically_indeterminate_equilibrium_is_refused() {
    let mut system = System::new(Rod { copies: 2 }, &[GRAVITY, LENGTH]);
    let y = [0.4, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let failure = equilibrium(&mut system, 0.0, &y, &[0.0; 16], &[true; 8]).unwrap_err();
    assert_eq!((failure.cause, failure.equations), (FailureCause::RedundantConstraints, vec![4, 5, 6, 7]));
}

fn swing(tolerance: f64, end: f64) -> Solution {
    let start = Start { time: 0.0, y: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0], y_prime: vec![0.0; 6], sensitivity: vec![] };
    let times: Vec<f64> = (1..=1000).map(|i| end * i as f64 / 1000.0).collect();
    let options = Options { relative_tolerance: tolerance, ..Options::default() };
    integrate(&mut System::new(Pendulum, &[GRAVITY]), &start, &times, &[], &options).unwrap()
}

/// Largest residuals on position and on velocity level and largest error of the energy.
fn residuals(solution: &Solution) -> (f64, f64, f64) {
    let mut worst = (0.0f64, 0.0f64, 0.0f64);
    for y in solution.y.chunks_exact(6) {
        worst.0 = worst.0.max((y[0].hypot(y[1]) - 1.0).abs());
        worst.1 = worst.1.max((y[0] * y[2] + y[1] * y[3]).abs());
        worst.2 = worst.2.max((0.5 * (y[2] * y[2] + y[3] * y[3]) + GRAVITY * y[1]).abs());
    }
    worst
}

#[test]
fn a_thousand_seconds_do_not_drift() {
    for tolerance in [1e-5, 1e-7] {
        let (short, long) = (swing(tolerance, 10.0), swing(tolerance, 1000.0));
        let (position, velocity, energy) = residuals(&long);
        println!("{tolerance:e}: {:?} {:?} {} steps", residuals(&short), residuals(&long), long.work.steps);
        assert!(position < tolerance, "position level {position:e}");
        assert!(velocity < 10.0 * tolerance, "velocity level {velocity:e}");
        // Energy is not part of what is controlled: its error grows with the number of steps, not faster.
        assert!(energy < 200.0 * residuals(&short).2, "energy {energy:e}");
    }
}

#[test]
fn gradient_with_constraints_is_that_of_the_discrete_solution() {
    for tolerance in [1e-3, 1e-6] {
        // By gravity alone, because the length would move the start. The last component is rounding.
        let system = System::new(Pendulum, &[GRAVITY]);
        let start = Start {
            time: 0.0,
            y: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            y_prime: vec![0.0; 6],
            sensitivity: vec![0.0; 6],
        };
        let options = Options { relative_tolerance: tolerance, ..Options::default() };
        let difference = difference_to_frozen(system, &start, 2.0, &options, 5);
        println!("{tolerance:e}: {difference:e}");
        assert!(difference < 1e-8, "{tolerance:e}: {difference:e}");
    }
}

#[test]
fn gradient_with_constraints_follows_the_tolerance() {
    let mut system = rod();
    let times = [0.7, 1.9];
    let theta = system.theta.clone();
    for (tolerance, bound) in [(1e-5, 1e-2), (1e-8, 1e-5_f64)] {
        let options = Options { relative_tolerance: tolerance, ..Options::default() };
        let start = start_on_circle(&mut system);
        let solution = integrate(&mut system, &start, &times, &[], &options).unwrap();
        for (j, &value) in theta.iter().enumerate() {
            let step = 1e-4 * value;
            let tight = Options { relative_tolerance: 1e-11, ..Options::default() };
            let mut ends = [1.0, -1.0].map(|sign| {
                system.theta[j] = value + sign * step;
                let mut y: Vec<f64> = GIVEN.to_vec();
                if j == 1 {
                    y.iter_mut().zip(GIVEN_SLOPE).for_each(|(y, slope)| *y += sign * step * slope);
                }
                y.resize(6, 0.0);
                let start = consistent_start(&mut system, 0.0, &y, &[], &[false; 6]).unwrap();
                let y = integrate(&mut system, &start, &times, &[], &tight).unwrap().y;
                system.theta[j] = value;
                y
            });
            let [above, below] = &mut ends;
            for k in 0..times.len() {
                // Differences of forces lose more digits: rounding stands in them divided by the step.
                for (i, bound) in [bound, bound, bound, bound, bound.max(1e-3)].into_iter().enumerate() {
                    let difference = (above[k * 6 + i] - below[k * 6 + i]) / (2.0 * step);
                    let ours = solution.sensitivity[(k * 2 + j) * 6 + i];
                    assert!((ours - difference).abs() < bound * difference.abs().max(1.0), "{i}: {ours} {difference}");
                }
            }
        }
    }
}
