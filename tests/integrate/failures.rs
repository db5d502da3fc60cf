//! Failures are values that say when, why and who.

use crate::problems::*;
use crate::scalar::Scalar;
use crate::system::{Equations, System};
use ident::integrate::{Failure, FailureCause, MethodChoice, Options, integrate};

/// The second component grows as y^2 and is infinite at t = 1.
struct Explosion;

impl Equations for Explosion {
    fn dimension(&self) -> usize {
        2
    }

    fn rates<S: Scalar>(&self, _t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        Some(vec![-y[0], y[1] * y[1]])
    }
}

/// Square root of a number that becomes negative at t = 1.
struct Root;

impl Equations for Root {
    fn dimension(&self) -> usize {
        1
    }

    fn rates<S: Scalar>(&self, t: f64, y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        Some(vec![(S::from(1.0 - t)).sqrt() - y[0]])
    }
}

fn failure<E: Equations>(equations: E, y: &[f64], options: Options) -> Failure {
    let mut system = System::new(equations, &[]);
    let start = system.start(y);
    integrate(&mut system, &start, &[2.0], &[], &options).unwrap_err()
}

#[test]
fn growth_without_bound_names_time_and_component() {
    for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
        let failure = failure(Explosion, &[1.0, 1.0], Options { method, ..Options::default() });
        assert!((failure.time - 1.0).abs() < 1e-3, "{method:?}: {}", failure.time);
        assert_eq!(failure.component, Some(1), "{method:?}");
        assert!(failure.work.steps > 10);
    }
}

#[test]
fn what_is_not_a_number_stops_the_run_where_it_arises() {
    for method in [MethodChoice::RungeKutta, MethodChoice::Bdf] {
        let failure = failure(Root, &[0.0], Options { method, ..Options::default() });
        assert_eq!(failure.cause, FailureCause::NotFinite, "{method:?}");
        assert!((failure.time - 1.0).abs() < 1e-9, "{method:?}: {}", failure.time);
    }
}

#[test]
fn budget_of_steps_is_kept() {
    let failure = failure(Pleiades, &Pleiades::initial(), Options { maximum_steps: 20, ..Options::default() });
    assert_eq!(failure.cause, FailureCause::TooManySteps);
}

#[test]
fn impossible_requests_are_refused() {
    let mut system = System::new(OscillatorWithForce, &[7.0, 0.05]);
    let mut start = system.start(&[1.0, 0.0, -49.0]);
    let forced = Options { method: MethodChoice::RungeKutta, ..Options::default() };
    let cause = |r: Result<_, Failure>| r.map(|_: ident::integrate::Solution| ()).unwrap_err().cause;
    assert_eq!(cause(integrate(&mut system, &start, &[1.0], &[], &forced)), FailureCause::InvalidRequest);
    let options = Options::default();
    assert_eq!(cause(integrate(&mut system, &start, &[1.0, 0.5], &[], &options)), FailureCause::InvalidRequest);
    assert_eq!(cause(integrate(&mut system, &start, &[-1.0], &[], &options)), FailureCause::InvalidRequest);
    start.y[0] = f64::NAN;
    assert_eq!(cause(integrate(&mut system, &start, &[1.0], &[], &options)), FailureCause::InconsistentStart);
}
