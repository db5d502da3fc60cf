//! Coverage of the 95 % intervals and bias of the noise variances over many repeated identifications of three shipped
//! studies: white noise, behind a prefilter, coloured noise.
//!
//! ```sh
//! cargo run --release --example coverage -- 2000
//! ```

#[path = "../tests/support/repeated.rs"]
mod repeated;

/// Repetitions, seed, and a part of the titles of the cases to run.
fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |otherwise: u64| arguments.next().map_or(Ok(otherwise), |text| text.parse());
    let (Ok(repetitions), Ok(seed)) = (number(500), number(20)) else {
        eprintln!("usage: coverage [REPETITIONS [SEED [STUDY OR NOISE]]]");
        std::process::exit(2);
    };
    let wanted = arguments.next().unwrap_or_default();
    println!(
        "{repetitions} repetitions: share of intervals that hold the truth (reported over true deviation, bias in deviations)"
    );
    for case in repeated::cases().iter().filter(|case| case.title().contains(&wanted)) {
        let result = repeated::repeat(case, repetitions, seed);
        println!("{}", case.title());
        for (j, name) in result.names.iter().enumerate() {
            let (share, ratio, bias) = (result.coverage[j], result.deviation_ratio[j], result.bias[j]);
            println!("  {name:<16} {:>6.2} %   ({ratio:.3}, {bias:+.3})", 100.0 * share);
        }
        let ratios: Vec<String> = result.variance_ratio.iter().map(|ratio| format!("{ratio:.4}")).collect();
        println!("  noise variance over the true one: {}", ratios.join(", "));
    }
}
