//! Files of results: what a fit knows, and how far it came.

use super::Failed;
use super::fit::FittedVariant;
use super::output::write_whole;
use crate::fit::{PriorRow, Progress};
use crate::identify::{SavedResult, confidence};
use crate::quantities::Unit;
use crate::simulation::Compiled;
use crate::study::{Parameter, Role};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name and version of the form of files of progress.
const PROGRESS: &str = "ident.progress/1";

fn complain(path: &Path, what: &str) -> Failed {
    eprintln!("error: {}: {what}", path.display());
    Failed
}

/// Writes what the fit knows about its parameters.
pub(super) fn save(path: &Path, fit: &FittedVariant) -> Result<(), Failed> {
    let confidence = confidence(&fit.compiled, &fit.fitted);
    let used = fit.records.iter().filter(|record| record.role == Role::Estimation).map(|record| record.name.clone());
    let saved = SavedResult::new(&fit.compiled, &fit.fitted, &confidence, used.collect())
        .map_err(|_| complain(path, "the covariance is not finite"))?;
    let text = serde_json::to_string_pretty(&saved).map_err(|error| complain(path, &error.to_string()))?;
    write_whole(path, &(text + "\n"))
}

/// What an earlier fit knows about these parameters.
pub(super) fn read(path: &Path, parameters: &[Parameter]) -> Result<Vec<PriorRow>, Failed> {
    saved(path)?.rows(parameters).map_err(|what| complain(path, &what))
}

fn saved(path: &Path) -> Result<SavedResult, Failed> {
    let text = std::fs::read_to_string(path).map_err(|error| complain(path, &format!("cannot read it: {error}")))?;
    serde_json::from_str(&text).map_err(|error| complain(path, &format!("is no saved result: {error}")))
}

/// Puts the values of a saved result (SI) in the place of those in `theta`, where they lie within the bounds.
pub(super) fn values(path: &Path, parameters: &[Parameter], theta: &mut [f64]) -> Result<(), Failed> {
    for saved in saved(path)?.parameters {
        if let Some(index) = parameters.iter().position(|parameter| parameter.name == saved.name) {
            let unit = Unit::parse(&saved.unit).map_err(|_| complain(path, &format!("`{}` is no unit", saved.unit)))?;
            theta[index] = unit.to_si(saved.value).clamp(parameters[index].lower, parameters[index].upper);
        }
    }
    Ok(())
}

/// Best parameters so far, SI by name.
#[derive(Deserialize, Serialize)]
struct Kept {
    schema: String,
    cost: f64,
    parameters: BTreeMap<String, f64>,
}

/// Parameters of a file of progress; `None` where there is no such file yet.
pub(super) fn resume(path: &Path, parameters: &[Parameter]) -> Result<Option<Vec<f64>>, Failed> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(complain(path, &format!("cannot read it: {error}"))),
    };
    let kept: Kept =
        serde_json::from_str(&text).map_err(|error| complain(path, &format!("is no file of progress: {error}")))?;
    if kept.schema != PROGRESS {
        return Err(complain(path, &format!("it is `{}`, not `{PROGRESS}`", kept.schema)));
    }
    let value = |parameter: &Parameter| {
        kept.parameters.get(&parameter.name).copied().ok_or_else(|| {
            complain(
                path,
                &format!("it does not know the parameter `{}`: remove the file to begin anew", parameter.name),
            )
        })
    };
    parameters.iter().map(value).collect::<Result<Vec<f64>, Failed>>().map(Some)
}

/// Writes the best parameters so far after every iteration.
pub(super) struct Keeper {
    path: Option<PathBuf>,
    names: Vec<String>,
    complained: bool,
}

impl Keeper {
    pub(super) fn new(path: Option<&Path>, compiled: &Compiled) -> Self {
        let names = compiled.study.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        Self { path: path.map(Path::to_path_buf), names, complained: false }
    }

    pub(super) fn keep(&mut self, progress: &Progress) {
        let Some(path) = &self.path else { return };
        let parameters = self.names.iter().cloned().zip(progress.theta.iter().copied()).collect();
        let kept = Kept { schema: PROGRESS.to_owned(), cost: progress.cost, parameters };
        let written = serde_json::to_string(&kept).is_ok_and(|text| write_whole(path, &(text + "\n")).is_ok());
        if !written && !self.complained {
            self.complained = true;
            eprintln!("warning: the progress of this fit is not kept");
        }
    }
}
