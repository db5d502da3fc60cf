//! A manoeuvre as a record without measurements.

use super::inputs::{Channel, Formula, RecordInputs};
use super::prepare::Record;
use crate::signal::Sampling;
use crate::study::{Role, Study};
use std::path::PathBuf;

/// What [`super::simulate`] needs to run manoeuvre `index`: its channels are the study's criteria of this manoeuvre, in
/// order; there are no measured samples.
pub fn manoeuvre(study: &Study, index: usize) -> Record {
    let criteria = study.criteria.iter().enumerate().filter(|(_, criterion)| criterion.manoeuvre == index);
    let outputs = criteria.map(|(criterion, _)| study.measures.len() + criterion).collect();
    record(study, index, study.manoeuvres[index].step, outputs)
}

/// Manoeuvre `index` as a test to come: its channels are all measures, sampled every `step` seconds.
pub fn excitation(study: &Study, index: usize, step: f64) -> Record {
    record(study, index, step, (0..study.measures.len()).collect())
}

fn record(study: &Study, index: usize, step: f64, outputs: Vec<usize>) -> Record {
    let manoeuvre = &study.manoeuvres[index];
    let formulas: Vec<Formula> =
        manoeuvre.inputs.iter().map(|&input| Formula::new(&study.graph, input, study.time)).collect();
    let mut breakpoints: Vec<f64> =
        formulas.iter().flat_map(|formula| formula.breakpoints(0.0, manoeuvre.duration)).collect();
    breakpoints.sort_by(f64::total_cmp);
    breakpoints.dedup();
    // The last instant is the end, even where the step does not divide the duration.
    let count = (manoeuvre.duration / step * (1.0 - 1e-12)).ceil().max(1.0) as usize;
    let step = manoeuvre.duration / count as f64;
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
        measures: outputs,
        measured: Vec::new(),
        sampling: Sampling { start: 0.0, step, count: count + 1, jitter: 0.0 },
    }
}
