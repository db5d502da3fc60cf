//! Picture of a law: its load over elongation and rate, or its answer over time.

use crate::analyse::{Characteristic, Trace};
use crate::report::chart::{Mark, Plot, Style};
use crate::report::figure::framed;

const PANEL: (f64, f64) = (450.0, 320.0);
/// Room for the title and the numbers below it.
const TOP: f64 = 58.0;
/// Characters that fit into a line of the numbers.
const LINE: usize = 135;

/// A harmonic course gives the load over elongation and over rate; an answer gives value and motion over time.
pub fn characteristic(shown: &Characteristic) -> String {
    let time = Trace { name: "time".to_owned(), unit: "s".to_owned(), values: shown.time.clone() };
    let panels: Vec<(&Trace, &Trace)> = match &shown.motion {
        Some((elongation, rate)) if shown.is_harmonic => vec![(elongation, &shown.value), (rate, &shown.value)],
        Some((elongation, _)) => vec![(&time, &shown.value), (&time, elongation)],
        None => vec![(&time, &shown.value)],
    };
    let lines = broken(&shown.shown);
    let top = TOP + 14.0 * (lines.len() as f64 - 1.0);
    let mut content = String::new();
    for (k, line) in lines.iter().enumerate() {
        let y = 44.0 + 14.0 * k as f64;
        content.push_str(&format!("<text x=\"14\" y=\"{y}\">{}</text>", crate::report::chart::escape(line)));
    }
    for (k, (x, y)) in panels.iter().enumerate() {
        let x_offset = k as f64 * PANEL.0;
        content.push_str(&format!("<g transform=\"translate({x_offset} {top})\">{}</g>", panel(x, y)));
    }
    let width = PANEL.0 * panels.len() as f64;
    framed(width.max(2.0 * PANEL.0), top + PANEL.1, &shown.law, &content)
}

fn panel(x: &Trace, y: &Trace) -> String {
    let label = |trace: &Trace| match trace.unit.as_str() {
        "" | "1" => trace.name.clone(),
        unit => format!("{} [{unit}]", trace.name),
    };
    let mark = Mark::Line { x: (&x.values).into(), y: (&y.values).into(), style: Style::After, name: "" };
    let plot = Plot {
        width: PANEL.0,
        height: PANEL.1,
        x_label: label(x),
        y_label: label(y),
        marks: vec![mark],
        legend: false,
        x_axis: None,
        y_axis: None,
    };
    plot.group()
}

/// Lines of bearable length.
fn broken(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        if let Some(last) = lines.last_mut()
            && last.len() + word.len() < LINE
        {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}
