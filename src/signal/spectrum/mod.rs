//! Spectra, correlation and autoregressive models of residuals.

mod autoregression;
mod correlation;
mod power;

pub use autoregression::AutoRegression;
pub use correlation::{autocorrelation, autocovariance, cross_correlation, effective_count, ljung_box};
pub use power::{PowerSpectrum, band_shares, periodogram, welch};
