//! Joints that close kinematic loops, as constraints on position and velocity level.
//!
//! A row is the dot product of two vectors that move with the bodies; its rate is a linear function of the velocities, and
//! a multiplier acts on the bodies by exactly the transpose of that function.

use super::articulated::Wrench;
use super::kinematics::{self, FrameMotion};
use super::topology::{Seat, Tree};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::vector::{self, Matrix, Vector};
use crate::expression::{Graph, Node};
use crate::study::{AxisMotion, Joint, JointKind, Study};

/// The two ends of a closing joint, in the order in which its shifts come before its turns: from parent to child, or, of a
/// joint that turns first, from child to parent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub near: Seat,
    pub far: Seat,
    /// The joint's axes (the parent's, at the joint's coordinates zero) to the axes of the links of either end.
    near_axes: Matrix,
    far_axes: Matrix,
    pub is_swapped: bool,
}

impl Ends {
    pub fn new(graph: &mut Graph, tree: &Tree, joint: &Joint) -> Self {
        let [parent, child] = [&joint.parent, &joint.child].map(|end| tree.place(graph, end));
        let child_axes = match joint.orientation {
            None => child.rotation,
            Some(matrix) => vector::multiply(graph, child.rotation, vector::transpose(matrix)),
        };
        if joint.axes.is_empty() || leading_shifts(joint.axes.iter().map(|axis| axis.motion)) {
            Ends { near: parent, far: child, near_axes: parent.rotation, far_axes: child_axes, is_swapped: false }
        } else {
            Ends { near: child, far: parent, near_axes: child_axes, far_axes: parent.rotation, is_swapped: true }
        }
    }

    /// Vectors of the links of either end in ground axes.
    pub fn in_ground(&self, graph: &mut Graph, frames: &[FrameMotion], [near, far]: [Vector; 2]) -> [Vector; 2] {
        let [r_near, r_far] = [self.near, self.far].map(|end| kinematics::orientation(graph, frames, end.link));
        [vector::apply(graph, r_near, near), vector::apply(graph, r_far, far)]
    }

    /// A direction given in the joint's axes as vectors fixed to the links of either end.
    pub fn carried(&self, graph: &mut Graph, direction: [f64; 3]) -> [Vector; 2] {
        let direction = vector::constant(graph, direction);
        [self.near_axes, self.far_axes].map(|axes| vector::apply(graph, axes, direction))
    }
}

impl Ends {
    /// The distance along a direction of the near link, in the form of a constraint.
    pub fn along(&self, direction: Vector) -> Row {
        let geometry = Geometry::Carried(direction);
        Row { joint: 0, holds: String::new(), direction: Direction::Distance, ends: *self, geometry }
    }
}

/// Whether no shift comes behind a turn.
fn leading_shifts(motions: impl Iterator<Item = AxisMotion>) -> bool {
    let is_turn: Vec<bool> = motions.map(|motion| matches!(motion, AxisMotion::Turn(_))).collect();
    is_turn.is_sorted()
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
    /// A direction of the near link (link axes) times the distance vector.
    Carried(Vector),
    /// A direction of the near link times one of the far link, minus their product at the joint's coordinates zero.
    Angle { near: Vector, far: Vector, drawn: f64 },
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
        let ends = Ends::new(graph, tree, joint);
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
        match position_rows(graph, joint, &ends) {
            Some(positions) => positions.into_iter().chain(angle_rows(graph, joint, &ends)).for_each(add),
            None => errors.push(no_constraint_form(joint)),
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
        .label(joint.span, "it shifts on both sides of a turn")
        .help("list its shifts first, `axes(shift y, shift x, turn z)`, or its turns; or let it have one shift only")
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

/// Directions that the shifts leave held. `None`: shifts on both sides of a turn.
fn position_rows(graph: &mut Graph, joint: &Joint, ends: &Ends) -> Option<Vec<(Direction, Geometry)>> {
    let motions = || joint.axes.iter().map(|axis| axis.motion);
    if !leading_shifts(motions()) && !leading_shifts(motions().rev()) {
        return None;
    }
    let shifts: Vec<[f64; 3]> =
        motions().filter(|motion| matches!(motion, AxisMotion::Shift(_))).map(AxisMotion::direction).collect();
    let held: Vec<[f64; 3]> = match shifts.as_slice() {
        [] => {
            return Some((0..3).map(|i| fixed(graph, i)).collect());
        }
        [axis] => vector::perpendicular(*axis).to_vec(),
        [a, b] => vec![normal(*a, *b)],
        _ => vec![],
    };
    let rows = held.into_iter().map(|direction| {
        let [near, _] = ends.carried(graph, direction);
        (Direction::Shift(direction), Geometry::Carried(near))
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

/// Pairs of directions that keep the angle between them.
fn angle_rows(graph: &mut Graph, joint: &Joint, ends: &Ends) -> Vec<(Direction, Geometry)> {
    if joint.rotation.is_some() {
        return vec![];
    }
    let mut turns = turns(joint);
    if ends.is_swapped {
        turns.reverse();
    }
    // Each pair: direction of the near end, direction of the far end.
    let pairs: Vec<([f64; 3], [f64; 3])> = match turns.as_slice() {
        [] => (0..3).map(|i| (unit(i), unit((i + 1) % 3))).collect(),
        [axis] => vector::perpendicular(*axis).map(|across| (across, *axis)).to_vec(),
        [first, second] => vec![(*first, *second)],
        _ => vec![],
    };
    let rows = pairs.into_iter().map(|(of_near, of_far)| {
        let [near, _] = ends.carried(graph, of_near);
        let [_, far] = ends.carried(graph, of_far);
        let drawn: f64 = of_near.iter().zip(of_far).map(|(a, b)| a * b).sum();
        let drawn = if drawn.abs() < f64::EPSILON { 0.0 } else { drawn };
        (Direction::Turn(normal(of_near, of_far)), Geometry::Angle { near, far, drawn })
    });
    rows.collect()
}

fn turns(joint: &Joint) -> Vec<[f64; 3]> {
    let is_turn = |motion: &AxisMotion| matches!(motion, AxisMotion::Turn(_));
    joint.axes.iter().map(|axis| axis.motion).filter(is_turn).map(AxisMotion::direction).collect()
}

fn unit(index: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == index { 1.0 } else { 0.0 })
}

/// Cosines that are one where a joint is closed as meant and not turned over: rows of angles hold in both positions.
pub(super) fn upright(graph: &mut Graph, study: &Study, tree: &Tree, frames: &[FrameMotion]) -> Vec<Node> {
    let mut cosines = Vec::new();
    for joint in study.joints.iter().filter(|joint| joint.closes_loop && joint.rotation.is_none()) {
        let ends = Ends::new(graph, tree, joint);
        let kept: Vec<[f64; 3]> = match (joint.kind, turns(joint).as_slice()) {
            (JointKind::Distance, _) => vec![],
            (_, []) => (0..3).map(unit).collect(),
            (_, [axis]) => vec![*axis],
            _ => vec![],
        };
        for direction in kept {
            let directions = ends.carried(graph, direction);
            let [near, far] = ends.in_ground(graph, frames, directions);
            cosines.push(vector::dot(graph, near, far));
        }
    }
    cosines
}

/// Positions and velocities that a row needs, ground axes.
struct Moving {
    distance: Vector,
    relative_velocity: Vector,
    turning: [Vector; 2],
}

impl Row {
    fn moving(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Moving {
        let ends = [self.ends.near, self.ends.far];
        let [p, c] = ends.map(|end| kinematics::point_position(graph, frames, end));
        let [v_p, v_c] = ends.map(|end| kinematics::point_velocity(graph, frames, end));
        let turning = ends.map(|end| kinematics::angular_velocity(graph, frames, end.link));
        Moving {
            distance: vector::subtract(graph, c, p),
            relative_velocity: vector::subtract(graph, v_c, v_p),
            turning,
        }
    }

    /// Directions of the near and the far link in ground axes.
    fn directions(&self, graph: &mut Graph, frames: &[FrameMotion]) -> [Vector; 2] {
        match self.geometry {
            Geometry::Fixed(u) => [u, u],
            Geometry::Carried(u) => self.ends.in_ground(graph, frames, [u, u]),
            Geometry::Angle { near, far, .. } => self.ends.in_ground(graph, frames, [near, far]),
            Geometry::Distance(_) => [vector::zero(graph); 2],
        }
    }

    /// g.
    pub fn position(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Node {
        let moving = self.moving(graph, frames);
        let [u, w] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) | Geometry::Carried(_) => vector::dot(graph, u, moving.distance),
            Geometry::Angle { drawn, .. } => {
                let now = vector::dot(graph, u, w);
                let drawn = graph.constant(drawn);
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

    /// What multiplier 1 does: force and moment on the far body at its attachment (ground axes), and its opposite on the near
    /// one.
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
        let mut near = self.ends.near;
        if let (Geometry::Carried(_), Some(link)) = (self.geometry, near.link) {
            // The point of the near body that the far one's attachment touches.
            let distance = self.moving(graph, frames).distance;
            let arm = vector::apply_transposed(graph, frames[link].orientation, distance);
            near.offset = vector::add(graph, near.offset, arm);
        }
        let reversed = (vector::negate(graph, force), vector::negate(graph, moment));
        let mut wrenches = Vec::new();
        for (end, (force, moment)) in [(near, reversed), (self.ends.far, (force, moment))] {
            let Some(link) = end.link else { continue };
            let orientation = frames[link].orientation;
            let force = vector::apply_transposed(graph, orientation, force);
            let moment = vector::apply_transposed(graph, orientation, moment);
            let lever = vector::cross(graph, end.offset, force);
            wrenches.push((link, Wrench { moment: vector::add(graph, moment, lever), force }));
        }
        wrenches
    }

    /// Force or moment on the child per multiplier 1, at its attachment, ground axes.
    pub fn reaction(&self, graph: &mut Graph, frames: &[FrameMotion], is_moment: bool) -> Vector {
        let (force, moment) = self.load(graph, frames);
        if !self.ends.is_swapped {
            return if is_moment { moment } else { force };
        }
        // The far body is the parent; the force acts at its attachment.
        if !is_moment {
            return vector::negate(graph, force);
        }
        let distance = self.moving(graph, frames).distance;
        let by_force = vector::cross(graph, distance, force);
        let sum = vector::add(graph, moment, by_force);
        vector::negate(graph, sum)
    }
}
