//! Can the loops be closed, and which of their constraints say something new? Answered at one configuration near the start.

use super::loops::{Direction, Row};
use super::topology::{Coordinate, Tree};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node, Symbol};
use crate::linear::SingularValueDecomposition;
use crate::study::{JointKind, Study};
use std::collections::HashMap;

/// What was found out about the constraints.
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    /// Rows that are independent of those before them.
    pub kept: Vec<usize>,
    pub warnings: Vec<Diagnostic>,
}

/// A row whose part independent of the rows before is smaller than this, relative to the row, is redundant.
const INDEPENDENT: f64 = 1e-7;
/// Loops count as closed below this error (m, rad).
const CLOSED: f64 = 1e-9;
const LARGEST_STEP: f64 = 0.3;
const MOST_STEPS: usize = 200;
/// How far the configuration judged is from the start (m and rad): symmetric positions have constraints that depend on each
/// other only there.
const ASIDE: f64 = 0.03;

/// # Errors
/// Loops that cannot be closed near the start; mechanisms that cannot move.
pub(super) fn assemble_loops(
    graph: &Graph,
    study: &Study,
    tree: &Tree,
    rows: &[Row],
    (positions, velocities): (&[Node], &[Node]),
) -> Result<Assembly, Vec<Diagnostic>> {
    if rows.is_empty() {
        return Ok(Assembly { kept: vec![], warnings: vec![] });
    }
    let mut mechanism = Mechanism::new(graph, study, tree, positions, velocities);
    let start = mechanism.values.clone();
    mechanism.move_aside();
    if mechanism.close().is_err() {
        mechanism.values = start;
        mechanism.close().map_err(|residual| vec![not_closed(study, rows, &residual)])?;
    }
    let jacobian = mechanism.jacobian();
    let kept = independent_rows(&jacobian, rows);
    let freedom = mechanism.rates.len() - kept.len();
    let is_driven = tree.links.iter().any(|link| matches!(link.coordinate, Coordinate::Prescribed { .. }));
    if freedom == 0 && !is_driven {
        return Err(vec![cannot_move(study, rows)]);
    }
    Ok(Assembly { warnings: redundancies(study, rows, &kept), kept })
}

/// The constraints as functions of the coordinates.
struct Mechanism {
    graph: Graph,
    positions: Vec<Node>,
    velocities: Vec<Node>,
    /// Symbols of the free rates, in order of the links.
    rates: Vec<Symbol>,
    /// Per free rate what it changes.
    changes: Vec<Change>,
    values: HashMap<Symbol, f64>,
}

enum Change {
    Coordinate(Symbol),
    Quaternion([Symbol; 4], usize),
}

impl Mechanism {
    fn new(graph: &Graph, study: &Study, tree: &Tree, positions: &[Node], velocities: &[Node]) -> Self {
        let (small, nodes) = graph.extract(&[positions, velocities].concat());
        let (positions, velocities) = nodes.split_at(positions.len());
        let mut values: HashMap<Symbol, f64> = study.parameters.iter().map(|p| (p.symbol, p.start)).collect();
        let (mut rates, mut changes) = (Vec::new(), Vec::new());
        for link in &tree.links {
            match link.coordinate {
                Coordinate::Free { symbols, .. } => {
                    rates.push(symbols.velocity);
                    changes.push(Change::Coordinate(symbols.position));
                    values.insert(symbols.position, 0.0);
                }
                Coordinate::Rotation { symbols, component } => {
                    rates.push(symbols.velocity[component]);
                    changes.push(Change::Quaternion(symbols.quaternion, component));
                    symbols.quaternion.iter().enumerate().for_each(|(i, &s)| {
                        values.insert(s, f64::from(u8::from(i == 0)));
                    });
                }
                Coordinate::Prescribed { .. } | Coordinate::Weld => {}
            }
        }
        // The first experiment says how the mechanism stands, as far as numbers and parameters go.
        if let Some(experiment) = study.experiments.first() {
            let known = values.clone();
            for &(symbol, node) in &experiment.start.overrides {
                let value = study.graph.evaluate(&[node], |s| known.get(&s).copied().unwrap_or(0.0), |_, _, _| 0.0)[0];
                if values.contains_key(&symbol) && value.is_finite() {
                    values.insert(symbol, value);
                }
            }
        }
        Self { positions: positions.to_vec(), velocities: velocities.to_vec(), graph: small, rates, changes, values }
    }

    fn residual(&self) -> Vec<f64> {
        self.graph.evaluate(&self.positions, |s| self.values.get(&s).copied().unwrap_or(0.0), |_, _, _| 0.0)
    }

    /// dg/dt per rate: m x n, column-major.
    fn jacobian(&self) -> Vec<f64> {
        let at = |moving: Option<Symbol>| {
            let value = |s: Symbol| {
                if Some(s) == moving { 1.0 } else { self.values.get(&s).copied().unwrap_or(0.0) }
            };
            self.graph.evaluate(&self.velocities, value, |_, _, _| 0.0)
        };
        let resting = at(None);
        self.rates
            .iter()
            .flat_map(|&rate| at(Some(rate)).into_iter().zip(&resting).map(|(v, r)| v - r).collect::<Vec<_>>())
            .collect()
    }

    fn advance(&mut self, step: &[f64]) {
        for (change, &amount) in self.changes.iter().zip(step) {
            match change {
                Change::Coordinate(symbol) => *self.values.entry(*symbol).or_insert(0.0) += amount,
                Change::Quaternion(symbols, component) => {
                    let q = symbols.map(|s| self.values.get(&s).copied().unwrap_or(0.0));
                    let half = 0.5 * amount;
                    let [w, x, y, z] = q;
                    // q + q (0, half e_component)
                    let change = match component {
                        0 => [-x, w, z, -y],
                        1 => [-y, -z, w, x],
                        _ => [-z, y, -x, w],
                    };
                    let moved: [f64; 4] = std::array::from_fn(|i| q[i] + half * change[i]);
                    let norm = moved.iter().map(|v| v * v).sum::<f64>().sqrt();
                    symbols.iter().zip(moved).for_each(|(&s, v)| {
                        self.values.insert(s, v / norm);
                    });
                }
            }
        }
    }

    /// A fixed pattern of small motions, different for every coordinate.
    fn move_aside(&mut self) {
        let step: Vec<f64> = (0..self.rates.len()).map(|i| ASIDE * (1.0 + (i as f64 * 2.4).sin()) / 2.0).collect();
        self.advance(&step);
    }

    /// Newton's method with the shortest steps (Gauss-Newton). The residual where it got stuck otherwise.
    fn close(&mut self) -> Result<(), Vec<f64>> {
        let largest = |values: &[f64]| {
            values.iter().fold(0.0_f64, |m, v| if v.is_nan() { f64::INFINITY } else { m.max(v.abs()) })
        };
        let mut residual = self.residual();
        for _ in 0..MOST_STEPS {
            if largest(&residual) < CLOSED {
                return Ok(());
            }
            let Some(mut step) = self.shortest_step(&residual) else { break };
            let size = largest(&step);
            if size > LARGEST_STEP {
                step.iter_mut().for_each(|s| *s *= LARGEST_STEP / size);
            }
            if size < 1e-14 {
                break;
            }
            self.advance(&step);
            residual = self.residual();
        }
        if largest(&residual) < CLOSED { Ok(()) } else { Err(residual) }
    }

    fn shortest_step(&self, residual: &[f64]) -> Option<Vec<f64>> {
        let (m, n) = (residual.len(), self.rates.len());
        let svd = SingularValueDecomposition::new(m, n, &self.jacobian()).ok()?;
        let mut step = vec![0.0; n];
        for j in 0..svd.rank(1e-9) {
            let along: f64 = svd.left(j).iter().zip(residual).map(|(u, r)| u * r).sum();
            let factor = -along / svd.singular_values[j];
            step.iter_mut().zip(svd.right(j)).for_each(|(s, v)| *s += factor * v);
        }
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}

/// Gram-Schmidt over the rows, shifts before turns: a mechanism loses turning constraints first.
fn independent_rows(jacobian: &[f64], rows: &[Row]) -> Vec<usize> {
    let (m, n) = (rows.len(), jacobian.len() / rows.len().max(1));
    let row = |i: usize| -> Vec<f64> { (0..n).map(|j| jacobian[j * m + i]).collect() };
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by_key(|&i| matches!(rows[i].direction, Direction::Turn(_)));
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut kept = Vec::new();
    let typical = (0..m).map(|i| norm(&row(i))).fold(0.0, f64::max);
    for i in order {
        let mut rest = row(i);
        let size = norm(&rest);
        for _ in 0..2 {
            for direction in &basis {
                let along: f64 = direction.iter().zip(&rest).map(|(a, b)| a * b).sum();
                rest.iter_mut().zip(direction).for_each(|(r, d)| *r -= along * d);
            }
        }
        let left = norm(&rest);
        if left > INDEPENDENT * size && size > 1e-9 * typical {
            rest.iter_mut().for_each(|r| *r /= left);
            basis.push(rest);
            kept.push(i);
        }
    }
    kept.sort_unstable();
    kept
}

fn not_closed(study: &Study, rows: &[Row], residual: &[f64]) -> Diagnostic {
    let worst = (0..rows.len()).max_by(|&a, &b| residual[a].abs().total_cmp(&residual[b].abs())).unwrap_or(0);
    let joint = &study.joints[rows[worst].joint];
    let gap = match rows[worst].direction {
        Direction::Turn(_) => format!("{:.3} deg are left ({})", residual[worst].to_degrees(), rows[worst].holds),
        _ => format!("{:.4} mm are left ({})", residual[worst] * 1e3, rows[worst].holds),
    };
    Diagnostic::error(Code::CANNOT_ASSEMBLE, format!("the loop closed by joint `{}` cannot be assembled", joint.name))
        .label(joint.span, gap)
        .help(
            "check lengths and points of the bodies in the loop; or start nearer: `start = rest { JOINT.position = .. }` \
             in the first experiment says how the mechanism stands",
        )
}

fn cannot_move(study: &Study, rows: &[Row]) -> Diagnostic {
    let mut names: Vec<String> = rows.iter().map(|row| format!("`{}`", study.joints[row.joint].name)).collect();
    names.dedup();
    let message = format!("the mechanism cannot move: {} take away all its freedom", names.join(", "));
    let mut diagnostic = Diagnostic::error(Code::CANNOT_MOVE, message);
    let mut seen = Vec::new();
    for row in rows {
        if !seen.contains(&row.joint) {
            seen.push(row.joint);
            let joint = &study.joints[row.joint];
            diagnostic = diagnostic.label(joint.span, "closes a loop");
        }
    }
    diagnostic.help("remove a joint, replace it by one with more freedom, or prescribe a motion")
}

/// One warning per joint with redundant constraints, with the joint that would do without them.
fn redundancies(study: &Study, rows: &[Row], kept: &[usize]) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    let mut joints: Vec<usize> = rows.iter().map(|row| row.joint).collect();
    joints.dedup();
    for index in joints {
        let own = || (0..rows.len()).filter(move |&i| rows[i].joint == index);
        let dropped: Vec<usize> = own().filter(|i| !kept.contains(i)).collect();
        if dropped.is_empty() {
            continue;
        }
        let joint = &study.joints[index];
        let held: Vec<&str> = dropped.iter().map(|&i| rows[i].holds.as_str()).collect();
        let message =
            format!("joint `{}` holds what the rest of its loop holds already: {}", joint.name, held.join(", "));
        let count = |is_turn: bool| {
            own().filter(|i| kept.contains(i) && matches!(rows[*i].direction, Direction::Turn(_)) == is_turn).count()
        };
        let cure = cure(joint.kind, &joint.name, (count(false), count(true)), &dropped, rows);
        let mut warning = Diagnostic::warning(Code::REDUNDANT_CONSTRAINT, message)
            .label(joint.span, "closes the loop; redundant")
            .note("the motion is the same without; reactions in these directions are undetermined and shown as zero");
        if let Some(cure) = cure {
            warning = warning.help(cure);
        }
        warnings.push(warning);
    }
    warnings
}

/// The edit after which the joint holds only what is needed.
fn cure(
    kind: JointKind,
    name: &str,
    (shifts, turns): (usize, usize),
    dropped: &[usize],
    rows: &[Row],
) -> Option<String> {
    let free: Vec<String> = dropped
        .iter()
        .filter_map(|&i| match rows[i].direction {
            Direction::Shift(axis) => Some(format!("shift {}", super::emit::axis_in_list(axis))),
            _ => None,
        })
        .collect();
    match (shifts, turns) {
        (3, 0) if kind != JointKind::Spherical => {
            Some(format!("replace it by a spherical joint: `joint {name}: spherical ..`"))
        }
        (0, 0) => Some(format!("remove joint `{name}`: it holds nothing that the others do not hold")),
        (_, 0) if !free.is_empty() => Some(format!(
            "replace it: `joint {name}: axes({}, turn x, turn y, turn z) ..` holds only what is needed",
            free.join(", ")
        )),
        _ => None,
    }
}
