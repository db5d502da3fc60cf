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

/// A mass between a soft and a hard spring: the slope of its force jumps at zero, twice per period. Exact by half
/// periods.
#[test]
fn gradients_across_kinks_are_exact() {
    const STIFFNESS: [f64; 2] = [400.0, 2500.0];
    const SPEED: f64 = 0.8;
    let study = |tolerance: f64| {
        format!(
            "study two_springs \"Two springs\"\n\
             law between(x: coordinate) -> load {{ param soft: load/coordinate, hard: load/coordinate\n\
               = if x < 0 m then -hard * x else -soft * x }}\n\
             body mass {{ mass = 1 kg }}\njoint slide: prismatic(z) ground -> mass\n\
             force springs: between on slide {{ soft = soft, hard = hard }}\n\
             measure x [m] = slide.position\n\
             identify {{ soft in 100 .. 1000 N/m from 400 N/m\n  hard in 1000 .. 5000 N/m from 2500 N/m }}\n\
             experiment run {{ data = \"run.csv\", start = rest {{ slide.velocity = {SPEED} m/s }} }}\n\
             solver {{ tolerance = {tolerance:e}, method = runge_kutta }}\n"
        )
    };
    let [soft, hard] = STIFFNESS;
    let half = |k: f64| std::f64::consts::PI / k.sqrt();
    let times: Vec<f64> = (0..800).map(|k| f64::from(k) * 0.01).collect();
    // Slopes of the position by both stiffnesses: within a half period, and by the times of all half periods before.
    let exact = |t: f64| {
        let period = half(soft) + half(hard);
        let (count, into) = ((t / period).floor(), t % period);
        let is_soft = into < half(soft);
        let (k, sign, into) = if is_soft { (soft, 1.0, into) } else { (hard, -1.0, into - half(soft)) };
        let angle = k.sqrt() * into;
        let speed = sign * SPEED * angle.cos();
        let own = (speed * into - sign * SPEED / k.sqrt() * angle.sin()) / (2.0 * k);
        let later = |k: f64| speed * half(k) / (2.0 * k);
        if is_soft {
            [own + count * later(soft), count * later(hard)]
        } else {
            [(count + 1.0) * later(soft), own + count * later(hard)]
        }
    };
    let folder = tempfile::tempdir().expect("a folder");
    let rows: Vec<String> = times.iter().map(|t| format!("{t},{t}\n")).collect();
    std::fs::write(folder.path().join("run.csv"), format!("t [s],x [m]\n{}", rows.concat())).expect("written");
    for tolerance in [1e-5, 1e-8, 1e-10] {
        let mut loaded = study::load_text("two_springs.ident", &study(tolerance));
        loaded.directory = folder.path().to_owned();
        let study = study::check(&loaded, None).unwrap_or_else(|findings| panic!("{findings:?}")).study;
        let (records, findings) = prepare(&study, &loaded.directory, &[]);
        assert!(findings.is_empty(), "{findings:?}");
        let compiled = Compiled::new(study).expect("a mechanism that can move");
        let run = simulate(&compiled, &records[0], &STIFFNESS, Gradient::AllParameters).expect("a run");
        let samples = times.len();
        let (mut worst, mut size) = ([0.0_f64; 2], [0.0_f64; 2]);
        for (k, &t) in times.iter().enumerate() {
            for (j, slope) in exact(t).into_iter().enumerate() {
                worst[j] = worst[j].max((run.gradient[0][j * samples + k] - slope).abs());
                size[j] = size[j].max(slope.abs());
            }
        }
        let errors = [worst[0] / size[0], worst[1] / size[1]];
        let (steps, rejected) = (run.work.steps, run.work.rejected_error);
        println!(
            "tolerance {tolerance:e}: errors {:.1e} {:.1e}, {steps} steps, {rejected} rejected",
            errors[0], errors[1]
        );
        assert!(errors.iter().all(|error| *error < 300.0 * tolerance), "{errors:?}");
        // Two kinks in each of 36 periods.
        assert!(rejected < 2 * 72, "{rejected} steps rejected");
    }
}
