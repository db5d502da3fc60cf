//! Equations of motion and their compiled form against independent derivations.

mod build;
mod pendulum;
