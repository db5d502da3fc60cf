//! Identification with honest statistics, on the shipped studies.

mod shipped;
mod validity;
