//! A cantilever of rigid links on hinges with springs: its frequencies converge to those of the Euler-Bernoulli beam.

use crate::run::checked;
use ident::expression::Symbol;
use ident::mechanics::{VariableKind, derive};
use nalgebra::DMatrix;

/// Roots of `cos x cosh x = -1`: the first by bisection from the bracket that contains it.
fn root(number: u32) -> f64 {
    let middle = (f64::from(number) + 0.5) * std::f64::consts::PI;
    let (mut low, mut high) = (middle - 1.0, middle + 1.0);
    let value = |x: f64| x.cos() + 1.0 / x.cosh();
    assert!(value(low) * value(high) < 0.0, "one root in the bracket");
    for _ in 0..200 {
        let half = 0.5 * (low + high);
        if value(low) * value(half) <= 0.0 { high = half } else { low = half }
    }
    low
}

/// Circular frequencies of a beam of 2 m, 3 kg/m and 400 N m^2, cut into `links`, the lowest first.
fn frequencies(links: usize) -> Vec<f64> {
    let length = 2.0 / links as f64;
    let (mass, stiffness) = (3.0 * length, 400.0 / length);
    let text = format!(
        "study cantilever
         for i in 1 .. {links} {{
           body link[i] {{ mass = {mass} kg, inertia = {} kg*m^2, centre_of_gravity = ({} m, 0 m, 0 m), point tip = ({length} m, 0 m, 0 m) }}
         }}
         joint hinge[1]: revolute(y) ground -> link[1]
         force bending[1]: spring on hinge[1] {{ stiffness = {} N*m/rad }}
         for i in 2 .. {links} {{
           joint hinge[i]: revolute(y) link[i - 1].tip -> link[i]
           force bending[i]: spring on hinge[i] {{ stiffness = {stiffness} N*m/rad }}
         }}
         measure tip [mm] = link[{links}].tip.position.z\n",
        mass * length * length / 12.0,
        0.5 * length,
        2.0 * stiffness,
    );
    let study = checked(&text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let system = derive(&study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let mut graph = system.graph.clone();
    let of = |kind| system.states.iter().enumerate().filter(move |(_, state)| state.kind == kind);
    let positions: Vec<Symbol> = of(VariableKind::Position).map(|(_, state)| state.symbol).collect();
    let accelerations: Vec<_> = of(VariableKind::Velocity).map(|(at, _)| system.rates[at]).collect();
    let slopes = graph.jacobian(&accelerations, &positions);
    let nodes: Vec<_> = slopes.iter().map(|entry| entry.value).collect();
    let numbers = graph.evaluate(&nodes, |_| 0.0, |_, _, _| f64::NAN);
    let mut matrix = DMatrix::zeros(links, links);
    slopes.iter().zip(numbers).for_each(|(entry, number)| matrix[(entry.row, entry.column)] = number);
    let mut squares: Vec<f64> = matrix.complex_eigenvalues().iter().map(|value| -value.re).collect();
    squares.sort_by(f64::total_cmp);
    squares.into_iter().map(f64::sqrt).collect()
}

#[test]
fn frequencies_converge_to_those_of_the_beam() {
    let beam = |number: u32| (root(number) / 2.0).powi(2) * (400.0_f64 / 3.0).sqrt();
    let [coarse, fine, finest] = [8, 16, 32].map(frequencies);
    for mode in 0..3 {
        let exact = beam(mode as u32);
        let error = |found: &[f64]| (found[mode] / exact - 1.0).abs();
        let ratios = [error(&coarse) / error(&fine), error(&fine) / error(&finest)];
        println!(
            "mode {}: {:.1e} with 8 links, {:.1e} with 32, ratios {ratios:.2?}",
            mode + 1,
            error(&coarse),
            error(&finest)
        );
        assert!(error(&finest) < 0.01, "mode {mode} differs by {:.1e}", error(&finest));
        assert!(ratios.iter().all(|ratio| (3.5..4.6).contains(ratio)), "second order: {ratios:?}");
        let extrapolated = (4.0 * finest[mode] - fine[mode]) / 3.0;
        assert!((extrapolated / exact - 1.0).abs() < 1e-4, "mode {mode}: {extrapolated} instead of {exact}");
    }
}
