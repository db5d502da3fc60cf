//! Joints that close kinematic loops, as constraints on position and velocity level.
//!
//! A row is the dot product of two vectors that move with the bodies; its rate is a linear function of the velocities, and
//! a multiplier acts on the bodies by exactly the transpose of that function.

use super::articulated::Wrench;
use super::forces::{Effect, ForceGeometry};
use super::kinematics::{self, FrameMotion};
use super::topology::{Seat, Tree};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::vector::{self, Vector};
use crate::expression::{Binary, Graph, Node};
use crate::study::{AxisMotion, Force, Joint, JointKind, Study};

/// The two ends of a closing joint.
#[derive(Clone, Copy, Debug)]
struct Ends {
    parent: Seat,
    child: Seat,
}

/// One constraint `0 = g(q, t)`.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub joint: usize,
    /// What it holds, in words.
    pub holds: String,
    pub direction: Direction,
    ends: Ends,
    geometry: Geometry,
}

/// Which freedom of the joint a row takes away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Direction {
    /// Along an axis given in parent axes.
    Shift([f64; 3]),
    /// About the axis that is perpendicular to the two directions compared.
    Turn([f64; 3]),
    Distance,
}

#[derive(Clone, Copy, Debug)]
enum Geometry {
    /// A ground-fixed direction times the distance vector.
    Fixed(Vector),
    /// A direction of the parent's link (link axes) times the distance vector.
    Carried(Vector),
    /// A direction of the parent's link times one of the child's link, minus their product in the reference configuration.
    Angle { parent: Vector, child: Vector },
    /// Distance of the points, m.
    Distance(Node),
}

/// Rows of all joints that close loops.
///
/// # Errors
/// Joints whose freedom cannot be written as constraints: shifts behind turns.
pub(super) fn rows(graph: &mut Graph, study: &Study, tree: &Tree) -> Result<Vec<Row>, Vec<Diagnostic>> {
    let mut rows = Vec::new();
    let mut errors = Vec::new();
    for (index, joint) in study.joints.iter().enumerate().filter(|(_, joint)| joint.closes_loop) {
        let ends = Ends { parent: tree.place(graph, &joint.parent), child: tree.place(graph, &joint.child) };
        if let Some(axis) = joint.axes.iter().find(|axis| axis.prescribed.is_some()) {
            errors.push(prescribed_in_loop(joint, &axis.name));
            continue;
        }
        let mut add = |(direction, geometry): (Direction, Geometry)| {
            rows.push(Row { joint: index, holds: holds(direction), direction, ends, geometry });
        };
        if let (JointKind::Distance, Some(length)) = (joint.kind, joint.length) {
            add((Direction::Distance, Geometry::Distance(length)));
            continue;
        }
        match (position_rows(graph, joint, ends), angle_rows(graph, joint, ends)) {
            (Some(positions), Some(angles)) => positions.into_iter().chain(angles).for_each(add),
            _ => errors.push(no_constraint_form(joint)),
        }
    }
    if errors.is_empty() { Ok(rows) } else { Err(errors) }
}

fn holds(direction: Direction) -> String {
    match direction {
        Direction::Shift(axis) => format!("shifting along {}", super::emit::axis_text(axis)),
        Direction::Turn(axis) => format!("turning about {}", super::emit::axis_text(without_sign(axis))),
        Direction::Distance => "the distance of its ends".to_owned(),
    }
}

/// An axis that is not directed: the first component that is not zero is positive.
fn without_sign(axis: [f64; 3]) -> [f64; 3] {
    let is_negative = axis.iter().find(|component| **component != 0.0).is_some_and(|component| *component < 0.0);
    if is_negative { axis.map(|component| 0.0 - component) } else { axis }
}

fn no_constraint_form(joint: &Joint) -> Diagnostic {
    Diagnostic::error(Code::CLOSED_LOOP, format!("joint `{}` cannot close its loop", joint.name))
        .label(joint.span, "a shift behind a turn, or more than one shift direction that turns")
        .help("list its shifts first, `axes(shift y, turn z)`; or let another joint close the loop: the one with the most freedom does, among equals the last declared")
}

fn prescribed_in_loop(joint: &Joint, axis: &str) -> Diagnostic {
    Diagnostic::error(
        Code::CLOSED_LOOP,
        format!("the motion of `{axis}` is prescribed, but joint `{}` closes a loop", joint.name),
    )
    .label(joint.span, "closes the loop")
    .help(
        "declare it before the joint of the same loop that has as much freedom; the last one declared closes the loop",
    )
}

/// Directions in the parent's axes that the leading shifts leave held. `None`: a shift behind a turn.
fn position_rows(graph: &mut Graph, joint: &Joint, ends: Ends) -> Option<Vec<(Direction, Geometry)>> {
    let shifts: Vec<[f64; 3]> =
        joint.axes.iter().filter(|a| matches!(a.motion, AxisMotion::Shift(_))).map(|a| a.motion.direction()).collect();
    let leads = joint.axes.iter().take(shifts.len()).all(|axis| matches!(axis.motion, AxisMotion::Shift(_)));
    if !leads {
        return None;
    }
    let held: Vec<[f64; 3]> = match shifts.as_slice() {
        [] => {
            return Some((0..3).map(|i| fixed(graph, i)).collect());
        }
        [axis] => vector::perpendicular(*axis).to_vec(),
        [a, b] => vec![normal(*a, *b)],
        _ => vec![],
    };
    let rows = held.into_iter().map(|direction| {
        let axis = vector::constant(graph, direction);
        (Direction::Shift(direction), Geometry::Carried(vector::apply(graph, ends.parent.rotation, axis)))
    });
    Some(rows.collect())
}

fn fixed(graph: &mut Graph, index: usize) -> (Direction, Geometry) {
    let axis: [f64; 3] = std::array::from_fn(|i| if i == index { 1.0 } else { 0.0 });
    (Direction::Shift(axis), Geometry::Fixed(vector::constant(graph, axis)))
}

fn normal(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let product: [f64; 3] = std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
    let length = product.iter().map(|x| x * x).sum::<f64>().sqrt();
    product.map(|x| x / length)
}

/// Pairs of directions that stay perpendicular (at their reference angle).
fn angle_rows(graph: &mut Graph, joint: &Joint, ends: Ends) -> Option<Vec<(Direction, Geometry)>> {
    if joint.rotation.is_some() {
        return Some(vec![]);
    }
    let turns: Vec<[f64; 3]> =
        joint.axes.iter().filter(|a| matches!(a.motion, AxisMotion::Turn(_))).map(|a| a.motion.direction()).collect();
    let unit = |i: usize| -> [f64; 3] { std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }) };
    // Each pair: direction of the parent, direction of the child (both in parent axes of the reference configuration).
    let pairs: Vec<([f64; 3], [f64; 3])> = match turns.as_slice() {
        [] => (0..3).map(|i| (unit(i), unit((i + 1) % 3))).collect(),
        [axis] => vector::perpendicular(*axis).map(|across| (across, *axis)).to_vec(),
        [first, second] => vec![(*first, *second)],
        _ => vec![],
    };
    let rows = pairs.into_iter().map(|(of_parent, of_child)| {
        let [parent, child] = [of_parent, of_child].map(|direction| {
            let direction = vector::constant(graph, direction);
            vector::apply(graph, ends.parent.rotation, direction)
        });
        (Direction::Turn(normal(of_parent, of_child)), Geometry::Angle { parent, child })
    });
    Some(rows.collect())
}

/// Positions and velocities that a row needs, ground axes.
struct Moving {
    distance: Vector,
    relative_velocity: Vector,
    turning: [Vector; 2],
}

impl Row {
    fn moving(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Moving {
        let Ends { parent, child } = self.ends;
        let [p, c] = [parent, child].map(|end| kinematics::point_position(graph, frames, end));
        let [v_p, v_c] = [parent, child].map(|end| kinematics::point_velocity(graph, frames, end));
        let turning = [parent, child].map(|end| kinematics::angular_velocity(graph, frames, end.link));
        Moving {
            distance: vector::subtract(graph, c, p),
            relative_velocity: vector::subtract(graph, v_c, v_p),
            turning,
        }
    }

    /// Directions of parent and child in ground axes.
    fn directions(&self, graph: &mut Graph, frames: &[FrameMotion]) -> [Vector; 2] {
        let (parent, child) = match self.geometry {
            Geometry::Fixed(u) => return [u, u],
            Geometry::Carried(u) => (u, u),
            Geometry::Angle { parent, child } => (parent, child),
            Geometry::Distance(_) => return [vector::zero(graph); 2],
        };
        let [r_p, r_c] =
            [self.ends.parent, self.ends.child].map(|end| kinematics::orientation(graph, frames, end.link));
        [vector::apply(graph, r_p, parent), vector::apply(graph, r_c, child)]
    }

    /// g.
    pub fn position(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Node {
        let moving = self.moving(graph, frames);
        let [u, w] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) | Geometry::Carried(_) => vector::dot(graph, u, moving.distance),
            Geometry::Angle { parent, child } => {
                let now = vector::dot(graph, u, w);
                let drawn = vector::dot(graph, parent, child);
                graph.subtract(now, drawn)
            }
            Geometry::Distance(length) => {
                let square = vector::dot(graph, moving.distance, moving.distance);
                let wanted = graph.multiply(length, length);
                let difference = graph.subtract(square, wanted);
                let two = graph.constant(2.0);
                let double = graph.multiply(two, length);
                graph.divide(difference, double)
            }
        }
    }

    /// dg/dt.
    pub fn velocity(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Node {
        let moving = self.moving(graph, frames);
        let [u, w] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) => vector::dot(graph, u, moving.relative_velocity),
            Geometry::Carried(_) => {
                let swept = vector::cross(graph, moving.turning[0], moving.distance);
                let relative = vector::subtract(graph, moving.relative_velocity, swept);
                vector::dot(graph, u, relative)
            }
            Geometry::Angle { .. } => {
                let relative = vector::subtract(graph, moving.turning[1], moving.turning[0]);
                let about = vector::cross(graph, w, u);
                vector::dot(graph, relative, about)
            }
            Geometry::Distance(length) => {
                let rate = vector::dot(graph, moving.distance, moving.relative_velocity);
                graph.divide(rate, length)
            }
        }
    }

    /// What multiplier 1 does: force and moment on the child at its attachment (ground axes), and its opposite on the
    /// parent.
    fn load(&self, graph: &mut Graph, frames: &[FrameMotion]) -> (Vector, Vector) {
        let zero = vector::zero(graph);
        let [u, w] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) | Geometry::Carried(_) => (u, zero),
            Geometry::Angle { .. } => (zero, vector::cross(graph, w, u)),
            Geometry::Distance(length) => {
                let distance = self.moving(graph, frames).distance;
                let one = graph.constant(1.0);
                let inverse = graph.divide(one, length);
                (vector::scale(graph, inverse, distance), zero)
            }
        }
    }

    /// Wrenches of `multiplier` on the links.
    pub fn wrenches(&self, graph: &mut Graph, frames: &[FrameMotion], multiplier: Node) -> Vec<(usize, Wrench)> {
        let (force, moment) = self.load(graph, frames);
        let force = vector::scale(graph, multiplier, force);
        let moment = vector::scale(graph, multiplier, moment);
        let mut parent = self.ends.parent;
        if let (Geometry::Carried(_), Some(link)) = (self.geometry, parent.link) {
            // The point of the parent that the child's attachment touches.
            let distance = self.moving(graph, frames).distance;
            let arm = vector::apply_transposed(graph, frames[link].orientation, distance);
            parent.offset = vector::add(graph, parent.offset, arm);
        }
        let reversed = (vector::negate(graph, force), vector::negate(graph, moment));
        let mut wrenches = Vec::new();
        for (end, (force, moment)) in [(parent, reversed), (self.ends.child, (force, moment))] {
            let Some(link) = end.link else { continue };
            let orientation = frames[link].orientation;
            let force = vector::apply_transposed(graph, orientation, force);
            let moment = vector::apply_transposed(graph, orientation, moment);
            let lever = vector::cross(graph, end.offset, force);
            wrenches.push((link, Wrench { moment: vector::add(graph, moment, lever), force }));
        }
        wrenches
    }

    /// Force or moment on the child per multiplier 1, ground axes.
    pub fn reaction(&self, graph: &mut Graph, frames: &[FrameMotion], is_moment: bool) -> Vector {
        let (force, moment) = self.load(graph, frames);
        if is_moment { moment } else { force }
    }
}

/// A force element on an axis of a joint that closes a loop: the coordinate follows from the bodies' positions.
pub(super) fn at_closing_joint(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    force: &Force,
    (joint, axis): (usize, usize),
) -> Result<ForceGeometry, Diagnostic> {
    match closing_coordinate(graph, study, tree, frames, (joint, axis)) {
        Some(geometry) => Ok(geometry),
        None => {
            let joint = &study.joints[joint];
            let message = format!("force `{}` acts on joint `{}`, which closes a loop", force.name, joint.name);
            Err(Diagnostic::error(Code::CLOSED_LOOP, message)
                .label(force.span, "its coordinate is not known there")
                .secondary(joint.span, "closes the loop")
                .help("let it act between the bodies (`A -> B along z`), or declare another joint of the loop last"))
        }
    }
}

/// Coordinate, rate and effect of an axis of a closing joint; for joints with at most one shift and one turn about the same
/// axis.
pub(super) fn closing_coordinate(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    (index, at): (usize, usize),
) -> Option<ForceGeometry> {
    let joint = &study.joints[index];
    if !matches!(joint.kind, JointKind::Prismatic | JointKind::Revolute | JointKind::Cylindrical) {
        return None;
    }
    let motion = joint.axes.get(at)?.motion;
    let ends = Ends { parent: tree.place(graph, &joint.parent), child: tree.place(graph, &joint.child) };
    let axis = vector::constant(graph, motion.direction());
    let axis = vector::apply(graph, ends.parent.rotation, axis);
    let [r_p, r_c] = [ends.parent, ends.child].map(|end| kinematics::orientation(graph, frames, end.link));
    let row = Row {
        joint: index,
        holds: String::new(),
        direction: Direction::Distance,
        ends,
        geometry: Geometry::Carried(axis),
    };
    if matches!(motion, AxisMotion::Shift(_)) {
        let coordinate = row.position(graph, frames);
        let rate = row.velocity(graph, frames);
        let one = graph.constant(1.0);
        let effect = Effect::Links(row.wrenches(graph, frames, one));
        return Some(ForceGeometry { coordinate, rate, effect });
    }
    let [across, beyond] = vector::perpendicular(motion.direction()).map(|v| {
        let v = vector::constant(graph, v);
        vector::apply(graph, ends.parent.rotation, v)
    });
    let turned = vector::apply(graph, r_c, across);
    let [x, y] = [across, beyond].map(|v| {
        let v = vector::apply(graph, r_p, v);
        vector::dot(graph, v, turned)
    });
    let coordinate = graph.binary(Binary::Atan2, y, x);
    let in_ground = vector::apply(graph, r_p, axis);
    let [slow, fast] = row.moving(graph, frames).turning;
    let relative = vector::subtract(graph, fast, slow);
    let rate = vector::dot(graph, in_ground, relative);
    let mut wrenches = Vec::new();
    for (end, sign) in [(ends.parent, -1.0), (ends.child, 1.0)] {
        let Some(link) = end.link else { continue };
        let sign = graph.constant(sign);
        let moment = vector::scale(graph, sign, in_ground);
        let moment = vector::apply_transposed(graph, frames[link].orientation, moment);
        wrenches.push((link, Wrench { moment, force: vector::zero(graph) }));
    }
    Some(ForceGeometry { coordinate, rate, effect: Effect::Links(wrenches) })
}
