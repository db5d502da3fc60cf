//! Optimisers side by side, and cuts of the cost.

use crate::shipped::{compiled, fitted, loaded};
use ident::analyse::{courses, cuts};
use ident::identify::Settings;
use ident::simulation::Record;

/// Three and six parameters (Figs. 3.4 and 3.5 of the document): Levenberg-Marquardt needs the least work; the others
/// end at the same cost where they converge.
#[test]
fn levenberg_marquardt_needs_the_fewest_simulations() {
    let chosen = ["c_tyre", "c_strut", "d_rebound"].map(str::to_owned);
    for (study, searched, count) in
        [("spring_slide", &[][..], 3), ("quarter_vehicle", &chosen[..], 3), ("quarter_vehicle", &[][..], 6)]
    {
        let (compiled, records) = compiled(&loaded(study));
        let short: Vec<Record> = records.iter().map(|record| record.part(0..300, "short")).collect();
        let result = courses(&compiled, &short.iter().collect::<Vec<_>>(), searched, 250, 1).expect("courses");
        assert_eq!(result.parameters.len(), count);
        assert_eq!(result.held.is_empty(), searched.is_empty());
        let best = result.courses.iter().map(|course| course.cost).fold(f64::INFINITY, f64::min);
        let first = result.courses[0].work_to_best.expect("Levenberg-Marquardt arrives");
        for course in &result.courses {
            assert!(course.work_to_best.is_none_or(|work| work >= first), "{study}: {}", course.optimiser);
            let falls = course.history.windows(2).all(|pair| pair[0].1 > pair[1].1 && pair[0].0 < pair[1].0);
            let end = course.history.last().map(|(_, cost)| *cost);
            assert!(end == Some(course.cost), "{study}: {} {end:?} {}", course.optimiser, course.cost);
            assert!(falls, "{study}: {} {:?}", course.optimiser, course.history);
            if course.converged {
                assert!(course.cost <= 1.02 * best, "{study}: {} ends at {}", course.optimiser, course.cost);
            }
        }
        assert!(result.courses[1].work_to_best.is_some(), "sequential quadratic programming arrives");
    }
}

/// Every cut has its lowest point at the estimate, in the band of the fit.
#[test]
fn cuts_have_their_minimum_at_the_estimate() {
    let (compiled, records) = compiled(&loaded("spring_slide"));
    let fit = fitted(&compiled, &records, &Settings::default());
    let result = cuts(&compiled, &fit, &records.iter().collect::<Vec<_>>(), 11, 0.1).expect("cuts");
    assert_eq!(result.parameters.len(), 3);
    for cut in &result.parameters {
        let own = &cut.curves[0];
        assert_eq!(cut.curves.len(), 4);
        let lowest = (0..11).min_by(|a, b| own.discrepancy[*a].total_cmp(&own.discrepancy[*b])).expect("values");
        let step = cut.values[1] - cut.values[0];
        assert!((cut.values[lowest] - cut.at).abs() <= step, "{}: {} {}", cut.parameter, cut.values[lowest], cut.at);
        assert!(own.tolerance < cut.curves[1].tolerance && own.roughness <= 1.5 * cut.curves[1].roughness);
    }
}
