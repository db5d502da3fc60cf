//! Spread of criteria by drawing parameters from their distribution.

use super::criterion::evaluate_on;
use crate::simulation::{Compiled, Gradient, Record};
use crate::statistics::NormalStream;
use rayon::prelude::*;

/// How many parameter vectors are drawn, and from which seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MonteCarlo {
    pub samples: usize,
    pub seed: u64,
}

impl Default for MonteCarlo {
    fn default() -> Self {
        Self { samples: 400, seed: 1 }
    }
}

/// Criteria at every drawn parameter vector.
pub(super) struct Draws {
    /// Per successful draw, all criteria.
    pub values: Vec<Vec<f64>>,
    pub failed: usize,
    /// Draws in which a parameter was moved back to its bound.
    pub cut: usize,
}

/// Draws from the normal distribution with the root `root` of the covariance (p x p, see
/// [`crate::statistics::covariance_root`]); the digits do not depend on the number of threads.
pub(super) fn draw(
    compiled: &Compiled,
    manoeuvres: &[Record],
    theta: &[f64],
    root: &[f64],
    options: MonteCarlo,
) -> Draws {
    let count = theta.len();
    let parameters = &compiled.study.parameters;
    let outcomes: Vec<(Option<Vec<f64>>, bool)> = (0..options.samples)
        .into_par_iter()
        .map(|sample| {
            let normals = NormalStream::new(options.seed, sample as u64).normals(count);
            let mut is_cut = false;
            let varied: Vec<f64> = (0..count)
                .map(|i| {
                    let value = theta[i] + (0..count).map(|k| root[k * count + i] * normals[k]).sum::<f64>();
                    let inside = value.clamp(parameters[i].lower, parameters[i].upper);
                    is_cut |= inside != value;
                    inside
                })
                .collect();
            let values = evaluate_on(compiled, manoeuvres, &varied, Gradient::None).ok().map(|found| found.values);
            (values, is_cut)
        })
        .collect();
    Draws {
        failed: outcomes.iter().filter(|(values, _)| values.is_none()).count(),
        cut: outcomes.iter().filter(|(_, is_cut)| *is_cut).count(),
        values: outcomes.into_iter().filter_map(|(values, _)| values).collect(),
    }
}
