//! The document's example: two springs in series, of which only the series is determined.

use crate::shipped::{compiled, fitted, loaded};
use ident::analyse::{Demand, MonteCarlo, Validity, Verdict, validity};
use ident::identify::{Confidence, Settings, confidence};

fn series_springs(samples: usize) -> (Confidence, Validity) {
    let (compiled, records) = compiled(&loaded("series_springs"));
    let fitted = fitted(&compiled, &records, &Settings::default());
    let confidence = confidence(&compiled, &fitted);
    let validity = validity(&compiled, &fitted, &confidence, MonteCarlo { samples, seed: 5 });
    (confidence, validity)
}

/// Largest travel (m) and spring force (N) in the manoeuvre with the records' true numbers: 8 kg, 9.3 and 18.6 kN/m in
/// series, 90 N s/m. Classical Runge-Kutta with fixed steps, equations by hand.
fn truth() -> (f64, f64) {
    let (mass, stiffness, damping) = (8.0, 6200.0, 90.0);
    let force = |t: f64| {
        let s = ((t - 0.2) / 0.05_f64).clamp(0.0, 1.0);
        400.0 * s * s * (3.0 - 2.0 * s)
    };
    let rates = |t: f64, [x, v]: [f64; 2]| [v, (force(t) - stiffness * x - damping * v) / mass];
    let step = 1e-5;
    let (mut state, mut largest) = ([0.0, 0.0], 0.0_f64);
    for k in 0..300_000 {
        let t = k as f64 * step;
        let moved = |rate: [f64; 2], h: f64| [state[0] + h * rate[0], state[1] + h * rate[1]];
        let a = rates(t, state);
        let b = rates(t + 0.5 * step, moved(a, 0.5 * step));
        let c = rates(t + 0.5 * step, moved(b, 0.5 * step));
        let d = rates(t + step, moved(c, step));
        for i in 0..2 {
            state[i] += step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
        largest = largest.max(state[0]);
    }
    (largest, stiffness * largest)
}

#[test]
fn the_series_of_two_springs_is_all_that_is_determined() {
    let (confidence, validity) = series_springs(200);
    assert_eq!(confidence.undetermined, ["only the series `1/(1/c_near + 1/c_far)` is determined"]);
    assert_eq!(confidence.directions.len(), 1);
    assert!(confidence.standard_deviation(0).is_none() && confidence.standard_deviation(1).is_none());
    assert!(confidence.standard_deviation(2).is_some());
    let [travel, force, stretch] = validity.criteria.as_slice() else { panic!("three criteria") };
    assert_eq!((travel.verdict, travel.demand), (Verdict::Valid, Demand::Met), "{}", travel.reason);
    assert_eq!((force.verdict, force.demand), (Verdict::Valid, Demand::Met), "{}", force.reason);
    assert_eq!(stretch.verdict, Verdict::NotValid);
    assert!(stretch.reason.contains("1/(1/c_near + 1/c_far)"), "{}", stretch.reason);
    assert!(travel.orthogonality.iter().all(|test| test.orthogonal) && !stretch.orthogonality[0].orthogonal);
    assert!(stretch.by_gradient.is_none(), "no interval where the variance is infinite");
}

/// The true values lie in the 99 % intervals, and the three ways agree.
#[test]
fn criteria_meet_the_truth_within_their_intervals() {
    let (_, validity) = series_springs(400);
    let (travel, force) = truth();
    for (criterion, truth) in validity.criteria.iter().zip([1e3 * travel, force]) {
        let spreads = [criterion.by_gradient, criterion.by_increments, criterion.by_monte_carlo].map(Option::unwrap);
        for spread in spreads {
            let (low, high) = spread.interval;
            assert!((low..=high).contains(&truth), "{}: {truth} is not in {low} .. {high}", criterion.name);
            let ratio = spread.standard_deviation / spreads[0].standard_deviation;
            assert!((ratio - 1.0).abs() < 0.12, "{}: deviations differ by a factor {ratio}", criterion.name);
        }
    }
}

/// The same digits on one thread and on two.
#[test]
fn threads_do_not_change_a_digit() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| serde_json::to_string(&series_springs(40).1).expect("JSON"))
    };
    assert_eq!(on(1), on(2));
}
