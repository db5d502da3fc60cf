//! What README says is executed here: its commands, its study, its links, its bibliography.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Contents of README's fenced blocks of one language.
fn blocks(language: &str) -> Vec<String> {
    let text = fs::read_to_string("README.md").expect("README.md");
    let opening = format!("```{language}\n");
    text.split(&opening).skip(1).filter_map(|rest| rest.split("```").next()).map(str::to_owned).collect()
}

fn commands() -> Vec<String> {
    blocks("sh").iter().flat_map(|block| block.lines()).map(str::to_owned).collect()
}

/// Runs `cargo run --release -- ARGUMENTS` with the binary of this build in a copy of the studies.
fn run(command: &str, folder: &Path) -> Output {
    let arguments = command.strip_prefix("cargo run --release -- ").expect("a call of the binary");
    Command::new(env!("CARGO_BIN_EXE_ident"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the binary runs")
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("folder");
    for entry in fs::read_dir(from).expect("folder").map(|entry| entry.expect("entry").path()) {
        let target = to.join(entry.file_name().expect("name"));
        if entry.is_dir() {
            copy(&entry, &target);
        } else {
            fs::copy(&entry, &target).expect("copy");
        }
    }
}

#[test]
fn its_commands_do_what_it_says() {
    let folder = tempfile::tempdir().expect("folder");
    copy(Path::new("studies/quarter_vehicle"), &folder.path().join("studies/quarter_vehicle"));
    let calls: Vec<String> = commands().into_iter().filter(|command| command.starts_with("cargo run")).collect();
    assert_eq!(calls.len(), 3, "{calls:?}");
    for call in &calls {
        let output = run(call, folder.path());
        assert!(output.status.success(), "{call}\n{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(text.contains("dry_friction"), "{call} does not mention the cause:\n{text}");
    }
    let page = fs::read_to_string(folder.path().join("diagnosis.html")).expect("the page is there");
    assert!(page.contains("dry_friction") && page.contains("<svg"));
    let study = fs::read_to_string(folder.path().join("studies/quarter_vehicle/quarter_vehicle.ident")).expect("study");
    let before = fs::read_to_string("studies/quarter_vehicle/quarter_vehicle.ident").expect("study");
    assert!(study.starts_with(&before) && study[before.len()..].contains("variant "), "{study}");
}

#[test]
fn its_test_command_is_the_one_of_continuous_integration() {
    let test = commands().into_iter().find(|command| command.starts_with("cargo test")).expect("a test command");
    let script = fs::read_to_string(".ci/run").expect(".ci/run");
    assert!(script.lines().any(|line| line.trim() == test), ".ci/run does not call `{test}`");
}

#[test]
fn its_first_study_is_the_shipped_one() {
    let shipped = fs::read_to_string("studies/quarter_vehicle/quarter_vehicle.ident").expect("study");
    let code: BTreeSet<&str> =
        shipped.lines().map(str::trim_end).filter(|line| !line.trim_start().starts_with("//")).collect();
    for line in blocks("ident").iter().flat_map(|block| block.lines()) {
        assert!(code.contains(line.trim_end()), "README explains a line that the study does not have: {line}");
    }
}

#[test]
fn its_links_lead_somewhere() {
    let text = fs::read_to_string("README.md").expect("README.md");
    for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(Path::new(target).exists(), "{target} does not exist");
    }
}

fn files(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("folder").map(|entry| entry.expect("entry").path()) {
        if entry.is_dir() {
            files(&entry, endings, found);
        } else if entry.extension().is_some_and(|ending| endings.iter().any(|wanted| ending == *wanted)) {
            found.push(entry);
        }
    }
}

/// `Author-Author-1978` in a text.
fn keys(text: &str) -> BTreeSet<String> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'))
        .filter(|word| {
            let parts: Vec<&str> = word.split('-').collect();
            let (Some(year), authors) = (parts.last(), &parts[..parts.len() - 1]) else { return false };
            let is_year = year.len() == 4 && year.starts_with(['1', '2']) && year.bytes().all(|b| b.is_ascii_digit());
            let is_name = |part: &&str| {
                part.len() > 2
                    && part.starts_with(|c: char| c.is_ascii_uppercase())
                    && part.chars().all(char::is_alphabetic)
            };
            is_year && !authors.is_empty() && authors.iter().all(is_name)
        })
        .map(str::to_owned)
        .collect()
}

#[test]
fn its_bibliography_resolves_every_key() {
    let readme = fs::read_to_string("README.md").expect("README.md");
    let listed: BTreeSet<String> = readme
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(" | ").next().map(str::to_owned))
        .flat_map(|cell| keys(&cell))
        .collect();
    assert!(listed.len() > 30, "the bibliography was not found");
    let mut sources = Vec::new();
    for folder in ["src", "grammar", "studies", "tests"] {
        files(Path::new(folder), &["rs", "ident", "md", "pest"], &mut sources);
    }
    for source in sources {
        let text = fs::read_to_string(&source).expect("source");
        for key in keys(&text) {
            let is_example = source.ends_with("readme.rs") || key.starts_with("Author");
            assert!(is_example || listed.contains(&key), "{}: {key} is not in the bibliography", source.display());
        }
    }
}
