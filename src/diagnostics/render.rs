//! Findings as text. The only file that names codespan-reporting.

use super::{DataPlace, Diagnostic, Severity, Sources};
use codespan_reporting::diagnostic as codespan;
use codespan_reporting::files::{Error, Files};
use codespan_reporting::term::{self, Config, Styles, StylesWriter, termcolor};
use std::ops::Range;

impl<'a> Files<'a> for Sources {
    type FileId = u32;
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, file: u32) -> Result<&'a str, Error> {
        Sources::name(self, file).ok_or(Error::FileMissing)
    }

    fn source(&'a self, file: u32) -> Result<&'a str, Error> {
        self.text(file).ok_or(Error::FileMissing)
    }

    fn line_index(&'a self, file: u32, byte: usize) -> Result<usize, Error> {
        Sources::line_index(self, file, byte).ok_or(Error::FileMissing)
    }

    fn line_range(&'a self, file: u32, line: usize) -> Result<Range<usize>, Error> {
        Sources::line_range(self, file, line).ok_or(Error::FileMissing)
    }
}

/// The findings with the source lines they point at, in the order given; `colour` adds terminal colours.
/// A finding whose place cannot be shown (it belongs to other sources) is still reported by its message.
pub fn render(diagnostics: &[Diagnostic], sources: &Sources, colour: bool) -> String {
    diagnostics.iter().map(|diagnostic| render_one(diagnostic, sources, colour)).collect()
}

fn render_one(diagnostic: &Diagnostic, sources: &Sources, colour: bool) -> String {
    let config = Config::default();
    let finding = translate(diagnostic, sources);
    let text = if colour {
        let styles = Styles::default();
        let mut buffer = termcolor::Buffer::ansi();
        let mut writer = StylesWriter::new(&mut buffer, &styles);
        term::emit_to_write_style(&mut writer, &config, sources, &finding)
            .map(|()| String::from_utf8_lossy(buffer.as_slice()).into_owned())
    } else {
        term::emit_into_string(&config, sources, &finding)
    };
    text.unwrap_or_else(|_| format!("{}: {}\n", diagnostic.code, diagnostic.message))
}

fn translate(diagnostic: &Diagnostic, sources: &Sources) -> codespan::Diagnostic<u32> {
    let severity = match diagnostic.severity {
        Severity::Error => codespan::Severity::Error,
        Severity::Warning => codespan::Severity::Warning,
        Severity::Note => codespan::Severity::Note,
    };
    let labels = diagnostic
        .labels
        .iter()
        .filter_map(|label| {
            let bytes = sources.bytes(label.span)?;
            let style = if label.primary { codespan::LabelStyle::Primary } else { codespan::LabelStyle::Secondary };
            Some(codespan::Label::new(style, label.span.file, bytes).with_message(&label.text))
        })
        .collect();
    let data = diagnostic.data.iter().map(|place| data_note(place));
    let help = diagnostic.help.iter().map(|text| hanging("help", text));
    let notes = diagnostic.notes.iter().map(|text| hanging("note", text));
    codespan::Diagnostic::new(severity)
        .with_code(diagnostic.code)
        .with_message(&diagnostic.message)
        .with_labels(labels)
        .with_notes(data.chain(help).chain(notes).collect())
}

fn data_note(place: &DataPlace) -> String {
    let mut text = format!("data: {}", place.file);
    if let Some(line) = place.line {
        text += &format!(", line {line}");
    }
    if let Some(column) = &place.column {
        text += &format!(", column `{column}`");
    }
    text
}

/// Further lines of a note stand below its first.
fn hanging(word: &str, text: &str) -> String {
    let indent = format!("\n{}", " ".repeat(word.len() + 2));
    format!("{word}: {}", text.trim_end().replace('\n', &indent))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::{Code, Span};

    fn example() -> (Sources, Diagnostic) {
        let mut sources = Sources::new();
        let file = sources.add("q.ident", "body wheel { mass = 45 kg }\nforce tyre: spring table -> whel\n");
        let finding = Diagnostic::error(Code::UNKNOWN_NAME, "there is no body `whel`")
            .label(sources.span(file, 56..60), "not declared")
            .secondary(sources.span(file, 5..10), "similar")
            .help("did you mean `wheel`?")
            .note("first line\nsecond line");
        (sources, finding)
    }

    #[test]
    fn plain_text_shows_line_label_and_help() {
        let (sources, finding) = example();
        insta::assert_snapshot!(render(&[finding], &sources, false), @r"
        error[E0201]: there is no body `whel`
          ┌─ q.ident:2:29
          │
        1 │ body wheel { mass = 45 kg }
          │      ----- similar
        2 │ force tyre: spring table -> whel
          │                             ^^^^ not declared
          │
          = help: did you mean `wheel`?
          = note: first line
                  second line
        ");
    }

    #[test]
    fn colour_adds_escapes_only() {
        let (sources, finding) = example();
        let coloured = render(std::slice::from_ref(&finding), &sources, true);
        assert!(coloured.contains("\u{1b}["));
        let mut plain = String::new();
        let mut rest = coloured.as_str();
        while let Some(at) = rest.find('\u{1b}') {
            plain += &rest[..at];
            rest = rest[at..].split_once('m').map_or("", |(_, behind)| behind);
        }
        assert_eq!(plain + rest, render(&[finding], &sources, false));
    }

    #[test]
    fn data_places_and_foreign_spans_are_reported_by_text() {
        let finding = Diagnostic::error(Code::CANNOT_READ_FILE, "no such file")
            .data("data/sweep.csv", Some(12), Some("z_body"))
            .label(Span { file: 9, start: 0, end: 4 }, "here");
        let text = render(&[finding], &Sources::new(), false);
        assert!(text.contains("data: data/sweep.csv, line 12, column `z_body`"), "{text}");
    }

    #[test]
    fn spans_outside_the_text_do_not_panic() {
        let mut sources = Sources::new();
        let file = sources.add("ü.ident", "ü");
        for (start, end) in [(0, 1), (1, 1), (5, 9), (2, 2), (1, 0)] {
            let finding = Diagnostic::error(Code::UNEXPECTED_TEXT, "x").label(Span { file, start, end }, "");
            assert!(render(&[finding], &sources, false).contains("ü.ident:1:"));
        }
    }

    #[test]
    fn records_name_lines_and_columns() {
        let (sources, finding) = example();
        let json = serde_json::to_value(finding.record(&sources)).expect("plain data");
        assert_eq!(json["severity"], "error");
        assert_eq!(json["labels"][0]["line"], 2);
        assert_eq!(json["labels"][0]["column"], 29);
        assert_eq!(json["labels"][1]["primary"], false);
    }
}
