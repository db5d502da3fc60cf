//! Identification with honest statistics, on the shipped studies.

mod combination;
mod coverage;
mod definitions;
mod elastic;
#[path = "../truth/kicked.rs"]
mod kicked;
mod nuisance;
mod plan;
#[path = "../support/repeated.rs"]
mod repeated;
mod shipped;
mod structures;
mod surface;
mod validity;
