//! Columns of a data file, and their values in SI.

use super::DataError;
use crate::diagnostics::{Code, similar_name};
use crate::quantities::{AngleContent, Unit};
use std::path::PathBuf;

/// A data file. All columns have the same length, [`Table::row_count`].
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub file: PathBuf,
    pub columns: Vec<Column>,
    /// Line in the file of every sample, counted from 1.
    pub lines: Vec<u64>,
}

/// A column as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub name: String,
    /// The unit in the head (or in the line below it), as written.
    pub unit: Option<String>,
    /// In that unit; NaN where the cell is no number.
    pub(super) values: Vec<f64>,
    pub(super) defect: Option<Defect>,
}

/// The first cell of a column that holds no finite number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Defect {
    pub line: u64,
    pub text: String,
    pub is_number: bool,
}

impl Table {
    /// Number of samples.
    pub fn row_count(&self) -> usize {
        self.lines.len()
    }

    /// The column called `name`, or whose whole head is `name` (`acc [g0]`).
    pub fn column(&self, name: &str) -> Result<&Column, DataError> {
        let wanted = name.trim();
        let by_head = |column: &&Column| match &column.unit {
            Some(unit) => without_blanks(wanted) == without_blanks(&format!("{}[{unit}]", column.name)),
            None => false,
        };
        // `ratio[1]` is a member of a family or, where nothing else has the name, a dimensionless quantity.
        let by_unit_one = |column: &&Column| column.unit.is_none() && column.name.strip_suffix("[1]") == Some(wanted);
        let find = |is_meant: &dyn Fn(&&Column) -> bool| self.columns.iter().find(is_meant);
        let by_name = |column: &&Column| column.name == wanted;
        find(&by_name).or_else(|| find(&by_head)).or_else(|| find(&by_unit_one)).ok_or_else(|| self.missing(wanted))
    }

    fn missing(&self, name: &str) -> DataError {
        let names: Vec<&str> = self.columns.iter().map(|column| column.name.as_str()).collect();
        let help = match similar_name(name, names.iter().copied()) {
            Some(similar) => {
                format!("did you mean `{similar}`? Otherwise bind it: `columns = {{ {name} = \"{similar}\" }}`")
            }
            None => format!("the file has: {}; bind one with `columns = {{ {name} = \"...\" }}`", names.join(", ")),
        };
        DataError::new(&Code::DATA_COLUMN_MISSING, &self.file, format!("there is no column `{name}`"), help)
            .at(None, Some(name))
    }

    /// All samples of a column in SI. `unit` is the unit of the quantity in the study; the file's own unit is
    /// converted.
    ///
    /// # Errors
    /// No such column; a cell that is no finite number; a unit that is unknown, missing or of another kind.
    pub fn values(&self, name: &str, unit: &Unit) -> Result<Vec<f64>, DataError> {
        let column = self.column(name)?;
        if let Some(defect) = &column.defect {
            return Err(self.defective(column, defect));
        }
        let own = self.unit_of(column, unit)?;
        Ok(column.values.iter().map(|&value| own.to_si(value)).collect())
    }

    fn defective(&self, column: &Column, defect: &Defect) -> DataError {
        let (code, explanation, help) = if defect.is_number {
            (
                &Code::DATA_NOT_FINITE,
                format!("the sample is `{}`", defect.text),
                "mend the record or cut it before this line; samples are never made up",
            )
        } else if defect.text.is_empty() {
            (
                &Code::DATA_NOT_A_NUMBER,
                "the cell is empty".to_owned(),
                "mend the record or cut it before this line; samples are never made up",
            )
        } else {
            (
                &Code::DATA_NOT_A_NUMBER,
                format!("`{}` is not a number", defect.text),
                "write numbers as 1.5 or 1.5e-3 (1,5 where semicolons separate the columns), without thousands separators or units",
            )
        };
        DataError::new(code, &self.file, explanation, help).at(Some(defect.line), Some(&column.name))
    }

    fn unit_of(&self, column: &Column, wanted: &Unit) -> Result<Unit, DataError> {
        let error = |explanation: String, help: String| {
            DataError::new(&Code::DATA_UNIT, &self.file, explanation, help).at(Some(1), Some(&column.name))
        };
        let Some(text) = &column.unit else {
            if wanted.dimension.is_one() {
                return Ok(Unit::dimensionless());
            }
            return Err(error(
                format!("the column has no unit; the study expects `{}`", wanted.symbol),
                format!("write the head as `{} [{}]`, with the unit the file is in", column.name, wanted.symbol),
            ));
        };
        let own = Unit::parse(text).map_err(|reason| {
            let help = reason.help().unwrap_or_else(|| format!("the study expects a unit like `{}`", wanted.symbol));
            error(format!("the unit `{text}` of the column cannot be read: {reason}"), help)
        })?;
        if own.dimension != wanted.dimension {
            return Err(error(
                format!("the column is in `{text}`, the study expects a unit like `{}`", wanted.symbol),
                "mend the head of the column, or bind the right column in the experiment's `columns`".to_owned(),
            ));
        }
        let contents = (own.angle_content(), wanted.angle_content());
        if matches!(contents, (AngleContent::Cycles, AngleContent::Angle) | (AngleContent::Angle, AngleContent::Cycles))
        {
            return Err(error(
                format!("the column is in `{text}`, the study expects `{}`", wanted.symbol),
                "1 Hz = 6.283 rad/s: use the same kind of unit in both places".to_owned(),
            ));
        }
        Ok(own)
    }

    /// Refuses a column whose samples in `rows` are all equal: there is nothing to compare.
    pub fn require_variation(&self, name: &str, rows: std::ops::Range<usize>) -> Result<(), DataError> {
        let column = self.column(name)?;
        let first_line = self.lines.get(rows.start).copied();
        let samples = column.values.get(rows).unwrap_or(&[]);
        if samples.windows(2).any(|pair| pair[0] != pair[1]) {
            return Ok(());
        }
        let value = samples.first().copied().unwrap_or(f64::NAN);
        Err(DataError::new(
            &Code::DATA_CONSTANT,
            &self.file,
            format!("the channel is {value} in all {} samples compared", samples.len()),
            "check the sensor and the column, or choose a window in which something happens",
        )
        .at(first_line, Some(&column.name)))
    }
}

fn without_blanks(text: &str) -> String {
    text.chars().filter(|sign| !sign.is_whitespace()).collect()
}
