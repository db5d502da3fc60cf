//! The accepted extension as text in the study's own language.

use super::candidates::Candidate;
use crate::simulation::Compiled;
use crate::study::Study;

/// Name for the variant that adds `candidate`, unused so far in `study`.
pub(super) fn variant_name(study: &Study, candidate: &Candidate) -> String {
    let wanted = if candidate.change.is_empty() {
        format!("free_{}", candidate.place.replace('.', "_"))
    } else {
        format!("{}_{}", candidate.place.replace('.', "_"), candidate.effect)
    };
    let used = |name: &str| study.variants.iter().any(|variant| variant == name);
    if !used(&wanted) {
        return wanted;
    }
    (2..).map(|count| format!("{wanted}_{count}")).find(|name| !used(name)).unwrap_or(wanted)
}

/// The variant's text, starting at the values `theta` of the parameters of `compiled`.
pub(super) fn variant_text(
    name: &str,
    base: &str,
    candidate: &Candidate,
    compiled: &Compiled,
    theta: &[f64],
) -> String {
    let values: Vec<f64> = candidate
        .unknowns
        .iter()
        .map(|unknown| {
            let position = compiled.study.parameters.iter().position(|p| p.name == unknown.target);
            position.map_or(unknown.neutral, |index| theta[index])
        })
        .collect();
    let text = candidate.variant(name, base, &values);
    if candidate.title.is_empty() { text } else { format!("/// {}\n{text}", candidate.title) }
}
