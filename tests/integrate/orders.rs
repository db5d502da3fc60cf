//! Orders of convergence and exactness.

use crate::problems::*;
use crate::scalar::Scalar;
use crate::system::{Equations, System};
use ident::integrate::{Branches, Dynamics, MethodChoice, Options, Plan, PlannedStep, Start, integrate};
use std::sync::Arc;

/// Error of the oscillator at `times` with `count` equal explicit steps to t = 2.
fn explicit_error(mark: u8, count: usize, times: &[f64]) -> f64 {
    let mut system = System::new(Oscillator, &[3.0, 0.1]);
    let start = system.start(&[1.0, 0.0]);
    let steps = (1..=count)
        .map(|i| PlannedStep { end: 2.0 * i as f64 / count as f64, order: mark, branches: Branches::Free })
        .collect();
    let options = Options { follow_plan: Some(Arc::new(Plan { steps })), ..Options::default() };
    let solution = integrate(&mut system, &start, times, &[], &options).unwrap();
    let exact = times.iter().map(|&t| Oscillator::exact(t, 3.0, 0.1));
    solution.y.iter().step_by(2).zip(exact).map(|(y, exact)| (y - exact).abs()).fold(0.0, f64::max)
}

#[test]
fn explicit_methods_converge_with_their_orders() {
    for (mark, order, count) in [(0, 5.0, 20), (8, 8.0, 12)] {
        let observed = (explicit_error(mark, count, &[2.0]) / explicit_error(mark, 2 * count, &[2.0])).log2();
        assert!((observed - order).abs() < 0.4, "order {order}: {observed}");
    }
}

#[test]
fn the_interpolant_of_order_8_is_of_order_7() {
    // The local error of the interpolant is of one order more; it does not add up over the steps.
    let times: Vec<f64> = (0..400).map(|i| 0.005 * (i as f64 + 0.37)).chain([2.0]).collect();
    let observed = (explicit_error(8, 6, &times) / explicit_error(8, 12, &times)).log2();
    assert!((7.3..8.8).contains(&observed), "{observed}");
}

#[test]
fn interpolation_between_steps_keeps_the_tolerance() {
    for (method, bound) in [(MethodChoice::RungeKutta, 1e-5), (MethodChoice::Bdf, 1e-4)] {
        let mut system = System::new(Oscillator, &[3.0, 0.1]);
        let start = system.start(&[1.0, 0.0]);
        let times: Vec<f64> = (0..=5000).map(|i| i as f64 * 1e-3).collect();
        let options = Options { method, ..Options::default() };
        let solution = integrate(&mut system, &start, &times, &[], &options).unwrap();
        let coarse = integrate(&mut system, &start, &[5.0], &[], &options).unwrap();
        assert_eq!(solution.work.steps, coarse.work.steps, "requested times do not shorten steps");
        let worst = times.iter().enumerate().map(|(k, &t)| (solution.y[2 * k] - Oscillator::exact(t, 3.0, 0.1)).abs());
        let worst = worst.fold(0.0, f64::max);
        println!("{method:?} {worst:e}");
        assert!(worst < bound, "{method:?}: {worst:e}");
    }
}

/// `x' = -x + u(t)` with a jump of u from 0 to 1 at t = 1; right-continuous.
struct Jump;

impl Equations for Jump {
    fn dimension(&self) -> usize {
        1
    }

    fn rates<S: Scalar>(&self, t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        Some(vec![S::from(if t >= 1.0 { 1.0 } else { 0.0 }) - y[0]])
    }
}

#[test]
fn breakpoints_are_met_exactly_and_from_both_sides() {
    for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
        let mut system = System::new(Jump, &[]);
        let start = system.start(&[0.5]);
        let options = Options { method, relative_tolerance: 1e-8, ..Options::default() };
        let solution = integrate(&mut system, &start, &[0.5, 1.0, 2.0], &[1.0], &options).unwrap();
        let at_jump = 0.5 * (-1.0f64).exp();
        let exact = [0.5 * (-0.5f64).exp(), at_jump, 1.0 + (at_jump - 1.0) * (-1.0f64).exp()];
        for (y, exact) in solution.y.iter().zip(exact) {
            assert!((y - exact).abs() < 1e-6, "{method:?}: {y} {exact}");
        }
        let blind = integrate(&mut system, &start, &[2.0], &[], &options).unwrap();
        assert!(solution.work.rejected_error + 5 < blind.work.rejected_error, "{method:?}: no step runs into the jump");
    }
}

#[test]
fn index_2_pendulum_stays_on_its_circle() {
    let mut system = System::new(Pendulum, &[9.81]);
    let start = Start {
        time: 0.0,
        y: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        y_prime: vec![0.0, 0.0, 0.0, -9.81, 0.0, 0.0],
        sensitivity: vec![0.0; 6],
    };
    let times: Vec<f64> = (1..=100).map(|i| 0.1 * i as f64).collect();
    let options = Options { relative_tolerance: 1e-7, ..Options::default() };
    let solution = integrate(&mut system, &start, &times, &[], &options).unwrap();
    for y in solution.y.chunks_exact(6) {
        assert!((y[0].hypot(y[1]) - 1.0).abs() < 1e-7, "position level");
        assert!((y[0] * y[2] + y[1] * y[3]).abs() < 1e-6, "velocity level");
        let energy = 0.5 * (y[2] * y[2] + y[3] * y[3]) + 9.81 * y[1];
        assert!(energy.abs() < 1e-3, "energy {energy:e}");
    }
    assert_eq!(system.differential()[4..], [false, false]);
}

/// `x' = -lambda(t) (x - cos t) - sin t`, stiff at first: lambda falls from 1e5 to 1 at t = 2. The solution is cos t.
struct FadingStiffness;

impl Equations for FadingStiffness {
    fn dimension(&self) -> usize {
        1
    }

    fn rates<S: Scalar>(&self, t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        let lambda = 1.0 + 5e4 * (1.0 - (20.0 * (t - 2.0)).tanh());
        Some(vec![S::from(-lambda) * (y[0] - S::from(t.cos())) - S::from(t.sin())])
    }
}

#[test]
fn the_explicit_method_comes_back_when_stiffness_has_gone() {
    let mut system = System::new(FadingStiffness, &[]);
    let start = Start { time: 0.0, y: vec![1.0], y_prime: vec![0.0], sensitivity: Vec::new() };
    let options = Options { relative_tolerance: 1e-8, ..Options::default() };
    let solution = integrate(&mut system, &start, &[100.0], &[], &options).unwrap();
    assert!((solution.y[0] - 100.0f64.cos()).abs() < 1e-5);
    let [(to_bdf, _), (back, name)] = solution.work.switches[..] else { panic!("{:?}", solution.work.switches) };
    assert!(to_bdf < 0.5 && (2.0..4.0).contains(&back) && name == solution.work.method, "{:?}", solution.work.switches);
    assert!(solution.work.reason.contains("stiffness has gone"), "{}", solution.work.reason);
    let only_bdf = Options { method: MethodChoice::Bdf, ..options };
    let bdf = integrate(&mut system, &start, &[100.0], &[], &only_bdf).unwrap();
    assert!(solution.work.steps < bdf.work.steps, "{} {}", solution.work.steps, bdf.work.steps);
}

/// A mass on a spring, driven, with dry friction that is nearly a jump: its solution bends sharply at every turn.
struct RubbingOscillator;

impl Equations for RubbingOscillator {
    fn dimension(&self) -> usize {
        2
    }

    fn rates<S: Scalar>(&self, t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        let drive = S::from((1.3 * t).sin() + 0.7 * (4.1 * t + 0.5).sin());
        let creep = y[1] / S::from(1e-3);
        Some(vec![y[1], drive - y[0] - S::from(0.3) * creep / (S::from(1.0) + creep * creep).sqrt()])
    }
}

impl RubbingOscillator {
    /// At `times`, by the classical method of order 4 with steps far below the width of the bends.
    fn fine(times: &[f64]) -> Vec<[f64; 2]> {
        const STEP: f64 = 2e-5;
        let rates = |t: f64, y: [f64; 2]| {
            let drive = (1.3 * t).sin() + 0.7 * (4.1 * t + 0.5).sin();
            let creep = y[1] / 1e-3;
            [y[1], drive - y[0] - 0.3 * creep / (1.0 + creep * creep).sqrt()]
        };
        let moved = |y: [f64; 2], h: f64, k: [f64; 2]| [y[0] + h * k[0], y[1] + h * k[1]];
        let (mut y, mut step) = ([0.5, 0.0], 0_u64);
        let mut states = Vec::new();
        for &time in times {
            while (step as f64 + 0.5) * STEP < time {
                let t = step as f64 * STEP;
                let a = rates(t, y);
                let b = rates(t + 0.5 * STEP, moved(y, 0.5 * STEP, a));
                let c = rates(t + 0.5 * STEP, moved(y, 0.5 * STEP, b));
                let d = rates(t + STEP, moved(y, STEP, c));
                let sum = [0, 1].map(|i| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0);
                (y, step) = (moved(y, STEP, sum), step + 1);
            }
            states.push(y);
        }
        states
    }
}

/// Where an estimate vanishes by chance at a bend, the step that crosses it must not pass for exact.
#[test]
fn bends_are_not_passed_by_chance() {
    let times: Vec<f64> = (1..=200).map(|i| 0.1 * f64::from(i)).collect();
    let exact = RubbingOscillator::fine(&times);
    let mut system = System::new(RubbingOscillator, &[]);
    let start = system.start(&[0.5, 0.0]);
    let mut ratios: Vec<f64> = (0..60)
        .map(|k| {
            let tolerance = 1e-6 * 10f64.powf(-0.05 * f64::from(k));
            let method = MethodChoice::RungeKutta;
            let options = Options { relative_tolerance: tolerance, method, ..Options::default() };
            let solution = integrate(&mut system, &start, &times, &[], &options).unwrap();
            let states = solution.y.chunks_exact(2).zip(&exact);
            let error =
                states.map(|(y, exact)| (y[0] - exact[0]).abs().max((y[1] - exact[1]).abs())).fold(0.0, f64::max);
            println!("{tolerance:.1e}: {error:.1e}, {} evaluations, {}", solution.work.residuals, solution.work.method);
            error / tolerance
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!("median {}, largest {}", ratios[30], ratios[59]);
    assert!(ratios[59] < 10.0 * ratios[30], "{ratios:?}");
}
