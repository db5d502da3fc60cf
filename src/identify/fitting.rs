//! The fit of one compiled study to its estimation records.

use super::knowledge::straightened;
use super::problem::{Block, Problem};
use super::weights::{Weighting, first_weights, residual_deviations};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node, Symbol};
use crate::fit::{
    Bounds, Constraints, Control, Estimate, FitError, Options, PriorRow, Progress, StopReason, WithPriors, constrained,
    parallel_starts,
};
use crate::signal::Prefilter;
use crate::simulation::{Compiled, Record};
use crate::study::{Parameter, Study};
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
    pub maximum_iterations: Option<usize>,
    /// Further searches from points all over the bounds, the best of all counts; and their seed.
    pub further_starts: usize,
    pub seed: u64,
    /// What independent results know about the parameters.
    pub knowledge: Vec<PriorRow>,
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
        if round == rounds || settled || estimate.stop_reason == StopReason::Interrupted {
            let mut fitted = finish(estimate, weighting, &problem, history, iterations);
            (fitted.prior_rows, fitted.start_costs) = (rows, start_costs);
            return Ok(fitted);
        }
        weighting = next;
    }
    Err(Diagnostic::error(Code::FIT_FAILED, "the fit ended without a result"))
}

fn start_values(compiled: &Compiled) -> Vec<f64> {
    compiled.study.parameters.iter().map(|parameter| parameter.start).collect()
}

/// Priors of the study.
fn prior_rows(study: &Study) -> Vec<PriorRow> {
    let parameters = study.parameters.iter().enumerate();
    let own = parameters
        .filter_map(|(index, p)| p.prior.map(|prior| PriorRow::gaussian(index, prior.mean, prior.standard_deviation)));
    own.collect()
}

/// The study's constraints as functions of the parameters.
struct StudyConstraints {
    graph: Graph,
    symbols: Vec<Symbol>,
    values: Vec<Node>,
    /// Per constraint, by each parameter.
    gradients: Vec<Vec<Node>>,
}

impl StudyConstraints {
    fn new(study: &Study) -> Self {
        let written: Vec<Node> = study.constraints.iter().map(|constraint| constraint.value).collect();
        let (mut graph, values) = study.graph.extract(&written);
        let symbols: Vec<Symbol> = study.parameters.iter().map(|parameter| parameter.symbol).collect();
        let by_parameter: Vec<Vec<Node>> = symbols.iter().map(|&symbol| graph.differentiate(&values, symbol)).collect();
        let gradients =
            (0..values.len()).map(|k| by_parameter.iter().map(|derivatives| derivatives[k]).collect()).collect();
        Self { graph, symbols, values, gradients }
    }
}

impl Constraints for StudyConstraints {
    fn evaluate(&self, theta: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let value_of = |symbol: Symbol| {
            self.symbols.iter().position(|other| *other == symbol).map_or(f64::NAN, |index| theta[index])
        };
        let at = |nodes: &[Node]| self.graph.evaluate(nodes, value_of, |_, _, _| f64::NAN);
        (at(&self.values), self.gradients.iter().map(|gradient| at(gradient)).collect())
    }
}

/// Share of its change over the bounds within which a constraint counts as active.
const ACTIVE: f64 = 1e-5;

/// Texts of the study's constraints that hold with equality at `theta`.
pub fn active_constraints<'a>(study: &'a Study, theta: &[f64]) -> Vec<&'a str> {
    let (values, gradients) = StudyConstraints::new(study).evaluate(theta);
    let change = |gradient: &[f64]| {
        gradient.iter().zip(&study.parameters).map(|(slope, p)| (slope * p.scale()).powi(2)).sum::<f64>().sqrt()
    };
    let active = |k: usize| values[k] >= -ACTIVE * change(&gradients[k]);
    study.constraints.iter().enumerate().filter(|(k, _)| active(*k)).map(|(_, c)| c.text.as_str()).collect()
}

/// Levenberg-Marquardt with the study's bounds, constraints and prior knowledge; the best of all searches, and the costs of all.
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
    let mut own = WithPriors { problem: &mut *problem, rows };
    let first = constrained(&mut own, &constraints, &start, &bounds, &options, observer);
    if further_starts == 0 {
        return Ok((first.map_err(|error| start_failure(compiled, &error))?, Vec::new()));
    }
    let points = parallel_starts(&start, &bounds, further_starts, settings.seed);
    let searches: Vec<(Problem, Result<Estimate, FitError>)> = points[1..]
        .par_iter()
        .map(|point| {
            let mut own = WithPriors { problem: Problem { simulations: 0, failures: 0, ..problem.clone() }, rows };
            let found = constrained(&mut own, &constraints, point, &bounds, &options, &mut |_| Control::Continue);
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

fn bounds(study: &Study) -> Bounds {
    Bounds::new(
        study.parameters.iter().map(|parameter| parameter.lower).collect(),
        study.parameters.iter().map(|parameter| parameter.upper).collect(),
    )
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
        prior_rows: Vec::new(),
        start_costs: Vec::new(),
        rates: problem.records.iter().map(|record| 1.0 / record.sample_step()).collect(),
        iterations,
        simulations: problem.simulations,
        failed_simulations: problem.failures,
    }
}
