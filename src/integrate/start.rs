//! Start values that satisfy the constraints, and how they depend on the parameters.
//!
//! The nearest point on the constraints, measured in typical magnitudes. Positions come first and velocities after
//! them: constraints on positions would else be met by moving what should only follow.

use super::augmented::Augmented;
use super::problem::{Dynamics, Failure, FailureCause, Start};
use super::structure::{entries, find};
use crate::linear::SingularValueDecomposition;

const MAXIMUM_ITERATIONS: usize = 100;
const MAXIMUM_HALVINGS: usize = 12;
/// Distance from the constraints, in typical magnitudes, that counts as none.
const REACHED: f64 = 1e-9;
/// A step this small, in typical magnitudes, is rounding.
const ROUNDING: f64 = 1e-14;
/// Singular values below this share of the largest mean a dependent constraint.
const DEPENDENT: f64 = 1e-10;
/// Equations with at least this share in a contradiction are named.
const SHARE: f64 = 0.1;
/// Distance of differences, in typical magnitudes.
const DIFFERENCE: f64 = 1e-3;

/// Moves `y` to the nearest values that satisfy the constraints on differential components, and carries its derivatives
/// with respect to the parameters (`sensitivity`, n x p column-major, or empty) along. Components marked in `fixed`
/// (length n) stay. Derivatives and algebraic values are left to [`super::integrate`], which finds them at its start.
///
/// # Errors
///
/// [`FailureCause::InconsistentStart`] naming the equations that contradict each other or the fixed values,
/// [`FailureCause::RedundantConstraints`] naming those that repeat each other, [`FailureCause::NotFinite`].
pub fn consistent_start(
    dynamics: &mut dyn Dynamics,
    t: f64,
    y: &[f64],
    sensitivity: &[f64],
    fixed: &[bool],
) -> Result<Start, Failure> {
    let (n, p) = (dynamics.dimension(), dynamics.parameter_count());
    let fail = |cause, component, equations| Failure {
        time: t,
        cause,
        component,
        equations,
        state: y.to_vec(),
        work: Box::default(),
    };
    if y.len() != n || fixed.len() != n || !(sensitivity.is_empty() || sensitivity.len() == n * p) {
        return Err(fail(FailureCause::InvalidRequest, None, Vec::new()));
    }
    let y_prime = vec![0.0; n];
    let mut z = y.to_vec();
    let columns = if sensitivity.is_empty() { 0 } else { p };
    z.extend((0..n).flat_map(|i| (0..columns).map(move |j| sensitivity[j * n + i])));
    let mut system = Augmented::new(dynamics, columns > 0, t, y, &y_prime);
    for stage in stages(&mut system, t, y, fixed) {
        let mut projection = Projection::new(&mut system, t, stage);
        projection.run(&mut z).map_err(|problem| fail(problem.cause, problem.component, problem.equations))?;
    }
    let sensitivity = (0..columns).flat_map(|j| (0..n).map(move |i| (i, j))).map(|(i, j)| z[n + i * p + j]).collect();
    z.truncate(n);
    Ok(Start { time: t, y: z, y_prime, sensitivity })
}

/// Constraints to be met together by moving some components.
#[derive(Debug, Default, PartialEq)]
struct Stage {
    rows: Vec<usize>,
    columns: Vec<usize>,
}

/// Splits the constraints into those on positions and those on velocities. Components whose rates hold common
/// multipliers form a class; constraints that touch a single class come first and settle it, if they are as many as its
/// multipliers: velocities may have constraints of their own, those of linear couplings and of rolling, but others that
/// touch positions, too, and follow. Components whose rates hold no multiplier stay beside others: the heading of a wheel
/// that rolls decides on velocities, not they on it.
fn stages(system: &mut Augmented, t: f64, y: &[f64], fixed: &[bool]) -> Vec<Stage> {
    let n = system.n;
    let by_y = entries(system.dynamics, t, y, &vec![0.0; n]).by_y;
    let structure = &system.structure;
    // Rate of differential component i is in row i or in another row; either way the row joins its components' classes.
    let mut class: Vec<usize> = (0..n).collect();
    for &(row, column) in by_y.iter().filter(|(_, column)| structure.is_multiplier[*column]) {
        let (a, b) = (find(&mut class, row), find(&mut class, column));
        class[a] = b;
    }
    let mut multipliers = vec![0; n];
    for i in (0..n).filter(|&i| structure.is_multiplier[i]) {
        multipliers[find(&mut class, i)] += 1;
    }
    let is_held: Vec<bool> = (0..n).map(|i| multipliers[find(&mut class, i)] > 0).collect();
    let touched = |row: usize| {
        let all: Vec<usize> = by_y.iter().filter(|entry| entry.0 == row).map(|entry| entry.1).collect();
        let any_held = all.iter().any(|&i| is_held[i]);
        (row, all.into_iter().filter(|&i| is_held[i] || !any_held).collect())
    };
    let touched: Vec<(usize, Vec<usize>)> = structure.constraints.iter().map(|&row| touched(row)).collect();
    let mut first = Stage::default();
    let mut second = Stage::default();
    let mut settled = vec![false; n];
    let mut classes_of = |columns: &[usize]| -> Vec<usize> {
        let mut classes: Vec<usize> = columns.iter().map(|&column| find(&mut class, column)).collect();
        classes.sort_unstable();
        classes.dedup();
        classes
    };
    let classes: Vec<Vec<usize>> = touched.iter().map(|(_, columns)| classes_of(columns)).collect();
    let own = |c: usize| classes.iter().filter(|classes| classes[..] == [c]).count();
    let follows = |c: usize| own(c) < multipliers[c];
    for ((row, _), classes) in touched.iter().zip(&classes) {
        match classes[..] {
            [single] if !follows(single) => {
                first.rows.push(*row);
                settled[single] = true;
            }
            [] => first.rows.push(*row),
            _ => second.rows.push(*row),
        }
    }
    let movable = |row: &(usize, Vec<usize>)| row.1.iter().copied().filter(|&i| !fixed[i]).collect::<Vec<usize>>();
    for entry in &touched {
        let columns = movable(entry);
        if first.rows.contains(&entry.0) {
            first.columns.extend(columns);
        } else {
            second.columns.extend(columns.iter().filter(|&&i| !settled[find(&mut class, i)]));
        }
    }
    for stage in [&mut first, &mut second] {
        stage.columns.sort_unstable();
        stage.columns.dedup();
    }
    [first, second].into_iter().filter(|stage| !stage.rows.is_empty()).collect()
}

struct Problem {
    cause: FailureCause,
    component: Option<usize>,
    equations: Vec<usize>,
}

struct Projection<'s, 'd> {
    system: &'s mut Augmented<'d>,
    t: f64,
    stage: Stage,
    scale: Vec<f64>,
    zero: Vec<f64>,
}

/// The constraints of a stage linearised, in typical magnitudes, rows of length one.
struct Linearised {
    decomposition: Option<SingularValueDecomposition>,
    rank: usize,
    row_factor: Vec<f64>,
    /// Rows of the stage by its columns, not scaled, row by row.
    matrix: Vec<f64>,
}

impl<'s, 'd> Projection<'s, 'd> {
    fn new(system: &'s mut Augmented<'d>, t: f64, stage: Stage) -> Self {
        let scale = system.dynamics.scale().to_vec();
        let zero = vec![0.0; system.n];
        Self { system, t, stage, scale, zero }
    }

    /// Moves the state and its sensitivities.
    fn run(&mut self, z: &mut [f64]) -> Result<(), Problem> {
        let n = self.system.n;
        let (y, s) = z.split_at_mut(n);
        let given = y.to_vec();
        self.refuse_redundant(y)?;
        self.move_state(&given, y)?;
        if self.system.p > 0 {
            self.move_sensitivities(&given, y, s)?;
        }
        Ok(())
    }

    fn residual(&mut self, y: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; y.len()];
        self.system.residual(self.t, y, &self.zero, &mut all);
        self.stage.rows.iter().map(|&row| all[row]).collect()
    }

    /// Derivatives of the constraints of the stage by `columns`, row by row.
    fn matrix(&mut self, y: &[f64], columns: &[usize]) -> Vec<f64> {
        self.system.linearise(self.t, y, &self.zero, 0.0);
        let width = columns.len();
        let mut matrix = vec![0.0; self.stage.rows.len() * width];
        let places = self.system.jacobian_rows.iter().zip(&self.system.jacobian_columns);
        for ((row, column), &value) in places.zip(&self.system.jacobian) {
            if let (Ok(i), Ok(k)) = (self.stage.rows.binary_search(row), columns.binary_search(column)) {
                matrix[i * width + k] = value;
            }
        }
        matrix
    }

    fn linearise(&mut self, y: &[f64], columns: &[usize]) -> Result<Linearised, Problem> {
        let (m, width) = (self.stage.rows.len(), columns.len());
        let matrix = self.matrix(y, columns);
        let scaled = |i: usize, k: usize| matrix[i * width + k] * self.scale[columns[k]];
        let row_factor: Vec<f64> = (0..m)
            .map(|i| (0..width).map(|k| scaled(i, k) * scaled(i, k)).sum::<f64>().sqrt())
            .map(|size| if size > 0.0 { 1.0 / size } else { 1.0 })
            .collect();
        let values: Vec<f64> =
            (0..width).flat_map(|k| (0..m).map(move |i| (i, k))).map(|(i, k)| scaled(i, k) * row_factor[i]).collect();
        let not_finite = || Problem { cause: FailureCause::NotFinite, component: None, equations: Vec::new() };
        let decomposition = match width {
            0 => None,
            _ => Some(SingularValueDecomposition::new(m, width, &values).map_err(|_| not_finite())?),
        };
        let rank = decomposition.as_ref().map_or(0, |d| d.rank(DEPENDENT));
        Ok(Linearised { decomposition, rank, row_factor, matrix })
    }

    /// Constraints whose directions depend on each other whatever moves.
    fn refuse_redundant(&mut self, y: &[f64]) -> Result<(), Problem> {
        let differential = self.system.dynamics.differential().to_vec();
        let all: Vec<usize> = (0..y.len()).filter(|&i| differential[i]).collect();
        let linearised = self.linearise(y, &all)?;
        let (m, rank) = (self.stage.rows.len(), linearised.rank);
        if rank == m {
            return Ok(());
        }
        let residual = self.residual(y);
        let unmet = linearised.unmet(&residual);
        let largest = unmet.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        let weights = if largest > REACHED { unmet } else { linearised.dependence(m) };
        let cause =
            if largest > REACHED { FailureCause::InconsistentStart } else { FailureCause::RedundantConstraints };
        Err(self.problem(cause, &weights))
    }

    /// Names the equations by their share.
    fn problem(&self, cause: FailureCause, share: &[f64]) -> Problem {
        let largest = share.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        let equations: Vec<usize> = self
            .stage
            .rows
            .iter()
            .zip(share)
            .filter(|(_, v)| v.abs() >= SHARE * largest)
            .map(|(row, _)| *row)
            .collect();
        let touched = |row: &usize| {
            let entries = self.system.jacobian_rows.iter().zip(&self.system.jacobian_columns);
            entries.filter(|(r, _)| *r == row).map(|(_, column)| *column).min()
        };
        Problem { cause, component: equations.first().and_then(touched), equations }
    }

    /// Newton's method for the nearest point, halving steps that lead away.
    fn move_state(&mut self, given: &[f64], y: &mut [f64]) -> Result<(), Problem> {
        let columns = self.stage.columns.clone();
        let mut residual = self.residual(y);
        let mut last_length = f64::INFINITY;
        for _ in 0..MAXIMUM_ITERATIONS {
            let linearised = self.linearise(y, &columns)?;
            let size = linearised.size(&residual);
            if !size.is_finite() {
                return Err(Problem {
                    cause: FailureCause::NotFinite,
                    ..self.problem(FailureCause::NotFinite, &residual)
                });
            }
            // The point on the linearised constraints that is nearest to the given one, not to the present one.
            let distance: Vec<f64> = columns.iter().map(|&i| y[i] - given[i]).collect();
            let target = linearised.along(&distance, &residual);
            let nearest = linearised.solve(&target);
            let step: Vec<f64> =
                columns.iter().zip(&nearest).zip(&distance).map(|((&i, a), d)| a * self.scale[i] - d).collect();
            let length = columns.iter().zip(&step).map(|(&i, s)| (s / self.scale[i]).powi(2)).sum::<f64>().sqrt();
            if size <= REACHED && (length <= ROUNDING || length >= last_length) {
                return Ok(());
            }
            last_length = length;
            let mut share = 1.0;
            let mut halvings = 0;
            let (moved, new) = loop {
                let mut moved = y.to_vec();
                columns.iter().zip(&step).for_each(|(&i, s)| moved[i] += share * s);
                let new = self.residual(&moved);
                if linearised.size(&new) <= size.max(REACHED) || halvings == MAXIMUM_HALVINGS {
                    break (moved, new);
                }
                share *= 0.5;
                halvings += 1;
            };
            if halvings == MAXIMUM_HALVINGS {
                return Err(self.problem(FailureCause::InconsistentStart, &linearised.scaled(&residual)));
            }
            y.copy_from_slice(&moved);
            residual = new;
        }
        let linearised = self.linearise(y, &columns)?;
        if linearised.size(&residual) <= REACHED {
            return Ok(());
        }
        Err(self.problem(FailureCause::InconsistentStart, &linearised.scaled(&residual)))
    }

    /// Derivative of the nearest point: `A S = -c_theta - c_u S_u` for its constraints, and its distance from the given
    /// point, `D^2 A^T nu`, changes with A.
    fn move_sensitivities(&mut self, given: &[f64], y: &[f64], s: &mut [f64]) -> Result<(), Problem> {
        let (n, p) = (self.system.n, self.system.p);
        let columns = self.stage.columns.clone();
        let width = columns.len();
        let linearised = self.linearise(y, &columns)?;
        let original = s.to_vec();
        let mut of_constraints = vec![0.0; n * p];
        for &i in &columns {
            s[i * p..(i + 1) * p].fill(0.0);
        }
        self.system.held_derivative_right_hand_side(self.t, y, &self.zero, s, &mut of_constraints);
        let distance: Vec<f64> = columns.iter().map(|&i| (y[i] - given[i]) / self.scale[i]).collect();
        let bend = self.bend(y, &linearised.multipliers(&distance), s);
        for j in 0..p {
            let right: Vec<f64> = self.stage.rows.iter().map(|&row| of_constraints[row * p + j]).collect();
            let mut target: Vec<f64> = columns.iter().map(|&i| original[i * p + j]).collect();
            let base = target.clone();
            for _ in 0..MAXIMUM_ITERATIONS {
                let value = |k: usize| -> f64 { target[k] };
                // From the given derivative, bent by the change of the directions, back onto the constraints.
                let from: Vec<f64> = (0..width)
                    .map(|k| {
                        let square = self.scale[columns[k]] * self.scale[columns[k]];
                        let along: f64 = (0..width).map(|l| bend.second[k * width + l] * value(l)).sum();
                        base[k] - square * (bend.mixed[k * p + j] + along)
                    })
                    .collect();
                let shift = linearised.solve(&linearised.along(&from, &right));
                let new: Vec<f64> = (0..width).map(|k| from[k] - shift[k] * self.scale[columns[k]]).collect();
                let change = new.iter().zip(&target).fold(0.0f64, |a, (n, o)| a.max((n - o).abs()));
                let size = new.iter().fold(0.0f64, |a, v| a.max(v.abs()));
                target = new;
                if change <= ROUNDING * size {
                    break;
                }
            }
            for (&i, value) in columns.iter().zip(&target) {
                s[i * p + j] = *value;
            }
        }
        Ok(())
    }

    /// Second derivatives of `nu^T c` by differences; zeros where nothing was moved.
    fn bend(&mut self, y: &[f64], multipliers: &[f64], s: &[f64]) -> Bend {
        let (n, p) = (self.system.n, self.system.p);
        let columns = self.stage.columns.clone();
        let width = columns.len();
        let mut bend = Bend { second: vec![0.0; width * width], mixed: vec![0.0; width * p] };
        if multipliers.iter().all(|m| *m == 0.0) {
            return bend;
        }
        let mut right = vec![0.0; n * p];
        for (k, &moved) in columns.iter().enumerate() {
            let step = DIFFERENCE * self.scale[moved];
            for (distance, weight) in super::consistent::CENTRAL {
                let mut point = y.to_vec();
                point[moved] += distance * step;
                // Known derivatives S of the other components and the parameters in one product.
                self.system.held_derivative_right_hand_side(self.t, &point, &self.zero, s, &mut right);
                let matrix = self.matrix(&point, &columns);
                for ((i, &row), multiplier) in self.stage.rows.iter().enumerate().zip(multipliers) {
                    let factor = weight / step * multiplier;
                    for l in 0..width {
                        bend.second[k * width + l] += factor * matrix[i * width + l];
                    }
                    for j in 0..p {
                        bend.mixed[k * p + j] -= factor * right[row * p + j];
                    }
                }
            }
        }
        bend
    }
}

struct Bend {
    second: Vec<f64>,
    mixed: Vec<f64>,
}

impl Linearised {
    fn scaled(&self, residual: &[f64]) -> Vec<f64> {
        residual.iter().zip(&self.row_factor).map(|(r, f)| r * f).collect()
    }

    fn size(&self, residual: &[f64]) -> f64 {
        let sum: f64 = self.scaled(residual).iter().map(|r| r * r).sum();
        if sum.is_finite() { sum.sqrt() } else { f64::INFINITY }
    }

    /// `A step - residual`.
    fn along(&self, step: &[f64], residual: &[f64]) -> Vec<f64> {
        let rows = self.matrix.chunks_exact(step.len().max(1));
        if step.is_empty() {
            return residual.iter().map(|r| -r).collect();
        }
        rows.zip(residual).map(|(row, r)| row.iter().zip(step).map(|(a, s)| a * s).sum::<f64>() - r).collect()
    }

    /// Shortest scaled solution of `A x = right`.
    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let Some(decomposition) = &self.decomposition else { return Vec::new() };
        let right = self.scaled(right);
        let mut solution = vec![0.0; decomposition.right(0).len()];
        for k in 0..self.rank {
            let share: f64 = decomposition.left(k).iter().zip(&right).map(|(u, r)| u * r).sum();
            let factor = share / decomposition.singular_values[k];
            solution.iter_mut().zip(decomposition.right(k)).for_each(|(s, v)| *s += factor * v);
        }
        solution
    }

    /// `nu` with `distance = -A^T nu` in scaled components.
    fn multipliers(&self, distance: &[f64]) -> Vec<f64> {
        let mut multipliers = vec![0.0; self.row_factor.len()];
        let Some(decomposition) = &self.decomposition else { return multipliers };
        if distance.iter().all(|d| d.abs() <= REACHED * REACHED.sqrt()) {
            return multipliers;
        }
        for k in 0..self.rank {
            let share: f64 = decomposition.right(k).iter().zip(distance).map(|(v, d)| v * d).sum();
            let factor = share / decomposition.singular_values[k];
            multipliers.iter_mut().zip(decomposition.left(k)).for_each(|(m, u)| *m -= factor * u);
        }
        multipliers.iter_mut().zip(&self.row_factor).for_each(|(m, f)| *m *= f);
        multipliers
    }

    /// Part of a residual that no movement can meet, scaled.
    fn unmet(&self, residual: &[f64]) -> Vec<f64> {
        let mut rest = self.scaled(residual);
        let Some(decomposition) = &self.decomposition else { return rest };
        for k in 0..self.rank {
            let share: f64 = decomposition.left(k).iter().zip(&rest).map(|(u, r)| u * r).sum();
            rest.iter_mut().zip(decomposition.left(k)).for_each(|(r, u)| *r -= share * u);
        }
        rest
    }

    /// Share of each equation in the dependences: how much of its unit vector no direction reaches.
    fn dependence(&self, count: usize) -> Vec<f64> {
        let reached = |i: usize| match &self.decomposition {
            Some(d) => (0..self.rank).map(|k| d.left(k)[i] * d.left(k)[i]).sum::<f64>(),
            None => 0.0,
        };
        (0..count).map(|i| (1.0 - reached(i)).max(0.0).sqrt()).collect()
    }
}
