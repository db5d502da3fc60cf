//! Makes the records of the shipped studies: `cargo run --example make_data`.
//!
//! Each study's records hide one effect that its text does not know; see `studies/README.md`.

#[path = "../tests/truth/mod.rs"]
mod truth;

use std::path::{Path, PathBuf};
use truth::effect::Effect;
use truth::record::Record;

/// Level of the held-out record's excitation relative to the estimation record's.
const HELD_OUT_LEVEL: f64 = 1.1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for (study, place, hide) in HIDDEN {
        let mechanism = truth::mechanism(study).ok_or_else(|| format!("no simulator for {study}"))?;
        let place = mechanism.place(place).ok_or_else(|| format!("{study} has no place {place}"))?;
        let effect = hide(place);
        let folder = studies().join(study).join("data");
        std::fs::create_dir_all(&folder)?;
        for (file, seed, level) in [("estimation.csv", 101, 1.0), ("validation.csv", 202, HELD_OUT_LEVEL)] {
            let record = Record::measure(mechanism.as_ref(), &effect, seed, level);
            record.write(&folder.join(file))?;
            println!("{}: {} samples", folder.join(file).display(), record.columns[0].len());
        }
    }
    Ok(())
}

type Hide = fn(usize) -> Effect;

/// What each shipped study's records hide, and where.
const HIDDEN: [(&str, &str, Hide); 4] = [
    ("quarter_vehicle", "chassis_guide", |place| Effect::DryFriction { place, load: 60.0 }),
    ("two_mass", "coupling", |place| Effect::Backlash { place, gap: 0.025 }),
    ("crane_pendulum", "hook", |place| Effect::QuadraticDrag { place, factor: 0.2 }),
    ("spring_slide", "damper", |place| Effect::DamperSaturation { place, knee: 0.3, ratio: 0.25 }),
];

fn studies() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("studies")
}
