//! Identifications repeated with fresh noise: how often the intervals hold the truth, and whether the noise's variance
//! comes out right.

#![allow(dead_code, reason = "each user looks at another part")]

use ident::fit::Control;
use ident::identify::{Settings, confidence, fit};
use ident::simulation::{Compiled, Gradient, Record, prepare, simulate};
use ident::statistics::NormalStream;
use ident::study::{self, Role};
use rayon::prelude::*;
use std::path::Path;

/// Noise as a share of a channel's deviation from its mean.
pub const NOISE: f64 = 0.03;
/// Samples of the shipped records that are used: short records are fast, and harder to be honest with.
pub const SAMPLES: usize = 400;

/// Spectrum of the noise.
#[derive(Clone, Copy)]
pub enum Colour {
    White,
    /// Autoregressive of order 2: a1, a2.
    Coloured(f64, f64),
}

impl Colour {
    /// Stationary noise of variance one.
    pub fn noise(self, stream: &mut NormalStream, count: usize) -> Vec<f64> {
        match self {
            Colour::White => stream.normals(count),
            Colour::Coloured(a, b) => {
                let variance = (1.0 - b) / ((1.0 + b) * ((1.0 - b).powi(2) - a * a));
                let (mut last, mut before) = (0.0, 0.0);
                let samples: Vec<f64> = (0..count + 500)
                    .map(|_| {
                        let value = a * last + b * before + stream.normal() / variance.sqrt();
                        (last, before) = (value, last);
                        value
                    })
                    .collect();
                samples[500..].to_vec()
            }
        }
    }
}

#[derive(Clone, Copy)]
pub struct Case {
    pub study: &'static str,
    pub filter: Option<&'static str>,
    pub colour: Colour,
    /// The fit weights by a model of the noise's colour.
    pub weighted: bool,
}

const FAST: &str = "filter { lowpass butterworth pass 14 Hz (2 dB) stop 28 Hz (20 dB) zero_phase }";
const SLOW: &str = "filter { lowpass butterworth pass 3 Hz (2 dB) stop 7 Hz (20 dB) zero_phase }";
const COLOURED: Colour = Colour::Coloured(0.9, -0.3);
/// That of the records of `swaying_sensor`, whose study asks for coloured noise.
const SWAYING: Colour = Colour::Coloured(1.6, -0.8);

/// Three studies, each with white noise, behind a prefilter, with coloured noise, and with weights that know the
/// colour; one that ships with coloured noise.
pub fn cases() -> Vec<Case> {
    let studies = [("spring_slide", FAST), ("two_mass", FAST), ("crane_pendulum", SLOW)];
    let of = |(study, filter): (&'static str, &'static str)| {
        let white = Case { study, filter: None, colour: Colour::White, weighted: false };
        let coloured = Case { colour: COLOURED, ..white };
        [white, Case { filter: Some(filter), ..white }, coloured, Case { weighted: true, ..coloured }]
    };
    let swaying = Case { study: "swaying_sensor", filter: None, colour: SWAYING, weighted: true };
    studies.into_iter().flat_map(of).chain([swaying]).collect()
}

impl Case {
    pub fn title(&self) -> String {
        let noise = match (self.filter, self.colour, self.weighted) {
            (Some(_), ..) => "white noise, prefilter",
            (None, Colour::White, _) => "white noise",
            (None, _, false) => "coloured noise",
            (None, _, true) => "coloured noise, weighted by its colour",
        };
        format!("{}: {noise}", self.study)
    }
}

/// Parameters and noise levels of one study over all repetitions.
pub struct Repeated {
    pub names: Vec<String>,
    /// Share of 95 % intervals that hold the truth, per parameter.
    pub coverage: Vec<f64>,
    /// Mean error over its scatter, per parameter.
    pub bias: Vec<f64>,
    /// Root mean square of the reported standard deviations over the scatter of the estimates.
    pub deviation_ratio: Vec<f64>,
    /// Mean of the estimated noise variances over the true one, per channel.
    pub variance_ratio: Vec<f64>,
}

/// One repetition: per parameter estimate, standard deviation, whether the interval holds the truth; per channel the
/// noise's level.
type Outcome = (Vec<(f64, f64, bool)>, Vec<f64>);

/// The model itself with the study's start values is the truth; fits start a twentieth of the bounds away from it.
pub fn repeat(case: &Case, repetitions: u64, seed: u64) -> Repeated {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies").join(case.study);
    let mut loaded = study::load(&path.join(format!("{}.ident", case.study)));
    if let Some(filter) = case.filter {
        loaded = loaded.with_text(filter);
    }
    let study = study::check(&loaded, None).expect("a study without errors").study;
    let (records, _) = prepare(&study, &loaded.directory, &[]);
    let compiled = Compiled::new(study).expect("a mechanism");
    let whole = records.iter().find(|record| record.role == Role::Estimation).expect("an estimation record");
    let record = whole.part(0..SAMPLES.min(whole.sample_count()), "short");
    let parameters = &compiled.study.parameters;
    let truth: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    let start: Vec<f64> = parameters.iter().map(|p| (p.start + 0.05 * p.scale()).min(p.upper)).collect();
    let exact = simulate(&compiled, &record, &truth, Gradient::None).expect("the truth can be simulated").channels;
    let deviations: Vec<f64> = exact.iter().map(|channel| NOISE * deviation(channel)).collect();
    let outcomes: Vec<Outcome> = (0..repetitions)
        .into_par_iter()
        .map(|repetition| {
            let mut stream = NormalStream::new(seed, repetition);
            let mut noisy = record.clone();
            for ((measured, channel), deviation) in noisy.measured.iter_mut().zip(&exact).zip(&deviations) {
                let noise = case.colour.noise(&mut stream, channel.len());
                *measured = channel.iter().zip(noise).map(|(value, e)| value + deviation * e).collect();
            }
            let weighted = case.weighted || compiled.study.solver.coloured_noise;
            once(&compiled, &noisy, &start, &truth, weighted)
        })
        .collect();
    let count = repetitions as f64;
    let mean = |value: &dyn Fn(&Outcome) -> f64| outcomes.iter().map(value).sum::<f64>() / count;
    let all = 0..truth.len();
    let scatter = |j: usize| {
        let middle = mean(&|run| run.0[j].0);
        mean(&|run| (run.0[j].0 - middle).powi(2)).sqrt()
    };
    Repeated {
        names: parameters.iter().map(|parameter| parameter.name.clone()).collect(),
        coverage: all.clone().map(|j| mean(&|run| f64::from(u8::from(run.0[j].2)))).collect(),
        bias: all.clone().map(|j| (mean(&|run| run.0[j].0) - truth[j]) / scatter(j)).collect(),
        deviation_ratio: all.map(|j| mean(&|run| run.0[j].1.powi(2)).sqrt() / scatter(j)).collect(),
        variance_ratio: (0..deviations.len()).map(|c| mean(&|run| (run.1[c] / deviations[c]).powi(2))).collect(),
    }
}

pub fn deviation(channel: &[f64]) -> f64 {
    let mean = channel.iter().sum::<f64>() / channel.len() as f64;
    (channel.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / channel.len() as f64).sqrt()
}

fn once(compiled: &Compiled, record: &Record, start: &[f64], truth: &[f64], coloured_noise: bool) -> Outcome {
    let settings = Settings { start: Some(start.to_vec()), coloured_noise, ..Settings::default() };
    let fitted = fit(compiled, &[record], &settings, &mut |_| Control::Continue).expect("a fit");
    let confidence = confidence(compiled, &fitted);
    let own = |j: usize| {
        let holds = confidence.interval(j).is_some_and(|(low, high)| (low..=high).contains(&truth[j]));
        (fitted.theta[j], confidence.standard_deviation(j).expect("determined"), holds)
    };
    let noise = record.measures.iter().map(|&measure| confidence.noise[measure].expect("a noise level")).collect();
    ((0..truth.len()).map(own).collect(), noise)
}
