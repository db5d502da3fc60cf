//! Faults of the mechanism as written in a study, with what the tool says about them.

use ident::diagnostics::render;
use ident::mechanics::derive;
use ident::study::{check, load_text};
use std::fs;
use std::path::Path;

/// `INSTA_UPDATE=always` writes the findings anew; read them before you commit.
#[test]
fn faults_of_mechanisms_are_told_in_an_engineers_words() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/mechanics");
    let mut paths: Vec<_> = fs::read_dir(&folder).expect("cases").map(|entry| entry.expect("a file").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ident"));
    paths.sort();
    let mut silent = Vec::new();
    for path in &paths {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let code = name.split('_').next().unwrap_or_default();
        let loaded = load_text(&format!("{name}.ident"), &fs::read_to_string(path).expect("a case"));
        let findings = match check(&loaded, None) {
            Err(findings) => findings,
            Ok(checked) => match derive(&checked.study) {
                Ok(system) => system.warnings,
                Err(findings) => findings,
            },
        };
        if !findings.iter().any(|finding| finding.code.text == code) {
            silent.push(format!("{name} does not show its code:\n{}", render(&findings, &loaded.sources, false)));
            continue;
        }
        let mut settings = insta::Settings::clone_current();
        settings.set_snapshot_path(&folder);
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings.bind(|| insta::assert_snapshot!(name, render(&findings, &loaded.sources, false)));
    }
    assert!(silent.is_empty(), "{}", silent.join("\n"));
    assert!(paths.len() >= 6, "only {} cases found", paths.len());
}
