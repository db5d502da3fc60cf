//! `ident fit STUDY`

use super::output::{answer, page};
use super::session::Session;
use super::{Failed, StudyArguments};
use crate::analyse::{Cuts, cuts};
use crate::fit::{Chosen, Control, Optimiser};
use crate::identify::{Fitted, Profile, Settings, confidence, equation_error, fit, identification, profiles};
use crate::report;
use crate::simulation::{Compiled, Record};
use crate::study::{ErrorDefinition, Role};
use clap::ValueEnum;
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
    /// Profile likelihood of these parameters: their intervals without linearisation (`all` for all)
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    profile: Vec<String>,
    /// Show on the page cuts of the cost along every parameter, at two tolerances and in two bands (as `ident cuts`)
    #[arg(long, requires = "html")]
    cuts: bool,
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
    /// What searches the minimum
    #[arg(long, value_enum, default_value_t)]
    optimiser: OptimiserArgument,
    /// Simulations of all records that an optimiser other than Levenberg-Marquardt may take
    #[arg(long, value_name = "N", default_value_t = 2000)]
    budget: usize,
    /// What counts as error between model and measurement (default: as the study's `solver` says)
    #[arg(long, value_enum)]
    error: Option<ErrorArgument>,
    /// Stretches per record of `--error shooting`
    #[arg(long, value_name = "N", default_value_t = 12)]
    stretches: usize,
    /// Where the search starts
    #[arg(long, value_enum, default_value_t)]
    start: StartArgument,
    /// Noise of the measurements: weight by an autoregressive model of its colour, or not (default: as the study's
    /// `solver` says)
    #[arg(long, value_enum)]
    noise: Option<NoiseArgument>,
    /// Widen the band of the filter to that of the study in so many steps, each twice as wide
    #[arg(long, value_name = "N", default_value_t = 0)]
    bands: usize,
    /// End after so many iterations, with the best so far
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ErrorArgument {
    /// Free simulation from the experiment's start
    Output,
    /// Measured states in the equations of motion: one linear step
    Equation,
    /// One-step predictions by an extended Kalman filter: noise in the process, too
    Filter,
    /// Stretches that the fit joins: weakly damped, self-excited, chaotic
    Shooting,
}

impl From<ErrorArgument> for ErrorDefinition {
    fn from(argument: ErrorArgument) -> Self {
        match argument {
            ErrorArgument::Output => Self::Output,
            ErrorArgument::Equation => Self::Equation,
            ErrorArgument::Filter => Self::Filter,
            ErrorArgument::Shooting => Self::Shooting,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, ValueEnum)]
enum StartArgument {
    /// The study's start values
    #[default]
    Study,
    /// The estimate by equation error
    Equation,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum NoiseArgument {
    White,
    Coloured,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum OptimiserArgument {
    /// Gauss-Newton steps within a trust region; knows constraints
    #[default]
    LevenbergMarquardt,
    /// Sequential quadratic programming with the gradient alone
    Sequential,
    /// The simplex of Nelder and Mead, without derivatives
    Simplex,
    /// Differential evolution: global, without derivatives
    Evolution,
}

impl From<OptimiserArgument> for Optimiser {
    fn from(argument: OptimiserArgument) -> Self {
        match argument {
            OptimiserArgument::LevenbergMarquardt => Self::LevenbergMarquardt,
            OptimiserArgument::Sequential => Self::Sequential,
            OptimiserArgument::Simplex => Self::Simplex,
            OptimiserArgument::Evolution => Self::Evolution,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let study = &arguments.study;
    super::set_threads(study.threads)?;
    let session = Session::open(&study.study, study.format)?;
    let fit = fit_variant(&session, study, &study.variant, &arguments.search)?;
    if let Some(path) = &arguments.save_result {
        super::results::save(path, &fit)?;
    }
    let mut result = identification(&fit.compiled, &fit.fitted, &fit.records.iter().collect::<Vec<_>>());
    result.profiles = profiles_of(&session, &fit, &arguments.profile)?;
    let cuts = match arguments.cuts {
        true => Some(cuts_of(&session, &fit)?),
        false => None,
    };
    page(arguments.html.as_deref(), || report::page::identification(&result, cuts.as_ref()))?;
    answer(study.format, || report::terminal::identification(&result), || report::json::identification(&result))
}

/// Points per cut of the page.
const CUT_POINTS: usize = 41;

fn cuts_of(session: &Session, fit: &FittedVariant) -> Result<Cuts, Failed> {
    let estimation: Vec<&Record> = fit.records.iter().filter(|record| record.role == Role::Estimation).collect();
    cuts(&fit.compiled, &fit.fitted, &estimation, CUT_POINTS, 1.0).map_err(|diagnostic| session.fail(&[diagnostic]))
}

/// Profiles of the named parameters.
fn profiles_of(session: &Session, fit: &FittedVariant, names: &[String]) -> Result<Vec<Profile>, Failed> {
    let parameters = &fit.compiled.study.parameters;
    let all = names.iter().any(|name| name == "all");
    if !all {
        known_parameters(&fit.compiled, names)?;
    }
    let indices: Vec<usize> = (0..parameters.len()).filter(|&j| all || names.contains(&parameters[j].name)).collect();
    let estimation: Vec<&Record> = fit.records.iter().filter(|record| record.role == Role::Estimation).collect();
    let known = confidence(&fit.compiled, &fit.fitted);
    profiles(&fit.compiled, &fit.fitted, &known, &estimation, &indices)
        .map_err(|diagnostic| session.fail(&[diagnostic]))
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
        Self { starts: 1, stretches: 12, budget: Chosen::default().budget, ..Self::default() }
    }

    fn settings(&self, compiled: &Compiled) -> Result<Settings, Failed> {
        let parameters = &compiled.study.parameters;
        let mut settings = Settings {
            further_starts: self.starts.saturating_sub(1),
            seed: 1,
            maximum_iterations: self.steps,
            error: self.error.map_or(compiled.study.solver.error, ErrorDefinition::from),
            stretches: self.stretches,
            coloured_noise: self.noise.map_or(compiled.study.solver.coloured_noise, |n| n == NoiseArgument::Coloured),
            bands: self.bands,
            chosen: Chosen { optimiser: self.optimiser.into(), budget: self.budget, ..Chosen::default() },
            ..Settings::default()
        };
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
    let mut settings = search.settings(&compiled)?;
    if search.start == StartArgument::Equation && settings.start.is_none() {
        let start: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
        let found = equation_error(&compiled, &estimation, &start).map_err(|diagnostic| session.fail(&[diagnostic]))?;
        settings.start = Some(found.theta);
    }
    let mut keeper = super::results::Keeper::new(search.resume.as_deref(), &compiled);
    let fitted = fit(&compiled, &estimation, &settings, &mut |progress| {
        keeper.keep(progress);
        if !quiet {
            eprintln!("{variant}: iteration {}, cost {:.6e}", progress.iteration, progress.cost);
        }
        Control::Continue
    })
    .map_err(|diagnostic| session.fail(&[diagnostic]))?;
    session.caution(&compiled, &records, &fitted.theta);
    Ok(FittedVariant { compiled, records, fitted })
}

/// Complains about names that are no parameters of the study.
pub(super) fn known_parameters(compiled: &Compiled, names: &[String]) -> Result<(), Failed> {
    let known: Vec<&str> = compiled.study.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    match names.iter().find(|name| !known.contains(&name.as_str())) {
        Some(name) => {
            eprintln!("error: `{name}` is no parameter of this study ({})", known.join(", "));
            Err(Failed)
        }
        None => Ok(()),
    }
}
