//! What joints transmit.

use super::articulated::Accelerated;
use super::forces::{Effect, ForceGeometry};
use super::kinematics::{self, FrameMotion};
use super::multipliers::Loops;
use super::topology::{Seat, Tree};
use crate::expression::vector::{self, Vector};
use crate::expression::{Graph, Node, Symbol};
use crate::study::{AxisMotion, ForcePlace, ReactionQuantity, Study};
use std::collections::HashMap;

/// Meaning of what joints transmit. Where loads depend on it (friction by a normal force) it becomes an unknown of its own:
/// returned with its definition.
pub(super) fn add_reactions(
    graph: &mut Graph,
    study: &Study,
    (tree, frames): (&Tree, &[FrameMotion]),
    accelerated: &[Accelerated],
    (geometries, loads): (&[ForceGeometry], &[Node]),
    loops: &Loops,
    meaning: &mut HashMap<Symbol, Node>,
) -> Vec<(ReactionQuantity, Node)> {
    let in_loads = graph.symbols_of(loads);
    let mut unknowns = Vec::new();
    for reaction in &study.reactions {
        let vector = if study.joints[reaction.joint].closes_loop {
            closing_reaction(graph, study, frames, reaction, (geometries, loads), loops)
        } else {
            carried_reaction(graph, study, tree, frames, accelerated, reaction)
        };
        let value = vector[reaction.axis];
        if in_loads.contains(&reaction.symbol) {
            unknowns.push((*reaction, value));
        } else {
            meaning.insert(reaction.symbol, value);
        }
    }
    unknowns
}

/// On the child at its attachment, ground axes.
fn carried_reaction(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    accelerated: &[Accelerated],
    reaction: &ReactionQuantity,
) -> Vector {
    let Some(&link) = tree.links_of_joint[reaction.joint].last() else { return vector::zero(graph) };
    let transmitted = accelerated[link].transmitted;
    let [force, moment] =
        [transmitted.force, transmitted.moment].map(|local| vector::apply(graph, frames[link].orientation, local));
    let on_outer = if reaction.is_moment { moment } else { force };
    if !tree.is_reversed(study, reaction.joint) {
        return on_outer;
    }
    // What is known acts on the parent, at its attachment.
    let mut on_child = vector::negate(graph, on_outer);
    if reaction.is_moment {
        let origin = Seat { link: Some(link), offset: vector::zero(graph), rotation: vector::identity(graph) };
        let child = tree.place(graph, &study.joints[reaction.joint].child);
        let [origin, child] = [origin, child].map(|place| kinematics::point_position(graph, frames, place));
        let arm = vector::subtract(graph, child, origin);
        let shifted = vector::cross(graph, arm, force);
        on_child = vector::add(graph, on_child, shifted);
    }
    on_child
}

fn closing_reaction(
    graph: &mut Graph,
    study: &Study,
    frames: &[FrameMotion],
    reaction: &ReactionQuantity,
    (geometries, loads): (&[ForceGeometry], &[Node]),
    loops: &Loops,
) -> Vector {
    let mut sum = vector::zero(graph);
    for (row, &multiplier) in loops.rows.iter().zip(&loops.multipliers).filter(|(row, _)| row.joint == reaction.joint) {
        let multiplier = graph.variable(multiplier);
        let unit = row.reaction(graph, frames, reaction.is_moment);
        let share = vector::scale(graph, multiplier, unit);
        sum = vector::add(graph, sum, share);
    }
    // Elements on the joint's own axes belong to what it transmits.
    let ends = [study.joints[reaction.joint].parent.body, study.joints[reaction.joint].child.body];
    for ((force, geometry), &load) in study.forces.iter().zip(geometries).zip(loads) {
        let ForcePlace::Joint { joint, axis } = force.place else { continue };
        let (Effect::Links(wrenches), true) = (&geometry.effect, joint == reaction.joint) else { continue };
        let is_turn = matches!(study.joints[joint].axes[axis].motion, AxisMotion::Turn(_));
        if is_turn != reaction.is_moment {
            continue;
        }
        // On the child; where that is ground, the opposite of what acts on the parent.
        let (own, factor) = match ends {
            [_, Some(_)] => (wrenches.last(), load),
            _ => (wrenches.first(), graph.negate(load)),
        };
        if let Some((link, wrench)) = own {
            let local = if reaction.is_moment { wrench.moment } else { wrench.force };
            let turned = vector::apply(graph, frames[*link].orientation, local);
            let share = vector::scale(graph, factor, turned);
            sum = vector::add(graph, sum, share);
        }
    }
    sum
}
