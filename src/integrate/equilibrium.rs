//! States in which nothing changes, and how they depend on the parameters.

use super::equilibrium_sparse::{self, Accuracy};
use super::problem::{Dynamics, Failure, FailureCause, Work};
use super::stepper::first_not_finite;
use super::structure::Structure;
use crate::linear::SingularValueDecomposition;

const MAXIMUM_ITERATIONS: usize = 200;
/// Scaled residual that counts as zero ...
const CONVERGED: f64 = 1e-9;
/// ... and below which further corrections are rounding.
const ROUNDING: f64 = 1e-14;
/// Singular values below this share of the largest mean a direction that the equations do not determine.
const UNDETERMINED: f64 = 1e-12;
/// Equations and components with at least this share in a contradiction or dependence are named.
const SHARE: f64 = 0.1;
/// Damping as share of the largest singular value: first value after a failed full step, its growth, and the number of
/// attempts before giving up.
const FIRST_DAMPING: f64 = 1e-4;
const DAMPING_GROWTH: f64 = 10.0;
const DAMPED_ATTEMPTS: i32 = 14;

/// A state of rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Equilibrium {
    /// Length n.
    pub y: Vec<f64>,
    /// Length n; zero for the components that were sought.
    pub y_prime: Vec<f64>,
    /// dy/dtheta, n x p column-major.
    pub sensitivity: Vec<f64>,
    pub work: Work,
}

/// Finds values of the components marked in `unknown` (length n) for which their equations hold with `y' = 0`, starting
/// from `y`; the other components keep their values, whose derivatives with respect to the parameters stand in
/// `sensitivity` (n x p column-major; rows of unknowns are ignored).
///
/// The equation of an unknown component is its row of F. Where that row holds no unknown (a position whose velocity is
/// given), the rows of the components it does hold take its place (the acceleration of that position).
///
/// Method: Newton steps on the equations scaled by the typical magnitudes, damped as in Levenberg-Marquardt where a
/// full step does not reduce the residual (More-1978). Sensitivities follow from the implicit function theorem.
///
/// # Errors
///
/// [`FailureCause::NoEquilibrium`] naming the equations that cannot be satisfied together, or the component that the
/// equations leave undetermined (free to move without stiffness); [`FailureCause::RedundantConstraints`] naming the
/// constraints whose forces are undetermined (static redundancy); [`FailureCause::NotFinite`] where the model cannot be
/// evaluated at the start.
pub fn equilibrium(
    dynamics: &mut dyn Dynamics,
    t: f64,
    y: &[f64],
    sensitivity: &[f64],
    unknown: &[bool],
) -> Result<Equilibrium, Failure> {
    let n = dynamics.dimension();
    let complete = y.len() == n && unknown.len() == n && sensitivity.len() == n * dynamics.parameter_count();
    if !complete {
        let trouble = Trouble { cause: FailureCause::InvalidRequest, component: None, equations: Vec::new() };
        return Err(fail(t, trouble, Work::default()));
    }
    let mut work = Work { method: "Newton", ..Work::default() };
    if unknown.iter().all(|u| *u) {
        let accuracy = Accuracy { converged: CONVERGED, rounding: ROUNDING };
        if let Some((y, sensitivity)) = equilibrium_sparse::solve(dynamics, t, y, &accuracy, &mut work) {
            return Ok(Equilibrium { y, y_prime: vec![0.0; n], sensitivity, work });
        }
    }
    let mut search = Search::new(dynamics, t, y, unknown, work);
    if search.unknowns.is_empty() {
        let (y, sensitivity) = (y.to_vec(), sensitivity.to_vec());
        return Ok(Equilibrium { y_prime: vec![0.0; n], y, sensitivity, work: search.work });
    }
    match search.solve().and_then(|()| search.sensitivity(sensitivity)) {
        Ok(sensitivity) => Ok(Equilibrium { y: search.y, y_prime: vec![0.0; n], sensitivity, work: search.work }),
        Err(trouble) => Err(fail(t, trouble, search.work)),
    }
}

fn fail(time: f64, trouble: Trouble, work: Work) -> Failure {
    let Trouble { cause, component, equations } = trouble;
    Failure { time, cause, component, equations, state: Vec::new(), work: Box::new(work) }
}

struct Trouble {
    cause: FailureCause,
    component: Option<usize>,
    equations: Vec<usize>,
}

impl Trouble {
    fn with(cause: FailureCause, component: Option<usize>) -> Self {
        Self { cause, component, equations: Vec::new() }
    }
}

type Outcome<T> = Result<T, Trouble>;

struct Search<'d> {
    dynamics: &'d mut dyn Dynamics,
    t: f64,
    y: Vec<f64>,
    unknowns: Vec<usize>,
    /// Equations used.
    rows: Vec<usize>,
    /// Typical magnitude of each unknown.
    scale: Vec<f64>,
    zero: Vec<f64>,
    work: Work,
}

/// The linearised equations at a point, scaled to rows of magnitude one.
struct Linearisation {
    decomposition: SingularValueDecomposition,
    /// dF/dy, all rows and columns, dense column-major.
    matrix: Vec<f64>,
    /// 1 / largest effect of an unknown on each row.
    row_factor: Vec<f64>,
}

impl<'d> Search<'d> {
    fn new(dynamics: &'d mut dyn Dynamics, t: f64, y: &[f64], unknown: &[bool], work: Work) -> Self {
        let n = y.len();
        let unknowns: Vec<usize> = (0..n).filter(|&i| unknown[i]).collect();
        let rows = equations(dynamics, t, y, unknown);
        let scale = unknowns.iter().map(|&i| dynamics.scale()[i]).collect();
        Self { dynamics, t, y: y.to_vec(), unknowns, rows, scale, zero: vec![0.0; n], work }
    }

    fn residual(&mut self, y: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; y.len()];
        self.work.residuals += 1;
        self.dynamics.residual(self.t, y, &self.zero, &mut all);
        self.rows.iter().map(|&row| all[row]).collect()
    }

    fn linearise(&mut self) -> Outcome<Linearisation> {
        let n = self.y.len();
        let mut values = vec![0.0; self.dynamics.pattern().len()];
        self.work.jacobians += 1;
        self.dynamics.jacobian(self.t, &self.y, &self.zero, 0.0, &mut values);
        let pattern = self.dynamics.pattern();
        if let Some(entry) = first_not_finite(&values) {
            return Err(Trouble::with(FailureCause::NotFinite, Some(pattern.rows[entry])));
        }
        let mut matrix = vec![0.0; n * n];
        for ((row, column), &value) in pattern.entries().zip(&values) {
            matrix[column * n + row] = value;
        }
        let effect = |row: usize, k: usize| matrix[self.unknowns[k] * n + row] * self.scale[k];
        let row_factor: Vec<f64> = self
            .rows
            .iter()
            .map(|&row| {
                let largest = (0..self.unknowns.len()).fold(0.0f64, |a, k| a.max(effect(row, k).abs()));
                if largest > 0.0 { 1.0 / largest } else { 1.0 }
            })
            .collect();
        let scaled: Vec<f64> = (0..self.unknowns.len())
            .flat_map(|k| self.rows.iter().zip(&row_factor).map(move |(&row, factor)| (row, k, factor)))
            .map(|(row, k, factor)| effect(row, k) * factor)
            .collect();
        self.work.factorisations += 1;
        let decomposition = SingularValueDecomposition::new(self.rows.len(), self.unknowns.len(), &scaled)
            .map_err(|_| Trouble::with(FailureCause::NoEquilibrium, None))?;
        Ok(Linearisation { decomposition, matrix, row_factor })
    }

    fn solve(&mut self) -> Outcome<()> {
        let mut residual = self.residual(&self.y.clone());
        if let Some(row) = first_not_finite(&residual) {
            return Err(Trouble::with(FailureCause::NotFinite, Some(self.rows[row])));
        }
        for _ in 0..MAXIMUM_ITERATIONS {
            let linearisation = self.linearise()?;
            let size = linearisation.size(&residual);
            if size <= ROUNDING {
                return self.refuse_undetermined(&linearisation);
            }
            match self.improve(&linearisation, &residual, size) {
                Some((y, better)) => {
                    self.y = y;
                    residual = better;
                }
                None if size <= CONVERGED => return self.refuse_undetermined(&linearisation),
                None => return Err(self.contradiction(&linearisation, &residual)),
            }
        }
        let linearisation = self.linearise()?;
        if linearisation.size(&residual) <= CONVERGED {
            return self.refuse_undetermined(&linearisation);
        }
        Err(self.contradiction(&linearisation, &residual))
    }

    /// A point with a smaller residual, by a full or damped step.
    fn improve(&mut self, linearisation: &Linearisation, residual: &[f64], size: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let largest = linearisation.decomposition.singular_values[0];
        for attempt in 0..DAMPED_ATTEMPTS {
            let damping = if attempt == 0 { 0.0 } else { FIRST_DAMPING * DAMPING_GROWTH.powi(attempt - 1) * largest };
            let step = linearisation.step(residual, damping);
            let mut y = self.y.clone();
            for ((&i, scale), step) in self.unknowns.iter().zip(&self.scale).zip(&step) {
                y[i] -= scale * step;
            }
            let new = self.residual(&y);
            // What is not a number is no improvement either.
            if linearisation.size(&new) < size {
                return Some((y, new));
            }
        }
        None
    }

    /// Equations with the largest scaled residuals.
    fn contradiction(&self, linearisation: &Linearisation, residual: &[f64]) -> Trouble {
        let sizes: Vec<f64> = residual.iter().zip(&linearisation.row_factor).map(|(r, f)| (r * f).abs()).collect();
        let worst = (0..sizes.len()).max_by(|&a, &b| sizes[a].total_cmp(&sizes[b])).unwrap_or(0);
        let equations = (0..sizes.len()).filter(|&k| sizes[k] >= SHARE * sizes[worst]).map(|k| self.rows[k]).collect();
        Trouble { cause: FailureCause::NoEquilibrium, component: Some(self.rows[worst]), equations }
    }

    fn refuse_undetermined(&mut self, linearisation: &Linearisation) -> Outcome<()> {
        let decomposition = &linearisation.decomposition;
        let rank = decomposition.rank(UNDETERMINED);
        if rank == self.unknowns.len() {
            return Ok(());
        }
        // With fewer equations than unknowns the thin decomposition has no vector for the missing directions.
        if rank >= decomposition.singular_values.len() {
            return Err(Trouble::with(FailureCause::NoEquilibrium, None));
        }
        let direction = decomposition.right(rank);
        let largest = (0..direction.len()).max_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs()));
        let size = largest.map_or(0.0, |k| direction[k].abs());
        let structure = Structure::new(self.dynamics, self.t, &self.y, &self.zero);
        let free = (0..direction.len()).filter(|&k| direction[k].abs() >= SHARE * size);
        let only_multipliers = free.into_iter().all(|k| structure.is_multiplier[self.unknowns[k]]);
        let component = largest.map(|k| self.unknowns[k]);
        if !only_multipliers {
            return Err(Trouble::with(FailureCause::NoEquilibrium, component));
        }
        // Rows whose unit vectors the equations do not reach depend on each other.
        let unreached =
            |k: usize| 1.0 - (0..rank).map(|j| decomposition.left(j)[k] * decomposition.left(j)[k]).sum::<f64>();
        let dependent = |k: &usize| structure.is_constraint[self.rows[*k]] && unreached(*k) > SHARE * SHARE;
        let equations = (0..self.rows.len()).filter(dependent).map(|k| self.rows[k]).collect();
        Err(Trouble { cause: FailureCause::RedundantConstraints, component, equations })
    }

    /// `dF/dy_unknown S_unknown = -(dF/dtheta + dF/dy_known S_known)`.
    fn sensitivity(&mut self, given: &[f64]) -> Outcome<Vec<f64>> {
        let (n, p) = (self.y.len(), self.dynamics.parameter_count());
        let mut sensitivity = given.to_vec();
        if p == 0 {
            return Ok(sensitivity);
        }
        let linearisation = self.linearise()?;
        let mut by_parameter = vec![0.0; n * p];
        self.dynamics.parameter_derivative(self.t, &self.y, &self.zero, &mut by_parameter);
        for (column, by_parameter) in sensitivity.chunks_exact_mut(n).zip(by_parameter.chunks_exact(n)) {
            for &i in &self.unknowns {
                column[i] = 0.0;
            }
            let right: Vec<f64> = self
                .rows
                .iter()
                .map(|&row| {
                    by_parameter[row] + (0..n).map(|i| linearisation.matrix[i * n + row] * column[i]).sum::<f64>()
                })
                .collect();
            let step = linearisation.step(&right, 0.0);
            for ((&i, scale), step) in self.unknowns.iter().zip(&self.scale).zip(&step) {
                column[i] = -scale * step;
            }
        }
        match first_not_finite(&sensitivity) {
            Some(place) => Err(Trouble::with(FailureCause::NotFinite, Some(place % n))),
            None => Ok(sensitivity),
        }
    }
}

impl Linearisation {
    /// Largest scaled residual; the scale of the matrix at this point, so that points are compared by one measure.
    fn size(&self, residual: &[f64]) -> f64 {
        let sum: f64 = residual.iter().zip(&self.row_factor).map(|(r, factor)| (r * factor) * (r * factor)).sum();
        if sum.is_finite() { sum.sqrt() } else { f64::INFINITY }
    }

    /// Damped least-squares solution of `A step = residual` in scaled unknowns.
    fn step(&self, residual: &[f64], damping: f64) -> Vec<f64> {
        let decomposition = &self.decomposition;
        let values = &decomposition.singular_values;
        let mut step = vec![0.0; decomposition.right(0).len()];
        for (k, &value) in values.iter().enumerate() {
            if value <= UNDETERMINED * values[0] {
                break;
            }
            let left = decomposition.left(k);
            let share: f64 =
                left.iter().zip(residual).zip(&self.row_factor).map(|((u, r), factor)| u * r * factor).sum();
            let factor = share * value / (value * value + damping * damping);
            step.iter_mut().zip(decomposition.right(k)).for_each(|(s, v)| *s += factor * v);
        }
        step
    }
}

/// Rows of F that determine the unknown components.
fn equations(dynamics: &mut dyn Dynamics, t: f64, y: &[f64], unknown: &[bool]) -> Vec<usize> {
    let n = unknown.len();
    let mut values = vec![0.0; dynamics.pattern().len()];
    dynamics.jacobian(t, y, &vec![0.0; n], 0.0, &mut values);
    let pattern = dynamics.pattern();
    // Per row: whether it holds an unknown, and the given components it holds.
    let mut holds_unknown = vec![false; n];
    let mut given: Vec<Vec<usize>> = vec![Vec::new(); n];
    for ((row, column), &value) in pattern.entries().zip(&values) {
        // The diagonal is always there, for the derivative; only its value tells whether the row holds y itself.
        if row == column && value == 0.0 {
            continue;
        }
        if unknown[column] {
            holds_unknown[row] = true;
        } else if row != column {
            given[row].push(column);
        }
    }
    let mut used = vec![false; n];
    for i in (0..n).filter(|&i| unknown[i]) {
        if holds_unknown[i] || given[i].is_empty() {
            used[i] = true;
        } else {
            given[i].iter().for_each(|&j| used[j] = true);
        }
    }
    (0..n).filter(|&row| used[row]).collect()
}
