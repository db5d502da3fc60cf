//! The gradient of every shipped study against dual numbers and differences along the same steps.

use ident::simulation::{Compiled, Gradient, certify, prepare, simulate};
use ident::study::{self, Loaded, Method};
use std::path::Path;

/// Studies whose data ship with them.
const STUDIES: [&str; 4] = ["quarter_vehicle", "two_mass", "crane_pendulum", "spring_slide"];

fn shipped(name: &str) -> Loaded {
    study::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("studies/{name}/{name}.ident")))
}

fn digits(loaded: &Loaded, method: Method) -> f64 {
    let mut study = study::check(loaded, None).expect("a sound study").study;
    study.solver.method = method;
    let (records, findings) = prepare(&study, &loaded.directory, &[]);
    assert!(findings.is_empty(), "{findings:?}");
    let compiled = Compiled::new(study).expect("a mechanism that can move");
    let theta: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    let first = &records[0];
    let short = first.part(0..first.sample_count().min(500), "begin");
    let trajectory = simulate(&compiled, &short, &theta, Gradient::AllParameters).expect("a run");
    assert!(trajectory.gradient.iter().flatten().any(|slope| *slope != 0.0));
    certify(&compiled, &[&short], &theta).expect("a run").expect("parameters")
}

#[test]
fn gradients_are_those_of_the_discrete_solution() {
    for name in STUDIES {
        for method in [Method::RungeKutta, Method::Bdf] {
            let digits = digits(&shipped(name), method);
            println!("{name} {method:?}: {digits:.1} digits");
            assert!(digits > 8.0, "{name} {method:?}: {digits} digits");
        }
    }
}

/// Andrews' mechanism, torque and stiffness identified: the forces of its loops are multipliers.
#[test]
fn gradients_of_closed_loops_are_those_of_the_discrete_solution() {
    let folder = tempfile::tempdir().expect("a folder");
    let samples: Vec<String> = (0..=60).map(|k| format!("{:e},{k},{k}\n", k as f64 * 1e-4)).collect();
    std::fs::write(folder.path().join("run.csv"), format!("t [s],q_beta,q_gamma\n{}", samples.concat()))
        .expect("written");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/multibody/andrews.ident");
    let text = std::fs::read_to_string(path).expect("the study");
    let measured = "data = \"run.csv\", measures = {q_beta, q_gamma}";
    let text = text.replace("data = \"run.csv\"", measured);
    let text = text.replace("identify {", "identify { spring.stiffness in 4000 .. 5000 N/m from 4530 N/m,");
    let mut loaded = study::load_text("andrews.ident", &text);
    loaded.directory = folder.path().to_owned();
    let digits = digits(&loaded, Method::Automatic);
    println!("andrews: {digits:.1} digits");
    assert!(digits > 8.0, "{digits} digits");
}
