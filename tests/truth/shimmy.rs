//! A towed wheel that swivels by itself while a rough road pushes it at random: noise in the process, not only in the
//! measurement.

use super::kicked::kicked;
use super::random::Random;
use super::record::Record;

pub const INERTIA: f64 = 0.5;
pub const ALIGNMENT: f64 = 800.0;
pub const STRENGTH: f64 = 6.0;
const REACH: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// Root of the spectral density of the road's moment, N m sqrt(s).
pub const ROAD: f64 = 0.8;
/// Of the measured swivel, deg.
pub const NOISE: f64 = 0.15;
const START: f64 = 3.0 * std::f64::consts::PI / 180.0;
const SAMPLING: f64 = 100.0;
const SAMPLES: usize = 400;
const SUBSTEPS: usize = 50;

fn rates([angle, rate]: [f64; 2]) -> [f64; 2] {
    let tyre = STRENGTH * (1.0 - (angle / REACH).powi(2)) * rate;
    [rate, (tyre - ALIGNMENT * angle) / INERTIA]
}

pub fn towing(seed: u64) -> Record {
    let mut road = Random::new(seed);
    let mut noise = Random::new(seed ^ 0x05EE_D0F4_015E);
    let h = 1.0 / (SAMPLING * SUBSTEPS as f64);
    let states = kicked(rates, [START, 0.0], ROAD / INERTIA, (SUBSTEPS, h), || road.normal());
    let noise_free: Vec<f64> = states.take(SAMPLES).map(|state| state[0].to_degrees()).collect();
    let time = (0..SAMPLES).map(|k| (k as f64 / SAMPLING * 1e6).round() / 1e6).collect();
    let measured = noise_free.iter().map(|swivel| ((swivel + NOISE * noise.normal()) * 1e4).round() / 1e4).collect();
    Record {
        heads: vec!["t [s]".to_owned(), "swivel [deg]".to_owned()],
        columns: vec![time, measured],
        noise_free: vec![noise_free],
    }
}
