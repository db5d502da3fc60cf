//! The cost over the iterations of a search, its gradient by internal differentiation or by finite differences (the
//! document's Fig. 3.10).

use crate::diagnostics::Diagnostic;
use crate::fit::{Bounds, Control, EvaluationFailure, LeastSquares, Options, levenberg_marquardt};
use crate::identify::{Fitted, Problem, Settings, fit, prefilters};
use crate::simulation::{Compiled, Record};
use schemars::JsonSchema;
use serde::Serialize;

/// Iterations after which a search that still creeps is ended.
const ITERATIONS: usize = 20;

/// Searches with both gradients at several tolerances of the integrator, from the study's start, all under the same
/// weights.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Descents {
    pub study: String,
    pub variant: String,
    pub parameters: Vec<String>,
    pub descents: Vec<Descent>,
}

/// One search.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Descent {
    /// `internal differentiation` or `finite differences`.
    pub gradient: String,
    /// Relative tolerance of the integrator.
    pub tolerance: f64,
    /// Cost at the start and after every iteration.
    pub costs: Vec<f64>,
    /// Simulations of all records; an internal derivative by one parameter counts as one.
    pub simulations: usize,
    /// The search ended at a minimum as far as it could tell.
    pub converged: bool,
    /// Why it ended.
    pub reason: String,
}

/// Searches from the study's start at each of the `tolerances`.
///
/// # Errors
/// The study cannot be fitted at all.
pub fn descents(compiled: &Compiled, records: &[&Record], tolerances: &[f64]) -> Result<Descents, Diagnostic> {
    let fitted = fit(compiled, records, &Settings::default(), &mut |_| Control::Continue)?;
    let study = &compiled.study;
    let mut found = Vec::new();
    for &tolerance in tolerances {
        let mut own = compiled.clone();
        own.study.solver.relative_tolerance = tolerance;
        for internal in [true, false] {
            found.push(descent(&own, records, &fitted, internal)?);
        }
    }
    Ok(Descents {
        study: study.name.clone(),
        variant: study.variant.clone(),
        parameters: study.parameters.iter().map(|parameter| parameter.name.clone()).collect(),
        descents: found,
    })
}

fn descent(compiled: &Compiled, records: &[&Record], fitted: &Fitted, internal: bool) -> Result<Descent, Diagnostic> {
    let parameters = &compiled.study.parameters;
    let column = |value: fn(&crate::study::Parameter) -> f64| parameters.iter().map(value).collect::<Vec<f64>>();
    let (start, bounds) = (column(|p| p.start), Bounds::new(column(|p| p.lower), column(|p| p.upper)));
    let filters = prefilters(compiled, records)?;
    let problem = Problem::new(compiled, records.to_vec(), filters, fitted.weighting.weights.clone());
    let tolerance = compiled.study.solver.relative_tolerance;
    let scales = parameters.iter().map(|parameter| parameter.scale()).collect();
    let mut watched =
        Watched { problem, differences: (!internal).then_some(tolerance), scales, upper: column(|p| p.upper) };
    let options = Options { maximum_iterations: ITERATIONS, ..Options::default() };
    let mut costs = Vec::new();
    let outcome = levenberg_marquardt(&mut watched, &start, &bounds, &options, &mut |progress| {
        costs.push(progress.cost);
        Control::Continue
    });
    let records = watched.problem.records.len().max(1);
    let mut simulations = watched.problem.simulations / records;
    let gradient = if internal { "internal differentiation" } else { "finite differences" }.to_owned();
    let (converged, reason) = match outcome {
        Ok(estimate) => {
            costs = estimate.cost_history;
            if internal {
                simulations += estimate.gradient_evaluations * start.len();
            }
            (estimate.stop_reason.converged(), estimate.stop_reason.to_string())
        }
        Err(error) => (false, error.to_string()),
    };
    Ok(Descent { gradient, tolerance, costs, simulations, converged, reason })
}

/// A problem that may be differentiated by differences instead.
struct Watched<'a> {
    problem: Problem<'a>,
    /// Relative accuracy of the residual where its gradient is taken by forward differences.
    differences: Option<f64>,
    scales: Vec<f64>,
    upper: Vec<f64>,
}

impl LeastSquares for Watched<'_> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        self.problem.residual(theta)
    }

    /// Forward differences over the root of the accuracy, where truncation and noise are of one size
    /// (Gill-Murray-Wright-1981, 8.6).
    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let Some(accuracy) = self.differences else { return self.problem.residual_and_gradient(theta) };
        let residual = self.problem.residual(theta)?;
        let mut gradient = Vec::with_capacity(residual.len() * theta.len());
        for j in 0..theta.len() {
            let distance = accuracy.sqrt() * self.scales[j];
            let step = if theta[j] + distance > self.upper[j] { -distance } else { distance };
            let mut moved = theta.to_vec();
            moved[j] += step;
            let other = self.problem.residual(&moved)?;
            gradient.extend(other.iter().zip(&residual).map(|(other, own)| (other - own) / step));
        }
        Ok((residual, gradient))
    }
}
