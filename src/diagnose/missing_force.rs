//! The picture an engineer wants: the force the model lacks at a place, as a history and over the place's motion.
//!
//! A free force of time (piecewise linear between knots) is put on the place; its knot values follow from the residual
//! by regularised least squares on the sensitivities. The model's other parameters stand at the extended model's
//! values, so that what the base fit had absorbed shows up as well.

use super::MissingForce;
use crate::expression::{Graph, Node, Symbol};
use crate::fit::LeastSquares;
use crate::identify::{Problem, Weighting, prefilters};
use crate::linear::smooth_least_squares;
use crate::quantities::Unit;
use crate::signal::effective_count;
use crate::simulation::{Compiled, Record, probe};
use crate::study::{Force, ForcePlace, Measure, Parameter, Place, PlaceKind, PlaceQuantity, Study};

/// Knots of the free force.
const KNOTS: usize = 120;
/// Samples per knot at least: a knot between two samples is not determined.
const SAMPLES_PER_KNOT: usize = 5;
/// Places shown at most, those first that explain most.
const PLACES: usize = 3;

/// The extended model (or the base where nothing was accepted) and which of its parameters are strengths of accepted
/// effects, with the value at which the effect vanishes.
pub(super) struct Source<'a> {
    pub compiled: &'a Compiled,
    pub theta: &'a [f64],
    pub weighting: &'a Weighting,
    pub strengths: &'a [(String, f64)],
}

/// Pictures for the joints and force elements of the study, best-explaining first.
pub(super) fn missing_forces(source: &Source, records: &[&Record]) -> Vec<MissingForce> {
    let Some(record) = records.first() else {
        return Vec::new();
    };
    let mut pictures: Vec<MissingForce> = source
        .compiled
        .study
        .places
        .iter()
        .filter(|place| matches!(place.kind, PlaceKind::Joint | PlaceKind::Force))
        .filter_map(|place| missing_force(source, record, place))
        .collect();
    pictures.sort_by(|a, b| b.share.total_cmp(&a.share));
    pictures.truncate(PLACES);
    pictures
}

fn missing_force(source: &Source, record: &Record, place: &Place) -> Option<MissingForce> {
    let study = &source.compiled.study;
    let knots = knots(record);
    let without: Vec<f64> = study
        .parameters
        .iter()
        .zip(source.theta)
        .map(|(parameter, &value)| neutral(source, &parameter.name).unwrap_or(value))
        .collect();
    let (free, names) = with_free_force(study, place, &knots)?;
    let fixed: Vec<(String, f64)> =
        study.parameters.iter().map(|parameter| parameter.name.clone()).zip(without.iter().copied()).collect();
    let compiled = Compiled::frozen(free, &fixed).ok()?;
    let filters = prefilters(&compiled, &[record]).ok()?;
    let mut problem = Problem::new(&compiled, vec![record], filters, source.weighting.weights.clone());
    let (residual, gradient) = problem.residual_and_gradient(&vec![0.0; names]).ok()?;
    let sensitivity: Vec<f64> = gradient.iter().map(|value| -value).collect();
    let independent: f64 = problem.blocks().iter().map(|block| effective_count(&residual[block.rows.clone()])).sum();
    // Model error is not noise: its own colour must not forbid resolving it.
    let independent = independent.max(2.0 * names as f64);
    let (force, share) = smooth_least_squares(&sensitivity, residual.len(), &residual, independent)?;
    picture(source, record, place, &knots, force, share)
}

fn neutral(source: &Source, name: &str) -> Option<f64> {
    source.strengths.iter().find(|(strength, _)| strength == name).map(|(_, neutral)| *neutral)
}

fn knots(record: &Record) -> Vec<f64> {
    let times = record.compared_times();
    let count = KNOTS.min(times.len() / SAMPLES_PER_KNOT).max(2);
    let (begin, end) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(1.0));
    (0..count).map(|k| begin + (end - begin) * k as f64 / (count - 1) as f64).collect()
}

/// The study with a piecewise linear force of time at `place`; also the number of its parameters.
fn with_free_force(study: &Study, place: &Place, knots: &[f64]) -> Option<(Study, usize)> {
    let mut free = study.clone();
    let force_place = force_place(study, place)?;
    let time = study.time;
    let spacing = knots[1] - knots[0];
    let mut load = free.graph.constant(0.0);
    for (k, &knot) in knots.iter().enumerate() {
        let name = format!("missing force {k}");
        let symbol = free.graph.symbol(&name);
        let hat = hat(&mut free.graph, time, knot, spacing);
        let value = free.graph.variable(symbol);
        let term = free.graph.multiply(value, hat);
        load = free.graph.add(load, term);
        let unit = Unit::coherent(place.dimension);
        let (lower, upper) = (f64::NEG_INFINITY, f64::INFINITY);
        free.parameters.push(Parameter {
            name,
            symbol,
            unit,
            lower,
            upper,
            start: 0.0,
            prior: None,
            span: Default::default(),
        });
    }
    let coordinate = free.graph.symbol("missing force coordinate");
    let rate = free.graph.symbol("missing force rate");
    free.forces.push(Force {
        name: "missing force".to_owned(),
        law: "free force of time".to_owned(),
        is_actuator: false,
        place: force_place,
        load,
        coordinate,
        rate,
        span: Default::default(),
    });
    Some((free, knots.len()))
}

fn force_place(study: &Study, place: &Place) -> Option<ForcePlace> {
    match place.kind {
        PlaceKind::Joint => {
            let axes = study.joints.iter().enumerate();
            axes.flat_map(|(joint, declared)| {
                declared.axes.iter().enumerate().map(move |(axis, entry)| (joint, axis, entry))
            })
            .find(|(.., entry)| entry.name == place.name)
            .map(|(joint, axis, _)| ForcePlace::Joint { joint, axis })
        }
        _ => study.forces.iter().find(|force| force.name == place.name).map(|force| force.place),
    }
}

/// `max(0, 1 - |t - knot| / spacing)`
fn hat(graph: &mut Graph, time: Symbol, knot: f64, spacing: f64) -> Node {
    use crate::expression::{Binary, Unary};
    let t = graph.variable(time);
    let knot = graph.constant(knot);
    let difference = graph.subtract(t, knot);
    let distance = graph.unary(Unary::Abs, difference);
    let spacing = graph.constant(spacing);
    let relative = graph.divide(distance, spacing);
    let one = graph.constant(1.0);
    let height = graph.subtract(one, relative);
    let zero = graph.constant(0.0);
    graph.binary(Binary::Maximum, zero, height)
}

fn picture(
    source: &Source,
    record: &Record,
    place: &Place,
    knots: &[f64],
    force: Vec<f64>,
    share: f64,
) -> Option<MissingForce> {
    let along = probe(source.compiled, record, source.theta).ok()?;
    let study = &source.compiled.study;
    let first: usize =
        study.places.iter().take_while(|p| p.name != place.name || p.kind != place.kind).map(|p| p.probes.len()).sum();
    let history = |quantity: PlaceQuantity| {
        place.probes.iter().position(|probe| probe.0 == quantity).map(|offset| &along.probes[first + offset])
    };
    let at_knots = |values: &[f64]| -> Vec<f64> { knots.iter().map(|&t| values[nearest(record, t)]).collect() };
    let (coordinate, rate) = (history(PlaceQuantity::Coordinate)?, history(PlaceQuantity::Rate)?);
    let coordinate_unit = Unit::coherent(place.quantity_dimension(PlaceQuantity::Coordinate));
    let rate_unit = Unit::coherent(place.quantity_dimension(PlaceQuantity::Rate));
    let explained = explained(source, record, place).map(|values| at_knots(&values)).unwrap_or_default();
    Some(MissingForce {
        place: place.name.clone(),
        unit: Unit::coherent(place.quantity_dimension(PlaceQuantity::Load)).symbol,
        coordinate: at_knots(coordinate),
        coordinate_unit: coordinate_unit.symbol,
        rate: at_knots(rate),
        rate_unit: rate_unit.symbol,
        time: knots.to_vec(),
        force,
        explained,
        share,
    })
}

fn nearest(record: &Record, time: f64) -> usize {
    let times = record.compared_times();
    times.partition_point(|&t| t < time).min(times.len() - 1)
}

/// The accepted effects' own force at `place` along the extended model's motion: its loads minus the same loads with
/// all strengths at their neutral values.
fn explained(source: &Source, record: &Record, place: &Place) -> Option<Vec<f64>> {
    let mut study = source.compiled.study.clone();
    let wanted = force_place(&study, place)?;
    let replacements = study
        .parameters
        .iter()
        .filter_map(|parameter| Some((parameter.symbol, neutral(source, &parameter.name)?)))
        .collect::<Vec<_>>();
    if replacements.is_empty() {
        return None;
    }
    let replacements = replacements.into_iter().map(|(symbol, value)| (symbol, study.graph.constant(value))).collect();
    let mut sum = study.graph.constant(0.0);
    for force in study.forces.iter().filter(|force| same_place(force, place, &wanted)) {
        let without = study.graph.substitute(&[force.load], &replacements)[0];
        let difference = study.graph.subtract(force.load, without);
        sum = study.graph.add(sum, difference);
    }
    if study.graph.is_zero(sum) {
        return None;
    }
    study.measures = vec![Measure {
        name: "explained".to_owned(),
        title: String::new(),
        unit: Unit::coherent(place.dimension),
        value: sum,
        noise: None,
        weight: 1.0,
        delay: None,
        quantisation: None,
        span: Default::default(),
    }];
    let compiled = Compiled::new(study).ok()?;
    let mut bare = (*record).clone();
    bare.measures = vec![0];
    bare.measured = vec![vec![0.0; record.sample_count()]];
    let trajectory =
        crate::simulation::simulate(&compiled, &bare, source.theta, crate::simulation::Gradient::None).ok()?;
    trajectory.channels.into_iter().next()
}

/// Effects at a joint are force elements on that joint; effects at an element change that element's load.
fn same_place(force: &Force, place: &Place, wanted: &ForcePlace) -> bool {
    match (place.kind, &force.place, wanted) {
        (PlaceKind::Joint, ForcePlace::Joint { joint: a, axis: at_a }, ForcePlace::Joint { joint: b, axis: at_b }) => {
            (a, at_a) == (b, at_b)
        }
        _ => force.name == place.name,
    }
}
