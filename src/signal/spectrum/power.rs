//! Power spectral densities.

use realfft::RealFftPlanner;

/// One-sided power spectral density; its integral over frequency is the variance of the signal.
#[derive(Clone, Debug, PartialEq)]
pub struct PowerSpectrum {
    /// Hz, equidistant from 0.
    pub frequencies: Vec<f64>,
    /// Square of the signal's unit per Hz.
    pub density: Vec<f64>,
}

/// Periodogram of the samples less their mean.
pub fn periodogram(samples: &[f64], sampling_rate: f64) -> PowerSpectrum {
    let window = vec![1.0; samples.len()];
    segment_spectrum(&[samples], &window, sampling_rate)
}

/// Mean of the periodograms of half-overlapping segments under a Hann window, each less its mean (Welch-1967).
/// `segment_length` is cut to the number of samples.
pub fn welch(samples: &[f64], sampling_rate: f64, segment_length: usize) -> PowerSpectrum {
    let length = segment_length.clamp(2.min(samples.len()), samples.len());
    let window: Vec<f64> =
        (0..length).map(|k| 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / length as f64).cos()).collect();
    let stride = (length / 2).max(1);
    let segments: Vec<&[f64]> = samples.windows(length.max(1)).step_by(stride).collect();
    segment_spectrum(&segments, &window, sampling_rate)
}

fn segment_spectrum(segments: &[&[f64]], window: &[f64], sampling_rate: f64) -> PowerSpectrum {
    let length = window.len();
    if length == 0 || segments.is_empty() {
        return PowerSpectrum { frequencies: Vec::new(), density: Vec::new() };
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mut spectrum = transform.make_output_vec();
    let mut density = vec![0.0; spectrum.len()];
    let energy: f64 = window.iter().map(|value| value * value).sum();
    for segment in segments {
        let mean = segment.iter().sum::<f64>() / length as f64;
        let mut weighted: Vec<f64> =
            segment.iter().zip(window).map(|(value, weight)| (value - mean) * weight).collect();
        if transform.process(&mut weighted, &mut spectrum).is_err() {
            // Lengths come from the plan itself, so this cannot happen; a NaN density would be seen.
            density.iter_mut().for_each(|value| *value = f64::NAN);
            break;
        }
        for (k, (sum, value)) in density.iter_mut().zip(&spectrum).enumerate() {
            let is_unpaired = k == 0 || (length.is_multiple_of(2) && k == length / 2);
            let sides = if is_unpaired { 1.0 } else { 2.0 };
            *sum += sides * value.norm_sqr() / (energy * sampling_rate * segments.len() as f64);
        }
    }
    let frequencies = (0..density.len()).map(|k| k as f64 * sampling_rate / length as f64).collect();
    PowerSpectrum { frequencies, density }
}

/// Share of the total power (0..1) between successive `edges` (Hz, ascending); power outside is not counted as a band.
pub fn band_shares(spectrum: &PowerSpectrum, edges: &[f64]) -> Vec<f64> {
    let total: f64 = spectrum.density.iter().sum();
    edges
        .windows(2)
        .map(|band| {
            let inside: f64 = spectrum
                .frequencies
                .iter()
                .zip(&spectrum.density)
                .filter(|(frequency, _)| **frequency >= band[0] && **frequency < band[1])
                .map(|(_, density)| density)
                .sum();
            if total > 0.0 { inside / total } else { 0.0 }
        })
        .collect()
}
