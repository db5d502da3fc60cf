//! Dense and sparse linear algebra behind concrete types: the only module that names faer and nalgebra.

mod dense_lu;
mod factorisation;
mod pattern;
mod svd;
mod sparse_lu;

pub use factorisation::{Factorisation, SingularMatrix};
pub use pattern::SparsityPattern;
pub use svd::{DecompositionError, SingularValueDecomposition, rounding_threshold};
