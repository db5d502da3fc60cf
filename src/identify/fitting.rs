//! The fit of one compiled study to its estimation records.

use super::bands::bands;
use super::confidence::RANK_THRESHOLD;
use super::constraints::StudyConstraints;
use super::definitions::{equation, filter, refuse_unused, shooting_start};
use super::errors::EquationFit;
use super::knowledge::straightened;
use super::noise::inflation;
use super::problem::{Block, Problem};
use super::weights::{Weighting, first_weights, residual_deviations};
use super::whitening::whitened;
use crate::diagnostics::{Code, Diagnostic};
use crate::fit::{
    Bounds, Chosen, Control, Estimate, FitError, LeastSquares, Options, PriorRow, Progress, Region, StopReason,
    WithPriors, parallel_starts,
};
use crate::signal::{AutoRegression, Prefilter};
use crate::simulation::{Compiled, Record};
use crate::study::{ErrorDefinition, Parameter, Study};
use rayon::prelude::*;

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
    /// Weights to begin with where none are given, in place of the channels' magnitudes: a start that is good under
    /// these may be left for another minimum under those.
    pub first_weights: Option<Weighting>,
    pub maximum_iterations: Option<usize>,
    /// Further searches from points all over the bounds, the best of all counts; and their seed.
    pub further_starts: usize,
    pub seed: u64,
    /// What searches the minimum.
    pub chosen: Chosen,
    /// What independent results know about the parameters.
    pub knowledge: Vec<PriorRow>,
    /// What counts as error.
    pub error: ErrorDefinition,
    /// Stretches per record of [`ErrorDefinition::Shooting`]; a number is found where it is 0.
    pub stretches: usize,
    /// Coloured noise is modelled and the cost weighted by it.
    pub coloured_noise: bool,
    /// Steps in which the band of the prefilter is widened to that of the study (method 3).
    pub bands: usize,
}

impl Settings {
    /// What is left of the allowed iterations.
    fn after(&self, iterations: usize) -> Self {
        let maximum_iterations = self.maximum_iterations.map(|limit| limit.saturating_sub(iterations));
        Self { maximum_iterations, ..self.clone() }
    }

    fn exhausted(&self) -> bool {
        self.maximum_iterations == Some(0)
    }
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
    /// Prior knowledge that the fit used: priors of the study, independent results.
    pub prior_rows: Vec<PriorRow>,
    /// Cost at the end of each search where there were several, best first.
    pub start_costs: Vec<f64>,
    pub iterations: usize,
    pub simulations: usize,
    pub failed_simulations: usize,
    pub error: ErrorDefinition,
    /// Of [`ErrorDefinition::Equation`].
    pub equation: Option<EquationFit>,
    /// Largest gap between stretches, relative to a state's course, before the output error took over.
    pub gap: Option<f64>,
    /// Process noise that the filter error found: (state, root of the spectral density of its rate, SI).
    pub process_noise: Vec<(String, f64)>,
    /// Noise levels per measure (SI) where the fit found them itself: filter error, pre-whitening.
    pub noise_levels: Option<Vec<Option<f64>>>,
    /// Noise model by which each block was weighted; empty where none was.
    pub whitening: Vec<Option<AutoRegression>>,
    /// Bands that were fitted before the study's own: (stop edge in Hz, discrepancy in %).
    pub bands: Vec<(f64, f64)>,
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
/// The model cannot be simulated at the start values, or they lie outside their bounds; the definition of the error
/// does not fit the study, or has no use for what is asked for beside it.
pub fn fit(
    compiled: &Compiled,
    records: &[&Record],
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Fitted, Diagnostic> {
    refuse_unused(settings)?;
    match settings.error {
        ErrorDefinition::Output => output(compiled, records, settings, observer),
        ErrorDefinition::Equation => equation(compiled, records, settings),
        ErrorDefinition::Filter => filter(compiled, records, settings, observer),
        ErrorDefinition::Shooting => {
            let joined = shooting_start(compiled, records, settings, observer)?;
            let settings = Settings { start: Some(joined.theta), ..settings.clone() };
            let mut fitted = output(compiled, records, &settings, observer)?;
            (fitted.error, fitted.gap) = (ErrorDefinition::Shooting, Some(joined.gap));
            fitted.simulations += joined.simulations;
            fitted.failed_simulations += joined.failures;
            Ok(fitted)
        }
    }
}

/// Output error: free simulations.
fn output(
    compiled: &Compiled,
    records: &[&Record],
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Fitted, Diagnostic> {
    let filters = prefilters(compiled, records)?;
    let mut weighting = match &settings.weights {
        Some(weighting) => weighting.clone(),
        None => settings
            .first_weights
            .as_ref()
            .map_or_else(|| first_weights(&compiled.study, records, &filters), Weighting::as_first),
    };
    let rounds = if settings.weights.is_some() { 0 } else { REWEIGHTINGS };
    let gains: Vec<f64> = filters.iter().map(Prefilter::noise_gain).collect();
    let mut start = settings.start.clone().unwrap_or_else(|| start_values(compiled));
    let before = bands(compiled, records, settings, &mut start, observer)?;
    let mut problem = Problem::new(compiled, records.to_vec(), filters, weighting.weights.clone());
    let mut rows = prior_rows(&compiled.study);
    if !settings.knowledge.is_empty() {
        // The data alone first: where they leave a direction open, another result's linearisation must not close it.
        problem.weights.clone_from(&weighting.weights);
        let (alone, _) = minimise(compiled, &mut problem, &start, settings, &rows, 0, observer)?;
        let (count, all) = (problem.residual_count(), alone.residual.len());
        let gradient: Vec<f64> =
            alone.gradient.chunks_exact(all).flat_map(|column| &column[..count]).copied().collect();
        let scales: Vec<f64> = compiled.study.parameters.iter().map(Parameter::scale).collect();
        rows.extend(straightened(&settings.knowledge, &alone.theta, &gradient, &scales));
        start.clone_from(&alone.theta);
    }
    let mut start_costs = Vec::new();
    let mut iterations = 0;
    let mut history = Vec::new();
    for round in 0..=rounds {
        problem.weights.clone_from(&weighting.weights);
        let settings = &settings.after(iterations);
        let searches = if round == 0 { settings.further_starts } else { 0 };
        let estimate = minimise(compiled, &mut problem, &start, settings, &rows, searches, observer)?;
        if round == 0 {
            start_costs = estimate.1;
        }
        let estimate = estimate.0;
        iterations += estimate.iterations;
        if round == 0 {
            history.clone_from(&estimate.cost_history);
        }
        start.clone_from(&estimate.theta);
        let blocks = problem.blocks();
        let residual = &estimate.residual[..problem.residual_count()];
        let next = residual_deviations(&weighting, &compiled.study, residual, &blocks, &gains, estimate.theta.len());
        let settled = next.largest_change(&weighting) < WEIGHT_CHANGE;
        // Prior knowledge counts beside the data as it should although coloured noise makes the data's cost too large.
        let factor = match rows.first() {
            Some(_) if rounds > 0 => {
                let here = finish(estimate.clone(), weighting.clone(), &problem, Vec::new(), iterations);
                inflation(compiled, &here, RANK_THRESHOLD)
            }
            _ => 1.0,
        };
        let settled = settled && rows.first().is_none_or(|row| (factor / row.variance).ln().abs() < WEIGHT_CHANGE);
        let ended = estimate.stop_reason == StopReason::Interrupted || settings.after(estimate.iterations).exhausted();
        if round == rounds || settled || ended {
            let mut fitted = finish(estimate, weighting, &problem, history, iterations);
            (fitted.prior_rows, fitted.start_costs, fitted.bands) = (rows, start_costs, before);
            if settings.coloured_noise && !ended {
                return whitened(compiled, problem, fitted, settings, observer);
            }
            return Ok(fitted);
        }
        rows = rows.iter().map(|row| row.with_variance(factor)).collect();
        weighting = next;
    }
    Err(Diagnostic::error(Code::FIT_FAILED, "the fit ended without a result"))
}

pub(super) fn start_values(compiled: &Compiled) -> Vec<f64> {
    compiled.study.parameters.iter().map(|parameter| parameter.start).collect()
}

/// Priors of the study.
pub(super) fn prior_rows(study: &Study) -> Vec<PriorRow> {
    let parameters = study.parameters.iter().enumerate();
    let own = parameters
        .filter_map(|(index, p)| p.prior.map(|prior| PriorRow::gaussian(index, prior.mean, prior.standard_deviation)));
    own.collect()
}

/// Levenberg-Marquardt with the study's bounds, constraints and prior knowledge; the best of all searches, and the
/// costs of all.
fn minimise(
    compiled: &Compiled,
    problem: &mut Problem,
    start: &[f64],
    settings: &Settings,
    rows: &[PriorRow],
    further_starts: usize,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<(Estimate, Vec<f64>), Diagnostic> {
    let bounds = bounds(&compiled.study);
    let constraints = StudyConstraints::new(&compiled.study);
    let options = options(settings);
    let region = Region { constraints: &constraints, bounds: &bounds, options: &options };
    let start = inside(&bounds, start);
    let mut own = WithPriors { problem: &mut *problem, rows };
    let first = crate::fit::minimise(settings.chosen, &mut own, &start, &region, observer);
    if further_starts == 0 {
        return Ok((first.map_err(|error| start_failure(compiled, &error))?, Vec::new()));
    }
    let points = parallel_starts(&start, &bounds, further_starts, settings.seed);
    let searches: Vec<(Problem, Result<Estimate, FitError>)> = points[1..]
        .par_iter()
        .map(|point| {
            let mut own = WithPriors { problem: Problem { simulations: 0, failures: 0, ..problem.clone() }, rows };
            let quiet = &mut |_: &Progress| Control::Continue;
            let found = crate::fit::minimise(settings.chosen, &mut own, point, &region, quiet);
            (own.problem, found)
        })
        .collect();
    problem.simulations += searches.iter().map(|(own, _)| own.simulations).sum::<usize>();
    problem.failures += searches.iter().map(|(own, _)| own.failures).sum::<usize>();
    let mut found: Vec<Estimate> = Vec::new();
    let mut failure = None;
    for outcome in std::iter::once(first).chain(searches.into_iter().map(|(_, outcome)| outcome)) {
        match outcome {
            Ok(estimate) => found.push(estimate),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    // Stable: of equal costs the earlier start's comes first.
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let costs = found.iter().map(|estimate| estimate.cost).collect();
    match (found.into_iter().next(), failure) {
        (Some(best), _) => Ok((best, costs)),
        (None, Some(error)) => Err(start_failure(compiled, &error)),
        (None, None) => Err(Diagnostic::error(Code::FIT_FAILED, "no search had a start")),
    }
}

/// One search over any residual of the study's parameters.
pub(super) fn search_once<P: LeastSquares>(
    compiled: &Compiled,
    problem: &mut P,
    start: &[f64],
    settings: &Settings,
    rows: &[PriorRow],
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Estimate, Diagnostic> {
    let bounds = bounds(&compiled.study);
    let constraints = StudyConstraints::new(&compiled.study);
    let mut own = WithPriors { problem, rows };
    let start = inside(&bounds, start);
    let region = Region { constraints: &constraints, bounds: &bounds, options: &options(settings) };
    crate::fit::minimise(settings.chosen, &mut own, &start, &region, observer)
        .map_err(|error| start_failure(compiled, &error))
}

fn options(settings: &Settings) -> Options {
    let default = Options::default();
    let maximum_iterations = settings.maximum_iterations.unwrap_or(default.maximum_iterations);
    Options { maximum_iterations, ..default }
}

fn inside(bounds: &Bounds, start: &[f64]) -> Vec<f64> {
    start.iter().zip(&bounds.lower).zip(&bounds.upper).map(|((value, low), high)| value.clamp(*low, *high)).collect()
}

pub(super) fn bounds(study: &Study) -> Bounds {
    Bounds::new(
        study.parameters.iter().map(|parameter| parameter.lower).collect(),
        study.parameters.iter().map(|parameter| parameter.upper).collect(),
    )
}

pub(super) fn start_failure(compiled: &Compiled, error: &FitError) -> Diagnostic {
    let diagnostic = Diagnostic::error(Code::FIT_FAILED, error.to_string());
    match error {
        FitError::StartOutsideBounds { index } | FitError::InvalidBounds { index } => {
            let parameter = &compiled.study.parameters[*index];
            diagnostic.label(parameter.span, format!("`{}` must start inside its bounds", parameter.name))
        }
        _ => diagnostic.help("try start values nearer to the real ones, or a simulation alone: `ident simulate`"),
    }
}

pub(super) fn finish(
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
        prior_rows: Vec::new(),
        start_costs: Vec::new(),
        rates: problem.records.iter().map(|record| 1.0 / record.sample_step()).collect(),
        iterations,
        simulations: problem.simulations,
        failed_simulations: problem.failures,
        error: ErrorDefinition::Output,
        equation: None,
        gap: None,
        process_noise: Vec::new(),
        noise_levels: None,
        whitening: Vec::new(),
        bands: Vec::new(),
    }
}
