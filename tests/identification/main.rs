//! Identification with honest statistics, on the shipped studies.

mod combination;
mod coverage;
mod definitions;
mod nuisance;
mod plan;
#[path = "../support/repeated.rs"]
mod repeated;
mod shipped;
mod structures;
mod surface;
mod validity;
