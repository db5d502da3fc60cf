//! `ident validate STUDY`

use super::fit::{SearchArguments, fit_variant};
use super::output::{answer, page};
use super::session::Session;
use super::{Failed, StudyArguments};
use crate::analyse::{MonteCarlo, Verdict, validity};
use crate::identify::confidence;
use crate::report;
use crate::simulation::{Record, manoeuvre};
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    #[command(flatten)]
    search: SearchArguments,
    /// Parameter vectors drawn for the Monte Carlo interval
    #[arg(long, default_value_t = 400)]
    samples: usize,
    /// Seed of the draws; the same seed gives the same digits
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the answer as one self-contained page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let checked = session.check(&study.variant)?;
    if checked.criteria.is_empty() {
        eprintln!(
            "error: the study declares no criterion\n  help: add `manoeuvre NAME {{ u = ..., for 4 s }}` and `criterion NAME = max(..) in NAME {{ below = .. }}`"
        );
        return Err(Failed);
    }
    let fit = fit_variant(&session, study, &study.variant, &arguments.search)?;
    let used: Vec<Record> =
        (0..fit.compiled.study.manoeuvres.len()).map(|index| manoeuvre(&fit.compiled.study, index)).collect();
    session.caution(&fit.compiled, &used, &fit.fitted.theta);
    let confidence = confidence(&fit.compiled, &fit.fitted);
    let options = MonteCarlo { samples: arguments.samples, seed: arguments.seed };
    let result = validity(&fit.compiled, &fit.fitted, &confidence, options);
    page(arguments.html.as_deref(), || report::page::validity(&result))?;
    answer(study.format, || report::terminal::validity(&result), || report::json::validity(&result))?;
    let answered = result.criteria.iter().all(|criterion| criterion.verdict != Verdict::CannotBeJudged);
    if answered { Ok(()) } else { Err(Failed) }
}
