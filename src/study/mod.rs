//! From the tree of a study's text to a checked [`Study`]: names resolved, dimensions checked, laws and effects
//! inlined, the chosen variant applied.
//!
//! *In*: a [`crate::syntax`] tree and the name of a variant. *Out*: a [`Study`], or diagnostics. *Must not happen
//! here*: kinematics (elements refer to their coordinates by symbols that [`crate::mechanics`] replaces), numbers
//! that depend on data, file access other than `use` of further study files.

mod model;

pub use model::*;
