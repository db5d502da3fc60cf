//! Variants: their order and what each changes.

use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::syntax::{Change, ItemKind, Name};
use std::collections::{BTreeSet, HashMap};

pub(super) struct Variant<'a> {
    pub name: &'a Name,
    pub base: &'a Name,
    pub changes: &'a [Change],
}

/// Names of variants are unique and their bases exist and end at `base`, whether or not they are applied.
pub(super) fn check(variants: &[Variant<'_>], diagnostics: &mut Vec<Diagnostic>) {
    let names: BTreeSet<&str> = variants.iter().map(|variant| variant.name.text.as_str()).collect();
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
        if variant.base.text != "base" && !names.contains(variant.base.text.as_str()) {
            diagnostics.push(unknown_variant(&variant.base.text, variants).label(variant.base.span, "not declared"));
        }
    }
    let by_name: HashMap<&str, usize> =
        variants.iter().enumerate().map(|(at, variant)| (variant.name.text.as_str(), at)).collect();
    let base_of = |at: usize| by_name.get(variants[at].base.text.as_str()).copied();
    // Each variant is walked over once; a walk that meets itself has found a cycle.
    let mut walk_of: Vec<Option<usize>> = vec![None; variants.len()];
    for start in 0..variants.len() {
        let mut path = Vec::new();
        let mut current = Some(start);
        while let Some(at) = current.filter(|at| walk_of[*at].is_none()) {
            walk_of[at] = Some(start);
            path.push(at);
            current = base_of(at);
        }
        if let Some(met) = current.filter(|at| walk_of[*at] == Some(start))
            && let Some(begin) = path.iter().position(|at| *at == met)
        {
            diagnostics.push(cycle(variants, &path[begin..]));
        }
    }
}

/// Told at the member that comes first in the text.
fn cycle(variants: &[Variant<'_>], members: &[usize]) -> Diagnostic {
    let first = members.iter().copied().min_by_key(|at| variants[*at].name.span.start).unwrap_or(0);
    let begin = members.iter().position(|at| *at == first).unwrap_or(0);
    let ordered: Vec<usize> = members[begin..].iter().chain(&members[..begin]).copied().collect();
    let names: Vec<&str> = ordered.iter().take(20).map(|at| variants[*at].name.text.as_str()).collect();
    let mut diagnostic =
        Diagnostic::error(Code::CYCLIC_DEFINITION, format!("variants are based on each other: {}", names.join(", ")))
            .label(variants[first].base.span, "leads back to this variant");
    for at in ordered.iter().skip(1).take(20) {
        diagnostic = diagnostic.secondary(variants[*at].name.span, "on the way");
    }
    diagnostic.help("one of them must be `of base`")
}

fn unknown_variant(name: &str, variants: &[Variant<'_>]) -> Diagnostic {
    let names = || variants.iter().map(|variant| variant.name.text.as_str()).chain(["base"]);
    let known: Vec<String> = names().take(30).map(|name| format!("`{name}`")).collect();
    Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no variant `{name}`"))
        .suggest(similar_name(name, names()))
        .note(format!("declared: {}", known.join(", ")))
}

/// The changes that lead from the base study to the variant `name`, in order.
pub(super) fn changes<'a>(variants: &[Variant<'a>], name: &str, diagnostics: &mut Vec<Diagnostic>) -> Vec<&'a Change> {
    let Some(chosen) = variants.iter().find(|variant| variant.name.text == name) else {
        diagnostics.push(unknown_variant(name, variants));
        return Vec::new();
    };
    let by_name: HashMap<&str, &Variant<'a>> =
        variants.iter().map(|variant| (variant.name.text.as_str(), variant)).collect();
    let mut chain = Vec::new();
    let mut seen = BTreeSet::new();
    let mut current = Some(chosen);
    // A circle is reported elsewhere.
    while let Some(variant) = current.filter(|variant| seen.insert(variant.name.text.as_str())) {
        chain.push(variant);
        current = by_name.get(variant.base.text.as_str()).copied();
    }
    chain.into_iter().rev().flat_map(|variant| variant.changes).collect()
}

/// The name by which `remove` and `replace` find an item.
pub(super) fn declared_name(kind: &ItemKind) -> Option<&Name> {
    match kind {
        ItemKind::Constant { name, .. }
        | ItemKind::Input { name, .. }
        | ItemKind::Body { name, .. }
        | ItemKind::Joint { name, .. }
        | ItemKind::Coupling { name, .. }
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
