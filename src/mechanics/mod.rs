//! From a checked study to equations of motion.
//!
//! *In*: a [`crate::study::Study`]. *Out*: a [`System`] of expressions in time, states, parameters and input samples only.
//! *Must not happen here*: numerical evaluation, parsing, knowledge of particular laws.

mod system;

pub use system::*;
