//! Reports for a terminal: the verdict first, then what supports it; at most about 100 columns.
//!
//! *In*: results. *Out*: text ending in a newline. *Must not happen here*: asking what kind of terminal it is (the
//! caller says [`Colour`]), progress.

mod answer;
mod identification;
mod plan;
mod sheet;
mod surface;
mod table;
mod validity;

use crate::analyse::{Courses, Cuts, Descents, Plan, Validity};
use crate::diagnose::Answer;
use crate::identify::Identification;

/// Whether to emphasise with ANSI sequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    Never,
    Always,
}

/// The answer of a diagnosis, without colours.
pub fn answer(answer: &Answer) -> String {
    answer_in(answer, Colour::Never)
}

/// The answer of a diagnosis.
pub fn answer_in(answer: &Answer, colour: Colour) -> String {
    answer::text(answer, colour)
}

/// The result of a fit, without colours.
pub fn identification(fit: &Identification) -> String {
    identification_in(fit, Colour::Never)
}

/// The result of a fit.
pub fn identification_in(fit: &Identification, colour: Colour) -> String {
    identification::text(fit, colour)
}

/// Variants side by side, without colours.
pub fn comparison(variants: &[Identification]) -> String {
    comparison_in(variants, Colour::Never)
}

/// Variants side by side; the first one is the base to which differences refer.
pub fn comparison_in(variants: &[Identification], colour: Colour) -> String {
    identification::comparison(variants, colour)
}

/// Verdicts on criteria, without colours.
pub fn validity(result: &Validity) -> String {
    validity_in(result, Colour::Never)
}

/// Verdicts on criteria.
pub fn validity_in(result: &Validity, colour: Colour) -> String {
    validity::text(result, colour)
}

/// What tests would tell, without colours.
pub fn plan(result: &Plan) -> String {
    plan_in(result, Colour::Never)
}

/// What tests would tell.
pub fn plan_in(result: &Plan, colour: Colour) -> String {
    plan::text(result, colour)
}

/// Gradients side by side, without colours.
pub fn descents(result: &Descents) -> String {
    surface::descents(result, Colour::Never)
}

/// Optimisers side by side, without colours.
pub fn courses(result: &Courses) -> String {
    surface::courses(result, Colour::Never)
}

/// Cuts of the cost, without colours.
pub fn cuts(result: &Cuts) -> String {
    surface::cuts(result, Colour::Never)
}
