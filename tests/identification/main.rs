//! Identification with honest statistics, on the shipped studies.

mod combination;
mod coverage;
mod definitions;
mod nuisance;
mod plan;
mod shipped;
mod structures;
mod surface;
mod validity;
