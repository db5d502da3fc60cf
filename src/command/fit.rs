//! `ident fit STUDY`

use super::output::write_whole;
use super::session::Session;
use super::{Failed, Format, StudyArguments};
use crate::fit::Control;
use crate::identify::{Fitted, Identification, Settings, fit, identification};
use crate::report;
use crate::simulation::{Compiled, Record};
use crate::study::Role;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Write the answer as one self-contained page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let result = identify(&session, study, &study.variant)?;
    if let Some(path) = &arguments.html {
        let page = report::page::identification(&result).map_err(|error| {
            eprintln!("error: the page cannot be made: {error}");
            Failed
        })?;
        write_whole(path, &page)?;
    }
    match study.format {
        Format::Text => print!("{}", report::terminal::identification(&result)),
        Format::Json => println!("{}", super::output::json(report::json::identification(&result))?),
    }
    Ok(())
}

/// Fits one variant to its estimation records and reports it on all records.
pub(super) fn identify(session: &Session, study: &StudyArguments, variant: &str) -> Result<Identification, Failed> {
    let fit = fit_variant(session, study, variant)?;
    Ok(identification(&fit.compiled, &fit.fitted, &fit.records.iter().collect::<Vec<_>>()))
}

/// A variant fitted to its estimation records.
pub(super) struct FittedVariant {
    pub compiled: Compiled,
    /// All records, held-out ones included.
    pub records: Vec<Record>,
    pub fitted: Fitted,
}

pub(super) fn fit_variant(session: &Session, study: &StudyArguments, variant: &str) -> Result<FittedVariant, Failed> {
    let compiled = session.compile(variant)?;
    let records = session.records(&compiled.study, study)?;
    let estimation: Vec<&Record> = records.iter().filter(|record| record.role == Role::Estimation).collect();
    let quiet = study.quiet;
    let fitted = fit(&compiled, &estimation, &Settings::default(), &mut |progress| {
        if !quiet {
            eprintln!("{variant}: iteration {}, cost {:.6e}", progress.iteration, progress.cost);
        }
        Control::Continue
    })
    .map_err(|diagnostic| session.fail(&[diagnostic]))?;
    Ok(FittedVariant { compiled, records, fitted })
}
