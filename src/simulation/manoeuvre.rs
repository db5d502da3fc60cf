//! A manoeuvre as a record without measurements.

use super::inputs::{Channel, Formula, RecordInputs};
use super::prepare::Record;
use crate::signal::Sampling;
use crate::study::{Role, Study};
use std::path::PathBuf;

/// What [`super::simulate`] needs to run manoeuvre `index`: its channels are the study's criteria of this manoeuvre, in
/// order; there are no measured samples.
pub fn manoeuvre(study: &Study, index: usize) -> Record {
    let manoeuvre = &study.manoeuvres[index];
    let formulas: Vec<Formula> =
        manoeuvre.inputs.iter().map(|&input| Formula::new(&study.graph, input, study.time)).collect();
    let mut breakpoints: Vec<f64> =
        formulas.iter().flat_map(|formula| formula.breakpoints(0.0, manoeuvre.duration)).collect();
    breakpoints.sort_by(f64::total_cmp);
    breakpoints.dedup();
    // The last instant is the end, even where the step does not divide the duration.
    let count = (manoeuvre.duration / manoeuvre.step * (1.0 + 1e-12)).ceil().max(1.0) as usize;
    let step = manoeuvre.duration / count as f64;
    let criteria = study.criteria.iter().enumerate().filter(|(_, criterion)| criterion.manoeuvre == index);
    let experiment = study.experiments.len() + index;
    let channels = formulas.into_iter().map(Channel::Formula).collect();
    Record {
        experiment,
        name: manoeuvre.name.clone(),
        role: Role::Test,
        file: PathBuf::new(),
        inputs: RecordInputs { channels, experiment },
        breakpoints,
        times: (0..=count).map(|k| k as f64 * step).collect(),
        first: 0,
        measures: criteria.map(|(criterion, _)| study.measures.len() + criterion).collect(),
        measured: Vec::new(),
        sampling: Sampling { start: 0.0, step, count: count + 1, jitter: 0.0 },
    }
}
