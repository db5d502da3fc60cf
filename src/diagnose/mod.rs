//! Shows what the simulation gets wrong, names the cause, extends the model and measures the gain.
//!
//! *In*: a loaded study and its records. *Out*: an [`Answer`]. *Must not happen here*: printing; any knowledge of a
//! particular effect (candidates come from the catalogue written in the language).

mod answer;

pub use answer::*;
