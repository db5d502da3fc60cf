//! `ident simulate STUDY`: its experiments and manoeuvres.

use super::output::{json, show, write_whole};
use super::session::Session;
use super::{Failed, Format, StudyArguments};
use crate::diagnostics::{Code, Diagnostic};
use crate::simulation::{Compiled, Record, Trajectory, cautions_about, manoeuvre, probe, slowness};
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Parameter values instead of the study's start values, e.g. `--set "mu=0.1"` (in the study's unit)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    values: Vec<String>,
    /// Folder for one CSV file per experiment and manoeuvre (default: standard output)
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Show what limited the steps, in which share of them and when; channels are written only with `--output`
    #[arg(long)]
    why_slow: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let compiled = session.compile(&study.variant)?;
    let theta = parameters(&compiled, &arguments.values)?;
    let mut records =
        if compiled.study.experiments.is_empty() { Vec::new() } else { session.records(&compiled.study, study)? };
    records.extend((0..compiled.study.manoeuvres.len()).map(|index| {
        let mut record = manoeuvre(&compiled.study, index);
        record.measures = (0..compiled.study.measures.len()).collect();
        record
    }));
    let mut trajectories = Vec::new();
    for record in &records {
        let trajectory = probe(&compiled, record, &theta).map_err(|failure| {
            let diagnostic = Diagnostic::error(Code::SIMULATION_FAILED, failure.to_string()).help(&failure.help);
            session.fail(&[diagnostic])
        })?;
        session.show(&cautions_about(&compiled, record, &trajectory));
        trajectories.push((record, trajectory));
    }
    if arguments.why_slow {
        show_slowness(&compiled, &trajectories, study.format)?;
    }
    for (record, trajectory) in &trajectories {
        let table = table(&compiled, record, trajectory).map_err(|error| {
            eprintln!("error: the channels cannot be written: {error}");
            Failed
        })?;
        match &arguments.output {
            Some(folder) => write_whole(&folder.join(format!("{}.csv", record.name)), &table)?,
            None if arguments.why_slow => {}
            None => show(&table),
        }
    }
    Ok(())
}

fn show_slowness(compiled: &Compiled, trajectories: &[(&Record, Trajectory)], format: Format) -> Result<(), Failed> {
    match format {
        Format::Text => {
            for (record, trajectory) in trajectories {
                show(&format!("{}\n{}\n", record.name, slowness(compiled, trajectory)));
            }
        }
        Format::Json => {
            let runs: serde_json::Map<String, serde_json::Value> = trajectories
                .iter()
                .map(|(record, trajectory)| (record.name.clone(), serde_json::json!(slowness(compiled, trajectory))))
                .collect();
            show(&format!("{}\n", json(serde_json::to_string_pretty(&runs))?));
        }
    }
    Ok(())
}

/// Start values with the given ones put in.
fn parameters(compiled: &Compiled, given: &[String]) -> Result<Vec<f64>, Failed> {
    let mut theta: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    for text in given {
        let parsed = text.split_once('=').and_then(|(name, value)| {
            let index = compiled.study.parameters.iter().position(|p| p.name == name.trim())?;
            Some((index, value.trim().parse::<f64>().ok().filter(|value| value.is_finite())?))
        });
        let Some((index, value)) = parsed else {
            let known: Vec<&str> = compiled.study.parameters.iter().map(|p| p.name.as_str()).collect();
            eprintln!("error: `--set {text}` must be NAME=VALUE with a parameter of the study ({})", known.join(", "));
            return Err(Failed);
        };
        theta[index] = compiled.study.parameters[index].unit.to_si(value);
    }
    Ok(theta)
}

/// Time and simulated channels in the study's units as CSV.
fn table(compiled: &Compiled, record: &Record, trajectory: &Trajectory) -> Result<String, String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let measures = record.measures.iter().map(|&measure| &compiled.study.measures[measure]);
    let mut head = vec!["t [s]".to_owned()];
    head.extend(measures.clone().map(|measure| format!("{} [{}]", measure.name, measure.unit.symbol)));
    writer.write_record(&head).map_err(|error| error.to_string())?;
    for (k, time) in record.compared_times().iter().enumerate() {
        let mut row = vec![time.to_string()];
        row.extend(
            measures
                .clone()
                .zip(&trajectory.channels)
                .map(|(m, channel)| m.unit.from_si(m.shown(channel[k])).to_string()),
        );
        writer.write_record(&row).map_err(|error| error.to_string())?;
    }
    let bytes = writer.into_inner().map_err(|error| error.to_string())?;
    String::from_utf8(bytes).map_err(|error| error.to_string())
}
