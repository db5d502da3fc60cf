//! What the data tell about the parameters, and how sure it is.
//!
//! *In*: weighted residuals and gradients as plain column-major arrays. *Out*: singular values and directions that the
//! data do not determine, covariances and intervals, noise variances, criteria and p-values for comparisons.
//! *Must not happen here*: simulation, minimisation, files.

mod angles;
mod bootstrap;
mod combination;
mod comparison;
mod covariance;
mod identifiability;
mod matrix;
mod noise;
mod random;
mod significance;

pub use angles::principal_angles;
pub use bootstrap::{ErrorChange, block_length, error_change};
pub use combination::{Combined, Information, combine};
pub use comparison::{BlockComparison, aicc, bic, compare_blocks};
pub use covariance::{Covariance, confidence_interval, filtered_noise_gamma, stationary_noise_gamma};
pub use identifiability::{Identifiability, Undetermined, identifiability};
pub use noise::{NoiseChannel, noise_variance, noise_variances};
pub use random::{NormalStream, covariance_root};
pub use significance::{
    chi_square_p, f_test_p, likelihood_ratio_p, mixture_p, normal_probability, normal_quantile, student_quantile,
};
