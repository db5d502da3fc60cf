//! Namespaces.

use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::Name;
use std::collections::BTreeMap;

/// Declared names with what they declare (`joint`).
pub(super) type Namespace<'a> = BTreeMap<&'a str, (&'static str, &'a Name)>;

/// Words that expressions already understand.
pub(super) const RESERVED: [&str; 4] = ["t", "pi", "ground", "total"];

/// Adds a name; reports it when it is taken or reserved.
pub(super) fn declare<'a>(
    names: &mut Namespace<'a>,
    sort: &'static str,
    name: &'a Name,
    diagnostics: &mut Vec<Diagnostic>,
) {
    if RESERVED.contains(&name.text.as_str()) {
        diagnostics.push(
            Diagnostic::error(Code::DUPLICATE_NAME, format!("`{}` has a meaning of its own", name.text))
                .label(name.span, "choose another name")
                .note("reserved: `t` (time), `pi`, `ground`, `total` (the group of all channels)"),
        );
    }
    if let Some((first_sort, first)) = names.insert(&name.text, (sort, name)) {
        diagnostics.push(
            Diagnostic::error(Code::DUPLICATE_NAME, format!("`{}` is declared twice", name.text))
                .label(name.span, format!("second declaration, {}", with_article(sort)))
                .secondary(first.span, format!("first declaration, {}", with_article(first_sort)))
                .help("rename one of them; in a variant use `replace` to exchange a declaration"),
        );
    }
}

fn with_article(noun: &str) -> String {
    format!("{} {noun}", article(noun))
}

pub(super) fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}
