//! From a simulation to a file: noise and sampling of the measuring chain.

use super::effect::Effect;
use super::excitation::Multisine;
use super::mechanism::Mechanism;
use super::random::Random;
use super::simulator::{Samples, simulate};
use std::io::Write;
use std::path::Path;

/// Standard deviation of the noise as a share of each channel's rms value.
pub const NOISE: f64 = 0.01;

/// Noise of a channel: its share of the channel's rms value, and the coefficients by which a sample follows from the
/// two before.
#[derive(Clone, Copy)]
pub struct Noise {
    pub share: f64,
    pub memory: [f64; 2],
}

const WHITE: Noise = Noise { share: NOISE, memory: [0.0, 0.0] };

impl Noise {
    /// Stationary, of variance one.
    fn samples(self, random: &mut Random, count: usize) -> Vec<f64> {
        let [a, b] = self.memory;
        if self.memory == [0.0, 0.0] {
            return (0..count).map(|_| random.normal()).collect();
        }
        let variance = (1.0 - b) / ((1.0 + b) * ((1.0 - b).powi(2) - a * a));
        let (mut last, mut before) = (0.0, 0.0);
        let mut next = || {
            (last, before) = (a * last + b * before + random.normal() / variance.sqrt(), last);
            last
        };
        (0..SETTLING).for_each(|_| {
            next();
        });
        (0..count).map(|_| next()).collect()
    }
}

/// Samples after which a process has forgotten its start.
const SETTLING: usize = 500;

/// Significant digits in the files: rounding stays below a hundredth of the noise.
const DIGITS_OF_CHANNELS: i32 = 5;
const DIGITS_OF_INPUT: i32 = 7;

/// A measured record with what no measurement tells.
pub struct Record {
    /// Column heads as `name [unit]`, time first.
    pub heads: Vec<String>,
    /// `columns[column][sample]`, in the heads' units.
    pub columns: Vec<Vec<f64>>,
    /// The channels without noise, in the heads' units.
    pub noise_free: Vec<Vec<f64>>,
}

impl Record {
    /// Excites the mechanism with `amplitude` times the usual level and measures it; `seed` sets phases and noise.
    pub fn measure(mechanism: &dyn Mechanism, effect: &Effect, seed: u64, amplitude: f64) -> Self {
        Self::with_noise(mechanism, effect, seed, amplitude, &[])
    }

    /// The same with noise of these kinds in the first channels.
    pub fn with_noise(mechanism: &dyn Mechanism, effect: &Effect, seed: u64, amplitude: f64, kinds: &[Noise]) -> Self {
        let samples = excite(mechanism, effect, seed, amplitude);
        let mut random = Random::new(seed ^ 0x05EE_D0F4_015E);
        let input = mechanism.input();
        let mut heads = vec!["t [s]".to_owned(), format!("{} [{}]", input.name, input.unit)];
        let commands = samples.input.iter().map(|value| rounded(value / input.factor, DIGITS_OF_INPUT)).collect();
        let mut columns = vec![samples.time, commands];
        let mut noise_free = vec![];
        let kinds = kinds.iter().copied().chain(std::iter::repeat(WHITE));
        for ((channel, values), kind) in mechanism.channels().iter().zip(samples.channels).zip(kinds) {
            heads.push(format!("{} [{}]", channel.name, channel.unit));
            let values: Vec<f64> = values.into_iter().map(|value| value / channel.factor).collect();
            let deviation = kind.share * rms(&values);
            let noise = kind.samples(&mut random, values.len());
            let noisy = values.iter().zip(noise).map(|(v, error)| rounded(v + deviation * error, DIGITS_OF_CHANNELS));
            columns.push(noisy.collect());
            noise_free.push(values);
        }
        Self { heads, columns, noise_free }
    }

    /// Writes comma-separated values with one line of heads.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        writeln!(file, "{}", self.heads.join(","))?;
        for sample in 0..self.columns[0].len() {
            let row: Vec<String> = self.columns.iter().map(|column| column[sample].to_string()).collect();
            writeln!(file, "{}", row.join(","))?;
        }
        file.flush()
    }

    /// Sum over the channels of noise power over the channel's power about its mean: what remains for a model that
    /// is the truth, as a share of what remains for a model that knows only every channel's mean.
    pub fn noise_floor(&self) -> f64 {
        let (mut noise, mut total) = (0.0, 0.0);
        for (measured, exact) in self.columns[2..].iter().zip(&self.noise_free) {
            let mean = measured.iter().sum::<f64>() / measured.len() as f64;
            let power: f64 = measured.iter().map(|value| (value - mean).powi(2)).sum();
            noise += measured.iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / power;
            total += 1.0;
        }
        noise / total
    }
}

/// The noise-free samples that `Record::measure` starts from.
pub fn excite(mechanism: &dyn Mechanism, effect: &Effect, seed: u64, amplitude: f64) -> Samples {
    let schedule = mechanism.schedule();
    let rms = amplitude * schedule.rms;
    let signal = Multisine::new(seed, schedule.band, schedule.lines, schedule.slope, rms, schedule.fade_in);
    simulate(mechanism, effect, &|t| signal.value(t))
}

/// How much the effect changes the outputs: per channel the rms of the change over the rms of the undisturbed channel,
/// root mean square over the channels.
pub fn strength(undisturbed: &Samples, disturbed: &Samples) -> f64 {
    let shares: Vec<f64> = undisturbed
        .channels
        .iter()
        .zip(&disturbed.channels)
        .map(|(first, second)| {
            let change: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
            rms(&change) / rms(first)
        })
        .collect();
    rms(&shares)
}

/// Root mean square of the values.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

pub fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let scale = 10f64.powi(digits - 1 - value.abs().log10().floor() as i32);
    let result = (value * scale).round() / scale;
    if result == 0.0 { 0.0 } else { result }
}
