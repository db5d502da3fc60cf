//! A study with its sources and records, and how its diagnostics reach the user.

use super::{Failed, Format, StudyArguments};
use crate::diagnostics::{Diagnostic, render};
use crate::simulation::{Compiled, Record, cautions, prepare};
use crate::study::{self, Loaded, Study};
use std::cell::RefCell;
use std::collections::HashSet;
use std::io::IsTerminal;
use std::path::Path;

/// A loaded study file.
pub(super) struct Session {
    pub loaded: Loaded,
    format: Format,
    /// Messages of the warnings printed so far.
    shown: RefCell<HashSet<String>>,
}

impl Session {
    /// Reads the study. Parse errors are printed and fail.
    pub(super) fn open(path: &Path, format: Format) -> Result<Self, Failed> {
        let session = Self { loaded: study::load(path), format, shown: RefCell::default() };
        let diagnostics = session.loaded.diagnostics.clone();
        if diagnostics.iter().any(Diagnostic::is_error) {
            // Checking goes on where it can, so that all errors come in one go.
            let all = study::check(&session.loaded, None).err().unwrap_or(diagnostics);
            return Err(session.fail(&all));
        }
        session.show(&diagnostics);
        Ok(session)
    }

    /// The checked study of a variant; warnings are printed.
    pub(super) fn check(&self, variant: &str) -> Result<Study, Failed> {
        let checked = study::check(&self.loaded, Some(variant)).map_err(|diagnostics| self.fail(&diagnostics))?;
        self.show(&checked.warnings);
        Ok(checked.study)
    }

    pub(super) fn compile(&self, variant: &str) -> Result<Compiled, Failed> {
        let compiled = Compiled::new(self.check(variant)?).map_err(|diagnostics| self.fail(&diagnostics))?;
        self.show(&compiled.system.warnings);
        Ok(compiled)
    }

    /// Warns of what simulations of these records with the parameters `theta` (SI) neglect or leave to chance.
    pub(super) fn caution(&self, compiled: &Compiled, records: &[Record], theta: &[f64]) {
        records.iter().for_each(|record| self.show(&cautions(compiled, record, theta)));
    }

    /// The study's records, read and checked.
    pub(super) fn records(&self, study: &Study, arguments: &StudyArguments) -> Result<Vec<Record>, Failed> {
        let directory = arguments.data.as_deref().unwrap_or(&self.loaded.directory);
        let (records, diagnostics) = prepare(study, directory, &arguments.measures);
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(self.fail(&diagnostics));
        }
        self.show(&diagnostics);
        Ok(records)
    }

    /// Prints diagnostics to standard error, each warning once: variants share most of them.
    pub(super) fn show(&self, diagnostics: &[Diagnostic]) {
        let mut shown = self.shown.borrow_mut();
        let is_new = |diagnostic: &&Diagnostic| diagnostic.is_error() || shown.insert(diagnostic.message.clone());
        let diagnostics: Vec<Diagnostic> = diagnostics.iter().filter(is_new).cloned().collect();
        if diagnostics.is_empty() {
            return;
        }
        match self.format {
            Format::Text => {
                eprint!("{}", render(&diagnostics, &self.loaded.sources, std::io::stderr().is_terminal()));
            }
            Format::Json => {
                for diagnostic in &diagnostics {
                    match serde_json::to_string(&diagnostic.record(&self.loaded.sources)) {
                        Ok(line) => eprintln!("{line}"),
                        Err(error) => eprintln!("{error}"),
                    }
                }
            }
        }
    }

    /// Prints what prevented an answer.
    pub(super) fn fail(&self, diagnostics: &[Diagnostic]) -> Failed {
        self.show(diagnostics);
        let count = diagnostics.iter().filter(|diagnostic| diagnostic.is_error()).count();
        if self.format == Format::Text {
            eprintln!("{count} error{}", if count == 1 { "" } else { "s" });
        }
        Failed
    }
}
