//! Pictures of the cost: over the work of optimisers, and along parameters.

use crate::analyse::{Courses, Cut, CutCurve, Cuts, Descent, Descents};
use crate::report::chart::{Axis, Mark, Plot, Style, escape};
use crate::report::figure::framed;

const WIDTH: f64 = 900.0;
const COURSES_HEIGHT: f64 = 430.0;
/// Of one diagram of a cut, two beside each other.
const CUT: (f64, f64) = (450.0, 260.0);
/// Of one on a page.
const TILE: (f64, f64) = (420.0, 260.0);
const TOP: f64 = 40.0;

/// Best cost so far (logarithm, relative to the start's) over simulations.
pub fn courses(courses: &Courses) -> String {
    let start = courses.courses.iter().filter_map(|course| course.history.first()).map(|(_, cost)| *cost);
    let first = start.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let mut marks = Vec::new();
    for (index, course) in courses.courses.iter().enumerate() {
        let (mut x, mut y): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for (work, cost) in &course.history {
            // Steps: the best stays the best until a better one is found.
            if let Some(&last) = y.last() {
                x.push(*work as f64);
                y.push(last);
            }
            x.push(*work as f64);
            y.push((cost / first).log10());
        }
        if let Some(&last) = y.last() {
            x.push(course.work as f64);
            y.push(last);
        }
        marks.push(Mark::Line { x: x.into(), y: y.into(), style: Style::Variant(index), name: &course.optimiser });
    }
    let plot = Plot {
        width: WIDTH,
        height: COURSES_HEIGHT - TOP,
        x_label: "simulations".to_owned(),
        y_label: "cost, powers of ten below the start".to_owned(),
        marks,
        legend: true,
        x_axis: None,
        y_axis: None,
    };
    let title = format!("Optimisers on {}, {} parameters", courses.study, courses.parameters.len());
    framed(WIDTH, COURSES_HEIGHT, &title, &format!("<g transform=\"translate(0 {TOP})\">{}</g>", plot.group()))
}

/// Excess costs below this share of the lowest cost are drawn as this.
const SMALLEST_EXCESS: f64 = 1e-6;

/// Excess over the lowest cost (logarithm) over the iterations, by gradient and tolerance.
pub fn descents(descents: &Descents) -> String {
    let short = |own: &Descent| own.gradient.replace("internal differentiation", "internal").replace("finite ", "");
    let names: Vec<String> =
        descents.descents.iter().map(|own| format!("{}, {:.0e}", short(own), own.tolerance)).collect();
    let lowest = descents.descents.iter().flat_map(|own| &own.costs).copied().fold(f64::INFINITY, f64::min);
    let lowest = lowest.max(f64::MIN_POSITIVE);
    let marks = descents
        .descents
        .iter()
        .zip(&names)
        .enumerate()
        .map(|(index, (own, name))| {
            let x: Vec<f64> = (0..own.costs.len()).map(|iteration| iteration as f64).collect();
            let y: Vec<f64> = own.costs.iter().map(|cost| (cost / lowest - 1.0).max(SMALLEST_EXCESS).log10()).collect();
            Mark::Line { x: x.into(), y: y.into(), style: Style::Variant(index), name }
        })
        .collect();
    let plot = Plot {
        width: WIDTH,
        height: COURSES_HEIGHT - TOP,
        x_label: "iterations".to_owned(),
        y_label: "excess over the lowest cost, powers of ten".to_owned(),
        marks,
        legend: true,
        x_axis: None,
        y_axis: None,
    };
    let title = format!("Gradients on {}, {} parameters", escape(&descents.study), descents.parameters.len());
    framed(WIDTH, COURSES_HEIGHT, &title, &format!("<g transform=\"translate(0 {TOP})\">{}</g>", plot.group()))
}

/// Discrepancy along every parameter, the others held at the estimate.
pub fn cuts(cuts: &Cuts) -> String {
    let mut content = String::new();
    for (index, cut) in cuts.parameters.iter().enumerate() {
        let (x, y) = ((index % 2) as f64 * CUT.0, TOP + (index / 2) as f64 * CUT.1);
        let picture = cut_plot(cut, CUT, &|plot| plot.group());
        content.push_str(&format!("<g transform=\"translate({x} {y})\">{picture}</g>"));
    }
    let height = TOP + cuts.parameters.len().div_ceil(2) as f64 * CUT.1;
    framed(
        WIDTH,
        height,
        &format!("Cuts of the cost of {}, by band and tolerance of the integrator", escape(&cuts.study)),
        &content,
    )
}

/// One parameter's cut as a picture of its own, for a page.
pub(super) fn cut_svg(cut: &Cut) -> String {
    cut_plot(cut, TILE, &|plot| plot.svg())
}

fn cut_plot(cut: &Cut, (width, height): (f64, f64), drawn: &dyn Fn(&Plot) -> String) -> String {
    let name = |curve: &CutCurve| {
        let band = curve.band.strip_prefix("up to ").unwrap_or("all");
        format!("{band} {:.0e}", curve.tolerance)
    };
    let names: Vec<String> = cut.curves.iter().map(name).collect();
    let finest = cut.curves.iter().map(|curve| curve.tolerance).fold(f64::INFINITY, f64::min);
    let mut bands: Vec<&str> = cut.curves.iter().map(|curve| curve.band.as_str()).collect();
    bands.dedup();
    let mark = |(curve, name): (&'_ CutCurve, &'_ String)| {
        let colour = bands.iter().position(|band| *band == curve.band).unwrap_or(0);
        let style = if curve.tolerance > finest { Style::Broad(colour) } else { Style::Variant(colour) };
        (curve.discrepancy.clone(), style, name.clone())
    };
    let mut lines: Vec<(Vec<f64>, Style, String)> = cut.curves.iter().zip(&names).map(mark).collect();
    // Coarse ones lie beneath.
    lines.sort_by_key(|(_, style, _)| matches!(style, Style::Variant(_)));
    let mut marks: Vec<Mark> = lines
        .iter()
        .map(|(y, style, name)| Mark::Line {
            x: cut.values.as_slice().into(),
            y: y.as_slice().into(),
            style: *style,
            name,
        })
        .collect();
    let at_estimate = cut.curves.first().and_then(|curve| nearest(&cut.values, &curve.discrepancy, cut.at));
    marks.extend(at_estimate.map(|(x, y)| Mark::Circles {
        x: vec![x].into(),
        y: vec![y].into(),
        style: Style::Measured,
        name: "",
    }));
    let plot = Plot {
        width,
        height,
        x_label: format!("{} [{}]", cut.parameter, cut.unit),
        y_label: "discrepancy [%]".to_owned(),
        marks,
        legend: true,
        x_axis: Axis::around(&cut.values, 0.0, 6),
        y_axis: None,
    };
    drawn(&plot)
}

/// The curve at `at`, between its neighbours.
fn nearest(values: &[f64], curve: &[f64], at: f64) -> Option<(f64, f64)> {
    let k = values.windows(2).position(|pair| (pair[0]..=pair[1]).contains(&at))?;
    let share = if values[k + 1] > values[k] { (at - values[k]) / (values[k + 1] - values[k]) } else { 0.0 };
    let y = curve[k] + share * (curve[k + 1] - curve[k]);
    y.is_finite().then_some((at, y))
}
