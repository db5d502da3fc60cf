//! Variants: their order and what each changes.

use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::syntax::{Change, ItemKind, Name};
use std::collections::HashMap;

pub(super) struct Variant<'a> {
    pub name: &'a Name,
    pub base: &'a Name,
    pub changes: &'a [Change],
}

/// Names of variants are unique and their bases exist and end at `base`, whether or not they are applied.
pub(super) fn check(variants: &[Variant<'_>], diagnostics: &mut Vec<Diagnostic>) {
    let mut seen: HashMap<&str, &Name> = HashMap::new();
    for variant in variants {
        if variant.name.text == "base" {
            let message = "`base` is the study without a variant";
            diagnostics
                .push(Diagnostic::error(Code::DUPLICATE_NAME, message).label(variant.name.span, "choose another name"));
        }
        if let Some(first) = seen.insert(&variant.name.text, variant.name) {
            diagnostics.push(
                Diagnostic::error(Code::DUPLICATE_NAME, format!("variant `{}` is declared twice", variant.name.text))
                    .label(variant.name.span, "second declaration")
                    .secondary(first.span, "first declaration")
                    .help("rename or remove one of them"),
            );
        }
        if variant.base.text != "base" && !variants.iter().any(|other| other.name.text == variant.base.text) {
            diagnostics.push(unknown_variant(&variant.base.text, variants).label(variant.base.span, "not declared"));
        }
    }
    for variant in variants {
        let (_, cycle) = chain(variants, variant);
        // Each cycle is reported once, at its member that comes first in the text.
        if let Some(cycle) = cycle.filter(|cycle| cycle.iter().all(|name| name.span.start >= variant.name.span.start)) {
            let names: Vec<&str> = cycle.iter().map(|name| name.text.as_str()).collect();
            let mut diagnostic = Diagnostic::error(
                Code::CYCLIC_DEFINITION,
                format!("variants are based on each other: {}", names.join(", ")),
            )
            .label(variant.base.span, "leads back to this variant");
            for name in cycle.iter().filter(|name| name.text != variant.name.text) {
                diagnostic = diagnostic.secondary(name.span, "on the way");
            }
            diagnostics.push(diagnostic.help("one of them must be `of base`"));
        }
    }
}

fn unknown_variant(name: &str, variants: &[Variant<'_>]) -> Diagnostic {
    let names = || variants.iter().map(|variant| variant.name.text.as_str()).chain(["base"]);
    let known: Vec<String> = names().map(|name| format!("`{name}`")).collect();
    Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no variant `{name}`"))
        .suggest(similar_name(name, names()))
        .note(format!("declared: {}", known.join(", ")))
}

/// The variants from `last` down to the one `of base`; and the members of the cycle if there is no end.
fn chain<'v, 'a>(variants: &'v [Variant<'a>], last: &'v Variant<'a>) -> (Vec<&'v Variant<'a>>, Option<Vec<&'a Name>>) {
    let mut chain = vec![last];
    let mut current = last;
    while let Some(next) = variants.iter().find(|other| other.name.text == current.base.text) {
        if next.name.text == last.name.text {
            let cycle = chain.iter().map(|variant| variant.name).collect();
            return (chain, Some(cycle));
        }
        if chain.iter().any(|seen| seen.name.text == next.name.text) {
            // Runs into a cycle that does not contain `last`; that one is reported at its own members.
            return (chain, None);
        }
        chain.push(next);
        current = next;
    }
    (chain, None)
}

/// The changes that lead from the base study to the variant `name`, in order.
pub(super) fn changes<'a>(variants: &[Variant<'a>], name: &str, diagnostics: &mut Vec<Diagnostic>) -> Vec<&'a Change> {
    let Some(chosen) = variants.iter().find(|variant| variant.name.text == name) else {
        diagnostics.push(unknown_variant(name, variants));
        return Vec::new();
    };
    let (chain, _) = chain(variants, chosen);
    chain.into_iter().rev().flat_map(|variant| variant.changes).collect()
}

/// The name by which `remove` and `replace` find an item.
pub(super) fn declared_name(kind: &ItemKind) -> Option<&Name> {
    match kind {
        ItemKind::Constant { name, .. }
        | ItemKind::Input { name, .. }
        | ItemKind::Body { name, .. }
        | ItemKind::Joint { name, .. }
        | ItemKind::Element { name, .. }
        | ItemKind::Formula { name, .. }
        | ItemKind::Measure { name, .. }
        | ItemKind::Group { name, .. }
        | ItemKind::Experiment { name, .. }
        | ItemKind::Manoeuvre { name, .. }
        | ItemKind::Criterion { name, .. }
        | ItemKind::Part { name, .. } => Some(name),
        _ => None,
    }
}
