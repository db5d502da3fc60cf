//! One trust-region step of a linear least-squares model with bounds.

use crate::linear::{DecompositionError, SingularValueDecomposition, rounding_threshold};

/// The linear model `|r + J D^-1 z|^2`, compressed to p rows by its singular value decomposition.
///
/// `z` are the steps in units of the scaling matrix D (More-1978).
pub(super) struct LinearModel {
    parameters: usize,
    /// Sigma V^T, k x p column-major.
    compressed: Vec<f64>,
    /// U^T r, length k.
    residual: Vec<f64>,
    decomposition: SmallDecomposition,
    threshold: f64,
}

/// A step and what the model promises for it.
pub(super) struct ModelStep {
    /// In units of D.
    pub z: Vec<f64>,
    /// `|r|^2 - |r + J D^-1 z|^2`.
    pub predicted_reduction: f64,
    /// `r^T J D^-1 z`, negative for descent.
    pub slope: f64,
    /// The step is the minimiser of the model itself: the trust region did not limit it.
    pub undamped: bool,
}

struct SmallDecomposition {
    singular_values: Vec<f64>,
    /// U, rows x k column-major.
    u: Vec<f64>,
    /// V, columns x k column-major.
    v: Vec<f64>,
    rows: usize,
    columns: usize,
}

impl LinearModel {
    /// `scaled_gradient` is J D^-1, N x p column-major.
    pub fn new(
        residual: &[f64],
        scaled_gradient: &[f64],
        parameters: usize,
        rank_threshold: f64,
    ) -> Result<Self, DecompositionError> {
        let rows = residual.len();
        let full = SingularValueDecomposition::new(rows, parameters, scaled_gradient)?;
        let size = full.singular_values.len();
        let projected: Vec<f64> = (0..size).map(|k| dot(full.left(k), residual)).collect();
        let mut compressed = vec![0.0; size * parameters];
        for j in 0..parameters {
            for k in 0..size {
                compressed[j * size + k] = full.singular_values[k] * full.right(k)[j];
            }
        }
        let mut identity = vec![0.0; size * size];
        (0..size).for_each(|k| identity[k * size + k] = 1.0);
        let decomposition = SmallDecomposition {
            singular_values: full.singular_values,
            u: identity,
            v: full.v,
            rows: size,
            columns: parameters,
        };
        let threshold = rank_threshold.max(rounding_threshold(rows, parameters));
        Ok(Self { parameters, compressed, residual: projected, decomposition, threshold })
    }

    /// Half the gradient of the cost with respect to z, length p.
    pub fn cost_gradient(&self) -> Vec<f64> {
        (0..self.parameters).map(|j| dot(self.column(j), &self.residual)).collect()
    }

    /// Minimises the model over `lower <= z <= upper` inside (about) the trust region `|z| <= radius`.
    ///
    /// Active set by successive fixing: the component that meets its bound first is fixed there and the others are
    /// solved again, until none leaves its bounds. `pinned` components stay at zero.
    pub fn step(
        &self,
        radius: f64,
        lower: &[f64],
        upper: &[f64],
        pinned: &[bool],
    ) -> Result<ModelStep, DecompositionError> {
        let mut z = vec![0.0; self.parameters];
        let mut fixed = pinned.to_vec();
        let mut undamped = true;
        loop {
            let free: Vec<usize> = (0..self.parameters).filter(|&j| !fixed[j]).collect();
            if free.is_empty() {
                break;
            }
            let (values, is_undamped) = self.solve_free(&z, &fixed, &free, radius)?;
            undamped = is_undamped;
            let mut first: Option<(usize, f64)> = None;
            for (&j, &value) in free.iter().zip(&values) {
                let limit = if value < 0.0 { lower[j] } else { upper[j] };
                if value.abs() > limit.abs() {
                    let share = limit.abs() / value.abs();
                    if first.is_none_or(|(_, smallest)| share < smallest) {
                        first = Some((j, share));
                    }
                }
                z[j] = value;
            }
            let Some((j, _)) = first else { break };
            z[j] = if z[j] < 0.0 { lower[j] } else { upper[j] };
            fixed[j] = true;
        }
        let step = self.assess(z, undamped);
        if step.predicted_reduction > 0.0 {
            return Ok(step);
        }
        Ok(self.steepest_descent(radius, lower, upper, pinned))
    }

    /// Step of the free components in the trust region, the fixed ones held at their `z`.
    fn solve_free(
        &self,
        z: &[f64],
        fixed: &[bool],
        free: &[usize],
        radius: f64,
    ) -> Result<(Vec<f64>, bool), DecompositionError> {
        let size = self.residual.len();
        let mut right_side = self.residual.clone();
        let mut fixed_norm_squared = 0.0;
        for j in (0..self.parameters).filter(|&j| fixed[j] && z[j] != 0.0) {
            fixed_norm_squared += z[j] * z[j];
            right_side.iter_mut().zip(self.column(j)).for_each(|(value, entry)| *value += entry * z[j]);
        }
        let remaining = (radius * radius - fixed_norm_squared).max(0.01 * radius * radius).sqrt();
        if free.len() == self.parameters {
            return Ok(self.decomposition.solve_within(&right_side, remaining, self.threshold));
        }
        let columns: Vec<f64> = free.iter().flat_map(|&j| self.column(j).iter().copied()).collect();
        let reduced = SingularValueDecomposition::new(size, free.len(), &columns)?;
        let reduced = SmallDecomposition {
            singular_values: reduced.singular_values,
            u: reduced.u,
            v: reduced.v,
            rows: size,
            columns: free.len(),
        };
        Ok(reduced.solve_within(&right_side, remaining, self.threshold))
    }

    /// The minimiser along the negative gradient inside bounds and trust region.
    fn steepest_descent(&self, radius: f64, lower: &[f64], upper: &[f64], pinned: &[bool]) -> ModelStep {
        let mut direction: Vec<f64> = self.cost_gradient().iter().map(|value| -value).collect();
        for j in 0..self.parameters {
            let blocked = (direction[j] < 0.0 && lower[j] >= 0.0) || (direction[j] > 0.0 && upper[j] <= 0.0);
            if pinned[j] || blocked {
                direction[j] = 0.0;
            }
        }
        let length = norm(&direction);
        if length == 0.0 {
            return self.assess(direction, true);
        }
        let change = self.apply(&direction);
        let curvature = dot(&change, &change);
        let mut share = radius / length;
        if curvature > 0.0 {
            share = share.min(length * length / curvature);
        }
        for j in 0..self.parameters {
            let limit = if direction[j] < 0.0 { lower[j] } else { upper[j] };
            if direction[j] != 0.0 {
                share = share.min(limit / direction[j]);
            }
        }
        direction.iter_mut().for_each(|value| *value *= share);
        self.assess(direction, false)
    }

    fn assess(&self, z: Vec<f64>, undamped: bool) -> ModelStep {
        let change = self.apply(&z);
        let slope = dot(&self.residual, &change);
        // Written out instead of |r|^2 - |r + Jz|^2, which cancels near the minimum.
        let predicted_reduction = -(2.0 * slope + dot(&change, &change));
        ModelStep { z, predicted_reduction, slope, undamped }
    }

    fn apply(&self, z: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.residual.len()];
        for (j, &value) in z.iter().enumerate() {
            product.iter_mut().zip(self.column(j)).for_each(|(sum, entry)| *sum += entry * value);
        }
        product
    }

    fn column(&self, j: usize) -> &[f64] {
        let size = self.residual.len();
        &self.compressed[j * size..(j + 1) * size]
    }
}

impl SmallDecomposition {
    /// Minimiser of `|right_side + A z|` with `|z| <= radius` (within 1 %), and whether the radius did not matter.
    fn solve_within(&self, right_side: &[f64], radius: f64, threshold: f64) -> (Vec<f64>, bool) {
        let floor = threshold * self.singular_values.first().copied().unwrap_or(0.0);
        let projected: Vec<f64> = (0..self.singular_values.len())
            .map(|k| dot(&self.u[k * self.rows..(k + 1) * self.rows], right_side))
            .collect();
        let active: Vec<(usize, f64, f64)> = self
            .singular_values
            .iter()
            .zip(&projected)
            .enumerate()
            .filter(|(_, (sigma, _))| **sigma > floor)
            .map(|(k, (&sigma, &weight))| (k, sigma, weight))
            .collect();
        let length = |damping: f64| {
            active
                .iter()
                .map(|&(_, sigma, weight)| (sigma * weight / (sigma * sigma + damping)).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        let undamped = length(0.0) <= radius;
        let damping = if undamped { 0.0 } else { damping_for_length(&active, radius) };
        let mut z = vec![0.0; self.columns];
        for &(k, sigma, weight) in &active {
            let coefficient = -sigma * weight / (sigma * sigma + damping);
            let direction = &self.v[k * self.columns..(k + 1) * self.columns];
            z.iter_mut().zip(direction).for_each(|(sum, entry)| *sum += coefficient * entry);
        }
        (z, undamped)
    }
}

/// The damping with which the step has the length `radius`: Newton's method on 1/|z| - 1/radius, safeguarded
/// (Hebden-1973, More-1978).
fn damping_for_length(active: &[(usize, f64, f64)], radius: f64) -> f64 {
    let mut low = 0.0_f64;
    let mut high = active.iter().map(|&(_, sigma, weight)| (sigma * weight).powi(2)).sum::<f64>().sqrt() / radius;
    let mut damping = 0.0_f64;
    const ITERATIONS: usize = 60;
    const RELATIVE_ACCURACY: f64 = 0.01;
    for _ in 0..ITERATIONS {
        let mut squared = 0.0;
        let mut derivative = 0.0;
        for &(_, sigma, weight) in active {
            let denominator = sigma * sigma + damping;
            let coefficient = sigma * weight / denominator;
            squared += coefficient * coefficient;
            derivative += coefficient * coefficient / denominator;
        }
        let length = squared.sqrt();
        if (length - radius).abs() <= RELATIVE_ACCURACY * radius {
            break;
        }
        if length > radius {
            low = low.max(damping);
        } else {
            high = high.min(damping);
        }
        let newton = damping + (length / radius - 1.0) * squared / derivative;
        damping = if newton > low && newton < high { newton } else { (low * high).sqrt().max(1e-3 * high) };
    }
    damping
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
