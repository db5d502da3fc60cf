//! The gradient of every shipped study against dual numbers and differences along the same steps.

use ident::simulation::{Compiled, Gradient, certify, prepare, simulate};
use ident::study::{self, Method};
use std::path::Path;

/// Studies whose data ship with them.
const STUDIES: [&str; 4] = ["quarter_vehicle", "two_mass", "crane_pendulum", "spring_slide"];

fn digits(name: &str, method: Method) -> f64 {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("studies/{name}/{name}.ident"));
    let loaded = study::load(&file);
    let mut study = study::check(&loaded, None).expect("a sound study").study;
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
            let digits = digits(name, method);
            println!("{name} {method:?}: {digits:.1} digits");
            assert!(digits > 8.0, "{name} {method:?}: {digits} digits");
        }
    }
}
