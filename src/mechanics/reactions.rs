//! What joints transmit.

use super::articulated::Accelerated;
use super::closing::closing_coordinate;
use super::couplings;
use super::forces::{Effect, ForceGeometry};
use super::kinematics::{self, FrameMotion};
use super::loops::Owner;
use super::multipliers::Loops;
use super::topology::{Seat, Tree};
use crate::expression::vector::{self, Vector};
use crate::expression::{Graph, Node, Symbol};
use crate::study::{ForcePlace, ReactionQuantity, Study};
use std::collections::HashMap;

/// Meaning of what joints transmit. Where loads depend on it (friction by a normal force) it becomes an unknown of its
/// own: returned with its definition.
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
            closing_reaction(graph, study, (tree, frames), reaction, (geometries, loads), (loops, meaning))
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
    (tree, frames): (&Tree, &[FrameMotion]),
    reaction: &ReactionQuantity,
    (geometries, loads): (&[ForceGeometry], &[Node]),
    (loops, meaning): (&Loops, &HashMap<Symbol, Node>),
) -> Vector {
    let mut sum = vector::zero(graph);
    let acting = loops.acting(graph, &loops.multipliers);
    for (row, multiplier) in acting.into_iter().filter(|(row, _)| row.owner == Owner::Joint(reaction.joint)) {
        let unit = row.reaction(graph, frames, reaction.is_moment);
        let share = vector::scale(graph, multiplier, unit);
        sum = vector::add(graph, sum, share);
    }
    // Elements on the joint's own axes belong to what it transmits.
    let places = [&study.joints[reaction.joint].parent, &study.joints[reaction.joint].child];
    let [parent, child] = places.map(|end| tree.place(graph, end));
    let on_joint = study.forces.iter().zip(geometries).zip(loads).filter(|((force, _), _)| match force.place {
        ForcePlace::Joint { joint, .. } => joint == reaction.joint,
        ForcePlace::Between { .. } => false,
    });
    let mut acting: Vec<(ForceGeometry, Node)> =
        on_joint.map(|((_, geometry), &load)| (geometry.clone(), load)).collect();
    let in_couplings = loops.coupling_loads(graph, study);
    for (at, load) in couplings::loads_on(graph, study, reaction.joint, &in_couplings, meaning) {
        let geometry = closing_coordinate(graph, study, tree, frames, (reaction.joint, at));
        acting.extend(geometry.map(|geometry| (geometry, load)));
    }
    for (geometry, load) in acting {
        let Effect::Links(wrenches) = &geometry.effect else { continue };
        // On the child; where that is ground, the opposite of what acts on the parent.
        let (body, factor) = match child.link {
            Some(_) => (child.link, load),
            None => (parent.link, graph.negate(load)),
        };
        for (link, wrench) in wrenches.iter().filter(|(link, _)| Some(*link) == body) {
            let orientation = frames[*link].orientation;
            let acting = vector::apply(graph, orientation, wrench.force);
            let mut share = acting;
            if reaction.is_moment {
                let origin = Seat { link: Some(*link), offset: vector::zero(graph), rotation: vector::identity(graph) };
                let [origin, at] = [origin, child].map(|place| kinematics::point_position(graph, frames, place));
                let arm = vector::subtract(graph, origin, at);
                let about = vector::apply(graph, orientation, wrench.moment);
                let by_force = vector::cross(graph, arm, acting);
                share = vector::add(graph, about, by_force);
            }
            let share = vector::scale(graph, factor, share);
            sum = vector::add(graph, sum, share);
        }
    }
    sum
}
