//! Sensitivities against analytic ones and against differences of the frozen step sequence.

use crate::problems::*;
use crate::scalar::Dual;
use crate::system::{Equations, System};
use ident::integrate::{Dynamics, MethodChoice, Options, Solution, Start, integrate};
use std::sync::Arc;

fn grid(end: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| end * i as f64 / count as f64).collect()
}

fn options(method: MethodChoice, relative_tolerance: f64) -> Options {
    Options { relative_tolerance, method, ..Options::default() }
}

/// Largest error of position and of its sensitivities over the grid.
fn oscillator_error<E: Equations>(system: &mut System<E>, start: &Start, options: &Options) -> (f64, f64) {
    let theta = system.theta.clone();
    let n = system.dimension();
    let times = grid(10.0, 137);
    let solution = integrate(system, start, &times, &[], options).unwrap();
    let mut worst = (0.0f64, 0.0f64);
    for (k, &t) in times.iter().enumerate() {
        for j in 0..2 {
            let seed = |i: usize| Dual { value: theta[i], slope: if i == j { 1.0 } else { 0.0 } };
            let exact = Oscillator::exact(t, seed(0), seed(1));
            worst.0 = worst.0.max((solution.y[k * n] - exact.value).abs());
            let scaled = (solution.sensitivity[k * 2 * n + j * n] - exact.slope) * theta[j];
            worst.1 = worst.1.max(scaled.abs());
        }
    }
    worst
}

#[test]
fn errors_of_state_and_sensitivities_follow_the_tolerance() {
    for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
        for tolerance in [1e-4, 1e-6, 1e-8] {
            let mut system = System::new(Oscillator, &[7.0, 0.05]);
            let start = system.start_with_sensitivity(&[1.0, 0.0]);
            let (state, sensitivity) = oscillator_error(&mut system, &start, &options(method, tolerance));
            println!("{method:?} {tolerance:e}: {:.1} {:.1}", state / tolerance, sensitivity / tolerance);
            assert!(state < 100.0 * tolerance, "{method:?} {tolerance:e}: state {state:e}");
            assert!(sensitivity < 1000.0 * tolerance, "{method:?} {tolerance:e}: sensitivity {sensitivity:e}");
        }
    }
}

#[test]
fn sensitivities_are_controlled_without_known_parameter_scale() {
    let mut system = System::new(Oscillator, &[7.0, 0.05]).without_parameter_scale();
    let start = system.start_with_sensitivity(&[1.0, 0.0]);
    let (_, sensitivity) = oscillator_error(&mut system, &start, &options(MethodChoice::RungeKutta, 1e-7));
    assert!(sensitivity < 1e-4, "{sensitivity:e}");
}

#[test]
fn algebraic_components_have_sensitivities() {
    let mut system = System::new(OscillatorWithForce, &[7.0, 0.05]);
    // The start of the algebraic component is wrong on purpose: it follows from the equations.
    let start = Start { time: 0.0, y: vec![1.0, 0.0, 0.0], y_prime: vec![0.0; 3], sensitivity: vec![0.0; 6] };
    let (state, sensitivity) = oscillator_error(&mut system, &start, &options(MethodChoice::Automatic, 1e-7));
    assert!(state < 1e-5 && sensitivity < 1e-4, "{state:e} {sensitivity:e}");
    let solution = integrate(&mut system, &start, &[0.0, 0.1], &[], &options(MethodChoice::Automatic, 1e-7)).unwrap();
    let [x, v, force] = solution.y[3..6] else { panic!() };
    assert!((force + 0.7 * v + 49.0 * x).abs() < 1e-6);
}

fn with_theta<E: Equations>(
    system: &mut System<E>,
    theta: &[f64],
    start: &Start,
    times: &[f64],
    options: &Options,
) -> Vec<f64> {
    let kept = std::mem::replace(&mut system.theta, theta.to_vec());
    let y = integrate(system, &Start { sensitivity: Vec::new(), ..start.clone() }, times, &[], options).unwrap().y;
    system.theta = kept;
    y
}

/// Largest relative difference between the sensitivities of a run and differences of order 6 along its step sequence,
/// in the first `compared` components.
pub fn difference_to_frozen<E: Equations>(
    mut system: System<E>,
    start: &Start,
    end: f64,
    options: &Options,
    compared: usize,
) -> f64 {
    let times = grid(end, 10);
    let options = Options { record_plan: true, ..options.clone() };
    let solution: Solution = integrate(&mut system, start, &times, &[], &options).unwrap();
    let frozen = Options { follow_plan: Some(Arc::new(solution.plan.clone().unwrap())), ..options };
    let (n, theta) = (system.dimension(), system.theta.clone());
    let mut worst = 0.0f64;
    for j in 0..theta.len() {
        let step = 2e-3 * theta[j];
        let mut difference = vec![0.0; solution.y.len()];
        for (distance, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
            for sign in [1.0, -1.0] {
                let mut moved = theta.clone();
                moved[j] += sign * distance * step;
                let y = with_theta(&mut system, &moved, start, &times, &frozen);
                difference.iter_mut().zip(&y).for_each(|(d, y)| *d += sign * weight * y / (60.0 * step));
            }
        }
        let column: Vec<f64> =
            (0..times.len()).flat_map(|k| solution.sensitivity[(k * theta.len() + j) * n..][..n].to_vec()).collect();
        for i in 0..compared {
            let of_component = |v: &[f64]| -> Vec<f64> { v.iter().skip(i).step_by(n).copied().collect() };
            let (exact, ours) = (of_component(&difference), of_component(&column));
            let size = exact.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            for (a, b) in exact.iter().zip(&ours) {
                worst = worst.max((a - b).abs() / size);
            }
        }
    }
    worst
}

#[test]
fn gradient_is_that_of_the_discrete_solution() {
    // The tightest is that of the explicit method of order 8.
    for tolerance in [1e-3, 1e-6, 1e-9] {
        for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
            let mut system = System::new(Oscillator, &[7.0, 0.05]);
            let start = system.start_with_sensitivity(&[1.0, 0.0]);
            let difference = difference_to_frozen(system, &start, 3.0, &options(method, tolerance), 2);
            println!("oscillator {method:?} {tolerance:e}: {difference:e}");
            assert!(difference < 1e-8, "{method:?} {tolerance:e}: {difference:e}");
        }
        for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
            let mut system = System::new(VanDerPol, &[0.05]);
            let start = system.start_with_sensitivity(&[2.0, 0.0]);
            let difference = difference_to_frozen(system, &start, 1.5, &options(method, tolerance), 2);
            println!("van der pol {method:?} {tolerance:e}: {difference:e}");
            assert!(difference < 1e-8, "{method:?} {tolerance:e}: {difference:e}");
        }
    }
}
