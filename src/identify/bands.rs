//! Stepwise widening of the filter's band (method 3): the low band first, whose cost is smooth and has few minima.

use super::fitting::{Settings, prior_rows, search_once};
use super::problem::Problem;
use super::weights::first_weights;
use crate::diagnostics::Diagnostic;
use crate::fit::{Control, Progress, StopReason};
use crate::signal::Prefilter;
use crate::simulation::{Compiled, Record};
use crate::study::{Filter, Study};

/// Each band is this much wider than the one before.
const WIDENING: f64 = 2.0;
/// A study without filter ends with this share of the sampling rate as the last pass edge, before the whole band.
const WIDEST: f64 = 0.1;
/// Stop over pass edge, drop and attenuation (dB) of bands for a study without filter.
const EDGES: f64 = 2.0;
const DROP: f64 = 2.0;
const ATTENUATION: f64 = 20.0;

/// Fits the narrower bands one after the other and leaves the last one's parameters in `start`.
///
/// # Errors
/// The model cannot be simulated at the start.
pub(super) fn bands(
    compiled: &Compiled,
    records: &[&Record],
    settings: &Settings,
    start: &mut Vec<f64>,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Vec<(f64, f64)>, Diagnostic> {
    let mut found = Vec::new();
    for step in (1..=settings.bands).rev() {
        let mut study = compiled.study.clone();
        let Some(filter) = narrowed(&study, records, WIDENING.powi(step as i32)) else { continue };
        study.filter = Some(filter);
        let filters: Result<Vec<Prefilter>, Diagnostic> =
            records.iter().map(|record| record.prefilter(&study)).collect();
        let filters = filters?;
        let weighting = first_weights(&study, records, &filters);
        let mut problem = Problem::new(compiled, records.to_vec(), filters, weighting.weights);
        let rows = prior_rows(&compiled.study);
        let estimate = search_once(compiled, &mut problem, start, settings, &rows, observer)?;
        let mean: f64 = problem.mean_squares().iter().sum();
        let cost: f64 = estimate.residual[..problem.residual_count()].iter().map(|value| value * value).sum();
        found.push((filter.stop, 100.0 * cost / mean));
        start.clone_from(&estimate.theta);
        if estimate.stop_reason == StopReason::Interrupted {
            break;
        }
    }
    Ok(found)
}

/// The study's filter, or one below the widest band, with its edges divided by `factor`.
fn narrowed(study: &Study, records: &[&Record], factor: f64) -> Option<Filter> {
    let rate = records.iter().map(|record| 1.0 / record.sample_step()).fold(f64::INFINITY, f64::min);
    let widest = study.filter.or_else(|| {
        let span = study.experiments.first()?.span;
        let pass = WIDENING * WIDEST * rate;
        Some(Filter {
            pass,
            pass_drop: DROP,
            stop: EDGES * pass,
            stop_attenuation: ATTENUATION,
            single_pass_specification: false,
            span,
        })
    })?;
    Some(Filter { pass: widest.pass / factor, stop: widest.stop / factor, ..widest })
}
