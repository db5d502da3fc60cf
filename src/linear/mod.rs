//! Dense and sparse linear algebra behind concrete types: the only module that names faer and nalgebra.

mod basis;
mod dense_block;
mod dense_lu;
mod determinant;
mod factorisation;
mod pattern;
mod products;
mod regularised;
mod sparse_lu;
mod svd;

pub use basis::{Basis, least_squares, perpendicular};
pub use determinant::sign_of_determinant;
pub use factorisation::{Factorisation, SingularMatrix};
pub use pattern::SparsityPattern;
pub use products::{RowOrder, combine};
pub use regularised::smooth_least_squares;
pub use svd::{DecompositionError, SingularValueDecomposition, rounding_threshold};
