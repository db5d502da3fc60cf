//! A towed wheel that swivels by itself while a rough road pushes it at random: noise in the process, not only in the measurement.

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

/// The drift by classical Runge-Kutta, the road by Euler and Maruyama.
pub fn towing(seed: u64) -> Record {
    let mut road = Random::new(seed);
    let mut noise = Random::new(seed ^ 0x05EE_D0F4_015E);
    let h = 1.0 / (SAMPLING * SUBSTEPS as f64);
    let mut state = [START, 0.0];
    let (mut time, mut measured, mut noise_free) = (vec![], vec![], vec![]);
    for k in 0..SAMPLES {
        for _ in 0..if k == 0 { 0 } else { SUBSTEPS } {
            let moved = |rate: [f64; 2], h: f64| [state[0] + h * rate[0], state[1] + h * rate[1]];
            let a = rates(state);
            let b = rates(moved(a, 0.5 * h));
            let c = rates(moved(b, 0.5 * h));
            let d = rates(moved(c, h));
            (0..2).for_each(|i| state[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            state[1] += ROAD / INERTIA * h.sqrt() * road.normal();
        }
        let swivel = state[0].to_degrees();
        time.push((k as f64 / SAMPLING * 1e6).round() / 1e6);
        measured.push(((swivel + NOISE * noise.normal()) * 1e4).round() / 1e4);
        noise_free.push(swivel);
    }
    Record {
        heads: vec!["t [s]".to_owned(), "swivel [deg]".to_owned()],
        columns: vec![time, measured],
        noise_free: vec![noise_free],
    }
}
