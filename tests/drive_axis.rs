//! The real drive axis (Janot-Gautier-Brunot-2019): causes and figures that the issue of the first light asks for.

use ident::diagnose::{Answer, Options, Verdict, diagnose};
use ident::diagnostics::Diagnostic;
use std::path::{Path, PathBuf};

/// The shared records; `None` (with a printed reason) where they are not there.
fn data() -> Option<PathBuf> {
    let shared = std::env::var_os("IDENT_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let folder = shared.join("data/emps");
    if !folder.join("est.csv").exists() {
        println!("skipped: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

fn answer(study: &str, extensions: usize, data: &Path) -> Answer {
    let loaded = ident::study::load(Path::new(study));
    let checked = ident::study::check(&loaded, None).unwrap_or_else(|findings| panic!("{findings:?}"));
    let (records, findings) = ident::simulation::prepare(&checked.study, data, &[]);
    assert!(!findings.iter().any(Diagnostic::is_error), "{findings:?}");
    let options = Options { maximum_extensions: extensions, ..Options::default() };
    diagnose(&loaded, &records, &options, &|_| {}).unwrap_or_else(|findings| panic!("{findings:?}"))
}

/// Relative errors of the drive voltage, % (estimation, validation).
fn errors(fit: &ident::identify::Identification) -> (f64, f64) {
    let of = |role: &str| {
        let record = fit.records.iter().find(|record| record.role == role).expect("a record of each role");
        record.channels[0].relative_error
    };
    (of("estimation"), of("validation"))
}

fn accepted(answer: &Answer) -> Vec<&str> {
    answer.steps.iter().filter_map(|step| step.accepted.map(|index| step.ranking[index].name.as_str())).collect()
}

#[test]
fn dry_friction_and_then_direction_dependent_damping_are_named() {
    let Some(data) = data() else { return };
    let first = answer("studies/drive_axis/drive_axis.ident", 1, &data);
    let (estimation, validation) = errors(&first.base);
    assert!((estimation - 17.1).abs() < 0.1 && (validation - 16.4).abs() < 0.1, "{estimation} {validation}");
    assert_eq!(accepted(&first), ["dry_friction at slide"]);
    let (estimation, validation) = errors(&first.extended);
    println!("first extension: {estimation:.2} / {validation:.2} %");
    assert!(estimation <= 4.8 && validation <= 5.6, "{estimation} {validation}");
    let second = answer("studies/drive_axis/drive_axis.ident", 2, &data);
    assert_eq!(accepted(&second), ["dry_friction at slide", "direction_dependent_damping at slide"]);
    let (estimation, validation) = errors(&second.extended);
    println!("second extension: {estimation:.2} / {validation:.2} %");
    assert!(estimation <= 4.0 && validation <= 5.0, "{estimation} {validation}");
}

#[test]
fn position_alone_cannot_tell() {
    let Some(data) = data() else { return };
    let answer = answer("studies/drive_axis/position_only.ident", 1, &data);
    assert_eq!(answer.verdict, Verdict::CannotBeJudged, "{}", answer.summary);
    assert!(answer.extension.is_none());
}
