//! Which equations of a semi-explicit system are constraints on the differential components, and which algebraic
//! components are their multipliers: found from the entries of the Jacobian, so that a model need not declare it.

use super::problem::Dynamics;

/// Shift, in typical magnitudes, to a second point: entries that vanish at the first one by chance show there.
const SHIFT: f64 = 0.0137;
/// Rounding of a factor that is one.
const UNIT: f64 = 1e-9;

/// In a Hessenberg system of index 2 (`x' = f(t, x, w)`, `0 = c(t, x)`) the rows `c` and the components `w`; both empty
/// in systems of index 0 and 1 (Brenan-Campbell-Petzold-1996, 2.2).
#[derive(Clone, Debug, Default)]
pub(super) struct Structure {
    /// Rows that hold neither derivatives nor algebraic components, length n.
    pub is_constraint: Vec<bool>,
    /// Those rows, ascending.
    pub constraints: Vec<usize>,
    /// Algebraic components that the algebraic equations alone do not determine, length n: multipliers, and what is
    /// defined by them (a reaction that a friction depends on).
    pub is_multiplier: Vec<bool>,
    /// Some combinations of differential components are in fact algebraic: constraints tie them together, or
    /// derivatives stand in rows of other components.
    pub has_hidden_algebraic: bool,
    /// Every derivative stands with factor one in the row of its own component, and nowhere else.
    pub has_unit_mass: bool,
}

impl Structure {
    pub fn new(dynamics: &mut dyn Dynamics, t: f64, y: &[f64], y_prime: &[f64]) -> Self {
        let n = y.len();
        let mut structure = Self { is_constraint: vec![false; n], is_multiplier: vec![false; n], ..Self::default() };
        let differential = dynamics.differential().to_vec();
        if differential.iter().all(|d| *d) && dynamics.explicit_rates(t, y, &mut vec![0.0; n]) {
            return structure;
        }
        let Entries { by_y, by_derivative } = entries(dynamics, t, y, y_prime);
        let is_unit = |&(row, column, value): &(usize, usize, f64)| row == column && (value - 1.0).abs() < UNIT;
        structure.has_unit_mass = by_derivative.iter().all(is_unit);
        structure.has_hidden_algebraic = by_derivative.iter().any(|(row, column, _)| row != column);
        if differential.iter().all(|d| *d) {
            return structure;
        }
        let mut has_derivative = vec![false; n];
        by_derivative.iter().for_each(|&(row, ..)| has_derivative[row] = true);
        let mut has_algebraic = vec![false; n];
        let mut tied = Vec::new();
        for &(row, column) in by_y.iter().filter(|(_, column)| !differential[*column]) {
            has_algebraic[row] = true;
            if !has_derivative[row] {
                tied.push((row, column));
            }
        }
        structure.is_constraint = (0..n).map(|row| !has_derivative[row] && !has_algebraic[row]).collect();
        structure.constraints = (0..n).filter(|&row| structure.is_constraint[row]).collect();
        if !structure.constraints.is_empty() {
            structure.has_hidden_algebraic = true;
            structure.is_multiplier = multipliers(&differential, &tied);
        }
        structure
    }

    pub fn has_constraints(&self) -> bool {
        !self.constraints.is_empty()
    }
}

/// Algebraic components are multipliers unless the algebraic equations that tie them together are as many as they.
/// `tied`: equation and component.
fn multipliers(differential: &[bool], tied: &[(usize, usize)]) -> Vec<bool> {
    let n = differential.len();
    // Components first, then equations.
    let mut group: Vec<usize> = (0..2 * n).collect();
    for &(row, column) in tied {
        let (a, b) = (find(&mut group, n + row), find(&mut group, column));
        group[a] = b;
    }
    let mut missing = vec![0_isize; 2 * n];
    for i in (0..n).filter(|&i| !differential[i]) {
        missing[find(&mut group, i)] += 1;
    }
    let mut equations: Vec<usize> = tied.iter().map(|&(row, _)| row).collect();
    equations.sort_unstable();
    equations.dedup();
    for row in equations {
        missing[find(&mut group, n + row)] -= 1;
    }
    (0..n).map(|i| !differential[i] && missing[find(&mut group, i)] > 0).collect()
}

/// Representative of the group of `i`.
pub(super) fn find(group: &mut [usize], mut i: usize) -> usize {
    while group[i] != i {
        group[i] = group[group[i]];
        i = group[i];
    }
    i
}

/// Places of the entries of dF/dy and of dF/dy' (with their values) that differ from zero at or near a point.
pub(super) struct Entries {
    pub by_y: Vec<(usize, usize)>,
    by_derivative: Vec<(usize, usize, f64)>,
}

pub(super) fn entries(dynamics: &mut dyn Dynamics, t: f64, y: &[f64], y_prime: &[f64]) -> Entries {
    let shifted: Vec<f64> = y
        .iter()
        .zip(dynamics.scale())
        .enumerate()
        .map(|(i, (y, scale))| y + SHIFT * scale * (1.0 + (i % 7) as f64 / 7.0))
        .collect();
    let places: Vec<(usize, usize)> = dynamics.pattern().entries().collect();
    let (mut by_y, mut by_derivative) = (Vec::new(), Vec::new());
    let (mut values, mut both) = (vec![0.0; places.len()], vec![0.0; places.len()]);
    for point in [y, &shifted] {
        dynamics.jacobian(t, point, y_prime, 0.0, &mut values);
        // Large against dF/dy, so that no entry is lost in rounding.
        let c = values.iter().filter(|v| v.is_finite()).fold(1.0f64, |a, v| a.max(v.abs()));
        dynamics.jacobian(t, point, y_prime, c, &mut both);
        by_y.extend(places.iter().zip(&values).filter(|(_, v)| **v != 0.0).map(|(place, _)| *place));
        let differing = places.iter().zip(values.iter().zip(&both)).filter(|(_, (a, b))| a != b);
        by_derivative.extend(differing.map(|(&(row, column), (a, b))| (row, column, (b - a) / c)));
    }
    Entries { by_y, by_derivative }
}
