//! A fit, and several fits side by side, as terminal text.

use super::Colour;
use super::sheet::Sheet;
use super::table::{Lean, Table};
use crate::identify::{DiscrepancyNode, Identification, ParameterEstimate};
use crate::report::{number, words};

pub fn text(fit: &Identification, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    sheet.heading(&format!("Fit of variant {}", fit.variant));
    sheet.paragraph(&headline(fit), 2);
    discrepancy_section(&mut sheet, fit, None);
    channel_section(&mut sheet, fit);
    parameter_section(&mut sheet, fit, "Parameters");
    profile_section(&mut sheet, fit);
    work_section(&mut sheet, fit);
    remark_section(&mut sheet, &fit.remarks);
    sheet.finish()
}

fn headline(fit: &Identification) -> String {
    let held_out = match fit.validation_discrepancy {
        Some(value) => format!("{} on held-out data", number::percent(value)),
        None => "no held-out record".into(),
    };
    format!("discrepancy {} on estimation data, {held_out}", number::percent(fit.estimation_discrepancy))
}

/// The discrepancy down the tree, beside that of `extended` where given.
pub fn discrepancy_section(sheet: &mut Sheet, base: &Identification, extended: Option<&Identification>) {
    sheet.heading("Discrepancy (100 % = no better than a model that stays at the mean)");
    let heads = if extended.is_some() { ["before", "after", "change"] } else { ["", "", ""] };
    let mut table =
        Table::new(&[("", Lean::Left), (heads[0], Lean::Right), (heads[1], Lean::Right), (heads[2], Lean::Right)]);
    for record in &base.records {
        let title = format!("{}, {}", record.experiment, words::role(&record.role));
        let after = extended.and_then(|fit| words::counterpart(record, fit)).map(|record| &record.discrepancy);
        // A single channel has the discrepancy of its record: one line says both.
        let mut node = &record.discrepancy;
        let mut after_node = after;
        while let [only] = node.children.as_slice() {
            after_node = after_node.and_then(|after| child(after, &only.name));
            node = only;
        }
        let title = if std::ptr::eq(node, &record.discrepancy) { title } else { format!("{title}: {}", node.name) };
        discrepancy_rows(&mut table, &title, node, after_node, 0);
    }
    sheet.table(&table, 2);
}

fn child<'a>(node: &'a DiscrepancyNode, name: &str) -> Option<&'a DiscrepancyNode> {
    node.children.iter().find(|child| child.name == name)
}

fn discrepancy_rows(
    table: &mut Table,
    title: &str,
    node: &DiscrepancyNode,
    after: Option<&DiscrepancyNode>,
    depth: usize,
) {
    let change = after.and_then(|after| words::relative_change(node.discrepancy, after.discrepancy));
    table.row(vec![
        format!("{}{title}", "  ".repeat(depth)),
        number::percent(node.discrepancy),
        after.map_or(String::new(), |after| number::percent(after.discrepancy)),
        change.map_or(String::new(), |change| format!("{} %", number::signed(change, number::fixed(change, 0)))),
    ]);
    for below in &node.children {
        let after_below = after.and_then(|after| child(after, &below.name));
        discrepancy_rows(table, &below.name, below, after_below, depth + 1);
    }
}

fn channel_section(sheet: &mut Sheet, fit: &Identification) {
    sheet.heading("Channels (unfiltered)");
    let mut table = Table::new(&[
        ("record", Lean::Left),
        ("channel", Lean::Left),
        ("residual rms", Lean::Right),
        ("unit", Lean::Left),
        ("relative error", Lean::Right),
        ("noise from", Lean::Left),
    ]);
    for record in &fit.records {
        for channel in &record.channels {
            table.row(vec![
                record.experiment.clone(),
                channel.name.clone(),
                number::significant(channel.residual_rms, 3),
                channel.unit.clone(),
                number::percent(channel.relative_error),
                channel.noise_source.clone(),
            ]);
        }
    }
    sheet.table(&table, 2);
}

/// Parameters with unit, interval and bounds, what is correlated and what is undetermined.
pub fn parameter_section(sheet: &mut Sheet, fit: &Identification, title: &str) {
    sheet.heading(title);
    if fit.parameters.is_empty() {
        sheet.line("  none");
        return;
    }
    let mut table = Table::new(&[
        ("name", Lean::Left),
        ("value", Lean::Right),
        ("unit", Lean::Left),
        ("95 % interval", Lean::Left),
        ("start", Lean::Right),
        ("bounds", Lean::Left),
        ("", Lean::Left),
    ]);
    for parameter in &fit.parameters {
        table.row(vec![
            parameter.name.clone(),
            number::with_deviation(parameter.value, parameter.standard_deviation),
            parameter.unit.clone(),
            number::interval_text(parameter.interval),
            number::short(parameter.start, 4),
            bounds(parameter),
            if parameter.at_bound { "at its bound".into() } else { String::new() },
        ]);
    }
    sheet.table(&table, 2);
    for (first, second, correlation) in words::strong_correlations(fit) {
        sheet.item(&format!("{first} and {second} move together (correlation {})", number::fixed(correlation, 2)));
    }
    for direction in &fit.undetermined {
        sheet.item(&format!("not determined by the data: {direction}"));
    }
}

/// Intervals by profile likelihood beside those by linearisation.
fn profile_section(sheet: &mut Sheet, fit: &Identification) {
    if fit.profiles.is_empty() {
        return;
    }
    sheet.heading("Profile likelihood (95 % intervals, all other parameters following)");
    let mut table = Table::new(&[
        ("name", Lean::Left),
        ("lower", Lean::Right),
        ("upper", Lean::Right),
        ("unit", Lean::Left),
        ("by linearisation", Lean::Left),
    ]);
    for profile in &fit.profiles {
        let end = |value: Option<f64>| value.map_or("open".into(), |value| number::significant(value, 4));
        let linear = fit.parameters.iter().find(|parameter| parameter.name == profile.parameter);
        table.row(vec![
            profile.parameter.clone(),
            end(profile.lower),
            end(profile.upper),
            profile.unit.clone(),
            linear.map_or(String::new(), |parameter| number::interval_text(parameter.interval)),
        ]);
    }
    sheet.table(&table, 2);
}

/// `0 .. 100`, as short as the bounds are.
pub fn bounds(parameter: &ParameterEstimate) -> String {
    format!("{} .. {}", number::short(parameter.lower, 4), number::short(parameter.upper, 4))
}

fn work_section(sheet: &mut Sheet, fit: &Identification) {
    sheet.heading("Fit");
    let failed = match fit.failed_simulations {
        0 => String::new(),
        count => format!(" ({count} failed)"),
    };
    sheet.paragraph(
        &format!(
            "{} iterations, {} simulations{failed}; stopped: {}",
            fit.iterations, fit.simulations, fit.stop_reason
        ),
        2,
    );
    sheet.paragraph(
        &format!(
            "{} residuals, worth {} independent ones; BIC {}",
            number::count(fit.residual_count),
            number::fixed(fit.effective_count, 0),
            number::fixed(fit.bic, 1)
        ),
        2,
    );
    error_section(sheet, fit);
    if let Some(digits) = fit.gradient_digits {
        sheet.paragraph(&format!("gradient agrees with an independent one to {} digits", number::fixed(digits, 1)), 2);
    }
}

/// What counted as error, and why nothing else did.
fn error_section(sheet: &mut Sheet, fit: &Identification) {
    let error = &fit.error;
    sheet.paragraph(&format!("error: {}; {}", error.used, error.reason), 2);
    for (state, level) in &error.process_noise {
        sheet.item(&format!("process noise on {state}: {} (SI, per root of Hz)", number::significant(*level, 3)));
    }
    for other in &error.others {
        sheet.item(&format!("not {}: {}", other.name, other.why));
    }
}

pub fn remark_section(sheet: &mut Sheet, remarks: &[String]) {
    if !remarks.is_empty() {
        sheet.heading("Remarks");
        remarks.iter().for_each(|remark| sheet.item(remark));
    }
}

pub fn comparison(variants: &[Identification], colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    sheet.heading("Variants");
    let Some(base) = variants.first() else {
        sheet.line("  none");
        return sheet.finish();
    };
    let mut table = Table::new(&[
        ("variant", Lean::Left),
        ("parameters", Lean::Right),
        ("estimation", Lean::Right),
        ("held out", Lean::Right),
        (&format!("BIC - {}", base.variant), Lean::Right),
        ("", Lean::Left),
    ]);
    for fit in variants {
        let at_bound = fit.parameters.iter().filter(|parameter| parameter.at_bound).count();
        table.row(vec![
            fit.variant.clone(),
            fit.parameters.len().to_string(),
            number::percent(fit.estimation_discrepancy),
            fit.validation_discrepancy.map_or("-".into(), number::percent),
            bic_difference(fit, base),
            if at_bound > 0 { format!("{at_bound} at bound") } else { String::new() },
        ]);
    }
    sheet.table(&table, 2);
    structure_section(&mut sheet, variants);
    record_section(&mut sheet, variants);
    estimate_section(&mut sheet, variants);
    for fit in variants.iter().filter(|fit| !fit.remarks.is_empty()) {
        sheet.heading(&format!("Remarks on {}", fit.variant));
        fit.remarks.iter().for_each(|remark| sheet.item(remark));
    }
    sheet.finish()
}

/// With common counts where the structures were compared.
fn bic_difference(fit: &Identification, base: &Identification) -> String {
    match (&fit.structure, &base.structure) {
        (Some(own), Some(first)) => number::fixed(own.bic - first.bic, 1),
        _ => number::fixed(fit.bic - base.bic, 1),
    }
}

fn structure_section(sheet: &mut Sheet, variants: &[Identification]) {
    let rows = words::structures(variants);
    if rows.is_empty() {
        return;
    }
    sheet.heading(&format!("Against {}", variants[0].variant));
    let last = words::STRUCTURE_HEADS.len() - 1;
    let lean = |column| if column == 0 || column == last { Lean::Left } else { Lean::Right };
    let heads = words::STRUCTURE_HEADS.iter().enumerate().map(|(column, head)| (*head, lean(column)));
    let mut table = Table::new(&heads.collect::<Vec<_>>());
    rows.into_iter().for_each(|row| table.row(row.to_vec()));
    sheet.table(&table, 2);
}

fn columns<'a>(first: &'a str, variants: &'a [Identification]) -> Vec<(&'a str, Lean)> {
    [(first, Lean::Left)].into_iter().chain(variants.iter().map(|fit| (fit.variant.as_str(), Lean::Right))).collect()
}

fn record_section(sheet: &mut Sheet, variants: &[Identification]) {
    sheet.heading("Discrepancy per record and channel");
    let mut table = Table::new(&columns("", variants));
    for record in &variants[0].records {
        let in_variant = |fit| words::counterpart(record, fit);
        let mut row = vec![format!("{}, {}", record.experiment, words::role(&record.role))];
        row.extend(
            variants.iter().map(|fit| {
                in_variant(fit).map_or("-".into(), |record| number::percent(record.discrepancy.discrepancy))
            }),
        );
        table.row(row);
        for (index, channel) in record.channels.iter().enumerate().filter(|_| record.channels.len() > 1) {
            let mut row = vec![format!("  {}", channel.name)];
            row.extend(variants.iter().map(|fit| {
                let found = in_variant(fit).and_then(|record| record.channels.get(index));
                found.map_or("-".into(), |channel| number::percent(channel.discrepancy))
            }));
            table.row(row);
        }
    }
    sheet.table(&table, 2);
}

fn estimate_section(sheet: &mut Sheet, variants: &[Identification]) {
    sheet.heading("Parameters (value +- half of the 95 % interval)");
    let mut names: Vec<(&str, &str)> = Vec::new();
    for parameter in variants.iter().flat_map(|fit| &fit.parameters) {
        if !names.iter().any(|(name, _)| *name == parameter.name) {
            names.push((&parameter.name, &parameter.unit));
        }
    }
    let mut table = Table::new(&columns("", variants));
    for (name, unit) in names {
        let mut row = vec![format!("{name} [{unit}]")];
        row.extend(variants.iter().map(|fit| {
            let found = fit.parameters.iter().find(|parameter| parameter.name == name);
            found.map_or("-".into(), estimate)
        }));
        table.row(row);
    }
    sheet.table(&table, 2);
}

fn estimate(parameter: &ParameterEstimate) -> String {
    let value = number::with_deviation(parameter.value, parameter.standard_deviation);
    match parameter.interval {
        Some((low, high)) => format!("{value} +- {}", number::significant(0.5 * (high - low), 2)),
        None => format!("{value} (undetermined)"),
    }
}
