//! `ident compare STUDY`

use super::fit::identify;
use super::session::Session;
use super::{Failed, Format, StudyArguments};
use crate::report;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let mut names = vec!["base".to_owned()];
    names.extend(session.check("base")?.variants);
    let results = names.iter().map(|name| identify(&session, study, name)).collect::<Result<Vec<_>, _>>()?;
    match study.format {
        Format::Text => print!("{}", report::terminal::comparison(&results)),
        Format::Json => println!("{}", super::output::json(report::json::comparison(&results))?),
    }
    Ok(())
}
