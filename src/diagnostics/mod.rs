//! What is wrong in a study's text or data: code, severity, message, labels, help.
//!
//! *In*: findings of every later stage. *Out*: text for a terminal ([`render`]) or records for programs
//! ([`Diagnostic::record`]). *Must not happen here*: deciding whether something is wrong; reading files.
//!
//! ```
//! use ident::diagnostics::{Code, Diagnostic, Sources, render};
//!
//! let mut sources = Sources::new();
//! let file = sources.add("quarter.ident", "force tyre: spring table -> whel");
//! let finding = Diagnostic::error(Code::UNKNOWN_NAME, "there is no body `whel`")
//!     .label(sources.span(file, 28..32), "not declared")
//!     .help("did you mean `wheel`?");
//! assert!(render(&[finding], &sources, false).contains("quarter.ident:1:29"));
//! ```

mod codes;
mod diagnostic;
mod render;
mod similar;
mod sources;

pub use codes::{Code, CodeEntry};
pub use diagnostic::{DataPlace, Diagnostic, Label, LabelRecord, Record, Severity};
pub use render::render;
pub use similar::{similar_name, similar_word};
pub use sources::{Location, Sources};

/// Byte range in a source file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Span {
    /// Index of the file in the set of sources.
    pub file: u32,
    pub start: u32,
    pub end: u32,
}

impl Span {
    /// The smallest range that holds both; `other` must lie in the same file.
    pub fn to(self, other: Span) -> Span {
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}
