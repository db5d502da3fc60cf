//! The fit of one compiled study to its estimation records.

use super::problem::{Block, Problem};
use super::weights::{Weighting, first_weights, residual_deviations};
use crate::diagnostics::{Code, Diagnostic};
use crate::fit::{
    Bounds, Control, Estimate, FitError, GaussianPrior, Options, Progress, StopReason, WithPriors, levenberg_marquardt,
};
use crate::signal::Prefilter;
use crate::simulation::{Compiled, Record};

/// How often weights are taken from the residual and the fit repeated (method 3.20, IV.6).
const REWEIGHTINGS: usize = 3;
/// Weights that change by less than this share need no further fit.
const WEIGHT_CHANGE: f64 = 0.05;

/// What a fit starts from, and how far it goes.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Start values (SI); the study's where absent.
    pub start: Option<Vec<f64>>,
    /// Weights per measure (1/SI); found by the fit where absent.
    pub weights: Option<Weighting>,
    pub maximum_iterations: Option<usize>,
}

/// A converged (or stopped) fit with what statistics need of it.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// SI, in the study's parameter order.
    pub theta: Vec<f64>,
    pub weighting: Weighting,
    /// Weighted, filtered residual and its gradient (N x p column-major), priors not included.
    pub residual: Vec<f64>,
    pub gradient: Vec<f64>,
    pub blocks: Vec<Block>,
    /// V_mean per block: the cost of the model "every channel is its mean" under the same weights and filters.
    pub mean_squares: Vec<f64>,
    pub cost_history: Vec<f64>,
    pub stop_reason: StopReason,
    pub at_bound: Vec<bool>,
    /// Prefilter and sampling rate (Hz) of each record of the fit.
    pub filters: Vec<Prefilter>,
    pub rates: Vec<f64>,
    pub iterations: usize,
    pub simulations: usize,
    pub failed_simulations: usize,
}

impl Fitted {
    /// Weighted sum of squares over the data (priors not included).
    pub fn cost(&self) -> f64 {
        self.residual.iter().map(|value| value * value).sum()
    }

    /// Discrepancy index over all records of the fit, %.
    pub fn discrepancy(&self) -> f64 {
        100.0 * self.cost() / self.mean_squares.iter().sum::<f64>()
    }
}

/// Prefilter of each record as the study asks for.
///
/// # Errors
/// The design is impossible at the record's sampling rate.
pub fn prefilters(compiled: &Compiled, records: &[&Record]) -> Result<Vec<Prefilter>, Diagnostic> {
    records.iter().map(|record| record.prefilter(&compiled.study)).collect()
}

/// Fits the study's parameters to `records`.
///
/// # Errors
/// The model cannot be simulated at the start values, or they lie outside their bounds.
pub fn fit(
    compiled: &Compiled,
    records: &[&Record],
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Fitted, Diagnostic> {
    let filters = prefilters(compiled, records)?;
    let mut weighting = match &settings.weights {
        Some(weighting) => weighting.clone(),
        None => first_weights(&compiled.study, records, &filters),
    };
    let rounds = if settings.weights.is_some() { 0 } else { REWEIGHTINGS };
    let gains: Vec<f64> = filters.iter().map(Prefilter::noise_gain).collect();
    let mut start = settings.start.clone().unwrap_or_else(|| start_values(compiled));
    let mut problem = Problem::new(compiled, records.to_vec(), filters, weighting.weights.clone());
    let mut iterations = 0;
    let mut history = Vec::new();
    for round in 0..=rounds {
        problem.weights.clone_from(&weighting.weights);
        let estimate = minimise(compiled, &mut problem, &start, settings, observer)?;
        iterations += estimate.iterations;
        if round == 0 {
            history.clone_from(&estimate.cost_history);
        }
        start.clone_from(&estimate.theta);
        let blocks = problem.blocks();
        let residual = &estimate.residual[..problem.residual_count()];
        let next = residual_deviations(&weighting, &compiled.study, residual, &blocks, &gains, estimate.theta.len());
        let settled = next.largest_change(&weighting) < WEIGHT_CHANGE;
        if round == rounds || settled || estimate.stop_reason == StopReason::Interrupted {
            return Ok(finish(estimate, weighting, &problem, history, iterations));
        }
        weighting = next;
    }
    Err(Diagnostic::error(Code::FIT_FAILED, "the fit ended without a result"))
}

fn start_values(compiled: &Compiled) -> Vec<f64> {
    compiled.study.parameters.iter().map(|parameter| parameter.start).collect()
}

/// One Levenberg-Marquardt run with the study's bounds and priors.
fn minimise(
    compiled: &Compiled,
    problem: &mut Problem,
    start: &[f64],
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Estimate, Diagnostic> {
    let parameters = &compiled.study.parameters;
    let bounds = Bounds::new(
        parameters.iter().map(|parameter| parameter.lower).collect(),
        parameters.iter().map(|parameter| parameter.upper).collect(),
    );
    let priors: Vec<GaussianPrior> = parameters
        .iter()
        .enumerate()
        .filter_map(|(parameter, p)| {
            let prior = p.prior?;
            Some(GaussianPrior { parameter, mean: prior.mean, standard_deviation: prior.standard_deviation })
        })
        .collect();
    let mut options = Options::default();
    if let Some(limit) = settings.maximum_iterations {
        options.maximum_iterations = limit;
    }
    let start: Vec<f64> = start
        .iter()
        .zip(&bounds.lower)
        .zip(&bounds.upper)
        .map(|((value, low), high)| value.clamp(*low, *high))
        .collect();
    let mut with_priors = WithPriors { problem, priors: &priors };
    levenberg_marquardt(&mut with_priors, &start, &bounds, &options, observer)
        .map_err(|error| start_failure(compiled, &error))
}

fn start_failure(compiled: &Compiled, error: &FitError) -> Diagnostic {
    let diagnostic = Diagnostic::error(Code::FIT_FAILED, error.to_string());
    match error {
        FitError::StartOutsideBounds { index } | FitError::InvalidBounds { index } => {
            let parameter = &compiled.study.parameters[*index];
            diagnostic.label(parameter.span, format!("`{}` must start inside its bounds", parameter.name))
        }
        _ => diagnostic.help("try start values nearer to the real ones, or a simulation alone: `ident simulate`"),
    }
}

fn finish(
    mut estimate: Estimate,
    weighting: Weighting,
    problem: &Problem,
    history: Vec<f64>,
    iterations: usize,
) -> Fitted {
    let (rows, all_rows) = (problem.residual_count(), estimate.residual.len());
    let gradient = estimate.gradient.chunks_exact(all_rows).flat_map(|column| &column[..rows]).copied().collect();
    estimate.residual.truncate(rows);
    let at_bound = estimate.bound_states.iter().map(|state| *state != crate::fit::BoundState::Interior).collect();
    Fitted {
        theta: estimate.theta,
        weighting,
        residual: estimate.residual,
        gradient,
        blocks: problem.blocks(),
        mean_squares: problem.mean_squares(),
        cost_history: history,
        stop_reason: estimate.stop_reason,
        at_bound,
        filters: problem.prefilters.clone(),
        rates: problem.records.iter().map(|record| 1.0 / record.sample_step()).collect(),
        iterations,
        simulations: problem.simulations,
        failed_simulations: problem.failures,
    }
}
