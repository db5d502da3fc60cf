//! Wording shared by all forms of a report.

use crate::analyse::{self, Combination, CriterionValidity, Demand, Plan};
use crate::diagnose::{Answer, Candidate, Refit, Step, Verdict};
use crate::identify::{Identification, RecordFit};
use crate::report::number;

/// Correlations of estimates from here on are pointed out.
pub const STRONG_CORRELATION: f64 = 0.9;

/// The verdict as a heading.
pub fn verdict(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::NothingWrongFound => "Nothing wrong found",
        Verdict::NoCauseFound => "No cause found for what is left",
        Verdict::CauseNamed => "Cause named",
        Verdict::GroupOfCauses => "Group of causes that cannot be told apart",
        Verdict::ShapeWithoutName => "A missing force whose cause is not in the catalogue",
        Verdict::CannotBeJudged => "Cannot be judged with this data",
    }
}

/// The role of a record as a reader understands it.
pub fn role(role: &str) -> &str {
    match role {
        "validation" => "validation (held out)",
        "test" => "test (looked at once)",
        other => other,
    }
}

/// The accepted candidates of all rounds, in order.
pub fn accepted(answer: &Answer) -> Vec<(&Step, &Candidate)> {
    let of_step = |step| -> Option<(&Step, &Candidate)> {
        let step: &Step = step;
        Some((step, step.ranking.get(step.accepted?)?))
    };
    answer.steps.iter().filter_map(of_step).collect()
}

/// The record of `other` that stands for the same measurement as `record`.
pub fn counterpart<'a>(record: &RecordFit, other: &'a Identification) -> Option<&'a RecordFit> {
    other.records.iter().find(|candidate| {
        candidate.experiment == record.experiment && candidate.file == record.file && candidate.role == record.role
    })
}

/// Pairs of parameters whose estimates move together: (first, second, correlation), strongest first.
pub fn strong_correlations(fit: &Identification) -> Vec<(&str, &str, f64)> {
    let mut pairs = Vec::new();
    for (row, first) in fit.parameters.iter().enumerate() {
        for (column, second) in fit.parameters.iter().enumerate().skip(row + 1) {
            let correlation = fit.correlation.get(row).and_then(|line| line.get(column)).copied().unwrap_or(0.0);
            if correlation.abs() >= STRONG_CORRELATION {
                pairs.push((first.name.as_str(), second.name.as_str(), correlation));
            }
        }
    }
    pairs.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
    pairs
}

/// 95 % interval of the relative change of the held-out error, as `-70 .. -64 %`.
pub fn held_out_change(refit: &Refit) -> Option<String> {
    let (low, high) = refit.validation_change?;
    let decimals = usize::from((high - low).abs() < 10.0);
    Some(format!("{} .. {} %", number::fixed(low, decimals), number::fixed(high, decimals)))
}

/// How a candidate fared in its round: `accepted`, `not told apart`, its objection, or nothing.
pub fn standing(step: &Step, index: usize) -> String {
    let Some(candidate) = step.ranking.get(index) else { return String::new() };
    if step.accepted == Some(index) {
        return "accepted".into();
    }
    let objection = candidate.refit.as_ref().and_then(|refit| refit.objection.clone());
    let rivals = step.rivals();
    let in_group = rivals.len() > 1 && rivals.contains(&candidate.name.as_str());
    match (in_group, objection) {
        (true, _) => "cannot be told apart".into(),
        (false, Some(objection)) => objection,
        (false, None) => String::new(),
    }
}

/// Heads of the columns of [`structures`]; the first and the last one are text.
pub const STRUCTURE_HEADS: [&str; 8] =
    ["variant", "AICc", "BIC", "likelihood ratio", "p", "Vuong z", "p ", "held-out error, 95 % interval"];

/// Every structure but the first one against it, a row each; empty where structures were not compared.
pub fn structures(variants: &[Identification]) -> Vec<[String; 8]> {
    let Some(first) = variants.first().and_then(|base| base.structure.as_ref()) else { return Vec::new() };
    let text = |value: Option<f64>, show: &dyn Fn(f64) -> String| value.map_or_else(String::new, show);
    let percent = |value: f64| number::signed(value, number::fixed(100.0 * value, 1));
    let compared = variants[1..].iter().filter_map(|fit| Some((fit, fit.structure.as_ref()?)));
    compared
        .map(|(fit, structure)| {
            [
                fit.variant.clone(),
                number::fixed(structure.aicc - first.aicc, 1),
                number::fixed(structure.bic - first.bic, 1),
                text(structure.likelihood_ratio, &|value| number::fixed(value, 1)),
                text(structure.likelihood_ratio_p, &number::probability),
                text(structure.vuong_z, &|value| number::fixed(value, 2)),
                text(structure.vuong_p, &number::probability),
                structure.held_out_change.map_or_else(String::new, |(change, low, high)| {
                    format!("{} % ({} .. {})", percent(change), percent(low), percent(high))
                }),
            ]
        })
        .collect()
}

/// `before -> after` change in per cent of the value before.
pub fn relative_change(before: f64, after: f64) -> Option<f64> {
    (before > 0.0 && before.is_finite() && after.is_finite()).then(|| 100.0 * (after / before - 1.0))
}

/// The command that writes the extension into the study.
pub fn next_step(answer: &Answer) -> Option<String> {
    answer.extension.as_ref().map(|_| format!("ident diagnose {} --write", answer.file))
}

/// The verdict on a criterion in words.
pub fn validity(criterion: &CriterionValidity) -> &'static str {
    match (criterion.verdict, criterion.demand) {
        (analyse::Verdict::Valid, Demand::Met) => "VALID: the demand is met",
        (analyse::Verdict::Valid, Demand::Violated) => "VALID: the demand is violated",
        (analyse::Verdict::Valid, _) => "VALID",
        (analyse::Verdict::NotValid, _) => "NOT VALID",
        (analyse::Verdict::CannotBeJudged, _) => "CANNOT BE JUDGED",
    }
}

/// ANSI colour of the verdict on a criterion.
pub fn validity_colour(criterion: &CriterionValidity) -> &'static str {
    match (criterion.verdict, criterion.demand) {
        (analyse::Verdict::Valid, Demand::Violated) | (analyse::Verdict::NotValid, _) => "1;31",
        (analyse::Verdict::Valid, _) => "1;32",
        (analyse::Verdict::CannotBeJudged, _) => "1;33",
    }
}

/// Value of a combination and that with everything offered, with their units.
pub fn combination_values(plan: &Plan, choice: &Combination) -> (String, String) {
    let criteria = &plan.together.criteria;
    let unit = criteria.iter().find(|criterion| criterion.name == choice.measure).map(|criterion| &criterion.unit);
    let shown = |value: f64| match unit {
        Some(unit) => format!("{} {unit}", number::significant(value, 3)),
        None => format!("{} %", number::significant(100.0 * value, 3)),
    };
    (shown(choice.value), shown(choice.with_everything))
}

/// What the list of combinations means.
pub fn combination_note(plan: &Plan) -> &'static str {
    if plan.combinations.iter().all(|choice| choice.exact) {
        "D and A in % of the bounds, criteria as their standard deviation. Each line is the best of all choices of its size; larger ones are listed where they gain at least 5 %."
    } else {
        "D and A in % of the bounds, criteria as their standard deviation. Tests and sensors were added one after the other and exchanged; larger choices are listed where they gain at least 5 %."
    }
}

/// A factor on a test in whole repetitions: one where a part of it would do.
pub fn repetitions(factor: f64) -> String {
    number::fixed(factor.ceil().max(1.0), 0)
}
