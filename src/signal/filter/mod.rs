//! Zero-phase low-pass filters as linear operators on columns of samples.

mod butterworth;
mod prefilter;

pub use butterworth::{Butterworth, FilterError, LowPass, Passes, Section};
pub use prefilter::Prefilter;
