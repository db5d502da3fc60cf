//! Studies compiled and run for measurements.

use ident::simulation::{Compiled, Record, prepare};
use ident::study::{check, load_text};
use std::time::Instant;

pub fn median(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_unstable_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

pub fn timed<T>(repetitions: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let mut times = Vec::new();
    let mut last = None;
    for _ in 0..repetitions {
        let begin = Instant::now();
        last = Some(work());
        times.push(begin.elapsed().as_secs_f64());
    }
    (median(times), last.expect("at least one repetition"))
}

pub fn compile(text: &str) -> Compiled {
    let loaded = load_text("generated.ident", text);
    let complain = |findings: &[ident::diagnostics::Diagnostic]| -> ! {
        panic!("{}", ident::diagnostics::render(findings, &loaded.sources, false))
    };
    let checked = check(&loaded, None).unwrap_or_else(|findings| complain(&findings));
    Compiled::new(checked.study).unwrap_or_else(|findings| complain(&findings))
}

/// A record of `duration` seconds, `rate` samples per second; the measured values do not matter.
pub fn record(compiled: &Compiled, duration: f64, rate: f64) -> Record {
    let folder = tempfile::tempdir().expect("a folder");
    let names: Vec<String> =
        compiled.study.measures.iter().map(|m| format!("{} [{}]", m.name, m.unit.symbol)).collect();
    let mut text = format!("t [s],{}\n", names.join(","));
    for k in 0..=(rate * duration).round() as usize {
        let t = k as f64 / rate;
        let values: Vec<String> = names.iter().enumerate().map(|(i, _)| format!("{}", (t + i as f64).sin())).collect();
        text += &format!("{t},{}\n", values.join(","));
    }
    std::fs::write(folder.path().join("run.csv"), text).expect("writable folder");
    let (mut records, findings) = prepare(&compiled.study, folder.path(), &[]);
    assert!(findings.iter().all(|finding| !finding.is_error()), "{findings:?}");
    records.remove(0)
}
