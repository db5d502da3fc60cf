//! How sure the parameters are, and which go together: correlation matrix, joint ellipses of pairs, profiles.

use crate::identify::{Identification, Profile};
use crate::report::chart::{Mark, Plot, Style};
use crate::report::number;
use serde::Serialize;

/// Of the pictures, pixels.
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 250.0;
/// More pairs than this are not drawn: the most correlated are.
const MOST_PAIRS: usize = 15;
const LEVEL: f64 = 0.95;
/// Points per half of an ellipse.
const POINTS: usize = 60;

#[derive(Serialize)]
pub struct CertaintyView {
    names: Vec<String>,
    rows: Vec<CorrelationRow>,
    ellipses: Vec<String>,
    /// Pairs that are not drawn.
    left_out: usize,
    profiles: Vec<ProfileView>,
}

#[derive(Serialize)]
struct CorrelationRow {
    name: String,
    deviation: String,
    unit: String,
    cells: Vec<CorrelationCell>,
}

#[derive(Serialize)]
struct CorrelationCell {
    text: String,
    /// Share of full colour.
    strength: f64,
}

#[derive(Serialize)]
struct ProfileView {
    heading: String,
    svg: String,
}

/// `None` where fewer than two parameters are determined and no profile was asked for.
pub fn view(fit: &Identification) -> Option<CertaintyView> {
    let determined: Vec<usize> = (0..fit.parameters.len())
        .filter(|&j| fit.parameters[j].standard_deviation.is_some_and(|sd| sd > 0.0))
        .collect();
    if determined.len() < 2 && fit.profiles.is_empty() {
        return None;
    }
    let mut pairs: Vec<(usize, usize)> =
        determined.iter().enumerate().flat_map(|(at, &i)| determined[at + 1..].iter().map(move |&j| (i, j))).collect();
    // Stable: of equally correlated pairs the first stay first.
    pairs.sort_by(|a, b| fit.correlation[b.0][b.1].abs().total_cmp(&fit.correlation[a.0][a.1].abs()));
    let left_out = pairs.len().saturating_sub(MOST_PAIRS);
    pairs.truncate(MOST_PAIRS);
    let cell =
        |value: f64| CorrelationCell { text: number::fixed(value, 2), strength: (100.0 * value.abs()).round() / 100.0 };
    let row = |i: &usize| CorrelationRow {
        name: fit.parameters[*i].name.clone(),
        deviation: number::significant(fit.parameters[*i].standard_deviation.unwrap_or(f64::NAN), 3),
        unit: fit.parameters[*i].unit.clone(),
        cells: determined.iter().map(|&j| cell(fit.correlation[*i][j])).collect(),
    };
    Some(CertaintyView {
        names: determined.iter().map(|&j| fit.parameters[j].name.clone()).collect(),
        rows: determined.iter().map(row).collect(),
        ellipses: pairs.iter().map(|&(i, j)| ellipse(fit, i, j)).collect(),
        left_out,
        profiles: fit.profiles.iter().map(|profile| profile_view(fit, profile)).collect(),
    })
}

/// The joint region of two parameters, from the F distribution with two degrees of freedom above; its box are the
/// intervals of one parameter each.
fn ellipse(fit: &Identification, i: usize, j: usize) -> String {
    let (x, y) = (&fit.parameters[i], &fit.parameters[j]);
    let deviations = (x.standard_deviation.unwrap_or(0.0), y.standard_deviation.unwrap_or(0.0));
    let correlation = fit.correlation[i][j].clamp(-1.0, 1.0);
    // 2 F_{2, nu}(level) in closed form.
    let size = (fit.freedom * ((1.0 - LEVEL).powf(-2.0 / fit.freedom) - 1.0)).sqrt();
    let across: Vec<f64> = (0..=POINTS).map(|k| -(std::f64::consts::PI * k as f64 / POINTS as f64).cos()).collect();
    let half = |sign: f64| Mark::Line {
        x: across.iter().map(|u| x.value + size * deviations.0 * u).collect(),
        y: across
            .iter()
            .map(|u| {
                let away = sign * ((1.0 - u * u).max(0.0) * (1.0 - correlation * correlation)).sqrt();
                y.value + size * deviations.1 * (correlation * u + away)
            })
            .collect(),
        style: Style::After,
        name: "",
    };
    let centre = Mark::Circles { x: vec![x.value].into(), y: vec![y.value].into(), style: Style::After, name: "" };
    let mut marks = vec![half(1.0), half(-1.0), centre];
    if let (Some(a), Some(b)) = (x.interval, y.interval) {
        let side = |x: [f64; 2], y: [f64; 2]| Mark::Line {
            x: x.to_vec().into(),
            y: y.to_vec().into(),
            style: Style::Measured,
            name: "",
        };
        marks.extend([side([a.0, a.1], [b.0, b.0]), side([a.0, a.1], [b.1, b.1])]);
        marks.extend([side([a.0, a.0], [b.0, b.1]), side([a.1, a.1], [b.0, b.1])]);
    }
    plot(marks, format!("{} [{}]", x.name, x.unit), format!("{} [{}]", y.name, y.unit))
}

fn profile_view(fit: &Identification, profile: &Profile) -> ProfileView {
    let name = &profile.parameter;
    let line = |y: Vec<f64>, style, name| Mark::Line { x: profile.values.clone().into(), y: y.into(), style, name };
    let mut marks = vec![
        line(profile.deviance.clone(), Style::After, "profile"),
        line(vec![profile.limit; profile.values.len()], Style::Measured, "95 %"),
    ];
    let parameter = fit.parameters.iter().find(|parameter| parameter.name == *name);
    if let Some((parameter, deviation)) =
        parameter.and_then(|p| Some((p, p.standard_deviation.filter(|sd| *sd > 0.0)?)))
    {
        let parabola = profile.values.iter().map(|value| ((value - parameter.value) / deviation).powi(2)).collect();
        // Beneath the profile, which often lies on it.
        marks.insert(0, line(parabola, Style::Before, "linear"));
    }
    let end = |value: Option<f64>| value.map_or("open".to_owned(), |value| number::significant(value, 4));
    let plot = Plot { legend: true, ..base(marks, format!("{name} [{}]", profile.unit), "deviance".to_owned()) };
    ProfileView {
        heading: format!("{name}: {} .. {} {}", end(profile.lower), end(profile.upper), profile.unit),
        svg: plot.svg(),
    }
}

fn plot(marks: Vec<Mark>, x_label: String, y_label: String) -> String {
    base(marks, x_label, y_label).svg()
}

fn base(marks: Vec<Mark>, x_label: String, y_label: String) -> Plot {
    Plot { width: WIDTH, height: HEIGHT, x_label, y_label, marks, legend: false, x_axis: None, y_axis: None }
}
