//! Pre-whitening: coloured noise modelled as autoregressive, the cost weighted by it, iterated to convergence.

use super::confidence::RANK_THRESHOLD;
use super::fitting::{Fitted, Settings, finish, search_once};
use super::noise::combined;
use super::problem::Problem;
use crate::diagnostics::{Code, Diagnostic};
use crate::fit::{Control, LeastSquares, PriorRow, Progress, StopReason};
use crate::signal::AutoRegression;
use crate::simulation::Compiled;
use crate::statistics::Covariance;
use crate::study::Parameter;

/// Largest order of a noise model.
const LARGEST_ORDER: usize = 24;
const ROUNDS: usize = 10;
/// Parameters that move by less than this share of their bounds between two rounds are settled.
const SETTLED: f64 = 1e-6;

/// The fit repeated with a noise model per channel and record, taken from its own residual, until neither changes. A
/// prefilter takes the place of the noise model: records behind one stay as they are.
///
/// # Errors
/// The model cannot be evaluated where the fit without noise models ended.
pub(super) fn whitened(
    compiled: &Compiled,
    mut problem: Problem,
    white: Fitted,
    settings: &Settings,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Fitted, Diagnostic> {
    let scales: Vec<f64> = compiled.study.parameters.iter().map(Parameter::scale).collect();
    let blocks = problem.blocks();
    // Whitened data count as much as they know: so does prior knowledge.
    let rows: Vec<PriorRow> = white.prior_rows.iter().map(|row| row.with_variance(1.0)).collect();
    let mut residual = white.residual.clone();
    let mut theta = white.theta.clone();
    let mut iterations = white.iterations;
    let mut taken = None;
    for round in 1.. {
        let models = blocks.iter().enumerate().map(|(index, block)| {
            let filtered = problem.prefilters[block.record].design().is_some();
            (!filtered).then(|| {
                let seen = AutoRegression::choose(&residual[block.rows.clone()], LARGEST_ORDER);
                let share =
                    taken.as_ref().map(|information: &Vec<f64>| share(&white, index, information, seen.order()));
                share.map_or_else(|| seen.clone(), |share| completed(&seen, &share))
            })
        });
        problem.whitening = models.collect();
        let estimate = search_once(compiled, &mut problem, &theta, settings, &rows, observer)?;
        iterations += estimate.iterations;
        let moved = estimate.theta.iter().zip(&theta).zip(&scales).map(|((a, b), scale)| (a - b).abs() / scale);
        let settled = moved.fold(0.0, f64::max) < SETTLED;
        theta.clone_from(&estimate.theta);
        if settled || round == ROUNDS || estimate.stop_reason == StopReason::Interrupted {
            let mut fitted =
                finish(estimate, white.weighting.clone(), &problem, white.cost_history.clone(), iterations);
            fitted.noise_levels = Some(levels(&problem, &white));
            fitted.whitening = problem.whitening;
            (fitted.prior_rows, fitted.start_costs, fitted.bands) = (rows, white.start_costs, white.bands);
            return Ok(fitted);
        }
        taken = inverse_information(&estimate.gradient, theta.len(), &scales);
        let models = std::mem::take(&mut problem.whitening);
        let failed = |explanation: String| Diagnostic::error(Code::FIT_FAILED, explanation);
        residual = problem.residual(&theta).map_err(|failure| failed(failure.explanation))?;
        problem.whitening = models;
    }
    Ok(white)
}

/// Xi^+ of a weighted gradient, p x p; `None` where it is not finite.
fn inverse_information(gradient: &[f64], count: usize, scales: &[f64]) -> Option<Vec<f64>> {
    (count > 0).then_some(())?;
    Covariance::new(gradient, scales, 1.0, None, RANK_THRESHOLD).ok().map(|covariance| covariance.matrix)
}

/// What the residual's autocovariance lacks of the noise's at the lags 0 ..= `order`, because the fitted parameters
/// have taken it: with weights that know the colour it is `Phi Xi^+ Phi^T`, on average along its diagonals. The
/// gradient before the whitening is that of the first fit.
fn share(white: &Fitted, block: usize, inverse: &[f64], order: usize) -> Vec<f64> {
    let (rows, range) = (white.residual.len().max(1), white.blocks[block].rows.clone());
    let phi: Vec<Vec<f64>> = white.gradient.chunks_exact(rows).map(|column| column[range.clone()].to_vec()).collect();
    let u = combined(&phi, inverse);
    let along = |lag: usize| {
        let of = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(&b[lag..]).map(|(x, y)| x * y).sum::<f64>();
        u.iter().zip(&phi).map(of).sum::<f64>() / (range.len() - lag).max(1) as f64
    };
    (0..=order).map(along).collect()
}

/// The model of the same order with the share given back.
fn completed(seen: &AutoRegression, share: &[f64]) -> AutoRegression {
    let impulse = seen.colour(&[1.0]);
    let lag = |lag: usize| impulse.iter().zip(&impulse[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let whole: Vec<f64> = share.iter().enumerate().map(|(k, own)| lag(k) + own).collect();
    let model = AutoRegression::from_autocovariance(&whole);
    if model.order() == seen.order() && model.variance > 0.0 { model } else { seen.clone() }
}

/// Standard deviation of the noise per measure, SI: of the process that each model stands for.
fn levels(problem: &Problem, white: &Fitted) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0.0); problem.weights.len()];
    for (block, model) in problem.blocks().iter().zip(&problem.whitening) {
        let weight = white.weighting.weights[block.measure];
        if let (Some(model), true) = (model, weight > 0.0) {
            let count = block.rows.len() as f64;
            sums[block.measure].0 += count * model.power() / (weight * weight);
            sums[block.measure].1 += count;
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| (sum / count).sqrt())).collect()
}
