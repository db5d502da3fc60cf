//! Equations of motion and their compiled form against independent derivations.

mod build;
mod cases;
mod derivatives;
mod faults;
mod maximal;
mod pendulum;
mod spatial;
mod text;
