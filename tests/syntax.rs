//! The language is read, printed and read again; errors are told in an engineer's words.

use ident::diagnostics::{Sources, render};
use ident::syntax::{Tree, parse, print};
use std::fs;
use std::path::{Path, PathBuf};

fn study_files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable folder").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ident"));
    paths.sort();
    paths
}

/// The tree as text without its spans.
fn shape(tree: &Tree) -> String {
    let debug = format!("{tree:?}");
    let mut parts = debug.split("Span {");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + part.split_once('}').map_or(part, |(_, behind)| behind))
}

fn read_without_errors(name: &str, text: &str) -> Tree {
    let mut sources = Sources::new();
    let file = sources.add(name, text);
    let (tree, diagnostics) = parse(file, text);
    assert!(diagnostics.is_empty(), "{}", render(&diagnostics, &sources, false));
    tree
}

#[test]
fn printing_and_reading_again_gives_the_same_tree() {
    for path in study_files("tests/cases/syntax_good") {
        let text = fs::read_to_string(&path).expect("readable case");
        let tree = read_without_errors(&path.display().to_string(), &text);
        assert!(tree.items.len() > 5, "{}", path.display());
        let printed = print(&tree);
        let again = read_without_errors("printed", &printed);
        assert_eq!(shape(&tree), shape(&again), "{printed}");
        assert_eq!(printed, print(&again));
    }
}
