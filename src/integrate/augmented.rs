//! The system together with its sensitivity equations, in the layout the inner loops want.

use super::problem::{Dynamics, Work};
use super::structure::Structure;
use crate::linear::RowOrder;

/// Parts of the run in which blame is counted.
const PARTS: usize = 200;

/// Wraps [`Dynamics`] for a vector `z` of length n (1 + p): first y, then the sensitivities row by row (component i,
/// then parameter j), so that operations on a row run over all parameters without a gap.
pub(super) struct Augmented<'d> {
    pub dynamics: &'d mut dyn Dynamics,
    pub n: usize,
    /// Number of sensitivity columns carried; 0 in a nominal run.
    pub p: usize,
    pub work: Work,
    pub explicit: bool,
    pub structure: Structure,
    /// Right-hand sides are never evaluated beyond this time, so that a step that ends at a discontinuity of the input
    /// sees its left limit.
    pub last_time: f64,
    pub jacobian: Vec<f64>,
    pub jacobian_rows: Vec<usize>,
    pub jacobian_columns: Vec<usize>,
    order: RowOrder,
    mass: Vec<f64>,
    parameter: Vec<f64>,
    parameter_places: Vec<usize>,
}

impl<'d> Augmented<'d> {
    pub fn new(dynamics: &'d mut dyn Dynamics, with_sensitivities: bool, t: f64, y: &[f64], y_prime: &[f64]) -> Self {
        let n = dynamics.dimension();
        let p = if with_sensitivities { dynamics.parameter_count() } else { 0 };
        let pattern = dynamics.pattern();
        let order = RowOrder::new(pattern);
        let (jacobian_rows, jacobian_columns): (Vec<usize>, Vec<usize>) = pattern.entries().unzip();
        let parameter_places: Vec<usize> = match dynamics.parameter_pattern() {
            Some(pattern) if p > 0 => (0..p)
                .flat_map(|j| pattern.rows[pattern.starts[j]..pattern.starts[j + 1]].iter().map(move |row| row * p + j))
                .collect(),
            _ => (0..p).flat_map(|j| (0..n).map(move |row| row * p + j)).collect(),
        };
        let structure = Structure::new(dynamics, t, y, y_prime);
        let explicit = dynamics.explicit_rates(t, y, &mut vec![0.0; n]);
        let work = Work { limited_by: vec![0; n], limited_when: vec![Vec::new(); n], ..Work::default() };
        Self {
            dynamics,
            n,
            p,
            work,
            explicit,
            structure,
            last_time: f64::INFINITY,
            jacobian: vec![0.0; jacobian_rows.len()],
            order,
            mass: vec![0.0; jacobian_rows.len()],
            jacobian_rows,
            jacobian_columns,
            parameter: vec![0.0; parameter_places.len()],
            parameter_places,
        }
    }

    /// Length of `z`.
    pub fn length(&self) -> usize {
        self.n * (1 + self.p)
    }

    /// `z' = (f, f_y S + f_theta)` of a system with explicit rates.
    pub fn rates(&mut self, t: f64, z: &[f64], rates: &mut [f64]) {
        let (y, s) = z.split_at(self.n);
        let (y_rates, s_rates) = rates.split_at_mut(self.n);
        if self.p == 0 {
            self.rates_of_state(t, y, y_rates);
            return;
        }
        let t = t.min(self.last_time);
        self.work.residuals += 1;
        self.work.jacobians += 1;
        self.dynamics.linearised_rates(t, y, y_rates, &mut self.jacobian, &mut self.parameter);
        s_rates.fill(0.0);
        self.order.subtract_product(&self.jacobian, s, s_rates, self.p);
        self.subtract_parameter_entries(s_rates);
    }

    /// `y' = f` of a system with explicit rates.
    pub fn rates_of_state(&mut self, t: f64, y: &[f64], rates: &mut [f64]) {
        self.work.residuals += 1;
        self.dynamics.explicit_rates(t.min(self.last_time), y, rates);
    }

    pub fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        self.work.residuals += 1;
        self.dynamics.residual(t.min(self.last_time), y, y_prime, residual);
    }

    /// Values of dF/dy + c dF/dy' into `self.jacobian`.
    pub fn linearise(&mut self, t: f64, y: &[f64], y_prime: &[f64], c: f64) {
        self.work.jacobians += 1;
        self.dynamics.jacobian(t.min(self.last_time), y, y_prime, c, &mut self.jacobian);
    }

    /// Values of the expanded matrix ([`Dynamics::expanded_jacobian`]).
    pub fn linearise_expanded(&mut self, t: f64, y: &[f64], c: f64, scale: &[f64], values: &mut [f64]) {
        self.work.jacobians += 1;
        self.dynamics.expanded_jacobian(t.min(self.last_time), y, c, scale, values);
    }

    /// `-(dF/dy' V + dF/dtheta)` into `result` (n x p row by row). Where derivatives have factors of their own,
    /// `self.jacobian` must hold the values at this point for `c`, which must not be zero.
    pub fn sensitivity_right_hand_side(
        &mut self,
        t: f64,
        y: &[f64],
        y_prime: &[f64],
        c: f64,
        v: &[f64],
        result: &mut [f64],
    ) {
        let t = t.min(self.last_time);
        if self.explicit || self.structure.has_unit_mass {
            let rows = result.chunks_exact_mut(self.p).zip(v.chunks_exact(self.p));
            for ((result, v), differential) in rows.zip(self.dynamics.differential()) {
                let sign = if *differential { -1.0 } else { 0.0 };
                result.iter_mut().zip(v).for_each(|(r, v)| *r = sign * v);
            }
        } else {
            self.dynamics.jacobian(t, y, y_prime, 0.0, &mut self.mass);
            for (m, j) in self.mass.iter_mut().zip(&self.jacobian) {
                *m = (j - *m) / c;
            }
            result.fill(0.0);
            self.order.subtract_product(&self.mass, v, result, self.p);
        }
        self.dynamics.parameter_entries(t, y, y_prime, &mut self.parameter);
        self.subtract_parameter_entries(result);
    }

    /// `-dF/dtheta` into `result` (n x p row by row).
    pub fn parameter_right_hand_side(&mut self, t: f64, y: &[f64], y_prime: &[f64], result: &mut [f64]) {
        self.dynamics.parameter_entries(t.min(self.last_time), y, y_prime, &mut self.parameter);
        result.fill(0.0);
        self.subtract_parameter_entries(result);
    }

    /// `-(dF/dy S + dF/dtheta)` into `result` (n x p row by row), derivatives held.
    pub fn held_derivative_right_hand_side(
        &mut self,
        t: f64,
        y: &[f64],
        y_prime: &[f64],
        s: &[f64],
        result: &mut [f64],
    ) {
        self.linearise(t, y, y_prime, 0.0);
        self.parameter_right_hand_side(t, y, y_prime, result);
        self.order.subtract_product(&self.jacobian, s, result, self.p);
    }

    fn subtract_parameter_entries(&self, target: &mut [f64]) {
        for (&place, value) in self.parameter_places.iter().zip(&self.parameter) {
            target[place] -= value;
        }
    }

    /// Notes that `component` had the largest share in the error of the step that begins at `t`.
    pub fn blame(&mut self, component: usize, t: f64) {
        self.work.limited_by[component] += 1;
        let (begin, end) = self.work.span;
        let counts = &mut self.work.limited_when[component];
        counts.resize(PARTS, 0);
        let part = PARTS as f64 * (t - begin) / (end - begin).max(f64::MIN_POSITIVE);
        counts[(part.max(0.0) as usize).min(PARTS - 1)] += 1;
    }
}
