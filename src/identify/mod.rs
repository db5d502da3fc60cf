//! Identification of a study: its experiments, measured records and parameters turned into one least-squares problem,
//! solved, and reported with honest statistics.
//!
//! *In*: a compiled study with its records. *Out*: an [`Identification`]. *Must not happen here*: text of any kind,
//! decisions about the model's structure.

mod result;

pub use result::*;
