//! `ident gradients STUDY`

use super::output::write_whole;
use super::session::Session;
use super::{Failed, Format, StudyArguments};
use crate::analyse::descents;
use crate::report;
use crate::simulation::Record;
use crate::study::Role;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Relative tolerances of the integrator
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [1e-3, 1e-6])]
    tolerances: Vec<f64>,
    /// Write the cost over the iterations as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    if arguments.tolerances.iter().any(|tolerance| !(*tolerance > 0.0 && *tolerance < 1.0)) {
        eprintln!("error: --tolerances must lie between 0 and 1");
        return Err(Failed);
    }
    let session = Session::open(&study.study, study.format)?;
    let compiled = session.compile(&study.variant)?;
    let records = session.records(&compiled.study, study)?;
    let estimation: Vec<&Record> = records.iter().filter(|record| record.role == Role::Estimation).collect();
    let result =
        descents(&compiled, &estimation, &arguments.tolerances).map_err(|diagnostic| session.fail(&[diagnostic]))?;
    if let Some(path) = &arguments.figure {
        write_whole(path, &report::figure::descents(&result))?;
    }
    match study.format {
        Format::Text => print!("{}", report::terminal::descents(&result)),
        Format::Json => println!("{}", super::output::json(report::json::descents(&result))?),
    }
    Ok(())
}
