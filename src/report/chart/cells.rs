//! Small pictures for the cells of tables: bars, whiskers, spectra.

use super::{Axis, Style, escape, pixel};
use crate::report::number;

/// One bar of a group.
#[derive(Clone, Debug)]
pub struct Bar {
    pub value: f64,
    pub style: Style,
}

/// Horizontal bars on a common scale from 0 to `full`, one under the other; longer ones are cut at the end.
pub fn bars(values: &[Bar], full: f64, width: f64) -> String {
    const THICKNESS: f64 = 8.0;
    const GAP: f64 = 2.0;
    let height = values.len() as f64 * (THICKNESS + GAP);
    let mut svg = open(width, height);
    for (index, bar) in values.iter().enumerate() {
        let share = if bar.value.is_finite() && full > 0.0 { (bar.value / full).clamp(0.0, 1.0) } else { 0.0 };
        svg.push_str(&format!(
            "<rect class=\"track\" x=\"0\" y=\"{y}\" width=\"{full_width}\" height=\"{THICKNESS}\"/>\
             <rect class=\"bar {class}\" x=\"0\" y=\"{y}\" width=\"{length}\" height=\"{THICKNESS}\"/>",
            y = pixel(index as f64 * (THICKNESS + GAP) + GAP / 2.0),
            full_width = pixel(width),
            class = bar.style.class(),
            length = pixel(share * width),
        ));
    }
    svg + "</svg>"
}

/// A value with its interval on a common scale.
#[derive(Clone, Debug)]
pub struct Whisker {
    pub value: f64,
    pub interval: Option<(f64, f64)>,
    pub style: Style,
}

/// Values with intervals between `lower` and `upper`, one under the other; `reference` is marked by a tick.
///
/// What lies outside is drawn at the end, as an arrow head.
pub fn whisker(values: &[Whisker], lower: f64, upper: f64, reference: Option<f64>, width: f64) -> String {
    const ROW: f64 = 10.0;
    const MARGIN: f64 = 6.0;
    let height = values.len().max(1) as f64 * ROW + 2.0;
    let axis = Axis::over(lower, upper, 2);
    let place = |value: f64| axis.place(value, MARGIN, width - MARGIN).clamp(MARGIN, width - MARGIN);
    let mut svg = open(width, height);
    let (bottom, last) = (pixel(height), pixel(width - MARGIN));
    svg.push_str(&format!(
        "<path class=\"bounds\" d=\"M{MARGIN} 0V{bottom}M{last} 0V{bottom}M{MARGIN} {0}H{last}\"/>",
        pixel(height / 2.0)
    ));
    if let Some(reference) = reference.filter(|value| value.is_finite()) {
        svg.push_str(&format!("<path class=\"reference\" d=\"M{} 0V{bottom}\"/>", pixel(place(reference))));
    }
    for (index, row) in values.iter().enumerate().filter(|(_, row)| row.value.is_finite()) {
        let middle = index as f64 * ROW + ROW / 2.0 + 1.0;
        let class = row.style.class();
        if let Some((low, high)) = row.interval.filter(|(low, high)| low.is_finite() && high.is_finite()) {
            svg.push_str(&format!(
                "<path class=\"whisker {class}\" d=\"M{} {m}H{}\"/>",
                pixel(place(low)),
                pixel(place(high)),
                m = pixel(middle)
            ));
            svg.push_str(&arrow_heads(low < axis.lower, high > axis.upper, middle, MARGIN, width - MARGIN, class));
        }
        svg.push_str(&format!(
            "<circle class=\"dot {class}\" cx=\"{}\" cy=\"{}\" r=\"3\"/>",
            pixel(place(row.value)),
            pixel(middle)
        ));
    }
    svg + "</svg>"
}

fn arrow_heads(left: bool, right: bool, middle: f64, first: f64, last: f64, class: &str) -> String {
    let mut text = String::new();
    if left {
        text.push_str(&format!("<path class=\"head {class}\" d=\"M0 {}l{first} -4v8z\"/>", pixel(middle)));
    }
    if right {
        let end = pixel(last + first);
        text.push_str(&format!("<path class=\"head {class}\" d=\"M{end} {}l-{first} -4v8z\"/>", pixel(middle)));
    }
    text
}

/// Shares (0..1) per frequency band as columns with their edges beneath.
pub fn spectrum_bars(bands: &[(f64, f64, f64)], width: f64) -> String {
    const HEIGHT: f64 = 44.0;
    let mut svg = open(width, HEIGHT + 16.0);
    let step = width / bands.len().max(1) as f64;
    let largest = bands.iter().map(|band| band.2).filter(|share| share.is_finite()).fold(0.0, f64::max).max(1e-12);
    for (index, (from, to, share)) in bands.iter().enumerate() {
        let height = if share.is_finite() { (share / largest).clamp(0.0, 1.0) * HEIGHT } else { 0.0 };
        let title = escape(&format!(
            "{} to {} Hz: {} of the residual's power",
            number::short(*from, 3),
            number::short(*to, 3),
            number::percent(100.0 * share)
        ));
        svg.push_str(&format!(
            "<rect class=\"bar before\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"><title>{title}</title></rect>",
            pixel(index as f64 * step + 1.0),
            pixel(HEIGHT - height),
            pixel(step - 2.0),
            pixel(height)
        ));
    }
    svg.push_str(&format!("<path class=\"frame\" d=\"M0 {HEIGHT}H{}\"/>", pixel(width)));
    // Every edge where there is room, else every second, third, ...
    let stride = (34.0 / step).ceil().max(1.0) as usize;
    let edges = bands.iter().map(|band| band.0).chain(bands.last().map(|band| band.1));
    for (index, edge) in edges.enumerate().filter(|(index, _)| index % stride == 0) {
        let at = index as f64 * step;
        let anchor = if index == 0 {
            "start"
        } else if index == bands.len() {
            "end"
        } else {
            "middle"
        };
        svg.push_str(&format!(
            "<text class=\"small\" x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\">{}</text>",
            pixel(at),
            HEIGHT + 12.0,
            number::short(edge, 3)
        ));
    }
    svg + "</svg>"
}

fn open(width: f64, height: f64) -> String {
    let (width, height) = (pixel(width), pixel(height));
    format!(
        "<svg class=\"cell\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" aria-hidden=\"true\">"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_cut_at_full_scale_and_survive_non_finite_values() {
        let svg = bars(
            &[
                Bar { value: 3.0, style: Style::Before },
                Bar { value: 0.5, style: Style::After },
                Bar { value: f64::NAN, style: Style::After },
            ],
            1.0,
            100.0,
        );
        assert!(svg.contains("class=\"bar before\" x=\"0\" y=\"1\" width=\"100\""));
        assert!(svg.contains("class=\"bar after\" x=\"0\" y=\"11\" width=\"50\""));
        assert!(svg.contains("class=\"bar after\" x=\"0\" y=\"21\" width=\"0\""));
    }

    #[test]
    fn an_interval_beyond_the_bounds_ends_in_an_arrow() {
        let row = Whisker { value: 9.0, interval: Some((8.0, 12.0)), style: Style::After };
        let svg = whisker(&[row], 0.0, 10.0, None, 112.0);
        assert_eq!(svg.matches("class=\"head").count(), 1);
        assert!(svg.contains("d=\"M86 6H106\""), "{svg}");
    }
}
