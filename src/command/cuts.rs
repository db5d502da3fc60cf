//! `ident cuts STUDY`

use super::fit::{SearchArguments, fit_variant};
use super::output::{answer, figure};
use super::session::Session;
use super::{Failed, StudyArguments};
use crate::analyse::cuts;
use crate::report;
use crate::simulation::Record;
use crate::study::Role;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    #[command(flatten)]
    search: SearchArguments,
    /// Points per cut
    #[arg(long, default_value_t = 41)]
    points: usize,
    /// Width of the cuts around the estimate, as a share of the bounds
    #[arg(long, default_value_t = 1.0)]
    width: f64,
    /// Write the cuts as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    if !(arguments.width > 0.0 && arguments.width <= 2.0) {
        eprintln!("error: --width must lie between 0 and 2");
        return Err(Failed);
    }
    let session = Session::open(&study.study, study.format)?;
    let fit = fit_variant(&session, study, &study.variant, &arguments.search)?;
    let estimation: Vec<&Record> = fit.records.iter().filter(|record| record.role == Role::Estimation).collect();
    let result = cuts(&fit.compiled, &fit.fitted, &estimation, arguments.points, arguments.width)
        .map_err(|diagnostic| session.fail(&[diagnostic]))?;
    figure(arguments.figure.as_deref(), || report::figure::cuts(&result))?;
    answer(study.format, || report::terminal::cuts(&result), || report::json::cuts(&result))
}
