//! Design of Butterworth low-pass filters from edges and attenuations.

use crate::diagnostics::{Code, Diagnostic, Span};
use std::fmt;

/// Steeper transitions than this order can give are refused: the filter would ring longer than any record.
const HIGHEST_ORDER: u32 = 24;

/// A low-pass specification. Frequencies in Hz, attenuations in dB (positive).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    /// Up to here the amplitude falls by at most `pass_drop`.
    pub pass: f64,
    pub pass_drop: f64,
    /// From here on the amplitude is lower by at least `stop_attenuation`.
    pub stop: f64,
    pub stop_attenuation: f64,
    /// What the attenuations refer to.
    pub passes: Passes,
}

/// The filter runs forward and backward, which doubles every attenuation (in dB).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passes {
    /// The attenuations are those of one pass.
    One,
    /// The attenuations are those of the whole zero-phase operation.
    Both,
}

/// Second-order section `(b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)` with gain 1 at frequency zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    pub b: [f64; 3],
    /// a1, a2
    pub a: [f64; 2],
}

/// A designed digital filter (one pass).
#[derive(Clone, Debug, PartialEq)]
pub struct Butterworth {
    pub order: u32,
    /// Frequency at which one pass is 3 dB down, Hz.
    pub cutoff: f64,
    /// Hz
    pub sampling_rate: f64,
    pub sections: Vec<Section>,
}

/// Why there is no such filter. Frequencies in Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterError {
    /// Edges must satisfy 0 < pass < stop, and attenuations 0 < pass_drop < stop_attenuation.
    Contradictory,
    /// The stop edge is not below half the sampling rate.
    StopAboveNyquist { stop: f64, nyquist: f64 },
    /// The transition is so steep that it needs an order beyond the limit.
    TooSteep { order: u32, limit: u32 },
}

impl fmt::Display for FilterError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Contradictory => {
                formatter.write_str("a low-pass needs 0 < pass edge < stop edge and 0 dB < drop < attenuation")
            }
            Self::StopAboveNyquist { stop, nyquist } => {
                write!(formatter, "the stop edge {stop} Hz is not below half the sampling rate, {nyquist} Hz")
            }
            Self::TooSteep { order, limit } => {
                write!(formatter, "the transition needs order {order}; at most {limit} is sensible: widen it")
            }
        }
    }
}

impl std::error::Error for FilterError {}

impl FilterError {
    /// As a finding of the study at its `filter`.
    pub fn diagnostic(&self, place: Span) -> Diagnostic {
        let help = match self {
            Self::Contradictory => {
                "for example: pass 5 Hz, stop 7 Hz, 2 dB in the pass band, 20 dB in the stop band".into()
            }
            Self::StopAboveNyquist { nyquist, .. } => {
                format!("choose a stop edge below {nyquist} Hz, or drop the filter")
            }
            Self::TooSteep { .. } => "move the stop edge away from the pass edge, or ask for less attenuation".into(),
        };
        Diagnostic::error(Code::FILTER_IMPOSSIBLE, self.to_string()).label(place, "this filter").help(help)
    }
}

impl Butterworth {
    /// The lowest order that meets the specification at this sampling rate (Hz); the pass edge is met exactly, the stop
    /// edge exceeded (Oppenheim-Schafer-2010, 7.3: bilinear transformation with prewarped edges).
    pub fn design(specification: &LowPass, sampling_rate: f64) -> Result<Self, FilterError> {
        let LowPass { pass, stop, .. } = *specification;
        let share = match specification.passes {
            Passes::One => 1.0,
            Passes::Both => 0.5,
        };
        let (drop, attenuation) = (share * specification.pass_drop, share * specification.stop_attenuation);
        let sensible = pass > 0.0 && pass < stop && drop > 0.0 && drop < attenuation && attenuation.is_finite();
        if !sensible {
            return Err(FilterError::Contradictory);
        }
        let nyquist = sampling_rate / 2.0;
        if stop.is_nan() || stop >= nyquist {
            return Err(FilterError::StopAboveNyquist { stop, nyquist });
        }
        let warped = |frequency: f64| (std::f64::consts::PI * frequency / sampling_rate).tan();
        let excess = |decibel: f64| 10.0_f64.powf(decibel / 10.0) - 1.0;
        let exact = (excess(attenuation) / excess(drop)).log10() / (2.0 * (warped(stop) / warped(pass)).log10());
        let order = exact.ceil().max(1.0);
        if order > f64::from(HIGHEST_ORDER) {
            return Err(FilterError::TooSteep { order: order.min(1e9) as u32, limit: HIGHEST_ORDER });
        }
        let corner = warped(pass) * excess(drop).powf(-0.5 / order);
        let cutoff = sampling_rate / std::f64::consts::PI * corner.atan();
        Self::with_cutoff(order as u32, cutoff, sampling_rate)
    }

    /// Order and 3 dB frequency (Hz) given directly.
    pub fn with_cutoff(order: u32, cutoff: f64, sampling_rate: f64) -> Result<Self, FilterError> {
        if order == 0 || order > HIGHEST_ORDER {
            return Err(FilterError::TooSteep { order, limit: HIGHEST_ORDER });
        }
        let nyquist = sampling_rate / 2.0;
        if !(cutoff > 0.0 && cutoff < nyquist) {
            return Err(FilterError::StopAboveNyquist { stop: cutoff, nyquist });
        }
        let corner = (std::f64::consts::PI * cutoff / sampling_rate).tan();
        // Poles near the unit circle last, as is usual for cascades: it keeps intermediate signals small.
        let mut sections: Vec<Section> = (0..order / 2).map(|pair| pole_pair(order, pair, corner)).collect();
        if order % 2 == 1 {
            sections.insert(0, real_pole(corner));
        }
        Ok(Self { order, cutoff, sampling_rate, sections })
    }

    /// Amplitude of one pass at a frequency (Hz).
    pub fn amplitude(&self, frequency: f64) -> f64 {
        let angle = 2.0 * std::f64::consts::PI * frequency / self.sampling_rate;
        let magnitude = |c0: f64, c1: f64, c2: f64| {
            let real = c0 + c1 * angle.cos() + c2 * (2.0 * angle).cos();
            let imaginary = c1 * angle.sin() + c2 * (2.0 * angle).sin();
            real.hypot(imaginary)
        };
        self.sections.iter().map(|s| magnitude(s.b[0], s.b[1], s.b[2]) / magnitude(1.0, s.a[0], s.a[1])).product()
    }

    /// Number of samples after which the impulse response of one pass has decayed by `factor` (< 1).
    pub fn settling(&self, factor: f64) -> usize {
        let slowest = self.sections.iter().map(pole_radius).fold(0.0_f64, f64::max);
        if slowest <= 0.0 { 1 } else { (factor.ln() / slowest.ln()).ceil().max(1.0) as usize }
    }
}

/// Bilinear transform of a conjugate pair of analogue poles on the circle of radius `corner` (prewarped); `pair` counts
/// away from the real axis, from the most to the least damped (Oppenheim-Schafer-2010, 7.3).
fn pole_pair(order: u32, pair: u32, corner: f64) -> Section {
    let from_real_axis = if order % 2 == 1 { f64::from(pair) + 1.0 } else { f64::from(pair) + 0.5 };
    let damping = (std::f64::consts::PI * from_real_axis / f64::from(order)).cos();
    let scale = 1.0 + 2.0 * damping * corner + corner * corner;
    let a = [2.0 * (corner * corner - 1.0) / scale, (1.0 - 2.0 * damping * corner + corner * corner) / scale];
    // Equal to corner^2 / scale, but with the rounding errors of `a`: frequency zero passes exactly unchanged.
    let gain = (1.0 + a[0] + a[1]) / 4.0;
    Section { b: [gain, 2.0 * gain, gain], a }
}

fn real_pole(corner: f64) -> Section {
    let a = (corner - 1.0) / (corner + 1.0);
    let gain = (1.0 + a) / 2.0;
    Section { b: [gain, gain, 0.0], a: [a, 0.0] }
}

fn pole_radius(section: &Section) -> f64 {
    let [a1, a2] = section.a;
    let discriminant = a1 * a1 / 4.0 - a2;
    if discriminant < 0.0 { a2.sqrt() } else { a1.abs() / 2.0 + discriminant.sqrt() }
}
