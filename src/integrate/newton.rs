//! Newton's method for the implicit equations of one step, with a matrix kept as long as it serves.

use super::augmented::Augmented;
use super::iteration_matrix::IterationMatrix;
use super::norm::ErrorNorm;
use super::problem::FailureCause;
use super::stepper::first_not_finite;

const MAXIMUM_ITERATIONS: usize = 4;
/// Remaining error of the iteration, in the error norm, at which it stops (Hindmarsh-2005).
const TOLERANCE: f64 = 0.33;
/// A first correction this small needs no second one to know the rate of convergence.
const NEGLIGIBLE: f64 = 1e-4 * TOLERANCE;
/// Slower convergence than this is given up.
const SLOWEST_RATE: f64 = 0.9;
/// Assumed value of rate / (1 - rate) with a new matrix.
const CAUTIOUS_RATE: f64 = 20.0;
/// Assumed value of it when the leading coefficient has changed since the last step: what was learnt of the rate then
/// says nothing about the old matrix now.
const UNKNOWN_RATE: f64 = 100.0;
/// The matrix is renewed when its leading coefficient and the present one differ by more than this factor.
const LARGEST_RATIO: f64 = 1.0 / 0.6;
/// Relative correction below which the matrix counts as that of the solution, and the most renewals to get there.
const SETTLED: f64 = 1e-9;
const SETTLE_RENEWALS: usize = 3;
/// Iterations with the old matrix before, as long as each takes the correction to this share of the one before.
const SETTLE_ITERATIONS: usize = 6;
const SETTLE_RATE: f64 = 0.3;
/// Iterations when the equations are to be solved to rounding.
const POLISH_ITERATIONS: usize = 12;
/// Correction, in the error norm, that counts as rounding.
const POLISHED: f64 = 1e-9;

/// Largest sum of a row of `|f_y| = |c I - J|`, rows and columns in typical magnitudes.
fn bound_of_eigenvalues(system: &Augmented, c: f64) -> f64 {
    let scale = system.dynamics.scale();
    let mut sums = vec![0.0; system.n];
    let places = system.jacobian_rows.iter().zip(&system.jacobian_columns);
    for ((&row, &column), value) in places.zip(&system.jacobian) {
        let entry = if row == column { value - c } else { *value };
        sums[row] += entry.abs() * scale[column] / scale[row];
    }
    sums.into_iter().fold(0.0, f64::max)
}

#[derive(Clone, Copy, Debug)]
pub(super) struct NewtonFailure {
    pub cause: FailureCause,
    pub component: Option<usize>,
}

/// The end of a step while it is being solved.
pub(super) struct StepEnd<'z> {
    pub time: f64,
    /// `dy'/dy` within the step.
    pub leading: f64,
    pub y: &'z mut [f64],
    pub y_prime: &'z mut [f64],
    /// `y` minus its prediction.
    pub correction: &'z mut [f64],
}

impl StepEnd<'_> {
    fn correct(&mut self, delta: &[f64]) {
        let states = self.y.iter_mut().zip(self.y_prime.iter_mut());
        for (((y, y_prime), e), d) in states.zip(self.correction.iter_mut()).zip(delta) {
            *y += d;
            *y_prime += self.leading * d;
            *e += d;
        }
    }

    /// Back to the prediction.
    fn reset(&mut self) {
        let states = self.y.iter_mut().zip(self.y_prime.iter_mut());
        for ((y, y_prime), e) in states.zip(self.correction.iter_mut()) {
            *y -= *e;
            *y_prime -= self.leading * *e;
            *e = 0.0;
        }
    }
}

pub(super) struct Newton {
    matrix: IterationMatrix,
    rate_factor: f64,
    /// Leading coefficient of the last step solved.
    last_leading: f64,
    delta: Vec<f64>,
    /// `c dF/dy'` at the last renewal, for [`Newton::filter`]; empty where there is nothing to filter or the factor of
    /// every derivative is one.
    mass: Vec<f64>,
    has_hidden_algebraic: bool,
    /// For `y' = f`: a bound of the eigenvalues of f_y (row sums in typical magnitudes) at the last renewal; infinite
    /// where it is not known.
    pub eigenvalue_bound: f64,
    filtered: Vec<f64>,
    /// How often the matrix has been renewed.
    pub renewals: usize,
}

impl Newton {
    pub fn new(system: &Augmented) -> Self {
        Self {
            matrix: IterationMatrix::new(system),
            rate_factor: CAUTIOUS_RATE,
            last_leading: 0.0,
            delta: vec![0.0; system.n],
            mass: Vec::new(),
            has_hidden_algebraic: system.structure.has_hidden_algebraic,
            eigenvalue_bound: f64::INFINITY,
            filtered: Vec::new(),
            renewals: 0,
        }
    }

    /// Drops the matrix.
    pub fn forget(&mut self) {
        self.matrix.forget();
    }

    fn serves(&self, c: f64) -> bool {
        self.matrix.leading().is_some_and(|leading| {
            let ratio = c / leading;
            (1.0 / LARGEST_RATIO..=LARGEST_RATIO).contains(&ratio)
        })
    }

    fn renew(&mut self, system: &mut Augmented, end: &StepEnd) -> Result<(), NewtonFailure> {
        self.matrix.renew(system, (end.time, end.y, end.y_prime), end.leading)?;
        self.renewals += 1;
        self.rate_factor = CAUTIOUS_RATE;
        if self.has_hidden_algebraic && !system.structure.has_unit_mass {
            self.renew_mass(system, end);
        }
        if system.explicit && !self.matrix.is_expanded() {
            self.eigenvalue_bound = bound_of_eigenvalues(system, end.leading);
        }
        Ok(())
    }

    fn renew_mass(&mut self, system: &mut Augmented, end: &StepEnd) {
        self.mass.clone_from(&system.jacobian);
        system.linearise(end.time, end.y, end.y_prime, 0.0);
        self.mass.iter_mut().zip(&mut system.jacobian).for_each(|(both, by_y)| {
            let by_derivative = *both - *by_y;
            *by_y = std::mem::replace(both, by_derivative);
        });
    }

    /// Whether the system has constraints with multipliers.
    pub fn has_multipliers(&self) -> bool {
        self.matrix.has_multipliers()
    }

    /// Whether [`Newton::filter`] changes anything.
    pub fn filters(&self) -> bool {
        self.has_hidden_algebraic
    }

    /// Replaces an error by what it does to the solution, `J^-1 c dF/dy' e`, where some combinations of differential
    /// components are in fact algebraic. These are found anew in every step, so that their differences say nothing
    /// about errors; they follow the error of the others (Hairer-Wanner-1996, IV.8).
    pub fn filter(&mut self, system: &Augmented, error: &mut [f64]) {
        if !self.has_hidden_algebraic {
            return;
        }
        let n = system.n;
        let (state, columns) = error.split_at_mut(n);
        for (part, width) in [(state, 1), (columns, system.p)] {
            if width == 0 || part.is_empty() {
                continue;
            }
            if system.structure.has_unit_mass {
                let leading = self.matrix.leading().unwrap_or(0.0);
                for (row, differential) in part.chunks_exact_mut(width).zip(system.dynamics.differential()) {
                    let factor = if *differential { leading } else { 0.0 };
                    row.iter_mut().for_each(|e| *e *= factor);
                }
                self.matrix.solve_block(part, width);
                continue;
            }
            self.filtered.clear();
            self.filtered.resize(n * width, 0.0);
            for ((value, &row), &column) in self.mass.iter().zip(&system.jacobian_rows).zip(&system.jacobian_columns) {
                for j in 0..width {
                    self.filtered[row * width + j] += value * part[column * width + j];
                }
            }
            self.matrix.solve_block(&mut self.filtered, width);
            part.copy_from_slice(&self.filtered);
        }
    }

    /// Solves from the prediction in `end` and leaves the solution there.
    pub fn solve(&mut self, system: &mut Augmented, norm: &ErrorNorm, end: &mut StepEnd) -> Result<(), NewtonFailure> {
        let mut new = !self.serves(end.leading);
        if end.leading != self.last_leading {
            self.rate_factor = UNKNOWN_RATE;
            self.last_leading = end.leading;
        }
        loop {
            if new {
                self.renew(system, end)?;
            }
            let result = self.iterate(system, norm, end);
            match result {
                Err(_) if !new => {
                    new = true;
                    end.reset();
                    // A huge excursion does not come back exactly; NaN does not come back at all.
                    if first_not_finite(end.y).is_some() {
                        self.forget();
                        return result;
                    }
                }
                other => return other,
            }
        }
    }

    fn iterate(&mut self, system: &mut Augmented, norm: &ErrorNorm, end: &mut StepEnd) -> Result<(), NewtonFailure> {
        let (mut first, mut has_converged) = (0.0, false);
        for iteration in 0..MAXIMUM_ITERATIONS {
            self.find_delta(system, end)?;
            let size = norm.of_correction(&self.delta);
            end.correct(&self.delta);
            if iteration == 0 {
                first = size;
                has_converged = size <= NEGLIGIBLE;
            } else if !has_converged {
                let rate = (size / first).powf(1.0 / iteration as f64);
                if rate.is_nan() || rate > SLOWEST_RATE {
                    break;
                }
                self.rate_factor = rate / (1.0 - rate);
            }
            has_converged |= self.rate_factor * size <= TOLERANCE;
            if has_converged && norm.multipliers_rest(&self.delta, end.y) {
                return Ok(());
            }
        }
        if has_converged {
            return Ok(());
        }
        Err(NewtonFailure { cause: FailureCause::NoConvergence, component: self.largest_delta(norm) })
    }

    /// `delta = -J^-1 F`, corrected for a matrix made with another leading coefficient.
    fn find_delta(&mut self, system: &mut Augmented, end: &StepEnd) -> Result<(), NewtonFailure> {
        system.work.newton_iterations += 1;
        system.residual(end.time, end.y, end.y_prime, &mut self.delta);
        if let Some(component) = first_not_finite(&self.delta) {
            return Err(NewtonFailure { cause: FailureCause::NotFinite, component: Some(component) });
        }
        self.matrix.solve_block(&mut self.delta, 1);
        let ratio = self.matrix.leading().map_or(1.0, |leading| end.leading / leading);
        let factor = -2.0 / (1.0 + ratio);
        self.delta.iter_mut().for_each(|d| *d *= factor);
        Ok(())
    }

    fn largest_delta(&self, norm: &ErrorNorm) -> Option<usize> {
        let scaled = |i: usize| (self.delta[i] * norm.state_weights()[i]).abs();
        (0..self.delta.len()).max_by(|&a, &b| scaled(a).total_cmp(&scaled(b)))
    }

    /// Corrects a solved step until nothing moves, with the matrix at hand, and renews it there: the point at which
    /// sensitivities are exact derivatives of the discrete solution.
    pub fn settle(&mut self, system: &mut Augmented, norm: &ErrorNorm, end: &mut StepEnd) -> Result<(), NewtonFailure> {
        let mut last = f64::INFINITY;
        for _ in 0..SETTLE_ITERATIONS {
            self.find_delta(system, end)?;
            end.correct(&self.delta);
            let size = norm.of_whole_correction(&self.delta) * norm.relative();
            let is_slow = size > SETTLE_RATE * last;
            last = size;
            if size <= SETTLED || is_slow {
                break;
            }
        }
        for _ in 0..SETTLE_RENEWALS {
            self.renew_and_correct(system, end)?;
            let size = norm.of_whole_correction(&self.delta) * norm.relative();
            // A new matrix that gains nothing stands at the rounding of the equations.
            if size <= SETTLED || size > SETTLE_RATE * last {
                break;
            }
            last = size;
        }
        Ok(())
    }

    fn renew_and_correct(&mut self, system: &mut Augmented, end: &mut StepEnd) -> Result<(), NewtonFailure> {
        self.renew(system, end)?;
        self.find_delta(system, end)?;
        end.correct(&self.delta);
        Ok(())
    }

    /// Solves to rounding with a new matrix in every iteration.
    pub fn polish(&mut self, system: &mut Augmented, norm: &ErrorNorm, end: &mut StepEnd) -> Result<(), NewtonFailure> {
        let mut last = f64::INFINITY;
        for _ in 0..POLISH_ITERATIONS {
            self.renew_and_correct(system, end)?;
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
        self.matrix.solve_block(right_hand_sides, width);
    }
}
