//! The missing force at a place over the place's motion.

use crate::diagnose::{Answer, MissingForce};
use crate::report::chart::{Mark, Plot, Style, median_by_bin};
use crate::report::{number, words};
use serde::Serialize;

#[derive(Serialize)]
pub struct MissingView {
    pub place: String,
    pub share: String,
    /// Whether the accepted extension acts here (shown in full) or not (folded away).
    pub named: bool,
    pub rate_svg: String,
    pub coordinate_svg: String,
}

const WIDTH: f64 = 540.0;
const HEIGHT: f64 = 330.0;
const BINS: usize = 40;
/// A median of fewer points is not drawn.
const LEAST_POINTS: usize = 5;

/// The places, those of accepted causes first, else by the share they explain.
pub fn views(answer: &Answer) -> Vec<MissingView> {
    ordered(answer).into_iter().map(|(named, missing)| view(named, missing)).collect()
}

/// Places with whether they are named; where nothing was accepted the first one counts as named.
pub fn ordered(answer: &Answer) -> Vec<(bool, &MissingForce)> {
    let places: Vec<&str> = words::accepted(answer).iter().map(|(_, candidate)| candidate.place.as_str()).collect();
    let is_named = |missing: &MissingForce| places.contains(&missing.place.as_str());
    let mut sorted: Vec<&MissingForce> = answer.missing_forces.iter().collect();
    sorted.sort_by(|a, b| is_named(b).cmp(&is_named(a)).then(b.share.total_cmp(&a.share)));
    let any_named = sorted.iter().any(|missing| is_named(missing));
    let with_name = |(index, missing)| (if any_named { is_named(missing) } else { index == 0 }, missing);
    sorted.into_iter().enumerate().map(with_name).collect()
}

fn view(named: bool, missing: &MissingForce) -> MissingView {
    MissingView {
        place: missing.place.clone(),
        share: number::percent(100.0 * missing.share),
        named,
        rate_svg: over_rate(missing, WIDTH, HEIGHT).svg(),
        coordinate_svg: over_coordinate(missing, WIDTH, HEIGHT).svg(),
    }
}

/// The missing force over the place's rate.
pub fn over_rate(missing: &MissingForce, width: f64, height: f64) -> Plot<'_> {
    let label = format!(
        "{} [{}]",
        if missing.rate_unit.starts_with("rad") { "angular velocity" } else { "velocity" },
        missing.rate_unit
    );
    scatter(missing, &missing.rate, label, width, height)
}

/// The missing force over the place's coordinate.
pub fn over_coordinate(missing: &MissingForce, width: f64, height: f64) -> Plot<'_> {
    let label = format!("position [{}]", missing.coordinate_unit);
    scatter(missing, &missing.coordinate, label, width, height)
}

fn scatter<'a>(missing: &'a MissingForce, x: &'a [f64], x_label: String, width: f64, height: f64) -> Plot<'a> {
    let mut marks = vec![Mark::Cloud {
        x: x.into(),
        y: missing.force.as_slice().into(),
        style: Style::Missing,
        name: "from the residual",
    }];
    if missing.explained.len() == x.len() {
        marks.push(Mark::Cloud {
            x: x.into(),
            y: missing.explained.as_slice().into(),
            style: Style::After,
            name: "extension",
        });
    }
    let medians = median_by_bin(x, &missing.force, BINS, LEAST_POINTS);
    if medians.len() > 1 {
        let (centres, values): (Vec<f64>, Vec<f64>) = medians.into_iter().unzip();
        marks.push(Mark::Circles { x: centres.into(), y: values.into(), style: Style::Median, name: "median" });
    }
    let quantity = if missing.unit.contains("*m") { "missing torque" } else { "missing force" };
    let y_label = format!("{quantity} [{}]", missing.unit);
    Plot { width, height, x_label, y_label, marks, legend: true, x_axis: None, y_axis: None }
}
