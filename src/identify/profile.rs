//! Profile likelihood: the cost along a parameter while all others follow (Venzon-Moolgavkar-1988).

use super::confidence::Confidence;
use super::errors::frozen_filter;
use super::fitting::{Fitted, bounds, prefilters};
use super::problem::Problem;
use crate::diagnostics::{Code, Diagnostic};
use crate::fit::{Bounds, Control, LeastSquares, Options, WithPriors, levenberg_marquardt};
use crate::simulation::{Compiled, Record};
use crate::statistics::student_quantile;
use crate::study::ErrorDefinition;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Points to either side of the estimate, and their distance in standard deviations.
const POINTS: usize = 10;
const DISTANCE: f64 = 0.5;
/// Distance as a share of the bounds where the linearisation says that the parameter is not determined.
const OPEN_DISTANCE: f64 = 0.05;
/// Points go on until the deviance exceeds its limit by this factor.
const BEYOND: f64 = 1.3;
const ITERATIONS: usize = 30;

/// The profile of one parameter, in its unit.
#[derive(Clone, Debug, JsonSchema, PartialEq, Serialize)]
pub struct Profile {
    pub parameter: String,
    pub unit: String,
    pub values: Vec<f64>,
    /// Rise of the cost above its minimum with all other parameters fitted anew, in units of the noise's effect: the
    /// square of the distance in standard deviations where the model is linear.
    pub deviance: Vec<f64>,
    /// Deviance at the ends of the 95 % interval.
    pub limit: f64,
    /// Where the deviance crosses the limit; absent on a side on which it does not before the bound.
    pub lower: Option<f64>,
    pub upper: Option<f64>,
}

/// Profiles of the parameters with these indices, under the weights of the fit: its noise models, or the gains of its
/// state estimator.
///
/// # Errors
/// A filter that cannot be designed for a record; a parameter that cannot be moved at all; the equation error, which
/// has no likelihood.
pub fn profiles(
    compiled: &Compiled,
    fitted: &Fitted,
    confidence: &Confidence,
    records: &[&Record],
    indices: &[usize],
) -> Result<Vec<Profile>, Diagnostic> {
    let failed = |why: String| Diagnostic::error(Code::FIT_FAILED, format!("no profile of the parameters: {why}"));
    match fitted.error {
        _ if indices.is_empty() => Ok(Vec::new()),
        ErrorDefinition::Equation => {
            Err(failed("noise in the states biases the equation error by an unknown amount".to_owned())
                .help("profile the output error, from there: `--start equation` instead of `--error equation`"))
        }
        ErrorDefinition::Filter => {
            let problem = frozen_filter(compiled, records, fitted).map_err(failed)?;
            along_all(compiled, fitted, confidence, &problem, indices)
        }
        ErrorDefinition::Output | ErrorDefinition::Shooting => {
            let filters = prefilters(compiled, records)?;
            let mut problem = Problem::new(compiled, records.to_vec(), filters, fitted.weighting.weights.clone());
            problem.whitening.clone_from(&fitted.whitening);
            along_all(compiled, fitted, confidence, &problem, indices)
        }
    }
}

fn along_all<P: LeastSquares + Clone + Sync>(
    compiled: &Compiled,
    fitted: &Fitted,
    confidence: &Confidence,
    problem: &P,
    indices: &[usize],
) -> Result<Vec<Profile>, Diagnostic> {
    let outcomes: Vec<Result<Profile, Diagnostic>> =
        indices.par_iter().map(|&index| profile(compiled, fitted, confidence, problem, index)).collect();
    outcomes.into_iter().collect()
}

fn profile<P: LeastSquares + Clone>(
    compiled: &Compiled,
    fitted: &Fitted,
    confidence: &Confidence,
    problem: &P,
    index: usize,
) -> Result<Profile, Diagnostic> {
    let parameter = &compiled.study.parameters[index];
    let deviation = confidence.standard_deviation(index).filter(|deviation| *deviation > 0.0);
    let step = deviation.map_or(OPEN_DISTANCE * parameter.scale(), |deviation| DISTANCE * deviation);
    let limit = student_quantile(0.975, confidence.freedom_of(index)).powi(2);
    let unit = deviation.map_or(1.0, |deviation| deviation * deviation * curvature(fitted, index));
    let best = refit(compiled, fitted, problem, index, fitted.theta[index], &fitted.theta)?;
    let mut points = vec![(fitted.theta[index], 0.0)];
    let mut ends = [None, None];
    for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
        let mut theta = fitted.theta.clone();
        let mut last = (fitted.theta[index], 0.0_f64);
        for k in 1..=POINTS {
            let wanted = fitted.theta[index] + sign * step * k as f64;
            let value = wanted.clamp(parameter.lower, parameter.upper);
            if value == last.0 {
                break;
            }
            // A side on which the model breaks down ends there.
            let Ok((next, cost)) = refit(compiled, fitted, problem, index, value, &theta) else { break };
            let point = (value, ((cost - best.1) / unit).max(0.0));
            theta = next;
            points.push(point);
            if ends[side].is_none() && point.1 >= limit {
                // Between two points the root of the deviance is nearly linear.
                let share = (limit.sqrt() - last.1.sqrt()) / (point.1.sqrt() - last.1.sqrt());
                ends[side] = Some(last.0 + share * (point.0 - last.0));
            }
            last = point;
            if point.1 > BEYOND * limit {
                break;
            }
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let shown = |value: f64| parameter.unit.from_si(value);
    Ok(Profile {
        parameter: parameter.name.clone(),
        unit: parameter.unit.symbol.clone(),
        values: points.iter().map(|point| shown(point.0)).collect(),
        deviance: points.iter().map(|point| point.1).collect(),
        limit,
        lower: ends[0].map(shown),
        upper: ends[1].map(shown),
    })
}

/// Parameters and cost (priors included) with parameter `index` held at `value`.
fn refit<P: LeastSquares + Clone>(
    compiled: &Compiled,
    fitted: &Fitted,
    problem: &P,
    index: usize,
    value: f64,
    start: &[f64],
) -> Result<(Vec<f64>, f64), Diagnostic> {
    let Bounds { mut lower, mut upper } = bounds(&compiled.study);
    (lower[index], upper[index]) = (value, value);
    let mut start = start.to_vec();
    start[index] = value;
    let mut own = WithPriors { problem: problem.clone(), rows: &fitted.prior_rows };
    let options = Options { maximum_iterations: ITERATIONS, ..Options::default() };
    levenberg_marquardt(&mut own, &start, &Bounds::new(lower, upper), &options, &mut |_| Control::Continue)
        .map(|estimate| (estimate.theta, estimate.cost))
        .map_err(|error| Diagnostic::error(Code::FIT_FAILED, format!("no profile of the parameters: {error}")))
}

/// Rise of the cost per square of the parameter's distance with the others following, by linearisation: 1 / (Xi^-1)_jj.
fn curvature(fitted: &Fitted, index: usize) -> f64 {
    let rows = fitted.residual.len().max(1);
    let columns: Vec<Vec<f64>> = fitted
        .gradient
        .chunks_exact(rows)
        .enumerate()
        .map(|(j, column)| column.iter().copied().chain(fitted.prior_rows.iter().map(|row| row.slope(j))).collect())
        .collect();
    let others: Vec<f64> = (0..columns.len()).filter(|j| *j != index).flat_map(|j| columns[j].clone()).collect();
    let own = &columns[index];
    let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    if others.is_empty() {
        return square(own);
    }
    let basis = crate::linear::Basis::new(&others, own.len());
    let mut rest = own.clone();
    basis.project_out(&mut rest);
    square(&rest)
}
