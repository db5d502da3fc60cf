//! The text as words between which blanks may change: paths, numbers with their units, signs, remarks.

use crate::syntax::grammar::{Grammar, Rule};
use pest::Parser;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A word that joins the parts of declarations and expressions.
    Joining,
    /// Any other word or path.
    Word,
    /// A number with its unit.
    Number,
    Text,
    Sign,
    Open,
    Close,
    /// `// ..`
    Remark,
    /// `/// ..`
    Documentation,
}

#[derive(Clone, Debug)]
pub(super) struct Token<'a> {
    pub kind: Kind,
    /// As it is written in the result.
    pub text: String,
    /// Line feeds between the token before and this one.
    pub line_feeds: usize,
    /// It follows the token before without a blank.
    pub touches: bool,
    /// A word followed by a colon.
    pub declares: bool,
    /// What follows.
    rest: &'a str,
}

/// Words after which no operand has been read, so that a minus belongs to what follows.
const JOINING: [&str; 18] = [
    "if", "then", "else", "and", "or", "in", "from", "prior", "by", "of", "along", "on", "adds", "neutral", "for",
    "when", "every", "nominal",
];

pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens: Vec<Token<'_>> = Vec::new();
    let mut rest = text;
    loop {
        let trimmed = rest.trim_start_matches([' ', '\t', '\r', '\n']);
        let between = &rest[..rest.len() - trimmed.len()];
        let line_feeds = if tokens.is_empty() { 1 } else { between.matches('\n').count() };
        let Some(first) = trimmed.chars().next() else { return tokens };
        let line = &trimmed[..trimmed.find('\n').unwrap_or(trimmed.len())];
        let (kind, length, text) = read(line, first, tokens.last());
        rest = &trimmed[length..];
        let declares = kind == Kind::Word && rest.trim_start().starts_with(':') && !rest.trim_start().starts_with(":=");
        tokens.push(Token { kind, text, line_feeds, touches: between.is_empty(), declares, rest });
    }
}

/// Kind, length and canonical text of the token at the beginning of the line's rest.
fn read(line: &str, first: char, before: Option<&Token<'_>>) -> (Kind, usize, String) {
    let whole = |kind: Kind| (kind, line.len(), line.trim_end().to_owned());
    if line.starts_with("//") {
        return whole(if line.starts_with("///") && !line.starts_with("////") {
            Kind::Documentation
        } else {
            Kind::Remark
        });
    }
    let as_written = |kind: Kind, length: usize| (kind, length, line[..length].to_owned());
    match first {
        '"' => as_written(Kind::Text, line[1..].find('"').map_or(line.len(), |end| end + 2)),
        '(' | '{' => as_written(Kind::Open, 1),
        ')' | '}' => as_written(Kind::Close, 1),
        // A unit in brackets; indices are parts of paths.
        '[' => {
            let end = line.find(']').map_or(line.len(), |end| end + 1);
            let inside = line[1..end].trim_end_matches(']').trim();
            (Kind::Word, end, format!("[{inside}]"))
        }
        '0'..='9' => {
            // The exponent of a type has no unit.
            let is_exponent = before.is_some_and(|token| token.text == "^");
            match length_of(Rule::quantity, line).filter(|_| !is_exponent) {
                Some(length) => (Kind::Number, length, number(&line[..length])),
                None => as_written(Kind::Number, line.find(|sign: char| !sign.is_ascii_digit()).unwrap_or(line.len())),
            }
        }
        _ if first.is_alphabetic() || first == '_' => word(line),
        _ => {
            let double = ["->", "..", "+-", "<=", ">=", ":="].iter().any(|sign| line.starts_with(sign));
            as_written(Kind::Sign, if double { 2 } else { first.len_utf8() })
        }
    }
}

fn word(line: &str) -> (Kind, usize, String) {
    let is_part = |sign: char| sign.is_alphanumeric() || sign == '_';
    let end = line.find(|sign| !is_part(sign)).unwrap_or(line.len());
    let word = &line[..end];
    if JOINING.contains(&word) {
        return (Kind::Joining, end, word.to_owned());
    }
    let length = length_of(Rule::path, line).unwrap_or(end);
    // The derivative of a state.
    let length = if line[length..].starts_with('\'') { length + 1 } else { length };
    let mut text = line[..length].to_owned();
    text.retain(|sign| !sign.is_whitespace());
    (Kind::Word, length, text)
}

/// The number and its unit, one blank between them.
fn number(text: &str) -> String {
    let end = length_of(Rule::number, text).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    if unit.trim().is_empty() { number.to_owned() } else { format!("{number} {}", unit.trim()) }
}

/// How much of the line's beginning the rule takes.
fn length_of(rule: Rule, line: &str) -> Option<usize> {
    let pair = Grammar::parse(rule, line).ok()?.next()?;
    Some(pair.as_str().trim_end().len())
}

impl Token<'_> {
    /// Whether the text goes on with this sign, blanks aside.
    pub fn is_followed_by(&self, sign: char) -> bool {
        self.rest.trim_start().starts_with(sign)
    }
}
