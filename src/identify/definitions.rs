//! Fits by the other definitions of the error.

use super::errors::{Joined, equation_error, filter_error, shooting};
use super::fitting::{Fitted, Settings, bounds, finish, prefilters, prior_rows, search_once, start_values};
use super::problem::Problem;
use super::weights::{Weighting, first_weights, residual_deviations};
use crate::diagnostics::{Code, Diagnostic};
use crate::fit::{BoundState, Control, Estimate, LeastSquares, Optimiser, Progress, StopReason};
use crate::signal::Prefilter;
use crate::simulation::{Compiled, Record, stretches_refused};
use crate::study::ErrorDefinition;

/// Stretches per record unless the user says otherwise.
const STRETCHES: usize = 12;

/// `instead`: what answers the question that this definition of the error was asked for.
fn refused(what: &str, why: &str, instead: &str) -> Diagnostic {
    Diagnostic::error(Code::FIT_FAILED, format!("{what} does not fit this study: {why}")).help(instead)
}

/// Process noise colours the residual of a free simulation.
const WITHOUT_FILTER: &str =
    "use the output error and weight by the colour that process noise gives it (`--error output --noise coloured`)";
/// Against minima of a cost that a record's length makes.
const WITHOUT_SHOOTING: &str =
    "use the output error from several starts, the low frequencies first (`--error output --starts 10 --bands 3`)";

/// What is asked for beside a definition of the error must have an effect.
pub(super) fn refuse_unused(settings: &Settings) -> Result<(), Diagnostic> {
    let steps = settings.error == ErrorDefinition::Equation;
    let what = match settings.error {
        ErrorDefinition::Output | ErrorDefinition::Shooting => return Ok(()),
        ErrorDefinition::Equation => "the equation error",
        ErrorDefinition::Filter => "the filter error",
    };
    let wishes = [
        (settings.coloured_noise, "`noise = coloured`", "colour of its residual is no noise of the measurements"),
        (settings.bands > 0, "a band widened in steps", "it has no prefilter"),
        (settings.further_starts > 0, "further starts", "it follows the measured states, not a start"),
        (
            steps && !settings.knowledge.is_empty(),
            "results of other fits",
            "its own has no covariance to weigh them with",
        ),
        (
            steps && settings.chosen.optimiser != Optimiser::LevenbergMarquardt,
            "another optimiser",
            "it is solved in steps",
        ),
    ];
    match wishes.into_iter().find(|(asked, ..)| *asked) {
        None => Ok(()),
        Some((_, wish, why)) => {
            let message = format!("{what} has no use for {wish}: {why}");
            Err(Diagnostic::error(Code::FIT_FAILED, message)
                .help("leave that out, or use the output error (`--error output`)"))
        }
    }
}

/// One linear step (or a few), and the output error there for weights and discrepancy.
pub(super) fn equation(compiled: &Compiled, records: &[&Record], settings: &Settings) -> Result<Fitted, Diagnostic> {
    let start = settings.start.clone().unwrap_or_else(|| start_values(compiled));
    let found = equation_error(compiled, records, &start)?;
    let filters = prefilters(compiled, records)?;
    let gains: Vec<f64> = filters.iter().map(Prefilter::noise_gain).collect();
    let mut weighting = first_weights(&compiled.study, records, &filters);
    let mut problem = Problem::new(compiled, records.to_vec(), filters, weighting.weights.clone());
    let failed = |failure: crate::fit::EvaluationFailure| {
        Diagnostic::error(Code::FIT_FAILED, format!("the model cannot be simulated there: {failure}"))
    };
    let residual = problem.residual(&found.theta).map_err(failed)?;
    weighting =
        residual_deviations(&weighting, &compiled.study, &residual, &problem.blocks(), &gains, found.theta.len());
    problem.weights.clone_from(&weighting.weights);
    let (residual, gradient) = problem.residual_and_gradient(&found.theta).map_err(failed)?;
    let limits = bounds(&compiled.study);
    let state = |j: usize| match found.theta[j] {
        value if value <= limits.lower[j] => BoundState::AtLower,
        value if value >= limits.upper[j] => BoundState::AtUpper,
        _ => BoundState::Interior,
    };
    let cost = residual.iter().map(|value| value * value).sum();
    let estimate = Estimate {
        bound_states: (0..found.theta.len()).map(state).collect(),
        theta: found.theta.clone(),
        cost,
        residual,
        gradient,
        cost_history: vec![cost],
        stop_reason: StopReason::StepConverged,
        iterations: found.steps,
        residual_evaluations: 1,
        gradient_evaluations: 1,
        failed_evaluations: 0,
        last_failure: None,
    };
    let mut fitted = finish(estimate, weighting, &problem, vec![cost], found.steps);
    (fitted.error, fitted.equation) = (ErrorDefinition::Equation, Some(found));
    fitted.prior_rows = prior_rows(&compiled.study);
    Ok(fitted)
}

/// Innovations of an extended Kalman filter.
pub(super) fn filter(
    compiled: &Compiled,
    records: &[&Record],
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Fitted, Diagnostic> {
    const WHAT: &str = "the filter error";
    if let Some(why) = stretches_refused(compiled) {
        return Err(refused(WHAT, why, WITHOUT_FILTER));
    }
    if compiled.study.filter.is_some() || compiled.study.remove_mean {
        let why = "its weights hold for innovations that are white, and a prefilter or a removed mean colours them";
        let instead = "leave `filter` out: the estimator follows what the model does not explain, slow or fast; or use `--error output`";
        return Err(refused(WHAT, why, instead));
    }
    let start = settings.start.clone().unwrap_or_else(|| start_values(compiled));
    let mut rows = prior_rows(&compiled.study);
    rows.extend(settings.knowledge.iter().cloned());
    let mut history = Vec::new();
    let (estimate, noise, simulations, failures) = filter_error(
        compiled,
        records,
        &start,
        &mut |problem, start| search_once(compiled, problem, start, settings, &rows, observer),
        &|why| refused(WHAT, &why, WITHOUT_FILTER),
    )?;
    history.clone_from(&estimate.cost_history);
    let measures = &compiled.study.measures;
    let compared = |measure: usize| records.iter().any(|record| record.measures.contains(&measure));
    let weighting = Weighting {
        weights: (0..measures.len())
            .map(|m| if compared(m) { measures[m].weight / noise.measured[m] } else { 0.0 })
            .collect(),
        sources: vec!["innovations of the filter"; measures.len()],
    };
    let filters = prefilters(compiled, records)?;
    let mut problem = Problem::new(compiled, records.to_vec(), filters, weighting.weights.clone());
    (problem.simulations, problem.failures) = (simulations, failures);
    let iterations = estimate.iterations;
    let mut fitted = finish(estimate, weighting, &problem, history, iterations);
    fitted.error = ErrorDefinition::Filter;
    let levels = (0..measures.len()).map(|m| compared(m).then_some(noise.measured[m])).collect();
    (fitted.prior_rows, fitted.noise_levels) = (rows, Some(levels));
    let variables = compiled.model.variables().iter().zip(&noise.process);
    fitted.process_noise =
        variables.filter(|(_, level)| **level > 0.0).map(|(variable, level)| (variable.name.clone(), *level)).collect();
    Ok(fitted)
}

/// Where multiple shooting hands over to the output error.
pub(super) fn shooting_start(
    compiled: &Compiled,
    records: &[&Record],
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Joined, Diagnostic> {
    const WHAT: &str = "multiple shooting";
    if let Some(why) = stretches_refused(compiled) {
        return Err(refused(WHAT, why, WITHOUT_SHOOTING));
    }
    let start = settings.start.clone().unwrap_or_else(|| start_values(compiled));
    let filters = prefilters(compiled, records)?;
    let weighting = first_weights(&compiled.study, records, &filters);
    let problem = Problem::new(compiled, records.to_vec(), filters, weighting.weights);
    let count = if settings.stretches == 0 { STRETCHES } else { settings.stretches };
    shooting(&problem, &bounds(&compiled.study), &start, count, observer)
        .map_err(|why| refused(WHAT, &why, WITHOUT_SHOOTING))
}
