//! Where closed loops pass a position in which they could go on in two ways.

use super::run::Compiled;
use crate::integrate::Dynamics;
use crate::linear::{self, SingularValueDecomposition};
use crate::mechanics::VariableKind;
use crate::tape::Bound;

/// A flat parallelogram, the dead centre of a crank as long as its rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branching {
    /// s
    pub time: f64,
    /// Index into [`crate::mechanics::System::loop_owners`].
    pub constraint: usize,
}

/// Instants looked at, at most.
const INSTANTS: usize = 1000;
/// Mechanisms of more freedoms before their loops are closed are not watched.
const MOST_FREEDOMS: usize = 40;
/// The directions left free at one instant must be found again in the next to this share, else both have nothing in
/// common.
const FOUND_AGAIN: f64 = 0.5;
/// Smallest singular value over its largest in the run: at a singular position, and near one.
const SINGULAR: f64 = 1e-6;
const NEARLY_SINGULAR: f64 = 0.5;

/// The constraints at one instant.
struct Instant {
    time: f64,
    /// Of the constraints' Jacobian, rows of at most length one.
    smallest: f64,
    /// The constraint with the largest part in their dependence.
    constraint: usize,
    /// Sign of the determinant of constraints and free directions together.
    sign: f64,
    /// Whether the free directions continue those of the instant before.
    continues: bool,
}

/// Passages along a solution, rows `y` at `times`: the constraints with the directions that they leave free are as many
/// as there are coordinates, and their determinant changes its sign where the constraints become dependent (the test
/// for simple branch points of continuation methods).
pub(super) fn branchings(compiled: &Compiled, bound: &mut Bound, times: &[f64], y: &[f64]) -> Vec<Branching> {
    let constraints = compiled.system.position_constraints;
    let kinds = compiled.model.variables().iter().map(|variable| variable.kind);
    let velocities: Vec<usize> =
        kinds.enumerate().filter(|(_, kind)| *kind == VariableKind::Velocity).map(|(i, _)| i).collect();
    if constraints == 0 || constraints > velocities.len() || velocities.len() > MOST_FREEDOMS {
        return Vec::new();
    }
    let n = compiled.model.dimension();
    let stride = times.len().div_ceil(INSTANTS).max(1);
    let looked_at: Vec<usize> = (0..times.len()).step_by(stride).collect();
    let state = |k: usize| &y[k * n..(k + 1) * n];
    let mut jacobians: Vec<Vec<f64>> =
        looked_at.iter().map(|&k| jacobian(compiled, bound, times[k], state(k), &velocities)).collect();
    let sizes = row_sizes(&jacobians, constraints);
    jacobians.iter_mut().for_each(|jacobian| divide_rows(jacobian, &sizes));
    // Which constraints are in force is a state that changes at events: others have another sign.
    let in_force: Vec<usize> = (0..compiled.model.state_count())
        .filter(|&i| compiled.model.variables()[i].name.ends_with(crate::mechanics::IN_FORCE))
        .collect();
    let mut before: Option<(usize, Vec<Vec<f64>>)> = None;
    let mut instants: Vec<Instant> = Vec::new();
    for (&k, jacobian) in looked_at.iter().zip(&jacobians) {
        let Some((smallest, constraint)) = weakest(jacobian, constraints) else { continue };
        let mut instant = Instant { time: times[k], smallest, constraint, sign: 0.0, continues: true };
        let is_same = |at: usize| in_force.iter().all(|&i| state(k)[i].to_bits() == state(at)[i].to_bits());
        let last = before.as_ref().filter(|(at, _)| is_same(*at)).map(|(_, directions)| &directions[..]);
        if let Some(directions) = directions(jacobian, constraints, last.unwrap_or_default()) {
            instant.sign = sign_of_determinant(jacobian, constraints, &directions.all);
            instant.continues = directions.continue_others;
            before = Some((k, directions.all));
        }
        instants.push(instant);
    }
    passages(&instants)
}

/// Per constraint the greatest length of its row in the run.
fn row_sizes(jacobians: &[Vec<f64>], rows: usize) -> Vec<f64> {
    let length =
        |jacobian: &Vec<f64>, row: usize| jacobian.iter().skip(row).step_by(rows).map(|v| v * v).sum::<f64>().sqrt();
    (0..rows).map(|row| jacobians.iter().map(|jacobian| length(jacobian, row)).fold(0.0, f64::max)).collect()
}

fn divide_rows(jacobian: &mut [f64], sizes: &[f64]) {
    for (row, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
        jacobian.iter_mut().skip(row).step_by(sizes.len()).for_each(|value| *value /= size);
    }
}

fn passages(instants: &[Instant]) -> Vec<Branching> {
    let largest = instants.iter().fold(0.0_f64, |most, instant| most.max(instant.smallest));
    let mut found = Vec::new();
    if let Some(first) = instants.first().filter(|first| first.smallest < SINGULAR * largest) {
        found.push(Branching { time: first.time, constraint: first.constraint });
    }
    let mut last: Option<usize> = None;
    for (k, instant) in instants.iter().enumerate() {
        if instant.smallest < SINGULAR * largest || instant.sign == 0.0 {
            continue;
        }
        let before = last.replace(k).map(|at| (at, &instants[at]));
        let Some((at, before)) = before.filter(|(_, before)| instant.continues && before.sign * instant.sign < 0.0)
        else {
            continue;
        };
        let nearest = instants[at..=k].iter().min_by(|a, b| a.smallest.total_cmp(&b.smallest));
        let Some(nearest) = nearest.filter(|nearest| nearest.smallest < NEARLY_SINGULAR * largest) else { continue };
        let share = before.smallest / (before.smallest + instant.smallest);
        let time = before.time + share * (instant.time - before.time);
        found.push(Branching { time, constraint: nearest.constraint });
    }
    found
}

/// Slopes of the velocity constraints by the velocities: constraints x velocities, column-major.
fn jacobian(compiled: &Compiled, bound: &mut Bound, time: f64, y: &[f64], velocities: &[usize]) -> Vec<f64> {
    let (n, rows, first) = (y.len(), compiled.system.position_constraints, compiled.model.state_count());
    let entries: Vec<(usize, usize)> = bound.pattern().entries().collect();
    let mut values = vec![0.0; entries.len()];
    bound.jacobian(time, y, &vec![0.0; n], 0.0, &mut values);
    let mut matrix = vec![0.0; rows * velocities.len()];
    for (&(row, column), value) in entries.iter().zip(values) {
        if let (Some(row), Ok(column)) =
            (row.checked_sub(first).filter(|row| *row < rows), velocities.binary_search(&column))
        {
            matrix[column * rows + row] = value;
        }
    }
    matrix
}

/// The smallest singular value, and the row with the largest part in its left vector.
fn weakest(jacobian: &[f64], rows: usize) -> Option<(f64, usize)> {
    let svd = SingularValueDecomposition::new(rows, jacobian.len() / rows, jacobian).ok()?;
    let last = rows.checked_sub(1)?;
    let part = |row: &usize| svd.left(last)[*row].abs();
    Some((svd.singular_values[last], (0..rows).max_by(|a, b| part(a).total_cmp(&part(b)))?))
}

/// An orthonormal basis of the directions that constraints leave free.
struct Directions {
    all: Vec<Vec<f64>>,
    /// Whether they are continued from others.
    continue_others: bool,
}

/// The directions that the constraints leave free, continued from those before, if there are any and they can be. None
/// where the constraints depend on each other.
fn directions(jacobian: &[f64], rows: usize, before: &[Vec<f64>]) -> Option<Directions> {
    let n = jacobian.len() / rows;
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for row in 0..rows {
        let own: Vec<f64> = jacobian.iter().skip(row).step_by(rows).copied().collect();
        basis.push(across(&basis, &own, SINGULAR)?);
    }
    let mut continued = basis.clone();
    for direction in before {
        let Some(next) = across(&continued, direction, FOUND_AGAIN) else { break };
        continued.push(next);
    }
    if continued.len() == n {
        return Some(Directions { all: continued.split_off(rows), continue_others: true });
    }
    // Some unit vector has at least this part outside of the directions so far.
    let least = 0.5 / (n as f64).sqrt();
    while basis.len() < n {
        let unit = |at: usize| (0..n).map(|i| f64::from(u8::from(i == at))).collect::<Vec<f64>>();
        let next = (0..n).find_map(|at| across(&basis, &unit(at), least))?;
        basis.push(next);
    }
    Some(Directions { all: basis.split_off(rows), continue_others: false })
}

/// The part of a vector across orthonormal others, of length one; none if it is shorter than `least`.
fn across(others: &[Vec<f64>], vector: &[f64], least: f64) -> Option<Vec<f64>> {
    let mut rest = vector.to_vec();
    for _ in 0..2 {
        for other in others {
            let along: f64 = other.iter().zip(&rest).map(|(a, b)| a * b).sum();
            rest.iter_mut().zip(other).for_each(|(r, o)| *r -= along * o);
        }
    }
    let length = rest.iter().map(|v| v * v).sum::<f64>().sqrt();
    rest.iter_mut().for_each(|v| *v /= length);
    (length > least).then_some(rest)
}

/// Of the square matrix with the constraints as its first rows and the directions as the others.
fn sign_of_determinant(jacobian: &[f64], rows: usize, directions: &[Vec<f64>]) -> f64 {
    let n = jacobian.len() / rows;
    let column =
        |k: usize| jacobian[k * rows..(k + 1) * rows].iter().copied().chain(directions.iter().map(move |d| d[k]));
    linear::sign_of_determinant(n, &(0..n).flat_map(column).collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_of_determinants() {
        // Column-major 2 x 3 with one direction.
        let jacobian = [1.0, 0.0, 0.0, 0.0, 0.0, 2.0];
        assert_eq!(sign_of_determinant(&jacobian, 2, &[vec![0.0, 1.0, 0.0]]), -1.0);
        assert_eq!(sign_of_determinant(&jacobian, 2, &[vec![0.0, -1.0, 0.0]]), 1.0);
        assert_eq!(sign_of_determinant(&jacobian, 2, &[vec![1.0, 0.0, 0.0]]), 0.0);
    }

    #[test]
    fn directions_are_continued() {
        let jacobian = |angle: f64| [angle.cos(), angle.sin()];
        let first = directions(&jacobian(0.3), 1, &[]).expect("one direction");
        assert!(!first.continue_others);
        let next = directions(&jacobian(0.5), 1, &first.all).expect("one direction");
        let alike = first.all[0][0] * next.all[0][0] + first.all[0][1] * next.all[0][1];
        assert!(next.continue_others && (alike - 0.2_f64.cos()).abs() < 1e-12);
        let far = directions(&jacobian(0.3 + 1.5), 1, &first.all).expect("one direction");
        assert!(!far.continue_others, "nearly a quarter turn has nothing in common");
        assert!(directions(&[0.0, 0.0], 1, &[]).is_none());
    }
}
