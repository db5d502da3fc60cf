//! Shipped studies, fitted.

use ident::fit::Control;
use ident::identify::{Fitted, Settings, fit};
use ident::simulation::{Compiled, Record, prepare};
use ident::study::{self, Loaded, Role};
use std::path::Path;

pub fn loaded(name: &str) -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies").join(name).join(format!("{name}.ident"));
    study::load(&path)
}

/// The study as it stands, or with further declarations, and its estimation records.
pub fn compiled(loaded: &Loaded) -> (Compiled, Vec<Record>) {
    let study = study::check(loaded, None).expect("a study without errors").study;
    let (records, findings) = prepare(&study, &loaded.directory, &[]);
    assert!(findings.iter().all(|finding| !finding.is_error()), "{findings:?}");
    let records = records.into_iter().filter(|record| record.role == Role::Estimation).collect();
    (Compiled::new(study).expect("a mechanism"), records)
}

pub fn fitted(compiled: &Compiled, records: &[Record], settings: &Settings) -> Fitted {
    let records: Vec<&Record> = records.iter().collect();
    fit(compiled, &records, settings, &mut |_| Control::Continue).expect("a fit")
}
