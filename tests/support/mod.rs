//! Cases with a known cause: what is hidden, how strong it is, and the study folder made of it.
//!
//! *In*: a shipped study's text, an effect's name, a place's name, a class of strength, a seed. *Out*: a folder with
//! the study and two records. *Must not happen here*: anything that tells the product what is hidden.

#![allow(dead_code, reason = "each test binary uses another part")]

pub mod judge;
pub mod strength;

use crate::truth::effect::Effect;
use crate::truth::mechanism::Mechanism;
use crate::truth::record::Record;
use crate::truth::shipped::HELD_OUT_LEVEL;
use std::path::{Path, PathBuf};
pub use strength::Strength;

/// The held-out record has phases and noise of its own.
const HELD_OUT_SEED: u64 = 0x0DD5_EED5;

/// One line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// A folder under `studies/`.
    pub study: &'static str,
    /// Name of an effect of the catalogue; `None` hides nothing.
    pub hidden: Option<(&'static str, &'static str)>,
    pub strength: Strength,
    pub seed: u64,
}

/// A case's records and their truth.
pub struct Prepared {
    pub case: Case,
    pub effect: Effect,
    /// Measured strength of the effect in the estimation record.
    pub measured_strength: f64,
    pub estimation: Record,
    pub validation: Record,
}

impl Case {
    /// `dry_friction at strut, medium (quarter_vehicle, seed 3)`
    pub fn title(&self) -> String {
        let cause = self.cause().map_or("nothing".to_owned(), |cause| format!("{cause}, {:?}", self.strength));
        format!("{cause} ({}, seed {})", self.study, self.seed)
    }

    /// The hidden cause as an answer names it.
    pub fn cause(&self) -> Option<String> {
        self.hidden.map(|(effect, place)| format!("{effect} at {place}"))
    }

    /// Chooses the effect's numbers by the class of strength and makes both records.
    pub fn prepare(&self) -> Prepared {
        let mechanism = self.mechanism();
        let (effect, measured_strength) = match self.hidden {
            None => (Effect::Nothing, 0.0),
            Some((effect, place)) => strength::calibrated(mechanism.as_ref(), effect, place, self.strength, self.seed),
        };
        let estimation = Record::measure(mechanism.as_ref(), &effect, self.seed, 1.0);
        let validation = Record::measure(mechanism.as_ref(), &effect, self.seed ^ HELD_OUT_SEED, HELD_OUT_LEVEL);
        Prepared { case: *self, effect, measured_strength, estimation, validation }
    }

    fn mechanism(&self) -> Box<dyn Mechanism> {
        crate::truth::mechanism(self.study).unwrap_or_else(|| panic!("no simulator for {}", self.study))
    }
}

impl Prepared {
    /// Writes the study and its records into `folder`; returns the study's file.
    pub fn write(&self, folder: &Path) -> std::io::Result<PathBuf> {
        let name = format!("{}.ident", self.case.study);
        let text = std::fs::read_to_string(studies().join(self.case.study).join(&name))?;
        let file = folder.join(name);
        std::fs::write(&file, text)?;
        std::fs::create_dir_all(folder.join("data"))?;
        self.estimation.write(&folder.join("data/estimation.csv"))?;
        self.validation.write(&folder.join("data/validation.csv"))?;
        Ok(file)
    }
}

/// The shipped studies.
pub fn studies() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("studies")
}
