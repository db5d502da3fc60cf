//! `ident fit STUDY`

use super::output::write_whole;
use super::session::Session;
use super::{Failed, Format, StudyArguments};
use crate::fit::Control;
use crate::identify::{Fitted, Settings, fit, identification};
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
    #[command(flatten)]
    search: SearchArguments,
    /// Write what the fit knows about the parameters, for `--with` of another fit
    #[arg(long, value_name = "FILE")]
    save_result: Option<PathBuf>,
}

/// Arguments of commands that fit.
#[derive(clap::Args, Clone, Debug, Default)]
pub(super) struct SearchArguments {
    /// Search from N points in all: the study's start, and others all over the bounds
    #[arg(long, value_name = "N", default_value_t = 1)]
    starts: usize,
    /// Take what an independent fit knows about the parameters into account; may be given several times
    #[arg(long = "with", value_name = "FILE")]
    with: Vec<PathBuf>,
    /// Keep the best parameters so far in this file, and go on from it where it exists
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let fit = fit_variant(&session, study, &study.variant, &arguments.search)?;
    if let Some(path) = &arguments.save_result {
        super::results::save(path, &fit)?;
    }
    let result = identification(&fit.compiled, &fit.fitted, &fit.records.iter().collect::<Vec<_>>());
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

/// A variant fitted to its estimation records.
pub(super) struct FittedVariant {
    pub compiled: Compiled,
    /// All records, held-out ones included.
    pub records: Vec<Record>,
    pub fitted: Fitted,
}

impl SearchArguments {
    /// A single search from the study's start.
    pub(super) fn one() -> Self {
        Self { starts: 1, ..Self::default() }
    }

    fn settings(&self, compiled: &Compiled) -> Result<Settings, Failed> {
        let parameters = &compiled.study.parameters;
        let mut settings = Settings { further_starts: self.starts.saturating_sub(1), seed: 1, ..Settings::default() };
        for path in &self.with {
            settings.knowledge.extend(super::results::read(path, parameters)?);
        }
        if let Some(path) = &self.resume {
            settings.start = super::results::resume(path, parameters)?;
        }
        Ok(settings)
    }
}

pub(super) fn fit_variant(
    session: &Session,
    study: &StudyArguments,
    variant: &str,
    search: &SearchArguments,
) -> Result<FittedVariant, Failed> {
    let compiled = session.compile(variant)?;
    let records = session.records(&compiled.study, study)?;
    let estimation: Vec<&Record> = records.iter().filter(|record| record.role == Role::Estimation).collect();
    let quiet = study.quiet;
    let settings = search.settings(&compiled)?;
    let mut keeper = super::results::Keeper::new(search.resume.as_deref(), &compiled);
    let fitted = fit(&compiled, &estimation, &settings, &mut |progress| {
        keeper.keep(progress);
        if !quiet {
            eprintln!("{variant}: iteration {}, cost {:.6e}", progress.iteration, progress.cost);
        }
        Control::Continue
    })
    .map_err(|diagnostic| session.fail(&[diagnostic]))?;
    Ok(FittedVariant { compiled, records, fitted })
}
