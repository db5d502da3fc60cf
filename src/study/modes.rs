//! The file of modes of an elastic body.
//!
//! CSV with one line per mode. Its head names the columns with their units: `frequency [Hz]`, perhaps `damping [1]` and
//! `modal_mass [kg]` (1 kg), `participation_x [kg]` .. `_z`, `moment_x [kg*m]` .. `_z`, and per frame `tip.shift_x` ..
//! `_z`,
//! `tip.turn_x [rad/m]` .. `_z`.

use super::elastic::ModeShape;
use crate::diagnostics::{Code, Diagnostic};
use crate::quantities::{Dimension, Unit};
use crate::syntax::Name;

/// What a file says, in SI units.
#[derive(Debug)]
pub(super) struct ModeFile {
    pub modes: Vec<FileMode>,
    /// Per frame the shapes of all modes.
    pub frames: Vec<(String, Vec<ModeShape>)>,
}

#[derive(Debug)]
pub(super) struct FileMode {
    /// Hz
    pub frequency: f64,
    pub damping: Option<f64>,
    pub participation: [f64; 3],
    pub moment: [f64; 3],
}

/// Modal masses may differ from 1 kg by rounding.
const UNIT_MASS: f64 = 1e-3;
const MOST_MODES: usize = 200;

struct Column {
    name: String,
    unit: Unit,
}

/// # Errors
/// Whatever makes the file no list of modes, with its line.
pub(super) fn read(path: &Name, text: &str) -> Result<ModeFile, Diagnostic> {
    let fail = |message: String, line: Option<u64>| {
        Diagnostic::error(Code::MODE_FILE, message).label(path.span, "this file").data(&path.text, line, None)
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut columns: Vec<Column> = Vec::new();
    let mut rows: Vec<(Option<u64>, Vec<f64>)> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|cause| fail(format!("a line cannot be taken apart: {cause}"), None))?;
        let line = record.position().map(csv::Position::line);
        if columns.is_empty() {
            columns = record.iter().map(column).collect::<Result<_, _>>().map_err(|cause| fail(cause, line))?;
            continue;
        }
        if record.len() != columns.len() {
            let message = format!("a line has {} cells, the head {}", record.len(), columns.len());
            return Err(fail(message, line));
        }
        let number = |(cell, column): (&str, &Column)| {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            value.map(|value| column.unit.to_si(value)).ok_or_else(|| format!("`{cell}` is not a number"))
        };
        let row = record.iter().zip(&columns).map(number).collect::<Result<_, _>>().map_err(|m| fail(m, line))?;
        rows.push((line, row));
        if rows.len() > MOST_MODES {
            return Err(fail(format!("more than {MOST_MODES} modes"), line));
        }
    }
    if rows.is_empty() {
        return Err(fail("the file holds no modes".to_owned(), None));
    }
    let table = Table { columns, rows };
    table.check_head().map_err(|message| fail(message, Some(1)))?;
    table.modes().map_err(|(message, line)| fail(message, line))
}

/// `name [unit]`
fn column(cell: &str) -> Result<Column, String> {
    let (name, unit) = match cell.rsplit_once('[').and_then(|(name, rest)| Some((name, rest.strip_suffix(']')?))) {
        None => (cell, None),
        Some((name, unit)) => (name, Some(unit.trim())),
    };
    let unit = match unit {
        None | Some("" | "-" | "1") => Unit::dimensionless(),
        Some(unit) => Unit::parse(unit).map_err(|cause| cause.to_string())?,
    };
    Ok(Column { name: name.trim().to_owned(), unit })
}

struct Table {
    columns: Vec<Column>,
    rows: Vec<(Option<u64>, Vec<f64>)>,
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Table {
    fn find(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// Every column is known, once, and has the right dimension.
    fn check_head(&self) -> Result<(), String> {
        for (at, column) in self.columns.iter().enumerate() {
            let name = column.name.as_str();
            let dimension = match (name, name.rsplit_once('.')) {
                ("mode" | "damping", _) => Dimension::ONE,
                ("frequency", _) => Dimension::FREQUENCY,
                ("modal_mass", _) => Dimension::MASS,
                (_, Some((_, part))) if stem(part) == Some("shift") => Dimension::ONE,
                (_, Some((_, part))) if stem(part) == Some("turn") => Dimension::ONE / Dimension::LENGTH,
                _ if stem(name) == Some("participation") => Dimension::MASS,
                _ if stem(name) == Some("moment") => Dimension::MASS * Dimension::LENGTH,
                _ => {
                    return Err(format!(
                        "column `{name}` is not known; there are mode, frequency, damping, modal_mass, participation_x, \
                         moment_x, POINT.shift_x, POINT.turn_x"
                    ));
                }
            };
            if column.unit.dimension != dimension {
                return Err(format!(
                    "column `{name}` is {dimension}, its unit in the head is {}",
                    column.unit.dimension
                ));
            }
            if name == "frequency" && column.unit.symbol.contains("rad") {
                return Err("frequencies are in Hz; 1 Hz = 6.283 rad/s".to_owned());
            }
            if self.columns[..at].iter().any(|other| other.name == name) {
                return Err(format!("column `{name}` is there twice"));
            }
        }
        Ok(())
    }

    fn three(&self, stem: &str) -> Result<[usize; 3], String> {
        let mut found = [0; 3];
        for (slot, axis) in found.iter_mut().zip(AXES) {
            let name = format!("{stem}_{axis}");
            *slot = self.find(&name).ok_or_else(|| format!("column `{name}` is missing"))?;
        }
        Ok(found)
    }

    fn modes(&self) -> Result<ModeFile, (String, Option<u64>)> {
        let head = |message: String| (message, Some(1));
        let frequency = self.find("frequency").ok_or_else(|| head("column `frequency [Hz]` is missing".to_owned()))?;
        let (damping, mass, number) = (self.find("damping"), self.find("modal_mass"), self.find("mode"));
        let participation = self.three("participation").map_err(head)?;
        let moment = self.three("moment").map_err(head)?;
        let mut modes = Vec::new();
        for (at, (line, row)) in self.rows.iter().enumerate() {
            if row[frequency] <= 0.0 {
                let message = "a frequency is not positive; rigid motions are the joints\' business".to_owned();
                return Err((message, *line));
            }
            if damping.is_some_and(|column| row[column] < 0.0) {
                return Err(("a damping ratio is negative".to_owned(), *line));
            }
            if let Some(column) = number.filter(|&column| row[column] != (at + 1) as f64) {
                return Err((format!("mode {} stands where mode {} is expected", row[column], at + 1), *line));
            }
            if let Some(column) = mass.filter(|&column| (row[column] - 1.0).abs() > UNIT_MASS) {
                let message = format!(
                    "the mode has a modal mass of {} kg instead of 1 kg: divide its shapes by {}",
                    row[column],
                    row[column].sqrt()
                );
                return Err((message, *line));
            }
            let three = |columns: [usize; 3]| columns.map(|column| row[column]);
            modes.push(FileMode {
                frequency: row[frequency],
                damping: damping.map(|column| row[column]),
                participation: three(participation),
                moment: three(moment),
            });
        }
        let mut frames: Vec<(String, Vec<ModeShape>)> = Vec::new();
        for (point, _) in self.columns.iter().filter_map(|column| column.name.rsplit_once('.')) {
            if frames.iter().any(|(name, _)| name == point) {
                continue;
            }
            let shift = self.three(&format!("{point}.shift")).map_err(head)?;
            let turn = self.three(&format!("{point}.turn")).map_err(head)?;
            let shape = |(_, row): &(Option<u64>, Vec<f64>)| ModeShape {
                shift: shift.map(|column| row[column]),
                turn: turn.map(|column| row[column]),
            };
            frames.push((point.to_owned(), self.rows.iter().map(shape).collect()));
        }
        Ok(ModeFile { modes, frames })
    }
}

/// `shift` of `shift_x`.
fn stem(name: &str) -> Option<&str> {
    let (stem, axis) = name.rsplit_once('_')?;
    AXES.contains(&axis).then_some(stem)
}
