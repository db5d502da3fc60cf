//! The command line: arguments in, exit status out. One file per subcommand.
//!
//! *In*: the process's arguments. *Out*: text on standard output, diagnostics and progress on standard error, files
//! that were asked for, and an exit status that is 0 only when the question was answered. *Must not happen here*:
//! computation.

mod check;
mod compare;
mod compile;
mod cuts;
mod diagnose;
mod explain;
mod fit;
mod format;
mod gradients;
mod law;
mod new;
mod optimisers;
mod output;
mod plan;
mod progress;
mod results;
mod session;
mod simulate;
mod validate;

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;

/// Shows what a mechanical simulation gets wrong, names the cause, extends the model and measures the gain.
#[derive(Debug, Parser)]
#[command(name = "ident", version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Parse and check a study; say what the model is
    Check(check::Arguments),
    /// Show the compiled model as stable text
    Compile(compile::Arguments),
    /// Run the experiments with given parameters and write the simulated channels
    Simulate(simulate::Arguments),
    /// Identify the parameters; show them with confidence, and the discrepancy tree
    Fit(fit::Arguments),
    /// Show what the simulation gets wrong, name the cause, extend the model, measure the gain
    Diagnose(diagnose::Arguments),
    /// Fit all variants and show them side by side, on estimation and held-out data
    Compare(compare::Arguments),
    /// Plan tests: what excitations and sensors would tell about the parameters and criteria
    Plan(plan::Arguments),
    /// Cut the cost along every parameter, at two tolerances and in two bands
    Cuts(cuts::Arguments),
    /// Compare optimisers: cost over the number of simulations
    Optimisers(optimisers::Arguments),
    /// Compare gradients: cost over the iterations, internal differentiation against finite differences
    Gradients(gradients::Arguments),
    /// Judge what the identified model is good for: criteria with confidence
    Validate(validate::Arguments),
    /// Bring study files into canonical layout
    Fmt(format::Arguments),
    /// Start a study
    New(new::Arguments),
    /// Show a law: its remark, its text, its characteristic as a picture
    Law(law::Arguments),
    /// Explain a diagnostic code
    Explain(explain::Arguments),
}

/// Arguments of all commands that read a study with its data.
#[derive(Args, Clone, Debug)]
struct StudyArguments {
    /// The study file
    study: PathBuf,
    /// Folder in which the study's data files are found (default: the study's own folder)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Variant to use instead of the study as it stands
    #[arg(long, default_value = "base")]
    variant: String,
    /// Compare only these measures, in all experiments
    #[arg(long = "measure", value_name = "NAME")]
    measures: Vec<String>,
    /// Form of the answer on standard output
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Number of threads (default: all cores); the digits do not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// No progress on standard error
    #[arg(long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// Why a command did not answer: everything is already printed.
#[derive(Debug)]
struct Failed;

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = match arguments.command {
        Command::Check(arguments) => check::run(&arguments),
        Command::Compile(arguments) => compile::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Diagnose(arguments) => diagnose::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Cuts(arguments) => cuts::run(&arguments),
        Command::Optimisers(arguments) => optimisers::run(&arguments),
        Command::Gradients(arguments) => gradients::run(&arguments),
        Command::Validate(arguments) => validate::run(&arguments),
        Command::Fmt(arguments) => format::run(&arguments),
        Command::New(arguments) => new::run(&arguments),
        Command::Law(arguments) => law::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failed) => ExitCode::FAILURE,
    }
}

/// Limits the thread pool where asked for.
fn set_threads(threads: Option<usize>) -> Result<(), Failed> {
    let Some(count) = threads else {
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new().num_threads(count).build_global().map_err(|error| {
        eprintln!("error: --threads {count}: {error}");
        Failed
    })
}
