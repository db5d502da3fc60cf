//! The integrators against analytic solutions and published references.

mod equilibrium;
mod events;
mod failures;
mod loops;
mod mechanisms;
mod orders;
mod problems;
mod references;
mod scalar;
mod sensitivities;
mod system;
