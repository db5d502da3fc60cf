//! The text as a list of tokens, fine enough to find declarations, statements and brackets.

use std::ops::Range;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TokenKind {
    Word,
    Number,
    /// `"..."`; not closed where the line ends first.
    Text {
        closed: bool,
    },
    /// `/// ...`
    Documentation,
    Open(u8),
    Close(u8),
    Other,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Token {
    pub kind: TokenKind,
    pub start: usize,
    pub end: usize,
    /// Nothing but blanks before it on its line.
    pub first_on_line: bool,
    /// Bytes before it on its line.
    pub column: usize,
}

impl Token {
    pub fn range(&self) -> Range<usize> {
        self.start..self.end
    }

    pub fn text<'a>(&self, text: &'a str) -> &'a str {
        &text[self.range()]
    }
}

/// All tokens of a text; comments and blanks are left out. Time proportional to the text.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let mut scanner = Scanner { text, at: 0, line_start: 0, first_on_line: true };
    let mut tokens = Vec::new();
    while let Some(token) = scanner.next_token() {
        tokens.push(token);
    }
    tokens
}

struct Scanner<'a> {
    text: &'a str,
    at: usize,
    line_start: usize,
    first_on_line: bool,
}

impl Scanner<'_> {
    fn next_token(&mut self) -> Option<Token> {
        self.skip_blanks_and_comments();
        let rest = &self.text[self.at..];
        let first = rest.chars().next()?;
        let (kind, length) = classify(rest, first);
        let token = Token {
            kind,
            start: self.at,
            end: self.at + length,
            first_on_line: self.first_on_line,
            column: self.at - self.line_start,
        };
        self.at = token.end;
        self.first_on_line = false;
        Some(token)
    }

    fn skip_blanks_and_comments(&mut self) {
        let bytes = self.text.as_bytes();
        while let Some(byte) = bytes.get(self.at) {
            match byte {
                b'\n' => {
                    self.at += 1;
                    self.line_start = self.at;
                    self.first_on_line = true;
                }
                b' ' | b'\t' | b'\r' => self.at += 1,
                b'/' if is_comment(&self.text[self.at..]) => self.at += line_length(&self.text[self.at..]),
                _ => return,
            }
        }
    }
}

fn is_comment(rest: &str) -> bool {
    rest.starts_with("//") && !is_documentation(rest)
}

fn is_documentation(rest: &str) -> bool {
    rest.starts_with("///") && !rest.starts_with("////")
}

fn line_length(rest: &str) -> usize {
    rest.find('\n').unwrap_or(rest.len())
}

fn classify(rest: &str, first: char) -> (TokenKind, usize) {
    match first {
        '/' if is_documentation(rest) => (TokenKind::Documentation, line_length(rest)),
        '"' => classify_text(rest),
        '(' | '[' | '{' => (TokenKind::Open(first as u8), 1),
        ')' | ']' | '}' => (TokenKind::Close(first as u8), 1),
        '0'..='9' => (TokenKind::Number, length_while(rest, |sign| sign.is_ascii_digit())),
        _ if is_word_start(first) => (TokenKind::Word, length_while(rest, is_word_part)),
        _ => (TokenKind::Other, first.len_utf8()),
    }
}

fn classify_text(rest: &str) -> (TokenKind, usize) {
    let inside = &rest[1..];
    match inside.find(['"', '\n']) {
        Some(end) if inside.as_bytes()[end] == b'"' => (TokenKind::Text { closed: true }, end + 2),
        Some(end) => (TokenKind::Text { closed: false }, end + 1),
        None => (TokenKind::Text { closed: false }, rest.len()),
    }
}

pub(super) fn is_word_start(sign: char) -> bool {
    sign.is_alphabetic() || sign == '_'
}

fn is_word_part(sign: char) -> bool {
    is_word_start(sign) || sign.is_ascii_digit()
}

fn length_while(rest: &str, wanted: impl Fn(char) -> bool) -> usize {
    rest.find(|sign| !wanted(sign)).unwrap_or(rest.len())
}

/// The closing partner of an opening bracket.
pub(super) fn partner(open: u8) -> u8 {
    match open {
        b'(' => b')',
        b'[' => b']',
        _ => b'}',
    }
}
