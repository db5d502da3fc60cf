//! Results of others beside own data that leave a direction open.

use super::confidence::RANK_THRESHOLD;
use crate::fit::PriorRow;
use crate::statistics::Covariance;

/// What another result seems to know along a direction that the data leave open counts from this share of the strongest
/// it knows. Less comes from the turn of its own undetermined directions between its parameters and these.
const TURN: f64 = 0.03;

/// The rows, those of other results (linearised) without their seeming knowledge along what `gradient` (of the data
/// alone, N x p at `theta`) leaves open.
pub(super) fn straightened(rows: &[PriorRow], theta: &[f64], gradient: &[f64], scales: &[f64]) -> Vec<PriorRow> {
    let mut rows = rows.to_vec();
    if !rows.iter().any(|row| row.linearised) {
        return rows;
    }
    let Ok(data) = Covariance::new(gradient, scales, 1.0, None, RANK_THRESHOLD) else { return rows };
    for direction in &data.undetermined {
        straighten(&mut rows, theta, direction, scales);
    }
    rows
}

fn straighten(rows: &mut [PriorRow], theta: &[f64], direction: &[f64], scales: &[f64]) {
    let scaled = |row: &PriorRow| -> Vec<f64> { (0..scales.len()).map(|j| row.slope(j) * scales[j]).collect() };
    let along = |row: &[f64]| row.iter().zip(direction).map(|(a, b)| a * b).sum::<f64>();
    let linearised = || rows.iter().filter(|row| row.linearised).map(scaled);
    let known: f64 = linearised().map(|row| along(&row).powi(2)).sum();
    let strongest = linearised().map(|row| row.iter().map(|value| value * value).sum::<f64>()).fold(0.0, f64::max);
    if known.sqrt() >= TURN * strongest.sqrt() {
        return;
    }
    for row in rows.iter_mut().filter(|row| row.linearised) {
        let mut weights = scaled(row);
        let share = along(&weights);
        weights.iter_mut().zip(direction).for_each(|(value, entry)| *value -= share * entry);
        // What the row says at these parameters stays.
        let residual = row.residual(theta);
        row.weights = weights.iter().zip(scales).map(|(value, scale)| value / scale).enumerate().collect();
        row.target = 0.0;
        row.target = row.residual(theta) - residual;
    }
}
