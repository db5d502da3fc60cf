//! Newton's method for the implicit equations of one step, with a matrix kept as long as it serves.

use super::augmented::Augmented;
use super::norm::ErrorNorm;
use super::problem::{Dynamics, FailureCause};
use super::stepper::first_not_finite;
use crate::linear::Factorisation;

const MAXIMUM_ITERATIONS: usize = 4;
/// Remaining error of the iteration, in the error norm, at which it stops (Hindmarsh-2005).
const TOLERANCE: f64 = 0.33;
/// A first correction this small needs no second one to know the rate of convergence.
const NEGLIGIBLE: f64 = 1e-4 * TOLERANCE;
/// Slower convergence than this is given up.
const SLOWEST_RATE: f64 = 0.9;
/// Assumed value of rate / (1 - rate) with a new matrix.
const CAUTIOUS_RATE: f64 = 20.0;
/// The matrix is renewed when its leading coefficient and the present one differ by more than this factor.
const LARGEST_RATIO: f64 = 1.0 / 0.6;
/// Iterations when the equations are to be solved to rounding.
const POLISH_ITERATIONS: usize = 12;
/// Correction, in the error norm, that counts as rounding.
const POLISHED: f64 = 1e-9;

#[derive(Clone, Copy, Debug)]
pub(super) struct NewtonFailure {
    pub cause: FailureCause,
    pub component: Option<usize>,
}

pub(super) struct Newton {
    factorisation: Factorisation,
    /// Leading coefficient the factors were made for.
    leading: Option<f64>,
    rate_factor: f64,
    delta: Vec<f64>,
}

impl Newton {
    pub fn new<D: Dynamics + ?Sized>(system: &Augmented<D>) -> Self {
        Self {
            factorisation: Factorisation::new(system.dynamics.pattern()),
            leading: None,
            rate_factor: CAUTIOUS_RATE,
            delta: vec![0.0; system.n],
        }
    }

    /// Drops the matrix.
    pub fn forget(&mut self) {
        self.leading = None;
    }

    fn serves(&self, c: f64) -> bool {
        self.leading.is_some_and(|leading| {
            let ratio = c / leading;
            ratio <= LARGEST_RATIO && ratio >= 1.0 / LARGEST_RATIO
        })
    }

    fn renew<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        t: f64,
        y: &[f64],
        y_prime: &[f64],
        c: f64,
    ) -> Result<(), NewtonFailure> {
        system.linearise(t, y, y_prime, c);
        system.work.factorisations += 1;
        self.leading = None;
        self.factorisation.factor(&system.jacobian).map_err(|singular| match first_not_finite(&system.jacobian) {
            Some(entry) => {
                NewtonFailure { cause: FailureCause::NotFinite, component: Some(system.jacobian_rows[entry]) }
            }
            None => NewtonFailure { cause: FailureCause::SingularMatrix, component: Some(singular.column) },
        })?;
        self.leading = Some(c);
        self.rate_factor = CAUTIOUS_RATE;
        Ok(())
    }

    /// Solves from the prediction in `y`, `y_prime` and leaves the solution there; `correction` (zero on entry)
    /// collects the difference.
    pub fn solve<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        norm: &ErrorNorm,
        t: f64,
        c: f64,
        y: &mut [f64],
        y_prime: &mut [f64],
        correction: &mut [f64],
    ) -> Result<(), NewtonFailure> {
        let mut new = !self.serves(c);
        loop {
            if new {
                self.renew(system, t, y, y_prime, c)?;
            }
            let result = self.iterate(system, norm, t, c, y, y_prime, correction);
            match result {
                Err(_) if !new => {
                    new = true;
                    for ((y, y_prime), e) in y.iter_mut().zip(y_prime.iter_mut()).zip(correction.iter_mut()) {
                        *y -= *e;
                        *y_prime -= c * *e;
                        *e = 0.0;
                    }
                    // A huge excursion does not come back exactly; NaN does not come back at all.
                    if first_not_finite(y).is_some() {
                        self.forget();
                        return result;
                    }
                }
                other => return other,
            }
        }
    }

    fn iterate<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        norm: &ErrorNorm,
        t: f64,
        c: f64,
        y: &mut [f64],
        y_prime: &mut [f64],
        correction: &mut [f64],
    ) -> Result<(), NewtonFailure> {
        let mut first = 0.0;
        for iteration in 0..MAXIMUM_ITERATIONS {
            self.find_delta(system, t, y, y_prime, c)?;
            let size = norm.of_correction(&self.delta);
            self.apply(c, y, y_prime, correction);
            if iteration == 0 {
                first = size;
                if size <= NEGLIGIBLE {
                    return Ok(());
                }
            } else {
                let rate = (size / first).powf(1.0 / iteration as f64);
                if !(rate <= SLOWEST_RATE) {
                    break;
                }
                self.rate_factor = rate / (1.0 - rate);
            }
            if self.rate_factor * size <= TOLERANCE {
                return Ok(());
            }
        }
        Err(NewtonFailure { cause: FailureCause::NoConvergence, component: self.largest_delta(norm) })
    }

    /// `delta = -J^-1 F`, corrected for a matrix made with another leading coefficient.
    fn find_delta<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        t: f64,
        y: &[f64],
        y_prime: &[f64],
        c: f64,
    ) -> Result<(), NewtonFailure> {
        system.work.newton_iterations += 1;
        system.residual(t, y, y_prime, &mut self.delta);
        if let Some(component) = first_not_finite(&self.delta) {
            return Err(NewtonFailure { cause: FailureCause::NotFinite, component: Some(component) });
        }
        self.factorisation.solve(&mut self.delta);
        let ratio = self.leading.map_or(1.0, |leading| c / leading);
        let factor = -2.0 / (1.0 + ratio);
        self.delta.iter_mut().for_each(|d| *d *= factor);
        Ok(())
    }

    fn apply(&self, c: f64, y: &mut [f64], y_prime: &mut [f64], correction: &mut [f64]) {
        for (((y, y_prime), e), d) in y.iter_mut().zip(y_prime).zip(correction).zip(&self.delta) {
            *y += d;
            *y_prime += c * d;
            *e += d;
        }
    }

    fn largest_delta(&self, norm: &ErrorNorm) -> Option<usize> {
        let scaled = |i: usize| (self.delta[i] * norm.state_weights()[i]).abs();
        (0..self.delta.len()).max_by(|&a, &b| scaled(a).total_cmp(&scaled(b)))
    }

    /// Renews the matrix at a solved step and applies one further correction with it, which leaves an error of the
    /// square of the tolerance: the point at which sensitivities are exact.
    pub fn renew_and_correct<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        t: f64,
        c: f64,
        y: &mut [f64],
        y_prime: &mut [f64],
        correction: &mut [f64],
    ) -> Result<(), NewtonFailure> {
        self.renew(system, t, y, y_prime, c)?;
        self.find_delta(system, t, y, y_prime, c)?;
        self.apply(c, y, y_prime, correction);
        Ok(())
    }

    /// Solves to rounding with a new matrix in every iteration.
    pub fn polish<D: Dynamics + ?Sized>(
        &mut self,
        system: &mut Augmented<D>,
        norm: &ErrorNorm,
        t: f64,
        c: f64,
        y: &mut [f64],
        y_prime: &mut [f64],
        correction: &mut [f64],
    ) -> Result<(), NewtonFailure> {
        let mut last = f64::INFINITY;
        for _ in 0..POLISH_ITERATIONS {
            self.renew_and_correct(system, t, c, y, y_prime, correction)?;
            let size = norm.of_correction(&self.delta);
            // Where rounding ends the descent before the bound, it has been reached all the same.
            if size <= POLISHED || (size <= 1e-3 && size >= 0.5 * last) {
                return Ok(());
            }
            last = size;
        }
        Err(NewtonFailure { cause: FailureCause::NoConvergence, component: self.largest_delta(norm) })
    }

    pub fn solve_block(&mut self, right_hand_sides: &mut [f64], width: usize) {
        self.factorisation.solve_block(right_hand_sides, width);
    }
}
