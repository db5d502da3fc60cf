//! Cuts of the cost surface along single parameters (the document's Figs. 3.3 and 4.5).

use crate::diagnostics::Diagnostic;
use crate::fit::LeastSquares;
use crate::identify::{Fitted, Problem, prefilters};
use crate::simulation::{Compiled, Record};
use crate::study::{Filter, Study};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Factor from the study's tolerance to the coarse one.
const COARSE: f64 = 1e4;
/// A study without filter is compared with a low-pass whose pass and stop edge are these shares of the sampling rate.
const LOW_BAND: (f64, f64) = (0.02, 0.04);

/// Costs along every parameter through the estimate, the others held.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Cuts {
    pub study: String,
    pub variant: String,
    pub parameters: Vec<Cut>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Cut {
    pub parameter: String,
    pub unit: String,
    /// The estimate.
    pub at: f64,
    /// Values of the parameter.
    pub values: Vec<f64>,
    pub curves: Vec<CutCurve>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct CutCurve {
    /// Relative tolerance of the integrator.
    pub tolerance: f64,
    /// What the prefilter passes, in words.
    pub band: String,
    /// Discrepancy in %, `null` where the simulation fails.
    pub discrepancy: Vec<f64>,
    /// Scatter about a smooth curve, from fifth differences, relative to the range of the curve: what the integrator's
    /// error leaves.
    pub roughness: f64,
}

/// Cuts with `points` values over the share `width` of the bounds around the estimate.
///
/// # Errors
/// A filter that cannot be designed for a record.
pub fn cuts(
    compiled: &Compiled,
    fitted: &Fitted,
    records: &[&Record],
    points: usize,
    width: f64,
) -> Result<Cuts, Diagnostic> {
    let tolerance = compiled.study.solver.relative_tolerance;
    let coarse = (COARSE * tolerance).min(1e-2);
    let mut settings: Vec<(Compiled, String)> = Vec::new();
    for (filter, band) in bands(&compiled.study, records) {
        for tolerance in [tolerance, coarse] {
            let mut own = compiled.clone();
            own.study.filter = filter;
            own.study.solver.relative_tolerance = tolerance;
            settings.push((own, band.clone()));
        }
    }
    let mut parameters = Vec::new();
    for (index, parameter) in compiled.study.parameters.iter().enumerate() {
        let (half, at) = (0.5 * width * parameter.scale(), fitted.theta[index]);
        let (low, high) = ((at - half).max(parameter.lower), (at + half).min(parameter.upper));
        let steps = (points.max(2) - 1) as f64;
        let values: Vec<f64> = (0..points.max(2)).map(|k| low + (high - low) * k as f64 / steps).collect();
        let mut curves = Vec::new();
        for (own, band) in &settings {
            let filters = prefilters(own, records)?;
            let weights = fitted.weighting.weights.clone();
            let problem = Problem::new(own, records.to_vec(), filters, weights);
            let mean: f64 = problem.mean_squares().iter().sum();
            let discrepancy: Vec<f64> = values
                .par_iter()
                .map(|value| {
                    let mut theta = fitted.theta.clone();
                    theta[index] = *value;
                    let residual = problem.clone().residual(&theta);
                    residual.map_or(f64::NAN, |r| 100.0 * r.iter().map(|v| v * v).sum::<f64>() / mean)
                })
                .collect();
            let roughness = roughness(&discrepancy);
            let tolerance = own.study.solver.relative_tolerance;
            curves.push(CutCurve { tolerance, band: band.clone(), discrepancy, roughness });
        }
        parameters.push(Cut {
            parameter: parameter.name.clone(),
            unit: parameter.unit.symbol.clone(),
            at: parameter.unit.from_si(at),
            values: values.iter().map(|value| parameter.unit.from_si(*value)).collect(),
            curves,
        });
    }
    Ok(Cuts { study: compiled.study.name.clone(), variant: compiled.study.variant.clone(), parameters })
}

/// The study's own band first, then one to compare it with.
fn bands(study: &Study, records: &[&Record]) -> Vec<(Option<Filter>, String)> {
    let words = |filter: &Filter| format!("up to {} Hz", crate::quantities::format_number(filter.pass, 3));
    match &study.filter {
        Some(filter) => vec![(Some(*filter), words(filter)), (None, "whole band".to_owned())],
        None => {
            let rate = records.iter().map(|record| 1.0 / record.sample_step()).fold(f64::INFINITY, f64::min);
            let low = Filter {
                pass: LOW_BAND.0 * rate,
                pass_drop: 2.0,
                stop: LOW_BAND.1 * rate,
                stop_attenuation: 20.0,
                single_pass_specification: false,
                span: crate::diagnostics::Span::default(),
            };
            vec![(None, "whole band".to_owned()), (Some(low), words(&low))]
        }
    }
}

/// Fifth differences are what scatter leaves of a smooth curve; their standard deviation is sqrt(252) times that of the
/// scatter.
fn roughness(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let range = finite.iter().fold(0.0_f64, |a, &b| a.max(b)) - finite.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    if finite.len() < 7 || range <= 0.0 {
        return 0.0;
    }
    let fifth = finite.windows(6).map(|w| w[5] - 5.0 * w[4] + 10.0 * w[3] - 10.0 * w[2] + 5.0 * w[1] - w[0]);
    let squares: f64 = fifth.map(|difference| difference * difference).sum();
    (squares / (finite.len() - 5) as f64 / 252.0).sqrt() / range
}
