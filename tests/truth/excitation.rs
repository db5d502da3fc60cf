//! Smooth band-limited excitation, exact at every instant (so that a delay is exact too).

use super::random::Random;
use std::f64::consts::TAU;

struct Line {
    amplitude: f64,
    frequency: f64,
    phase: f64,
}

/// A random-phase multisine that fades in from rest: value, rate and second derivative are zero at and before t = 0.
pub struct Multisine {
    lines: Vec<Line>,
    fade_in: f64,
}

impl Multisine {
    /// `count` lines, spaced evenly on a logarithmic axis of frequency with a random shift inside their slot, with
    /// amplitudes falling as `frequency^-slope`, scaled so that the rms value of the faded-in signal is `rms`.
    pub fn new(seed: u64, band: (f64, f64), count: usize, slope: f64, rms: f64, fade_in: f64) -> Self {
        let mut random = Random::new(seed);
        let ratio = (band.1 / band.0).powf(1.0 / count as f64);
        let mut lines: Vec<Line> = (0..count)
            .map(|index| {
                let frequency = band.0 * ratio.powf(index as f64 + random.uniform());
                Line { amplitude: frequency.powf(-slope), frequency, phase: TAU * random.uniform() }
            })
            .collect();
        let power: f64 = lines.iter().map(|line| line.amplitude * line.amplitude / 2.0).sum();
        for line in &mut lines {
            line.amplitude *= rms / power.sqrt();
        }
        Self { lines, fade_in }
    }

    /// Value at time `t` in s.
    pub fn value(&self, t: f64) -> f64 {
        if t <= 0.0 {
            return 0.0;
        }
        let s = (t / self.fade_in).min(1.0);
        let envelope = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        envelope
            * self.lines.iter().map(|line| line.amplitude * (TAU * line.frequency * t + line.phase).sin()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rms_value_is_the_one_asked_for() {
        let signal = Multisine::new(3, (0.5, 15.0), 20, 1.0, 2.0, 0.5);
        let count = 200_000;
        let power = (0..count).map(|k| signal.value(1.0 + k as f64 * 1e-3).powi(2)).sum::<f64>() / count as f64;
        assert!((power.sqrt() - 2.0).abs() < 0.05, "{}", power.sqrt());
    }

    #[test]
    fn it_starts_from_rest() {
        let signal = Multisine::new(3, (0.5, 15.0), 20, 1.0, 2.0, 0.5);
        assert_eq!(signal.value(0.0), 0.0);
        assert!(signal.value(1e-3).abs() < 1e-5);
    }
}
