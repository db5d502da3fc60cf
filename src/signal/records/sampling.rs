//! Sample times: order, equidistance, windows.

use super::{DataError, Table};
use crate::diagnostics::Code;
use crate::quantities::{Dimension, Unit};
use std::ops::Range;

/// Largest deviation of a time stamp from the equidistant grid, in steps. Loggers round and jitter; a lost sample
/// deviates by a whole step.
const STAMP_TOLERANCE: f64 = 0.05;

/// Equidistant sample times `start + k * step`, k = 0 .. count-1, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    pub start: f64,
    pub step: f64,
    pub count: usize,
    /// Largest deviation of a stamp from the grid, s.
    pub jitter: f64,
}

impl Sampling {
    /// Samples per second.
    pub fn rate(&self) -> f64 {
        1.0 / self.step
    }

    pub fn time(&self, index: usize) -> f64 {
        self.start + index as f64 * self.step
    }

    pub fn times(&self) -> Vec<f64> {
        (0..self.count).map(|index| self.time(index)).collect()
    }

    pub fn end(&self) -> f64 {
        self.time(self.count.saturating_sub(1))
    }

    /// Indices of the samples in `begin ..= end` (s), to a hundredth of a step.
    pub fn rows(&self, begin: f64, end: f64) -> Range<usize> {
        let slack = 0.01;
        let limit = |value: f64| value.clamp(0.0, self.count as f64) as usize;
        let first = limit(((begin - self.start) / self.step - slack).ceil());
        let last = limit(((end - self.start) / self.step + slack).floor() + 1.0);
        first..last.max(first)
    }
}

impl Table {
    /// The sampling of the table by its time column (unit of time in the head).
    ///
    /// # Errors
    /// Time that stands still or runs backward (first such line); samples that are not equidistant (worst place and
    /// how much); fewer than two samples; what [`Table::values`] reports.
    pub fn sampling(&self, time_column: &str) -> Result<Sampling, DataError> {
        let seconds = Unit { symbol: "s".to_owned(), ..Unit::coherent(Dimension::TIME) };
        let times = self.values(time_column, &seconds)?;
        let place = |code: &'static Code, row: usize, explanation: String, help: &str| {
            DataError::new(code, &self.file, explanation, help).at(self.lines.get(row).copied(), Some(time_column))
        };
        if times.len() < 2 {
            return Err(place(
                &Code::DATA_TOO_SHORT,
                0,
                "the record has one sample only".into(),
                "a record needs at least two",
            ));
        }
        if let Some(row) = (1..times.len()).find(|&row| times[row] <= times[row - 1]) {
            let (before, now) = (times[row - 1], times[row]);
            let explanation = if now == before {
                format!("the time {now} s is repeated")
            } else {
                format!("time runs backward, from {before} s to {now} s")
            };
            let help = "remove doubled lines; write records that were joined into one file as separate files";
            return Err(place(&Code::DATA_TIME_ORDER, row, explanation, help));
        }
        self.equidistant(&times, place)
    }

    fn equidistant(
        &self,
        times: &[f64],
        place: impl Fn(&'static Code, usize, String, &str) -> DataError,
    ) -> Result<Sampling, DataError> {
        let last = times.len() - 1;
        let step = (times[last] - times[0]) / last as f64;
        let deviation = |row: usize| (times[row] - times[0] - row as f64 * step).abs();
        let jitter = (0..=last).map(deviation).fold(0.0_f64, f64::max);
        if jitter <= STAMP_TOLERANCE * step {
            return Ok(Sampling { start: times[0], step, count: times.len(), jitter });
        }
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let unsorted = steps.clone();
        steps.sort_by(f64::total_cmp);
        let usual = steps[steps.len() / 2];
        let worst = (0..unsorted.len())
            .max_by(|&a, &b| (unsorted[a] - usual).abs().total_cmp(&(unsorted[b] - usual).abs()))
            .unwrap_or(0);
        let explanation = format!(
            "the samples are not equidistant: usually {} ms apart, {} ms from {} s to {} s",
            1e3 * usual,
            1e3 * unsorted[worst],
            times[worst],
            times[worst + 1]
        );
        let help = if unsorted[worst] > 1.5 * usual {
            "samples seem to be missing: cut the record at the gap, or resample it"
        } else {
            "resample the record to a fixed rate"
        };
        Err(place(&Code::DATA_NOT_UNIFORM, worst + 1, explanation, help))
    }

    /// Rows of the window (s; the whole record without one), at least `minimum` of them.
    pub fn window(
        &self,
        sampling: &Sampling,
        window: Option<(f64, f64)>,
        minimum: usize,
    ) -> Result<Range<usize>, DataError> {
        let rows = match window {
            Some((begin, end)) => sampling.rows(begin, end),
            None => 0..sampling.count,
        };
        if rows.len() >= minimum {
            return Ok(rows);
        }
        let explanation = match window {
            Some((begin, end)) => format!("the window {begin} s .. {end} s holds {} samples", rows.len()),
            None => format!("the record holds {} samples", rows.len()),
        };
        let help =
            format!("at least {minimum} are needed; the record runs from {} s to {} s", sampling.start, sampling.end());
        Err(DataError::new(&Code::DATA_TOO_SHORT, &self.file, explanation, help))
    }
}

/// A cell as number: decimal point, or decimal comma (never a thousands separator). `NaN` and `inf` are numbers here.
pub(super) fn parse_number(cell: &str) -> Option<f64> {
    let cell = cell.trim();
    if let Ok(value) = cell.parse::<f64>() {
        return Some(value);
    }
    let decimal_comma = cell.matches(',').count() == 1 && !cell.contains('.');
    decimal_comma.then(|| cell.replace(',', ".").parse().ok()).flatten()
}
