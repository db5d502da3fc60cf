//! Measured and simulated histories: static pictures, and compact data for the zoomable ones.

use crate::identify::{ChannelFit, Identification, RecordFit};
use crate::report::chart::{Axis, Mark, Plot, Style, envelope};
use crate::report::{number, words};
use base64::{Engine, engine::general_purpose::STANDARD};
use serde::Serialize;

/// A fit whose simulations are drawn, under this name and colour.
#[derive(Clone)]
pub struct Curve<'a> {
    pub name: String,
    pub style: Style,
    pub fit: &'a Identification,
}

/// Values (2 bytes each) that a page carries at most; beyond that curves are thinned, peaks kept.
const VALUE_BUDGET: usize = 600_000;
/// Records beyond this number are folded away at first.
const OPEN_RECORDS: usize = 4;
const WIDTH: f64 = 1100.0;
/// Longer channel titles would not fit beside the picture.
const TITLE_ROOM: usize = 26;

#[derive(Serialize)]
pub struct RecordView {
    pub heading: String,
    pub file: String,
    pub open: bool,
    /// What was left out of the data, if anything.
    pub thinned: Option<String>,
    pub channels: Vec<ChannelView>,
}

#[derive(Serialize)]
pub struct ChannelView {
    /// Where the script puts its charts.
    pub id: String,
    pub heading: String,
    /// Key figures per curve.
    pub figures: Vec<String>,
    pub main_svg: String,
    pub residual_svg: String,
}

/// Static pictures of all records of the first curve's fit, beside the simulations of all curves.
pub fn views(curves: &[Curve]) -> Vec<RecordView> {
    let Some(first) = curves.first() else { return Vec::new() };
    let size = bucket(curves);
    let view = |(index, record): (usize, &RecordFit)| RecordView {
        heading: format!("{}, {}", record.experiment, words::role(&record.role)),
        file: record.file.clone(),
        open: index < OPEN_RECORDS,
        thinned: (size > 1)
            .then(|| format!("drawn from the minimum and maximum of every {size} samples, so that peaks are kept")),
        channels: (0..record.channels.len()).map(|channel| channel_view(curves, index, record, channel)).collect(),
    };
    first.fit.records.iter().enumerate().map(view).collect()
}

fn channel_view(curves: &[Curve], record_index: usize, record: &RecordFit, index: usize) -> ChannelView {
    let channel = &record.channels[index];
    let x_axis = Axis::around(&record.time, 0.0, (WIDTH / 70.0) as usize);
    let plot = |marks, y_label, x_label: &str, height, legend| {
        let x_label = x_label.to_string();
        Plot { width: WIDTH, height, x_label, y_label, marks, legend, x_axis: x_axis.clone(), y_axis: None }.svg()
    };
    let time = || std::borrow::Cow::from(record.time.as_slice());
    let mut main =
        vec![Mark::Line { x: time(), y: channel.measured.as_slice().into(), style: Style::Measured, name: "measured" }];
    let mut strip = Vec::new();
    let mut figures = Vec::new();
    for (curve, fitted) in fitted(curves, record, index) {
        main.push(Mark::Line {
            x: time(),
            y: fitted.simulated.as_slice().into(),
            style: curve.style,
            name: &curve.name,
        });
        strip.push(Mark::Line { x: time(), y: residual(fitted).into(), style: curve.style, name: "" });
        figures.push(format!(
            "{}: residual {} {} rms, {} of the signal",
            curve.name,
            number::significant(fitted.residual_rms, 3),
            fitted.unit,
            number::percent(fitted.relative_error)
        ));
    }
    ChannelView {
        id: format!("history-{record_index}-{index}"),
        heading: if channel.title.is_empty() {
            channel.name.clone()
        } else {
            format!("{}: {}", channel.name, channel.title)
        },
        figures,
        main_svg: plot(main, label(channel), "", 220.0, true),
        residual_svg: plot(strip, format!("residual [{}]", channel.unit), "time [s]", 140.0, false),
    }
}

fn label(channel: &ChannelFit) -> String {
    let short = !channel.title.is_empty() && channel.title.chars().count() <= TITLE_ROOM;
    format!("{} [{}]", if short { &channel.title } else { &channel.name }, channel.unit)
}

/// The curves that have this channel of this record.
fn fitted<'a>(curves: &'a [Curve], record: &RecordFit, channel: usize) -> Vec<(&'a Curve<'a>, &'a ChannelFit)> {
    let of_curve = |curve: &'a Curve<'a>| Some((curve, words::counterpart(record, curve.fit)?.channels.get(channel)?));
    curves.iter().filter_map(of_curve).collect()
}

fn residual(channel: &ChannelFit) -> Vec<f64> {
    channel.measured.iter().zip(&channel.simulated).map(|(measured, simulated)| measured - simulated).collect()
}

/// Samples per bucket of the embedded data; 1 where everything fits.
fn bucket(curves: &[Curve]) -> usize {
    let Some(first) = curves.first() else { return 1 };
    let samples: usize = first.fit.records.iter().map(|record| record.time.len() * record.channels.len()).sum();
    let values = samples * (1 + 2 * curves.len());
    // Two values stay per bucket; an even size keeps their instants uniform.
    if values <= VALUE_BUDGET { 1 } else { 2 * values.div_ceil(VALUE_BUDGET) }
}

#[derive(Serialize)]
struct RecordData {
    time: TimeData,
    channels: Vec<ChannelData>,
}

#[derive(Serialize)]
struct ChannelData {
    id: String,
    label: String,
    unit: String,
    curves: Vec<SeriesData>,
    residuals: Vec<SeriesData>,
}

#[derive(Serialize)]
struct SeriesData {
    name: String,
    class: &'static str,
    /// `value = offset + scale * integer`, integers of 16 bits (little endian, base64), -32768 for a gap.
    offset: f64,
    scale: f64,
    data: String,
}

#[derive(Serialize)]
#[serde(untagged)]
enum TimeData {
    Uniform { start: f64, step: f64, count: usize },
    Listed { values: Vec<f64> },
}

/// JSON text with all histories for the page's script.
pub fn data(curves: &[Curve]) -> String {
    let size = bucket(curves);
    let records: Vec<RecordData> = curves.first().map_or(Vec::new(), |first| {
        first.fit.records.iter().enumerate().map(|(index, record)| record_data(curves, index, record, size)).collect()
    });
    // Only strings and numbers: serialisation cannot fail; an empty list leaves the static pictures.
    serde_json::to_string(&records).unwrap_or_else(|_| "[]".into())
}

fn record_data(curves: &[Curve], record_index: usize, record: &RecordFit, size: usize) -> RecordData {
    let channel_data = |(index, channel): (usize, &ChannelFit)| {
        let series = |name: &str, style: Style, values: &[f64]| encoded(name, style, &envelope(values, size));
        let mut shown = vec![series("measured", Style::Measured, &channel.measured)];
        let mut residuals = Vec::new();
        for (curve, fitted) in fitted(curves, record, index) {
            shown.push(series(&curve.name, curve.style, &fitted.simulated));
            residuals.push(series(&curve.name, curve.style, &residual(fitted)));
        }
        ChannelData {
            id: format!("history-{record_index}-{index}"),
            label: label(channel),
            unit: channel.unit.clone(),
            curves: shown,
            residuals,
        }
    };
    RecordData {
        time: time_data(&record.time, size),
        channels: record.channels.iter().enumerate().map(channel_data).collect(),
    }
}

/// Instants of the values that [`envelope`] keeps: the first and the middle one of each bucket.
fn time_data(time: &[f64], size: usize) -> TimeData {
    let (Some(start), Some(end)) = (time.first(), time.last()) else { return TimeData::Listed { values: vec![] } };
    let step = (end - start) / (time.len() - 1).max(1) as f64;
    let even = time.iter().enumerate().all(|(index, t)| (t - start - step * index as f64).abs() <= 1e-3 * step);
    match (even, size) {
        (true, 0..3) => TimeData::Uniform { start: *start, step, count: time.len() },
        (true, size) => {
            let step = step * size as f64 / 2.0;
            TimeData::Uniform { start: *start, step, count: 2 * time.len().div_ceil(size) }
        }
        (false, 0..3) => TimeData::Listed { values: time.iter().copied().map(microseconds).collect() },
        (false, size) => {
            let ends = time.chunks(size).flat_map(|chunk| [chunk[0], chunk[chunk.len() / 2]]);
            TimeData::Listed { values: ends.map(microseconds).collect() }
        }
    }
}

fn microseconds(instant: f64) -> f64 {
    (instant * 1e6).round() * 1e-6
}

fn encoded(name: &str, style: Style, values: &[f64]) -> SeriesData {
    const GAP: i16 = i16::MIN;
    const REACH: f64 = 32_767.0;
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let (offset, scale) = if low <= high { (0.5 * (low + high), (high - low) / (2.0 * REACH)) } else { (0.0, 0.0) };
    let integer = |value: f64| match (value.is_finite(), scale > 0.0) {
        (false, _) => GAP,
        (true, false) => 0,
        (true, true) => ((value - offset) / scale).round().clamp(-REACH, REACH) as i16,
    };
    let bytes: Vec<u8> = values.iter().flat_map(|value| integer(*value).to_le_bytes()).collect();
    SeriesData { name: name.into(), class: style.class(), offset, scale, data: STANDARD.encode(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive_the_coding_to_a_part_in_sixty_thousand() {
        let values = vec![-3.0, f64::NAN, 17.0, 4.321];
        let series = encoded("", Style::After, &values);
        let bytes = STANDARD.decode(&series.data).unwrap();
        let decode = |pair: &[u8]| i16::from_le_bytes([pair[0], pair[1]]);
        let integers: Vec<i16> = bytes.chunks(2).map(decode).collect();
        assert_eq!(integers[1], i16::MIN);
        for index in [0, 2, 3] {
            let value = series.offset + series.scale * f64::from(integers[index]);
            assert!((value - values[index]).abs() <= 20.0 / 60_000.0, "{value}");
        }
    }

    #[test]
    fn uniform_time_is_three_numbers() {
        let time: Vec<f64> = (0..1000).map(|index| 1.0 + index as f64 * 1e-3).collect();
        assert!(matches!(time_data(&time, 1), TimeData::Uniform { count: 1000, .. }));
        assert!(matches!(time_data(&[0.0, 1.0, 5.0], 1), TimeData::Listed { .. }));
        let TimeData::Uniform { step, count, .. } = time_data(&time, 10) else {
            panic!("thinned instants are uniform")
        };
        assert_eq!(count, envelope(&time, 10).len());
        assert!((step - 5e-3).abs() < 1e-12);
    }
}
