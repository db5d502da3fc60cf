//! The texts that spans point into.

use super::Span;
use std::ops::Range;

/// The set of study files read so far; a file's index is the `file` of its spans.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<SourceFile>,
}

#[derive(Clone, Debug)]
struct SourceFile {
    name: String,
    text: String,
    line_starts: Vec<usize>,
}

/// Line and column (in characters), both counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Location {
    pub line: usize,
    pub column: usize,
}

impl Sources {
    pub fn new() -> Sources {
        Sources::default()
    }

    /// Adds a file and returns its index. `name` is shown in messages; the same name may occur again.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> u32 {
        let text = text.into();
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        self.files.push(SourceFile { name: name.into(), text, line_starts });
        (self.files.len() - 1) as u32
    }

    /// Number of files.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    pub fn name(&self, file: u32) -> Option<&str> {
        self.files.get(file as usize).map(|file| file.name.as_str())
    }

    pub fn text(&self, file: u32) -> Option<&str> {
        self.files.get(file as usize).map(|file| file.text.as_str())
    }

    /// A span of bytes of this file.
    pub fn span(&self, file: u32, bytes: Range<usize>) -> Span {
        Span { file, start: bytes.start as u32, end: bytes.end as u32 }
    }

    /// The text a span covers; `None` for a span of another set of sources.
    pub fn excerpt(&self, span: Span) -> Option<&str> {
        self.text(span.file)?.get(span.start as usize..span.end as usize)
    }

    /// Line and column of a byte; bytes behind the end count as the end.
    pub fn location(&self, file: u32, byte: u32) -> Option<Location> {
        let source = self.files.get(file as usize)?;
        let byte = source.character_start(byte as usize);
        let line = source.line_of(byte);
        let column = source.text[source.line_starts[line]..byte].chars().count();
        Some(Location { line: line + 1, column: column + 1 })
    }

    /// `name:line:column` of a span's start.
    pub fn place(&self, span: Span) -> Option<String> {
        let location = self.location(span.file, span.start)?;
        Some(format!("{}:{}:{}", self.name(span.file)?, location.line, location.column))
    }

    pub(super) fn line_index(&self, file: u32, byte: usize) -> Option<usize> {
        self.files.get(file as usize).map(|source| source.line_of(byte))
    }

    /// Bytes of a line (counted from 0) with its line feed.
    pub(super) fn line_range(&self, file: u32, line: usize) -> Option<Range<usize>> {
        let source = self.files.get(file as usize)?;
        let start = *source.line_starts.get(line)?;
        let end = source.line_starts.get(line + 1).copied().unwrap_or(source.text.len());
        Some(start..end)
    }

    /// Bytes of a span, moved onto character boundaries within the text.
    pub(super) fn bytes(&self, span: Span) -> Option<Range<usize>> {
        let source = self.files.get(span.file as usize)?;
        let start = source.character_start(span.start as usize);
        Some(start..source.character_start(span.end as usize).max(start))
    }
}

impl SourceFile {
    fn line_of(&self, byte: usize) -> usize {
        self.line_starts.partition_point(|&start| start <= byte).saturating_sub(1)
    }

    fn character_start(&self, byte: usize) -> usize {
        self.text.floor_char_boundary(byte.min(self.text.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters_from_one() {
        let mut sources = Sources::new();
        let file = sources.add("a.ident", "// größe\nbody w\n");
        assert_eq!(sources.location(file, 0), Some(Location { line: 1, column: 1 }));
        assert_eq!(sources.location(file, 10), Some(Location { line: 1, column: 9 }));
        assert_eq!(sources.location(file, 11), Some(Location { line: 2, column: 1 }));
        assert_eq!(sources.location(file, 999), Some(Location { line: 3, column: 1 }));
        assert_eq!(sources.location(7, 0), None);
    }
}
