//! Measured data: files, interpolation, filters, spectra.
//!
//! *In*: CSV files ([`read_table`]), filter specifications. *Out*: columns in SI with their sampling, interpolants of
//! sampled inputs, linear prefilters, spectra and tests of residuals. *Must not happen here*: simulation, knowledge of
//! studies beyond names and units; missing samples are never made up.

mod filter;
mod interpolation;
mod records;
mod spectrum;

pub use filter::{Butterworth, FilterError, LowPass, Passes, Prefilter, Section};
pub use interpolation::Interpolant;
pub use records::{Column, DataError, Sampling, Table, read_table};
pub use spectrum::{
    AutoRegression, PowerSpectrum, autocorrelation, autocovariance, band_shares, cross_correlation, effective_count,
    ljung_box, periodogram, welch,
};
