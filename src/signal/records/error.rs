//! What is wrong with a data file.

use crate::diagnostics::{Code, Diagnostic, Span};
use std::fmt;
use std::path::{Path, PathBuf};

/// A finding in a data file: the place, the cause, the likely fix.
#[derive(Clone, Debug, PartialEq)]
pub struct DataError {
    /// Kind of finding, one of `Code::DATA_*`.
    pub code: &'static Code,
    pub file: PathBuf,
    /// Counted from 1, the head included.
    pub line: Option<u64>,
    pub column: Option<String>,
    pub explanation: String,
    /// The likely fix.
    pub help: String,
}

impl DataError {
    /// Of a column that the study binds to an input or measure of another name: the help binds that one.
    pub fn of_element(mut self, element: &str) -> Self {
        if let Some(column) = &self.column {
            self.help = self.help.replace(&format!("columns = {{ {column} = "), &format!("columns = {{ {element} = "));
        }
        self
    }

    pub(super) fn new(
        code: &'static Code,
        file: &Path,
        explanation: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        let (explanation, help) = (explanation.into(), help.into());
        Self { code, file: file.to_path_buf(), line: None, column: None, explanation, help }
    }

    pub(super) fn at(mut self, line: Option<u64>, column: Option<&str>) -> Self {
        self.line = line;
        self.column = column.map(str::to_owned);
        self
    }

    /// As a finding of the study; `place` marks the words of the study that asked for the data.
    pub fn diagnostic(&self, place: Option<Span>) -> Diagnostic {
        let finding = Diagnostic::error(*self.code, &self.explanation)
            .data(self.file.display().to_string(), self.line, self.column.as_deref())
            .help(&self.help);
        match place {
            Some(span) => finding.label(span, "needed here"),
            None => finding,
        }
    }
}

impl fmt::Display for DataError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(formatter, ", line {line}")?;
        }
        if let Some(column) = &self.column {
            write!(formatter, ", column `{column}`")?;
        }
        write!(formatter, ": {} ({})", self.explanation, self.help)
    }
}

impl std::error::Error for DataError {}
