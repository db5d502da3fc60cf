//! Equations of motion and their compiled form against independent derivations.

mod build;
mod cantilever;
mod cases;
mod couplings;
mod derivatives;
mod effects;
mod elastic;
mod faults;
mod impacts;
mod linkages;
mod maximal;
mod newton_euler;
mod pendulum;
mod random_states;
mod rolling;
mod run;
mod spatial;
mod text;
