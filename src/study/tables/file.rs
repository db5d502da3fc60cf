//! Points of a table from a file.

use super::Points;
use crate::diagnostics::{Code, Diagnostic};
use crate::quantities::Unit;
use crate::syntax::Name;

/// The points in SI units with the dimensions of the two columns.
pub(super) fn read(path: &Name, text: &str) -> Result<Points, Diagnostic> {
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
    let mut units: Option<[Unit; 2]> = None;
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|cause| fail(format!("a line cannot be taken apart: {cause}"), None))?;
        let line = record.position().map(csv::Position::line);
        let [first, second] = [record.get(0), record.get(1)].map(Option::unwrap_or_default);
        if record.len() != 2 {
            return Err(fail(format!("a line has {} cells instead of two", record.len()), line));
        }
        match &units {
            None => units = Some(read_head([first, second]).map_err(|cause| fail(cause, line))?),
            Some(units) => {
                let number = |text: &str| text.replace(',', ".").parse::<f64>().ok().filter(|value| value.is_finite());
                let (Some(x), Some(y)) = (number(first), number(second)) else {
                    return Err(fail(format!("`{first}`, `{second}` are not two numbers"), line));
                };
                points.push((units[0].to_si(x), units[1].to_si(y)));
            }
        }
    }
    let Some(units) = units else { return Err(fail("the file is empty".to_owned(), None)) };
    Ok((points, units.map(|unit| unit.dimension)))
}

/// `name [unit]` twice.
fn read_head(cells: [&str; 2]) -> Result<[Unit; 2], String> {
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
    <[Unit; 2]>::try_from(units).map_err(|_| "the head needs two columns".to_owned())
}
