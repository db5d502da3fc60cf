//! The contract of `ident compile --emit` (docs/emitted_text.md), kept for the studies that ship.

use ident::mechanics::{TEXT_FORM, derive, emit_equations, emit_model, emit_tree};
use ident::study::{check, load};
use ident::tape::{Model, emit_tape};
use std::fs;
use std::path::{Path, PathBuf};

fn studies() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies");
    let mut paths = Vec::new();
    for folder in fs::read_dir(root).expect("studies").map(|entry| entry.expect("an entry").path()) {
        let name = folder.file_name().unwrap_or_default().to_owned();
        let path = folder.join(name).with_extension("ident");
        if path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    paths
}

/// Model, tree, equations and tape of a study.
fn texts(path: &Path) -> [String; 4] {
    let checked = check(&load(path), None).unwrap_or_else(|findings| panic!("{}: {findings:?}", path.display()));
    let system = derive(&checked.study).unwrap_or_else(|findings| panic!("{}: {findings:?}", path.display()));
    [
        emit_model(&checked.study, &system),
        emit_tree(&checked.study).expect("connected"),
        emit_equations(&checked.study, &system),
        emit_tape(&Model::compile(&system)),
    ]
}

/// `INSTA_UPDATE=always` writes the texts anew; a line that changes without a change of its study needs a new form.
#[test]
fn models_of_shipped_studies_are_as_recorded() {
    let paths = studies();
    assert!(paths.len() >= 6, "found only {paths:?}");
    for path in paths {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut settings = insta::Settings::clone_current();
        settings.set_snapshot_path("emitted_text");
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings.bind(|| insta::assert_snapshot!(name, texts(&path)[0]));
    }
}

#[test]
fn texts_are_of_the_documented_form() {
    for path in studies() {
        let (first, again) = (texts(&path), texts(&path));
        assert_eq!(first, again, "{}", path.display());
        for (text, kind) in first.iter().zip(["model", "tree", "equations", "tape"]) {
            let head = text.lines().next().unwrap_or_default();
            assert!(head.starts_with(kind) && head.ends_with(&format!(", form {TEXT_FORM}")), "{head}");
            assert!(text.ends_with('\n') && !text.contains('\r'), "{}", path.display());
            let ragged = text.lines().find(|line| line.trim_end() != *line);
            assert_eq!(ragged, None, "{}: {kind}", path.display());
        }
    }
}

/// Another number of the study changes the lines that show it, and no other.
#[test]
fn a_changed_number_changes_its_line() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/quarter_vehicle/quarter_vehicle.ident");
    let text = fs::read_to_string(root).expect("the study");
    let model = |text: &str| {
        let checked = check(&ident::study::load_text("study.ident", text), None).expect("a study");
        emit_model(&checked.study, &derive(&checked.study).expect("derivable"))
    };
    let (before, after) = (model(&text), model(&text.replace("mass = 45 kg", "mass = 46.5 kg")));
    let changed: Vec<(&str, &str)> = before.lines().zip(after.lines()).filter(|(a, b)| a != b).collect();
    assert_eq!(changed, [("body wheel: mass 45", "body wheel: mass 46.5")]);
    assert_eq!(before.lines().count(), after.lines().count());
}
