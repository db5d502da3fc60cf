//! Force elements: elongation, rate, and what a unit of load does to the links.

use super::articulated::Wrench;
use super::closing::at_closing_joint;
use super::kinematics::{self, FrameMotion};
use super::topology::{Axis, Coordinate, Seat, Tree};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::vector::{self, Vector};
use crate::expression::{Binary, Graph, Node, Unary};
use crate::study::{Force, ForceDirection, ForcePlace, Motion, Study};

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
        ForcePlace::Joint { joint, axis } if study.joints[*joint].closes_loop => {
            at_closing_joint(graph, study, tree, frames, force, (*joint, *axis))
        }
        ForcePlace::Joint { joint, axis } => at_joint(graph, study, tree, force, (*joint, *axis)),
        ForcePlace::Between { first, second, along, free_length } => {
            let ends = [tree.place(graph, first), tree.place(graph, second)];
            match along {
                Some(direction) if direction.motion == Motion::Rotational => {
                    Ok(about_axis(graph, tree, frames, [first.body, second.body], *direction))
                }
                Some(ForceDirection { axis, body: None, .. }) => Ok(along_axis(graph, frames, ends, *axis)),
                Some(direction) => Ok(along_body_axis(graph, tree, frames, ends, *direction)),
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
    (joint, axis): (usize, usize),
) -> Result<ForceGeometry, Diagnostic> {
    let Some(link) = tree.link_of_axis(joint, axis) else {
        let joint = &study.joints[joint];
        let message = format!("force `{}` acts on joint `{}`, which cannot move", force.name, joint.name);
        return Err(Diagnostic::error(Code::FORCE_ON_FIXED_JOINT, message)
            .label(force.span, "acts on a fixed joint")
            .secondary(joint.span, "fixed here")
            .help("attach the force to a joint that can move, or between two bodies"));
    };
    let (coordinate, rate) = match tree.links[link].coordinate {
        Coordinate::Prescribed { motion, .. } => (motion[0], motion[1]),
        _ => {
            let symbols = study.joints[joint].axes[axis].symbols;
            (graph.variable(symbols.position), graph.variable(symbols.velocity))
        }
    };
    Ok(ForceGeometry { coordinate, rate, effect: Effect::Coordinate(link) })
}

/// Signed displacement of the second point against the first along an axis that turns with a body. The load acts at the
/// second point on both bodies, so that power is load times rate.
fn along_body_axis(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    ends: [Seat; 2],
    direction: ForceDirection,
) -> ForceGeometry {
    let (axis, link) = turning_axis(graph, tree, frames, direction);
    let [first, second] = ends.map(|end| kinematics::point_position(graph, frames, end));
    let relative = vector::subtract(graph, second, first);
    let reference = {
        let [first, second] = ends.map(|end| kinematics::point_reference(graph, frames, end));
        let drawn = vector::subtract(graph, second, first);
        let seat = tree.seat(graph, direction.body);
        let axis = vector::constant(graph, direction.axis);
        let drawn_axis = vector::apply(graph, seat.rotation, axis);
        vector::dot(graph, drawn_axis, drawn)
    };
    let length = vector::dot(graph, axis, relative);
    let coordinate = graph.subtract(length, reference);
    let along = relative_rate(graph, frames, ends, axis);
    let angular = kinematics::angular_velocity(graph, frames, link);
    let turning = vector::cross(graph, angular, axis);
    let by_turning = vector::dot(graph, turning, relative);
    let rate = graph.add(along, by_turning);
    // What the turning of the axis contributes to the rate is a moment on the body that carries it.
    let mut wrenches = match pulling(graph, frames, ends, axis) {
        Effect::Links(wrenches) => wrenches,
        Effect::Coordinate(_) => Vec::new(),
    };
    if let Some(link) = link {
        let moment = vector::cross(graph, axis, relative);
        let moment = vector::apply_transposed(graph, frames[link].orientation, moment);
        wrenches.push((link, Wrench { moment, force: vector::zero(graph) }));
    }
    ForceGeometry { coordinate, rate, effect: Effect::Links(wrenches) }
}

/// The axis in ground axes and the link it turns with.
fn turning_axis(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    direction: ForceDirection,
) -> (Vector, Option<usize>) {
    let seat = tree.seat(graph, direction.body);
    let axis = vector::constant(graph, direction.axis);
    let axis = vector::apply(graph, seat.rotation, axis);
    let orientation = kinematics::orientation(graph, frames, seat.link);
    (vector::apply(graph, orientation, axis), seat.link)
}

/// Angle of the second body against the first about an axis: the sum of the turns between them where all are about it,
/// however far; else that between the projections of a direction that is perpendicular to the axis and parallel in both
/// bodies in the reference configuration, up to half a turn.
fn about_axis(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    bodies: [Option<usize>; 2],
    direction: ForceDirection,
) -> ForceGeometry {
    let (axis, _) = turning_axis(graph, tree, frames, direction);
    let seat = tree.seat(graph, direction.body);
    let [across, beyond] = vector::perpendicular(direction.axis).map(|v| {
        let v = vector::constant(graph, v);
        vector::apply(graph, seat.rotation, v)
    });
    let links = bodies.map(|body| tree.seat(graph, body).link);
    let [first, second] = links.map(|link| kinematics::orientation(graph, frames, link));
    let carrier = kinematics::orientation(graph, frames, seat.link);
    let drawn_axis = {
        let axis = vector::constant(graph, direction.axis);
        vector::apply(graph, seat.rotation, axis)
    };
    let coordinate = match links.map(|link| turns_about(graph, tree, link, drawn_axis)) {
        [Some(first), Some(second)] => graph.subtract(second, first),
        _ => {
            let plane = [across, beyond].map(|v| vector::apply(graph, carrier, v));
            let projected = [first, second].map(|orientation| {
                let turned = vector::apply(graph, orientation, across);
                plane.map(|direction| vector::dot(graph, direction, turned))
            });
            angle_between(graph, projected)
        }
    };
    let [slow, fast] = links.map(|link| kinematics::angular_velocity(graph, frames, link));
    let relative = vector::subtract(graph, fast, slow);
    let rate = vector::dot(graph, axis, relative);
    let wrenches = opposite_moments(graph, frames, links, axis);
    ForceGeometry { coordinate, rate, effect: Effect::Links(wrenches) }
}

/// The angle from one plane vector to another.
fn angle_between(graph: &mut Graph, [from, to]: [[Node; 2]; 2]) -> Node {
    let product = |graph: &mut Graph, a: [Node; 2], b: [Node; 2]| {
        let (first, second) = (graph.multiply(a[0], b[0]), graph.multiply(a[1], b[1]));
        (first, second)
    };
    let (xx, yy) = product(graph, from, to);
    let (xy, yx) = product(graph, from, [to[1], to[0]]);
    let (along, across) = (graph.add(xx, yy), graph.subtract(xy, yx));
    graph.binary(Binary::Atan2, across, along)
}

/// The sum of the coordinates by which a frame has turned about a constant axis; `None` where something turns it
/// otherwise.
fn turns_about(graph: &mut Graph, tree: &Tree, mut link: Option<usize>, axis: Vector) -> Option<Node> {
    let mut sum = graph.constant(0.0);
    while let Some(at) = link {
        let own = &tree.links[at];
        match (&own.coordinate, own.axis) {
            (Coordinate::Weld, _) | (Coordinate::Free { .. } | Coordinate::Prescribed { .. }, Axis::Shift(_)) => {}
            (coordinate, Axis::Turn(about)) => {
                let position = match coordinate {
                    Coordinate::Free { symbols, .. } => graph.variable(symbols.position),
                    Coordinate::Prescribed { motion, .. } => motion[0],
                    _ => return None,
                };
                let same = vector::dot(graph, about, axis);
                let factor = graph.constant_value(same).filter(|cosine| (cosine.abs() - 1.0).abs() < PARALLEL)?;
                let factor = graph.constant(factor.signum());
                let turned = graph.multiply(factor, position);
                sum = graph.add(sum, turned);
            }
            _ => return None,
        }
        link = own.predecessor;
    }
    Some(sum)
}

/// A unit moment about `axis` (ground axes) on the second link, reversed on the first.
pub(super) fn opposite_moments(
    graph: &mut Graph,
    frames: &[FrameMotion],
    links: [Option<usize>; 2],
    axis: Vector,
) -> Vec<(usize, Wrench)> {
    let reversed = vector::negate(graph, axis);
    let mut wrenches = Vec::new();
    for (link, moment) in links.into_iter().zip([reversed, axis]) {
        let Some(link) = link.filter(|_| links[0] != links[1]) else { continue };
        let moment = vector::apply_transposed(graph, frames[link].orientation, moment);
        wrenches.push((link, Wrench { moment, force: vector::zero(graph) }));
    }
    wrenches
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
    let is_drawn_together = graph.is_zero(drawn_length);
    if is_drawn_together && free_length.is_none() {
        let message = format!("the end points of force `{}` coincide in the reference configuration", force.name);
        return Err(Diagnostic::error(Code::COINCIDENT_POINTS, message)
            .label(force.span, "no direction to act along")
            .help("name a direction with `along`, give its `free_length`, or attach it to points that are apart"));
    }
    let length = if is_drawn_together { rounded_length(graph, relative) } else { vector::norm(graph, relative) };
    let one = graph.constant(1.0);
    let inverse = graph.divide(one, length);
    let direction = vector::scale(graph, inverse, relative);
    let coordinate = graph.subtract(length, free_length.unwrap_or(drawn_length));
    let rate = relative_rate(graph, frames, ends, direction);
    let effect = pulling(graph, frames, ends, direction);
    Ok(ForceGeometry { coordinate, rate, effect })
}

/// Axes whose cosine differs from one by less are parallel.
const PARALLEL: f64 = 1e-12;

/// Distances below this, m, count as none: there an element without direction pulls nowhere.
const POINT_SIZE: f64 = 1e-9;

/// The length of a vector, rounded off at zero so that direction and derivatives stay finite.
fn rounded_length(graph: &mut Graph, vector: Vector) -> Node {
    let square = vector::dot(graph, vector, vector);
    let size = graph.constant(POINT_SIZE * POINT_SIZE);
    let square = graph.add(square, size);
    graph.unary(Unary::Sqrt, square)
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
