//! Records: measured data of an experiment bound to the study's inputs and measures.

use super::inputs::{Channel, RecordInputs};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::signal::{Butterworth, Interpolant, LowPass, Passes, Prefilter, Sampling, Table, read_table};
use crate::study::{Experiment, Interpolation, Role, Study};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A record must hold at least this many compared samples to be worth a fit.
const MINIMUM_SAMPLES: usize = 20;

/// One experiment's data, ready to simulate and compare. All values SI.
#[derive(Clone, Debug)]
pub struct Record {
    /// Index into the study's experiments; beyond them, into its manoeuvres.
    pub experiment: usize,
    pub name: String,
    pub role: Role,
    /// Of the data; empty for a manoeuvre.
    pub file: PathBuf,
    pub inputs: RecordInputs,
    /// Times at which an input jumps or kinks; the integrator restarts there.
    pub breakpoints: Vec<f64>,
    /// Sample times from the start of the simulation to the last compared sample.
    pub times: Vec<f64>,
    /// Index of the first compared sample in `times`.
    pub first: usize,
    /// Indices of the study's measures compared here (of its outputs in general).
    pub measures: Vec<usize>,
    /// Per compared measure: its samples from `times[first]` on.
    pub measured: Vec<Vec<f64>>,
    pub(super) sampling: Sampling,
}

impl Record {
    /// As messages name it: `experiment sweep`, `manoeuvre kerb`.
    pub fn title(&self) -> String {
        let kind = if self.file.as_os_str().is_empty() { "manoeuvre" } else { "experiment" };
        format!("{kind} {}", self.name)
    }

    /// Number of compared samples per channel.
    pub fn sample_count(&self) -> usize {
        self.times.len() - self.first
    }

    /// Times of the compared samples.
    pub fn compared_times(&self) -> &[f64] {
        &self.times[self.first..]
    }

    /// Where the simulation starts.
    pub fn start_time(&self) -> f64 {
        self.times[0]
    }

    /// Sampling interval, s.
    pub fn sample_step(&self) -> f64 {
        self.sampling.step
    }

    /// The same record with only part of its compared samples (simulated from the same start).
    pub fn part(&self, samples: Range<usize>, label: &str) -> Record {
        let mut part = self.clone();
        part.name = format!("{} ({label})", self.name);
        part.first = self.first + samples.start;
        part.times.truncate(self.first + samples.end);
        part.measured = self.measured.iter().map(|channel| channel[samples.clone()].to_vec()).collect();
        part
    }

    /// The study's prefilter designed for this record's sampling rate; the identity where the study asks for none.
    ///
    /// # Errors
    /// The edges do not fit the sampling rate.
    pub fn prefilter(&self, study: &Study) -> Result<Prefilter, Diagnostic> {
        let Some(filter) = &study.filter else {
            return Ok(Prefilter::new(None, study.remove_mean));
        };
        let specification = LowPass {
            pass: filter.pass,
            pass_drop: filter.pass_drop,
            stop: filter.stop,
            stop_attenuation: filter.stop_attenuation,
            passes: if filter.single_pass_specification { Passes::One } else { Passes::Both },
        };
        let design = Butterworth::design(&specification, self.sampling.rate()).map_err(|error| {
            Diagnostic::error(Code::FILTER_IMPOSSIBLE, format!("no such filter for experiment {}: {error}", self.name))
                .label(filter.span, format!("the record is sampled at {} Hz", self.sampling.rate()))
                .help("choose edges below half the sampling rate with more distance between them")
        })?;
        Ok(Prefilter::new(Some(design), study.remove_mean))
    }
}

/// Reads all records of a study. Data files are looked for in `directory`. `measures` restricts the comparison to these
/// channels (empty: as the study says).
///
/// All experiments are read, so that all findings come in one go; the records are complete only if no finding is an
/// error.
pub fn prepare(study: &Study, directory: &Path, measures: &[String]) -> (Vec<Record>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let wanted = wanted_measures(study, measures, &mut diagnostics);
    let mut records = Vec::new();
    for (index, experiment) in study.experiments.iter().enumerate() {
        match record(study, index, experiment, directory, wanted.as_deref()) {
            Ok(record) => records.push(record),
            Err(findings) => diagnostics.extend(findings),
        }
    }
    if !study.experiments.iter().any(|experiment| experiment.role == Role::Estimation) {
        diagnostics.push(
            Diagnostic::error(Code::NO_ESTIMATION_RECORD, "the study has no estimation experiment")
                .help("declare `experiment NAME estimation { data = \"file.csv\", start = equilibrium }`"),
        );
    }
    (records, diagnostics)
}

fn wanted_measures(study: &Study, names: &[String], diagnostics: &mut Vec<Diagnostic>) -> Option<Vec<usize>> {
    if names.is_empty() {
        return None;
    }
    let mut wanted = Vec::new();
    for name in names {
        match study.measures.iter().position(|measure| measure.name == *name) {
            Some(index) => wanted.push(index),
            None => diagnostics.push(
                Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no measure `{name}`"))
                    .suggest(similar_name(name, study.measures.iter().map(|measure| measure.name.as_str()))),
            ),
        }
    }
    wanted.sort_unstable();
    wanted.dedup();
    Some(wanted)
}

fn record(
    study: &Study,
    index: usize,
    experiment: &Experiment,
    directory: &Path,
    wanted: Option<&[usize]>,
) -> Result<Record, Vec<Diagnostic>> {
    let path = directory.join(&experiment.data);
    let place = Some(experiment.data_span);
    let one = |error: crate::signal::DataError| vec![error.diagnostic(place)];
    let table = read_table(&path).map_err(one)?;
    let sampling = table.sampling(&experiment.time_column).map_err(one)?;
    let rows = table.window(&sampling, experiment.window, MINIMUM_SAMPLES).map_err(one)?;
    let measures: Vec<usize> = match wanted {
        Some(wanted) => wanted.to_vec(),
        None => experiment.measures.clone(),
    };
    let mut findings = Vec::new();
    let inputs = inputs(study, experiment, &table, &sampling, &mut findings);
    let measured = measured(study, experiment, &table, &measures, &rows, &mut findings);
    if !findings.is_empty() {
        return Err(findings);
    }
    let times: Vec<f64> = (0..rows.end).map(|row| sampling.time(row)).collect();
    let (begin, end) = (sampling.start, sampling.time(rows.end.saturating_sub(1)));
    let mut breakpoints: Vec<f64> =
        inputs.iter().flat_map(|interpolant: &Interpolant| interpolant.breakpoints(begin, end)).collect();
    breakpoints.sort_by(f64::total_cmp);
    breakpoints.dedup();
    Ok(Record {
        experiment: index,
        name: experiment.name.clone(),
        role: experiment.role,
        file: path,
        inputs: RecordInputs { channels: inputs.into_iter().map(Channel::Sampled).collect(), experiment: index },
        breakpoints,
        times,
        first: rows.start,
        measures,
        measured,
        sampling,
    })
}

fn column<'a>(experiment: &'a Experiment, name: &'a str) -> &'a str {
    experiment.columns.iter().find(|(element, _)| element == name).map_or(name, |(_, column)| column)
}

fn inputs(
    study: &Study,
    experiment: &Experiment,
    table: &Table,
    sampling: &Sampling,
    findings: &mut Vec<Diagnostic>,
) -> Vec<Interpolant> {
    let mut interpolants = Vec::new();
    for (index, input) in study.inputs.iter().enumerate() {
        if let Some((_, value)) = experiment.constant_inputs.iter().find(|(constant, _)| *constant == index) {
            interpolants.push(Interpolant::new(sampling.start, sampling.step, &[*value], Interpolation::Hold));
            continue;
        }
        match table.values(column(experiment, &input.name), &input.unit) {
            Ok(values) => {
                interpolants.push(Interpolant::new(sampling.start, sampling.step, &values, input.interpolation));
            }
            Err(error) => findings.push(
                error
                    .of_element(&input.name)
                    .diagnostic(Some(experiment.data_span))
                    .secondary(input.span, format!("input `{}` is declared here", input.name)),
            ),
        }
    }
    interpolants
}

fn measured(
    study: &Study,
    experiment: &Experiment,
    table: &Table,
    measures: &[usize],
    rows: &Range<usize>,
    findings: &mut Vec<Diagnostic>,
) -> Vec<Vec<f64>> {
    let mut channels = Vec::new();
    for &index in measures {
        let measure = &study.measures[index];
        let name = column(experiment, &measure.name);
        let values = table
            .values(name, &measure.unit)
            .and_then(|values| table.require_variation(name, rows.clone()).map(|()| values[rows.clone()].to_vec()));
        match values {
            Ok(values) => channels.push(values),
            Err(error) => findings.push(
                error
                    .of_element(&measure.name)
                    .diagnostic(Some(experiment.data_span))
                    .secondary(measure.span, format!("measure `{}` is declared here", measure.name)),
            ),
        }
    }
    channels
}
