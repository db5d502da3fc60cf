//! A study's experiments as one least-squares problem.
//!
//! The residual is `S F (Y_measured - Y(theta))`, record by record, channel by channel: F the zero-phase prefilter (or
//! the identity), S the channels' weights. Its gradient passes through the same chain (internal differentiation).

use crate::fit::{EvaluationFailure, LeastSquares, transformed};
use crate::signal::{AutoRegression, Prefilter};
use crate::simulation::{Compiled, Gradient, Record, Trajectory, simulate};
use crate::study::Loss;
use rayon::prelude::*;

/// What stays fixed while parameters move: the compiled study, the records, filter and weights.
#[derive(Clone)]
pub struct Problem<'a> {
    pub compiled: &'a Compiled,
    pub records: Vec<&'a Record>,
    /// One per record.
    pub prefilters: Vec<Prefilter>,
    /// Per measure of the study, 1/SI unit; the same for every record.
    pub weights: Vec<f64>,
    /// Noise model per block, by which the weighted residual is whitened and scaled to variance one; empty: none.
    pub whitening: Vec<Option<AutoRegression>>,
    pub simulations: usize,
    pub failures: usize,
}

/// Residuals of all channels of one record, filtered: `channels[c][k]`.
pub type Residuals = Vec<Vec<f64>>;

/// Where one channel of one record stands in the stacked residual.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Index into [`Problem::records`].
    pub record: usize,
    /// Index into the study's measures.
    pub measure: usize,
    pub rows: std::ops::Range<usize>,
}

impl<'a> Problem<'a> {
    pub fn new(
        compiled: &'a Compiled,
        records: Vec<&'a Record>,
        prefilters: Vec<Prefilter>,
        weights: Vec<f64>,
    ) -> Self {
        Self { compiled, records, prefilters, weights, whitening: Vec::new(), simulations: 0, failures: 0 }
    }

    pub fn parameter_count(&self) -> usize {
        self.compiled.study.parameters.len()
    }

    /// Total number of residuals.
    pub fn residual_count(&self) -> usize {
        self.records.iter().map(|record| record.sample_count() * record.measures.len()).sum()
    }

    /// The stacked residual's blocks, in order.
    pub fn blocks(&self) -> Vec<Block> {
        let mut offset = 0;
        let mut blocks = Vec::new();
        for (r, record) in self.records.iter().enumerate() {
            for &measure in &record.measures {
                blocks.push(Block { record: r, measure, rows: offset..offset + record.sample_count() });
                offset += record.sample_count();
            }
        }
        blocks
    }

    /// Whitens a weighted column of a block.
    fn whiten(&self, block: usize, column: &mut [f64]) {
        if let Some(Some(model)) = self.whitening.get(block)
            && model.variance > 0.0
        {
            model.whiten(column);
            let deviation = model.variance.sqrt();
            column.iter_mut().for_each(|value| *value /= deviation);
        }
    }

    fn run(&mut self, theta: &[f64], gradient: Gradient) -> Result<Vec<Trajectory>, EvaluationFailure> {
        self.simulations += self.records.len();
        let compiled = self.compiled;
        let outcomes: Vec<_> =
            self.records.par_iter().map(|record| simulate(compiled, record, theta, gradient)).collect();
        let mut trajectories = Vec::with_capacity(outcomes.len());
        for outcome in outcomes {
            match outcome {
                Ok(trajectory) => trajectories.push(trajectory),
                Err(failure) => {
                    self.failures += 1;
                    return Err(EvaluationFailure { explanation: format!("{failure}; {}", failure.help) });
                }
            }
        }
        Ok(trajectories)
    }

    /// Filtered, unweighted residuals of record `r` in SI.
    pub fn filtered_residuals(&self, r: usize, trajectory: &Trajectory) -> Residuals {
        let record = self.records[r];
        (0..record.measures.len())
            .map(|c| {
                let mut residual: Vec<f64> =
                    record.measured[c].iter().zip(&trajectory.channels[c]).map(|(m, s)| m - s).collect();
                self.prefilters[r].apply(&mut residual);
                residual
            })
            .collect()
    }

    fn stacked_residual(&self, trajectories: &[Trajectory]) -> Vec<f64> {
        let mut stacked = Vec::with_capacity(self.residual_count());
        let mut block = 0;
        for (r, trajectory) in trajectories.iter().enumerate() {
            for (c, residual) in self.filtered_residuals(r, trajectory).into_iter().enumerate() {
                let weight = self.weights[self.records[r].measures[c]];
                let loss = self.compiled.study.solver.loss;
                let mut weighted: Vec<f64> = residual.iter().map(|value| weight * value).collect();
                self.whiten(block, &mut weighted);
                stacked.extend(weighted.into_iter().map(|value| transformed(loss, value).0));
                block += 1;
            }
        }
        stacked
    }

    fn stacked_gradient(&self, trajectories: &[Trajectory]) -> Vec<f64> {
        let (rows, columns) = (self.residual_count(), self.parameter_count());
        let mut gradient = vec![0.0; rows * columns];
        let loss = self.compiled.study.solver.loss;
        let (mut offset, mut block) = (0, 0);
        for (r, trajectory) in trajectories.iter().enumerate() {
            let record = self.records[r];
            let samples = record.sample_count();
            let mut residuals = if loss == Loss::Squares { Vec::new() } else { self.filtered_residuals(r, trajectory) };
            for (c, &measure) in record.measures.iter().enumerate() {
                if let Some(residual) = residuals.get_mut(c) {
                    residual.iter_mut().for_each(|value| *value *= self.weights[measure]);
                    self.whiten(block, residual);
                }
                for j in 0..columns {
                    let target = &mut gradient[j * rows + offset..j * rows + offset + samples];
                    target.copy_from_slice(&trajectory.gradient[c][j * samples..(j + 1) * samples]);
                    self.prefilters[r].apply(target);
                    target.iter_mut().for_each(|value| *value *= -self.weights[measure]);
                    self.whiten(block, target);
                    if let Some(residual) = residuals.get(c) {
                        target.iter_mut().zip(residual).for_each(|(value, r)| *value *= transformed(loss, *r).1);
                    }
                }
                offset += samples;
                block += 1;
            }
        }
        gradient
    }

    /// Weighted, filtered sum of squares of "the channel is its mean", per block (method 4.4.1: V_mean).
    pub fn mean_squares(&self) -> Vec<f64> {
        self.blocks()
            .iter()
            .enumerate()
            .map(|(index, block)| {
                let record = self.records[block.record];
                let channel = record.measures.iter().position(|&measure| measure == block.measure);
                let Some(channel) = channel else { return 0.0 };
                let mut values = record.measured[channel].clone();
                let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
                values.iter_mut().for_each(|value| *value -= mean);
                self.prefilters[block.record].apply(&mut values);
                let weight = self.weights[block.measure];
                values.iter_mut().for_each(|value| *value *= weight);
                self.whiten(index, &mut values);
                values.iter().map(|value| value * value).sum()
            })
            .collect()
    }

    /// Simulated channels of every record.
    ///
    /// # Errors
    /// The first record (in order) that could not be simulated.
    pub fn trajectories(&mut self, theta: &[f64]) -> Result<Vec<Trajectory>, EvaluationFailure> {
        self.run(theta, Gradient::None)
    }
}

impl LeastSquares for Problem<'_> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let trajectories = self.run(theta, Gradient::None)?;
        Ok(self.stacked_residual(&trajectories))
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let trajectories = self.run(theta, Gradient::AllParameters)?;
        Ok((self.stacked_residual(&trajectories), self.stacked_gradient(&trajectories)))
    }
}
