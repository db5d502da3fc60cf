//! The parameter table with intervals drawn between the bounds.

use crate::identify::ParameterEstimate;
use crate::report::chart::{Whisker, whisker};
use crate::report::page::histories::Curve;
use crate::report::{number, words};
use serde::Serialize;

#[derive(Serialize)]
pub struct ParameterRow {
    pub name: String,
    pub unit: String,
    pub start: String,
    /// One cell per fit.
    pub cells: Vec<EstimateCell>,
    pub lower: String,
    pub upper: String,
    pub whisker_svg: String,
    pub flags: Vec<String>,
}

#[derive(Serialize)]
pub struct EstimateCell {
    pub value: String,
    pub interval: String,
    /// Class that carries the fit's colour.
    pub class: &'static str,
}

const WIDTH: f64 = 260.0;

/// One row per parameter of any fit, in the order in which they first occur.
pub fn rows(curves: &[Curve]) -> Vec<ParameterRow> {
    let mut known: Vec<&ParameterEstimate> = Vec::new();
    for parameter in curves.iter().flat_map(|curve| &curve.fit.parameters) {
        if !known.iter().any(|other| other.name == parameter.name) {
            known.push(parameter);
        }
    }
    known.into_iter().map(|parameter| row(curves, parameter)).collect()
}

fn row(curves: &[Curve], parameter: &ParameterEstimate) -> ParameterRow {
    let found: Vec<Option<&ParameterEstimate>> =
        curves.iter().map(|curve| curve.fit.parameters.iter().find(|other| other.name == parameter.name)).collect();
    let whiskers: Vec<Whisker> = found
        .iter()
        .zip(curves)
        .filter_map(|(found, curve)| found.map(|found| (found, curve)))
        .map(|(found, curve)| Whisker { value: found.value, interval: found.interval, style: curve.style })
        .collect();
    let cell = |(found, curve): (&Option<&ParameterEstimate>, &Curve)| match found {
        Some(found) => EstimateCell {
            value: number::with_deviation(found.value, found.standard_deviation),
            interval: number::interval_text(found.interval),
            class: curve.style.class(),
        },
        None => EstimateCell { value: "-".into(), interval: String::new(), class: "" },
    };
    ParameterRow {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        start: number::short(parameter.start, 4),
        cells: found.iter().zip(curves).map(cell).collect(),
        lower: number::short(parameter.lower, 4),
        upper: number::short(parameter.upper, 4),
        whisker_svg: whisker(&whiskers, parameter.lower, parameter.upper, Some(parameter.start), WIDTH),
        flags: flags(&found, curves),
    }
}

fn flags(found: &[Option<&ParameterEstimate>], curves: &[Curve]) -> Vec<String> {
    let mut flags = Vec::new();
    let several = curves.len() > 1;
    for (parameter, curve) in found.iter().zip(curves).filter_map(|(found, curve)| found.map(|found| (found, curve))) {
        let place = if several { format!(" ({})", curve.fit.variant) } else { String::new() };
        if parameter.at_bound {
            flags.push(format!("at its bound{place}"));
        }
        if parameter.interval.is_none() {
            flags.push(format!("not determined{place}"));
        }
    }
    flags
}

/// Correlated pairs and undetermined directions of the last fit, in words.
pub fn notes(curves: &[Curve]) -> Vec<String> {
    let Some(last) = curves.last() else { return Vec::new() };
    let pair = |(first, second, correlation): (&str, &str, f64)| {
        format!("{first} and {second} move together: correlation {}", number::fixed(correlation, 2))
    };
    let correlated = words::strong_correlations(last.fit).into_iter().map(pair);
    let undetermined = last.fit.undetermined.iter().map(|direction| format!("Not determined by the data: {direction}"));
    correlated.chain(undetermined).collect()
}
