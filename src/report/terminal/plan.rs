//! What tests would tell, as terminal text.

use super::Colour;
use super::sheet::Sheet;
use super::table::{Lean, Table};
use crate::analyse::{Excitation, Outcome, Plan};
use crate::report::{number, words};

pub fn text(plan: &Plan, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    sheet.heading(&format!("Tests for {} (variant {})", plan.study, plan.variant));
    best(&mut sheet, plan);
    excitations(&mut sheet, plan);
    combinations(&mut sheet, plan);
    for excitation in &plan.excitations {
        section(&mut sheet, excitation);
    }
    if plan.excitations.len() > 1 {
        sheet.heading("All excitations together");
        outcome(&mut sheet, &plan.together);
    }
    if !plan.fix.is_empty() {
        sheet.heading("Better given a value than identified");
        plan.fix.iter().for_each(|line| sheet.item(line));
    }
    super::identification::remark_section(&mut sheet, &plan.remarks);
    sheet.finish()
}

fn best(sheet: &mut Sheet, plan: &Plan) {
    for best in &plan.best {
        let what = match best.measure.as_str() {
            "D" => "smallest confidence ellipsoid of all parameters (D)".to_owned(),
            "A" => "smallest mean variance of the parameters (A)".to_owned(),
            criterion => format!("best known criterion {criterion}"),
        };
        let excitation = best.excitation.as_deref().unwrap_or("none determines it");
        sheet.item(&format!("{what}: {excitation}"));
    }
}

fn share(value: Option<f64>) -> String {
    value.map_or_else(|| "undetermined".into(), |value| number::significant(100.0 * value, 3))
}

fn excitations(sheet: &mut Sheet, plan: &Plan) {
    sheet.heading("Excitations, with all sensors");
    let wanted = format!("enough for {} %", number::short(plan.accuracy, 3));
    let mut table = Table::new(&[
        ("excitation", Lean::Left),
        ("duration [s]", Lean::Right),
        ("rate [Hz]", Lean::Right),
        ("D [% of bounds]", Lean::Right),
        ("A [% of bounds]", Lean::Right),
        (&wanted, Lean::Left),
        ("useful rate [Hz]", Lean::Right),
    ]);
    for excitation in &plan.excitations {
        let enough = match (excitation.sufficient_duration, excitation.repetitions) {
            (Some(until), _) => format!("after {} s", number::significant(until, 2)),
            (None, Some(times)) => format!("{} times", number::fixed(times, 0)),
            (None, None) => "never".into(),
        };
        table.row(vec![
            excitation.name.clone(),
            number::short(excitation.duration, 4),
            number::short(excitation.rate, 4),
            share(excitation.outcome.d_measure),
            share(excitation.outcome.a_measure),
            enough,
            number::significant(excitation.useful_rate, 2),
        ]);
    }
    sheet.table(&table, 2);
}

/// Best choices of tests and sensors, growing.
fn combinations(sheet: &mut Sheet, plan: &Plan) {
    if plan.combinations.is_empty() {
        return;
    }
    sheet.heading("Tests and sensors that belong together");
    let mut table = Table::new(&[
        ("by", Lean::Left),
        ("excitations", Lean::Left),
        ("sensors", Lean::Left),
        ("value", Lean::Right),
        ("with everything", Lean::Right),
    ]);
    let mut before = "";
    for choice in &plan.combinations {
        let (value, everything) = words::combination_values(plan, choice);
        table.row(vec![
            if choice.measure == before { String::new() } else { choice.measure.clone() },
            choice.excitations.join(", "),
            choice.sensors.join(", "),
            value,
            everything,
        ]);
        before = &choice.measure;
    }
    sheet.table(&table, 2);
    sheet.paragraph(words::combination_note(plan), 2);
}

fn section(sheet: &mut Sheet, excitation: &Excitation) {
    let title = if excitation.title.is_empty() { String::new() } else { format!(", {}", excitation.title) };
    sheet.heading(&format!("{}{title}", excitation.name));
    outcome(sheet, &excitation.outcome);
    needs(sheet, excitation);
    let mut table = Table::new(&[("sensor", Lean::Left), ("D alone", Lean::Right), ("D without it", Lean::Right)]);
    for sensor in excitation.sensors.iter().filter(|_| excitation.sensors.len() > 1) {
        table.row(vec![sensor.name.clone(), share(sensor.alone), share(sensor.without)]);
    }
    if excitation.sensors.len() > 1 {
        sheet.table(&table, 2);
    }
}

/// What the wanted accuracy takes, one by one.
fn needs(sheet: &mut Sheet, excitation: &Excitation) {
    let mut table = Table::new(&[
        ("wanted", Lean::Left),
        ("+-", Lean::Right),
        ("unit", Lean::Left),
        ("reached after", Lean::Right),
        ("or repetitions", Lean::Right),
        ("or rate [Hz]", Lean::Right),
    ]);
    for need in &excitation.needs {
        table.row(vec![
            need.name.clone(),
            number::significant(need.wanted, 3),
            need.unit.clone(),
            need.duration.map_or("not at all".into(), |time| format!("{} s", number::significant(time, 2))),
            need.repetitions.map_or("never".into(), words::repetitions),
            need.rate.map_or(String::new(), |rate| number::significant(rate, 2)),
        ]);
    }
    sheet.table(&table, 2);
    sheet.paragraph("Repetitions and rates (not below the useful one) count as long as the noise stays white.", 2);
}

fn outcome(sheet: &mut Sheet, outcome: &Outcome) {
    let mut table = Table::new(&[
        ("parameter", Lean::Left),
        ("value", Lean::Right),
        ("unit", Lean::Left),
        ("deviation", Lean::Right),
        ("relative", Lean::Right),
        ("identifiability", Lean::Right),
    ]);
    for parameter in &outcome.parameters {
        let relative = parameter.standard_deviation.map(|deviation| 100.0 * deviation / parameter.value.abs());
        table.row(vec![
            parameter.name.clone(),
            number::short(parameter.value, 5),
            parameter.unit.clone(),
            parameter.standard_deviation.map_or("undetermined".into(), |value| number::significant(value, 3)),
            relative.map_or(String::new(), number::percent),
            number::significant(parameter.identifiability, 2),
        ]);
    }
    sheet.table(&table, 2);
    for direction in &outcome.undetermined {
        sheet.item(&format!("not determined: {direction}"));
    }
    for criterion in &outcome.criteria {
        let known = match criterion.standard_deviation {
            Some(deviation) => format!("deviation {} {}", number::significant(deviation, 3), criterion.unit),
            None => "depends on what is not determined".into(),
        };
        sheet.item(&format!("criterion {}: {known}", criterion.name));
    }
}
