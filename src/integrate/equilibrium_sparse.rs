//! Equilibrium of large systems by Newton's method with a sparse factorisation. Whatever is not plain sailing is left
//! to the search by singular values, which costs the cube of the dimension and can say what is wrong.

use super::problem::{Dynamics, Work};
use super::stepper::first_not_finite;
use crate::linear::Factorisation;

/// Below this dimension the search by singular values costs nothing to speak of.
const LARGE: usize = 40;
const MAXIMUM_ITERATIONS: usize = 30;
/// Growth of a solution against its right-hand side that suggests an undetermined direction.
const SUSPICIOUS: f64 = 1e10;

/// Scaled residuals that count as zero, and as rounding.
pub(super) struct Accuracy {
    pub converged: f64,
    pub rounding: f64,
}

/// State (length n) and its sensitivity (n x p column-major) where all components are unknown and Newton's method runs
/// straight to a regular solution.
pub(super) fn solve(
    dynamics: &mut dyn Dynamics,
    t: f64,
    y: &[f64],
    accuracy: &Accuracy,
    work: &mut Work,
) -> Option<(Vec<f64>, Vec<f64>)> {
    if y.len() < LARGE {
        return None;
    }
    let mut newton = Newton::new(dynamics, t, y);
    let outcome = newton.run(accuracy);
    let sensitivity = outcome.and_then(|()| newton.sensitivity());
    work.residuals += newton.work.residuals;
    work.jacobians += newton.work.jacobians;
    work.factorisations += newton.work.factorisations;
    sensitivity.map(|sensitivity| (newton.y, sensitivity))
}

struct Newton<'d> {
    dynamics: &'d mut dyn Dynamics,
    t: f64,
    y: Vec<f64>,
    zero: Vec<f64>,
    scale: Vec<f64>,
    factorisation: Factorisation,
    places: Vec<(usize, usize)>,
    /// Entries of dF/dy in typical magnitudes, rows with largest entry one.
    values: Vec<f64>,
    row_factor: Vec<f64>,
    work: Work,
}

impl<'d> Newton<'d> {
    fn new(dynamics: &'d mut dyn Dynamics, t: f64, y: &[f64]) -> Self {
        let n = y.len();
        let places: Vec<(usize, usize)> = dynamics.pattern().entries().collect();
        Self {
            t,
            y: y.to_vec(),
            zero: vec![0.0; n],
            scale: dynamics.scale().to_vec(),
            factorisation: Factorisation::new(dynamics.pattern()),
            values: vec![0.0; places.len()],
            places,
            row_factor: vec![1.0; n],
            work: Work::default(),
            dynamics,
        }
    }

    fn residual(&mut self, y: &[f64]) -> Vec<f64> {
        let mut residual = vec![0.0; y.len()];
        self.work.residuals += 1;
        self.dynamics.residual(self.t, y, &self.zero, &mut residual);
        residual
    }

    fn size(&self, residual: &[f64]) -> f64 {
        residual.iter().zip(&self.row_factor).map(|(r, f)| (r * f) * (r * f)).sum::<f64>().sqrt()
    }

    /// Linearises at the present point.
    fn factor(&mut self) -> Option<()> {
        self.work.jacobians += 1;
        self.work.factorisations += 1;
        self.dynamics.jacobian(self.t, &self.y, &self.zero, 0.0, &mut self.values);
        if first_not_finite(&self.values).is_some() {
            return None;
        }
        let mut largest = vec![0.0f64; self.y.len()];
        for (value, &(row, column)) in self.values.iter_mut().zip(&self.places) {
            *value *= self.scale[column];
            largest[row] = largest[row].max(value.abs());
        }
        self.row_factor.iter_mut().zip(&largest).for_each(|(f, l)| *f = if *l > 0.0 { 1.0 / l } else { 1.0 });
        self.values.iter_mut().zip(&self.places).for_each(|(value, &(row, _))| *value *= self.row_factor[row]);
        self.factorisation.factor(&self.values).ok()
    }

    fn run(&mut self, accuracy: &Accuracy) -> Option<()> {
        let mut residual = self.residual(&self.y.clone());
        for _ in 0..MAXIMUM_ITERATIONS {
            self.factor()?;
            let size = self.size(&residual);
            if size <= accuracy.rounding {
                return self.require_regular();
            }
            let mut step: Vec<f64> = residual.iter().zip(&self.row_factor).map(|(r, f)| r * f).collect();
            self.factorisation.solve(&mut step);
            let moved: Vec<f64> = (0..step.len()).map(|i| self.y[i] - self.scale[i] * step[i]).collect();
            let new = self.residual(&moved);
            let improved = self.size(&new) < size;
            match (improved, size <= accuracy.converged) {
                (true, _) => {
                    self.y = moved;
                    residual = new;
                }
                (false, true) => return self.require_regular(),
                (false, false) => return None,
            }
        }
        None
    }

    /// A right-hand side without regularity of its own shows nearly undetermined directions.
    fn require_regular(&mut self) -> Option<()> {
        let mut test: Vec<f64> = (0..self.y.len()).map(|i| ((i * i + 3 * i) as f64).sin()).collect();
        self.factorisation.solve(&mut test);
        test.iter().all(|v| v.abs() < SUSPICIOUS).then_some(())
    }

    /// `dF/dy S = -dF/dtheta`.
    fn sensitivity(&mut self) -> Option<Vec<f64>> {
        let (n, p) = (self.y.len(), self.dynamics.parameter_count());
        let mut by_parameter = vec![0.0; n * p];
        self.dynamics.parameter_derivative(self.t, &self.y, &self.zero, &mut by_parameter);
        if p == 0 {
            return Some(by_parameter);
        }
        self.factor()?;
        let mut block: Vec<f64> = (0..n)
            .flat_map(|i| (0..p).map(move |j| (i, j)))
            .map(|(i, j)| -by_parameter[j * n + i] * self.row_factor[i])
            .collect();
        self.factorisation.solve_block(&mut block, p);
        let sensitivity: Vec<f64> =
            (0..p).flat_map(|j| (0..n).map(move |i| (i, j))).map(|(i, j)| self.scale[i] * block[i * p + j]).collect();
        first_not_finite(&sensitivity).is_none().then_some(sensitivity)
    }
}
