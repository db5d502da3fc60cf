//! Derivatives of the differential components and values of the algebraic ones that satisfy the equations.

use super::augmented::Augmented;
use super::problem::Dynamics;
use super::stepper::first_not_finite;
use crate::linear::Factorisation;

const MAXIMUM_ITERATIONS: usize = 12;
/// Converged when corrections are this small against the largest value of their component on the way.
const TOLERANCE: f64 = 1e-10;

/// Outcome of [`make_consistent`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Consistency {
    Reached,
    /// The equations do not determine all derivatives and algebraic values (index above 1): nothing was changed.
    Undetermined,
    NotFinite(usize),
}

/// Solves `F(t, y, y') = 0` for the derivatives of the differential and the values of the algebraic components, then the
/// linear equations that their sensitivities satisfy. Differential values and their sensitivities stay.
pub(super) fn make_consistent<D: Dynamics + ?Sized>(
    system: &mut Augmented<D>,
    t: f64,
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
    let differential = system.dynamics.differential().to_vec();
    let (mut new_z, mut new_z_prime) = (z.to_vec(), z_prime.to_vec());
    let mut factorisation = Factorisation::new(system.dynamics.pattern());
    match solve_state(system, &mut factorisation, &differential, t, &mut new_z[..n], &mut new_z_prime[..n]) {
        Consistency::Reached => {}
        other => return other,
    }
    if p > 0 {
        solve_sensitivities(system, &mut factorisation, &differential, t, &mut new_z, &mut new_z_prime);
        if first_not_finite(&new_z).or(first_not_finite(&new_z_prime)).is_some() {
            return Consistency::Undetermined;
        }
    }
    z.copy_from_slice(&new_z);
    z_prime.copy_from_slice(&new_z_prime);
    Consistency::Reached
}

/// Matrix of the derivatives with respect to y' of differential and y of algebraic components; also returns dF/dy.
fn matrix<D: Dynamics + ?Sized>(
    system: &mut Augmented<D>,
    differential: &[bool],
    t: f64,
    y: &[f64],
    y_prime: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    system.linearise(t, y, y_prime, 0.0);
    let by_y = system.jacobian.clone();
    // Large against dF/dy, so that the difference keeps its digits.
    let c = by_y.iter().fold(1.0f64, |a, v| a.max(v.abs()));
    system.linearise(t, y, y_prime, c);
    let values = system
        .jacobian_columns
        .iter()
        .zip(system.jacobian.iter().zip(&by_y))
        .map(|(&column, (both, by_y))| if differential[column] { (both - by_y) / c } else { *by_y })
        .collect();
    (values, by_y)
}

fn solve_state<D: Dynamics + ?Sized>(
    system: &mut Augmented<D>,
    factorisation: &mut Factorisation,
    differential: &[bool],
    t: f64,
    y: &mut [f64],
    y_prime: &mut [f64],
) -> Consistency {
    let mut residual = vec![0.0; system.n];
    let mut largest = vec![0.0f64; system.n];
    for _ in 0..MAXIMUM_ITERATIONS {
        system.residual(t, y, y_prime, &mut residual);
        if let Some(component) = first_not_finite(&residual) {
            return Consistency::NotFinite(component);
        }
        let (values, _) = matrix(system, differential, t, y, y_prime);
        if factorisation.factor(&values).is_err() {
            return Consistency::Undetermined;
        }
        factorisation.solve(&mut residual);
        let mut converged = true;
        for i in 0..system.n {
            let unknown = if differential[i] { &mut y_prime[i] } else { &mut y[i] };
            largest[i] = largest[i].max(unknown.abs());
            *unknown -= residual[i];
            largest[i] = largest[i].max(unknown.abs());
            converged &= residual[i].abs() <= TOLERANCE * largest[i];
        }
        if converged {
            return Consistency::Reached;
        }
    }
    Consistency::Undetermined
}

fn solve_sensitivities<D: Dynamics + ?Sized>(
    system: &mut Augmented<D>,
    factorisation: &mut Factorisation,
    differential: &[bool],
    t: f64,
    z: &mut [f64],
    z_prime: &mut [f64],
) {
    let (n, p) = (system.n, system.p);
    let (y, s) = z.split_at_mut(n);
    let (y_prime, s_prime) = z_prime.split_at_mut(n);
    let (values, by_y) = matrix(system, differential, t, y, y_prime);
    if factorisation.factor(&values).is_err() {
        s_prime.fill(f64::NAN);
        return;
    }
    let mut right = vec![0.0; n * p];
    system.parameter_right_hand_side(t, y, y_prime, &mut right);
    for (k, &value) in by_y.iter().enumerate() {
        let (row, column) = (system.jacobian_rows[k], system.jacobian_columns[k]);
        if differential[column] {
            for j in 0..p {
                right[row * p + j] -= value * s[column * p + j];
            }
        }
    }
    factorisation.solve_block(&mut right, p);
    for i in 0..n {
        let target = if differential[i] { &mut *s_prime } else { &mut *s };
        target[i * p..(i + 1) * p].copy_from_slice(&right[i * p..(i + 1) * p]);
    }
}
