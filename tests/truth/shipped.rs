//! The records of the shipped studies and what they hide.

use super::effect::Effect;
use super::record::{Noise, Record};

/// Level of the held-out record's excitation relative to the estimation record's.
pub const HELD_OUT_LEVEL: f64 = 1.1;

/// File names with seed and level of the excitation.
const RECORDS: [(&str, u64, f64); 2] = [("estimation.csv", 101, 1.0), ("validation.csv", 202, HELD_OUT_LEVEL)];

/// A record of a shipped study.
pub struct Shipped {
    pub study: &'static str,
    pub file: &'static str,
    pub record: Record,
}

/// A stand that sways at 18 Hz, sampled at 250 Hz.
const SWAYING: Noise = Noise { share: 0.03, memory: [1.6, -0.8] };

/// Study, place and effect there.
type Hidden = (&'static str, &'static str, fn(usize) -> Effect);

const HIDDEN: [Hidden; 4] = [
    ("quarter_vehicle", "chassis_guide", |place| Effect::DryFriction { place, load: 60.0 }),
    ("two_mass", "coupling", |place| Effect::Backlash { place, gap: 0.025 }),
    ("crane_pendulum", "hook", |place| Effect::QuadraticDrag { place, factor: 0.2 }),
    ("spring_slide", "damper", |place| Effect::DamperSaturation { place, knee: 0.3, ratio: 0.25 }),
];

/// Simulates all of them.
pub fn records() -> Vec<Shipped> {
    let mut shipped = vec![];
    for (study, place, hide) in HIDDEN {
        let mechanism = super::mechanism(study).expect("each shipped study has its simulator");
        let effect = hide(mechanism.place(place).expect("the place is one of the mechanism's"));
        for (file, seed, level) in RECORDS {
            shipped.push(Shipped { study, file, record: Record::measure(mechanism.as_ref(), &effect, seed, level) });
        }
    }
    // Two springs of 9.3 and 18.6 kN/m in series act like one of 6.2 kN/m; nothing is hidden.
    let slide = super::mechanism("spring_slide").expect("the slide has a simulator");
    for (file, seed, level) in RECORDS {
        let record = Record::measure(slide.as_ref(), &Effect::Nothing, seed, level);
        shipped.push(Shipped { study: "series_springs", file, record });
    }
    for (file, seed, level) in RECORDS {
        let record = Record::with_noise(slide.as_ref(), &Effect::Nothing, seed, level, &[SWAYING]);
        shipped.push(Shipped { study: "swaying_sensor", file, record });
    }
    shipped.push(Shipped { study: "caster_shimmy", file: "estimation.csv", record: super::shimmy::towing(7) });
    for (file, seed, level) in RECORDS {
        shipped.push(Shipped { study: "elastic_arm", file, record: super::elastic_arm::turning(seed, level) });
    }
    shipped
}

/// Further files of shipped studies: their path, and their text.
pub fn further() -> [(&'static str, String); 1] {
    [("elastic_arm/arm_modes.csv", super::elastic_arm::modes(4))]
}
