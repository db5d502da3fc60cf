//! Points of a table from a file.

use super::Points;
use crate::diagnostics::{Code, Diagnostic};
use crate::quantities::Unit;
use crate::syntax::Name;

/// The points in SI units with the dimensions of the `count` columns.
pub(super) fn read(path: &Name, text: &str, count: usize) -> Result<Points, Diagnostic> {
    let fail = |message: String, line: Option<u64>| {
        Diagnostic::error(Code::TABLE_FILE, message).label(path.span, "this file").data(&path.text, line, None)
    };
    let delimiter = match text.lines().next().unwrap_or_default() {
        head if head.contains('\t') => b'\t',
        head if head.contains(';') => b';',
        _ => b',',
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let wanted = if count == 2 { "two" } else { "three" };
    let mut units: Option<Vec<Unit>> = None;
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|cause| fail(format!("a line cannot be taken apart: {cause}"), None))?;
        let line = record.position().map(csv::Position::line);
        if record.len() != count {
            return Err(fail(format!("a line has {} cells instead of {wanted}", record.len()), line));
        }
        match &units {
            None => units = Some(read_head(record.iter()).map_err(|cause| fail(cause, line))?),
            Some(units) => {
                let number = |text: &str| text.replace(',', ".").parse::<f64>().ok().filter(|value| value.is_finite());
                let numbers = record.iter().zip(units).map(|(cell, unit)| Some(unit.to_si(number(cell)?)));
                let Some(numbers) = numbers.collect::<Option<Vec<f64>>>() else {
                    let cells: Vec<String> = record.iter().map(|cell| format!("`{cell}`")).collect();
                    return Err(fail(format!("{} are not {wanted} numbers", cells.join(", ")), line));
                };
                points.push(numbers);
            }
        }
    }
    let Some(units) = units else { return Err(fail("the file is empty".to_owned(), None)) };
    Ok((points, units.into_iter().map(|unit| unit.dimension).collect()))
}

/// `name [unit]` per column.
fn read_head<'c>(cells: impl Iterator<Item = &'c str>) -> Result<Vec<Unit>, String> {
    let mut units = Vec::new();
    for cell in cells {
        if cell.replace(',', ".").parse::<f64>().is_ok() {
            return Err("the first line holds numbers instead of names with units".to_owned());
        }
        let unit = match cell.rsplit_once('[').and_then(|(_, rest)| rest.strip_suffix(']')) {
            None | Some("" | "-" | "1") => Ok(Unit::dimensionless()),
            Some(unit) => Unit::parse(unit.trim()),
        };
        units.push(unit.map_err(|cause| cause.to_string())?);
    }
    Ok(units)
}
