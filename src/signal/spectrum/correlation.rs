//! Correlation of residuals with themselves and with other signals.

use realfft::RealFftPlanner;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Autocovariance at lags 0 ..= `largest_lag` of the samples less their mean, divided by N at every lag (so that the
/// sequence is positive definite). Lags beyond N-1 are zero.
pub fn autocovariance(samples: &[f64], largest_lag: usize) -> Vec<f64> {
    let centred = centred(samples);
    raw_correlation(&centred, &centred, largest_lag)
}

/// Autocovariance divided by its value at lag 0; all zero but the first for a constant signal.
pub fn autocorrelation(samples: &[f64], largest_lag: usize) -> Vec<f64> {
    let covariance = autocovariance(samples, largest_lag);
    let variance = covariance[0];
    let scaled = |value: &f64| if variance > 0.0 { value / variance } else { 0.0 };
    let mut correlation: Vec<f64> = covariance.iter().map(scaled).collect();
    correlation[0] = 1.0;
    correlation
}

/// Correlation coefficients of `a[t + lag]` with `b[t]` for lags 0 ..= `largest_lag`, both less their means; zero where
/// one of them is constant. Lengths must agree.
pub fn cross_correlation(a: &[f64], b: &[f64], largest_lag: usize) -> Vec<f64> {
    let (a, b) = (centred(a), centred(b));
    let norm = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let scale = norm(&a) * norm(&b) / a.len().max(1) as f64;
    let correlation = raw_correlation(&a, &b, largest_lag);
    correlation.into_iter().map(|value| if scale > 0.0 { value / scale } else { 0.0 }).collect()
}

/// Ljung-Box test of whiteness over `lags` lags; `fitted` of them are spent by fitted coefficients of a noise model.
/// Returns the statistic and its p-value (1 where there are too few samples to judge).
pub fn ljung_box(samples: &[f64], lags: usize, fitted: usize) -> (f64, f64) {
    let count = samples.len() as f64;
    let lags = lags.min(samples.len().saturating_sub(2));
    if lags <= fitted {
        return (0.0, 1.0);
    }
    let correlation = autocorrelation(samples, lags);
    let statistic: f64 = (1..=lags).map(|lag| correlation[lag] * correlation[lag] / (count - lag as f64)).sum::<f64>()
        * count
        * (count + 2.0);
    let p_value = ChiSquared::new((lags - fitted) as f64).map_or(1.0, |distribution| distribution.sf(statistic));
    (statistic, p_value)
}

/// Number of independent samples with the same information on the variance: N / (1 + 2 sum rho_k^2), the equivalent
/// degrees of freedom of a coloured residual (Bartlett-1946; for a signal that fills the share B of the band: N B).
///
/// Squares of estimated correlations are about 1/(this number) too large each, which is taken off; lags run to a
/// quarter of the record. The result lies in 1 ..= N.
pub fn effective_count(samples: &[f64]) -> f64 {
    let count = samples.len();
    if count < 4 {
        return count as f64;
    }
    let largest_lag = count / 4;
    let correlation = autocorrelation(samples, largest_lag);
    let taper = |lag: usize| 1.0 - lag as f64 / count as f64;
    let raw: f64 = (1..=largest_lag).map(|lag| taper(lag) * correlation[lag] * correlation[lag]).sum();
    let share = (1..=largest_lag).map(taper).sum::<f64>() / count as f64;
    // With the bias (1 + 2 sum) / N per lag taken off: sum = raw - share (1 + 2 sum).
    let sum = (raw - share) / (1.0 + 2.0 * share);
    (count as f64 / (1.0 + 2.0 * sum.max(0.0))).clamp(1.0, count as f64)
}

fn centred(samples: &[f64]) -> Vec<f64> {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    samples.iter().map(|value| value - mean).collect()
}

/// `sum_t a[t + lag] b[t] / N` by fast Fourier transformation, zero-padded so that nothing wraps around.
fn raw_correlation(a: &[f64], b: &[f64], largest_lag: usize) -> Vec<f64> {
    let count = a.len().min(b.len());
    let mut result = vec![0.0; largest_lag + 1];
    if count == 0 {
        return result;
    }
    let length = (2 * count).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, backward) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let transformed = |values: &[f64]| {
        let mut padded = values[..count].to_vec();
        padded.resize(length, 0.0);
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut padded, &mut spectrum).map(|()| spectrum)
    };
    let (Ok(mut first), Ok(second)) = (transformed(a), transformed(b)) else {
        return vec![f64::NAN; largest_lag + 1];
    };
    first.iter_mut().zip(&second).for_each(|(x, y)| *x *= y.conj());
    let mut correlation = backward.make_output_vec();
    // The imaginary parts at the ends must be exactly zero for the inverse; rounding may leave some.
    if let Some(end) = first.first_mut() {
        end.im = 0.0;
    }
    if let Some(end) = first.last_mut() {
        end.im = 0.0;
    }
    if backward.process(&mut first, &mut correlation).is_err() {
        return vec![f64::NAN; largest_lag + 1];
    }
    let scale = 1.0 / (length as f64 * count as f64);
    for (lag, value) in result.iter_mut().enumerate().take(count) {
        *value = correlation[lag] * scale;
    }
    result
}
