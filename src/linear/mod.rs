//! Dense and sparse linear algebra behind concrete types: the only module that names faer and nalgebra.

mod dense_lu;
mod factorisation;
mod pattern;
mod sparse_lu;
mod svd;

pub use factorisation::{Factorisation, SingularMatrix};
pub use pattern::SparsityPattern;
pub use svd::{DecompositionError, SingularValueDecomposition, rounding_threshold};
