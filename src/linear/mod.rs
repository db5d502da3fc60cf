//! Dense and sparse linear algebra behind concrete types: the only module that names faer and nalgebra.

mod pattern;
mod svd;

pub use pattern::SparsityPattern;
pub use svd::{DecompositionError, SingularValueDecomposition, rounding_threshold};
