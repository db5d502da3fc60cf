//! `ident optimisers STUDY`

use super::output::{answer, figure};
use super::session::Session;
use super::{Failed, StudyArguments};
use crate::analyse::courses;
use crate::report;
use crate::simulation::Record;
use crate::study::Role;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Search only these parameters, the others keep their estimates (default: all)
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    parameters: Vec<String>,
    /// Allowed work per optimiser, in simulations of all records
    #[arg(long, default_value_t = 400)]
    budget: usize,
    /// Seed of the optimisers that draw
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the cost over the work as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let compiled = session.compile(&study.variant)?;
    let records = session.records(&compiled.study, study)?;
    let estimation: Vec<&Record> = records.iter().filter(|record| record.role == Role::Estimation).collect();
    super::fit::known_parameters(&compiled, &arguments.parameters)?;
    let result = courses(&compiled, &estimation, &arguments.parameters, arguments.budget, arguments.seed)
        .map_err(|diagnostics| session.fail(&diagnostics))?;
    figure(arguments.figure.as_deref(), || report::figure::courses(&result))?;
    answer(study.format, || report::terminal::courses(&result), || report::json::courses(&result))
}
