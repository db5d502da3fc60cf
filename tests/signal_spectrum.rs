//! Spectra, correlations and noise models against SciPy 1.17.1 figures and against noise of known properties.

use ident::signal::{
    AutoRegression, Butterworth, Prefilter, autocorrelation, autocovariance, band_shares, cross_correlation,
    effective_count, ljung_box, periodogram, welch,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

fn signal() -> Vec<f64> {
    (0..200)
        .map(|k| {
            let t = f64::from(k);
            (0.05 * t).sin() + 0.3 * (1.7 * t).cos() + 0.01 * t + 0.2 * f64::from((k * 7919) % 13) / 13.0
        })
        .collect()
}

/// Standard normal samples by the Box-Muller transformation.
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = move || ((generator.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    (0..count).map(|_| (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()).collect()
}

fn close(value: f64, reference: f64) -> bool {
    (value - reference).abs() < 1e-10 * reference.abs().max(1e-3)
}

/// `scipy.signal.welch(x, fs=100, nperseg=64)` and `periodogram(x, fs=100)`.
#[test]
fn densities_agree_with_scipy() {
    let spectrum = welch(&signal(), 100.0, 64);
    assert_eq!(spectrum.frequencies[17], 26.5625);
    let table = [
        (0, 0.012211828258625861),
        (1, 0.06473719039968473),
        (2, 0.006473093476763258),
        (17, 0.01685583990505089),
        (32, 6.477489371810627e-08),
    ];
    for (index, reference) in table {
        assert!(close(spectrum.density[index], reference), "{index}: {}", spectrum.density[index]);
    }
    let spectrum = periodogram(&signal(), 100.0);
    for (index, reference) in
        [(1, 0.9217900116172542), (3, 0.040339093108042304), (54, 0.08289596723564682), (100, 2.470317103670838e-05)]
    {
        assert!(close(spectrum.density[index], reference), "{index}: {}", spectrum.density[index]);
    }
    let variance = autocovariance(&signal(), 0)[0];
    assert!((spectrum.density.iter().sum::<f64>() * 0.5 - variance).abs() < 1e-12);
    let shares = band_shares(&spectrum, &[0.0, 2.0, 20.0, 51.0]);
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12 && shares[0] > 0.8);
}

/// NumPy: c = x - mean; sum(c[l:] * c[:n-l]) / sum(c * c); Ljung-Box with `scipy.stats.chi2.sf`.
#[test]
fn correlations_agree_with_numpy() {
    let correlation = autocorrelation(&signal(), 20);
    for (lag, reference) in [(0, 1.0), (1, 0.9268782927386943), (5, 0.8636186611443118), (20, 0.5654723655635027)] {
        assert!(close(correlation[lag], reference), "{lag}: {}", correlation[lag]);
    }
    let chirp = |k: f64| (k * k * 0.7).sin() + 0.3 * ((k - 1.0) * (k - 1.0) * 0.7).sin();
    let samples: Vec<f64> = (0..200).map(|k| chirp(f64::from(k))).collect();
    let (statistic, p_value) = ljung_box(&samples, 10, 0);
    assert!((statistic - 19.753161113188714).abs() < 1e-8 && (p_value - 0.031675734105155985).abs() < 1e-9);
    assert!((ljung_box(&samples, 10, 2).1 - 0.011311374201391267).abs() < 1e-9);
}

#[test]
fn cross_correlation_finds_the_lag() {
    let source = noise(500, 3);
    let mut delayed = vec![0.0; 500];
    delayed[7..].copy_from_slice(&source[..493]);
    let correlation = cross_correlation(&delayed, &source, 12);
    assert!(correlation[7] > 0.97 && correlation.iter().enumerate().all(|(lag, value)| lag == 7 || value.abs() < 0.2));
    assert_eq!(cross_correlation(&[1.0; 9], &source[..9], 2), [0.0; 3]);
}

/// x_t = 1.2 x_{t-1} - 0.5 x_{t-2} + e_t: coefficients within four standard errors (0.9 / sqrt N), order found,
/// whitened.
#[test]
fn autoregression_finds_and_whitens_coloured_noise() {
    let innovations = noise(4000, 11);
    let mut samples = vec![0.0; 4000];
    for t in 2..4000 {
        samples[t] = 1.2 * samples[t - 1] - 0.5 * samples[t - 2] + 2.0 * innovations[t];
    }
    let model = AutoRegression::choose(&samples, 20);
    assert_eq!(model.order(), 2);
    assert!((model.coefficients[0] - 1.2).abs() < 0.06 && (model.coefficients[1] + 0.5).abs() < 0.06, "{model:?}");
    assert!((model.variance - 4.0).abs() < 0.4);
    assert!(ljung_box(&samples, 20, 0).1 < 1e-6);
    let mut white = samples.clone();
    model.whiten(&mut white);
    assert!(ljung_box(&white, 20, 2).1 > 0.01);
    let variance = white.iter().map(|value| value * value).sum::<f64>() / 4000.0;
    assert!((variance / model.variance - 1.0).abs() < 0.01);
    // The density integrates to the variance of the process.
    let step = 0.01;
    let power: f64 = (0..5000).map(|k| model.density((f64::from(k) + 0.5) * step, 100.0) * step).sum();
    assert!((power / autocovariance(&samples, 0)[0] - 1.0).abs() < 0.05);
}

/// Whitening is linear, and the covariance of whitened noise is exactly diagonal: checked against a Cholesky factor of
/// the process's covariance matrix for an AR(1).
#[test]
fn the_first_samples_are_whitened_exactly() {
    let model = AutoRegression::burg(
        &noise(500, 2)
            .iter()
            .scan(0.0, |x, e| {
                *x = 0.8 * *x + e;
                Some(*x)
            })
            .collect::<Vec<_>>(),
        1,
    );
    let a = model.coefficients[0];
    let mut columns: Vec<Vec<f64>> = (0..5).map(|j| (0..5).map(|i| f64::from(i == j)).collect()).collect();
    columns.iter_mut().for_each(|column| model.whiten(column));
    let covariance = |i: usize, j: usize| model.variance * a.powi(i.abs_diff(j) as i32) / (1.0 - a * a);
    for r in 0..5 {
        for s in 0..5 {
            let whitened: f64 = (0..25).map(|k| columns[k / 5][r] * covariance(k / 5, k % 5) * columns[k % 5][s]).sum();
            let expected = if r == s { model.variance } else { 0.0 };
            assert!((whitened - expected).abs() < 1e-12, "{r} {s}: {whitened}");
        }
    }
}

/// White noise keeps its count; noise that fills a tenth of the band has a tenth of it.
#[test]
fn effective_counts_follow_the_bandwidth() {
    let white = noise(8000, 5);
    assert!(effective_count(&white) > 0.9 * 8000.0);
    let filter = Prefilter::new(Some(Butterworth::with_cutoff(8, 5.0, 100.0).unwrap()), false);
    let mut narrow = white.clone();
    filter.apply(&mut narrow);
    let expected = 8000.0 * filter.noise_gain().powi(2) / fourth_power_gain(&filter);
    let count = effective_count(&narrow);
    assert!((count / expected - 1.0).abs() < 0.1, "{count} against {expected}");
    assert!(count > 0.07 * 8000.0 && count < 0.12 * 8000.0);
    assert_eq!(effective_count(&[1.0, 2.0]), 2.0);
    assert_eq!(AutoRegression::choose(&[0.0; 50], 5).order(), 0);
}

/// Mean of |H|^4 over the band up to half the sampling rate (100 Hz).
fn fourth_power_gain(filter: &Prefilter) -> f64 {
    (0..5000).map(|k| filter.amplitude((f64::from(k) + 0.5) * 0.01).powi(4)).sum::<f64>() / 5000.0
}
