//! The check of studies: what laws and effects become, and how errors read.

#[path = "study/actuators.rs"]
mod actuators;
#[path = "study/bushing.rs"]
mod bushing;
#[path = "study/evaluate.rs"]
mod evaluate;
#[path = "study/inlining.rs"]
mod inlining;
#[path = "study/laws.rs"]
mod laws;
#[path = "study/models.rs"]
mod models;
#[path = "study/prelude.rs"]
mod prelude;
#[path = "study/reference.rs"]
mod reference;
#[path = "study/tables.rs"]
mod tables;
#[path = "study/track.rs"]
mod track;

use ident::diagnostics::{Code, render};
use ident::study::{check, load_text};
use std::fs;
use std::path::{Path, PathBuf};

fn cases() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/study");
    let entries = fs::read_dir(folder).expect("the folder of cases");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable folder").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ident"));
    paths.sort();
    paths
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The findings of every case beside its text. `INSTA_UPDATE=always` writes them anew; read them before you commit.
#[test]
fn errors_are_told_in_an_engineers_words() {
    let mut silent = Vec::new();
    for path in cases() {
        let name = name_of(&path);
        let text = fs::read_to_string(&path).expect("readable case");
        let variant = text.lines().find_map(|line| line.strip_prefix("// variant: "));
        let code = name.split('_').next().unwrap_or_default();
        let loaded = load_text(&name, &text);
        let findings = match check(&loaded, variant) {
            Ok(checked) => checked.warnings,
            Err(findings) => findings,
        };
        if !findings.iter().any(|finding| finding.code.text == code) {
            silent.push(format!("{name} does not show its code:\n{}", render(&findings, &loaded.sources, false)));
            continue;
        }
        let shown: Vec<_> =
            findings.into_iter().filter(|finding| finding.is_error() || finding.code.text == code).collect();
        let mut settings = insta::Settings::clone_current();
        settings.set_snapshot_path(path.parent().expect("a folder"));
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings
            .bind(|| insta::assert_snapshot!(name.trim_end_matches(".ident"), render(&shown, &loaded.sources, false)));
    }
    assert!(silent.is_empty(), "{}", silent.join("\n"));
}

#[test]
fn shipped_studies_are_sound() {
    for name in ["quarter_vehicle", "two_mass", "crane_pendulum", "spring_slide", "drive_axis", "elastic_arm"] {
        let path = format!("{}/studies/{name}/{name}.ident", env!("CARGO_MANIFEST_DIR"));
        let loaded = ident::study::load(Path::new(&path));
        match check(&loaded, None) {
            Ok(checked) => {
                assert!(checked.warnings.is_empty(), "{}", render(&checked.warnings, &loaded.sources, false));
            }
            Err(findings) => panic!("{}", render(&findings, &loaded.sources, false)),
        }
    }
}

#[test]
fn files_use_each_other_and_missing_ones_are_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("writable folder");
    write("main.ident", "study s\nuse \"part.ident\"\nmeasure z [mm] = guide.position\n");
    write("part.ident", "use \"main.ident\"\nbody b { mass = 1 kg }\njoint guide: prismatic(z) ground -> b\n");
    let loaded = ident::study::load(&folder.path().join("main.ident"));
    let checked = check(&loaded, None).unwrap_or_else(|findings| panic!("{findings:?}"));
    assert_eq!(checked.study.bodies.len(), 1);
    assert_eq!(loaded.directory, folder.path());
    write("main.ident", "study s\nuse \"parts.ident\"\n");
    let findings = check(&ident::study::load(&folder.path().join("main.ident")), None).expect_err("a missing file");
    assert!(findings.iter().any(|finding| finding.code == Code::CANNOT_READ_FILE && finding.span().is_some()));
    let findings = check(&ident::study::load(Path::new("no/such/study.ident")), None).expect_err("a missing file");
    assert!(findings.iter().any(|finding| finding.code == Code::CANNOT_READ_FILE));
}

/// Damaged text gives findings, never a panic.
#[test]
fn damaged_studies_do_not_panic() {
    let quarter = include_str!("../studies/quarter_vehicle/quarter_vehicle.ident");
    let axis = include_str!("../studies/drive_axis/axis.ident");
    for text in [
        format!("{quarter}\nvariant v of base {{ add effect e: dry_friction on strut {{ F = f }} }}"),
        format!("study a\n{axis}"),
    ] {
        let lines: Vec<&str> = text.lines().collect();
        for skipped in 0..lines.len() {
            let rest: Vec<&str> =
                lines.iter().enumerate().filter(|(at, _)| *at != skipped).map(|(_, line)| *line).collect();
            let _ = check(&load_text("damaged", &rest.join("\n")), Some("v"));
        }
        for (from, to) in
            [("kN", "mm"), ("wheel", "table"), ("->", "on"), ("0", ""), ("=", "= -"), ("slide", "t"), ("{", "{ {")]
        {
            let _ = check(&load_text("damaged", &text.replace(from, to)), None);
        }
        let mut end = 0;
        while let Some(next) = text[end..].char_indices().nth(37) {
            end += next.0;
            let _ = check(&load_text("damaged", &text[..end]), None);
        }
    }
}

/// Thousands of candidate extensions are checked in a diagnosis.
#[test]
fn extensions_are_checked_quickly() {
    let base = load_text("quarter", include_str!("../studies/quarter_vehicle/quarter_vehicle.ident"));
    let text = "variant c of base { add effect e: dry_friction on strut { F = e_F, creep = 1 mm/s }\n\
                identify { e_F in 0 .. 100 N from 20 N } }";
    let begin = std::time::Instant::now();
    let count = 200;
    for _ in 0..count {
        let checked = check(&base.with_text(text), Some("c")).unwrap_or_else(|findings| panic!("{findings:?}"));
        assert_eq!(checked.study.variant, "c");
    }
    let each = begin.elapsed() / count;
    println!("one extension: {each:?}");
    // Some twenty times what an idle machine needs.
    assert!(each < std::time::Duration::from_millis(40), "{each:?}");
}
