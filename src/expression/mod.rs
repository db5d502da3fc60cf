//! The symbolic graph: every force law, kinematic relation and measurement is a node of one hash-consed,
//! acyclic graph.
//!
//! *In*: constants, named symbols, operations on nodes. *Out*: nodes; derivatives and substitutions are nodes of
//! the same graph. *Must not happen here*: numerical evaluation of models (that is [`crate::tape`]), knowledge of
//! bodies, laws or units.
//!
//! Equal subexpressions are one node by construction; simplification happens when a node is built
//! ([`Graph`] applies the rules of `simplify`), so there is no unsimplified form to forget about.

mod curve;
mod differentiate;
mod graph;
mod latex;
mod print;
#[cfg(test)]
mod properties;
mod simplify;
pub(crate) mod vector;

pub(crate) use curve::polynomial;
pub use curve::{Beyond, Curve};
pub use differentiate::Entry;
pub use graph::{Binary, CURVES, Graph, Node, Operation, Symbol, Unary, curve_of};
pub use latex::{LatexPrinter, latex_name};
pub use print::Printer;
