//! Columns of neighbouring lines: keys of fields, names of like declarations, parts of `identify` lines, and remarks
//! behind declarations.

use super::Line;
use super::token::{Kind, Token};

/// Where a line may be cut into columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    /// Only lines of one sort are aligned.
    sort: String,
    /// Bytes of the line's text at which columns begin, the first excepted.
    cuts: Vec<usize>,
}

/// The columns of a line whose tokens begin at these bytes.
pub(super) fn columns(tokens: &[Token<'_>], starts: &[usize], in_identify: bool, in_braces: bool) -> Option<Columns> {
    let text = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let cut = |sort: &str, places: &[usize]| {
        let cuts: Option<Vec<usize>> = places.iter().map(|at| starts.get(*at).copied()).collect();
        Some(Columns { sort: sort.to_owned(), cuts: cuts? })
    };
    if tokens.first()?.kind != Kind::Word {
        return None;
    }
    match text(0) {
        _ if in_identify => identify_columns(tokens, starts),
        _ if in_braces && text(1) == "=" && is_one_field(tokens) => cut("field", &[1]),
        "joint" | "force" | "actuator" | "signal" | "effect" | "part" if text(2) == ":" => cut("element", &[3]),
        "coupling" if text(2) == ":" => cut("coupling", &[3]),
        head @ ("body" | "group") if text(2) == "{" && closes(tokens) => cut(head, &[2]),
        head @ ("measure" | "criterion") if text(2).starts_with('[') => cut(head, &[2, 3]),
        _ => None,
    }
}

/// Several fields on one line are no column.
fn is_one_field(tokens: &[Token<'_>]) -> bool {
    let mut depth = 0usize;
    let mut signs = 0;
    for token in tokens {
        match token.kind {
            Kind::Open => depth += 1,
            Kind::Close => depth = depth.saturating_sub(1),
            _ if depth == 0 && token.text == "=" => signs += 1,
            _ => {}
        }
    }
    signs == 1
}

fn closes(tokens: &[Token<'_>]) -> bool {
    tokens.iter().rfind(|token| token.kind != Kind::Remark).is_some_and(|token| token.text == "}")
}

/// `TARGET`, `in ..`, `from ..`, `prior ..`; nothing where a line holds anything else.
fn identify_columns(tokens: &[Token<'_>], starts: &[usize]) -> Option<Columns> {
    let words = ["in", "from", "prior"];
    let joining = tokens.iter().zip(starts).filter(|(token, _)| token.kind == Kind::Joining);
    let found: Vec<(&str, usize)> = joining.map(|(token, start)| (token.text.as_str(), *start)).collect();
    let in_order = found.len() >= 2 && found.iter().zip(words).all(|((word, _), wanted)| *word == wanted);
    let plain = found.len() <= words.len() && !tokens.iter().any(|token| token.text == "{" || token.text == "}");
    let cuts = found.into_iter().map(|(_, start)| start).collect();
    (in_order && plain).then_some(Columns { sort: "identify".to_owned(), cuts })
}

pub(super) fn align(lines: &mut [Line]) {
    for_blocks(lines, same_columns, align_columns);
    for_blocks(
        lines,
        |previous, line| !previous.is_documentation && previous.remark.is_some() && line.remark.is_some(),
        |block| {
            let width = block.iter().map(|line| line.text.chars().count()).max().unwrap_or(0);
            for line in block {
                line.text = pad(&line.text, width);
            }
        },
    );
}

fn same_columns(previous: &Line, line: &Line) -> bool {
    let sort = |line: &Line| line.columns.as_ref().map(|columns| columns.sort.clone());
    line.is_documentation || previous.is_documentation || sort(line).is_some() && sort(line) == sort(previous)
}

/// Runs of neighbouring lines of one indentation.
fn for_blocks(lines: &mut [Line], joined: impl Fn(&Line, &Line) -> bool, treat: impl Fn(&mut [Line])) {
    let mut start = 0;
    while start < lines.len() {
        let mut end = start + 1;
        while end < lines.len()
            && !lines[end].blank_before
            && lines[end].indentation == lines[start].indentation
            && joined(&lines[end - 1], &lines[end])
        {
            end += 1;
        }
        if end - start > 1 {
            treat(&mut lines[start..end]);
        }
        start = end;
    }
}

/// Lines of documentation stand between the rows.
fn align_columns(block: &mut [Line]) {
    let mut sorts: Vec<String> = Vec::new();
    for columns in block.iter().filter_map(|line| line.columns.as_ref()) {
        if !sorts.contains(&columns.sort) {
            sorts.push(columns.sort.clone());
        }
    }
    for sort in sorts {
        let is_row = |line: &Line| line.columns.as_ref().is_some_and(|columns| columns.sort == sort);
        let rows: Vec<Vec<String>> = block.iter().filter(|line| is_row(line)).map(cells).collect();
        let most = rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |at: usize| rows.iter().filter_map(|row| row.get(at)).map(|cell| cell.chars().count()).max();
        let widths: Vec<usize> = (0..most).map(|at| width(at).unwrap_or(0)).collect();
        for (line, row) in block.iter_mut().filter(|line| is_row(line)).zip(&rows) {
            let cells = row.iter().zip(&widths).enumerate().map(|(at, (cell, width))| {
                let gap = if at > 1 && sort == "identify" {
                    "  "
                } else if at > 0 {
                    " "
                } else {
                    ""
                };
                format!("{gap}{}", pad(cell, *width))
            });
            line.text = cells.collect::<String>().trim_end().to_owned();
        }
    }
}

fn cells(line: &Line) -> Vec<String> {
    let cuts = line.columns.as_ref().map(|columns| columns.cuts.as_slice()).unwrap_or_default();
    let starts = std::iter::once(0).chain(cuts.iter().copied());
    let ends = cuts.iter().copied().chain(std::iter::once(line.text.len()));
    starts.zip(ends).map(|(start, end)| line.text[start..end].trim_end().to_owned()).collect()
}

fn pad(text: &str, width: usize) -> String {
    let missing = width.saturating_sub(text.chars().count());
    format!("{text}{}", " ".repeat(missing))
}
