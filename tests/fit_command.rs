//! `ident fit` as users run it: interrupted and resumed, results saved and combined, optimisers, threads.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn study(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("studies").join(name).join(format!("{name}.ident"))
}

fn command(arguments: &[&str], study: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ident"));
    command.arg(arguments[0]).arg(study).args(&arguments[1..]);
    command
}

fn run(arguments: &[&str], study: &Path) -> Output {
    command(arguments, study).output().expect("the program starts")
}

/// The `result` of a run with `--format json`.
fn answer(arguments: &[&str], study: &Path) -> Value {
    let output = run(&[arguments, &["--format", "json", "--quiet"]].concat(), study);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    answer["result"].take()
}

fn value(result: &Value, name: &str, field: &str) -> f64 {
    let parameters = result["parameters"].as_array().expect("parameters");
    let found = parameters.iter().find(|parameter| parameter["name"] == name).expect("the parameter");
    found[field].as_f64().expect("a number")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path")
}

/// A long search is ended from outside, as by Ctrl-C (whose signal programs in the background are told to ignore): its
/// file holds the best so far, whole, and a later run goes on from there.
#[cfg(unix)]
#[test]
fn an_interrupted_fit_is_resumed() {
    let folder = tempfile::tempdir().expect("a folder");
    let kept = folder.path().join("progress.json");
    let search = ["fit", "--resume", text(&kept), "--optimiser", "simplex", "--budget", "1000000"];
    let mut child = command(&search, &study("quarter_vehicle"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let begin = Instant::now();
    let cost = || {
        let text = std::fs::read_to_string(&kept).ok()?;
        serde_json::from_str::<Value>(&text).expect("a whole file at any time")["cost"].as_f64()
    };
    // The start is the first best; it must have been bettered.
    let mut start = None;
    while begin.elapsed() < Duration::from_secs(120) {
        let now = cost();
        start = start.or(now);
        if now.zip(start).is_some_and(|(now, start)| now < start) {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let killed = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("a signal");
    assert!(killed.success());
    assert!(!child.wait().expect("an end").success(), "an interrupted fit has not answered");
    let best: Value = serde_json::from_str(&std::fs::read_to_string(&kept).expect("kept")).expect("a whole file");
    assert_eq!(best["schema"], "ident.progress/1");
    let stiffness = best["parameters"]["c_tyre"].as_f64().expect("SI");
    assert!((100e3..=300e3).contains(&stiffness));
    // The next run starts there, not at the study's start.
    let first =
        |arguments: &[&str]| answer(arguments, &study("quarter_vehicle"))["cost_history"][0].as_f64().expect("a cost");
    let (resumed, fresh) = (first(&["fit", "--resume", text(&kept), "--steps", "1"]), first(&["fit", "--steps", "1"]));
    assert!(resumed < fresh, "{resumed} {fresh}");
}

/// In two parts with a step limit as in one go.
#[test]
fn steps_add_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let kept = folder.path().join("progress.json");
    let part = answer(&["fit", "--resume", text(&kept), "--steps", "2"], &study("spring_slide"));
    let stopped = part["remarks"].as_array().expect("remarks").iter().any(|r| r.to_string().contains("stopped early"));
    assert!(stopped, "{}", part["remarks"]);
    let rest = answer(&["fit", "--resume", text(&kept)], &study("spring_slide"));
    let whole = answer(&["fit"], &study("spring_slide"));
    for name in ["m_slider", "c_return", "d_slide"] {
        let (a, b) = (value(&rest, name, "value"), value(&whole, name, "value"));
        assert!((a / b - 1.0).abs() < 1e-4, "{name}: {a} {b}");
    }
    std::fs::write(&kept, "{").expect("written");
    assert!(!run(&["fit", "--resume", text(&kept)], &study("spring_slide")).status.success());
}

/// What a fit knows, taken into another fit of the same kind of test: half the variance.
#[test]
fn a_saved_result_helps_another_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    let saved = folder.path().join("result.json");
    let alone = answer(&["fit", "--save-result", text(&saved)], &study("spring_slide"));
    let document: Value = serde_json::from_str(&std::fs::read_to_string(&saved).expect("saved")).expect("JSON");
    assert_eq!(
        (document["schema"].as_str(), document["records"][0].as_str()),
        (Some("ident.result/1"), Some("shaking"))
    );
    let both = answer(&["fit", "--with", text(&saved)], &study("spring_slide"));
    let ratio = value(&both, "c_return", "standard_deviation") / value(&alone, "c_return", "standard_deviation");
    assert!((ratio * 2f64.sqrt() - 1.0).abs() < 0.1, "{ratio}");
}

/// Every optimiser, every band and a start by equation error end at the same parameters.
#[test]
fn all_ways_lead_to_the_same_minimum() {
    let plain = answer(&["fit"], &study("spring_slide"));
    let ways: [&[&str]; 4] = [
        &["fit", "--optimiser", "sequential"],
        &["fit", "--optimiser", "simplex"],
        &["fit", "--bands", "3"],
        &["fit", "--start", "equation"],
    ];
    for way in ways {
        let other = answer(way, &study("spring_slide"));
        for name in ["m_slider", "c_return", "d_slide"] {
            let (a, b) = (value(&other, name, "value"), value(&plain, name, "value"));
            let deviation = value(&plain, name, "standard_deviation");
            assert!((a - b).abs() < 0.05 * deviation, "{way:?} {name}: {a} {b}");
        }
    }
}

/// The profile's ends are those of the linearisation where the model is nearly linear.
#[test]
fn profiles_agree_with_the_linearisation_where_it_holds() {
    let result = answer(&["fit", "--profile", "c_return,d_slide"], &study("spring_slide"));
    let profiles = result["profiles"].as_array().expect("profiles");
    assert_eq!(profiles.len(), 2);
    for profile in profiles {
        let name = profile["parameter"].as_str().expect("a name");
        let deviation = value(&result, name, "standard_deviation");
        let interval = &result["parameters"]
            .as_array()
            .expect("parameters")
            .iter()
            .find(|p| p["name"] == name)
            .expect("it")["interval"];
        for (end, linear) in [(&profile["lower"], &interval[0]), (&profile["upper"], &interval[1])] {
            let (end, linear) = (end.as_f64().expect("closed"), linear.as_f64().expect("a number"));
            assert!((end - linear).abs() < 0.1 * deviation, "{name}: {end} {linear}");
        }
    }
    assert!(!run(&["fit", "--profile", "nothing"], &study("spring_slide")).status.success());
}

/// Several searches, all digits the same on one thread and on two.
#[test]
fn threads_do_not_change_a_digit_of_a_fit() {
    let on = |threads: &str| answer(&["fit", "--starts", "4", "--threads", threads], &study("spring_slide"));
    assert_eq!(on("1"), on("2"));
}

/// A blade that turns fast, a parallelogram that branches, and a slider whose stiffness is identified.
const CAUTIOUS: &str = "study cautious\n\
    body blade {\n\
      mass = 0.42 kg, centre_of_gravity = (0.4 m, 0 m, 0 m), inertia = (0, 0.0224, 0.0224 kg*m^2)\n\
      modes = \"arm_modes.csv\", damping_ratio = 1 %, mode_count = 1, point tip = (0.8 m, 0 m, 0 m)\n\
    }\n\
    joint shaft: revolute(z) ground -> blade { motion = 20 rad/s * t }\n\
    body ground { point far = (0.5 m, 0 m, 1 m), point near = (0 m, 0 m, 1 m) }\n\
    body c1 { mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }\n\
    body c2 { mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }\n\
    body rod { mass = 1 kg, inertia = 0.05 kg*m^2, point tip = (0.5 m, 0 m, 0 m) }\n\
    joint crank_1: revolute(z) ground.near -> c1\njoint crank_2: revolute(z) ground.far -> c2\n\
    joint a: revolute(z) c1.tip -> rod\njoint b: axes(shift z, turn x, turn y, turn z) rod.tip -> c2.tip\n\
    body slider { mass = 1 kg }\njoint guide: prismatic(z) ground -> slider\n\
    force spring: spring on guide { stiffness = c }\n\
    measure z [mm] = guide.position\nidentify { c in 200 .. 800 N/m from 300 N/m }\n\
    experiment run { data = \"run.csv\", start = rest {\n\
      guide.position = 10 mm, crank_1.position = 1 rad, crank_2.position = 1 rad, crank_1.velocity = 4 rad/s\n\
    } }\n\
    manoeuvre turn { for 1 s, start = rest { crank_1.position = 1 rad, crank_2.position = 1 rad, crank_1.velocity = 4 rad/s } }\n\
    criterion most [mm] = max(guide.position) in turn { below = 11 mm }\n";

/// What a simulation neglects or leaves to chance is told by every command that simulates, before it goes on to longer
/// work.
#[test]
fn cautions_reach_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let modes = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/elastic_arm/arm_modes.csv");
    std::fs::copy(modes, folder.path().join("arm_modes.csv")).expect("copied");
    let rows = (0..=100).map(|k| f64::from(k) * 0.01).map(|t| format!("{t},{}\n", 10.0 * (20.0 * t).cos()));
    std::fs::write(folder.path().join("run.csv"), format!("t [s],z [mm]\n{}", rows.collect::<String>()))
        .expect("written");
    let study = folder.path().join("cautious.ident");
    std::fs::write(&study, CAUTIOUS).expect("written");
    for (name, records) in [("simulate", 2), ("fit", 1), ("compare", 1), ("validate", 2), ("diagnose", 1)] {
        let mut child = command(&[name, "--quiet"], &study)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let told = BufReader::new(child.stderr.take().expect("its standard error"));
        let mut found = [0, 0];
        for line in told.lines() {
            let line = line.expect("text");
            found[0] += usize::from(line.starts_with("warning[E0316]: elastic body `blade`"));
            found[1] += usize::from(line.starts_with("warning[E0317]: the loop through `b`"));
            if found == [records; 2] {
                break;
            }
        }
        // What a diagnosis does after its warnings takes minutes.
        let _ = child.kill();
        child.wait().expect("it ends");
        assert_eq!(found, [records; 2], "{name}");
    }
}

/// The variants side by side as a page: the test against the base as in the text, and the curves of both.
#[test]
fn variants_are_compared_on_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let original = study("quarter_vehicle");
    let data = original.with_file_name("data");
    let text_of_study = std::fs::read_to_string(&original).expect("the study");
    let variant = "\nvariant rubbing of base {\n  add effect rubbing: dry_friction on chassis_guide { F = F_rubbing, creep = 0.2 mm/s }\n  identify { F_rubbing in 0 N .. 1 kN from 60 N }\n}\n";
    let path = folder.path().join("quarter_vehicle.ident");
    std::fs::write(&path, text_of_study + variant).expect("written");
    std::fs::create_dir(folder.path().join("data")).expect("a folder");
    for file in std::fs::read_dir(data).expect("its data").flatten() {
        std::fs::copy(file.path(), folder.path().join("data").join(file.file_name())).expect("copied");
    }
    let page = folder.path().join("compared.html");
    let output = run(&["compare", "--quiet", "--html", text(&page)], &path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8(output.stdout).expect("text");
    let row = told.lines().skip_while(|line| *line != "Against base").find(|line| line.trim().starts_with("rubbing"));
    let figures: Vec<&str> = row.expect("a row of the variant").split_whitespace().collect();
    let page = std::fs::read_to_string(page).expect("the page");
    for part in ["<h2>Against base</h2>", "<td>rubbing</td>", "swatch variant1", "likelihood ratio"] {
        assert!(page.contains(part), "page shows {part}");
    }
    let criteria: Vec<f64> = figures[1..4].iter().map(|figure| figure.parse().expect("a number")).collect();
    assert!(criteria[0] < -100.0 && criteria[1] < -100.0 && criteria[2] > 100.0, "{criteria:?}");
    assert!(page.contains(&format!("<td class=\"number\">{}</td>", figures[1])), "the criterion of the text");
}
