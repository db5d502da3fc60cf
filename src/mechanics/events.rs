//! What events do to the states: new values of law states, and impulses along force elements.
//!
//! An impulse `L` along an element changes all velocities by `da/dload L`, the accelerations being linear in loads; `L`
//! is such that the element's rate becomes the value asked for (Pfeiffer-Glocker-1996, Poisson and Newton impacts
//! without friction). Joints that close loops answer with impulses of their own, such that the rates of their
//! constraints stay as they are.

use super::articulated::Accelerated;
use super::forces::ForceGeometry;
use super::multipliers::Loops;
use super::topology::Tree;
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node, Symbol};
use crate::study::{ChangeTarget, Event, Study};
use std::collections::HashMap;

/// States by their symbols, with their values after an event.
pub(super) type Changes = Vec<(Symbol, Node)>;

/// Per event of the study the symbols of states that it changes, with their values after it. `accelerate` gives the
/// accelerations under other loads of the force elements.
///
/// # Errors
/// Impulses along elements to whose rate closed loops and prescribed motions leave no freedom.
pub(super) fn changes(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    (geometries, loads): (&[ForceGeometry], &[Node]),
    meaning: &HashMap<Symbol, Node>,
    loops: &Loops,
    accelerate: impl Fn(&mut Graph, &[Node]) -> Vec<Accelerated>,
) -> Result<Vec<Changes>, Vec<Diagnostic>> {
    let mut result = Vec::new();
    for event in &study.events {
        let mut changed = Vec::new();
        for (target, value) in &event.changes {
            let value = graph.substitute(&[*value], meaning)[0];
            match target {
                ChangeTarget::State(symbol) => changed.push((*symbol, value)),
                ChangeTarget::Rate(force) => {
                    let impulse = graph.symbol("(impulse)");
                    let added = graph.variable(impulse);
                    let mut loads = loads.to_vec();
                    loads[*force] = graph.add(loads[*force], added);
                    let accelerated = accelerate(graph, &loads);
                    let rate = geometries[*force].rate;
                    let after = velocities_after(graph, tree, &accelerated, loops, impulse, (rate, value));
                    if !is_free(graph, study, loops, after.mobility) {
                        return Err(vec![held(study, *force, event)]);
                    }
                    changed.extend(after.velocities);
                }
            }
        }
        result.push(changed);
    }
    Ok(result)
}

/// Share of an element's mobility that must be left by the loops.
const FREE: f64 = 1e-9;

/// Whether the loops leave the element's rate free where they are closed near the study's first start.
fn is_free(graph: &mut Graph, study: &Study, loops: &Loops, mobility: [Node; 2]) -> bool {
    if loops.rows.is_empty() {
        return true;
    }
    let closed = &loops.general;
    let parameter = |symbol: Symbol| study.parameters.iter().find(|p| p.symbol == symbol).map(|p| p.start);
    let value = |symbol: Symbol| closed.get(&symbol).copied().or_else(|| parameter(symbol)).unwrap_or(0.0);
    let [alone, left] = mobility;
    let values = graph.evaluate(&[alone, left], value, |_, _, _| 0.0);
    !values[0].is_finite() || values[1] > FREE * values[0]
}

fn held(study: &Study, force: usize, event: &Event) -> Diagnostic {
    let name = &study.forces[force].name;
    let message = format!("`{}` changes a rate at once that the closed loops determine", event.owner);
    Diagnostic::error(Code::IMPACT_IN_LOOP, message)
        .label(event.span, format!("no impulse along `{name}` moves anything"))
        .help("let the drive yield, by a spring and damper instead of a prescribed motion, or take the impact out")
}

/// What an impulse does.
struct After {
    velocities: Changes,
    /// Rate of the element per impulse: if the loops were open, and as they are.
    mobility: [Node; 2],
}

/// All velocities after an impulse that brings `rate` to `value`.
///
/// With the rates `J v` of the element and of the constraints, the impulses `L` along them change the velocities by
/// `M^-1 J^T L`; the matrix `J M^-1 J^T` is positive definite where the constraints leave the element's rate free, so
/// that elimination needs no exchange of rows.
fn velocities_after(
    graph: &mut Graph,
    tree: &Tree,
    accelerated: &[Accelerated],
    loops: &Loops,
    impulse: Symbol,
    (rate, value): (Node, Node),
) -> After {
    let free = tree.links.iter().zip(accelerated);
    let velocities: Changes = free.filter_map(|(link, own)| Some((link.free_symbols()?.0, own.acceleration))).collect();
    let accelerations: Vec<Node> = velocities.iter().map(|(_, acceleration)| *acceleration).collect();
    // The element comes last: its row alone is not zero on the right.
    let along: Vec<(Symbol, Node)> = loops.multipliers.iter().copied().zip(loops.velocities.iter().copied()).collect();
    let along = [along, vec![(impulse, rate)]].concat();
    let responses: Vec<Vec<Node>> =
        along.iter().map(|&(impulse, _)| graph.differentiate(&accelerations, impulse)).collect();
    let mut matrix: Vec<Vec<Node>> = Vec::new();
    for &(_, rate) in &along {
        let levers: Vec<Node> =
            velocities.iter().map(|&(velocity, _)| graph.differentiate(&[rate], velocity)[0]).collect();
        matrix.push(responses.iter().map(|response| sum_of_products(graph, &levers, response)).collect());
    }
    let missing = graph.subtract(value, rate);
    let alone = matrix[along.len() - 1][along.len() - 1];
    let (impulses, left) = solve_last(graph, matrix, missing);
    let mut changed = Vec::new();
    for (k, &(velocity, _)) in velocities.iter().enumerate() {
        let own: Vec<Node> = responses.iter().map(|response| response[k]).collect();
        let change = sum_of_products(graph, &own, &impulses);
        if !graph.is_zero(change) {
            let before = graph.variable(velocity);
            changed.push((velocity, graph.add(before, change)));
        }
    }
    After { velocities: changed, mobility: [alone, left] }
}

pub(super) fn sum_of_products(graph: &mut Graph, a: &[Node], b: &[Node]) -> Node {
    let mut sum = graph.constant(0.0);
    for (&a, &b) in a.iter().zip(b) {
        let product = graph.multiply(a, b);
        sum = graph.add(sum, product);
    }
    sum
}

/// Solves `matrix x = (0, .., 0, last)` without exchange of rows; also the last pivot.
fn solve_last(graph: &mut Graph, mut matrix: Vec<Vec<Node>>, last: Node) -> (Vec<Node>, Node) {
    let n = matrix.len();
    for k in 0..n {
        let pivots = matrix[k].clone();
        for row in &mut matrix[k + 1..] {
            if graph.is_zero(row[k]) {
                continue;
            }
            let factor = graph.divide(row[k], pivots[k]);
            for (entry, &pivot) in row.iter_mut().zip(&pivots).skip(k) {
                let share = graph.multiply(factor, pivot);
                *entry = graph.subtract(*entry, share);
            }
        }
    }
    let mut solution = vec![last; n];
    for k in (0..n).rev() {
        let mut right = if k + 1 == n { last } else { graph.constant(0.0) };
        for (&entry, &known) in matrix[k].iter().zip(&solution).skip(k + 1) {
            let share = graph.multiply(entry, known);
            right = graph.subtract(right, share);
        }
        solution[k] = graph.divide(right, matrix[k][k]);
    }
    (solution, matrix[n - 1][n - 1])
}
