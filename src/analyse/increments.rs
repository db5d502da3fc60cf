//! Relevance by increments as wide as the parameters' spread (method 8).

use super::criterion::evaluate_on;
use crate::simulation::{Compiled, Gradient, Record};
use rayon::prelude::*;

/// (J(theta + s) - J(theta - s)) / 2 s per criterion and parameter, s the parameter's standard deviation, cut at its
/// bounds.
/// `None` where a simulation fails or the parameter has no spread.
pub(super) fn relevances(
    compiled: &Compiled,
    manoeuvres: &[Record],
    theta: &[f64],
    spread: &[Option<f64>],
) -> Vec<Option<Vec<f64>>> {
    (0..theta.len())
        .into_par_iter()
        .map(|j| {
            let width = spread[j].filter(|width| *width > 0.0)?;
            let parameter = &compiled.study.parameters[j];
            let moved = |value: f64| {
                let mut varied = theta.to_vec();
                varied[j] = value.clamp(parameter.lower, parameter.upper);
                let values = evaluate_on(compiled, manoeuvres, &varied, Gradient::None).ok()?.values;
                Some((varied[j], values))
            };
            let ((high, above), (low, below)) = (moved(theta[j] + width)?, moved(theta[j] - width)?);
            Some(above.iter().zip(&below).map(|(a, b)| (a - b) / (high - low)).collect())
        })
        .collect()
}
