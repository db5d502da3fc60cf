//! Courses of optimisers and cuts of the cost, as terminal text.

use super::Colour;
use super::sheet::Sheet;
use super::table::{Lean, Table};
use crate::analyse::{Courses, Cuts, Descents};
use crate::report::number;

pub fn courses(courses: &Courses, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    let count = courses.parameters.len();
    sheet.heading(&format!("Optimisers on {} (variant {}), {count} parameters", courses.study, courses.variant));
    let mut table = Table::new(&[
        ("optimiser", Lean::Left),
        ("cost", Lean::Right),
        ("simulations to within 1 % of the best", Lean::Right),
        ("simulations", Lean::Right),
        ("", Lean::Left),
    ]);
    for course in &courses.courses {
        table.row(vec![
            course.optimiser.clone(),
            number::significant(course.cost, 5),
            course.work_to_best.map_or("never".into(), |work| work.to_string()),
            course.work.to_string(),
            if course.converged { String::new() } else { "stopped by the budget".into() },
        ]);
    }
    sheet.table(&table, 2);
    sheet.paragraph(&format!("Searched: {}.", courses.parameters.join(", ")), 2);
    if !courses.held.is_empty() {
        sheet.paragraph(&format!("Held at their estimates: {}.", courses.held.join(", ")), 2);
    }
    sheet.paragraph("A gradient by internal differentiation counts as one simulation per parameter more.", 2);
    sheet.finish()
}

pub fn descents(descents: &Descents, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    let count = descents.parameters.len();
    sheet.heading(&format!("Gradients on {} (variant {}), {count} parameters", descents.study, descents.variant));
    let mut table = Table::new(&[
        ("gradient", Lean::Left),
        ("tolerance", Lean::Right),
        ("cost", Lean::Right),
        ("iterations", Lean::Right),
        ("simulations", Lean::Right),
        ("ended", Lean::Left),
    ]);
    for descent in &descents.descents {
        table.row(vec![
            descent.gradient.clone(),
            format!("{:.0e}", descent.tolerance),
            descent.costs.last().map_or("-".into(), |cost| number::significant(*cost, 5)),
            descent.costs.len().saturating_sub(1).to_string(),
            descent.simulations.to_string(),
            descent.reason.clone(),
        ]);
    }
    sheet.table(&table, 2);
    sheet.paragraph("An internal derivative by one parameter counts as one simulation, though it costs less.", 2);
    sheet.finish()
}

pub fn cuts(cuts: &Cuts, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    sheet.heading(&format!("Cuts of the cost of {} (variant {})", cuts.study, cuts.variant));
    let mut table = Table::new(&[
        ("parameter", Lean::Left),
        ("from", Lean::Right),
        ("to", Lean::Right),
        ("unit", Lean::Left),
        ("band", Lean::Left),
        ("tolerance", Lean::Right),
        ("smallest discrepancy", Lean::Right),
        ("at", Lean::Right),
        ("roughness", Lean::Right),
    ]);
    for cut in &cuts.parameters {
        for (index, curve) in cut.curves.iter().enumerate() {
            let finite = curve.discrepancy.iter().zip(&cut.values).filter(|(value, _)| value.is_finite());
            let smallest = finite.min_by(|a, b| a.0.total_cmp(b.0));
            let first = |text: String| if index == 0 { text } else { String::new() };
            table.row(vec![
                first(cut.parameter.clone()),
                first(cut.values.first().map_or(String::new(), |value| number::short(*value, 4))),
                first(cut.values.last().map_or(String::new(), |value| number::short(*value, 4))),
                first(cut.unit.clone()),
                curve.band.clone(),
                number::significant(curve.tolerance, 1),
                smallest.map_or("-".into(), |(value, _)| number::percent(*value)),
                smallest.map_or("-".into(), |(_, at)| number::short(*at, 4)),
                number::significant(curve.roughness, 2),
            ]);
        }
    }
    sheet.table(&table, 2);
    sheet.finish()
}
