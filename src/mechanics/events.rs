//! What events do to the states: new values of law states, and impulses along force elements.
//!
//! An impulse `L` along an element changes all velocities by `da/dload L`, the accelerations being linear in loads; `L` is such that
//! the element's rate becomes the value asked for (Pfeiffer-Glocker-1996, Poisson and Newton impacts without friction).

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
/// Impulses in mechanisms with closed loops.
pub(super) fn changes(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    (geometries, loads): (&[ForceGeometry], &[Node]),
    meaning: &HashMap<Symbol, Node>,
    loops: &Loops,
    accelerate: impl Fn(&mut Graph, &[Node]) -> Vec<Accelerated>,
) -> Result<Vec<Changes>, Vec<Diagnostic>> {
    let is_impact = |event: &&Event| event.changes.iter().any(|(target, _)| matches!(target, ChangeTarget::Rate(_)));
    if !loops.rows.is_empty()
        && let Some(event) = study.events.iter().find(is_impact)
    {
        let message = format!("`{}` changes a rate at once, in a mechanism with closed loops", event.owner);
        return Err(vec![
            Diagnostic::error(Code::IMPACT_IN_LOOP, message)
                .label(event.span, "the closing joints would answer with impulses")
                .help("model the contact as a stiff spring with damping, or open the loop"),
        ]);
    }
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
                    changed.extend(velocities_after(graph, tree, &accelerated, impulse, (rate, value)));
                }
            }
        }
        result.push(changed);
    }
    Ok(result)
}

/// All velocities after an impulse that brings `rate` to `value`.
fn velocities_after(
    graph: &mut Graph,
    tree: &Tree,
    accelerated: &[Accelerated],
    impulse: Symbol,
    (rate, value): (Node, Node),
) -> Vec<(Symbol, Node)> {
    let free = tree.links.iter().zip(accelerated);
    let velocities: Changes = free.filter_map(|(link, own)| Some((link.free_symbols()?.0, own.acceleration))).collect();
    let accelerations: Vec<Node> = velocities.iter().map(|(_, acceleration)| *acceleration).collect();
    let mobilities = graph.differentiate(&accelerations, impulse);
    let mut mobility = graph.constant(0.0);
    for ((velocity, _), &own) in velocities.iter().zip(&mobilities) {
        let lever = graph.differentiate(&[rate], *velocity)[0];
        let share = graph.multiply(lever, own);
        mobility = graph.add(mobility, share);
    }
    let missing = graph.subtract(value, rate);
    let size = graph.divide(missing, mobility);
    let moved = velocities.iter().zip(mobilities).filter(|(_, own)| !graph.is_zero(*own)).collect::<Vec<_>>();
    moved
        .into_iter()
        .map(|(&(velocity, _), own)| {
            let change = graph.multiply(own, size);
            let before = graph.variable(velocity);
            (velocity, graph.add(before, change))
        })
        .collect()
}
