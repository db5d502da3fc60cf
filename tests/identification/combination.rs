//! Results that one study writes and another reads.

use crate::shipped::{compiled, fitted, loaded};
use ident::identify::{Confidence, Fitted, SavedResult, Settings, confidence};
use ident::simulation::{Compiled, Record};

fn result(compiled: &Compiled, records: &[Record], settings: &Settings) -> (Fitted, Confidence) {
    let fitted = fitted(compiled, records, settings);
    let confidence = confidence(compiled, &fitted);
    (fitted, confidence)
}

/// What one half of a record knows, written and read again, joined to the fit of the other half.
fn halves(name: &str) -> (Compiled, [(Fitted, Confidence); 3]) {
    let (compiled, records) = compiled(&loaded(name));
    let count = records[0].sample_count();
    let (first, second) = (records[0].part(0..count / 2, "first"), records[0].part(count / 2..count, "second"));
    let alone = result(&compiled, std::slice::from_ref(&first), &Settings::default());
    let saved = SavedResult::new(&compiled, &alone.0, &alone.1, vec![first.name.clone()]).expect("a finite covariance");
    let text = serde_json::to_string(&saved).expect("JSON");
    let read: SavedResult = serde_json::from_str(&text).expect("JSON");
    assert_eq!(read, saved);
    let knowledge = read.rows(&compiled.study.parameters).expect("the same parameters");
    let combined = result(&compiled, std::slice::from_ref(&second), &Settings { knowledge, ..Settings::default() });
    let joint = result(&compiled, &[first, second], &Settings::default());
    (compiled, [alone, combined, joint])
}

/// Two halves combined equal the fit of both together: to a fifth of the standard deviation, which is what differing
/// estimates of the noise's level and colour make.
#[test]
fn halves_combine_to_the_joint_fit() {
    let (compiled, [alone, combined, joint]) = halves("series_springs");
    let free = compiled.study.parameters.iter().position(|p| p.name == "d_slide").expect("a parameter");
    let deviation = joint.1.standard_deviation(free).expect("determined");
    let difference = combined.0.theta[free] - joint.0.theta[free];
    assert!(difference.abs() < 0.2 * deviation, "{difference} of {deviation}");
    let ratio = combined.1.standard_deviation(free).expect("determined") / deviation;
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    assert!(alone.1.standard_deviation(free).expect("determined") > 1.2 * deviation, "half the data knows less");
    // What neither half determines stays undetermined, and the series of the springs agrees.
    assert_eq!(combined.1.undetermined, joint.1.undetermined);
    let series = |theta: &[f64]| theta[0] * theta[1] / (theta[0] + theta[1]);
    let (a, b) = (series(&combined.0.theta), series(&joint.0.theta));
    assert!((a / b - 1.0).abs() < 2e-4, "{a} {b}");
}

/// A prior for one spring makes both springs determined.
#[test]
fn a_result_of_another_test_resolves_what_this_one_leaves_open() {
    let (compiled, records) = compiled(&loaded("series_springs"));
    let text = r#"{ "schema": "ident.result/1", "study": "bench", "variant": "base", "records": ["bench"],
        "parameters": [
            { "name": "c_near", "unit": "N/mm", "value": 9.3, "lower": 4, "upper": 20 },
            { "name": "c_bench", "unit": "N/mm", "value": 1, "lower": 0, "upper": 2 } ],
        "information": [[125.0, 50.0], [50.0, 100.0]] }"#;
    let bench: SavedResult = serde_json::from_str(text).expect("JSON");
    let knowledge = bench.rows(&compiled.study.parameters).expect("one parameter in common");
    // Without `c_bench` what is known about `c_near` is 125 - 50^2 / 100 = 100 per (N/mm)^2.
    assert_eq!(knowledge.len(), 1);
    assert!((knowledge[0].weights[0].1 * 1e3 - 10.0).abs() < 1e-9, "{knowledge:?}");
    let (fitted, confidence) = result(&compiled, &records, &Settings { knowledge, ..Settings::default() });
    assert!(confidence.undetermined.is_empty());
    assert!((fitted.theta[0] - 9300.0).abs() < 1.0 && (fitted.theta[1] / 18_600.0 - 1.0).abs() < 0.01);
    let deviation = confidence.standard_deviation(0).expect("determined");
    assert!((deviation - 100.0).abs() < 3.0, "{deviation}");
    let mut foreign = bench.clone();
    foreign.parameters[0].unit = "kg".to_owned();
    assert_eq!(foreign.rows(&compiled.study.parameters), Err("c_near is in kg there and in kN/m here".to_owned()));
}
