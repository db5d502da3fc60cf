//! Closed loops as numbers: where a mechanism can stand.

use super::assembly::Constraints;
use super::topology::{Axis, Coordinate, Tree};
use crate::expression::{Graph, Node, Symbol};
use crate::linear::SingularValueDecomposition;
use crate::study::{Start, Study};
use std::collections::HashMap;

/// Loops count as closed below this error (m, rad).
pub(super) const CLOSED: f64 = 1e-9;
/// Cosine of directions that a closed joint makes parallel: one as meant, minus one where the joint is turned over,
/// zero where a joint that cannot turn closes with its axes exchanged.
const UPRIGHT: f64 = 0.5;
/// A step below this leads nowhere.
const SMALLEST_STEP: f64 = 1e-14;
const LARGEST_STEP: f64 = 0.3;
const MOST_STEPS: usize = 100;
/// Steps without a smaller error than the best before them: a dead end.
const PATIENCE: usize = 25;
/// How far the configuration judged is from the start (m and rad): symmetric positions have constraints that depend on
/// each other only there.
const ASIDE: f64 = 0.03;
/// Other positions tried where the start leads nowhere, and how far away they are (rad; m relative to the largest
/// error).
const ATTEMPTS: usize = 40;
const FAR: f64 = 3.0;

/// A loop that is closed further than this from the start (rad; m) may have been meant otherwise.
const NEAR: f64 = 0.5;
/// Stated coordinates that are moved by less (rad; m) stand where they were meant to.
const AS_STATED: f64 = 0.2;
/// Positions whose coordinates differ by more than this (rad; m) are different ways to stand.
const ELSEWHERE: f64 = 0.1;
/// Tries to find another position, and the size of mechanism up to which it is tried.
const TRIES: usize = 8;
const MOST_FREEDOMS: usize = 40;
/// Ways tried from a position, steps along each, and their length (rad; m).
const WAYS: usize = 4;
const STEPS: usize = 150;
const STEP: f64 = 0.1;
/// Steps along prescribed motions, and the longest, s.
const DRIVEN_STEPS: usize = 300;
const LONGEST_STEP: f64 = 0.1;
/// Times at which prescribed motions are compared with the loops, s.
const TIMES: [f64; 3] = [0.0, 0.05, 0.3];
/// Velocities that the loops take up to this share are allowed by them.
const ALLOWED: f64 = 1e-6;

/// A coordinate that could have another value where the loops are closed.
pub(super) struct OtherPosition {
    pub coordinate: Symbol,
    pub is_turn: bool,
    pub chosen: f64,
    pub alternative: f64,
}

/// The constraints as functions of the coordinates.
pub(super) struct Linkage {
    graph: Graph,
    time: Symbol,
    positions: Vec<Node>,
    velocities: Vec<Node>,
    upright: Vec<Node>,
    freedoms: Vec<Freedom>,
    /// Parameters at their start, coordinates where the mechanism stands.
    values: HashMap<Symbol, f64>,
    /// Inputs, whatever they are, grow with time; else they are zero.
    is_driven: bool,
}

/// A rate that is free, and what it changes.
struct Freedom {
    rate: Symbol,
    change: Change,
    is_turn: bool,
    /// A modal coordinate: deformation closes a loop only where rigid motion cannot.
    is_elastic: bool,
}

impl Freedom {
    /// The coordinate, where it is one of its own.
    fn coordinate(&self) -> Option<Symbol> {
        match self.change {
            Change::Coordinate(symbol) => Some(symbol),
            Change::Quaternion(..) => None,
        }
    }
}

#[derive(Clone, Copy)]
enum Change {
    Coordinate(Symbol),
    Quaternion([Symbol; 4], usize),
}

impl Change {
    fn touches(self, given: &HashMap<Symbol, f64>) -> bool {
        match self {
            Change::Coordinate(symbol) => given.contains_key(&symbol),
            Change::Quaternion(symbols, _) => symbols.iter().any(|symbol| given.contains_key(symbol)),
        }
    }
}

impl Linkage {
    pub fn new(graph: &Graph, study: &Study, tree: &Tree, constraints: &Constraints) -> Self {
        let Constraints { positions, velocities, upright, .. } = constraints;
        let (small, nodes) = graph.extract(&[*positions, *velocities, *upright].concat());
        let (positions, rest) = nodes.split_at(positions.len());
        let (velocities, upright) = rest.split_at(velocities.len());
        let mut values: HashMap<Symbol, f64> = study.parameters.iter().map(|p| (p.symbol, p.start)).collect();
        let mut freedoms = Vec::new();
        for link in &tree.links {
            let is_turn = matches!(link.axis, Axis::Turn(_));
            match link.coordinate {
                Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
                    let is_elastic = matches!(link.coordinate, Coordinate::Mode { .. });
                    let change = Change::Coordinate(symbols.position);
                    freedoms.push(Freedom { rate: symbols.velocity, change, is_turn, is_elastic });
                    values.insert(symbols.position, 0.0);
                }
                Coordinate::Rotation { symbols, component, .. } => {
                    let change = Change::Quaternion(symbols.quaternion, component);
                    freedoms.push(Freedom { rate: symbols.velocity[component], change, is_turn, is_elastic: false });
                    symbols.quaternion.iter().enumerate().for_each(|(i, &s)| {
                        values.insert(s, f64::from(u8::from(i == 0)));
                    });
                }
                Coordinate::Prescribed { .. }
                | Coordinate::Turned { .. }
                | Coordinate::Weld
                | Coordinate::Follower { .. } => {}
            }
        }
        let (positions, velocities, upright) = (positions.to_vec(), velocities.to_vec(), upright.to_vec());
        Self { graph: small, time: study.time, positions, velocities, upright, freedoms, values, is_driven: false }
    }

    pub fn freedom(&self) -> usize {
        self.freedoms.len()
    }

    /// How many constraints are those of positions; they come first.
    pub fn of_positions(&self) -> usize {
        self.positions.len()
    }

    /// The positions that a start states, as far as numbers and parameters go.
    pub fn given(&self, study: &Study, start: &Start) -> HashMap<Symbol, f64> {
        let mut given = HashMap::new();
        for &(symbol, node) in &start.overrides {
            let known = |s: Symbol| self.values.get(&s).copied().unwrap_or(0.0);
            let value = study.graph.evaluate(&[node], known, |_, _, _| 0.0)[0];
            let is_position =
                self.freedoms.iter().any(|freedom| freedom.change.touches(&HashMap::from([(symbol, 0.0)])));
            if is_position && value.is_finite() {
                given.insert(symbol, value);
            }
        }
        given
    }

    /// Positions at which the loops are closed: near those given, which stay where that is possible; else from
    /// elsewhere. The residual near the start otherwise. Where they state more than the loops leave free, the first of
    /// them in `order` are kept.
    pub fn assembled(
        &mut self,
        given: &HashMap<Symbol, f64>,
        order: &[Symbol],
    ) -> Result<HashMap<Symbol, f64>, Vec<f64>> {
        let drawn = self.values.clone();
        self.values.extend(given);
        self.normalise();
        let start = self.values.clone();
        let all: Vec<usize> = (0..self.freedoms.len()).collect();
        let without = |kept: &[Symbol]| -> Vec<usize> {
            let kept: HashMap<Symbol, f64> = kept.iter().map(|&symbol| (symbol, 0.0)).collect();
            let moves = |i: &usize| !self.freedoms[*i].is_elastic && !self.freedoms[*i].change.touches(&kept);
            all.iter().copied().filter(moves).collect()
        };
        let unstated = without(order);
        let mut moved: Vec<Vec<usize>> = (0..=order.len()).rev().map(|count| without(&order[..count])).collect();
        moved.push(all.clone());
        moved.dedup();
        let mut outcome = self.close_by(&start, &moved);
        for attempt in 0..ATTEMPTS {
            let Err(residual) = &outcome else { break };
            let reach = residual.iter().fold(0.0_f64, |m, v| m.max(v.abs())).clamp(0.1, 10.0);
            self.values = start.clone();
            self.move_far(&unstated, attempt, reach);
            let from = self.values.clone();
            outcome = self.close_by(&from, &moved).map_err(|_| residual.clone());
        }
        // What is stated leads nowhere, such as a guide started a third of a turn away.
        if let Err(residual) = &outcome
            && !given.is_empty()
        {
            self.values = drawn.clone();
            outcome = self.close(&all).map_err(|_| residual.clone());
        }
        if outcome.is_ok() {
            let nearest = self.nearest_stated(&start, order, (&unstated, &moved));
            self.values = nearest;
        }
        let closed = std::mem::replace(&mut self.values, drawn);
        outcome.map(|()| closed)
    }

    /// Of several ways to close the loops, the present one first, that in which the stated coordinates are nearest to
    /// what is stated.
    fn nearest_stated(
        &mut self,
        start: &HashMap<Symbol, f64>,
        order: &[Symbol],
        (unstated, moved): (&[usize], &[Vec<usize>]),
    ) -> HashMap<Symbol, f64> {
        let value = |values: &HashMap<Symbol, f64>, s: &Symbol| values.get(s).copied().unwrap_or(0.0);
        let apart = |values: &HashMap<Symbol, f64>| {
            order.iter().map(|s| (value(values, s) - value(start, s)).abs()).fold(0.0, f64::max)
        };
        let mut best = self.values.clone();
        for attempt in 0..TRIES {
            if apart(&best) < AS_STATED {
                break;
            }
            self.values = start.clone();
            self.move_far(unstated, attempt * ATTEMPTS / TRIES, 1.0);
            let from = self.values.clone();
            if self.close_by(&from, moved).is_ok() && apart(&self.values) < apart(&best) {
                best = self.values.clone();
            }
        }
        best
    }

    /// Closes the loops from one position by the first of these sets of coordinates that can, each beginning where the
    /// one before came nearest: what is stated too much says the way first. The residual of the last one otherwise.
    fn close_by(&mut self, from: &HashMap<Symbol, f64>, sets: &[Vec<usize>]) -> Result<(), Vec<f64>> {
        let mut outcome = Err(Vec::new());
        self.values = from.clone();
        for (number, moved) in sets.iter().enumerate() {
            outcome = self.close(moved);
            if outcome.is_err() && number > 0 {
                self.values = from.clone();
                outcome = self.close(moved);
            }
            if outcome.is_ok() {
                break;
            }
        }
        outcome
    }

    /// A closed position near another that is not special, and the Jacobian of the constraints there: m x n,
    /// column-major.
    pub fn general_position(&mut self, closed: &HashMap<Symbol, f64>) -> (HashMap<Symbol, f64>, Vec<f64>) {
        let drawn = std::mem::replace(&mut self.values, closed.clone());
        self.move_aside();
        let all: Vec<usize> = (0..self.freedoms.len()).collect();
        if self.close(&all).is_err() {
            self.values = closed.clone();
        }
        let jacobian = self.jacobian();
        (std::mem::replace(&mut self.values, drawn), jacobian)
    }

    /// The Jacobian of the constraints on positions, m x n, column-major.
    pub fn jacobian_at(&mut self, closed: &HashMap<Symbol, f64>) -> Vec<f64> {
        let drawn = std::mem::replace(&mut self.values, closed.clone());
        let jacobian = self.jacobian_of_first(self.of_positions());
        self.values = drawn;
        jacobian
    }

    /// Jacobians of the constraints on positions along the ways that the loops leave free, from a closed position.
    pub fn jacobians_along(&mut self, closed: &HashMap<Symbol, f64>, is_driven: bool) -> Vec<Vec<f64>> {
        let drawn = std::mem::replace(&mut self.values, closed.clone());
        let all: Vec<usize> = (0..self.freedoms.len()).collect();
        let mut found = Vec::new();
        for way in 0..WAYS {
            self.values = closed.clone();
            // The second way leads back from where the first leads to, and so on.
            let sign = if way % 2 == 0 { 1.0 } else { -1.0 };
            let mut heading: Vec<f64> =
                all.iter().map(|&i| sign * (1.0 + 2.4 * (i + (way / 2) * all.len()) as f64).sin()).collect();
            for _ in 0..STEPS {
                let jacobian = self.jacobian_of_first(self.of_positions());
                let is_moving = allowed(&jacobian, &mut heading);
                found.push(jacobian);
                if !is_moving {
                    break;
                }
                let step: Vec<f64> = heading.iter().map(|share| STEP * share).collect();
                self.advance(&all, &step);
                if self.close(&all).is_err() {
                    break;
                }
            }
        }
        if is_driven {
            self.driven(closed, &mut found);
        }
        self.values = drawn;
        found
    }

    /// Another way to close the loops with what is given, where the position chosen is far from the start.
    pub fn other_position(
        &mut self,
        given: &HashMap<Symbol, f64>,
        chosen: &HashMap<Symbol, f64>,
    ) -> Option<OtherPosition> {
        let unstated: Vec<usize> = (0..self.freedoms.len())
            .filter(|&i| !self.freedoms[i].is_elastic && !self.freedoms[i].change.touches(given))
            .collect();
        let stated = |s: &Symbol| given.get(s).or(self.values.get(s)).copied().unwrap_or(0.0);
        // Only where the given values leave no freedom do two positions mean two ways to stand.
        let is_far = unstated.iter().any(|&i| {
            self.freedoms[i]
                .coordinate()
                .is_some_and(|s| (chosen.get(&s).copied().unwrap_or(0.0) - stated(&s)).abs() > NEAR)
        });
        if !is_far || self.freedoms.len() > MOST_FREEDOMS || self.is_free(chosen, &unstated) {
            return None;
        }
        let drawn = self.values.clone();
        let mut found = None;
        for attempt in 0..TRIES {
            self.values = chosen.clone();
            self.move_far(&unstated, attempt * ATTEMPTS / TRIES, 1.0);
            if self.close(&unstated).is_ok() {
                found = self.largest_difference(chosen, &unstated);
            }
            if found.is_some() {
                break;
            }
        }
        self.values = drawn;
        found
    }

    /// Whether the loops leave the coordinates `moved` a motion.
    fn is_free(&mut self, closed: &HashMap<Symbol, f64>, moved: &[usize]) -> bool {
        let (m, general) = (self.of_positions(), self.general_position(closed).0);
        let all = self.jacobian_at(&general);
        let jacobian: Vec<f64> = moved.iter().flat_map(|&i| &all[i * m..(i + 1) * m]).copied().collect();
        SingularValueDecomposition::new(m, moved.len(), &jacobian).map_or(true, |svd| svd.rank(1e-7) < moved.len())
    }

    fn largest_difference(&self, chosen: &HashMap<Symbol, f64>, moved: &[usize]) -> Option<OtherPosition> {
        let difference = |&i: &usize| {
            let freedom = &self.freedoms[i];
            let coordinate = freedom.coordinate()?;
            let [chosen, found] = [chosen, &self.values].map(|values| values.get(&coordinate).copied().unwrap_or(0.0));
            let turn = std::f64::consts::TAU;
            let change = found - chosen;
            let change = if freedom.is_turn { change - turn * (change / turn).round() } else { change };
            let mut alternative = chosen + change;
            if freedom.is_turn {
                alternative -= turn * (alternative / turn).round();
            }
            let other = OtherPosition { coordinate, is_turn: freedom.is_turn, chosen, alternative };
            (change.abs() > ELSEWHERE).then_some((change.abs(), other))
        };
        moved.iter().filter_map(difference).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, other)| other)
    }

    /// A row that is not kept and that prescribed motions violate, although all rows kept allow them.
    pub fn contradicted(&mut self, closed: &HashMap<Symbol, f64>, kept: &[usize]) -> Option<usize> {
        let drawn = std::mem::replace(&mut self.values, closed.clone());
        let all: Vec<usize> = (0..self.freedoms.len()).collect();
        let mut found = None;
        for time in TIMES {
            self.values = closed.clone();
            self.values.insert(self.time, time);
            if time > 0.0 && self.close(&all).is_err() {
                continue;
            }
            // Inputs, whatever they are, change at some rate.
            let value = |s: Symbol| {
                let is_rate = self.freedoms.iter().any(|freedom| freedom.rate == s);
                if is_rate { 0.0 } else { self.values.get(&s).copied().unwrap_or(0.0) }
            };
            let driven = self.graph.evaluate(&self.velocities, value, |_, order, _| if order == 1 { 1.0 } else { 0.0 });
            let step = self.shortest_step(&driven, &all).unwrap_or_else(|| vec![0.0; all.len()]);
            let (m, jacobian) = (driven.len(), self.jacobian());
            let rest = |row: usize| {
                let taken: f64 = step.iter().enumerate().map(|(i, s)| jacobian[i * m + row] * s).sum();
                (driven[row] + taken).abs()
            };
            let size = driven.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
            found = (0..m).filter(|row| !kept.contains(row)).find(|&row| rest(row) > ALLOWED * size);
            if found.is_some() {
                break;
            }
        }
        self.values = drawn;
        found
    }

    fn evaluate(&self, nodes: &[Node]) -> Vec<f64> {
        self.graph.evaluate(nodes, |s| self.values.get(&s).copied().unwrap_or(0.0), self.input())
    }

    fn input(&self) -> impl Fn(u32, u8, f64) -> f64 {
        let slope = if self.is_driven { 1.0 } else { 0.0 };
        move |_, order, t| match order {
            0 => slope * t,
            1 => slope,
            _ => 0.0,
        }
    }

    /// Jacobians of the constraints on positions through which prescribed motions lead from a closed position.
    fn driven(&mut self, closed: &HashMap<Symbol, f64>, found: &mut Vec<Vec<f64>>) {
        self.values = closed.clone();
        self.is_driven = true;
        let all: Vec<usize> = (0..self.freedoms.len()).collect();
        let rates: Vec<Symbol> = self.freedoms.iter().map(|freedom| freedom.rate).collect();
        let mut time = 0.0;
        for _ in 0..DRIVEN_STEPS {
            let value = |s: Symbol| if rates.contains(&s) { 0.0 } else { self.values.get(&s).copied().unwrap_or(0.0) };
            let driven = self.graph.evaluate(&self.velocities, value, self.input());
            let speed = driven.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
            time += (STEP / speed).min(LONGEST_STEP);
            self.values.insert(self.time, time);
            if self.close(&all).is_err() {
                break;
            }
            found.push(self.jacobian_of_first(self.of_positions()));
        }
        self.is_driven = false;
    }

    /// dg/dt per rate: m x n, column-major.
    fn jacobian(&self) -> Vec<f64> {
        self.jacobian_of_first(self.velocities.len())
    }

    /// Of so many constraints.
    fn jacobian_of_first(&self, count: usize) -> Vec<f64> {
        let at = |moving: Option<Symbol>| {
            let value = |s: Symbol| if Some(s) == moving { 1.0 } else { self.values.get(&s).copied().unwrap_or(0.0) };
            self.graph.evaluate(&self.velocities[..count], value, self.input())
        };
        let resting = at(None);
        let column = |rate: Symbol| at(Some(rate)).into_iter().zip(&resting).map(|(v, r)| v - r).collect::<Vec<_>>();
        self.freedoms.iter().flat_map(|freedom| column(freedom.rate)).collect()
    }

    fn advance(&mut self, moved: &[usize], step: &[f64]) {
        for (&which, &amount) in moved.iter().zip(step) {
            match self.freedoms[which].change {
                Change::Coordinate(symbol) => *self.values.entry(symbol).or_insert(0.0) += amount,
                Change::Quaternion(symbols, component) => {
                    let q = symbols.map(|s| self.values.get(&s).copied().unwrap_or(0.0));
                    let (cosine, sine) = ((0.5 * amount).cos(), (0.5 * amount).sin());
                    let [w, x, y, z] = q;
                    // q (cosine, sine e_component)
                    let change = match component {
                        0 => [-x, w, z, -y],
                        1 => [-y, -z, w, x],
                        _ => [-z, y, -x, w],
                    };
                    let turned = (0..4).map(|i| cosine * q[i] + sine * change[i]);
                    symbols.iter().zip(turned).for_each(|(&s, v)| {
                        self.values.insert(s, v);
                    });
                }
            }
        }
        self.normalise();
    }

    /// Quaternions of length one.
    fn normalise(&mut self) {
        for freedom in &self.freedoms {
            let Change::Quaternion(symbols, 0) = freedom.change else { continue };
            let q = symbols.map(|s| self.values.get(&s).copied().unwrap_or(0.0));
            let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
            let q = if norm > 0.0 { q.map(|v| v / norm) } else { [1.0, 0.0, 0.0, 0.0] };
            symbols.iter().zip(q).for_each(|(&s, v)| {
                self.values.insert(s, v);
            });
        }
    }

    /// A fixed pattern of small motions, different for every coordinate.
    fn move_aside(&mut self) {
        let all: Vec<usize> = (0..self.freedoms.len()).collect();
        let step: Vec<f64> = all.iter().map(|&i| ASIDE * (1.0 + (i as f64 * 2.4).sin()) / 2.0).collect();
        self.advance(&all, &step);
    }

    /// A fixed sequence of large motions, growing with the attempts; `reach` is typical of the lengths.
    fn move_far(&mut self, moved: &[usize], attempt: usize, reach: f64) {
        let share = FAR * (attempt + 1) as f64 / ATTEMPTS as f64;
        let amount = |i: usize| {
            // Multiples of irrational numbers fill the interval evenly.
            let place = ((attempt + 1) as f64 * 0.618_033_988_75
                + (i + 1) as f64 * 0.414_213_562_37 * (attempt + 1) as f64)
                .fract();
            let size = if self.freedoms[i].is_turn { 1.0 } else { reach };
            share * size * (2.0 * place - 1.0)
        };
        let step: Vec<f64> = moved.iter().map(|&i| amount(i)).collect();
        self.advance(moved, &step);
    }

    /// Newton's method with the shortest steps (Gauss-Newton) of the coordinates `moved`. The residual where it got
    /// stuck, or ends in a joint that is turned over.
    fn close(&mut self, moved: &[usize]) -> Result<(), Vec<f64>> {
        let largest = |values: &[f64]| {
            values.iter().fold(0.0_f64, |m, v| if v.is_nan() { f64::INFINITY } else { m.max(v.abs()) })
        };
        let mut residual = self.evaluate(&self.positions);
        let (mut best, mut since) = (f64::INFINITY, 0);
        for _ in 0..MOST_STEPS {
            let error = largest(&residual);
            if error < CLOSED {
                break;
            }
            since = if error < 0.9 * best { 0 } else { since + 1 };
            best = best.min(error);
            if since > PATIENCE {
                break;
            }
            let Some(mut step) = self.shortest_step(&residual, moved) else { break };
            let size = largest(&step);
            if size > LARGEST_STEP {
                step.iter_mut().for_each(|s| *s *= LARGEST_STEP / size);
            }
            if size < SMALLEST_STEP {
                break;
            }
            self.advance(moved, &step);
            residual = self.evaluate(&self.positions);
        }
        let is_upright = || self.evaluate(&self.upright).iter().all(|cosine| *cosine > UPRIGHT);
        if largest(&residual) < CLOSED && is_upright() { Ok(()) } else { Err(residual) }
    }

    /// Of the first constraints, as many as there are residuals.
    fn shortest_step(&self, residual: &[f64], moved: &[usize]) -> Option<Vec<f64>> {
        let (m, n) = (residual.len(), moved.len());
        let all = self.jacobian_of_first(m);
        let jacobian: Vec<f64> = moved.iter().flat_map(|&i| &all[i * m..(i + 1) * m]).copied().collect();
        if jacobian.is_empty() {
            return None;
        }
        let svd = SingularValueDecomposition::new(m, n, &jacobian).ok()?;
        let mut step = vec![0.0; n];
        for j in 0..svd.rank(1e-9) {
            let along: f64 = svd.left(j).iter().zip(residual).map(|(u, r)| u * r).sum();
            let factor = -along / svd.singular_values[j];
            step.iter_mut().zip(svd.right(j)).for_each(|(s, v)| *s += factor * v);
        }
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}

/// Reduces a heading to the part that the constraints allow, its largest component one; whether there is any.
fn allowed(jacobian: &[f64], heading: &mut [f64]) -> bool {
    let (n, m) = (heading.len(), jacobian.len() / heading.len().max(1));
    let Ok(svd) = SingularValueDecomposition::new(m, n, jacobian) else { return false };
    for j in 0..svd.rank(1e-7) {
        let along: f64 = svd.right(j).iter().zip(heading.iter()).map(|(a, b)| a * b).sum();
        heading.iter_mut().zip(svd.right(j)).for_each(|(h, v)| *h -= along * v);
    }
    let largest = heading.iter().fold(0.0_f64, |m, h| m.max(h.abs()));
    if largest < 1e-6 {
        return false;
    }
    heading.iter_mut().for_each(|h| *h /= largest);
    true
}
