//! Bad input: each defect gets a message that names file, line or column, study element and likely fix; the exit status
//! is not zero, and nothing is written.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const STUDY: &str = r#"study slider "Slider on a spring"
input force [N] "force of the shaker"
body slider { mass = m_slider }
joint guide: prismatic(x) ground -> slider
actuator shaker: external_load on guide { value = force }
force spring_1: spring on guide { stiffness = c_spring }
force damper_1: damper on guide { damping = 20 N*s/m }
measure position [mm] "position" = guide.position
experiment shaking estimation { data = "shaking.csv", start = rest }
identify {
  m_slider in 1 .. 20 kg from 5 kg
  c_spring in 100 .. 10000 N/m from 2000 N/m
}
"#;

/// 200 samples at 100 Hz of a plausible record.
fn record() -> Vec<String> {
    let mut lines = vec!["t [s],force [N],position [mm]".to_owned()];
    lines.extend((0..200).map(|k| {
        let t = f64::from(k) * 0.01;
        format!("{t:.2},{:.6},{:.6}", 50.0 * (9.0 * t).sin(), 20.0 * (9.0 * t - 0.4).sin())
    }));
    lines
}

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new(study: &str, lines: &[String]) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        fs::write(folder.path().join("slider.ident"), study).expect("study");
        fs::write(folder.path().join("shaking.csv"), lines.join("\n") + "\n").expect("record");
        Self { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Runs `ident diagnose` asking for every output; it must fail and leave no file behind.
    fn refuse(&self) -> String {
        let before = listing(self.path());
        let output = Command::new(env!("CARGO_BIN_EXE_ident"))
            .args(["diagnose", "slider.ident", "--html", "page.html", "--write", "--quiet"])
            .current_dir(self.path())
            .output()
            .expect("the binary runs");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "bad input was accepted:\n{}", String::from_utf8_lossy(&output.stdout));
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(output.stdout.is_empty(), "half an answer was printed");
        assert_eq!(before, listing(self.path()), "files were written");
        assert_eq!(fs::read_to_string(self.path().join("slider.ident")).expect("study").len(), self.study_length());
        message
    }

    fn study_length(&self) -> usize {
        fs::metadata(self.path().join("slider.ident")).map_or(0, |data| data.len() as usize)
    }
}

fn listing(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<PathBuf> =
        fs::read_dir(folder).expect("folder").map(|entry| entry.expect("entry").path()).collect();
    names.sort();
    names
}

/// All words must appear in the message.
fn assert_names(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in:\n{message}");
    }
    assert!(message.contains("help"), "no likely fix in:\n{message}");
}

fn with_line(line: usize, text: &str) -> Vec<String> {
    let mut lines = record();
    lines[line - 1] = text.to_owned();
    lines
}

#[test]
fn the_good_study_is_accepted() {
    let place = Place::new(STUDY, &record());
    let output = Command::new(env!("CARGO_BIN_EXE_ident"))
        .args(["fit", "slider.ident", "--quiet"])
        .current_dir(place.path())
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn missing_data_file() {
    let place = Place::new(STUDY, &record());
    fs::remove_file(place.path().join("shaking.csv")).expect("remove");
    assert_names(&place.refuse(), &["shaking.csv", "slider.ident:9", "--data"]);
}

#[test]
fn data_file_that_is_a_folder() {
    let place = Place::new(STUDY, &record());
    fs::remove_file(place.path().join("shaking.csv")).expect("remove");
    fs::create_dir(place.path().join("shaking.csv")).expect("folder");
    assert_names(&place.refuse(), &["shaking.csv", "slider.ident:9"]);
}

#[test]
fn missing_column() {
    let mut lines = record();
    lines[0] = "t [s],force [N],positon [mm]".to_owned();
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "position", "positon", "measure"]);
}

#[test]
fn wrong_unit() {
    let mut lines = record();
    lines[0] = "t [s],force [kg],position [mm]".to_owned();
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "force", "kg"]);
}

#[test]
fn time_backward() {
    let lines = with_line(52, "0.30,1.0,1.0");
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "52", "backward"]);
}

#[test]
fn time_not_uniform() {
    let mut lines = record();
    lines.remove(100);
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "equidistant", "101"]);
}

#[test]
fn not_a_number() {
    let lines = with_line(77, "0.75,NaN,1.0");
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "77", "force"]);
}

#[test]
fn unreadable_cell() {
    let lines = with_line(31, "0.29,1.0,lost");
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "31", "position", "lost"]);
}

#[test]
fn empty_window() {
    let study = STUDY.replace("start = rest", "start = rest, window = 5 s .. 6 s");
    assert_names(&Place::new(&study, &record()).refuse(), &["shaking.csv", "window", "5", "6"]);
}

#[test]
fn constant_channel() {
    let lines: Vec<String> = record()
        .iter()
        .enumerate()
        .map(|(k, line)| {
            if k == 0 {
                line.clone()
            } else {
                line.rsplit_once(',').map(|(head, _)| format!("{head},3.5")).unwrap_or_default()
            }
        })
        .collect();
    assert_names(&Place::new(STUDY, &lines).refuse(), &["shaking.csv", "position", "3.5"]);
}

#[test]
fn parameter_without_influence() {
    let study = STUDY
        .replace("joint guide", "body other { mass = m_other }\njoint side: prismatic(y) ground -> other\njoint guide")
        .replace("identify {", "identify {\n  m_other in 1 .. 5 kg from 2 kg");
    assert_names(&Place::new(&study, &record()).refuse(), &["m_other", "influence", "slider.ident:"]);
}

#[test]
fn start_outside_bounds() {
    let study = STUDY.replace("from 5 kg", "from 50 kg");
    assert_names(&Place::new(&study, &record()).refuse(), &["m_slider", "slider.ident:11", "50"]);
}

#[test]
fn singular_model() {
    let study = STUDY.replace("mass = m_slider", "mass = 0 kg").replace("  m_slider in 1 .. 20 kg from 5 kg\n", "");
    assert_names(&Place::new(&study, &record()).refuse(), &["slider", "mass"]);
}

#[test]
fn no_equilibrium() {
    let study = STUDY
        .replace("force spring_1: spring on guide { stiffness = c_spring }\n", "")
        .replace("  c_spring in 100 .. 10000 N/m from 2000 N/m\n", "")
        .replace("start = rest", "start = equilibrium");
    assert_names(&Place::new(&study, &record()).refuse(), &["shaking", "equilibrium", "guide"]);
}

#[test]
fn diverging_simulation() {
    let study = STUDY.replace("damping = 20 N*s/m", "damping = -90000 N*s/m");
    assert_names(&Place::new(&study, &record()).refuse(), &["shaking", "t = ", "guide"]);
}

#[test]
fn several_errors_at_once() {
    let study = STUDY.replace("stiffness = c_spring", "stifness = c_spring").replace("[mm]", "[kg]");
    let message = Place::new(&study, &record()).refuse();
    assert_names(&message, &["stifness", "stiffness", "kg"]);
    assert!(message.matches("error[").count() >= 2, "{message}");
}
