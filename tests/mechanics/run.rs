//! Runs studies given as text, with the files they name beside them.

use ident::diagnostics::{Diagnostic, render};
use ident::simulation::{Compiled, Gradient, manoeuvre, simulate};
use ident::study::{Study, check, load};
use std::collections::BTreeMap;
use std::fs;

pub type Channels = BTreeMap<String, Vec<f64>>;

/// The checked study, or its findings as text. `files` are (name, text).
pub fn checked(text: &str, files: &[(&str, String)]) -> Result<Study, String> {
    let folder = tempfile::tempdir().expect("a folder");
    files.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).expect("writable folder"));
    let path = folder.path().join("study.ident");
    fs::write(&path, text).expect("writable folder");
    let loaded = load(&path);
    let told = |findings: Vec<Diagnostic>| render(&findings, &loaded.sources, false);
    check(&loaded, None).map(|checked| checked.study).map_err(told)
}

/// All measures of every manoeuvre, in order.
pub fn run(text: &str, files: &[(&str, String)]) -> Vec<Channels> {
    let study = checked(text, files).unwrap_or_else(|findings| panic!("{findings}"));
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let theta: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    let run_one = |index: usize| {
        let mut record = manoeuvre(&compiled.study, index);
        record.measures = (0..compiled.study.measures.len()).collect();
        let trajectory = simulate(&compiled, &record, &theta, Gradient::None).unwrap_or_else(|f| panic!("{f:?}"));
        let names = compiled.study.measures.iter().map(|measure| measure.name.clone());
        names.zip(trajectory.channels).collect()
    };
    (0..compiled.study.manoeuvres.len()).map(run_one).collect()
}

/// The largest change of a channel over the run.
pub fn drift(values: &[f64]) -> f64 {
    values.iter().map(|value| (value - values[0]).abs()).fold(0.0, f64::max)
}
