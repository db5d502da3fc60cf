//! One finding, and the same as a record for programs.

use super::{Code, Sources, Span};
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Something the user should know; nothing has to be changed.
    Note,
    Warning,
    /// The question cannot be answered before this is mended.
    Error,
}

/// A marked place with what is to be said about it; the text may be empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    pub span: Span,
    pub text: String,
    /// The place to look at first; the others explain it.
    pub primary: bool,
}

/// A place in a data file, which is not among the sources of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DataPlace {
    pub file: String,
    /// Counted from 1, the head included.
    pub line: Option<u64>,
    /// Name of the column.
    pub column: Option<String>,
}

/// A finding: what is wrong, where, and the likely fix.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    pub severity: Severity,
    pub code: Code,
    /// One line, in an engineer's words, without full stop.
    pub message: String,
    pub labels: Vec<Label>,
    pub data: Option<Box<DataPlace>>,
    pub help: Vec<String>,
    pub notes: Vec<String>,
}

impl Diagnostic {
    pub fn error(code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Error, code, message)
    }

    pub fn warning(code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Warning, code, message)
    }

    /// A remark; see [`Diagnostic::note`] for a note that belongs to another finding.
    pub fn remark(code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Note, code, message)
    }

    pub fn new(severity: Severity, code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            severity,
            code,
            message: message.into(),
            labels: Vec::new(),
            data: None,
            help: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Marks the place of the finding.
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.labels.push(Label { span, text: text.into(), primary: true });
        self
    }

    /// Marks a place that explains the finding.
    pub fn secondary(mut self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.labels.push(Label { span, text: text.into(), primary: false });
        self
    }

    /// Names a place in a data file.
    pub fn data(mut self, file: impl Into<String>, line: Option<u64>, column: Option<&str>) -> Diagnostic {
        self.data = Some(Box::new(DataPlace { file: file.into(), line, column: column.map(str::to_owned) }));
        self
    }

    /// The likely fix.
    pub fn help(mut self, text: impl Into<String>) -> Diagnostic {
        self.help.push(text.into());
        self
    }

    /// "did you mean `..`?" where there is a similar name; nothing otherwise.
    pub fn suggest(self, similar: Option<&str>) -> Diagnostic {
        match similar {
            Some(name) => self.help(format!("did you mean `{name}`?")),
            None => self,
        }
    }

    pub fn note(mut self, text: impl Into<String>) -> Diagnostic {
        self.notes.push(text.into());
        self
    }

    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// The span to look at first, for ordering.
    pub fn span(&self) -> Option<Span> {
        self.labels.iter().find(|label| label.primary).or(self.labels.first()).map(|label| label.span)
    }

    /// The finding with places as file, line and column.
    pub fn record(&self, sources: &Sources) -> Record {
        Record {
            code: self.code.text,
            title: self.code.title,
            severity: self.severity,
            message: self.message.clone(),
            labels: self.labels.iter().filter_map(|label| LabelRecord::new(label, sources)).collect(),
            data: self.data.as_deref().cloned(),
            help: self.help.clone(),
            notes: self.notes.clone(),
        }
    }
}

/// A finding for programs (`--format json`). Lines and columns count from 1; columns count characters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Record {
    pub code: &'static str,
    pub title: &'static str,
    pub severity: Severity,
    pub message: String,
    pub labels: Vec<LabelRecord>,
    pub data: Option<DataPlace>,
    pub help: Vec<String>,
    pub notes: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabelRecord {
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
    pub primary: bool,
    pub text: String,
}

impl LabelRecord {
    fn new(label: &Label, sources: &Sources) -> Option<LabelRecord> {
        let start = sources.location(label.span.file, label.span.start)?;
        let end = sources.location(label.span.file, label.span.end)?;
        Some(LabelRecord {
            file: sources.name(label.span.file)?.to_owned(),
            line: start.line,
            column: start.column,
            end_line: end.line,
            end_column: end.column,
            primary: label.primary,
            text: label.text.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Diagnostic;

    /// Findings are returned as errors by value; clippy refuses errors of 128 bytes and more.
    #[test]
    fn findings_are_small_enough_to_be_returned() {
        assert!(size_of::<Diagnostic>() < 128, "{}", size_of::<Diagnostic>());
    }
}
