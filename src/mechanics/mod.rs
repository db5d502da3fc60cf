//! From a checked study to equations of motion.
//!
//! *In*: a [`crate::study::Study`]. *Out*: a [`System`] of expressions in time, states, parameters and input samples
//! only.
//! *Must not happen here*: repeated numerical evaluation, parsing, knowledge of particular laws.
//!
//! A joint is a list of motion axes; every axis is one link of the spanning tree (`topology`). Motion goes outwards
//! (`kinematics`), forces come from the elements (`forces`), accelerations from the articulated-body algorithm
//! (`articulated`, with modes of elastic bodies `elastic` and `modal_pass`), all on symbolic scalars, so that whatever
//! is structurally zero vanishes. Joints that close loops are rows of constraints (`loops`), so are relations of
//! positions and of rates (`couplings`), of which those count that are independent near the start (`assembly`, in
//! numbers `linkage`; where a loop needs others in other positions, `selection`), with two multipliers each, or one where
//! only rates are held (`multipliers`); what joints transmit follows from the same pass (`reactions`).

mod articulated;
mod assemble;
mod assembly;
mod chain;
mod closing;
mod couplings;
mod derive;
mod elastic;
mod emit;
mod emit_latex;
mod events;
mod forces;
mod inertia;
mod kinematics;
mod linkage;
mod loops;
mod modal_pass;
mod multipliers;
mod reactions;
mod scale;
mod selection;
mod starts;
mod system;
mod topology;

pub use derive::derive;
pub use emit::{TEXT_FORM, emit_equations, emit_model, emit_tree};
pub use emit_latex::emit_latex;
pub use system::*;
