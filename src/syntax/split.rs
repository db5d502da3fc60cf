//! The text split into declarations, so that an error in one does not hide the others.

use super::scan::{Token, TokenKind, partner};
use crate::diagnostics::{Code, Diagnostic, Span, similar_word};
use std::ops::Range;

/// First words of declarations.
pub(super) const KEYWORDS: [&str; 26] = [
    "study",
    "use",
    "gravity",
    "constant",
    "input",
    "body",
    "joint",
    "coupling",
    "force",
    "actuator",
    "signal",
    "effect",
    "measure",
    "group",
    "experiment",
    "manoeuvre",
    "criterion",
    "identify",
    "filter",
    "solver",
    "variant",
    "law",
    "model",
    "part",
    "for",
    "table",
];

/// First words of declarations that are planned.
const PLANNED: [&str; 2] = ["event", "contact"];

/// Deeper brackets are refused.
const DEEPEST_NESTING: usize = 64;

/// How often an unclosed bracket may be looked for down to the end of the file, before the search stops at the next
/// declaration at once. Keeps the time proportional to the text.
const FULL_SEARCHES: usize = 3;

/// The tokens of one declaration, documentation included.
#[derive(Debug)]
pub(super) struct Chunk {
    pub tokens: Range<usize>,
    /// Brackets match and the first word is a keyword.
    pub readable: bool,
}

/// Splits the tokens; what cannot be a declaration is reported.
pub(super) fn split(file: u32, text: &str, tokens: &[Token]) -> (Vec<Chunk>, Vec<Diagnostic>) {
    let mut splitter = Splitter { file, text, tokens, diagnostics: Vec::new(), full_searches: 0 };
    let mut chunks = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let (end, brackets_match) = splitter.chunk_end(at);
        let readable = splitter.check_first_word(at..end) && brackets_match;
        chunks.push(Chunk { tokens: at..end, readable });
        at = end;
    }
    (chunks, splitter.diagnostics)
}

struct Splitter<'a> {
    file: u32,
    text: &'a str,
    tokens: &'a [Token],
    diagnostics: Vec<Diagnostic>,
    full_searches: usize,
}

/// Where a declaration ends, as far as its brackets tell.
enum End {
    At(usize),
    Mismatch { open: usize, close: usize, next: usize },
    Stray { close: usize, next: usize },
    TooDeep { open: usize, next: usize },
    Unclosed { open: usize, next: usize },
}

impl Splitter<'_> {
    /// Index of the token behind the declaration that starts at `start`, and whether its brackets match.
    fn chunk_end(&mut self, start: usize) -> (usize, bool) {
        let patient = self.full_searches < FULL_SEARCHES;
        let mut end = self.search(start, !patient);
        if let End::Unclosed { .. } = end
            && patient
        {
            self.full_searches += 1;
            end = self.search(start, true);
        }
        match end {
            End::At(next) => (next, true),
            End::Mismatch { open, close, next } => {
                self.report_mismatch(open, close);
                (next, false)
            }
            End::Stray { close, next } => {
                self.report_stray(close);
                (next, false)
            }
            End::TooDeep { open, next } => {
                let message = format!("brackets are nested more than {DEEPEST_NESTING} deep");
                self.report(Code::TOO_DEEP, message, open, "this one is too deep");
                (next, false)
            }
            End::Unclosed { open, next } => {
                let sign = self.tokens[open].text(self.text);
                self.report(Code::UNCLOSED, format!("`{sign}` is never closed"), open, "opened here");
                (next, false)
            }
        }
    }

    /// Walks from `start` to the end of the declaration. `hasty`: a keyword at the beginning of a line that is not
    /// indented more than the declaration ends it even inside brackets.
    fn search(&self, start: usize, hasty: bool) -> End {
        let mut open: Vec<usize> = Vec::new();
        let mut wrong: Option<End> = None;
        let mut too_deep: Option<usize> = None;
        let mut only_documentation = true;
        for at in start..self.tokens.len() {
            let token = &self.tokens[at];
            if !only_documentation && self.begins_declaration(start, at, open.is_empty(), hasty) {
                return self.finish(open.first().copied(), wrong, too_deep, at);
            }
            only_documentation &= token.kind == TokenKind::Documentation;
            match token.kind {
                TokenKind::Open(_) => {
                    open.push(at);
                    if open.len() > DEEPEST_NESTING {
                        too_deep = too_deep.or(Some(at));
                    }
                }
                TokenKind::Close(sign) => {
                    let matching = open
                        .iter()
                        .rposition(|&at| matches!(self.tokens[at].kind, TokenKind::Open(o) if partner(o) == sign));
                    match (matching, open.last()) {
                        (None, _) => wrong = wrong.or(Some(End::Stray { close: at, next: 0 })),
                        (Some(matching), Some(&last)) => {
                            if open[matching] != last {
                                wrong = wrong.or(Some(End::Mismatch { open: last, close: at, next: 0 }));
                            }
                            open.truncate(matching);
                        }
                        (Some(_), None) => {}
                    }
                    if open.is_empty() && sign == b'}' {
                        return self.finish(None, wrong, too_deep, at + 1);
                    }
                }
                _ => {}
            }
        }
        self.finish(open.first().copied(), wrong, too_deep, self.tokens.len())
    }

    fn finish(&self, unclosed: Option<usize>, wrong: Option<End>, too_deep: Option<usize>, next: usize) -> End {
        match (too_deep, unclosed, wrong) {
            (Some(open), _, _) => End::TooDeep { open, next },
            (_, Some(open), _) => End::Unclosed { open, next },
            (_, _, Some(End::Mismatch { open, close, .. })) => End::Mismatch { open, close, next },
            (_, _, Some(End::Stray { close, .. })) => End::Stray { close, next },
            _ => End::At(next),
        }
    }

    /// Whether the token at `at` is the first of another declaration than the one that began at `start` and has more
    /// than documentation before `at`.
    fn begins_declaration(&self, start: usize, at: usize, outside_brackets: bool, hasty: bool) -> bool {
        let token = &self.tokens[at];
        if !token.first_on_line {
            return false;
        }
        let column = self.tokens[start].column;
        if outside_brackets {
            let begins = matches!(token.kind, TokenKind::Word | TokenKind::Documentation);
            return begins && !self.continues(at) && (token.column <= column || self.looks_like_declaration(at));
        }
        hasty && token.column <= column && self.looks_like_declaration(at)
    }

    /// Whether the line of the token at `at` goes on with the line before: that one ends with an operator, or this
    /// one starts with a word that needs something before it.
    fn continues(&self, at: usize) -> bool {
        let before = self.tokens[at - 1].text(self.text);
        let word = self.tokens[at].text(self.text);
        matches!(before, "+" | "-" | "*" | "/" | "^" | "=" | ":" | "," | ">" | "<" | ".")
            || matches!(word, "along" | "on" | "from" | "prior" | "then" | "else" | "and" | "or")
    }

    /// A keyword followed by what may follow it.
    fn looks_like_declaration(&self, at: usize) -> bool {
        let word = self.tokens[at].text(self.text);
        let Some(next) = self.tokens.get(at + 1) else {
            return false;
        };
        let next_text = next.text(self.text);
        match word {
            "identify" | "filter" | "solver" => next_text == "{",
            "gravity" => next_text == "=",
            "use" => matches!(next.kind, TokenKind::Text { .. }),
            _ => KEYWORDS.contains(&word) && next.kind == TokenKind::Word,
        }
    }

    /// Whether the declaration starts with a keyword; reports it otherwise.
    fn check_first_word(&mut self, chunk: Range<usize>) -> bool {
        let first = chunk.clone().find(|&at| self.tokens[at].kind != TokenKind::Documentation);
        let Some(first) = first else {
            // Documentation at the end of the file describes nothing; it is harmless.
            return false;
        };
        let word = self.tokens[first].text(self.text);
        if KEYWORDS.contains(&word) {
            return true;
        }
        let span = self.span(first);
        let diagnostic = if PLANNED.contains(&word) {
            Diagnostic::error(Code::NOT_YET, format!("`{word}` is not yet part of the language"))
                .label(span, "planned for a later version")
        } else if self.tokens[first].kind == TokenKind::Word {
            let finding = Diagnostic::error(Code::UNKNOWN_KEYWORD, format!("`{word}` does not begin a declaration"))
                .label(span, "expected a declaration, e.g. `body`, `joint`, `force`, `measure`");
            match similar_word(word, &KEYWORDS).map(str::to_owned).or_else(|| self.keyword_before(first)) {
                Some(declaration) => finding.help(format!("did you mean `{declaration}`?")),
                None => finding,
            }
        } else if matches!(self.tokens[first].kind, TokenKind::Close(_)) {
            return false;
        } else {
            Diagnostic::error(Code::UNEXPECTED_TEXT, format!("expected a declaration, found `{word}`"))
                .label(span, "not the beginning of a declaration")
                .help(
                    comment_help(word)
                        .unwrap_or("a declaration begins with a keyword, e.g. `body wheel { mass = 45 kg }`"),
                )
        };
        self.diagnostics.push(diagnostic);
        false
    }

    /// For a declaration that lacks its keyword, the beginning of what was probably meant.
    fn keyword_before(&self, first: usize) -> Option<String> {
        let text = |at: usize| self.tokens.get(at).map_or("", |token| token.text(self.text));
        let word = text(first);
        if text(first + 1) == "=" {
            return Some(format!("constant {word} = ..."));
        }
        (text(first + 2) == ":").then(|| format!("force {}: {word} ...", text(first + 1)))
    }

    fn report_mismatch(&mut self, open: usize, close: usize) {
        let (opening, closing) = (self.tokens[open].text(self.text), self.tokens[close].text(self.text));
        let diagnostic = Diagnostic::error(Code::UNCLOSED, format!("`{opening}` is not closed"))
            .label(self.span(open), "opened here")
            .secondary(self.span(close), format!("`{closing}` comes before its closing bracket"));
        self.diagnostics.push(diagnostic);
    }

    fn report_stray(&mut self, close: usize) {
        let sign = self.tokens[close].text(self.text);
        self.report(Code::UNEXPECTED_TEXT, format!("`{sign}` closes nothing"), close, "no bracket is open here");
    }

    fn report(&mut self, code: Code, message: String, at: usize, label: &str) {
        self.diagnostics.push(Diagnostic::error(code, message).label(self.span(at), label));
    }

    fn span(&self, at: usize) -> Span {
        let token = &self.tokens[at];
        Span { file: self.file, start: token.start as u32, end: token.end as u32 }
    }
}

/// Help for comment signs of other languages.
pub(super) fn comment_help(found: &str) -> Option<&'static str> {
    matches!(found, "#" | "%" | "/" | ";" | "!").then_some("comments start with `//`")
}
