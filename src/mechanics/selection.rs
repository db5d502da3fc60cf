//! Which constraints count where.
//!
//! A loop that holds more than it needs (Bennett's and Bricard's linkages) has constraints that are independent of each
//! other in some positions and not in others, although as many as ever are independent everywhere. Then several sets of
//! them take turns: all hold the same, so that changing over moves nothing, and only the multipliers are others.

use crate::expression::{Binary, Graph, Node, Symbol};

/// A set is left where its volume is below this share of the best set's.
const POOR: f64 = 0.3;
/// Volumes below this share of the largest are those of positions in which the mechanism itself is singular.
const SINGULAR: f64 = 1e-6;
/// Sets at most, and rows of a set at most: the volume is part of the equations.
const MOST_SETS: usize = 8;
const MOST_ROWS: usize = 10;

/// Rows that are connected by coordinates, and the sets of them that take turns.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Every set has as many rows as the others; a row stands at the same place in all sets it belongs to. The first is
    /// the best at a general position.
    pub sets: Vec<Vec<usize>>,
    /// Per start of the study the best set there.
    pub at_starts: Vec<usize>,
    /// What divides a row, so that shifts and turns compare.
    pub sizes: Vec<f64>,
}

/// Jacobian, column-major: `rows` x any.
pub(super) struct Jacobian<'a> {
    pub rows: usize,
    pub values: &'a [f64],
}

impl Jacobian<'_> {
    fn row(&self, i: usize) -> Vec<f64> {
        self.values.iter().skip(i).step_by(self.rows).copied().collect()
    }
}

/// Groups with more than one set. `kept` are the rows independent at a general position, `along` the Jacobians in
/// positions that the mechanism can reach, `starts` those at the starts.
pub(super) fn groups(kept: &[usize], along: &[Jacobian], starts: &[Jacobian]) -> Vec<Group> {
    let Some(first) = along.first() else { return vec![] };
    let sizes: Vec<f64> = (0..first.rows)
        .map(|i| along.iter().map(|jacobian| norm(&jacobian.row(i))).fold(0.0, f64::max))
        .map(|size| if size > 0.0 { size } else { 1.0 })
        .collect();
    components(along).into_iter().filter_map(|rows| group(&rows, kept, along, starts, &sizes)).collect()
}

/// Sets of rows that share columns.
fn components(along: &[Jacobian]) -> Vec<Vec<usize>> {
    let m = along[0].rows;
    let touches = |i: usize, j: usize| along.iter().any(|jacobian| jacobian.values[j * m + i].abs() > 1e-12);
    let n = along[0].values.len() / m;
    let columns: Vec<Vec<usize>> = (0..m).map(|i| (0..n).filter(|&j| touches(i, j)).collect()).collect();
    let mut label: Vec<usize> = (0..m).collect();
    for i in 0..m {
        for j in 0..i {
            if label[i] != label[j] && columns[i].iter().any(|column| columns[j].contains(column)) {
                let (from, to) = (label[i].max(label[j]), label[i].min(label[j]));
                label.iter_mut().filter(|own| **own == from).for_each(|own| *own = to);
            }
        }
    }
    (0..m)
        .map(|first| (0..m).filter(|&i| label[i] == first).collect::<Vec<_>>())
        .filter(|rows| !rows.is_empty())
        .collect()
}

fn group(rows: &[usize], kept: &[usize], along: &[Jacobian], starts: &[Jacobian], sizes: &[f64]) -> Option<Group> {
    let first: Vec<usize> = rows.iter().copied().filter(|i| kept.contains(i)).collect();
    if first.len() == rows.len() || first.is_empty() || first.len() > MOST_ROWS {
        return None;
    }
    let volume =
        |set: &[usize], jacobian: &Jacobian| -> f64 { orthogonalised(jacobian, set, sizes).into_iter().product() };
    let best = |jacobian: &Jacobian| pivoted(jacobian, rows, first.len(), sizes);
    let largest = along.iter().map(|jacobian| volume(&best(jacobian), jacobian)).fold(0.0, f64::max);
    let mut sets = vec![first.clone()];
    for jacobian in along {
        let other = best(jacobian);
        let wanted = volume(&other, jacobian);
        let reached = sets.iter().map(|set| volume(set, jacobian)).fold(0.0, f64::max);
        if wanted > SINGULAR * largest && reached < POOR * wanted && sets.len() < MOST_SETS {
            sets.push(aligned(&first, &other));
        }
    }
    if sets.len() == 1 {
        return None;
    }
    let at_starts = starts.iter().map(|jacobian| {
        let volumes = sets.iter().map(|set| volume(set, jacobian));
        volumes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(at, _)| at)
    });
    let at_starts = at_starts.collect();
    Some(Group { sets, at_starts, sizes: sizes.to_vec() })
}

/// `set` with every row that `first` has, too, at its place there.
fn aligned(first: &[usize], set: &[usize]) -> Vec<usize> {
    let mut others = set.iter().copied().filter(|row| !first.contains(row));
    let place = |&row: &usize| if set.contains(&row) { Some(row) } else { others.next() };
    first.iter().filter_map(place).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn scaled(jacobian: &Jacobian, row: usize, sizes: &[f64]) -> Vec<f64> {
    jacobian.row(row).into_iter().map(|value| value / sizes[row]).collect()
}

fn remove(rest: &mut [f64], direction: &[f64]) {
    for _ in 0..2 {
        let along: f64 = direction.iter().zip(rest.iter()).map(|(a, b)| a * b).sum();
        rest.iter_mut().zip(direction).for_each(|(r, d)| *r -= along * d);
    }
}

/// Per row the length of its part across the rows before.
fn orthogonalised(jacobian: &Jacobian, set: &[usize], sizes: &[f64]) -> Vec<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut lengths = Vec::new();
    for &row in set {
        let mut rest = scaled(jacobian, row, sizes);
        basis.iter().for_each(|direction| remove(&mut rest, direction));
        let length = norm(&rest);
        lengths.push(length);
        if length > 0.0 {
            rest.iter_mut().for_each(|value| *value /= length);
            basis.push(rest);
        }
    }
    lengths
}

/// `count` rows, one after the other that with the longest part across those chosen.
fn pivoted(jacobian: &Jacobian, rows: &[usize], count: usize, sizes: &[f64]) -> Vec<usize> {
    let mut rests: Vec<(usize, Vec<f64>)> = rows.iter().map(|&row| (row, scaled(jacobian, row, sizes))).collect();
    let mut chosen = Vec::new();
    for _ in 0..count {
        let Some(at) = (0..rests.len()).max_by(|&a, &b| norm(&rests[a].1).total_cmp(&norm(&rests[b].1))) else { break };
        let (row, mut direction) = rests.swap_remove(at);
        let length = norm(&direction).max(f64::MIN_POSITIVE);
        direction.iter_mut().for_each(|value| *value /= length);
        rests.iter_mut().for_each(|(_, rest)| remove(rest, &direction));
        chosen.push(row);
    }
    chosen.sort_unstable();
    chosen
}

/// The state that says which set of a group is in force, and when that changes.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    pub symbol: Symbol,
    pub at_starts: Vec<usize>,
    /// Rises through zero where another set is to be taken.
    pub condition: Node,
    pub change: Node,
}

/// 1 where the choice is this set.
pub(super) fn is_in_force(graph: &mut Graph, choice: Symbol, set: usize) -> Node {
    let choice = graph.variable(choice);
    let [low, high] = [set as f64 - 0.5, set as f64 + 0.5].map(|bound| graph.constant(bound));
    let [above, below] = [graph.binary(Binary::Less, low, choice), graph.binary(Binary::Less, choice, high)];
    graph.multiply(above, below)
}

impl Group {
    /// When another set is to be taken, and which: by the squared volumes of the sets' rows, whose rates are `rates`.
    pub fn choice(&self, graph: &mut Graph, symbol: Symbol, rates: &[Node], velocities: &[Symbol]) -> Choice {
        let volumes: Vec<Node> = self
            .sets
            .iter()
            .map(|set| {
                let rows = set.iter().map(|&row| {
                    let size = graph.constant(1.0 / self.sizes[row]);
                    let lever = |graph: &mut Graph, velocity: Symbol| {
                        let own = graph.differentiate(&[rates[row]], velocity)[0];
                        graph.multiply(size, own)
                    };
                    velocities.iter().map(|&velocity| lever(graph, velocity)).collect()
                });
                let rows: Vec<Vec<Node>> = rows.collect();
                let product = |graph: &mut Graph, a: &[Node], b: &[Node]| super::events::sum_of_products(graph, a, b);
                let gram: Vec<Vec<Node>> =
                    rows.iter().map(|a| rows.iter().map(|b| product(graph, a, b)).collect()).collect();
                determinant(graph, &gram)
            })
            .collect();
        let (mut best, mut largest) = (graph.constant(0.0), volumes[0]);
        for (number, &volume) in volumes.iter().enumerate().skip(1) {
            let is_larger = graph.binary(Binary::Less, largest, volume);
            let own = graph.constant(number as f64);
            best = graph.select(is_larger, own, best);
            largest = graph.binary(Binary::Maximum, largest, volume);
        }
        let mut current = volumes[0];
        for (number, &volume) in volumes.iter().enumerate().skip(1) {
            let is_own = is_in_force(graph, symbol, number);
            current = graph.select(is_own, volume, current);
        }
        let share = graph.constant(POOR * POOR);
        let reached = graph.divide(current, largest);
        let condition = graph.subtract(share, reached);
        Choice { symbol, at_starts: self.at_starts.clone(), condition, change: best }
    }
}

/// By the characteristic polynomial (Faddeev and LeVerrier): without division by pivots, which may vanish.
fn determinant(graph: &mut Graph, matrix: &[Vec<Node>]) -> Node {
    let n = matrix.len();
    let zero = graph.constant(0.0);
    let mut power: Vec<Vec<Node>> = matrix.to_vec();
    let mut coefficient = zero;
    for k in 1..=n {
        if k > 1 {
            for (i, row) in power.iter_mut().enumerate() {
                row[i] = graph.add(row[i], coefficient);
            }
            let before = std::mem::take(&mut power);
            power = (0..n)
                .map(|i| {
                    (0..n)
                        .map(|j| {
                            let column: Vec<Node> = before.iter().map(|row| row[j]).collect();
                            super::events::sum_of_products(graph, &matrix[i], &column)
                        })
                        .collect()
                })
                .collect();
        }
        let mut trace = zero;
        for (i, row) in power.iter().enumerate() {
            trace = graph.add(trace, row[i]);
        }
        let factor = graph.constant(-1.0 / k as f64);
        coefficient = graph.multiply(factor, trace);
    }
    if n % 2 == 1 { graph.negate(coefficient) } else { coefficient }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn determinants_of_small_matrices() {
        let mut graph = Graph::new();
        for (entries, expected) in [
            (vec![vec![3.0]], 3.0),
            (vec![vec![0.0, 2.0], vec![5.0, 1.0]], -10.0),
            (vec![vec![2.0, -1.0, 0.0], vec![1.0, 3.0, 2.0], vec![0.0, 5.0, -4.0]], -48.0),
        ] {
            let matrix: Vec<Vec<Node>> =
                entries.iter().map(|row| row.iter().map(|&value| graph.constant(value)).collect()).collect();
            let node = determinant(&mut graph, &matrix);
            let value = graph.evaluate(&[node], |_| 0.0, |_, _, _| 0.0)[0];
            assert!((value - expected).abs() < 1e-12, "{value} instead of {expected}");
        }
    }

    /// Three rows of two unknowns, of which the first vanishes in a position where the second, else parallel to it,
    /// does not; the third row shares an unknown with them or is a component of its own, of which no row can be spared.
    #[test]
    fn a_row_that_vanishes_is_replaced() {
        fn jacobian(values: &[f64]) -> Jacobian<'_> {
            Jacobian { rows: 3, values }
        }
        let sets = |shared: f64| {
            let [usual, special] = [1.0, 0.0].map(|first| [first, 1.0, shared, 0.0, 0.0, 3.0]);
            let found = groups(&[0, 2], &[jacobian(&usual), jacobian(&special)], &[jacobian(&special)]);
            let [group] = found.as_slice() else { panic!("{found:?}") };
            (group.sets.clone(), group.at_starts.clone())
        };
        assert_eq!(sets(2.0), (vec![vec![0, 2], vec![1, 2]], vec![1]));
        assert_eq!(sets(0.0), (vec![vec![0], vec![1]], vec![1]));
    }
}
