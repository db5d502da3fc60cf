//! From a checked study to equations of motion.
//!
//! *In*: a [`crate::study::Study`]. *Out*: a [`System`] of expressions in time, states, parameters and input samples only.
//! *Must not happen here*: repeated numerical evaluation, parsing, knowledge of particular laws.
//!
//! A joint is a list of motion axes; every axis is one link of the spanning tree (`topology`). Motion goes outwards
//! (`kinematics`), forces come from the elements (`forces`), accelerations from the articulated-body algorithm
//! (`articulated`), all on symbolic scalars, so that whatever is structurally zero vanishes.

mod articulated;
mod assembly;
mod derive;
mod emit;
mod forces;
mod kinematics;
mod loops;
mod scale;
mod starts;
mod system;
mod topology;

pub use derive::derive;
pub use emit::{emit_equations, emit_model, emit_tree};
pub use system::*;
