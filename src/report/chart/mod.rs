//! Charts as SVG text: lines over time, clouds of points, bars, whiskers.
//!
//! *In*: slices of numbers with labels and units. *Out*: SVG markup whose colours come from classes, so that a page or
//! a stand-alone picture decides on them. *Must not happen here*: knowledge of studies and results.
//!
//! Non-finite values leave gaps; long curves are drawn by their minimum and maximum per pixel, so that peaks are kept.

mod axis;
mod cells;
mod decimate;
mod plot;

pub use axis::Axis;
pub use cells::{Bar, Whisker, bars, spectrum_bars, whisker};
pub use decimate::{envelope, median_by_bin};
pub use plot::{Mark, Plot, Style};

/// Text made safe for SVG and HTML.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

/// A coordinate with one decimal, short.
fn pixel(value: f64) -> String {
    let text = format!("{value:.1}");
    match text.strip_suffix(".0") {
        Some("-0") => "0".into(),
        Some(short) => short.into(),
        None => text,
    }
}
