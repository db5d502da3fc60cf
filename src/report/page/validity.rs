//! Verdicts on criteria as a page.

use crate::analyse::{CriterionValidity, Demand, Spread, Validity, Verdict};
use crate::report::chart::{Bar, Style, Whisker, bars, whisker};
use crate::report::{number, words};
use serde::Serialize;

/// Width of the pictures of intervals, and of the bars of relevances, in pixels.
const INTERVAL_WIDTH: f64 = 560.0;
const BAR_WIDTH: f64 = 260.0;

#[derive(Serialize)]
pub struct ValidityPage {
    title: String,
    study: String,
    criteria: Vec<CriterionView>,
    remarks: Vec<String>,
}

#[derive(Serialize)]
struct CriterionView {
    name: String,
    title: String,
    verdict: &'static str,
    verdict_class: &'static str,
    reason: String,
    value: Option<String>,
    level: String,
    lower: String,
    upper: String,
    limit: bool,
    interval_svg: Option<String>,
    ways: Vec<WayRow>,
    orthogonality: Vec<String>,
    relevances: Vec<RelevanceRow>,
    unit: String,
}

#[derive(Serialize)]
struct WayRow {
    way: &'static str,
    interval: String,
    deviation: String,
}

#[derive(Serialize)]
struct RelevanceRow {
    parameter: String,
    over_bounds: String,
    per_deviation: String,
    bars_svg: String,
}

pub fn view(validity: &Validity) -> ValidityPage {
    ValidityPage {
        title: "What the model is good for".to_owned(),
        study: format!("{}, variant {}", validity.study, validity.variant),
        criteria: validity.criteria.iter().map(criterion).collect(),
        remarks: validity.remarks.clone(),
    }
}

fn criterion(criterion: &CriterionValidity) -> CriterionView {
    let verdict_class = match (criterion.verdict, criterion.demand) {
        (Verdict::Valid, Demand::Violated) | (Verdict::NotValid, _) => "open",
        (Verdict::Valid, _) => "good",
        (Verdict::CannotBeJudged, _) => "fair",
    };
    let of = format!("{} of manoeuvre {}", criterion.statistic, criterion.manoeuvre);
    let ways = ways(criterion);
    let (lower, upper) = range(criterion, &ways);
    let deviation = criterion.by_gradient.map(|spread| spread.standard_deviation);
    CriterionView {
        name: criterion.name.clone(),
        title: if criterion.title.is_empty() { of } else { format!("{}, {of}", criterion.title) },
        verdict: words::validity(criterion),
        verdict_class,
        reason: criterion.reason.clone(),
        value: criterion.value.map(|value| number::with_deviation(value, deviation)),
        level: number::short(100.0 * criterion.confidence, 4),
        lower: number::significant(lower, 4),
        upper: number::significant(upper, 4),
        limit: criterion.below.or(criterion.above).is_some(),
        interval_svg: picture(criterion, &ways, lower, upper),
        ways: ways
            .iter()
            .map(|(way, spread)| WayRow {
                way,
                interval: number::interval_text(Some(spread.interval)),
                deviation: number::significant(spread.standard_deviation, 3),
            })
            .collect(),
        orthogonality: criterion
            .orthogonality
            .iter()
            .map(|test| {
                let outcome =
                    if test.orthogonal { "the criterion does not depend on it" } else { "the criterion depends on it" };
                format!("{}: {outcome} (share of its gradient {})", test.direction, number::significant(test.share, 2))
            })
            .collect(),
        relevances: relevances(criterion),
        unit: criterion.unit.clone(),
    }
}

fn ways(criterion: &CriterionValidity) -> Vec<(&'static str, Spread)> {
    [
        ("by gradient", criterion.by_gradient),
        ("by wide increments", criterion.by_increments),
        ("by Monte Carlo", criterion.by_monte_carlo),
    ]
    .into_iter()
    .filter_map(|(way, spread)| spread.map(|spread| (way, spread)))
    .collect()
}

/// All intervals and limits with a margin.
fn range(criterion: &CriterionValidity, ways: &[(&str, Spread)]) -> (f64, f64) {
    let ends = ways.iter().flat_map(|(_, spread)| [spread.interval.0, spread.interval.1]);
    let shown: Vec<f64> = ends.chain(criterion.below).chain(criterion.above).chain(criterion.value).collect();
    let low = shown.iter().copied().fold(f64::INFINITY, f64::min);
    let high = shown.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let margin = 0.08 * (high - low).max(1e-12 * high.abs());
    (low - margin, high + margin)
}

fn picture(criterion: &CriterionValidity, ways: &[(&str, Spread)], lower: f64, upper: f64) -> Option<String> {
    let value = criterion.value.filter(|_| !ways.is_empty())?;
    let styles = [Style::After, Style::Before, Style::Measured];
    let rows: Vec<Whisker> = ways
        .iter()
        .zip(styles)
        .map(|((_, spread), style)| Whisker { value, interval: Some(spread.interval), style })
        .collect();
    Some(whisker(&rows, lower, upper, criterion.below.or(criterion.above), INTERVAL_WIDTH))
}

fn relevances(criterion: &CriterionValidity) -> Vec<RelevanceRow> {
    let full = criterion.relevances.iter().map(|relevance| relevance.over_bounds.abs()).fold(0.0, f64::max);
    let spread = criterion
        .relevances
        .iter()
        .filter_map(|relevance| relevance.per_deviation)
        .fold(0.0, |a: f64, b| a.max(b.abs()));
    criterion
        .relevances
        .iter()
        .map(|relevance| RelevanceRow {
            parameter: relevance.parameter.clone(),
            over_bounds: number::significant(relevance.over_bounds, 3),
            per_deviation: relevance
                .per_deviation
                .map_or("undetermined".to_owned(), |value| number::significant(value, 3)),
            bars_svg: bars(
                &[
                    Bar { value: relevance.over_bounds.abs() / full, style: Style::Before },
                    Bar { value: relevance.per_deviation.unwrap_or(0.0).abs() / spread, style: Style::After },
                ],
                1.0,
                BAR_WIDTH,
            ),
        })
        .collect()
}
