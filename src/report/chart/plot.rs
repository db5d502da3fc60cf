//! One diagram: frame, ticks, labels, legend, and marks inside.

use super::{Axis, envelope, escape, pixel};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;

/// What a mark stands for; becomes the class that carries its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    Measured,
    Before,
    After,
    /// Estimated points.
    Missing,
    /// Medians of the points.
    Median,
    /// One of several variants, by a cycle of [`Style::VARIANTS`] colours.
    Variant(usize),
    /// The same colours as a broad pale line, to lie beneath a thin one.
    Broad(usize),
}

impl Style {
    /// Number of colours for variants.
    pub const VARIANTS: usize = 6;

    pub fn class(self) -> &'static str {
        match self {
            Style::Measured => "measured",
            Style::Before => "before",
            Style::After => "after",
            Style::Missing => "missing",
            Style::Median => "median",
            Style::Variant(index) => {
                ["variant0", "variant1", "variant2", "variant3", "variant4", "variant5"][index % Style::VARIANTS]
            }
            Style::Broad(index) => [
                "broad variant0",
                "broad variant1",
                "broad variant2",
                "broad variant3",
                "broad variant4",
                "broad variant5",
            ][index % Style::VARIANTS],
        }
    }
}

/// Something drawn inside a plot; `x` and `y` have equal length.
#[derive(Clone, Debug)]
pub enum Mark<'a> {
    /// A curve over ascending `x`.
    Line { x: Cow<'a, [f64]>, y: Cow<'a, [f64]>, style: Style, name: &'a str },
    /// Points, darker where many lie on each other.
    Cloud { x: Cow<'a, [f64]>, y: Cow<'a, [f64]>, style: Style, name: &'a str },
    /// A few points as open circles.
    Circles { x: Cow<'a, [f64]>, y: Cow<'a, [f64]>, style: Style, name: &'a str },
}

impl Mark<'_> {
    fn data(&self) -> (&[f64], &[f64]) {
        match self {
            Mark::Line { x, y, .. } | Mark::Cloud { x, y, .. } | Mark::Circles { x, y, .. } => (x, y),
        }
    }

    fn name(&self) -> &str {
        match self {
            Mark::Line { name, .. } | Mark::Cloud { name, .. } | Mark::Circles { name, .. } => name,
        }
    }

    fn style(&self) -> Style {
        match self {
            Mark::Line { style, .. } | Mark::Cloud { style, .. } | Mark::Circles { style, .. } => *style,
        }
    }
}

/// A diagram of `width` by `height` pixels.
#[derive(Clone, Debug)]
pub struct Plot<'a> {
    pub width: f64,
    pub height: f64,
    /// Quantity and unit; empty for none (and less room below).
    pub x_label: String,
    pub y_label: String,
    pub marks: Vec<Mark<'a>>,
    pub legend: bool,
    /// Given axes, else they follow the data.
    pub x_axis: Option<Axis>,
    pub y_axis: Option<Axis>,
}

const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
/// Points within a square of this many pixels are drawn as one, darker.
const CLOUD_CELL: f64 = 2.0;
/// Pixels between ticks that keep their labels apart.
const TICK_SPACING: (f64, f64) = (75.0, 26.0);
/// Average advance of the 12 px type of legends; width of a key; room between entries.
const LEGEND: (f64, f64, f64) = (6.2, 22.0, 14.0);

struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: Axis,
    y: Axis,
}

impl Plot<'_> {
    /// The diagram as an `<svg>` element for use inside a page.
    pub fn svg(&self) -> String {
        let (width, height) = (pixel(self.width), pixel(self.height));
        let label = escape(&format!("{} over {}", self.y_label, self.x_label));
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{label}\">{}</svg>",
            self.group()
        )
    }

    /// The diagram as markup to be placed inside an `<svg>`.
    pub fn group(&self) -> String {
        let Some(frame) = self.frame() else {
            return format!(
                "<text class=\"note\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">no finite values to show</text>",
                pixel(self.width / 2.0),
                pixel(self.height / 2.0)
            );
        };
        let mut svg = String::new();
        self.draw_axes(&frame, &mut svg);
        for mark in &self.marks {
            match mark {
                Mark::Line { x, y, style, .. } => draw_line(&frame, x, y, *style, &mut svg),
                Mark::Cloud { x, y, style, .. } => draw_cloud(&frame, x, y, *style, &mut svg),
                Mark::Circles { x, y, style, .. } => draw_circles(&frame, x, y, *style, &mut svg),
            }
        }
        if self.legend {
            self.draw_legend(&frame, &mut svg);
        }
        svg
    }

    fn frame(&self) -> Option<Frame> {
        let (left, right) = (LEFT, self.width - RIGHT);
        let top = if self.legend { 28.0 } else { 8.0 };
        let bottom = self.height - if self.x_label.is_empty() { 22.0 } else { 40.0 };
        let ticks = |length: f64, spacing: f64| ((length / spacing) as usize).max(2);
        let x_values = self.marks.iter().flat_map(|mark| mark.data().0);
        let y_values = self.marks.iter().flat_map(|mark| mark.data().1);
        let margin = if self.marks.iter().any(|mark| matches!(mark, Mark::Cloud { .. })) { 0.03 } else { 0.0 };
        let x = match &self.x_axis {
            Some(axis) => axis.clone(),
            None => Axis::around(x_values, margin, ticks(right - left, TICK_SPACING.0))?,
        };
        let y = match &self.y_axis {
            Some(axis) => axis.clone(),
            None => Axis::around(y_values, 0.05, ticks(bottom - top, TICK_SPACING.1))?,
        };
        Some(Frame { left, right, top, bottom, x, y })
    }

    fn draw_axes(&self, frame: &Frame, svg: &mut String) {
        let Frame { left, right, top, bottom, x, y } = frame;
        for tick in &x.ticks {
            let at = pixel(x.place(*tick, *left, *right));
            let class = if *tick == 0.0 { "zero" } else { "grid" };
            push(svg, format_args!("<path class=\"{class}\" d=\"M{at} {}V{}\"/>", pixel(*top), pixel(*bottom)));
            push(
                svg,
                format_args!(
                    "<text x=\"{at}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                    pixel(bottom + 15.0),
                    x.label(*tick)
                ),
            );
        }
        for tick in &y.ticks {
            let at = y.place(*tick, *bottom, *top);
            let class = if *tick == 0.0 { "zero" } else { "grid" };
            push(
                svg,
                format_args!("<path class=\"{class}\" d=\"M{} {}H{}\"/>", pixel(*left), pixel(at), pixel(*right)),
            );
            push(
                svg,
                format_args!(
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                    pixel(left - 6.0),
                    pixel(at + 4.0),
                    y.label(*tick)
                ),
            );
        }
        push(
            svg,
            format_args!(
                "<path class=\"frame\" d=\"M{} {}V{}H{}\"/>",
                pixel(*left),
                pixel(*top),
                pixel(*bottom),
                pixel(*right)
            ),
        );
        self.draw_labels(frame, svg);
    }

    fn draw_labels(&self, frame: &Frame, svg: &mut String) {
        let middle = (frame.top + frame.bottom) / 2.0;
        push(
            svg,
            format_args!(
                "<text class=\"label\" transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                pixel(middle),
                escape(&self.y_label)
            ),
        );
        if !self.x_label.is_empty() {
            push(
                svg,
                format_args!(
                    "<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                    pixel((frame.left + frame.right) / 2.0),
                    pixel(frame.bottom + 33.0),
                    escape(&self.x_label)
                ),
            );
        }
    }

    fn draw_legend(&self, frame: &Frame, svg: &mut String) {
        let (advance, key, room) = LEGEND;
        let length = |mark: &Mark| key + advance * mark.name().chars().count() as f64 + room;
        let named = || self.marks.iter().filter(|mark| !mark.name().is_empty());
        // A long legend begins further left rather than being cut on the right.
        let total: f64 = named().map(length).sum();
        let mut at = (frame.left + 4.0).min(self.width - total).max(2.0);
        for mark in named() {
            let class = mark.style().class();
            match mark {
                Mark::Line { .. } => {
                    push(svg, format_args!("<path class=\"line key {class}\" d=\"M{} 14h18\"/>", pixel(at)))
                }
                Mark::Circles { .. } => push(
                    svg,
                    format_args!("<circle class=\"ring {class}\" cx=\"{}\" cy=\"14\" r=\"3\"/>", pixel(at + 9.0)),
                ),
                Mark::Cloud { .. } => push(
                    svg,
                    format_args!("<circle class=\"dot {class}\" cx=\"{}\" cy=\"14\" r=\"3.5\"/>", pixel(at + 9.0)),
                ),
            }
            push(svg, format_args!("<text x=\"{}\" y=\"18\">{}</text>", pixel(at + key), escape(mark.name())));
            at += length(mark);
        }
    }
}

fn push(svg: &mut String, text: std::fmt::Arguments) {
    // Writing into a String cannot fail.
    let _ = svg.write_fmt(text);
}

/// The path of a curve; gaps where values are not finite, minimum and maximum per pixel where it is dense.
fn draw_line(frame: &Frame, x: &[f64], y: &[f64], style: Style, svg: &mut String) {
    let columns = (frame.right - frame.left).max(1.0);
    let bucket = (x.len() as f64 / columns).floor() as usize;
    let path = if bucket >= 3 {
        let thinned_y = envelope(y, bucket);
        let thinned_x: Vec<f64> = x
            .chunks(bucket)
            .flat_map(|chunk| [chunk.first(), chunk.get(chunk.len() / 2)])
            .map(|value| value.copied().unwrap_or(f64::NAN))
            .collect();
        path_of(frame, &thinned_x, &thinned_y)
    } else {
        path_of(frame, x, y)
    };
    push(svg, format_args!("<path class=\"line {}\" d=\"{path}\"/>", style.class()));
}

/// Path data in relative steps of tenths of a pixel: short, and without accumulated rounding.
fn path_of(frame: &Frame, x: &[f64], y: &[f64]) -> String {
    let mut path = String::new();
    let mut last: Option<(i64, i64)> = None;
    let tenths = |value: f64| (10.0 * value).round() as i64;
    for (x, y) in x.iter().zip(y) {
        if !(x.is_finite() && y.is_finite()) {
            last = None;
            continue;
        }
        let across = tenths(frame.x.place(*x, frame.left, frame.right));
        let down = tenths(frame.y.place(*y, frame.bottom, frame.top).clamp(frame.top, frame.bottom));
        match last {
            None => push(&mut path, format_args!("M{} {}", tenth(across), tenth(down))),
            Some(from) => {
                let down_text = tenth(down - from.1);
                let gap = if down_text.starts_with('-') { "" } else { " " };
                push(&mut path, format_args!("l{}{gap}{down_text}", tenth(across - from.0)));
            }
        }
        last = Some((across, down));
    }
    path
}

/// A number of tenths in its shortest form: `-.5`, `12`, `3.1`.
fn tenth(tenths: i64) -> String {
    let sign = if tenths < 0 { "-" } else { "" };
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    match (whole, rest) {
        (whole, 0) => format!("{}{whole}", if whole == 0 { "" } else { sign }),
        (0, rest) => format!("{sign}.{rest}"),
        (whole, rest) => format!("{sign}{whole}.{rest}"),
    }
}

fn draw_circles(frame: &Frame, x: &[f64], y: &[f64], style: Style, svg: &mut String) {
    for (x, y) in x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()) {
        let across = pixel(frame.x.place(*x, frame.left, frame.right));
        let down = pixel(frame.y.place(*y, frame.bottom, frame.top).clamp(frame.top, frame.bottom));
        push(svg, format_args!("<circle class=\"ring {}\" cx=\"{across}\" cy=\"{down}\" r=\"2.6\"/>", style.class()));
    }
}

/// Points gathered in cells; the number in a cell decides how dark it is (classes `few` to `many`).
fn draw_cloud(frame: &Frame, x: &[f64], y: &[f64], style: Style, svg: &mut String) {
    let mut cells: BTreeMap<(i64, i64), usize> = BTreeMap::new();
    for (x, y) in x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()) {
        let column = (frame.x.place(*x, frame.left, frame.right) / CLOUD_CELL).round() as i64;
        let row = (frame.y.place(*y, frame.bottom, frame.top) / CLOUD_CELL).round() as i64;
        *cells.entry((column, row)).or_default() += 1;
    }
    let largest = cells.values().copied().max().unwrap_or(1) as f64;
    let mut paths: [String; 3] = Default::default();
    for ((column, row), number) in cells {
        // Thirds of the logarithmic range: sparse points stay visible beside dense ones.
        let level = if largest <= 1.0 { 2.0 } else { (3.0 * (number as f64).ln() / largest.ln()).min(2.0) };
        let (x, y) = (column as f64 * CLOUD_CELL, row as f64 * CLOUD_CELL);
        paths[level as usize].push_str(&format!("M{x} {y}h0"));
    }
    for (path, density) in paths.iter().zip(["few", "some", "many"]) {
        if !path.is_empty() {
            push(svg, format_args!("<path class=\"cloud {density} {}\" d=\"{path}\"/>", style.class()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot<'a>(marks: Vec<Mark<'a>>) -> Plot<'a> {
        Plot {
            width: 400.0,
            height: 200.0,
            x_label: "time [s]".into(),
            y_label: "force <F> [N]".into(),
            marks,
            legend: true,
            x_axis: None,
            y_axis: None,
        }
    }

    #[test]
    fn labels_are_escaped_and_a_gap_starts_a_new_stretch() {
        let x = vec![0.0, 1.0, 2.0, 3.0];
        let y = vec![0.0, 1.0, f64::NAN, 1.0];
        let svg = plot(vec![Mark::Line { x: x.into(), y: y.into(), style: Style::Before, name: "before" }]).svg();
        assert!(svg.contains("force &lt;F&gt; [N]"));
        let path = svg.split("class=\"line before\" d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!(path.matches('M').count(), 2);
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn long_curves_are_thinned_and_keep_their_peak() {
        let x: Vec<f64> = (0..50_000).map(|index| index as f64 * 1e-3).collect();
        let mut y = vec![0.0; 50_000];
        y[31_234] = 5.0;
        let svg = plot(vec![Mark::Line { x: x.into(), y: y.into(), style: Style::After, name: "" }]).svg();
        assert!(svg.len() < 20_000, "{} bytes", svg.len());
        // Between margins of 5 % of the range the 132 pixels of height leave 120 for the peak.
        let path = svg.split("class=\"line after\" d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert!(path.contains("-120l"), "the peak of 120 pixels is drawn: {path}");
    }

    #[test]
    fn nothing_finite_is_said_in_words() {
        let svg =
            plot(vec![Mark::Cloud { x: vec![f64::NAN].into(), y: vec![1.0].into(), style: Style::Missing, name: "" }])
                .svg();
        assert!(svg.contains("no finite values"));
    }
}
