//! `ident diagnose STUDY`

use super::output::write_whole;
use super::progress::Display;
use super::session::Session;
use super::{Failed, Format, StudyArguments};
use crate::diagnose::{Answer, Options, diagnose};
use crate::report;
use std::path::{Path, PathBuf};

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Append the extension to the study file as a variant, and show the change as a patch
    #[arg(long)]
    write: bool,
    /// Write the answer as one self-contained page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write the picture of the answer (before and after, the missing force) as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Add at most this many extensions one after the other
    #[arg(long, default_value_t = 4)]
    extensions: usize,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let checked = session.check(&study.variant)?;
    let records = session.records(&checked, study)?;
    let is_elastic = checked.bodies.iter().any(|body| body.elastic.is_some());
    if is_elastic || !checked.couplings.is_empty() || checked.joints.iter().any(|joint| joint.closes_loop) {
        let compiled = session.compile(&study.variant)?;
        let start: Vec<f64> = checked.parameters.iter().map(|parameter| parameter.start).collect();
        session.caution(&compiled, &records, &start);
    }
    let display = Display::new(study.quiet);
    let options = Options { variant: study.variant.clone(), maximum_extensions: arguments.extensions };
    let outcome = diagnose(&session.loaded, &records, &options, &|event| display.show(event));
    display.end();
    let answer = outcome.map_err(|diagnostics| session.fail(&diagnostics))?;
    if let Some(path) = &arguments.html {
        let page = report::page::answer(&answer).map_err(|error| {
            eprintln!("error: the page cannot be made: {error}");
            Failed
        })?;
        write_whole(path, &page)?;
    }
    if let Some(path) = &arguments.figure {
        write_whole(path, &report::figure::summary(&answer))?;
    }
    match study.format {
        Format::Text => print!("{}", report::terminal::answer(&answer)),
        Format::Json => println!("{}", super::output::json(report::json::answer(&answer))?),
    }
    if arguments.write { write_extension(&study.study, &answer) } else { Ok(()) }
}

/// Appends the accepted variants to the study file; the patch goes to standard error so that `--format json` stays
/// clean.
fn write_extension(path: &Path, answer: &Answer) -> Result<(), Failed> {
    let Some(extension) = &answer.extension else {
        eprintln!("nothing to write: no extension was accepted");
        return Ok(());
    };
    let before = std::fs::read_to_string(path).map_err(|error| {
        eprintln!("error: cannot read {}: {error}", path.display());
        Failed
    })?;
    let separator = if before.ends_with('\n') { "\n" } else { "\n\n" };
    let after = format!("{before}{separator}{extension}");
    write_whole(path, &after)?;
    let name = path.display().to_string();
    let patch = similar::TextDiff::from_lines(&before, &after).unified_diff().header(&name, &name).to_string();
    eprint!("{patch}");
    eprintln!("`ident compare {name}` shows the study with and without it");
    Ok(())
}
