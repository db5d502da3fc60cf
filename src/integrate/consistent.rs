//! Derivatives of the differential components and values of the algebraic ones that satisfy the equations.
//!
//! Constraints on the differential components hold already; in their place stand their derivatives with respect to
//! time, which determine the multipliers (Brenan-Campbell-Petzold-1996, 5.3).

use super::augmented::Augmented;
use super::stepper::first_not_finite;
use crate::linear::Factorisation;

const MAXIMUM_ITERATIONS: usize = 12;
/// Converged when corrections, in typical magnitudes, are this small against the largest value among the derivatives or
/// among the algebraic values; Newton's method being quadratic, what remains is rounding.
const TOLERANCE: f64 = 1e-10;
/// Differences along the solution move the fastest component by this share of its typical magnitude.
const DISTANCE: f64 = 1e-3;
/// Forward differences of third order, central ones of fourth: distances and weights.
const FORWARD: [(f64, f64); 4] = [(0.0, -11.0 / 6.0), (1.0, 3.0), (2.0, -1.5), (3.0, 1.0 / 3.0)];
pub(super) const CENTRAL: [(f64, f64); 4] =
    [(-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)];

/// Outcome of [`make_consistent`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Consistency {
    Reached,
    /// The equations do not determine all derivatives and algebraic values: nothing was changed.
    Undetermined,
    NotFinite(usize),
}

/// The point at which values are sought.
struct Point {
    t: f64,
    /// Distance of differences in time.
    time_step: f64,
    differential: Vec<bool>,
}

/// The equations linearised: matrix for derivatives of differential and values of algebraic components, and dF/dy.
struct Equations {
    matrix: Vec<f64>,
    by_y: Vec<f64>,
}

/// Solves `F(t, y, y') = 0` for the derivatives of the differential and the values of the algebraic components, then
/// the linear equations that their sensitivities satisfy. Differential values and their sensitivities stay; they must
/// satisfy the constraints. Explicit dependence of constraints on time is differenced over `time_step` from `t` on.
pub(super) fn make_consistent(
    system: &mut Augmented,
    t: f64,
    time_step: f64,
    z: &mut [f64],
    z_prime: &mut [f64],
) -> Consistency {
    if system.explicit {
        system.rates(t, z, z_prime);
        return first_not_finite(z_prime).map_or(Consistency::Reached, |place| {
            Consistency::NotFinite(if place < system.n { place } else { (place - system.n) / system.p.max(1) })
        });
    }
    let (n, p) = (system.n, system.p);
    let point = Point { t, time_step, differential: system.dynamics.differential().to_vec() };
    let (mut new_z, mut new_z_prime) = (z.to_vec(), z_prime.to_vec());
    let mut factorisation = Factorisation::new(system.dynamics.pattern());
    match point.solve_state(system, &mut factorisation, &mut new_z[..n], &mut new_z_prime[..n]) {
        Consistency::Reached => {}
        other => return other,
    }
    if p > 0 {
        point.solve_sensitivities(system, &mut factorisation, &mut new_z, &mut new_z_prime);
        if first_not_finite(&new_z).or(first_not_finite(&new_z_prime)).is_some() {
            return Consistency::Undetermined;
        }
    }
    z.copy_from_slice(&new_z);
    z_prime.copy_from_slice(&new_z_prime);
    Consistency::Reached
}

impl Point {
    fn equations(&self, system: &mut Augmented, y: &[f64], y_prime: &[f64]) -> Equations {
        system.linearise(self.t, y, y_prime, 0.0);
        let by_y = system.jacobian.clone();
        // Large against dF/dy, so that the difference keeps its digits.
        let c = by_y.iter().fold(1.0f64, |a, v| a.max(v.abs()));
        system.linearise(self.t, y, y_prime, c);
        let entry = |k: usize| {
            let (row, column) = (system.jacobian_rows[k], system.jacobian_columns[k]);
            match (system.structure.is_constraint[row], self.differential[column]) {
                (true, true) | (false, false) => by_y[k],
                (true, false) => 0.0,
                (false, true) => (system.jacobian[k] - by_y[k]) / c,
            }
        };
        let matrix = (0..by_y.len()).map(entry).collect();
        Equations { matrix, by_y }
    }

    fn solve_state(
        &self,
        system: &mut Augmented,
        factorisation: &mut Factorisation,
        y: &mut [f64],
        y_prime: &mut [f64],
    ) -> Consistency {
        let mut residual = vec![0.0; system.n];
        let drift = self.drift(system, y, y_prime);
        for _ in 0..MAXIMUM_ITERATIONS {
            system.residual(self.t, y, y_prime, &mut residual);
            let equations = self.equations(system, y, y_prime);
            replace_constraints(system, &equations.by_y, &drift, y_prime, &mut residual);
            if let Some(component) = first_not_finite(&residual) {
                return Consistency::NotFinite(component);
            }
            if factorisation.factor(&equations.matrix).is_err() {
                return Consistency::Undetermined;
            }
            factorisation.solve(&mut residual);
            let (mut change, mut largest) = ([0.0f64; 2], [0.0f64; 2]);
            for i in 0..system.n {
                let kind = usize::from(self.differential[i]);
                let unknown = if self.differential[i] { &mut y_prime[i] } else { &mut y[i] };
                *unknown -= residual[i];
                let scale = system.dynamics.scale()[i];
                change[kind] = change[kind].max(residual[i].abs() / scale);
                largest[kind] = largest[kind].max(unknown.abs() / scale);
            }
            if change.iter().zip(&largest).all(|(change, largest)| *change <= TOLERANCE * largest) {
                return Consistency::Reached;
            }
        }
        Consistency::Undetermined
    }

    /// Partial derivative of the constraints with respect to time, length n.
    fn drift(&self, system: &mut Augmented, y: &[f64], y_prime: &[f64]) -> Vec<f64> {
        let mut drift = vec![0.0; system.n];
        if !system.structure.has_constraints() {
            return drift;
        }
        let mut residual = vec![0.0; system.n];
        for (distance, weight) in FORWARD {
            system.residual(self.t + distance * self.time_step, y, y_prime, &mut residual);
            drift.iter_mut().zip(&residual).for_each(|(d, r)| *d += weight / self.time_step * r);
        }
        drift
    }

    fn solve_sensitivities(
        &self,
        system: &mut Augmented,
        factorisation: &mut Factorisation,
        z: &mut [f64],
        z_prime: &mut [f64],
    ) {
        let (n, p) = (system.n, system.p);
        let (y, s) = z.split_at_mut(n);
        let (y_prime, s_prime) = z_prime.split_at_mut(n);
        for i in (0..n).filter(|&i| !self.differential[i]) {
            s[i * p..(i + 1) * p].fill(0.0);
        }
        let mut right = vec![0.0; n * p];
        system.held_derivative_right_hand_side(self.t, y, y_prime, s, &mut right);
        self.replace_constraint_sensitivities(system, y, y_prime, s, &mut right);
        let equations = self.equations(system, y, y_prime);
        if factorisation.factor(&equations.matrix).is_err() {
            s_prime.fill(f64::NAN);
            return;
        }
        factorisation.solve_block(&mut right, p);
        for i in 0..n {
            let target = if self.differential[i] { &mut *s_prime } else { &mut *s };
            target[i * p..(i + 1) * p].copy_from_slice(&right[i * p..(i + 1) * p]);
        }
    }

    /// In the rows of constraints `-(c_x S + c_theta)` gives way to its derivative along the solution, S held.
    fn replace_constraint_sensitivities(
        &self,
        system: &mut Augmented,
        y: &[f64],
        y_prime: &[f64],
        s: &[f64],
        right: &mut [f64],
    ) {
        if !system.structure.has_constraints() {
            return;
        }
        let p = system.p;
        let mut slope = vec![0.0; right.len()];
        let mut term = vec![0.0; right.len()];
        let mut add = |system: &mut Augmented, t: f64, y: &[f64], weight: f64| {
            system.held_derivative_right_hand_side(t, y, y_prime, s, &mut term);
            slope.iter_mut().zip(&term).for_each(|(sum, value)| *sum += weight * value);
        };
        for (distance, weight) in FORWARD {
            add(system, self.t + distance * self.time_step, y, weight / self.time_step);
        }
        let speeds = y_prime.iter().zip(system.dynamics.scale()).zip(&self.differential);
        let fastest = speeds.filter(|(_, d)| **d).fold(0.0f64, |a, ((v, scale), _)| a.max((v / scale).abs()));
        if fastest > 0.0 {
            let step = DISTANCE / fastest;
            for (distance, weight) in CENTRAL {
                let moved = |i: usize| if self.differential[i] { y[i] + distance * step * y_prime[i] } else { y[i] };
                let moved: Vec<f64> = (0..y.len()).map(moved).collect();
                add(system, self.t, &moved, weight / step);
            }
        }
        for &row in &system.structure.constraints {
            right[row * p..(row + 1) * p].copy_from_slice(&slope[row * p..(row + 1) * p]);
        }
    }
}

/// Puts `c_t + c_x x'` in the rows of constraints.
fn replace_constraints(system: &Augmented, by_y: &[f64], drift: &[f64], y_prime: &[f64], residual: &mut [f64]) {
    for &row in &system.structure.constraints {
        residual[row] = drift[row];
    }
    for ((value, &row), &column) in by_y.iter().zip(&system.jacobian_rows).zip(&system.jacobian_columns) {
        if system.structure.is_constraint[row] {
            residual[row] += value * y_prime[column];
        }
    }
}
