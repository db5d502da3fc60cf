//! Speed-up by threads: several searches, several experiments, Monte Carlo samples, on one thread and on all. The
//! digits are the same, which is checked on the way. Medians of a few rounds in which one thread and all take turns, so
//! that what else the machine does meets both alike.
//!
//! ```sh
//! cargo run --release --example speedup
//! ```

use ident::analyse::{MonteCarlo, validity};
use ident::fit::Control;
use ident::identify::{Settings, confidence, fit};
use ident::simulation::{Compiled, Record, prepare};
use ident::study::{self, Role};
use std::path::Path;
use std::time::Instant;

fn prepared(name: &str) -> (Compiled, Vec<Record>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies").join(name).join(format!("{name}.ident"));
    let loaded = study::load(&path);
    let study = study::check(&loaded, None).expect("a study without errors").study;
    let (records, _) = prepare(&study, &loaded.directory, &[]);
    let records = records.into_iter().filter(|record| record.role == Role::Estimation).collect();
    (Compiled::new(study).expect("a mechanism"), records)
}

/// Rounds of which the medians are shown.
const ROUNDS: usize = 5;
/// Iterations of each search: enough for every search to have work.
const ITERATIONS: usize = 4;

/// All digits of the parameters after a fit.
fn fitted(compiled: &Compiled, records: &[&Record], further_starts: usize) -> Vec<u64> {
    let settings = Settings { further_starts, seed: 1, maximum_iterations: Some(ITERATIONS), ..Settings::default() };
    let fitted = fit(compiled, records, &settings, &mut |_| Control::Continue).expect("a fit");
    fitted.theta.iter().map(|value| value.to_bits()).collect()
}

fn timed(threads: usize, work: &(dyn Fn() -> Vec<u64> + Sync)) -> (f64, Vec<u64>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        let begin = Instant::now();
        let digits = work();
        (begin.elapsed().as_secs_f64(), digits)
    })
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let threads = std::thread::available_parallelism().map_or(2, usize::from).max(2);
    let (vehicle, vehicle_records) = prepared("quarter_vehicle");
    let count = vehicle_records[0].sample_count();
    let parts: Vec<Record> =
        (0..4).map(|k| vehicle_records[0].part(k * count / 16..(k + 1) * count / 16, "part")).collect();
    let short = [vehicle_records[0].part(0..count / 8, "eighth")];
    let (springs, springs_records) = prepared("series_springs");
    let springs_fit =
        fit(&springs, &springs_records.iter().collect::<Vec<_>>(), &Settings::default(), &mut |_| Control::Continue)
            .expect("a fit");
    let known = confidence(&springs, &springs_fit);
    let starts = || fitted(&vehicle, &short.iter().collect::<Vec<_>>(), 7);
    let experiments = || fitted(&vehicle, &parts.iter().collect::<Vec<_>>(), 0);
    let samples = || {
        let result = validity(&springs, &springs_fit, &known, MonteCarlo { samples: 500, seed: 1 });
        let deviations = result.criteria.iter().filter_map(|criterion| criterion.by_monte_carlo);
        deviations.map(|spread| spread.standard_deviation.to_bits()).collect()
    };
    println!("{:<28} {:>10} {:>10} {:>9}", "", "1 thread", format!("{threads} threads"), "speed-up");
    // Caches and clocks settle before anything is measured.
    timed(threads, &samples);
    let works: [(&str, &(dyn Fn() -> Vec<u64> + Sync)); 3] =
        [("8 searches", &starts), ("4 experiments", &experiments), ("500 Monte Carlo samples", &samples)];
    for (name, work) in works {
        let mut times: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        for _ in 0..ROUNDS {
            let (alone, digits) = timed(1, work);
            let (together, same) = timed(threads, work);
            assert_eq!(digits, same, "{name}: threads changed a digit");
            times[0].push(alone);
            times[1].push(together);
        }
        let [alone, together] = times.map(median);
        println!("{name:<28} {alone:>8.2} s {together:>8.2} s {:>9.2}", alone / together);
    }
}
