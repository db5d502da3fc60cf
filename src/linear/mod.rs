//! Dense and sparse linear algebra behind concrete types: the only module that names faer and nalgebra.

mod pattern;

pub use pattern::SparsityPattern;
