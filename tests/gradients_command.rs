//! `ident gradients`: the cost over the iterations, with the figure.

use std::path::Path;
use std::process::Command;

/// At a loose tolerance differences of simulations are noise and the search with them ends higher; the internal
/// derivative is that of the simulation itself. At a tight one both reach the same.
#[test]
fn internal_differentiation_needs_no_tight_tolerance() {
    let folder = tempfile::tempdir().expect("a folder");
    let figure = folder.path().join("gradients.svg");
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/two_mass/two_mass.ident");
    let output = Command::new(env!("CARGO_BIN_EXE_ident"))
        .arg("gradients")
        .arg(study)
        .args(["--tolerances", "1e-3,1e-7", "--quiet", "--format", "json", "--figure"])
        .arg(&figure)
        .output()
        .expect("ident runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let descents = answer["result"]["descents"].as_array().expect("descents");
    let cost = |k: usize| descents[k]["costs"].as_array().and_then(|costs| costs.last()?.as_f64()).expect("a cost");
    let names: Vec<&str> = descents.iter().filter_map(|descent| descent["gradient"].as_str()).collect();
    assert_eq!(names[..2], ["internal differentiation", "finite differences"]);
    println!("costs: {:?}", (0..4).map(cost).collect::<Vec<f64>>());
    assert!(cost(0) <= cost(1) * (1.0 + 1e-6), "internal {} against differences {}", cost(0), cost(1));
    assert!((cost(2) / cost(3) - 1.0).abs() < 0.01, "at the tight tolerance {} and {}", cost(2), cost(3));
    let simulations = |k: usize| descents[k]["simulations"].as_u64().expect("a number");
    assert!(simulations(0) > 0 && simulations(1) > 0);
    let picture = std::fs::read_to_string(&figure).expect("the figure");
    assert!(picture.contains("differences, 1e-3") && picture.contains("iterations"));
}
