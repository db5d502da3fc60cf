//! Simulators that make measured records whose truth is known.
//!
//! *In*: a mechanism with its true numbers, one hidden effect, an excitation, a seed. *Out*: records as files.
//! *Must not happen here*: any use of the crate under test. Equations of motion are written by hand in coordinates
//! of their own, integrated with the classical fourth-order Runge-Kutta method at fixed fine steps; sticking,
//! slipping, contact and clipping switch exactly at the located instant.

#![allow(dead_code, reason = "each test binary uses another part of the simulators")]

pub mod crane_pendulum;
pub mod effect;
pub mod elastic_arm;
pub mod excitation;
pub mod kicked;
pub mod magnet;
pub mod mechanism;
pub mod quarter_vehicle;
pub mod random;
pub mod record;
pub mod shimmy;
pub mod shipped;
pub mod simulator;
pub mod spring_slide;
pub mod two_mass;

use mechanism::Mechanism;

/// The mechanism of a shipped study by the study's name.
pub fn mechanism(name: &str) -> Option<Box<dyn Mechanism>> {
    match name {
        "quarter_vehicle" => Some(Box::new(quarter_vehicle::QuarterVehicle::default())),
        "two_mass" => Some(Box::new(two_mass::TwoMass::default())),
        "crane_pendulum" => Some(Box::new(crane_pendulum::CranePendulum::default())),
        "spring_slide" => Some(Box::new(spring_slide::SpringSlide::default())),
        _ => None,
    }
}
