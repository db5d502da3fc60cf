//! Verdicts on criteria as terminal text.

use super::Colour;
use super::sheet::Sheet;
use super::table::{Lean, Table};
use crate::analyse::{CriterionValidity, Spread, Validity};
use crate::report::{number, words};

pub fn text(validity: &Validity, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    sheet.heading(&format!("What {} (variant {}) is good for", validity.study, validity.variant));
    for criterion in &validity.criteria {
        section(&mut sheet, criterion);
    }
    super::identification::remark_section(&mut sheet, &validity.remarks);
    sheet.finish()
}

fn section(sheet: &mut Sheet, criterion: &CriterionValidity) {
    let of = format!("{} of manoeuvre {}", criterion.statistic, criterion.manoeuvre);
    let title = if criterion.title.is_empty() { of } else { format!("{}, {of}", criterion.title) };
    sheet.heading(&format!("{}: {title}", criterion.name));
    sheet.banner(&format!("  {}", words::validity(criterion)), words::validity_colour(criterion));
    sheet.paragraph(&criterion.reason, 2);
    if let Some(value) = criterion.value {
        let deviation = criterion.by_gradient.map(|spread| spread.standard_deviation);
        sheet.line(&format!("  value {} {}", number::with_deviation(value, deviation), criterion.unit));
    }
    let mut table = Table::new(&[
        (&format!("{} % interval", number::short(100.0 * criterion.confidence, 4)), Lean::Left),
        ("", Lean::Left),
        ("deviation", Lean::Right),
        ("", Lean::Left),
    ]);
    let ways = [
        ("by gradient", criterion.by_gradient),
        ("by wide increments", criterion.by_increments),
        ("by Monte Carlo", criterion.by_monte_carlo),
    ];
    for (way, spread) in ways {
        let Some(Spread { standard_deviation, interval }) = spread else { continue };
        let deviation = number::significant(standard_deviation, 3);
        table.row(vec![way.into(), number::interval_text(Some(interval)), deviation, criterion.unit.clone()]);
    }
    if criterion.by_gradient.is_some() {
        sheet.table(&table, 2);
    }
    for test in &criterion.orthogonality {
        let outcome = if test.orthogonal { "does not depend on it" } else { "depends on it" };
        let share = number::significant(test.share, 2);
        sheet.item(&format!("{}: {outcome} (share of the gradient {share})", test.direction));
    }
    relevance_table(sheet, criterion);
}

fn relevance_table(sheet: &mut Sheet, criterion: &CriterionValidity) {
    let unit = &criterion.unit;
    let mut table = Table::new(&[
        ("relevance", Lean::Left),
        (&format!("over the bounds [{unit}]"), Lean::Right),
        (&format!("per deviation [{unit}]"), Lean::Right),
        ("wide", Lean::Right),
    ]);
    let shown =
        |value: Option<f64>| value.map_or_else(|| "undetermined".to_owned(), |value| number::significant(value, 3));
    for relevance in &criterion.relevances {
        table.row(vec![
            relevance.parameter.clone(),
            number::significant(relevance.over_bounds, 3),
            shown(relevance.per_deviation),
            relevance.per_deviation_wide.map_or_else(String::new, |value| number::significant(value, 3)),
        ]);
    }
    sheet.table(&table, 2);
}
