//! Positions, velocities and accelerations of frames and points, from ground outwards (Featherstone-2008, chapter 4).

use super::topology::{Axis, Coordinate, Link, Seat, Tree};
use crate::expression::vector::{self, Matrix, Vector};
use crate::expression::{Binary, Graph, Node, Symbol};

/// Motion of one link's frame. Vectors are in the link's axes unless stated.
#[derive(Clone, Debug)]
pub(super) struct FrameMotion {
    /// Link axes to predecessor axes.
    pub rotation: Matrix,
    /// From the predecessor's origin, in predecessor axes.
    pub shift: Vector,
    /// Link axes to ground axes.
    pub orientation: Matrix,
    /// The origin at coordinates zero, in ground axes.
    pub reference: Vector,
    /// How far the origin has moved from there, in ground axes.
    pub displacement: Vector,
    pub angular_velocity: Vector,
    /// Of the origin.
    pub velocity: Vector,
    /// Spatial acceleration that the joint's rate brings without its second derivative, v x S q'.
    pub angular_bias: Vector,
    pub bias: Vector,
}

/// Spatial velocity or acceleration of a frame: angular, and linear at the frame's origin. The linear acceleration is
/// the derivative of the velocity's components, without w x v.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpatialMotion {
    pub angular: Vector,
    pub linear: Vector,
}

/// Motion axis as constant vectors: angular, linear.
pub(super) fn motion_axis(graph: &mut Graph, axis: Axis) -> (Vector, Vector) {
    let zero = vector::zero(graph);
    match axis {
        Axis::Turn(a) => (a, zero),
        Axis::Shift(a) => (zero, a),
    }
}

/// Rotation of a link's frame against its predecessor's, and how far it is shifted.
fn relative_placement(graph: &mut Graph, link: &Link) -> (Matrix, Vector) {
    let position = match link.coordinate {
        Coordinate::Free { symbols, .. } => graph.variable(symbols.position),
        Coordinate::Prescribed { motion, .. } => motion[0],
        Coordinate::Follower { position, .. } => position,
        Coordinate::Rotation { symbols, component: 0, axes, is_reversed: false } => {
            return (turned_by(graph, symbols.quaternion, axes), vector::zero(graph));
        }
        Coordinate::Turned { symbols, axes } => {
            let forth = turned_by(graph, symbols.quaternion, axes);
            return (vector::transpose(forth), vector::zero(graph));
        }
        Coordinate::Rotation { .. } | Coordinate::Weld | Coordinate::Mode { .. } => {
            return (vector::identity(graph), vector::zero(graph));
        }
    };
    match link.axis {
        Axis::Turn(axis) => (vector::rotation(graph, axis, position), vector::zero(graph)),
        Axis::Shift(axis) => (vector::identity(graph), vector::scale(graph, position, axis)),
    }
}

/// Rotation by a quaternion about `axes`.
fn turned_by(graph: &mut Graph, quaternion: [Symbol; 4], axes: Matrix) -> Matrix {
    let quaternion = quaternion.map(|symbol| graph.variable(symbol));
    let about_axes = vector::rotation_of_quaternion(graph, quaternion);
    let rotation = vector::multiply(graph, axes, about_axes);
    vector::multiply(graph, rotation, vector::transpose(axes))
}

/// The relative velocity (angular, linear) with which the bias of a link arises: its own, but for a free rotation,
/// whose three components turn with the frame together, the first takes all and the others nothing.
fn rate_in_bias(graph: &mut Graph, link: &Link) -> (Vector, Vector) {
    let zero = vector::zero(graph);
    match link.coordinate {
        Coordinate::Rotation { symbols, component: 0, axes, is_reversed } => {
            let rates = symbols.velocity.map(|symbol| graph.variable(symbol));
            let turning = vector::apply(graph, axes, rates);
            (if is_reversed { vector::negate(graph, turning) } else { turning }, zero)
        }
        Coordinate::Rotation { .. } | Coordinate::Turned { .. } | Coordinate::Weld | Coordinate::Mode { .. } => {
            (zero, zero)
        }
        Coordinate::Free { .. } | Coordinate::Prescribed { .. } | Coordinate::Follower { .. } => {
            let rate = link.rate(graph);
            let (turning, shifting) = motion_axis(graph, link.axis);
            (vector::scale(graph, rate, turning), vector::scale(graph, rate, shifting))
        }
    }
}

/// Motion of every link, in order of the tree.
pub(super) fn motion(graph: &mut Graph, tree: &Tree) -> Vec<FrameMotion> {
    let mut frames: Vec<FrameMotion> = Vec::with_capacity(tree.links.len());
    for link in &tree.links {
        let frame = frame_motion(graph, link, link.predecessor.map(|p| &frames[p]));
        frames.push(frame);
    }
    frames
}

fn frame_motion(graph: &mut Graph, link: &Link, predecessor: Option<&FrameMotion>) -> FrameMotion {
    let rate = link.rate(graph);
    let (turning, shifting) = motion_axis(graph, link.axis);
    let (rotation, travel) = relative_placement(graph, link);
    let shift = vector::add(graph, link.offset, travel);
    let joint_angular = vector::scale(graph, rate, turning);
    let joint_linear = vector::scale(graph, rate, shifting);
    let zero = vector::zero(graph);

    let (orientation, reference, displacement) = match predecessor {
        None => (rotation, link.offset, travel),
        Some(p) => {
            let orientation = vector::multiply(graph, p.orientation, rotation);
            let reference = vector::add(graph, p.reference, link.offset);
            let turned = turned_away(graph, p.orientation, link.offset);
            let own = vector::apply(graph, p.orientation, travel);
            let moved = vector::add(graph, turned, own);
            (orientation, reference, vector::add(graph, p.displacement, moved))
        }
    };
    // What the predecessor's motion gives this frame; the joint's own rate adds nothing to v x S q'.
    let (carried_angular, carried_linear) = match predecessor {
        None => (zero, zero),
        Some(p) => {
            let motion = SpatialMotion { angular: p.angular_velocity, linear: p.velocity };
            carry(graph, rotation, shift, motion)
        }
    };
    let (relative_angular, relative_linear) = rate_in_bias(graph, link);
    let (angular_bias, bias) = match link.axis {
        Axis::Turn(_) => (
            vector::cross(graph, carried_angular, relative_angular),
            vector::cross(graph, carried_linear, relative_angular),
        ),
        Axis::Shift(_) => (zero, vector::cross(graph, carried_angular, relative_linear)),
    };
    let angular_velocity = vector::add(graph, carried_angular, joint_angular);
    let velocity = vector::add(graph, carried_linear, joint_linear);
    FrameMotion {
        rotation,
        shift,
        orientation,
        reference,
        displacement,
        angular_velocity,
        velocity,
        angular_bias,
        bias,
    }
}

/// `(orientation - 1) point`: how far a turned frame moves a point fixed in it.
fn turned_away(graph: &mut Graph, orientation: Matrix, point: Vector) -> Vector {
    let identity = vector::identity(graph);
    let difference = vector::subtract_matrix(graph, orientation, identity);
    vector::apply(graph, difference, point)
}

/// A spatial motion vector (angular, linear at the predecessor's origin, predecessor axes) seen at the link.
pub(super) fn carry(graph: &mut Graph, rotation: Matrix, shift: Vector, motion: SpatialMotion) -> (Vector, Vector) {
    let lever = vector::cross(graph, motion.angular, shift);
    let linear = vector::add(graph, motion.linear, lever);
    (vector::apply_transposed(graph, rotation, motion.angular), vector::apply_transposed(graph, rotation, linear))
}

/// Angular velocity of a point's frame, ground axes.
pub(super) fn angular_velocity(graph: &mut Graph, frames: &[FrameMotion], link: Option<usize>) -> Vector {
    match link {
        None => vector::zero(graph),
        Some(link) => vector::apply(graph, frames[link].orientation, frames[link].angular_velocity),
    }
}

/// The angle by which a direction has turned from `across` towards `beyond`, which are perpendicular.
pub(super) fn angle(graph: &mut Graph, [across, beyond]: [Vector; 2], turned: Vector) -> Node {
    let x = vector::dot(graph, across, turned);
    let y = vector::dot(graph, beyond, turned);
    graph.binary(Binary::Atan2, y, x)
}

/// Angular acceleration of a frame, ground axes.
pub(super) fn angular_acceleration(
    graph: &mut Graph,
    frames: &[FrameMotion],
    accelerations: &[SpatialMotion],
    link: Option<usize>,
) -> Vector {
    match link {
        None => vector::zero(graph),
        Some(link) => vector::apply(graph, frames[link].orientation, accelerations[link].angular),
    }
}

/// Link axes to ground axes.
pub(super) fn orientation(graph: &mut Graph, frames: &[FrameMotion], link: Option<usize>) -> Matrix {
    match link {
        None => vector::identity(graph),
        Some(link) => frames[link].orientation,
    }
}

/// Spatial accelerations of the links relative to the ground, from the joints' accelerations.
pub(super) fn accelerations(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    joint_accelerations: &[Node],
) -> Vec<SpatialMotion> {
    let mut result: Vec<SpatialMotion> = Vec::with_capacity(frames.len());
    for (number, link) in tree.links.iter().enumerate() {
        let frame = &frames[number];
        let zero = vector::zero(graph);
        let (angular, linear) = match link.predecessor {
            None => (zero, zero),
            Some(p) => carry(graph, frame.rotation, frame.shift, result[p]),
        };
        let (turning, shifting) = motion_axis(graph, link.axis);
        let own_angular = vector::scale(graph, joint_accelerations[number], turning);
        let own_linear = vector::scale(graph, joint_accelerations[number], shifting);
        let own_angular = vector::add(graph, frame.angular_bias, own_angular);
        let own_linear = vector::add(graph, frame.bias, own_linear);
        result.push(SpatialMotion {
            angular: vector::add(graph, angular, own_angular),
            linear: vector::add(graph, linear, own_linear),
        });
    }
    result
}

/// Position of a point at coordinates zero, ground axes.
pub(super) fn point_reference(graph: &mut Graph, frames: &[FrameMotion], point: Seat) -> Vector {
    match point.link {
        None => point.offset,
        Some(link) => vector::add(graph, frames[link].reference, point.offset),
    }
}

/// How far a point has moved from its place at coordinates zero, ground axes.
pub(super) fn point_displacement(graph: &mut Graph, frames: &[FrameMotion], point: Seat) -> Vector {
    let Some(link) = point.link else { return vector::zero(graph) };
    let turned = turned_away(graph, frames[link].orientation, point.offset);
    vector::add(graph, frames[link].displacement, turned)
}

pub(super) fn point_position(graph: &mut Graph, frames: &[FrameMotion], point: Seat) -> Vector {
    let reference = point_reference(graph, frames, point);
    let displacement = point_displacement(graph, frames, point);
    vector::add(graph, reference, displacement)
}

/// Velocity of a point, ground axes.
pub(super) fn point_velocity(graph: &mut Graph, frames: &[FrameMotion], point: Seat) -> Vector {
    let Some(link) = point.link else { return vector::zero(graph) };
    let frame = &frames[link];
    let lever = vector::cross(graph, frame.angular_velocity, point.offset);
    let local = vector::add(graph, frame.velocity, lever);
    vector::apply(graph, frame.orientation, local)
}

/// Acceleration of a point, ground axes: R (a + w x v + alpha x c + w x (w x c)).
pub(super) fn point_acceleration(
    graph: &mut Graph,
    frames: &[FrameMotion],
    accelerations: &[SpatialMotion],
    point: Seat,
) -> Vector {
    let Some(link) = point.link else { return vector::zero(graph) };
    let (frame, acceleration) = (&frames[link], accelerations[link]);
    let lever = vector::cross(graph, frame.angular_velocity, point.offset);
    let velocity = vector::add(graph, frame.velocity, lever);
    let centripetal = vector::cross(graph, frame.angular_velocity, velocity);
    let tangential = vector::cross(graph, acceleration.angular, point.offset);
    let local = vector::add(graph, acceleration.linear, tangential);
    let local = vector::add(graph, local, centripetal);
    vector::apply(graph, frame.orientation, local)
}
