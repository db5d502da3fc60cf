//! Identification with honest statistics, on the shipped studies.

mod coverage;
mod shipped;
mod validity;
