//! Reading a file: split into declarations, read each by the grammar, mend and read on where it fails.

use super::Tree;
use super::build::Builder;
use super::explain::explain;
use super::grammar::{Grammar, Rule};
use super::scan::{Token, TokenKind, tokens};
use super::split::{Chunk, split};
use super::tree::Item;
use crate::diagnostics::{Code, Diagnostic, Span};
use pest::Parser;
use std::ops::Range;

/// Larger texts are refused; a study written by hand has some kilobytes.
const LARGEST_TEXT: usize = 16 << 20;

/// Findings beyond this number are not reported.
const MOST_DIAGNOSTICS: usize = 50;

/// How many wrong statements of one declaration are reported.
const MOST_ERRORS_PER_DECLARATION: usize = 10;

/// Reads the text of the file with this index in the sources. The tree holds every declaration that could be read;
/// of a declaration with wrong statements it holds the others, provided that something is left that makes sense. A
/// tree that comes with errors is for looking up names, not for simulating.
///
/// ```
/// let (tree, diagnostics) = ident::syntax::parse(0, "body wheel { mass = 45 kg }");
/// assert!(diagnostics.is_empty());
/// assert_eq!(tree.items.len(), 1);
/// ```
pub fn parse(file: u32, text: &str) -> (Tree, Vec<Diagnostic>) {
    if text.len() > LARGEST_TEXT {
        let message = format!("the file is larger than {} MB", LARGEST_TEXT >> 20);
        let start = Span { file, start: 0, end: 0 };
        return (Tree::default(), vec![Diagnostic::error(Code::TOO_DEEP, message).label(start, "")]);
    }
    let tokens = tokens(text);
    let (chunks, mut diagnostics) = split(file, text, &tokens);
    report_open_texts(file, &tokens, &mut diagnostics);
    let readable = chunks.iter().filter(|chunk| chunk.readable);
    let items = readable.filter_map(|chunk| read_chunk(file, text, &tokens, chunk, &mut diagnostics)).collect();
    diagnostics.sort_by_key(|diagnostic| diagnostic.span().map(|span| (span.start, span.end)));
    if diagnostics.len() > MOST_DIAGNOSTICS {
        let hidden = diagnostics.len() - MOST_DIAGNOSTICS;
        diagnostics.truncate(MOST_DIAGNOSTICS);
        if let Some(last) = diagnostics.last_mut() {
            last.notes.push(format!("{hidden} further errors are not shown"));
        }
    }
    (Tree { items }, diagnostics)
}

fn report_open_texts(file: u32, tokens: &[Token], diagnostics: &mut Vec<Diagnostic>) {
    for token in tokens.iter().filter(|token| token.kind == (TokenKind::Text { closed: false })) {
        let span = Span { file, start: token.start as u32, end: token.end as u32 };
        diagnostics.push(
            Diagnostic::error(Code::UNCLOSED, "the quotation mark is not closed on its line")
                .label(span, "opened here"),
        );
    }
}

/// Reads one declaration. Statements that cannot be read are reported, blanked out, and the rest is read again.
fn read_chunk(
    file: u32,
    text: &str,
    all_tokens: &[Token],
    chunk: &Chunk,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Item> {
    let tokens = &all_tokens[chunk.tokens.clone()];
    if tokens.iter().any(|token| token.kind == (TokenKind::Text { closed: false })) {
        return None;
    }
    let offset = tokens.first()?.start;
    let mut mended = text[offset..tokens.last()?.end].to_owned();
    let mut failed = false;
    for _ in 0..MOST_ERRORS_PER_DECLARATION {
        let error = match Grammar::parse(Rule::single, &mended) {
            Ok(pairs) => {
                let mut builder = Builder::new(file, offset, &mended, tokens);
                let item = builder.item(pairs);
                if !failed {
                    diagnostics.append(&mut builder.diagnostics);
                }
                return item;
            }
            Err(error) => error,
        };
        let place = explain(file, text, tokens, offset, &error);
        let Some(statement) = place.token.and_then(|token| statement_around(text, tokens, token)) else {
            if !failed || !place.at_closing {
                diagnostics.push(place.diagnostic);
            }
            return None;
        };
        let blanked = tokens[statement.start].start - offset..tokens[statement.end - 1].end - offset;
        if is_blank(&mended[blanked.clone()]) {
            return None;
        }
        diagnostics.push(place.diagnostic);
        failed = true;
        blank(&mut mended, blanked);
    }
    None
}

fn is_blank(text: &str) -> bool {
    text.trim().is_empty()
}

/// Replaces a range by blanks, line feeds excepted, so that all other places stay where they are.
fn blank(text: &mut String, range: Range<usize>) {
    let blanks: String = text[range.clone()].bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }).collect();
    text.replace_range(range, &blanks);
}

/// The tokens of the statement within braces that holds the token `at`: from the separator before to the one behind.
/// `None` outside of braces.
fn statement_around(text: &str, tokens: &[Token], at: usize) -> Option<Range<usize>> {
    // A closing brace belongs to the statement before it.
    let anchor = match tokens[at].kind {
        TokenKind::Close(b'}') => at.checked_sub(1)?,
        _ => at,
    };
    if matches!(tokens[anchor].kind, TokenKind::Open(b'{')) {
        return None;
    }
    let open = innermost_brace(tokens, anchor)?;
    let mut start = open + 1;
    let mut depth = 0usize;
    for (index, token) in tokens.iter().enumerate().skip(open + 1) {
        let separates =
            depth == 0 && (token.text(text) == "," || (token.first_on_line && begins_statement(text, token)));
        match token.kind {
            TokenKind::Open(_) => depth += 1,
            TokenKind::Close(_) if depth == 0 => return (start < index).then_some(start..index),
            TokenKind::Close(_) => depth -= 1,
            _ => {}
        }
        if separates && index > anchor {
            return Some(start..index);
        }
        if separates && index <= anchor {
            start = if token.text(text) == "," && index < anchor { index + 1 } else { index };
        }
    }
    None
}

/// Lines that go on with the statement before start with an operator or a bracket; a law's value starts with `=`.
fn begins_statement(text: &str, token: &Token) -> bool {
    !matches!(token.kind, TokenKind::Open(_) | TokenKind::Close(_) | TokenKind::Other) || token.text(text) == "="
}

fn innermost_brace(tokens: &[Token], at: usize) -> Option<usize> {
    let mut open: Vec<usize> = Vec::new();
    for (index, token) in tokens[..=at].iter().enumerate() {
        match token.kind {
            TokenKind::Open(_) if index < at => open.push(index),
            TokenKind::Close(_) if index < at => {
                open.pop();
            }
            _ => {}
        }
    }
    open.into_iter().rev().find(|&index| matches!(tokens[index].kind, TokenKind::Open(b'{')))
}
