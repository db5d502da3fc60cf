//! Hidden effects: each case is a study whose records contain something that the study does not say.

mod support;
mod truth;

use Strength::{Medium, Strong, Weak};
use rayon::prelude::*;
use support::{Case, Strength};

const CASES: [Case; 38] = [
    case("quarter_vehicle", "dry_friction", "chassis_guide", Strong, 1),
    case("quarter_vehicle", "dry_friction", "strut", Medium, 2),
    case("quarter_vehicle", "quadratic_drag", "chassis_guide", Medium, 3),
    case("quarter_vehicle", "viscous_damping", "tyre", Strong, 4),
    case("quarter_vehicle", "end_stop", "strut", Strong, 5),
    case("quarter_vehicle", "sensor_offset", "F_tyre", Medium, 6),
    case("quarter_vehicle", "sensor_lag", "a_axle", Medium, 7),
    case("quarter_vehicle", "input_delay", "u", Strong, 8),
    case("quarter_vehicle", "harmonic_disturbance", "chassis_guide", Medium, 9),
    case("quarter_vehicle", "cubic_stiffness", "tyre", Medium, 10),
    case("two_mass", "backlash", "coupling", Strong, 11),
    case("two_mass", "backlash", "coupling", Medium, 12),
    case("two_mass", "dry_friction", "bearing", Medium, 13),
    case("two_mass", "quadratic_drag", "bearing", Strong, 14),
    case("two_mass", "cubic_stiffness", "coupling", Medium, 15),
    case("two_mass", "actuator_limit", "motor_torque", Strong, 16),
    case("two_mass", "input_delay", "torque", Medium, 17),
    case("two_mass", "harmonic_disturbance", "bearing", Strong, 18),
    case("two_mass", "dry_friction", "bearing", Weak, 19),
    case("crane_pendulum", "dry_friction", "rail", Strong, 20),
    case("crane_pendulum", "dry_friction", "hook", Medium, 21),
    case("crane_pendulum", "quadratic_drag", "hook", Medium, 22),
    case("crane_pendulum", "viscous_damping", "hook", Strong, 23),
    case("crane_pendulum", "end_stop", "rail", Strong, 24),
    case("crane_pendulum", "input_delay", "drive_force", Medium, 25),
    case("crane_pendulum", "sensor_offset", "swing", Weak, 26),
    case("spring_slide", "damper_saturation", "damper", Strong, 27),
    case("spring_slide", "cubic_stiffness", "return_spring", Strong, 28),
    case("spring_slide", "dry_friction", "guide", Weak, 29),
    case("spring_slide", "sensor_lag", "position", Medium, 30),
    nothing("quarter_vehicle", 31),
    nothing("quarter_vehicle", 32),
    nothing("two_mass", 33),
    nothing("two_mass", 34),
    nothing("crane_pendulum", 35),
    nothing("crane_pendulum", 36),
    nothing("spring_slide", 37),
    nothing("spring_slide", 38),
];

const fn case(study: &'static str, effect: &'static str, place: &'static str, strength: Strength, seed: u64) -> Case {
    Case { study, hidden: Some((effect, place)), strength, seed }
}

const fn nothing(study: &'static str, seed: u64) -> Case {
    Case { study, hidden: None, strength: Weak, seed }
}

/// The class of each case is measured, not claimed.
#[test]
fn every_effect_is_as_strong_as_its_class_says() {
    let wrong: Vec<String> = CASES
        .par_iter()
        .filter(|case| case.hidden.is_some())
        .map(Case::prepare)
        .filter(|prepared| !prepared.case.strength.contains(prepared.measured_strength))
        .map(|prepared| {
            format!("{}: changes {:.4}, {:?}", prepared.case.title(), prepared.measured_strength, prepared.effect)
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
