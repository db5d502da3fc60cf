//! Bytes of a CSV file to a table.

use super::table::{Column, Defect, Table};
use super::{DataError, sampling};
use crate::diagnostics::Code;
use std::path::Path;

/// Reads a CSV file: one head line `name [unit]` per column, an optional line of units below it, then one line per
/// sample. Columns are separated by comma, semicolon or tab (the head decides); numbers have a decimal point, or a
/// decimal comma. UTF-8 (with or without byte order mark) or Latin-1. Lines starting with `#` are skipped.
///
/// Unreadable cells are reported when their column is asked for: a column of remarks does no harm.
///
/// # Errors
/// [`DataError`] with file and line when the file cannot be read, is empty, or is not rectangular.
pub fn read_table(path: &Path) -> Result<Table, DataError> {
    let bytes = std::fs::read(path).map_err(|error| unreadable(path, &error))?;
    let text = decode(path, &bytes)?;
    parse_table(path, &text)
}

fn unreadable(path: &Path, error: &std::io::Error) -> DataError {
    let missing = error.kind() == std::io::ErrorKind::NotFound;
    let explanation = if missing {
        format!("there is no data file `{}`", path.display())
    } else {
        format!("the data file `{}` cannot be read: {error}", path.display())
    };
    DataError::new(
        &Code::DATA_FILE_UNREADABLE,
        path,
        explanation,
        "check the path in the experiment's `data = ...`; `--data DIR` names the folder that holds the data",
    )
}

fn decode(path: &Path, bytes: &[u8]) -> Result<String, DataError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") || bytes.contains(&0) {
        return Err(DataError::new(
            &Code::DATA_FILE_UNREADABLE,
            path,
            "the data file is not CSV text (UTF-16 or binary)",
            "export it as CSV in UTF-8",
        ));
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        // Every Latin-1 byte is the Unicode scalar of the same number.
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    })
}

fn parse_table(path: &Path, text: &str) -> Result<Table, DataError> {
    let delimiter = delimiter(text);
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let mut rows = reader.records();
    let head = match rows.next() {
        Some(record) => record.map_err(|error| malformed(path, &error))?,
        None => return Err(empty(path, "the data file is empty")),
    };
    let mut columns = read_head(path, &head)?;
    let mut lines = Vec::new();
    for (index, record) in rows.enumerate() {
        let record = record.map_err(|error| malformed(path, &error))?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != columns.len() {
            // A trailing separator at every line is a habit of some loggers.
            let trailing = record.len() == columns.len() + 1 && record.get(columns.len()) == Some("");
            if !trailing {
                return Err(ragged(path, line, record.len(), columns.len()));
            }
        }
        if index == 0 && take_units_row(&mut columns, &record) {
            continue;
        }
        for (column, cell) in columns.iter_mut().zip(record.iter()) {
            column.push(cell, line);
        }
        lines.push(line);
    }
    if lines.is_empty() {
        return Err(empty(path, "the data file has a head but no samples"));
    }
    Ok(Table { file: path.to_path_buf(), columns, lines })
}

/// Of the first line that is no comment: tab or semicolon where there is one, else comma.
fn delimiter(text: &str) -> u8 {
    let head = text.lines().find(|line| !line.starts_with('#') && !line.trim().is_empty()).unwrap_or("");
    if head.contains('\t') {
        b'\t'
    } else if head.contains(';') {
        b';'
    } else {
        b','
    }
}

fn read_head(path: &Path, head: &csv::StringRecord) -> Result<Vec<Column>, DataError> {
    let mut columns: Vec<Column> = Vec::new();
    let cells: Vec<&str> = head.iter().collect();
    let count = if cells.len() > 1 && cells.last() == Some(&"") { cells.len() - 1 } else { cells.len() };
    for cell in &cells[..count] {
        let (name, unit) = split_head(cell);
        if columns.iter().any(|column| column.name == name) {
            return Err(layout(path, format!("two columns are called `{name}`")).at(Some(1), Some(&name)));
        }
        columns.push(Column { name, unit, values: Vec::new(), defect: None });
    }
    if columns.iter().all(|column| sampling::parse_number(&column.name).is_some()) {
        return Err(
            layout(path, "the first line holds numbers instead of the names of the columns".into()).at(Some(1), None)
        );
    }
    Ok(columns)
}

/// `name [unit]`; whole numbers in brackets that follow the name without a blank are its index (`z[1] [mm]`).
fn split_head(cell: &str) -> (String, Option<String>) {
    if let Some(start) = cell.rfind('[')
        && let Some(end) = cell[start..].find(']')
        && cell[start + end + 1..].trim().is_empty()
        && !is_index(&cell[..start], &cell[start + 1..start + end])
    {
        let unit = cell[start + 1..start + end].trim();
        let unit = if unit.is_empty() || unit == "-" { "1" } else { unit };
        return (cell[..start].trim().to_owned(), Some(unit.to_owned()));
    }
    // Blanks within an index do not tell names apart.
    let mut name = cell.trim().to_owned();
    if name.contains('[') {
        name.retain(|sign| !sign.is_whitespace());
    }
    (name, None)
}

fn is_index(name: &str, inside: &str) -> bool {
    let number =
        |part: &str| !part.trim().is_empty() && part.trim().trim_start_matches('-').bytes().all(|b| b.is_ascii_digit());
    name.ends_with(|last: char| last.is_alphanumeric() || last == '_') && inside.split(',').all(number)
}

/// Units may stand in a line of their own below the names, where the names carry none.
fn take_units_row(columns: &mut [Column], record: &csv::StringRecord) -> bool {
    let without_units = columns.iter().all(|column| column.unit.is_none());
    let words = record.iter().take(columns.len()).all(|cell| sampling::parse_number(cell).is_none());
    if !(without_units && words && record.iter().any(|cell| !cell.is_empty())) {
        return false;
    }
    for (column, cell) in columns.iter_mut().zip(record.iter()) {
        let unit = cell.trim_start_matches('[').trim_end_matches(']').trim();
        let unit = if unit.is_empty() || unit == "-" { "1" } else { unit };
        column.unit = Some(unit.to_owned());
    }
    true
}

impl Column {
    fn push(&mut self, cell: &str, line: u64) {
        let value = sampling::parse_number(cell);
        if value.is_none_or(|number| !number.is_finite()) && self.defect.is_none() {
            self.defect = Some(Defect { line, text: cell.to_owned(), is_number: value.is_some() });
        }
        self.values.push(value.unwrap_or(f64::NAN));
    }
}

fn empty(path: &Path, explanation: &str) -> DataError {
    DataError::new(
        &Code::DATA_EMPTY,
        path,
        explanation,
        "the file needs a head line `t [s],name [unit],...` and one line of numbers per sample",
    )
}

fn malformed(path: &Path, error: &csv::Error) -> DataError {
    let line = error.position().map(csv::Position::line);
    layout(path, format!("the line cannot be taken apart: {error}")).at(line, None)
}

fn ragged(path: &Path, line: u64, found: usize, expected: usize) -> DataError {
    layout(path, format!("the line has {found} cells, the head has {expected} columns")).at(Some(line), None)
}

fn layout(path: &Path, explanation: String) -> DataError {
    DataError::new(
        &Code::DATA_LAYOUT,
        path,
        explanation,
        "check separators and decimal signs of this line; the file may have been cut while it was written",
    )
}
