//! Weights of the channels: first by magnitude, then by the deviation of the residual (method 3.20, IV.6).

use super::problem::Block;
use crate::fit::{original, robust_deviation};
use crate::signal::Prefilter;
use crate::simulation::Record;
use crate::study::{Loss, Study};

/// Weights per measure and where they come from.
#[derive(Clone, Debug, PartialEq)]
pub struct Weighting {
    /// 1/SI unit; 0 for measures that no record compares.
    pub weights: Vec<f64>,
    /// `stated in the study`, `magnitude of the channel`, `residual of the fit`.
    pub sources: Vec<&'static str>,
}

const STATED: &str = "stated in the study";
const MAGNITUDE: &str = "magnitude of the channel";
const RESIDUAL: &str = "residual of the fit";

impl Weighting {
    /// The same weights as a beginning: at least one fit follows with those of its own residual.
    pub(super) fn as_first(&self) -> Self {
        let begin = |source: &&'static str| if *source == RESIDUAL { MAGNITUDE } else { *source };
        Self { weights: self.weights.clone(), sources: self.sources.iter().map(begin).collect() }
    }

    /// Largest relative change of a weight against `other`, after taking out a common factor.
    pub fn largest_change(&self, other: &Weighting) -> f64 {
        let ratios: Vec<f64> = self
            .weights
            .iter()
            .zip(&other.weights)
            .filter(|(_, old)| **old > 0.0)
            .map(|(new, old)| (new / old).ln())
            .collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
        // A common factor changes nothing but the meaning of the cost; one change of that is always wanted.
        let first = self.sources != other.sources;
        let spread = ratios.iter().map(|ratio| (ratio - mean).abs()).fold(0.0, f64::max);
        if first { f64::INFINITY } else { spread }
    }
}

/// Weights before any fit: the noise where the study states it, else the channel's deviation from its mean.
pub(super) fn first_weights(study: &Study, records: &[&Record], filters: &[Prefilter]) -> Weighting {
    let count = study.measures.len();
    let mut squares = vec![0.0; count];
    let mut samples = vec![0usize; count];
    for (record, filter) in records.iter().zip(filters) {
        for (c, &measure) in record.measures.iter().enumerate() {
            let mut channel = record.measured[c].clone();
            let mean = channel.iter().sum::<f64>() / channel.len().max(1) as f64;
            channel.iter_mut().for_each(|value| *value -= mean);
            filter.apply(&mut channel);
            squares[measure] += channel.iter().map(|value| value * value).sum::<f64>();
            samples[measure] += channel.len();
        }
    }
    let mut weighting = Weighting { weights: vec![0.0; count], sources: vec![MAGNITUDE; count] };
    for (measure, declared) in study.measures.iter().enumerate() {
        if let Some(noise) = declared.noise {
            weighting.weights[measure] = declared.weight / noise;
            weighting.sources[measure] = STATED;
        } else if squares[measure] > 0.0 {
            weighting.weights[measure] = declared.weight / (squares[measure] / samples[measure] as f64).sqrt();
        }
    }
    weighting
}

/// Weights from the residual of a fit with `parameter_count` parameters; stated noise stays. `gains`: share of white
/// noise's variance that passes each record's prefilter, so that weights refer to the noise before it (method 4.6).
pub(super) fn residual_deviations(
    current: &Weighting,
    study: &Study,
    residual: &[f64],
    blocks: &[Block],
    gains: &[f64],
    parameter_count: usize,
) -> Weighting {
    let mut next = current.clone();
    // Each channel pays its share of the fitted parameters (method 4.5).
    let passed = |block: &Block| block.rows.len() as f64 * gains[block.record];
    let all: f64 = blocks.iter().map(passed).sum();
    let free = 1.0 - parameter_count as f64 / all.max(parameter_count as f64 + 1.0);
    for (measure, declared) in study.measures.iter().enumerate() {
        if declared.noise.is_some() || current.weights[measure] == 0.0 {
            continue;
        }
        let own = || blocks.iter().filter(|block| block.measure == measure);
        let squares: f64 = own().flat_map(|block| &residual[block.rows.clone()]).map(|value| value * value).sum();
        let count: f64 = own().map(passed).sum();
        let spread = if study.solver.loss == Loss::Squares {
            (squares / (count * free)).sqrt()
        } else {
            let rows = own().flat_map(|block| &residual[block.rows.clone()]);
            let share = count / own().map(|block| block.rows.len()).sum::<usize>().max(1) as f64;
            robust_deviation(rows.map(|value| original(study.solver.loss, *value))) / (share * free).sqrt()
        };
        // What a channel shows cannot be known better than it rounds, even where the model meets the rounded values.
        let deviation = (declared.weight * spread / current.weights[measure]).max(declared.rounding());
        if deviation > 0.0 {
            next.weights[measure] = declared.weight / deviation;
            next.sources[measure] = RESIDUAL;
        }
    }
    next
}
