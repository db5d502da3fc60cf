//! The text in canonical layout: two blanks of indentation per open bracket, single blanks between words, at most one
//! empty line in a row. Lines stay lines, and every remark stays where it is.

mod align;
mod space;
mod token;

use super::print::print;
use super::read::parse;
use crate::diagnostics::Diagnostic;
use align::{Columns, align, columns};
use space::{Spacing, ends_open, goes_on};
use token::{Kind, Token, tokens};

/// The canonical layout of a text. Formatting it again changes nothing, and it reads as the same tree.
///
/// # Errors
/// A text that cannot be read is left alone.
pub fn format(file: u32, text: &str) -> Result<String, NotFormatted> {
    let (tree, findings) = parse(file, text);
    if !findings.is_empty() {
        return Err(NotFormatted::Unreadable(findings));
    }
    let formatted = layout(text);
    let (again, findings) = parse(file, &formatted);
    let is_same = findings.is_empty() && print(&again) == print(&tree);
    if is_same { Ok(formatted) } else { Err(NotFormatted::Unfaithful) }
}

/// Why a text keeps its layout.
#[derive(Clone, Debug, PartialEq)]
pub enum NotFormatted {
    /// The findings of reading.
    Unreadable(Vec<Diagnostic>),
    /// It would be read otherwise afterwards: a defect of the formatter, found by reading the result again.
    Unfaithful,
}

/// A line of the result.
struct Line {
    indentation: usize,
    text: String,
    /// Behind the text.
    remark: Option<String>,
    columns: Option<Columns>,
    blank_before: bool,
    is_documentation: bool,
}

fn layout(text: &str) -> String {
    let tokens = tokens(text);
    let mut writer = Writer::default();
    let mut at = 0;
    while at < tokens.len() {
        let end =
            tokens[at + 1..].iter().position(|token| token.line_feeds > 0).map_or(tokens.len(), |next| at + 1 + next);
        writer.line(&tokens[at..end]);
        at = end;
    }
    align(&mut writer.lines);
    let mut result = String::new();
    for (index, line) in writer.lines.iter().enumerate() {
        if line.blank_before && index > 0 {
            result.push('\n');
        }
        let mut written = format!("{}{}", " ".repeat(line.indentation), line.text);
        if let Some(remark) = &line.remark {
            written += remark;
        }
        result += written.trim_end();
        result.push('\n');
    }
    result
}

#[derive(Default)]
struct Writer {
    lines: Vec<Line>,
    /// Of each open bracket: its sign, the line it stands on, the indentation of that line's statement.
    open: Vec<Bracket>,
    /// The last token that is no remark.
    previous: Option<(Kind, String)>,
    /// First word of the statement that the present line belongs to.
    statement: String,
}

struct Bracket {
    sign: char,
    line: usize,
    indentation: usize,
    is_identify: bool,
}

const STEP: usize = 2;

impl Writer {
    fn line(&mut self, tokens: &[Token<'_>]) {
        let first = &tokens[0];
        let closing = tokens.iter().take_while(|token| token.kind == Kind::Close).count();
        let goes_on = self.goes_on(first);
        let indentation = self.indentation(closing, goes_on);
        // What opens on a later line of a statement belongs to the statement.
        let base = match self.open.last() {
            Some(bracket) if bracket.sign != '{' => bracket.indentation,
            _ if goes_on => indentation - STEP,
            _ => indentation,
        };
        if !goes_on && first.kind != Kind::Remark && first.kind != Kind::Documentation {
            first.text.clone_into(&mut self.statement);
        }
        let innermost = self.open.last().filter(|_| closing == 0 && !goes_on);
        let in_identify = innermost.is_some_and(|bracket| bracket.is_identify);
        let in_braces = innermost.is_some_and(|bracket| bracket.sign == '{');
        let after_open = self.previous.as_ref().is_some_and(|(kind, _)| *kind == Kind::Open)
            && self.lines.last().is_some_and(|line| line.remark.is_none());
        let blank_before = first.line_feeds > 1 && !after_open && first.kind != Kind::Close;
        let mut text = String::new();
        let mut remark = None;
        let mut starts = Vec::new();
        let mut spacing = Spacing::default();
        for token in tokens {
            if token.kind == Kind::Remark && !text.is_empty() {
                remark = Some(format!("  {}", token.text));
                continue;
            }
            let before = self.previous.as_ref().map(|(kind, text)| (*kind, text.as_str()));
            if !text.is_empty() && spacing.blank(before, token) {
                text.push(' ');
            }
            spacing.note(before, token);
            starts.push(text.len());
            text += &token.text;
            if token.kind != Kind::Remark && token.kind != Kind::Documentation {
                self.bracket(token, base);
                self.previous = Some((token.kind, token.text.clone()));
            }
        }
        let columns = if goes_on { None } else { columns(tokens, &starts, in_identify, in_braces) };
        let is_documentation = first.kind == Kind::Documentation;
        self.lines.push(Line { indentation, text, remark, columns, blank_before, is_documentation });
    }

    /// Whether a line that begins with this token belongs to the statement of the line before.
    fn goes_on(&self, first: &Token<'_>) -> bool {
        let Some((kind, text)) = &self.previous else { return false };
        let in_parentheses = self.open.last().is_some_and(|bracket| bracket.sign != '{');
        if in_parentheses || matches!(first.kind, Kind::Remark | Kind::Documentation | Kind::Close) {
            return false;
        }
        let in_list = matches!(self.statement.as_str(), "param" | "amplitude" | "shape");
        let after_comma = text == "," && (self.open.is_empty() || in_list && first.declares);
        after_comma || ends_open(*kind, text) || goes_on(first)
    }

    /// One step per line on which brackets are open; brackets that this line begins by closing do not count.
    fn indentation(&self, closing: usize, goes_on: bool) -> usize {
        let kept = self.open.len().saturating_sub(closing);
        if let Some(closed) = self.open.get(kept).filter(|_| closing > 0) {
            return closed.indentation;
        }
        let own = match self.open.last() {
            Some(bracket) => bracket.indentation + STEP,
            None => 0,
        };
        if goes_on { own + STEP } else { own }
    }

    fn bracket(&mut self, token: &Token<'_>, indentation: usize) {
        match token.kind {
            Kind::Open => {
                let line = self.lines.len();
                // A bracket that opens on a line with another one does not indent further.
                let shared = self.open.last().filter(|bracket| bracket.line == line).map(|bracket| bracket.indentation);
                let is_identify = self.previous.as_ref().is_some_and(|(_, text)| text == "identify");
                self.open.push(Bracket {
                    sign: token.text.chars().next().unwrap_or('{'),
                    line,
                    indentation: shared.unwrap_or(indentation),
                    is_identify,
                });
            }
            Kind::Close => {
                self.open.pop();
            }
            _ => {}
        }
    }
}
