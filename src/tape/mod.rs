//! Equations as straight-line programs.
//!
//! *In*: a [`crate::mechanics::System`]. *Out*: a [`Model`]: tapes for rates, their sparse Jacobian, parameter
//! derivatives, outputs and their derivatives, probes, start values. [`Bound`] evaluates them for one parameter vector
//! and one set of inputs.
//! *Must not happen here*: symbolic manipulation beyond asking the graph for derivatives, knowledge of mechanics or
//! data.
//!
//! A [`Model`] is immutable and shared between threads; all memory of an evaluation is in [`Bound`]. Nodes that depend
//! on parameters only are computed once per parameter vector, nodes of time and inputs once per time.
//!
//! A program is executed run by run of equal instructions; one of short runs that is executed often becomes machine
//! code, which gives the same digits.

mod bound;
mod compile;
mod elementary;
mod emit;
mod events;
mod expansion;
mod kernels;
mod kinks;
mod machine;
mod model;
mod program;
mod schedule;
mod slopes;
mod sweep;
mod tangent;

use crate::expression::{Curve, curve_of};
use std::sync::Arc;

pub use bound::{Bound, StartValues};
pub use emit::emit_tape;
pub use model::{DerivativeForm, Model};
pub use tangent::Tangent;

/// Sampled inputs of an experiment as functions of time.
pub trait InputSource: Sync {
    /// The `order`-th time derivative of input channel `input` (index in the study's inputs) at time `t`, SI.
    fn sample(&self, input: u32, order: u8, t: f64) -> f64;
}

/// The inputs with the curves of the model.
struct Sources<'a> {
    curves: &'a [Arc<Curve>],
    inputs: &'a dyn InputSource,
}

impl InputSource for Sources<'_> {
    fn sample(&self, input: u32, order: u8, t: f64) -> f64 {
        match curve_of(self.curves, input) {
            Some(curve) => curve.evaluate(t, order),
            None => self.inputs.sample(input, order, t),
        }
    }
}
