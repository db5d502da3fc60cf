//! What is wrong in a study's text or data: code, severity, message, labels, help.

/// Byte range in a source file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Span {
    /// Index of the file in the set of sources.
    pub file: u32,
    pub start: u32,
    pub end: u32,
}
