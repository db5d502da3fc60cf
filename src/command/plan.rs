//! `ident plan STUDY`

use super::output::{answer, page};
use super::session::Session;
use super::{Failed, Format};
use crate::analyse::{PlanOptions, plan};
use crate::report;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// The study file; its manoeuvres are the offered excitations, its measures the offered sensors
    study: PathBuf,
    /// Variant to use instead of the study as it stands
    #[arg(long, default_value = "base")]
    variant: String,
    /// Samples per second of the planned tests, Hz (default: the step of each manoeuvre)
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Largest half-width of a parameter's 95 % interval that is wanted, % of its value
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0)]
    accuracy: f64,
    /// What is known already: a result saved by `ident fit --save-result`; its values are used, too
    #[arg(long = "with", value_name = "FILE")]
    with: Vec<PathBuf>,
    /// Write the answer as one self-contained page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Form of the answer on standard output
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Number of threads (default: all cores); the digits do not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    super::set_threads(arguments.threads)?;
    let wrong = |what: &str| {
        eprintln!("error: {what}");
        Failed
    };
    if !(arguments.accuracy > 0.0 && arguments.accuracy.is_finite()) {
        return Err(wrong("--accuracy must be positive"));
    }
    if arguments.rate.is_some_and(|rate| !(rate > 0.0 && rate.is_finite())) {
        return Err(wrong("--rate must be positive"));
    }
    let session = Session::open(&arguments.study, arguments.format)?;
    let compiled = session.compile(&arguments.variant)?;
    let parameters = &compiled.study.parameters;
    let mut options = PlanOptions {
        theta: parameters.iter().map(|parameter| parameter.start).collect(),
        rate: arguments.rate,
        accuracy: 0.01 * arguments.accuracy,
        knowledge: Vec::new(),
    };
    for path in &arguments.with {
        options.knowledge.extend(super::results::read(path, parameters)?);
        super::results::values(path, parameters, &mut options.theta)?;
    }
    let result = plan(&compiled, &options).map_err(|what| wrong(&what))?;
    page(arguments.html.as_deref(), || report::page::plan(&result))?;
    answer(arguments.format, || report::terminal::plan(&result), || report::json::plan(&result))
}
