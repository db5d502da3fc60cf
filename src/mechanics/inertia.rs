//! Joints that move nothing.

use super::articulated::Accelerated;
use super::topology::{Axis, Coordinate, Tree};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node, Symbol};
use crate::study::{Body, Study};
use std::collections::HashMap;

/// Below this part of the inertia in other directions, what a joint moves is rounding.
const NEGLIGIBLE_INERTIA: f64 = 1e-12;

/// Below this, kg, nothing is left of a modal mass of 1 kg: its equation is not determined.
const LEAST_MODAL_MASS: f64 = 1e-9;

/// Evaluates what each joint moves at one general configuration: zero there means zero nearly everywhere.
pub(super) fn refuse_missing_inertia(
    graph: &Graph,
    study: &Study,
    tree: &Tree,
    accelerated: &[Accelerated],
) -> Result<(), Vec<Diagnostic>> {
    let mut point: HashMap<Symbol, f64> = study.parameters.iter().map(|p| (p.symbol, p.start)).collect();
    for (number, link) in tree.links.iter().enumerate() {
        let general = match link.axis {
            Axis::Turn(_) => 0.3 + 0.1 * number as f64,
            Axis::Shift(_) => 0.01 + 0.003 * number as f64,
        };
        match link.coordinate {
            Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
                point.insert(symbols.position, general);
            }
            Coordinate::Rotation { symbols, component: 0, .. } => {
                symbols.quaternion.iter().zip([0.8, 0.3, -0.4, 0.2]).for_each(|(&symbol, value)| {
                    point.insert(symbol, value + 0.01 * number as f64);
                });
            }
            _ => {}
        }
    }
    let needed: Vec<Node> =
        accelerated.iter().flat_map(|a| [&[a.moved_inertia][..], &a.around[0], &a.around[1]].concat()).collect();
    let values = graph.evaluate(&needed, |s| point.get(&s).copied().unwrap_or(0.0), |_, _, _| 0.0);
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));

    // Outer joints first: where one fails, what lies further in is not determined and not to blame.
    let mut reference = vec![[0.0_f64; 2]; tree.links.len()];
    let mut is_in_shadow = vec![false; tree.links.len()];
    let mut errors = Vec::new();
    for (number, link) in tree.links.iter().enumerate().rev() {
        let values = &values[7 * number..7 * (number + 1)];
        let around = [largest(&values[1..4]), largest(&values[4..7])];
        let around: [f64; 2] = std::array::from_fn(|k| around[k].max(reference[number][k]));
        let scale = if matches!(link.axis, Axis::Turn(_)) { around[0] } else { around[1] };
        let is_moving = link.free_symbols().is_none() || values[0] > NEGLIGIBLE_INERTIA * scale;
        if let Coordinate::Mode { body, number: mode, .. } = link.coordinate {
            if values[0] <= LEAST_MODAL_MASS && !is_in_shadow[number] {
                errors.push(modes_too_large(&study.bodies[body], mode));
                is_in_shadow[number] = true;
            }
        } else if !is_moving && !is_in_shadow[number] {
            errors.push(no_inertia(study, tree, link.joint, link.axis));
        }
        if let Some(p) = link.predecessor {
            is_in_shadow[p] |= is_in_shadow[number] || !is_moving;
            reference[p] = std::array::from_fn(|k| reference[p][k].max(around[k]));
        }
    }
    errors.reverse();
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

pub(super) fn modes_too_large(body: &Body, mode: usize) -> Diagnostic {
    let message = format!("the modes of `{}` take along more than its mass and inertia", body.name);
    let span = body.elastic.as_ref().map_or(body.span, |elastic| elastic.span);
    Diagnostic::error(Code::MODE_NORMALISATION, message)
        .label(span, format!("mode {} with those before it", mode + 1))
        .secondary(body.span, "this body")
        .help("scale every mode to a modal mass of 1 kg; check `mass` and `inertia` of the body")
}

fn no_inertia(study: &Study, tree: &Tree, joint: usize, axis: Axis) -> Diagnostic {
    let body = tree.walk.iter().find(|(number, _)| *number == joint).map(|&(_, body)| &study.bodies[body]);
    let joint = &study.joints[joint];
    let body_name = body.map_or("ground", |body| body.name.as_str());
    let (lacks, field) = match axis {
        Axis::Turn(_) => ("moment of inertia", "inertia = 0.1 kg*m^2"),
        Axis::Shift(_) => ("mass", "mass = 1 kg"),
    };
    let mut finding =
        Diagnostic::error(Code::NO_INERTIA, format!("joint `{}` moves body `{body_name}` without {lacks}", joint.name))
            .label(joint.span, format!("its acceleration is undetermined: it moves no {lacks}"));
    if let Some(body) = body {
        finding = finding.secondary(body.span, format!("`{body_name}` and what hangs on it is without {lacks} here"));
    }
    finding.help(format!("give `{body_name}` a positive {lacks} (`{field}`), or replace the joint by a fixed one"))
}
