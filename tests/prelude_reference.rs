//! `docs/prelude.md` is what the prelude's own remarks say. `PRELUDE_UPDATE=1` writes it anew.

use ident::study::load_text;
use ident::syntax::{Declared, ItemKind, print_item};
use std::fmt::Write;
use std::fs;
use std::path::Path;

fn table(text: &mut String, sort: &str, declared: &[Declared]) {
    for item in declared {
        let kind = item.kind.as_ref().map(|kind| {
            let factors = kind.factors.iter().map(|(name, power)| format!("{}^{power}", name.text));
            factors.collect::<Vec<_>>().join(" ").replace("^1", "")
        });
        let about = item.documentation.replace('\n', " ");
        let _ = writeln!(text, "| {sort} | `{}` | {} | {about} |", item.name.text, kind.unwrap_or_default());
    }
}

fn reference() -> String {
    let mut text = String::from(
        "# The prelude\n\nLaws, models and effects that ship with the tool. They are written in the language itself \
         (`grammar/prelude`); this page is made from their remarks. The line that begins with `=` is the characteristic; `ident law NAME \
         --figure FILE` draws it with the numbers of the example.\n",
    );
    let loaded = load_text("empty", "study s");
    for (tree, _) in loaded.trees().filter(|(_, is_prelude)| *is_prelude) {
        for item in &tree.items {
            let printed = print_item(item);
            let code: String =
                printed.lines().filter(|line| !line.starts_with("///")).map(|l| format!("{l}\n")).collect();
            let (name, rows) = match &item.kind {
                ItemKind::Law(law) => {
                    let mut rows = String::new();
                    table(&mut rows, "port", &law.ports);
                    table(&mut rows, "parameter", &law.parameters);
                    (format!("law `{}`", law.name.text), rows)
                }
                ItemKind::Effect(effect) => {
                    let mut rows = String::new();
                    table(&mut rows, "amplitude", &effect.amplitudes);
                    table(&mut rows, "shape", &effect.shapes);
                    (format!("effect `{}`", effect.name.text), rows)
                }
                ItemKind::Model(model) => {
                    let mut rows = String::new();
                    for port in &model.ports {
                        let _ = writeln!(rows, "| port | `{}` | {} | |", port.name.text, port.kind.text);
                    }
                    table(&mut rows, "parameter", &model.parameters);
                    (format!("model `{}`", model.name.text), rows)
                }
                _ => continue,
            };
            assert!(!item.documentation.is_empty(), "{name} says nothing about itself");
            let _ = write!(text, "\n## {name}\n\n{}\n", item.documentation);
            if !rows.is_empty() {
                let _ = write!(text, "\n| | name | type | |\n| --- | --- | --- | --- |\n{rows}");
            }
            let _ = write!(text, "\n```ident\n{code}```\n");
        }
    }
    text
}

#[test]
fn the_reference_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/prelude.md");
    let wanted = reference();
    if std::env::var_os("PRELUDE_UPDATE").is_some() {
        fs::write(&path, &wanted).expect("docs/prelude.md");
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(found == wanted, "docs/prelude.md is stale: run this test with PRELUDE_UPDATE=1");
}
