//! The language is read, printed and read again; errors are told in an engineer's words.

#[path = "syntax/generated.rs"]
mod generated;

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

/// The prelude and the folders of the shipped studies.
fn shipped_folders() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let studies = fs::read_dir(root.join("studies")).expect("shipped studies");
    let folders = studies.map(|entry| entry.expect("readable folder").path()).filter(|path| path.is_dir());
    let mut names: Vec<String> = folders.map(|path| path.display().to_string()).collect();
    names.extend(root.join("grammar/prelude").is_dir().then(|| "grammar/prelude".to_owned()));
    names.sort();
    names
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
    let folders = ["tests/cases/syntax_good".to_owned()].into_iter().chain(shipped_folders());
    let paths: Vec<PathBuf> = folders.flat_map(|folder| study_files(&folder)).collect();
    assert!(paths.len() > 5, "the shipped studies are missing");
    for path in paths {
        let text = fs::read_to_string(&path).expect("readable case");
        let tree = read_without_errors(&path.display().to_string(), &text);
        assert!(!tree.items.is_empty(), "{}", path.display());
        let printed = print(&tree);
        let again = read_without_errors("printed", &printed);
        assert_eq!(shape(&tree), shape(&again), "{printed}");
        assert_eq!(printed, print(&again));
    }
}

/// The findings of every case, next to its text. `INSTA_UPDATE=always` writes them anew; read them before you commit.
#[test]
fn errors_are_told_in_an_engineers_words() {
    for path in study_files("tests/cases/syntax") {
        let text = fs::read_to_string(&path).expect("readable case");
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut sources = Sources::new();
        let file = sources.add(&name, &text);
        let (tree, diagnostics) = parse(file, &text);
        let code = name.split('_').next().unwrap_or_default();
        assert!(diagnostics.iter().any(|finding| finding.code.text == code), "{name} does not show its code");
        let kept: Vec<String> = tree.items.iter().map(ident::syntax::print_item).collect();
        let shown =
            format!("{}\n---- read nevertheless ----\n{}", render(&diagnostics, &sources, false), kept.concat());
        let mut settings = insta::Settings::clone_current();
        settings.set_snapshot_path("cases/syntax");
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings.bind(|| insta::assert_snapshot!(name.trim_end_matches(".ident"), shown));
    }
}

/// Every example of the language reference is read without errors.
#[test]
fn examples_of_the_reference_are_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("grammar/README.md");
    let text = fs::read_to_string(path).expect("language reference");
    let examples = text.split("```ident\n").skip(1);
    let mut count = 0;
    for example in examples {
        let (code, _) = example.split_once("```").expect("closed fence");
        assert!(!read_without_errors("grammar/README.md", code).items.is_empty(), "{code}");
        count += 1;
    }
    assert!(count >= 12, "only {count} examples");
    for entry in ident::quantities::NAMED_TYPES {
        assert!(text.contains(entry.name), "the reference does not name the type {}", entry.name);
    }
}

mod soup {
    use super::*;
    use proptest::prelude::*;

    /// Tokens of the language and some that are foreign to it.
    fn token() -> impl Strategy<Value = String> {
        let words = [
            "study",
            "use",
            "gravity",
            "constant",
            "input",
            "body",
            "joint",
            "coupling",
            "force",
            "actuator",
            "signal",
            "effect",
            "measure",
            "group",
            "experiment",
            "identify",
            "filter",
            "solver",
            "variant",
            "law",
            "add",
            "remove",
            "replace",
            "param",
            "let",
            "state",
            "amplitude",
            "shape",
            "adds",
            "replaces",
            "in",
            "from",
            "prior",
            "on",
            "along",
            "of",
            "at",
            "any",
            "where",
            "by",
            "if",
            "then",
            "else",
            "and",
            "or",
            "lowpass",
            "butterworth",
            "pass",
            "stop",
            "zero_phase",
            "remove_mean",
            "one_sided",
            "neutral",
            "x",
            "wheel",
            "arm.tip",
            "z'",
            "ü",
            "{",
            "}",
            "{",
            "}",
            "(",
            ")",
            "[",
            "]",
            ",",
            ":",
            "=",
            "->",
            "..",
            "+-",
            "+",
            "-",
            "*",
            "/",
            "^",
            "<",
            ">",
            "<=",
            ".",
            ";",
            "#",
            "\"",
            "\"text\"",
            "12",
            "0.5 kN/m",
            "1e-3",
            "30 %",
            "\n",
            "\n",
            "\n",
            "// remark\n",
            "/// documentation\n",
            "€",
        ];
        prop::sample::select(words.to_vec()).prop_map(str::to_owned)
    }

    fn check(text: &str) -> Result<(), TestCaseError> {
        let mut sources = Sources::new();
        let file = sources.add("soup", text);
        let (tree, diagnostics) = parse(file, text);
        render(&diagnostics, &sources, false);
        let printed = print(&tree);
        if diagnostics.is_empty() {
            let (again, errors) = parse(0, &printed);
            prop_assert!(errors.is_empty(), "{}", printed);
            prop_assert_eq!(shape(&tree), shape(&again));
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_tokens_are_read_or_refused(tokens in prop::collection::vec(token(), 0..60)) {
            check(&tokens.join(" "))?;
        }

        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,80}") {
            check(&text)?;
        }

        /// Good studies with a piece cut out: errors, but no panic, and other declarations survive.
        #[test]
        fn damaged_studies_are_read_or_refused(cut in 0usize..6000, length in 1usize..40, file in 0usize..2) {
            let paths = study_files("tests/cases/syntax_good");
            let text = fs::read_to_string(&paths[file]).expect("readable case");
            let start = text.floor_char_boundary(cut.min(text.len()));
            let end = text.floor_char_boundary((start + length).min(text.len()));
            let damaged = format!("{}{}", &text[..start], &text[end..]);
            check(&damaged)?;
            let (tree, _) = parse(0, &damaged);
            prop_assert!(tree.items.len() > 8, "only {} declarations survive", tree.items.len());
        }
    }
}

/// Large text of any kind takes time proportional to it.
#[test]
fn large_texts_are_read_in_proportional_time() {
    let hostile = [
        "body a {\n",
        "body a { m = (\n",
        "body a { m = 1 kg }\n",
        "body a { m 1 kg }\n",
        "(",
        "{",
        "[ ",
        "- ",
        "if ",
        "a = ",
        "\"",
        "///\n",
        "}\n",
        "measure a = ",
        "1 + ",
        "x^",
        "law a(",
        "variant a of b { add ",
        "x.",
        "1/",
        "1 m*(",
    ];
    for piece in hostile {
        let text = piece.repeat(400_000 / piece.len());
        let start = std::time::Instant::now();
        let (_, diagnostics) = parse(0, &text);
        assert!(diagnostics.len() <= 50);
        assert!(start.elapsed().as_secs_f64() < 10.0, "{piece:?} took {:?}", start.elapsed());
    }
    for head in ["measure a = ", "body a { m = ", "law f(x: rate) -> load { = ", "constant c = 2 "] {
        for piece in ["- ", "if ", "1 + ", "2^", "x*(", "m*", "f(", "if a < b then 1 else "] {
            let text = format!("{head}{}", piece.repeat(20_000));
            let start = std::time::Instant::now();
            let (tree, diagnostics) = parse(0, &text);
            assert!(!diagnostics.is_empty(), "{head}{piece}");
            print(&tree);
            assert!(start.elapsed().as_secs_f64() < 10.0, "{head}{piece:?} took {:?}", start.elapsed());
        }
    }
}

/// The highlighting for editors knows every keyword of the grammar.
#[test]
fn highlighting_knows_every_keyword() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("grammar");
    let highlighting = fs::read_to_string(root.join("ident.tmLanguage.json")).expect("highlighting");
    let highlighting: serde_json::Value = serde_json::from_str(&highlighting).expect("JSON");
    let patterns: String =
        highlighting["patterns"].as_array().expect("patterns").iter().map(|p| p.to_string()).collect();
    let grammar = fs::read_to_string(root.join("ident.pest")).expect("grammar");
    let keywords = grammar.lines().filter_map(|line| {
        let (rule, rest) = line.split_once("= @{ \"")?;
        rule.trim().ends_with("_word").then(|| rest.split('"').next().unwrap_or_default())
    });
    let mut count = 0;
    for keyword in keywords {
        let known = [format!("|{keyword}|"), format!("({keyword}|"), format!("|{keyword})")];
        assert!(known.iter().any(|form| patterns.contains(form.as_str())), "`{keyword}` is not highlighted");
        count += 1;
    }
    assert!(count > 40, "only {count} keywords found in the grammar");
}

/// What ships with the tool is in canonical layout.
#[test]
fn shipped_texts_are_formatted() {
    for path in shipped_folders().iter().flat_map(|folder| study_files(folder)) {
        let text = fs::read_to_string(&path).expect("readable file");
        let formatted = ident::syntax::format(0, &text).unwrap_or_else(|findings| panic!("{findings:?}"));
        assert!(formatted == text, "run `ident fmt {}`", path.display());
    }
}
