//! What the templates show, as finished words and pictures.

use super::anatomy::{self, AnatomyRow};
use super::certainty::{self, CertaintyView};
use super::discrepancy::{self, TreeRow};
use super::histories::{self, Curve, RecordView};
use super::missing::{self, MissingView};
use super::parameters::{self, ParameterRow};
use super::ranking::{self, RoundView};
use crate::analyse::Cuts;
use crate::diagnose::{Answer, Verdict};
use crate::identify::Identification;
use crate::report::chart::Style;
use crate::report::{number, surface, words};
use serde::Serialize;

#[derive(Serialize)]
pub struct AnswerView {
    title: String,
    study: String,
    verdict: &'static str,
    verdict_class: &'static str,
    summary: String,
    roles: String,
    figures: Vec<KeyFigure>,
    missing: Vec<MissingView>,
    rounds: Vec<RoundView>,
    anatomy: Vec<AnatomyRow>,
    extension: Option<String>,
    next: Option<String>,
    cannot_judge: Vec<String>,
    remarks: Vec<String>,
    #[serde(flatten)]
    fits: FitsView,
}

/// What all pages share: one or several fits of the same records.
#[derive(Serialize)]
pub struct FitsView {
    legend: Vec<LegendEntry>,
    histories: Vec<RecordView>,
    tree: Vec<TreeRow>,
    parameters: Vec<ParameterRow>,
    parameter_notes: Vec<String>,
    works: Vec<WorkView>,
}

#[derive(Serialize)]
pub struct LegendEntry {
    name: String,
    class: &'static str,
}

#[derive(Serialize)]
pub struct KeyFigure {
    label: String,
    before: Option<String>,
    value: String,
    note: String,
}

/// How a fit went.
#[derive(Serialize)]
pub struct WorkView {
    variant: String,
    estimation: String,
    validation: String,
    bic: String,
    residuals: String,
    effective: String,
    iterations: usize,
    simulations: usize,
    failed: usize,
    stopped: String,
    gradient: String,
    singular_values: String,
    remarks: Vec<String>,
}

#[derive(Serialize)]
pub struct FitPage {
    title: String,
    figures: Vec<KeyFigure>,
    remarks: Vec<String>,
    certainty: Option<CertaintyView>,
    error: Vec<String>,
    /// One picture per parameter.
    cuts: Vec<String>,
    #[serde(flatten)]
    fits: FitsView,
}

#[derive(Serialize)]
pub struct ComparisonPage {
    title: String,
    base: String,
    structure_heads: [&'static str; 8],
    structures: Vec<[String; 8]>,
    #[serde(flatten)]
    fits: FitsView,
}

/// The fits whose curves the page of an answer shows: base, and the extension where there is one.
pub fn answer_curves(answer: &Answer) -> Vec<Curve<'_>> {
    let accepted = answer.extension.is_some();
    let name = if accepted { "simulated before" } else { "simulated" };
    let mut curves = vec![Curve { name: name.into(), style: Style::Before, fit: &answer.base }];
    if accepted {
        curves.push(Curve { name: "simulated after".into(), style: Style::After, fit: &answer.extended });
    }
    curves
}

pub fn fit_curves(fit: &Identification) -> Vec<Curve<'_>> {
    vec![Curve { name: "simulated".into(), style: Style::After, fit }]
}

pub fn variant_curves(variants: &[Identification]) -> Vec<Curve<'_>> {
    let curve = |(index, fit)| {
        let fit: &Identification = fit;
        Curve { name: fit.variant.clone(), style: Style::Variant(index), fit }
    };
    variants.iter().enumerate().map(curve).collect()
}

pub fn answer(answer: &Answer) -> AnswerView {
    let verdict_class = match answer.verdict {
        Verdict::NothingWrongFound | Verdict::CauseNamed => "good",
        Verdict::GroupOfCauses | Verdict::ShapeWithoutName | Verdict::NoCauseFound => "fair",
        Verdict::CannotBeJudged => "open",
    };
    AnswerView {
        title: answer.title.clone(),
        study: answer.study.clone(),
        verdict: words::verdict(&answer.verdict),
        verdict_class,
        summary: answer.summary.clone(),
        roles: answer.roles.clone(),
        figures: answer_figures(answer),
        missing: missing::views(answer),
        rounds: ranking::rounds(answer),
        anatomy: anatomy::rows(answer),
        extension: answer.extension.clone(),
        next: words::next_step(answer),
        cannot_judge: answer.cannot_judge.clone(),
        remarks: answer.remarks.clone(),
        fits: fits(&answer_curves(answer)),
    }
}

pub fn identification(fit: &Identification, cuts: Option<&Cuts>) -> FitPage {
    FitPage {
        title: format!("Fit of variant {}", fit.variant),
        figures: discrepancy_figures(fit, None),
        remarks: fit.remarks.clone(),
        certainty: certainty::view(fit),
        error: error_lines(fit),
        cuts: cuts.map_or_else(Vec::new, |cuts| cuts.parameters.iter().map(surface::cut_svg).collect()),
        fits: fits(&fit_curves(fit)),
    }
}

/// What counted as error, and why nothing else did.
fn error_lines(fit: &Identification) -> Vec<String> {
    let error = &fit.error;
    let used = format!("{}: {}", error.used, error.reason);
    let noise = error.process_noise.iter();
    let noise = noise.map(|(state, level)| {
        format!("process noise on {state}: {} (SI, per root of Hz)", number::significant(*level, 3))
    });
    let others = error.others.iter().map(|other| format!("not {}: {}", other.name, other.why));
    std::iter::once(used).chain(noise).chain(others).collect()
}

pub fn comparison(variants: &[Identification]) -> ComparisonPage {
    let names: Vec<&str> = variants.iter().map(|fit| fit.variant.as_str()).collect();
    ComparisonPage {
        title: format!("Variants {}", names.join(", ")),
        base: names.first().copied().unwrap_or_default().to_owned(),
        structure_heads: words::STRUCTURE_HEADS,
        structures: words::structures(variants),
        fits: fits(&variant_curves(variants)),
    }
}

fn fits(curves: &[Curve]) -> FitsView {
    FitsView {
        legend: curves.iter().map(legend_entry).collect(),
        histories: histories::views(curves),
        tree: discrepancy::rows(curves),
        parameters: parameters::rows(curves),
        parameter_notes: parameters::notes(curves),
        works: curves.iter().map(|curve| work(curve.fit)).collect(),
    }
}

/// The variant's name, with its place in time where the curve says one.
fn legend_entry(curve: &Curve) -> LegendEntry {
    let when = ["before", "after"].into_iter().find(|word| curve.name.ends_with(word));
    let name = when.map_or(curve.fit.variant.clone(), |when| format!("{when}: {}", curve.fit.variant));
    LegendEntry { name, class: curve.style.class() }
}

fn answer_figures(answer: &Answer) -> Vec<KeyFigure> {
    let extended = answer.extension.is_some().then_some(&answer.extended);
    let mut figures = discrepancy_figures(&answer.base, extended);
    let rounds = answer.steps.len();
    figures.push(KeyFigure {
        label: "Candidates screened".into(),
        before: None,
        value: number::count(answer.steps.iter().map(|step| step.screened).max().unwrap_or(0)),
        note: format!(
            "{rounds} round{}, {} simulations",
            if rounds == 1 { "" } else { "s" },
            number::count(answer.simulations)
        ),
    });
    figures
}

/// Discrepancy on estimation and held-out data, before and after.
fn discrepancy_figures(base: &Identification, extended: Option<&Identification>) -> Vec<KeyFigure> {
    let figure = |label: &str, before: f64, after: Option<f64>| {
        let change = after.and_then(|after| words::relative_change(before, after));
        KeyFigure {
            label: label.into(),
            before: after.map(|_| number::percent(before)),
            value: number::percent(after.unwrap_or(before)),
            note: change
                .map_or(String::new(), |change| format!("{} %", number::signed(change, number::fixed(change, 0)))),
        }
    };
    let estimation = figure(
        "Discrepancy, estimation data",
        base.estimation_discrepancy,
        extended.map(|fit| fit.estimation_discrepancy),
    );
    let held_out = match base.validation_discrepancy {
        Some(before) => {
            let after = extended.and_then(|fit| fit.validation_discrepancy);
            figure("Discrepancy, held-out data", before, after)
        }
        None => KeyFigure {
            label: "Discrepancy, held-out data".into(),
            before: None,
            value: "-".into(),
            note: "the study has no validation record".into(),
        },
    };
    vec![estimation, held_out]
}

fn work(fit: &Identification) -> WorkView {
    let singular: Vec<String> = fit.singular_values.iter().map(|value| number::significant(*value, 2)).collect();
    WorkView {
        variant: fit.variant.clone(),
        estimation: number::percent(fit.estimation_discrepancy),
        validation: fit.validation_discrepancy.map_or("-".into(), number::percent),
        bic: number::fixed(fit.bic, 1),
        residuals: number::count(fit.residual_count),
        effective: number::fixed(fit.effective_count, 0),
        iterations: fit.iterations,
        simulations: fit.simulations,
        failed: fit.failed_simulations,
        stopped: fit.stop_reason.clone(),
        gradient: fit
            .gradient_digits
            .map_or("not checked".into(), |digits| format!("{} digits", number::fixed(digits, 1))),
        singular_values: singular.join(", "),
        remarks: fit.remarks.clone(),
    }
}
