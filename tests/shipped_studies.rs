//! Every `.ident` file under `studies/` is read without a complaint.

use std::path::{Path, PathBuf};

fn texts(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(texts(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "ident") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

#[test]
fn every_shipped_study_is_read() -> std::io::Result<()> {
    let paths = texts(&Path::new(env!("CARGO_MANIFEST_DIR")).join("studies"))?;
    assert!(paths.len() >= 6, "found only {paths:?}");
    for path in paths {
        let (tree, diagnostics) = ident::syntax::parse(0, &std::fs::read_to_string(&path)?);
        assert!(diagnostics.is_empty(), "{}: {diagnostics:#?}", path.display());
        assert!(!tree.items.is_empty(), "{} is empty", path.display());
    }
    Ok(())
}
