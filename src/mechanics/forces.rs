//! Force elements: elongation, rate, and what a unit of load does to the links.

use super::articulated::Wrench;
use super::kinematics::{self, FrameMotion};
use super::topology::{Seat, Tree};
use super::vector::{self, Vector};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node};
use crate::study::{Force, ForcePlace, Study};

/// Geometry of one force element.
#[derive(Clone, Debug)]
pub(super) struct ForceGeometry {
    pub coordinate: Node,
    pub rate: Node,
    pub effect: Effect,
}

/// What load 1 does.
#[derive(Clone, Debug)]
pub(super) enum Effect {
    /// Acts on the coordinate of a link.
    Coordinate(usize),
    /// Acts on links by wrenches (ground left out).
    Links(Vec<(usize, Wrench)>),
}

pub(super) fn geometry(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    force: &Force,
) -> Result<ForceGeometry, Diagnostic> {
    match &force.place {
        ForcePlace::Joint(joint) => at_joint(graph, study, tree, force, *joint),
        ForcePlace::Between { first, second, along, free_length } => {
            let ends = [tree.place(graph, first), tree.place(graph, second)];
            match along {
                Some(axis) => Ok(along_axis(graph, frames, ends, *axis)),
                None => between_points(graph, frames, ends, *free_length, force),
            }
        }
    }
}

fn at_joint(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    force: &Force,
    joint: usize,
) -> Result<ForceGeometry, Diagnostic> {
    let Some(link) = tree.link_of_joint[joint] else {
        let joint = &study.joints[joint];
        let message = format!("force `{}` acts on joint `{}`, which cannot move", force.name, joint.name);
        return Err(Diagnostic::error(Code::FORCE_ON_FIXED_JOINT, message)
            .label(force.span, "acts on a fixed joint")
            .secondary(joint.span, "fixed here")
            .help("attach the force to a joint that can move, or between two bodies"));
    };
    let symbols = tree.links[link].symbols;
    Ok(ForceGeometry {
        coordinate: graph.variable(symbols.position),
        rate: graph.variable(symbols.velocity),
        effect: Effect::Coordinate(link),
    })
}

/// Signed displacement of the second point against the first along a ground-fixed axis.
fn along_axis(graph: &mut Graph, frames: &[FrameMotion], ends: [Seat; 2], axis: [f64; 3]) -> ForceGeometry {
    let axis = vector::constant(graph, axis);
    let [first, second] = ends.map(|end| kinematics::point_displacement(graph, frames, end));
    let relative = vector::subtract(graph, second, first);
    let coordinate = vector::dot(graph, axis, relative);
    let rate = relative_rate(graph, frames, ends, axis);
    ForceGeometry { coordinate, rate, effect: pulling(graph, frames, ends, axis) }
}

/// Distance of the points minus the free length.
fn between_points(
    graph: &mut Graph,
    frames: &[FrameMotion],
    ends: [Seat; 2],
    free_length: Option<Node>,
    force: &Force,
) -> Result<ForceGeometry, Diagnostic> {
    let [first, second] = ends.map(|end| kinematics::point_position(graph, frames, end));
    let relative = vector::subtract(graph, second, first);
    let [first, second] = ends.map(|end| kinematics::point_reference(graph, frames, end));
    let drawn = vector::subtract(graph, second, first);
    let drawn_length = vector::norm(graph, drawn);
    if graph.is_zero(drawn_length) {
        let message = format!("the end points of force `{}` coincide in the reference configuration", force.name);
        return Err(Diagnostic::error(Code::COINCIDENT_POINTS, message)
            .label(force.span, "no direction to act along")
            .help("name a direction with `along`, or attach it to points that are apart"));
    }
    let length = vector::norm(graph, relative);
    let one = graph.constant(1.0);
    let inverse = graph.divide(one, length);
    let direction = vector::scale(graph, inverse, relative);
    let coordinate = graph.subtract(length, free_length.unwrap_or(drawn_length));
    let rate = relative_rate(graph, frames, ends, direction);
    let effect = pulling(graph, frames, ends, direction);
    Ok(ForceGeometry { coordinate, rate, effect })
}

fn relative_rate(graph: &mut Graph, frames: &[FrameMotion], ends: [Seat; 2], direction: Vector) -> Node {
    let [first, second] = ends.map(|end| kinematics::point_velocity(graph, frames, end));
    let relative = vector::subtract(graph, second, first);
    vector::dot(graph, direction, relative)
}

/// A unit force along `direction` (ground axes) on the second end, reversed on the first.
fn pulling(graph: &mut Graph, frames: &[FrameMotion], ends: [Seat; 2], direction: Vector) -> Effect {
    if ends[0].link == ends[1].link {
        return Effect::Links(vec![]);
    }
    let reversed = vector::negate(graph, direction);
    let mut wrenches = Vec::new();
    for (end, force) in ends.into_iter().zip([reversed, direction]) {
        let Some(link) = end.link else { continue };
        let force = vector::apply_transposed(graph, frames[link].orientation, force);
        let moment = vector::cross(graph, end.offset, force);
        wrenches.push((link, Wrench { moment, force }));
    }
    Effect::Links(wrenches)
}
