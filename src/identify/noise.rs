//! The noise behind a residual: its level before the prefilter, and its colour.

use super::fitting::Fitted;
use crate::signal::AutoRegression;
use crate::simulation::Compiled;
use crate::statistics::{Covariance, NoiseChannel, noise_variances};

/// Orders of autoregressive models that are tried.
const LARGEST_ORDER: usize = 24;
/// The parameters are never said to have taken more than the rest of the noise's energy.
const LEAST_LEFT: f64 = 0.1;
/// Order of the autoregressive image of the prefilter.
const FILTER_ORDER: usize = 16;

/// Stationary model of the weighted, filtered noise of one channel in one record.
///
/// What a low-pass leaves of the band would make a model at the full sampling rate badly conditioned; it is made of
/// every
/// `stride`-th sample, all such series together. The colour that the prefilter gives is known; only that of the noise
/// before it is estimated.
#[derive(Clone, Debug)]
pub(super) struct NoiseModel {
    pub stride: usize,
    filter: AutoRegression,
    pub model: AutoRegression,
    /// The share of the fitted parameters is given back, lag by lag.
    complete: bool,
}

impl NoiseModel {
    pub fn order(&self) -> usize {
        self.model.order()
    }

    /// Variance of the filtered noise.
    fn power(&self) -> f64 {
        self.model.colour(&self.filter.colour(&[1.0])).iter().map(|value| value * value).sum()
    }
}

/// One model per block of the residual, order by the Bayesian criterion.
pub(super) fn models(fitted: &Fitted) -> Vec<NoiseModel> {
    fitted
        .blocks
        .iter()
        .map(|block| {
            let stride = stride(fitted, block.record);
            let residual = &fitted.residual[block.rows.clone()];
            let order = if stride > 1 { FILTER_ORDER } else { 0 };
            let shape = fitted.filters[block.record].noise_autocovariance(order, stride);
            let filter = AutoRegression::from_autocovariance(&shape);
            let mut series: Vec<Vec<f64>> = (0..stride).map(|phase| every(residual, phase, stride)).collect();
            let deviation = filter.variance.sqrt();
            for values in &mut series {
                filter.whiten(values);
                values.iter_mut().for_each(|value| *value /= deviation);
            }
            let views: Vec<&[f64]> = series.iter().map(Vec::as_slice).collect();
            let model = AutoRegression::choose_over(&views, residual.len() / stride, LARGEST_ORDER);
            let mut noise = NoiseModel { stride, filter, model, complete: false };
            let square = residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64;
            let power = noise.power();
            if power > 0.0 {
                // The level from the whole residual: the image is least exact where the filter leaves least.
                noise.model.variance *= square / power;
            }
            noise
        })
        .collect()
}

/// Share of the noise's power that its own past predicts, per block of the residual; what the prefilter's colour
/// predicts not counted.
pub fn predicted_shares(fitted: &Fitted) -> Vec<f64> {
    let share = |noise: NoiseModel| {
        let power = noise.model.power();
        if power > 0.0 { 1.0 - noise.model.variance / power } else { 0.0 }
    };
    models(fitted).into_iter().map(share).collect()
}

/// The same of all blocks together.
pub(super) fn predicted_share(fitted: &Fitted) -> f64 {
    let (mut left, mut all) = (0.0, 0.0);
    for (block, noise) in fitted.blocks.iter().zip(models(fitted)) {
        let power = noise.model.power();
        if power > 0.0 {
            left += block.rows.len() as f64 * noise.model.variance / power;
            all += block.rows.len() as f64;
        }
    }
    if all > 0.0 { 1.0 - left / all } else { 0.0 }
}

/// Samples that a band up to the stop edge leaves independent.
fn stride(fitted: &Fitted, record: usize) -> usize {
    let Some(design) = fitted.filters[record].design() else { return 1 };
    // Where both passes together leave a tenth of the amplitude, a hundredth of the power.
    let band_end = design.cutoff * 9f64.powf(0.5 / f64::from(design.order.max(1)));
    (fitted.rates[record] / (2.0 * band_end)).floor().max(1.0) as usize
}

pub(super) fn every(values: &[f64], phase: usize, stride: usize) -> Vec<f64> {
    values.iter().skip(phase).step_by(stride).copied().collect()
}

/// Gamma = Phi^T S^T S Cov(D) S^T S Phi of method 3.30, p x p. `gradient`: N x p, weighted and filtered; rows after the
/// last block are priors with variances of their own. The fitted parameters have taken their share of the residual,
/// from which the models are: it is given back to the level (method 4.5 for coloured noise; `inverse` is Xi^+).
pub(super) fn gamma(fitted: &Fitted, gradient: &[f64], models: &[NoiseModel], inverse: &[f64]) -> Vec<f64> {
    let count = fitted.theta.len();
    let rows = gradient.len() / count.max(1);
    let mut gamma = vec![0.0; count * count];
    let mut add = |columns: &[Vec<f64>], factor: f64| add_gram(&mut gamma, columns, factor);
    let column = |j: usize, range: std::ops::Range<usize>| &gradient[j * rows + range.start..j * rows + range.end];
    for (block, noise) in fitted.blocks.iter().zip(models) {
        let filtered: Vec<Vec<f64>> = (0..count)
            .map(|j| {
                let mut own = column(j, block.rows.clone()).to_vec();
                fitted.filters[block.record].apply(&mut own);
                own
            })
            .collect();
        for phase in 0..noise.stride {
            let shaped: Vec<Vec<f64>> =
                filtered.iter().map(|own| noise.model.colour(&every(own, phase, noise.stride))).collect();
            // Shaped columns differ in length by their rest; what is missing is negligible.
            add(&shaped, 1.0);
        }
    }
    let energy: f64 = fitted.blocks.iter().zip(models).map(|(b, noise)| b.rows.len() as f64 * noise.power()).sum();
    let taken: f64 = (0..count * count).map(|k| inverse[k] * gamma[k]).sum();
    let left = (1.0 - taken / energy).clamp(LEAST_LEFT, 1.0);
    if energy > 0.0 && !models.iter().all(|noise| noise.complete) {
        gamma.iter_mut().for_each(|value| *value /= left);
    }
    let mut add = |columns: &[Vec<f64>], factor: f64| add_gram(&mut gamma, columns, factor);
    let rest: Vec<Vec<f64>> = (0..count).map(|j| column(j, fitted.residual.len()..rows).to_vec()).collect();
    let deviations = |row: usize| fitted.prior_rows.get(row).map_or(1.0, |prior| prior.variance.sqrt());
    let rest: Vec<Vec<f64>> = rest
        .into_iter()
        .map(|own| own.iter().enumerate().map(|(row, value)| deviations(row) * value).collect())
        .collect();
    add(&rest, 1.0);
    gamma
}

/// Factor by which the data's cost counts more than it knows, because coloured noise is weighted as if it were white:
/// mean of the parameters' variances over those for white noise of the same level. At least 1.
pub(super) fn inflation(compiled: &Compiled, fitted: &Fitted, threshold: f64) -> f64 {
    let count = fitted.theta.len();
    let scales: Vec<f64> = compiled.study.parameters.iter().map(crate::study::Parameter::scale).collect();
    let alone = Fitted { prior_rows: Vec::new(), ..fitted.clone() };
    let level = fitted.cost() / fitted.residual.len().max(1) as f64;
    let Ok(covariance) = Covariance::new(&alone.gradient, &scales, 1.0, None, threshold) else { return 1.0 };
    let gamma = gamma(&alone, &alone.gradient, &models(&alone), &covariance.matrix);
    let trace: f64 = (0..count * count).map(|k| covariance.matrix[k] * gamma[k]).sum();
    let rank = count.saturating_sub(covariance.undetermined.len()).max(1);
    let factor = trace / rank as f64 / level;
    if factor.is_finite() { factor.max(1.0) } else { 1.0 }
}

/// Longest lag of the models' autocovariance that the completion takes into account.
const LONGEST: usize = 400;
/// Rounds of the completion: each time the share is a share of the noise as completed before.
const COMPLETIONS: usize = 3;

/// Gives the models back what the fitted parameters have taken of the noise (method 4.5 lag by lag): it is missing at
/// the very frequencies at which the parameters are determined, where an average share would be too little. With the
/// residual
/// `(I - P) d`, `P = Phi Xi^+ Phi^T`, its autocovariance is that of the noise d less
/// `P R + R P - P R P` on average along the diagonals. Records behind a prefilter keep the average share.
pub(super) fn complete(fitted: &Fitted, models: &mut [NoiseModel], inverse: &[f64]) {
    let filtered = |record: usize| fitted.filters[record].design().is_some();
    if fitted.blocks.iter().any(|block| filtered(block.record)) {
        return;
    }
    let seen: Vec<Vec<f64>> = models.iter().map(|noise| autocovariance(&noise.model)).collect();
    for _ in 0..COMPLETIONS {
        let taken = taken(fitted, models, inverse);
        for ((noise, seen), taken) in models.iter_mut().zip(&seen).zip(taken) {
            let completed: Vec<f64> =
                taken.iter().enumerate().map(|(lag, own)| seen.get(lag).copied().unwrap_or(0.0) + own).collect();
            let model = AutoRegression::from_autocovariance(&completed);
            if model.order() + 1 == completed.len() && model.variance > 0.0 {
                (noise.model, noise.complete) = (model, true);
            }
        }
    }
}

/// Per block, at the lags up to the model's order: what the residual's autocovariance lacks of the noise's if that is
/// as the models say.
fn taken(fitted: &Fitted, models: &[NoiseModel], inverse: &[f64]) -> Vec<Vec<f64>> {
    let (count, rows) = (fitted.theta.len(), fitted.residual.len());
    let column =
        |j: usize, range: &std::ops::Range<usize>| &fitted.gradient[j * rows + range.start..j * rows + range.end];
    let covariances: Vec<Vec<f64>> = models.iter().map(|noise| autocovariance(&noise.model)).collect();
    // R Phi per block, and Phi^T R Phi of all.
    let shaped: Vec<Vec<Vec<f64>>> = fitted
        .blocks
        .iter()
        .zip(&covariances)
        .map(|(block, covariance)| (0..count).map(|j| toeplitz(covariance, column(j, &block.rows))).collect())
        .collect();
    let mut gamma = vec![0.0; count * count];
    for (block, own) in fitted.blocks.iter().zip(&shaped) {
        for (j, image) in own.iter().enumerate() {
            for i in 0..count {
                gamma[j * count + i] += column(i, &block.rows).iter().zip(image).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
    let blocks = fitted.blocks.iter().zip(&shaped).zip(models);
    blocks
        .map(|((block, own), noise)| {
            let length = block.rows.len();
            let phi: Vec<Vec<f64>> = (0..count).map(|j| column(j, &block.rows).to_vec()).collect();
            // u = Phi Xi^+ - as columns; then P R = u (R Phi)^T, and P R P = u Gamma u^T.
            let u = combined(&phi, inverse);
            let through = combined(&u, &gamma);
            (0..=noise.model.order())
                .map(|lag| {
                    let along = |a: &[f64], b: &[f64]| a.iter().zip(&b[lag..]).map(|(x, y)| x * y).sum::<f64>();
                    let own = |j: usize| along(&u[j], &own[j]) + along(&own[j], &u[j]) - along(&through[j], &u[j]);
                    (0..count).map(own).sum::<f64>() / (length - lag).max(1) as f64
                })
                .collect()
        })
        .collect()
}

/// Columns times a p x p matrix.
pub(super) fn combined(columns: &[Vec<f64>], matrix: &[f64]) -> Vec<Vec<f64>> {
    let (count, length) = (columns.len(), columns.first().map_or(0, Vec::len));
    (0..count)
        .map(|j| {
            let mut sum = vec![0.0; length];
            for (i, own) in columns.iter().enumerate() {
                let factor = matrix[j * count + i];
                sum.iter_mut().zip(own).for_each(|(value, entry)| *value += factor * entry);
            }
            sum
        })
        .collect()
}

/// Of the process, up to the lag where it has decayed.
fn autocovariance(model: &AutoRegression) -> Vec<f64> {
    let impulse = model.colour(&[1.0]);
    let lags = impulse.len().min(LONGEST);
    (0..lags).map(|lag| impulse.iter().zip(&impulse[lag..]).map(|(a, b)| a * b).sum()).collect()
}

/// R x with the Toeplitz matrix R of an autocovariance.
fn toeplitz(covariance: &[f64], x: &[f64]) -> Vec<f64> {
    let mut image: Vec<f64> = x.iter().map(|value| covariance[0] * value).collect();
    for (lag, value) in covariance.iter().enumerate().skip(1).take(x.len().saturating_sub(1)) {
        for t in lag..x.len() {
            image[t] += value * x[t - lag];
            image[t - lag] += value * x[t];
        }
    }
    image
}

fn add_gram(gamma: &mut [f64], columns: &[Vec<f64>], factor: f64) {
    let count = columns.len();
    for j in 0..count {
        for i in 0..count {
            gamma[j * count + i] += factor * columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum::<f64>();
        }
    }
}

/// Standard deviation of the noise before the prefilter, per measure, SI (method 4.5).
pub(super) fn deviations(
    compiled: &Compiled,
    fitted: &Fitted,
    gradient_with_priors: &[f64],
    scales: &[f64],
    threshold: f64,
) -> Vec<Option<f64>> {
    let count = fitted.theta.len();
    let measures = compiled.study.measures.len();
    let rows = fitted.residual.len();
    let mut numbers: Vec<usize> = fitted.blocks.iter().map(|block| block.measure).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let own: Vec<Vec<f64>> = fitted
        .blocks
        .iter()
        .map(|block| {
            let column = |j: usize| &fitted.gradient[j * rows + block.rows.start..j * rows + block.rows.end];
            (0..count).flat_map(|j| column(j).iter().copied()).collect()
        })
        .collect();
    let channels: Vec<NoiseChannel> = fitted
        .blocks
        .iter()
        .zip(&own)
        .map(|(block, gradient)| NoiseChannel {
            channel: numbers.binary_search(&block.measure).unwrap_or(0),
            residual: &fitted.residual[block.rows.clone()],
            gradient,
            weight: fitted.weighting.weights[block.measure],
            trace: fitted.filters[block.record].trace(block.rows.len()),
        })
        .collect();
    let all_rows = gradient_with_priors.len() / count.max(1);
    let prior: Vec<f64> = (0..count * count)
        .map(|k| {
            let part = |j: usize| &gradient_with_priors[j * all_rows + rows..(j + 1) * all_rows];
            part(k % count).iter().zip(part(k / count)).map(|(a, b)| a * b).sum()
        })
        .collect();
    let prior = (all_rows > rows).then_some(prior.as_slice());
    let filter = |block: usize, column: &mut [f64]| fitted.filters[fitted.blocks[block].record].apply(column);
    let mut deviations = vec![None; measures];
    if let Ok(variances) = noise_variances(&channels, scales, prior, threshold, &filter) {
        for (&measure, variance) in numbers.iter().zip(variances) {
            // A channel that stands still between two steps shows less than its rounding does.
            let rounding = compiled.study.measures[measure].rounding();
            deviations[measure] = Some(variance.sqrt().max(rounding)).filter(|deviation| deviation.is_finite());
        }
    }
    deviations
}
