//! What an identification found. Values of parameters and channels are in the unit the study wrote; times in s.

use super::errors::ErrorReport;
use super::profile::Profile;
use schemars::JsonSchema;
use serde::Serialize;

/// One variant of a study fitted to its estimation records, and evaluated on all of them.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Identification {
    pub variant: String,
    pub parameters: Vec<ParameterEstimate>,
    /// Correlation matrix of the estimates, row-major, in parameter order; NaN-free (0 where undetermined).
    pub correlation: Vec<Vec<f64>>,
    /// Covariance matrix of the estimates in their units, row-major, in parameter order; finite part only.
    pub covariance: Vec<Vec<f64>>,
    /// Degrees of freedom of the noise estimate behind the intervals.
    pub freedom: f64,
    /// Profile likelihoods that were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profiles: Vec<Profile>,
    /// Singular values of the weighted gradient scaled by the parameter bounds, descending.
    pub singular_values: Vec<f64>,
    /// Directions the data do not determine, in words.
    pub undetermined: Vec<String>,
    pub records: Vec<RecordFit>,
    /// Total discrepancy index over the estimation records, %.
    pub estimation_discrepancy: f64,
    /// Total discrepancy index over the validation records, %; absent when there are none.
    pub validation_discrepancy: Option<f64>,
    /// Weighted sum of squares at the optimum (estimation records).
    pub cost: f64,
    /// Cost after each accepted iteration, from the start.
    pub cost_history: Vec<f64>,
    pub residual_count: usize,
    /// Residual count divided by the variance inflation of its autocorrelation.
    pub effective_count: f64,
    /// Bayesian information criterion with unknown variance and effective count.
    pub bic: f64,
    pub iterations: usize,
    pub simulations: usize,
    pub failed_simulations: usize,
    pub stop_reason: String,
    /// Digits to which the gradient agrees with an independent one in random directions; absent when not asked for.
    pub gradient_digits: Option<f64>,
    /// How the structure stands against the first one; only where several are compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub structure: Option<Structure>,
    /// What counted as error between model and measurement, and why.
    pub error: ErrorReport,
    /// Anything a reader must know: parameters at bounds, missing influence, fallbacks.
    pub remarks: Vec<String>,
}

/// A structure against the first one. Both count their residuals alike, so that criteria can be subtracted.
#[derive(Clone, Debug, JsonSchema, PartialEq, Serialize)]
pub struct Structure {
    /// Corrected Akaike criterion with unknown variance per channel; only differences mean something.
    pub aicc: f64,
    /// Bayesian criterion with unknown variance per channel; only differences mean something.
    pub bic: f64,
    /// Twice the logarithm of the likelihood ratio to the first structure.
    pub likelihood_ratio: Option<f64>,
    /// Its p-value; only for a structure that contains the first one.
    pub likelihood_ratio_p: Option<f64>,
    /// Vuong's test statistic, positive where this structure is better; only where neither contains the other.
    pub vuong_z: Option<f64>,
    pub vuong_p: Option<f64>,
    /// Relative change of the held-out error (root mean square) with its 95 % interval: [change, low, high].
    pub held_out_change: Option<(f64, f64, f64)>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct ParameterEstimate {
    pub name: String,
    pub unit: String,
    pub lower: f64,
    pub upper: f64,
    pub start: f64,
    pub value: f64,
    /// Infinite variance is `None`.
    pub standard_deviation: Option<f64>,
    /// 95 % interval.
    pub interval: Option<(f64, f64)>,
    pub at_bound: bool,
    /// Identifiability measure of method 4.15, relative to the largest (0..1).
    pub identifiability: f64,
}

/// One record with the model's answer to it.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct RecordFit {
    pub experiment: String,
    /// `estimation`, `validation` or `test`.
    pub role: String,
    pub file: String,
    pub time: Vec<f64>,
    pub channels: Vec<ChannelFit>,
    /// Discrepancy down the tree of groups.
    pub discrepancy: DiscrepancyNode,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct ChannelFit {
    pub name: String,
    pub title: String,
    pub unit: String,
    pub measured: Vec<f64>,
    pub simulated: Vec<f64>,
    /// V / V_mean * 100 %, filtered as in the cost.
    pub discrepancy: f64,
    /// 100 * |measured - simulated| / |measured|, unfiltered, mean kept.
    pub relative_error: f64,
    /// Root mean square of measured - simulated, in the channel's unit, unfiltered.
    pub residual_rms: f64,
    /// Weight (1/SI standard deviation) the cost used for this channel, and where it comes from.
    pub noise: f64,
    pub noise_source: String,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct DiscrepancyNode {
    pub name: String,
    /// %
    pub discrepancy: f64,
    pub children: Vec<DiscrepancyNode>,
}
