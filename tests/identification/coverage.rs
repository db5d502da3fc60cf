//! 500 repeated identifications with fresh noise of three shipped studies: 95 % intervals hold the truth in 93 to 97 %
//! of them, and the noise variance is unbiased within 2 %; white noise, behind a prefilter, coloured noise.
//!
//! `cargo run --release --example coverage -- 5000` is the same with other numbers and seeds.

use crate::repeated::{Case, Colour, NOISE, SAMPLES, cases, deviation, repeat};
use crate::shipped::{compiled, loaded};
use ident::fit::Control;
use ident::identify::{Settings, confidence, fit, profiles};
use ident::simulation::{Gradient, simulate};
use ident::statistics::NormalStream;
use rayon::prelude::*;

const REPETITIONS: u64 = 500;

/// A coverage of 95 % has a standard error of 0.97 % in 500 repetitions: the mean over a study's parameters is asserted
/// to lie in 93 to 97 %, each parameter by itself within three standard errors.
fn honest(wanted: impl Fn(&Case) -> bool) {
    for case in cases().iter().filter(|case| wanted(case)) {
        let result = repeat(case, REPETITIONS, 20);
        let mean = result.coverage.iter().sum::<f64>() / result.coverage.len() as f64;
        let shown =
            format!("{}: {:?} {:?}, noise {:?}", case.title(), result.names, result.coverage, result.variance_ratio);
        println!("{shown}");
        assert!((0.93..=0.97).contains(&mean), "{shown}");
        let error = (0.95 * 0.05 / REPETITIONS as f64).sqrt();
        assert!(result.coverage.iter().all(|share| (share - 0.95).abs() <= 3.0 * error), "{shown}");
        assert!(result.variance_ratio.iter().all(|ratio| (ratio - 1.0).abs() < 0.02), "{shown}");
    }
}

/// One channel has its noise above the band of the motion, the other within it, both of the same deviation: weights
/// that know the colour trust the first, and the intervals say how much better that is.
#[test]
fn weights_for_coloured_noise_make_better_estimates() {
    const RUNS: u64 = 100;
    let (compiled, records) = compiled(&loaded("spring_slide"));
    let record = records[0].part(0..SAMPLES, "short");
    let truth: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    let exact = simulate(&compiled, &record, &truth, Gradient::None).expect("the truth can be simulated").channels;
    let outcomes: Vec<[(f64, bool); 2]> = (0..RUNS)
        .into_par_iter()
        .map(|run| {
            let mut stream = NormalStream::new(33, run);
            let mut noisy = record.clone();
            for ((measured, channel), slope) in noisy.measured.iter_mut().zip(&exact).zip([-0.9, 0.9]) {
                let noise = Colour::Coloured(slope, 0.0).noise(&mut stream, channel.len());
                let deviation = NOISE * deviation(channel);
                *measured = channel.iter().zip(noise).map(|(value, e)| value + deviation * e).collect();
            }
            [false, true].map(|coloured_noise| {
                let settings = Settings { coloured_noise, ..Settings::default() };
                let fitted = fit(&compiled, &[&noisy], &settings, &mut |_| Control::Continue).expect("a fit");
                let known = confidence(&compiled, &fitted);
                let (low, high) = known.interval(1).expect("determined");
                (fitted.theta[1] / truth[1] - 1.0, (low..=high).contains(&truth[1]))
            })
        })
        .collect();
    let scatter = |way: usize| outcomes.iter().map(|run| run[way].0.powi(2)).sum::<f64>().sqrt();
    let held = outcomes.iter().filter(|run| run[1].1).count();
    println!("{} {} {held}", scatter(0), scatter(1));
    assert!(scatter(1) < 0.7 * scatter(0), "{} {}", scatter(0), scatter(1));
    // 95 of 100 within three standard errors.
    assert!((88..=100).contains(&held), "{held}");
}

/// Where the fit weights by the noise's colour the profile does, too: its ends are those of the interval in a nearly
/// linear model.
#[test]
fn profiles_weight_as_the_fit_does() {
    let (compiled, records) = compiled(&loaded("spring_slide"));
    let mut record = records[0].part(0..SAMPLES, "short");
    let truth: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    let exact = simulate(&compiled, &record, &truth, Gradient::None).expect("the truth can be simulated").channels;
    let mut stream = NormalStream::new(5, 0);
    for ((measured, channel), slope) in record.measured.iter_mut().zip(&exact).zip([-0.9, 0.9]) {
        let noise = Colour::Coloured(slope, 0.0).noise(&mut stream, channel.len());
        *measured = channel.iter().zip(noise).map(|(value, e)| value + NOISE * deviation(channel) * e).collect();
    }
    let settings = Settings { coloured_noise: true, ..Settings::default() };
    let fitted = fit(&compiled, &[&record], &settings, &mut |_| Control::Continue).expect("a fit");
    let known = confidence(&compiled, &fitted);
    for profile in profiles(&compiled, &fitted, &known, &[&record], &[0, 1, 2]).expect("profiles") {
        let index = compiled.study.parameters.iter().position(|p| p.name == profile.parameter).expect("known");
        let (low, high) = known.interval(index).expect("determined");
        let unit = &compiled.study.parameters[index].unit;
        let ends = (profile.lower.expect("an end"), profile.upper.expect("an end"));
        let ratio = (ends.1 - ends.0) / (unit.from_si(high) - unit.from_si(low));
        assert!((ratio - 1.0).abs() < 0.03, "{}: {ends:?}, {ratio}", profile.parameter);
    }
}

#[test]
fn white_noise() {
    honest(|case| case.filter.is_none() && matches!(case.colour, Colour::White));
}

#[test]
fn white_noise_behind_a_prefilter() {
    honest(|case| case.filter.is_some());
}

#[test]
fn coloured_noise() {
    honest(|case| matches!(case.colour, Colour::Coloured(..)) && (!case.weighted || case.study == "swaying_sensor"));
}
