//! The answer of a diagnosis as terminal text.

use super::Colour;
use super::identification::{discrepancy_section, parameter_section, remark_section};
use super::sheet::Sheet;
use super::table::{Lean, Table};
use crate::diagnose::{Answer, Candidate, Refit, Step, Verdict};
use crate::report::{number, words};

/// Candidates shown per round.
const SHOWN: usize = 10;

pub fn text(answer: &Answer, colour: Colour) -> String {
    let mut sheet = Sheet::new(colour);
    verdict(&mut sheet, answer);
    let extended = answer.extension.is_some().then_some(&answer.extended);
    discrepancy_section(&mut sheet, &answer.base, extended);
    causes(&mut sheet, answer);
    let last = extended.unwrap_or(&answer.base);
    parameter_section(&mut sheet, last, &format!("Parameters of {}", last.variant));
    anatomy(&mut sheet, answer);
    for (index, step) in answer.steps.iter().enumerate() {
        ranking(&mut sheet, index, step);
    }
    if !answer.cannot_judge.is_empty() {
        sheet.heading("Cannot be judged with this data");
        answer.cannot_judge.iter().for_each(|line| sheet.item(line));
    }
    remark_section(&mut sheet, &remarks(answer));
    next(&mut sheet, answer);
    sheet.finish()
}

fn verdict(sheet: &mut Sheet, answer: &Answer) {
    let code = match answer.verdict {
        Verdict::NothingWrongFound | Verdict::CauseNamed => "1;32",
        Verdict::GroupOfCauses | Verdict::ShapeWithoutName | Verdict::NoCauseFound => "1;33",
        Verdict::CannotBeJudged => "1;31",
    };
    sheet.line(&format!("{}: {}", answer.study, answer.title));
    sheet.line("");
    sheet.banner(&words::verdict(&answer.verdict).to_uppercase(), code);
    sheet.paragraph(&answer.summary, 2);
    if !answer.roles.is_empty() {
        sheet.paragraph(&format!("Records: {}", answer.roles), 2);
    }
}

fn causes(sheet: &mut Sheet, answer: &Answer) {
    let accepted = words::accepted(answer);
    if accepted.is_empty() {
        return;
    }
    sheet.heading(if accepted.len() == 1 { "Cause" } else { "Causes, in the order found" });
    for (number, (step, candidate)) in accepted.iter().enumerate() {
        let lead = if accepted.len() == 1 { String::new() } else { format!("{}. ", number + 1) };
        sheet.line(&format!("  {lead}{}", candidate.name));
        if !candidate.title.is_empty() {
            sheet.paragraph(&candidate.title, 5);
        }
        if let Some(refit) = &candidate.refit {
            strengths(sheet, refit);
        }
        if !candidate.same_as.is_empty() {
            sheet.paragraph(&format!("the very same force as {}", candidate.same_as.join(", ")), 5);
        }
        let others: Vec<&str> = step.rivals().into_iter().filter(|name| *name != candidate.name).collect();
        if !others.is_empty() {
            sheet.paragraph(&format!("cannot be told apart from: {}", others.join(", ")), 5);
        }
        sheet.paragraph(&step.judgement, 5);
    }
}

fn strengths(sheet: &mut Sheet, refit: &Refit) {
    for (name, value, interval, unit) in &refit.parameters {
        let deviation = interval.map(|(low, high)| (high - low) / 3.92);
        let value = number::with_deviation(*value, deviation);
        sheet.line(&format!("     {name} = {value} {unit}  (95 %: {})", number::interval_text(*interval)));
    }
}

fn anatomy(sheet: &mut Sheet, answer: &Answer) {
    if answer.anatomy.is_empty() {
        return;
    }
    sheet.heading("What the base model leaves unexplained");
    let mut table = Table::new(&[
        ("record", Lean::Left),
        ("channel", Lean::Left),
        ("residual", Lean::Right),
        ("noise", Lean::Right),
        ("unit", Lean::Left),
        ("white (p)", Lean::Right),
        ("strongest band", Lean::Left),
        ("goes along with", Lean::Left),
    ]);
    for channel in &answer.anatomy {
        let band = channel.bands.iter().max_by(|a, b| a.2.total_cmp(&b.2));
        table.row(vec![
            channel.experiment.clone(),
            channel.channel.clone(),
            number::significant(channel.residual_rms, 3),
            number::significant(channel.noise_rms, 3),
            channel.unit.clone(),
            number::probability(channel.whiteness_p),
            band.map_or(String::new(), |(from, to, share)| {
                format!(
                    "{} .. {} Hz ({} %)",
                    number::short(*from, 3),
                    number::short(*to, 3),
                    number::fixed(100.0 * share, 0)
                )
            }),
            strongest_correlation(&channel.correlations),
        ]);
    }
    sheet.table(&table, 2);
}

fn strongest_correlation(correlations: &[(String, f64)]) -> String {
    let strongest = correlations.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    strongest.map_or(String::new(), |(name, r)| format!("{name} (r = {})", number::fixed(*r, 2)))
}

fn ranking(sheet: &mut Sheet, index: usize, step: &Step) {
    sheet.heading(&format!("Ranking, round {} ({} candidates screened)", index + 1, step.screened));
    let mut table = Table::new(&[
        ("", Lean::Right),
        ("candidate", Lean::Left),
        ("predicted", Lean::Right),
        ("BIC", Lean::Right),
        ("estimation", Lean::Right),
        ("held out", Lean::Right),
        ("change (95 %)", Lean::Right),
        ("weight", Lean::Right),
        ("", Lean::Left),
    ]);
    for (place, candidate) in step.ranking.iter().enumerate().take(SHOWN) {
        table.row(candidate_row(step, place, candidate));
    }
    sheet.table(&table, 2);
    if !step.judgement.is_empty() {
        sheet.paragraph(&step.judgement, 2);
    }
}

fn candidate_row(step: &Step, place: usize, candidate: &Candidate) -> Vec<String> {
    let refit = candidate.refit.as_ref();
    vec![
        (place + 1).to_string(),
        candidate.name.clone(),
        format!("{} %", number::fixed(100.0 * candidate.predicted_gain, 1)),
        refit.map_or(String::new(), |refit| {
            number::signed(refit.bic_difference, number::fixed(refit.bic_difference, 0))
        }),
        refit.map_or(String::new(), |refit| number::percent(refit.estimation_discrepancy)),
        refit.and_then(|refit| refit.validation_discrepancy).map_or(String::new(), number::percent),
        refit.and_then(words::held_out_change).unwrap_or_default(),
        candidate.confidence.map_or(String::new(), |weight| number::fixed(weight, 2)),
        words::standing(step, place),
    ]
}

/// The remarks of the answer and of the fit it ends with, each once.
fn remarks(answer: &Answer) -> Vec<String> {
    let mut remarks = answer.remarks.clone();
    for remark in &answer.extended.remarks {
        if !remarks.contains(remark) {
            remarks.push(remark.clone());
        }
    }
    remarks
}

fn next(sheet: &mut Sheet, answer: &Answer) {
    let Some(extension) = &answer.extension else { return };
    sheet.heading("Extension");
    extension.lines().for_each(|line| sheet.line(&format!("  {line}")));
    if let Some(command) = words::next_step(answer) {
        sheet.heading("Next");
        sheet.line(&format!("  {command}    puts it into the study as a variant"));
    }
    sheet.line("");
    sheet.line(&format!("{} simulations", number::count(answer.simulations)));
}
