//! P1 and P2 as studies: one call of the rates, nominal run and gradient at the tolerance that reaches the error asked
//! for.
//!
//! `cargo bench --bench problems` prints achieved errors (against a run of the same study at tolerance 1e-10) and
//! medians. The peers' figures are those of `../shared/bench`, measured on another occasion: ratios across machines are
//! rough. With the environment variable `IDENT_PEERS` set to a prepared copy of the peers' scripts, they run in turn
//! with the own runs; on one core (`taskset -c 0 cargo bench --bench problems`) both find it in the same condition.

#[path = "support/peer.rs"]
mod peer;
#[path = "generated/problems.rs"]
mod problems;
mod support;

use ident::fit::Control;
use ident::identify::{Settings, Weighting, fit};
use ident::integrate::Dynamics;
use ident::simulation::{Gradient, Trajectory, simulate};
use ident::statistics::NormalStream;
use ident::tape::Bound;
use peer::{Pairs, Peer};
use support::{compile, record, timed};

/// errY of the problems' definition.
fn error_of_outputs(own: &Trajectory, reference: &Trajectory) -> f64 {
    let channels = own.channels.iter().zip(&reference.channels);
    let errors = channels.map(|(own, reference)| {
        let size = reference.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        own.iter().zip(reference).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size
    });
    errors.fold(0.0, f64::max)
}

/// errS of the problems' definition.
fn error_of_sensitivities(own: &Trajectory, reference: &Trajectory, theta: &[f64]) -> f64 {
    let mut worst: f64 = 0.0;
    for (own, reference) in own.gradient.iter().zip(&reference.gradient) {
        let samples = own.len() / theta.len();
        let size = |j: usize| {
            reference[j * samples..(j + 1) * samples].iter().fold(0.0_f64, |m, v| m.max((v * theta[j]).abs()))
        };
        let largest = (0..theta.len()).map(size).fold(0.0, f64::max);
        for (j, parameter) in theta.iter().enumerate() {
            let range = j * samples..(j + 1) * samples;
            let differences =
                own[range.clone()].iter().zip(&reference[range]).map(|(a, b)| ((a - b) * parameter).abs());
            worst = worst.max(differences.fold(0.0, f64::max) / size(j).max(1e-3 * largest));
        }
    }
    worst
}

/// Tolerances of the references, far below the errors asked for. Slope jumps of the dampers are kinks of the
/// sensitivities, at which explicit steps at tight tolerances become very short.
const REFERENCE: f64 = 1e-10;
const GRADIENT_REFERENCE: f64 = 1e-8;

struct Peers {
    call: f64,
    nominal: f64,
    gradient: f64,
    /// Relative tolerances at which they reach the same errors; none where a run takes too long to be repeated.
    nominal_tolerance: &'static str,
    gradient_tolerance: Option<&'static str>,
    bdf_tolerance: &'static str,
}

const P1_PEERS: Peers = Peers {
    call: 0.22,
    nominal: 0.035,
    gradient: 0.155,
    nominal_tolerance: "3e-8",
    gradient_tolerance: Some("5e-7"),
    bdf_tolerance: "1e-8",
};
const P2_PEERS: Peers = Peers {
    call: 1.19,
    nominal: 0.19,
    gradient: 14.0,
    nominal_tolerance: "2e-8",
    gradient_tolerance: Some("2e-6"),
    bdf_tolerance: "1e-8",
};

/// Runs in turn with a peer, where one is prepared.
fn compare<T>(peer: &mut Option<Peer>, request: &str, own: impl FnMut() -> T) {
    if let Some(peer) = peer {
        let Pairs { own, peer, ratio } = peer.beside(request, own);
        println!("    in turn with the peer (`{request}`): {own:.3e} s, peer {peer:.3e} s: {ratio:.2} times");
    }
}

fn problem(name: &str, text: fn(f64) -> String, rate: f64, wanted: (f64, f64), peers: &Peers) {
    let compiled = compile(&text(REFERENCE));
    let record = record(&compiled, 10.0, rate);
    let theta: Vec<f64> = compiled.study.parameters.iter().map(|p| p.start).collect();
    let mut bound = Bound::new(&compiled.model, &record.inputs, &theta);
    let n = compiled.model.dimension();
    let mut peer = Peer::start();
    let (mut y, mut rates) = (vec![0.001; n], vec![0.0; n]);
    let mut calls = || {
        for k in 0..1000 {
            bound.explicit_rates(1.0 + 1e-4 * f64::from(k), &y, &mut rates);
            y[0] = 0.001 + 1e-12 * rates[0];
        }
    };
    let (call, ()) = timed(21, &mut calls);
    println!("{name}: {n} states, {} parameters; instructions {:?}", theta.len(), compiled.model.instruction_counts());
    println!("  rates: {:.3} us per call, peer {} us: {:.2} times", call * 1e3, peers.call, call * 1e3 / peers.call);
    compare(&mut peer, &format!("{name} rates -"), calls);
    let reference = simulate(&compiled, &record, &theta, Gradient::None).expect("a reference");
    let (seconds, gradient_reference) = timed(1, || {
        simulate(&compile(&text(GRADIENT_REFERENCE)), &record, &theta, Gradient::AllParameters).expect("a reference")
    });
    println!(
        "  references: {} steps; gradient {} steps, {seconds:.2} s",
        reference.work.steps, gradient_reference.work.steps
    );
    for method in ["automatic", "bdf"] {
        let nominal = first_good(
            text,
            method,
            |compiled| {
                let (time, run) = timed(5, || simulate(compiled, &record, &theta, Gradient::None).expect("a run"));
                (error_of_outputs(&run, &reference), time, run)
            },
            wanted.0,
        );
        if let Some((tolerance, error, time, run)) = nominal {
            println!(
                "  nominal, {method}: {time:.4} s at tolerance {tolerance:.1e}, error {error:.1e}, {} steps {}; peer {} s: {:.2} times",
                run.work.steps,
                run.work.method,
                peers.nominal,
                time / peers.nominal
            );
            let compiled = compile(&with_method(text, tolerance, method));
            let request = match method {
                "bdf" => format!("{name} bdf {}", peers.bdf_tolerance),
                _ => format!("{name} nominal {}", peers.nominal_tolerance),
            };
            compare(&mut peer, &request, || simulate(&compiled, &record, &theta, Gradient::None).expect("a run"));
        }
        if method == "bdf" {
            continue;
        }
        let gradient = first_good(
            text,
            method,
            |compiled| {
                let (time, run) =
                    timed(3, || simulate(compiled, &record, &theta, Gradient::AllParameters).expect("a run"));
                (error_of_sensitivities(&run, &gradient_reference, &theta), time, run)
            },
            wanted.1,
        );
        if let Some((tolerance, error, time, run)) = gradient {
            let plain = compile(&with_method(text, tolerance, method));
            let (nominal, _) = timed(5, || simulate(&plain, &record, &theta, Gradient::None).expect("a run"));
            println!(
                "  gradient, {method}: {time:.4} s at tolerance {tolerance:.1e}, error {error:.1e}, {} steps; peer {} s: {:.2} times; {:.1} nominal runs",
                run.work.steps,
                peers.gradient,
                time / peers.gradient,
                time / nominal
            );
            if let Some(peers) = peers.gradient_tolerance {
                let request = format!("{name} gradient {peers}");
                compare(&mut peer, &request, || {
                    simulate(&plain, &record, &theta, Gradient::AllParameters).expect("a run")
                });
            }
        }
    }
}

fn with_method(text: fn(f64) -> String, tolerance: f64, method: &str) -> String {
    text(tolerance).replace("solver { ", &format!("solver {{ method = {method}, "))
}

/// The loosest tolerance whose run has at most the wanted error: tolerance, error, time, run.
fn first_good(
    text: fn(f64) -> String,
    method: &str,
    mut run: impl FnMut(&ident::simulation::Compiled) -> (f64, f64, Trajectory),
    wanted: f64,
) -> Option<(f64, f64, f64, Trajectory)> {
    for quarter_decade in 12..=40 {
        let tolerance = 10f64.powf(-0.25 * f64::from(quarter_decade));
        let compiled = compile(&with_method(text, tolerance, method));
        let (error, time, trajectory) = run(&compiled);
        if std::env::args().any(|argument| argument == "--all") {
            let work = &trajectory.work;
            println!(
                "    {method} {tolerance:.1e}: error {error:.1e}, {time:.4} s, {} steps, {} rejected, {} evaluations, {}",
                work.steps, work.rejected_error, work.residuals, work.method
            );
        }
        if error <= wanted {
            return Some((tolerance, error, time, trajectory));
        }
    }
    println!("  {method}: no tolerance reaches {wanted:.0e}");
    None
}

/// All ten parameters of P1 from the problem's start values and noise of 1 % of every channel's standard deviation.
fn identification(peer: f64) {
    /// Tolerance of the data, and of the simulations that a fit compares with them.
    const DATA: f64 = 1e-9;
    const FIT: f64 = 1e-5;
    const AWAY: [f64; 10] = [0.25, -0.20, 0.30, -0.25, 0.20, -0.30, 0.25, -0.20, 0.30, -0.25];
    let exact = compile(&problems::p1(DATA));
    let truth: Vec<f64> = exact.study.parameters.iter().map(|p| p.start).collect();
    let mut record = record(&exact, 10.0, 1000.0);
    let run = simulate(&exact, &record, &truth, Gradient::None).expect("data");
    let mut random = NormalStream::new(20_240_601, 0);
    let mut weights = Vec::new();
    for (measured, channel) in record.measured.iter_mut().zip(&run.channels) {
        let mean = channel.iter().sum::<f64>() / channel.len() as f64;
        let variance = channel.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / channel.len() as f64;
        let deviation = 0.01 * variance.sqrt();
        weights.push(1.0 / deviation);
        *measured = channel.iter().map(|v| v + deviation * random.normal()).collect();
    }
    let compiled = compile(&problems::p1(FIT));
    let settings = Settings {
        start: Some(truth.iter().zip(AWAY).map(|(value, away)| value * (1.0 + away)).collect()),
        weights: Some(Weighting { sources: vec!["known"; weights.len()], weights }),
        ..Settings::default()
    };
    let run = || {
        fit(&compiled, &[&record], &settings, &mut |_| Control::Continue).unwrap_or_else(|f| panic!("{}", f.message))
    };
    let (seconds, fitted) = timed(3, run);
    if std::env::args().any(|argument| argument == "--all") {
        println!("    {} iterations, {}: {:?}", fitted.iterations, fitted.stop_reason, fitted.cost_history);
    }
    let errors = fitted.theta.iter().zip(&truth).map(|(own, truth)| (own / truth - 1.0).abs());
    println!(
        "  identification: {seconds:.3} s, {} simulations, worst parameter error {:.2} %; peer {peer} s: {:.2} times",
        fitted.simulations,
        100.0 * errors.fold(0.0, f64::max),
        seconds / peer
    );
    compare(&mut Peer::start(), "P1 identification 1e-6", run);
}

fn main() {
    let wanted = std::env::args().nth(1).filter(|argument| !argument.starts_with('-'));
    let runs = |name: &str| wanted.as_deref().is_none_or(|wanted| wanted == name);
    if runs("p1") {
        problem("P1", problems::p1, 1000.0, (1e-6, 1e-4), &P1_PEERS);
        identification(4.3);
    }
    if runs("p2") {
        problem("P2", problems::p2, 200.0, (1e-6, 4e-4), &P2_PEERS);
    }
}
