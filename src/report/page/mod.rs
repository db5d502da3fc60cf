//! One self-contained page per result: styles, script, data and pictures inside, no request to the outside.
//!
//! *In*: results. *Out*: HTML text. Pictures are SVG and readable without scripts; histories become zoomable where
//! scripts run (uPlot, licence beside it in `vendor/uplot`). *Must not happen here*: files, judgements.

mod anatomy;
mod certainty;
mod discrepancy;
mod histories;
mod missing;
mod parameters;
mod plan;
mod ranking;
mod template;
mod validity;
mod view;

pub(crate) use missing::{ordered as places, over_rate as missing_over_rate};
pub use template::RenderError;

use crate::analyse::{Cuts, Plan, Validity};
use crate::diagnose::Answer;
use crate::identify::Identification;

/// The answer of a diagnosis as a page.
///
/// # Errors
/// When the embedded template cannot be rendered: a defect of the program, told with the template's line.
pub fn answer(answer: &Answer) -> Result<String, RenderError> {
    template::render("answer.html", &view::answer(answer), &histories::data(&view::answer_curves(answer)))
}

/// The result of a fit as a page, with cuts of its cost where they were asked for.
///
/// # Errors
/// As [`answer`].
pub fn identification(fit: &Identification, cuts: Option<&Cuts>) -> Result<String, RenderError> {
    template::render("fit.html", &view::identification(fit, cuts), &histories::data(&view::fit_curves(fit)))
}

/// Variants side by side as a page; the first one is the base.
///
/// # Errors
/// As [`answer`].
pub fn comparison(variants: &[Identification]) -> Result<String, RenderError> {
    template::render("comparison.html", &view::comparison(variants), &histories::data(&view::variant_curves(variants)))
}

/// Verdicts on criteria as a page.
///
/// # Errors
/// As [`answer`].
pub fn validity(result: &Validity) -> Result<String, RenderError> {
    template::render("validity.html", &validity::view(result), "[]")
}

/// What tests would tell, as a page.
///
/// # Errors
/// As [`answer`].
pub fn plan(result: &Plan) -> Result<String, RenderError> {
    template::render("plan.html", &plan::view(result), "[]")
}
