//! Identification of a study: its experiments, measured records and parameters turned into one least-squares problem,
//! solved, and reported with honest statistics.
//!
//! *In*: a compiled study with its records. *Out*: an [`Identification`]. *Must not happen here*: text of any kind,
//! decisions about the model's structure.

mod bands;
mod confidence;
mod constraints;
mod definitions;
mod errors;
mod fitting;
mod freedom;
mod knowledge;
mod noise;
mod problem;
mod profile;
mod report;
mod resolution;
mod result;
mod saved;
mod structures;
mod suspicious;
mod weights;
mod whitening;

pub use confidence::{Confidence, confidence};
pub use constraints::active_constraints;
pub use errors::{EquationFit, ErrorReport, OtherError, equation_error, error_report};
pub use fitting::{Fitted, Settings, fit, prefilters};
pub use noise::predicted_shares;
pub use problem::{Block, Problem};
pub use profile::{Profile, profiles};
pub use report::identification;
pub use resolution::resolution;
pub use result::*;
pub use saved::{RESULT, SavedParameter, SavedResult};
pub use structures::{Candidate, structures};
pub use weights::Weighting;
