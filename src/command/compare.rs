//! `ident compare STUDY`

use super::fit::{SearchArguments, fit_variant};
use super::output::{answer, page};
use super::session::Session;
use super::{Failed, StudyArguments};
use crate::identify::{Candidate, Identification, identification, structures};
use crate::report;
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
    let mut names = vec!["base".to_owned()];
    names.extend(session.check("base")?.variants);
    let fits = names
        .iter()
        .map(|name| fit_variant(&session, study, name, &SearchArguments::one()))
        .collect::<Result<Vec<_>, _>>()?;
    let candidates: Vec<Candidate> = fits
        .iter()
        .map(|fit| Candidate { compiled: &fit.compiled, fitted: &fit.fitted, records: &fit.records })
        .collect();
    let mut results: Vec<Identification> = fits
        .iter()
        .map(|fit| identification(&fit.compiled, &fit.fitted, &fit.records.iter().collect::<Vec<_>>()))
        .collect();
    for (result, structure) in results.iter_mut().zip(structures(&candidates)) {
        // One figure under that name: with the counts that all variants share.
        result.bic = structure.bic;
        result.structure = Some(structure);
    }
    page(arguments.html.as_deref(), || report::page::comparison(&results))?;
    answer(study.format, || report::terminal::comparison(&results), || report::json::comparison(&results))
}
