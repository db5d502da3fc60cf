//! How the tool grows with the mechanism: from text to tapes, per evaluation, per simulated second.
//!
//! `cargo bench --bench scale` prints one table per family. Medians of several runs on one thread; resident memory of
//! the whole process after compilation.

mod generated;
mod support;

use ident::integrate::{Dynamics, Work};
use ident::simulation::{Gradient, simulate};
use ident::tape::Bound;
use support::{compile, record, timed};

fn resident_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: f64 = status.split(' ').nth(1).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN);
    pages * 4096.0 / 1e6
}

/// Least-squares slope of log(y) over log(x).
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let above: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    above / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

fn family(name: &str, generate: fn(usize) -> String) {
    println!("{name:>8} {:>10} {:>12} {:>12} {:>12} {:>10}", "compile s", "rates us", "step us", "steps", "memory MB");
    let (mut per_step, mut per_call, mut memory) = (Vec::new(), Vec::new(), Vec::new());
    for size in [10, 20, 40, 80, 160, 320] {
        let text = generate(size);
        let (seconds, compiled) = timed(3, || compile(&text));
        let record = record(&compiled, 1.0, 100.0);
        let theta: Vec<f64> = compiled.study.parameters.iter().map(|p| p.start).collect();
        let mut bound = Bound::new(&compiled.model, &record.inputs, &theta);
        let mut y = vec![0.1; compiled.model.dimension()];
        let mut rates = vec![0.0; y.len()];
        let (call, _) = timed(9, || {
            for k in 0..100 {
                y[0] = 0.1 + 1e-6 * f64::from(k);
                bound.explicit_rates(0.0, &y, &mut rates);
            }
        });
        let (run, trajectory) =
            timed(3, || simulate(&compiled, &record, &theta, Gradient::None).expect("a simulation"));
        let steps = trajectory.work.steps;
        let step = run / steps as f64;
        per_step.push((size as f64, step));
        per_call.push((size as f64, call / 100.0));
        memory.push((size as f64, resident_megabytes()));
        println!(
            "{size:>8} {seconds:>10.3} {:>12.2} {:>12.1} {steps:>12} {:>10.0}",
            call * 1e4,
            step * 1e6,
            resident_megabytes()
        );
    }
    println!(
        "growth: rates ^{:.2}, step ^{:.2}, memory ^{:.2}\n",
        exponent(&per_call),
        exponent(&per_step),
        exponent(&memory)
    );
}

fn counts(work: &Work) -> String {
    format!(
        "{} steps, {} rejected, {} residuals, {} factorisations, {}",
        work.steps,
        work.rejected_error + work.rejected_newton,
        work.residuals,
        work.factorisations,
        work.method
    )
}

fn vehicle() {
    let text = generated::vehicle();
    let (seconds, compiled) = timed(3, || compile(&text));
    let [rates, jacobian, parameters, _] = compiled.model.instruction_counts();
    println!("vehicle: 73 bodies, 17 loops, 158 force elements, {} parameters", compiled.study.parameters.len());
    println!(
        "compiled in {seconds:.3} s, {:.0} MB; {} states, {} algebraic; rates {rates}, Jacobian {jacobian}, parameter derivatives {parameters} operations",
        resident_megabytes(),
        compiled.system.states.len(),
        compiled.system.algebraic.len()
    );
    let record = record(&compiled, 13.0, 100.0);
    let theta: Vec<f64> = compiled.study.parameters.iter().map(|p| p.start).collect();
    let (nominal, trajectory) =
        timed(1, || simulate(&compiled, &record, &theta, Gradient::None).expect("a simulation"));
    println!(
        "nominal: {nominal:.2} s for 13 s, {:.1} times real time, {:.2} ms per step; {}",
        13.0 / nominal,
        1e3 * nominal / trajectory.work.steps as f64,
        counts(&trajectory.work)
    );
    let (gradient, trajectory) =
        timed(1, || simulate(&compiled, &record, &theta, Gradient::AllParameters).expect("a gradient"));
    println!(
        "gradient: {gradient:.2} s, {:.1} nominal runs, {:.2} ms per step; {}",
        gradient / nominal,
        1e3 * gradient / trajectory.work.steps as f64,
        counts(&trajectory.work)
    );
}

fn main() {
    let wanted = std::env::args().nth(1).filter(|argument| !argument.starts_with('-'));
    let runs = |name: &str| wanted.as_deref().is_none_or(|wanted| wanted == name);
    if runs("chain") {
        family("chain", generated::chain);
    }
    if runs("tree") {
        family("tree", generated::tree);
    }
    if runs("vehicle") {
        vehicle();
    }
}
