//! Data flows one way: a module of the library uses only modules that stand above it in the list of `src/lib.rs`.

use std::fs;
use std::path::{Path, PathBuf};

/// The stages from `src/lib.rs`'s own diagram, in order.
fn stages() -> Vec<String> {
    let text = fs::read_to_string("src/lib.rs").expect("src/lib.rs");
    let diagram = text.split("```text").nth(1).and_then(|rest| rest.split("```").next()).expect("stage diagram");
    diagram
        .lines()
        .filter_map(|line| line.strip_prefix("//! "))
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("folder").map(|entry| entry.expect("entry").path()) {
        if entry.is_dir() {
            found.extend(sources(&entry));
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            found.push(entry);
        }
    }
    found.sort();
    found
}

/// Names of crate modules that a line of code mentions as `crate::NAME`.
fn mentioned(line: &str) -> Vec<&str> {
    let code = line.split("//").next().unwrap_or("");
    code.match_indices("crate::")
        .map(|(start, word)| {
            let rest = &code[start + word.len()..];
            &rest[..rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len())]
        })
        .collect()
}

#[test]
fn every_module_is_in_the_diagram() {
    let stages = stages();
    let text = fs::read_to_string("src/lib.rs").expect("src/lib.rs");
    for module in text.lines().filter_map(|line| line.strip_prefix("pub mod ")).map(|m| m.trim_end_matches(';')) {
        assert!(stages.iter().any(|stage| stage == module), "{module} is missing in the stage diagram");
    }
    for stage in &stages {
        assert!(text.contains(&format!("pub mod {stage};")), "{stage} is in the diagram, but no module");
    }
}

#[test]
fn lower_stages_use_only_higher_ones() {
    let stages = stages();
    let rank = |name: &str| stages.iter().position(|stage| stage == name);
    let mut violations = Vec::new();
    for stage in &stages {
        for file in sources(&Path::new("src").join(stage)) {
            let text = fs::read_to_string(&file).expect("source");
            for (number, line) in text.lines().enumerate() {
                for name in mentioned(line) {
                    if rank(name) > rank(stage) {
                        violations.push(format!("{}:{}: {stage} uses {name}", file.display(), number + 1));
                    }
                }
            }
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

/// Crates that only one module may name.
#[test]
fn libraries_stay_behind_their_module() {
    let homes = [
        ("pest", "syntax"),
        ("codespan_reporting", "diagnostics"),
        ("nalgebra", "linear"),
        ("faer", "linear"),
        ("minijinja", "report"),
        ("clap", "command"),
        ("indicatif", "command"),
    ];
    let mut violations = Vec::new();
    for file in sources(Path::new("src")) {
        let text = fs::read_to_string(&file).expect("source");
        for (library, home) in homes {
            let inside = file.starts_with(Path::new("src").join(home));
            let named = text
                .lines()
                .map(|line| line.split("//").next().unwrap_or(""))
                .any(|line| line.contains(&format!("{library}::")) || line.contains(&format!("use {library}")));
            if named && !inside {
                violations.push(format!("{} names {library}, which belongs to {home}", file.display()));
            }
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn the_rule_finds_a_violation() {
    assert_eq!(mentioned("use crate::diagnose::Answer; // crate::report"), ["diagnose"]);
    assert_eq!(mentioned("    crate::linear::Basis::new(crate::study::x)"), ["linear", "study"]);
}
