//! The shipped elastic arm: modes from a file, records of finite elements.

use crate::shipped::{compiled, fitted, loaded};
use ident::identify::{Settings, confidence};

/// What the independent generator was given is found, within the intervals widened by what three modes leave out of a
/// beam with a payload, and nothing but noise is left over.
#[test]
fn modes_and_payload_of_an_elastic_arm_are_identified() {
    let (compiled, records) = compiled(&loaded("elastic_arm"));
    let found = fitted(&compiled, &records, &Settings::default());
    let known = confidence(&compiled, &found);
    for (name, truth) in [("J_hub", 0.06), ("s_arm", 0.94), ("D_arm", 0.012), ("m_payload", 0.18), ("d_hub", 0.5)] {
        let j = compiled.study.parameters.iter().position(|parameter| parameter.name == name).expect("a parameter");
        let deviation = known.standard_deviation(j).expect("determined");
        let error = found.theta[j] - truth;
        assert!(error.abs() < 3.0 * deviation + 1e-3 * truth, "{name}: {} +- {deviation} for {truth}", found.theta[j]);
        assert!(deviation < 0.02 * truth, "{name}: {deviation}");
    }
    // 1 % noise on every channel is a discrepancy of 0.01 %.
    assert!(found.discrepancy() < 0.015, "{}", found.discrepancy());
}
