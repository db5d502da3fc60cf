//! From the tree of a study's text to a checked [`Study`]: names resolved, dimensions checked, laws and effects
//! inlined, the chosen variant applied.
//!
//! *In*: a [`crate::syntax`] tree and the name of a variant. *Out*: a [`Study`], or diagnostics. *Must not happen
//! here*: kinematics (elements refer to their coordinates by symbols that [`crate::mechanics`] replaces), numbers
//! that depend on data, file access other than `use` of further study files.

mod assemble;
mod bodies;
mod channels;
mod checker;
mod couplings;
mod declarations;
mod effects;
mod elaborate;
mod elastic;
mod elements;
mod evaluate;
mod events;
mod experiments;
mod fields;
mod functions;
mod gravity;
mod identify;
mod instance;
mod joints;
mod kinds;
mod load;
mod manoeuvres;
mod model;
mod modes;
mod names;
mod normal;
mod nuisance;
mod parts;
mod paths;
mod places;
mod ports;
mod tables;
mod topology;
mod trial;
mod units;

pub use elastic::{Elastic, ElasticFrame, Mode, ModeShape};
pub use load::{Loaded, load, load_text};
pub use model::*;

use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::{Tree, print};

/// A study without errors, and what should be said about it nevertheless.
#[derive(Clone, Debug)]
pub struct Checked {
    pub study: Study,
    /// Warnings and notes.
    pub warnings: Vec<Diagnostic>,
}

/// The study with models, parts, families and the variant written out, as text.
///
/// # Errors
/// All findings of reading and writing out when at least one of them is an error.
pub fn flat_text(loaded: &Loaded, variant: Option<&str>) -> Result<String, Vec<Diagnostic>> {
    let mut findings = loaded.diagnostics.clone();
    let flat = elaborate::elaborate(loaded, variant, &mut findings);
    if findings.iter().any(Diagnostic::is_error) {
        return Err(findings);
    }
    let items = flat.items.into_iter().map(|flat| flat.item).collect();
    Ok(print(&Tree { items }))
}

/// Does with a text all that is done before data are needed: reading, formatting, checking with every variant, showing
/// the findings. For tests with texts that nobody would write; returns the number of findings.
pub fn probe(text: &str) -> usize {
    let loaded = load_text("probe", text);
    let _ = crate::syntax::format(loaded.study_file(), text);
    let mut findings = check(&loaded, None).map_or_else(|findings| findings, |checked| checked.warnings);
    let variants = elaborate::elaborate(&loaded, None, &mut Vec::new()).variants;
    for variant in variants.iter().take(3) {
        findings.extend(check(&loaded, Some(&variant.text)).map_or_else(|more| more, |checked| checked.warnings));
    }
    let shown = &findings[..findings.len().min(100)];
    crate::diagnostics::render(shown, &loaded.sources, false);
    findings.len()
}

/// Checks a study with one of its variants (`None` or `base`: none).
///
/// # Errors
/// All findings of reading and checking when at least one of them is an error, in order of their places.
pub fn check(loaded: &Loaded, variant: Option<&str>) -> Result<Checked, Vec<Diagnostic>> {
    let mut findings = Vec::new();
    let flat = elaborate::elaborate(loaded, variant, &mut findings);
    if flat.is_too_large {
        findings.extend(loaded.diagnostics.iter().cloned());
        return Err(findings);
    }
    let declarations = declarations::collect(loaded, &flat, &mut findings);
    let mut checker = checker::Checker::new(loaded, &declarations, findings);
    let study = checker.study();
    let mut findings = checker.diagnostics;
    if loaded.diagnostics.iter().any(Diagnostic::is_error) {
        // What could not be read is missing; what depends on it is no finding of its own.
        let is_consequence = |code: Code| {
            [
                Code::UNKNOWN_NAME,
                Code::NOT_IDENTIFIED,
                Code::UNUSED_PARAMETER,
                Code::UNCONNECTED_BODY,
                Code::NO_STUDY,
                Code::MISSING_FIELD,
                Code::IDENTIFY_TARGET,
            ]
            .contains(&code)
        };
        findings.retain(|finding| !is_consequence(finding.code));
    }
    findings.extend(loaded.diagnostics.iter().cloned());
    if findings.iter().any(Diagnostic::is_error) {
        // What would use it may be what has the error.
        let is_alone = findings.iter().filter(|f| f.is_error()).all(|finding| finding.code == Code::UNUSED_PARAMETER);
        findings.retain(|finding| {
            (finding.is_error() || finding.code != Code::UNUSED_DECLARATION)
                && (is_alone || finding.code != Code::UNUSED_PARAMETER)
        });
    }
    findings.sort_by_key(|finding| finding.span().map(|span| (span.file, span.start)));
    match study {
        Some(study) if !findings.iter().any(Diagnostic::is_error) => Ok(Checked { study, warnings: findings }),
        _ => Err(findings),
    }
}
