//! What an identified model is good for.
//!
//! *In*: a compiled study with manoeuvres and criteria, an estimate with its covariance. *Out*: per criterion its
//! value, interval and verdict ([`Validity`]); before any test, what the offered excitations and sensors would tell
//! ([`Plan`]); what a single law does ([`Characteristic`]). *Must not happen here*: fits, files, text for a terminal.

mod characteristic;
mod courses;
mod criterion;
mod cuts;
mod descents;
mod increments;
mod monte_carlo;
mod plan;
mod validity;

pub use characteristic::{Characteristic, Course as LawCourse, Demonstration, Trace, characteristic, laws};
pub use courses::{Course, Courses, courses};
pub use criterion::{CriterionValues, evaluate};
pub use cuts::{Cut, CutCurve, Cuts, cuts};
pub use descents::{Descent, Descents, descents};
pub use monte_carlo::MonteCarlo;
pub use plan::*;
pub use validity::*;
