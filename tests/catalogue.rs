//! The catalogue of diagnostics is complete: every code has an explanation with a cure and a case that shows it, and
//! every case is one of a code.

use ident::diagnostics::Code;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Codes of stages that are given their study by other means than a text, with the test that shows them: the check of
/// texts finds these mistakes earlier.
const SHOWN_BY_TESTS: [(&str, &str); 3] = [
    ("UNKNOWN_START", "tests/mechanics/faults.rs"),
    ("UNKNOWN_QUANTITY", "tests/mechanics/faults.rs"),
    ("FORCE_ON_FIXED_JOINT", "tests/mechanics/faults.rs"),
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The cases of all stages.
fn cases() -> Vec<PathBuf> {
    let entries = |folder: &Path| -> Vec<PathBuf> {
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect()
    };
    let folders = entries(&root().join("tests/cases")).into_iter().filter(|path| path.is_dir());
    let mut paths: Vec<PathBuf> = folders.flat_map(|folder| entries(&folder)).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ident"));
    paths.retain(|path| name_of(path).starts_with('E'));
    paths.sort();
    paths
}

fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[test]
fn every_code_has_a_case_and_every_case_a_code() {
    let table = fs::read_to_string(root().join("src/diagnostics/codes.rs")).expect("the table");
    let with_case: BTreeSet<String> =
        cases().iter().map(|path| name_of(path).split('_').next().unwrap_or_default().to_owned()).collect();
    let mut shown = with_case.clone();
    for (name, test) in SHOWN_BY_TESTS {
        let row = table.lines().find(|line| line.trim_start().starts_with(&format!("{name} \"E")));
        let code = row.and_then(|row| row.split('"').nth(1)).unwrap_or_else(|| panic!("no code {name}"));
        let text = fs::read_to_string(root().join(test)).expect("the test");
        assert!(text.contains(&format!("Code::{name}")), "{test} does not show {name}");
        assert!(!with_case.contains(code), "{code} has a case of its own");
        shown.insert(code.to_owned());
    }
    let known: BTreeSet<String> = Code::ALL.iter().map(|code| code.text.to_owned()).collect();
    let without: Vec<&String> = known.difference(&shown).collect();
    let unknown: Vec<&String> = shown.difference(&known).collect();
    assert!(
        without.is_empty() && unknown.is_empty(),
        "codes without case: {without:?}, cases without code: {unknown:?}"
    );
    assert!(known.len() >= 80, "only {} codes", known.len());
}

/// Each case has its findings beside it, and they show the code, a place and, nearly always, a cure.
#[test]
fn cases_show_place_and_cure() {
    let (mut helpless, mut count) = (Vec::new(), 0);
    for path in cases() {
        let name = name_of(&path);
        let code = name.split('_').next().unwrap_or_default();
        let snapshot =
            fs::read_to_string(path.with_extension("snap")).unwrap_or_else(|_| panic!("{name}: no findings"));
        let findings: Vec<&str> = snapshot.split("\n\n").filter(|part| part.contains(&format!("[{code}]"))).collect();
        assert!(!findings.is_empty(), "{name} does not show its code");
        count += 1;
        if !snapshot.contains("= help:") && !snapshot.contains("= note:") {
            helpless.push(name);
        }
    }
    assert!(helpless.len() * 5 < count, "{} of {count} cases end without help: {helpless:?}", helpless.len());
}

/// `ident explain` says what is wrong and shows how it is right.
#[test]
fn explanations_show_examples() {
    for code in Code::ALL {
        let output =
            Command::new(env!("CARGO_BIN_EXE_ident")).args(["explain", code.text]).output().expect("ident runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && text.contains(code.title), "{code}: {text}");
        assert!(code.explanation.contains('`') || code.explanation.contains("\n    "), "{code} shows no example");
    }
}

/// Mistakes that show when the study meets its data. `INSTA_UPDATE=always` writes the findings anew.
#[test]
fn mistakes_of_data_are_told_in_an_engineers_words() {
    let folder = root().join("tests/cases/run");
    for path in cases().into_iter().filter(|path| path.starts_with(&folder)) {
        let name = name_of(&path);
        let text = fs::read_to_string(&path).expect("a case");
        let command = text.lines().next().and_then(|line| line.strip_prefix("// run: ")).expect("a command");
        let output = Command::new(env!("CARGO_BIN_EXE_ident"))
            .args([command, &format!("{name}.ident")])
            .current_dir(&folder)
            .output()
            .expect("ident runs");
        assert_eq!(output.status.code(), Some(1), "{name}: {}", String::from_utf8_lossy(&output.stdout));
        let findings = String::from_utf8_lossy(&output.stderr).into_owned();
        let mut settings = insta::Settings::clone_current();
        settings.set_snapshot_path(&folder);
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings.bind(|| insta::assert_snapshot!(name, findings));
    }
}
