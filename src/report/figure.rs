//! Stand-alone SVG files: the one picture of a diagnosis (histories before and after, and the missing force), courses
//! of optimisers, cuts of the cost.

use crate::diagnose::{Answer, MissingForce};
use crate::identify::{ChannelFit, RecordFit};
use crate::report::chart::{Axis, Mark, Plot, Style, escape};
use crate::report::page::{missing_over_rate, places};
use crate::report::{number, words};

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 420.0;
/// Room for the two lines of the title.
const TOP: f64 = 56.0;
/// Width of the histories where a missing force stands beside them.
const LEFT_WIDTH: f64 = 540.0;
/// The part of a long record that is drawn: short enough to show single reversals.
const LONGEST_STRETCH: f64 = 0.5;

const VARIANT_STYLE: &str = "\
.line{stroke-width:1.6}.line.variant0{stroke:#d55e00}.line.variant1{stroke:#0072b2}.line.variant2{stroke:#009e73}\
.line.variant3{stroke:#cc79a7}.line.variant4{stroke:#b58a00}.line.variant5{stroke:#56b4e9}\
.line.broad{stroke-width:6;stroke-opacity:.3}";

const STYLE: &str = "\
text{font:12px system-ui,'Segoe UI','Helvetica Neue','DejaVu Sans',sans-serif;fill:#59636e}\
text.label{fill:#1b1f24}text.title{font-weight:600;fill:#1b1f24}text.gain{font-size:14px}\
path{fill:none}.paper{fill:#fff}.grid{stroke:#e9ecef}.zero{stroke:#c5ccd3}.frame{stroke:#59636e}\
.line{stroke-width:1.2;stroke-linejoin:round}.line.key{stroke-width:2.5}\
.line.measured{stroke:#4b5563;stroke-width:1.6}.line.before{stroke:#d55e00}.line.after{stroke:#0072b2}\
.cloud{stroke-width:2.4;stroke-linecap:round}.cloud.missing{stroke:#7a8794}.cloud.after{stroke:#0072b2}\
.few{stroke-opacity:.35}.some{stroke-opacity:.65}.cloud.after.few,.cloud.after.some{stroke-opacity:.8}\
.dot.missing{fill:#7a8794}.dot.after{fill:#0072b2}.ring{fill:#fff;stroke:#1b1f24;stroke-width:1.3}";

pub use super::characteristic::characteristic;
pub use super::surface::{courses, cuts, descents};

/// A picture of its own with a title.
pub(super) fn framed(width: f64, height: f64, title: &str, content: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\
         <style>{STYLE}{VARIANT_STYLE}</style><rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>\
         <text class=\"title\" x=\"14\" y=\"24\" style=\"font-size:16px\">{}</text>{content}</svg>\n",
        escape(title)
    )
}

/// Measured against simulated (before and after) and residuals on the left, the missing force over velocity on the
/// right.
///
/// The record shown is a held-out one where there is one; of its channels the one whose discrepancy falls most.
pub fn summary(answer: &Answer) -> String {
    let named = places(answer).into_iter().find(|(named, _)| *named).map(|(_, missing)| missing);
    let width = if named.is_some() { LEFT_WIDTH } else { WIDTH };
    let title = title(answer);
    let histories = shown(answer).map_or(String::new(), |(record, index)| histories(answer, record, index, width));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\">\
         <style>{STYLE}</style><rect class=\"paper\" width=\"{WIDTH}\" height=\"{HEIGHT}\"/>\
         <text class=\"title\" x=\"14\" y=\"24\" style=\"font-size:{}px\">{}</text>\
         <text class=\"gain\" x=\"14\" y=\"44\">{}</text>{histories}{}</svg>\n",
        title_size(&title),
        escape(&title),
        escape(&gain(answer)),
        named.map_or(String::new(), force),
    )
}

fn title(answer: &Answer) -> String {
    let causes: Vec<&str> = words::accepted(answer).iter().map(|(_, candidate)| candidate.name.as_str()).collect();
    let verdict = words::verdict(&answer.verdict);
    if causes.is_empty() { verdict.to_string() } else { format!("{verdict}: {}", causes.join(", ")) }
}

/// Smaller type for titles that would not fit, px.
fn title_size(title: &str) -> f64 {
    const LARGEST: f64 = 17.0;
    /// Average advance of bold type, as a share of its size.
    const ADVANCE: f64 = 0.62;
    let fitting = (WIDTH - 28.0) / (ADVANCE * title.chars().count().max(1) as f64);
    (10.0 * fitting.min(LARGEST)).floor() / 10.0
}

fn gain(answer: &Answer) -> String {
    match (answer.base.validation_discrepancy, answer.extended.validation_discrepancy) {
        (Some(before), Some(after)) if answer.extension.is_some() => {
            format!("held-out discrepancy {} \u{2192} {}", number::percent(before), number::percent(after))
        }
        (Some(before), _) => format!("held-out discrepancy {}", number::percent(before)),
        (None, _) => format!("discrepancy {}, no held-out record", number::percent(answer.base.estimation_discrepancy)),
    }
}

/// The record and channel that show best what was gained.
fn shown(answer: &Answer) -> Option<(&RecordFit, usize)> {
    let records = &answer.base.records;
    let record = records.iter().find(|record| record.role == "validation").or(records.first())?;
    let extended = words::counterpart(record, &answer.extended);
    let fall = |index: usize| {
        let after = extended.and_then(|record| record.channels.get(index)).map_or(0.0, |channel| channel.discrepancy);
        record.channels[index].discrepancy - after
    };
    let index = (0..record.channels.len()).max_by(|a, b| fall(*a).total_cmp(&fall(*b)))?;
    Some((record, index))
}

fn histories(answer: &Answer, record: &RecordFit, index: usize, width: f64) -> String {
    let measured = &record.channels[index];
    let kept = stretch(record.time.len());
    let mut fits: Vec<(&ChannelFit, Style, &str)> = vec![(measured, Style::Before, "before")];
    if answer.extension.is_some() {
        let extended = words::counterpart(record, &answer.extended).and_then(|record| record.channels.get(index));
        fits.extend(extended.map(|channel| (channel, Style::After, "after")));
    }
    let time = &record.time[kept.clone()];
    let line = |y: Vec<f64>, style, name| Mark::Line { x: time.into(), y: y.into(), style, name };
    let mut main = vec![line(measured.measured[kept.clone()].to_vec(), Style::Measured, "measured")];
    let mut strip = Vec::new();
    for (channel, style, name) in fits {
        main.push(line(channel.simulated[kept.clone()].to_vec(), style, name));
        let residual = |k: usize| channel.measured[k] - channel.simulated[k];
        strip.push(line(kept.clone().map(residual).collect(), style, ""));
    }
    let x_axis = Axis::around(time, 0.0, (width / 70.0) as usize);
    let y_label = |quantity: &str| format!("{quantity} [{}]", measured.unit);
    let name = if measured.title.is_empty() { &measured.name } else { &measured.title };
    let plot = |marks, y_label, x_label: &str, height, legend| {
        let x_label = x_label.to_string();
        Plot { width, height, x_label, y_label, marks, legend, x_axis: x_axis.clone(), y_axis: None }.group()
    };
    let heights = (0.58 * (HEIGHT - TOP), 0.42 * (HEIGHT - TOP));
    let below = format!("time [s], record {}", record.experiment);
    format!(
        "<g transform=\"translate(0 {TOP})\">{}</g><g transform=\"translate(0 {})\">{}</g>",
        plot(main, y_label(name), "", heights.0, true),
        TOP + heights.0,
        plot(strip, y_label("residual"), &below, heights.1, false)
    )
}

/// The first half of a long record, all of a short one.
fn stretch(samples: usize) -> std::ops::Range<usize> {
    const LONG: usize = 5000;
    0..if samples > LONG { (LONGEST_STRETCH * samples as f64) as usize } else { samples }
}

fn force(missing: &MissingForce) -> String {
    let plot = missing_over_rate(missing, WIDTH - LEFT_WIDTH, HEIGHT - TOP);
    format!("<g transform=\"translate({LEFT_WIDTH} {TOP})\">{}</g>", plot.group())
}
