//! States of rest against closed solutions.

use crate::scalar::Scalar;
use crate::system::{Equations, System};
use ident::integrate::{Dynamics, FailureCause, equilibrium};

/// A mass on a spring with cubic part, gravity and a filter of the spring force: (x, v, z) with parameters
/// (k, cubic, m, tau).
struct HangingMass {
    stiff: bool,
    load: f64,
}

const GRAVITY: f64 = 9.81;

impl Equations for HangingMass {
    fn dimension(&self) -> usize {
        3
    }

    fn scale(&self) -> Vec<f64> {
        vec![0.1, 1.0, 100.0]
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        let (x, v, z) = (y[0], y[1], y[2]);
        let spring = if self.stiff { -(theta[0] * x) - theta[1] * x * x * x } else { S::from(0.0) };
        let force = spring - S::from(5.0) * v - theta[2] * S::from(self.load);
        Some(vec![v, force / theta[2], (spring - z) / theta[3]])
    }
}

const THETA: [f64; 4] = [800.0, 3e5, 12.0, 0.05];

fn at_rest() -> HangingMass {
    HangingMass { stiff: true, load: GRAVITY }
}

#[test]
fn hanging_mass_balances_and_depends_on_the_parameters_as_the_implicit_function_does() {
    let mut system = System::new(at_rest(), &THETA);
    let found = equilibrium(&mut system, 0.0, &[0.0; 3], &[0.0; 12], &[true; 3]).unwrap();
    let [x, v, z] = found.y[..] else { panic!() };
    let [k, cubic, m, _] = THETA;
    assert!((k * x + cubic * x.powi(3) + m * GRAVITY).abs() < 1e-9 && v.abs() < 1e-14, "{x} {v}");
    assert!((z - m * GRAVITY).abs() < 1e-9);
    let stiffness = k + 3.0 * cubic * x * x;
    let exact = [-x / stiffness, -x.powi(3) / stiffness, -GRAVITY / stiffness, 0.0];
    for (j, exact) in exact.iter().enumerate() {
        assert!((found.sensitivity[3 * j] - exact).abs() < 1e-12 * exact.abs().max(1e-3), "parameter {j}");
    }
    assert!((found.sensitivity[3 * 2 + 2] - GRAVITY).abs() < 1e-9, "the filter follows the weight");
}

#[test]
fn given_components_keep_value_and_dependence() {
    let mut system = System::new(at_rest(), &THETA);
    // The velocity is given; the acceleration must vanish all the same, so the damper carries its share.
    let mut given = [0.0; 12];
    given[1] = 0.25;
    let found = equilibrium(&mut system, 0.0, &[0.0, 2.0, 0.0], &given, &[true, false, true]).unwrap();
    let [k, cubic, m, _] = THETA;
    let x = found.y[0];
    assert_eq!(found.y[1], 2.0);
    assert!((k * x + cubic * x.powi(3) + m * GRAVITY + 10.0).abs() < 1e-9);
    let stiffness = k + 3.0 * cubic * x * x;
    assert!((found.sensitivity[0] - (-x - 5.0 * 0.25) / stiffness).abs() < 1e-12);
    assert_eq!(found.sensitivity[1], 0.25);
}

#[test]
fn a_given_position_leaves_the_rest_to_its_own_equations() {
    let mut system = System::new(at_rest(), &THETA);
    let found = equilibrium(&mut system, 0.0, &[0.1, 0.0, 0.0], &[0.0; 12], &[false, false, true]).unwrap();
    assert!((found.y[2] + 80.0 + 3e5 * 1e-3).abs() < 1e-9);
}

#[test]
fn free_motion_is_named() {
    let mut system = System::new(HangingMass { stiff: false, load: 0.0 }, &THETA);
    let failure = equilibrium(&mut system, 0.0, &[0.0; 3], &[0.0; 12], &[true; 3]).unwrap_err();
    assert_eq!((failure.cause, failure.component), (FailureCause::NoEquilibrium, Some(0)), "free position");
    let mut system = System::new(HangingMass { stiff: false, load: GRAVITY }, &THETA);
    let failure = equilibrium(&mut system, 0.0, &[0.0; 3], &[0.0; 12], &[true; 3]).unwrap_err();
    assert_eq!((failure.cause, failure.component), (FailureCause::NoEquilibrium, Some(1)), "accelerates for ever");
}

#[test]
fn a_model_that_is_no_number_is_a_failure() {
    let mut system = System::new(at_rest(), &[f64::NAN, 3e5, 12.0, 0.05]);
    let failure = equilibrium(&mut system, 0.0, &[0.0; 3], &[0.0; 12], &[true; 3]).unwrap_err();
    assert_eq!(failure.cause, FailureCause::NotFinite);
}

/// Masses on springs in a row, hanging from the ceiling or falling freely; parameters: stiffness, gravity.
struct Chain {
    hangs: bool,
}

const MASSES: usize = 60;

impl Equations for Chain {
    fn dimension(&self) -> usize {
        2 * MASSES
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], theta: &[S]) -> Option<Vec<S>> {
        let (x, v) = y.split_at(MASSES);
        let pull = |i: usize| {
            let above = if i == 0 { S::from(0.0) } else { x[i - 1] };
            if i == 0 && !self.hangs { S::from(0.0) } else { theta[0] * (above - x[i]) }
        };
        let below = |i: usize| if i + 1 < MASSES { pull(i + 1) } else { S::from(0.0) };
        let mut rates = v.to_vec();
        rates.extend((0..MASSES).map(|i| pull(i) - below(i) - theta[1] - v[i]));
        Some(rates)
    }
}

#[test]
fn a_long_chain_hangs_as_its_springs_say_at_little_cost() {
    let mut system = System::new(Chain { hangs: true }, &[500.0, 9.81]);
    let n = system.dimension();
    let start = vec![0.1; n];
    let rest = equilibrium(&mut system, 0.0, &start, &vec![0.0; 2 * n], &vec![true; n]).unwrap();
    let mut position = 0.0;
    for i in 0..MASSES {
        position -= (MASSES - i) as f64 * 9.81 / 500.0;
        assert!((rest.y[i] - position).abs() < 1e-9 && rest.y[MASSES + i].abs() < 1e-9);
        assert!((rest.sensitivity[i] + position / 500.0).abs() < 1e-11, "by stiffness");
        assert!((rest.sensitivity[n + i] - position / 9.81).abs() < 1e-9, "by gravity");
    }
    assert!(rest.work.factorisations <= 5, "{:?}", rest.work);
}

#[test]
fn a_long_chain_that_falls_has_no_equilibrium() {
    let mut system = System::new(Chain { hangs: false }, &[500.0, 0.0]);
    let n = system.dimension();
    let failure = equilibrium(&mut system, 0.0, &vec![0.1; n], &vec![0.0; 2 * n], &vec![true; n]).unwrap_err();
    assert_eq!(failure.cause, FailureCause::NoEquilibrium);
    assert!(failure.component.is_some_and(|i| i < MASSES), "{failure:?}");
}
