//! The spanning tree: which joint carries which body.

use super::elastic::{self, Modal};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::vector::{self, Matrix, Vector};
use crate::expression::{Graph, Node, Symbol};
use crate::study::{Attachment, AxisMotion, ForcePlace, Joint, JointSymbols, RotationSymbols, Study};
use std::collections::VecDeque;

/// One single motion: a frame that shifts along or turns about a constant axis relative to its predecessor. A joint
/// with several freedoms becomes a chain of links, all but the last without bodies. All links are parallel to the
/// ground in the reference configuration.
#[derive(Clone, Debug)]
pub(super) struct Link {
    /// `None`: ground.
    pub predecessor: Option<usize>,
    pub joint: usize,
    pub coordinate: Coordinate,
    pub axis: Axis,
    /// This link's origin at coordinate zero, in predecessor axes from the predecessor's origin.
    pub offset: Vector,
    /// Bodies that move with this frame, in order of the walk from ground.
    pub bodies: Vec<usize>,
}

/// Motion per unit of the coordinate's rate, in the axes of the link (and of its predecessor: it is invariant).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Axis {
    Turn(Vector),
    Shift(Vector),
}

/// What determines the motion along the axis.
#[derive(Clone, Copy, Debug)]
pub(super) enum Coordinate {
    /// A state, index of the axis within the joint.
    Free { symbols: JointSymbols, at: usize },
    /// Position, velocity, acceleration are given.
    Prescribed { symbols: JointSymbols, at: usize, motion: [Node; 3] },
    /// One of the three components of a free rotation, along the axes (columns of `axes`) of the joint's child. Walked
    /// from parent to child they are fixed in the frame, and the first carries the whole rotation; walked from child to
    /// parent they are fixed in the predecessor, and the rotation follows behind the last.
    Rotation { symbols: RotationSymbols, component: usize, axes: Matrix, is_reversed: bool },
    /// The turned frame behind the components of a reversed free rotation; no motion of its own.
    Turned { symbols: RotationSymbols, axes: Matrix },
    /// No motion; only there because what it transmits is asked for.
    Weld,
    /// The coordinate of a mode of an elastic body. The frame does not move by it; frames of the body follow.
    Mode { symbols: JointSymbols, body: usize, number: usize },
    /// A frame of an elastic body: a sum of modal coordinates, with index into [`Tree::weights`].
    Follower { position: Node, velocity: Node, weights: usize },
}

impl Link {
    /// Symbols of velocity and acceleration, where the motion is free.
    pub fn free_symbols(&self) -> Option<(Symbol, Symbol)> {
        match self.coordinate {
            Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
                Some((symbols.velocity, symbols.acceleration))
            }
            Coordinate::Rotation { symbols, component, .. } => {
                Some((symbols.velocity[component], symbols.acceleration[component]))
            }
            Coordinate::Prescribed { .. }
            | Coordinate::Turned { .. }
            | Coordinate::Weld
            | Coordinate::Follower { .. } => None,
        }
    }

    /// Rate of the coordinate (component of the relative velocity).
    pub fn rate(&self, graph: &mut Graph) -> Node {
        match self.coordinate {
            Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => graph.variable(symbols.velocity),
            Coordinate::Follower { velocity, .. } => velocity,
            Coordinate::Rotation { symbols, component, .. } => graph.variable(symbols.velocity[component]),
            Coordinate::Prescribed { motion, .. } => motion[1],
            Coordinate::Turned { .. } | Coordinate::Weld => graph.constant(0.0),
        }
    }
}

/// Where a body sits: frame (`None`: ground), the body's origin in the frame's axes, body axes to frame axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub link: Option<usize>,
    pub offset: Vector,
    pub rotation: Matrix,
}

/// Links in an order in which predecessors come first.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub links: Vec<Link>,
    /// Per body of the study.
    pub seats: Vec<Seat>,
    /// Per body: where it sits undeformed.
    pub undeformed: Vec<Seat>,
    /// Per body, per frame of an elastic one: where it is, if anything stands on it.
    pub frames: Vec<Vec<Option<Seat>>>,
    pub modal: Vec<Modal>,
    /// Links of modes with their weights, per frame's coordinate.
    pub weights: Vec<Vec<(usize, Node)>>,
    /// Per joint of the study; empty for fixed joints and those that close loops.
    pub links_of_joint: Vec<Vec<usize>>,
    /// Joints in the order of the walk, with the body each carries.
    pub walk: Vec<(usize, usize)>,
}

impl Tree {
    /// The frame and the position in it of a point of the study.
    pub fn place(&self, graph: &mut Graph, point: &Attachment) -> Seat {
        let frames = point.body.and_then(|body| self.frames.get(body));
        if let Some(Some(seat)) = point.frame.and_then(|frame| frames?.get(frame)) {
            return *seat;
        }
        let seat = self.seat(graph, point.body);
        let turned = vector::apply(graph, seat.rotation, point.position);
        Seat { offset: vector::add(graph, seat.offset, turned), ..seat }
    }

    pub fn seat(&self, graph: &mut Graph, body: Option<usize>) -> Seat {
        match body {
            Some(body) => self.seats[body],
            None => ground_seat(graph),
        }
    }

    /// The link that moves along axis `at` of a joint.
    pub fn link_of_axis(&self, joint: usize, at: usize) -> Option<usize> {
        self.links_of_joint[joint].iter().copied().find(|&link| match self.links[link].coordinate {
            Coordinate::Free { at: own, .. } | Coordinate::Prescribed { at: own, .. } => own == at,
            _ => false,
        })
    }

    /// Whether the walk went from the joint's child to its parent.
    pub fn is_reversed(&self, study: &Study, joint: usize) -> bool {
        self.walk.iter().any(|&(number, body)| number == joint && study.joints[joint].parent.body == Some(body))
    }
}

fn ground_seat(graph: &mut Graph) -> Seat {
    Seat { link: None, offset: vector::zero(graph), rotation: vector::identity(graph) }
}

/// Walks from ground over the joints that carry bodies, breadth first in order of declaration.
pub(super) fn spanning_tree(study: &Study, graph: &mut Graph) -> Result<Tree, Vec<Diagnostic>> {
    let ground = study.bodies.len();
    let index = |attachment: &Attachment| attachment.body.unwrap_or(ground);
    let mut joints_at = vec![Vec::new(); ground + 1];
    for (number, joint) in study.joints.iter().enumerate().filter(|(_, joint)| !joint.closes_loop) {
        joints_at[index(&joint.parent)].push(number);
        joints_at[index(&joint.child)].push(number);
    }
    let mut seats: Vec<Option<Seat>> = vec![None; ground + 1];
    seats[ground] = Some(ground_seat(graph));
    let mut tree = Tree {
        links: vec![],
        seats: vec![],
        undeformed: vec![ground_seat(graph); study.bodies.len()],
        frames: vec![vec![]; study.bodies.len()],
        modal: vec![],
        weights: vec![],
        links_of_joint: vec![vec![]; study.joints.len()],
        walk: vec![],
    };
    let used = used_frames(study);
    let mut queue = VecDeque::from([ground]);
    while let Some(from) = queue.pop_front() {
        for &number in &joints_at[from] {
            let joint = &study.joints[number];
            let is_reversed = index(&joint.parent) != from;
            let to = if is_reversed { index(&joint.parent) } else { index(&joint.child) };
            let (Some(seat), None) = (seats[from], seats[to]) else { continue };
            let is_asked = study.reactions.iter().any(|reaction| reaction.joint == number);
            let far = if is_reversed { &joint.parent } else { &joint.child };
            let near = if is_reversed { &joint.child } else { &joint.parent };
            let seat = tree.place_from(graph, seat, near);
            let base = tree.attach(graph, study, (number, joint), (is_reversed, is_asked), seat, (to, far));
            seats[to] = Some(tree.settle(graph, study, number, base, (to, far), &used[to]));
            queue.push_back(to);
        }
    }
    let mut errors = Vec::new();
    for (body, seat) in study.bodies.iter().zip(&seats) {
        match seat {
            Some(seat) => tree.seats.push(*seat),
            None => errors.push(
                Diagnostic::error(Code::UNCONNECTED_BODY, format!("body `{}` is not connected to ground", body.name))
                    .label(body.span, "no chain of joints leads from ground to here")
                    .help(format!("add a joint, for example `joint {0}_guide: prismatic(z) ground -> {0}`", body.name)),
            ),
        }
    }
    if errors.is_empty() { Ok(tree) } else { Err(errors) }
}

/// Per body, per frame of an elastic one: something stands on it. The body itself always counts.
fn used_frames(study: &Study) -> Vec<Vec<bool>> {
    let frames = |body: &crate::study::Body| body.elastic.as_ref().map_or(0, |elastic| elastic.frames.len());
    let mut used: Vec<Vec<bool>> =
        study.bodies.iter().map(|body| (0..frames(body)).map(|frame| frame == 0).collect()).collect();
    let mut mark = |end: &Attachment| {
        if let (Some(body), Some(frame)) = (end.body, end.frame)
            && let Some(slot) = used[body].get_mut(frame)
        {
            *slot = true;
        }
    };
    study.joints.iter().for_each(|joint| [&joint.parent, &joint.child].into_iter().for_each(&mut mark));
    for force in &study.forces {
        if let ForcePlace::Between { first, second, .. } = &force.place {
            mark(first);
            mark(second);
        }
    }
    study.point_quantities.iter().for_each(|quantity| mark(&quantity.point));
    used
}

impl Tree {
    /// The frame and position of a joint's near end, whose body sits at `seat`.
    fn place_from(&self, graph: &mut Graph, seat: Seat, near: &Attachment) -> Seat {
        let frames = near.body.map_or(&[][..], |body| &self.frames[body][..]);
        if let Some(Some(seat)) = near.frame.and_then(|frame| frames.get(frame)) {
            return *seat;
        }
        let turned = vector::apply(graph, seat.rotation, near.position);
        Seat { offset: vector::add(graph, seat.offset, turned), ..seat }
    }

    /// Where body `to` is, given its undeformed seat on the joint that carries it at `far`.
    fn settle(
        &mut self,
        graph: &mut Graph,
        study: &Study,
        joint: usize,
        base: Seat,
        (to, far): (usize, &Attachment),
        used: &[bool],
    ) -> Seat {
        let Some(body_elastic) = study.bodies[to].elastic.as_ref() else {
            if let Some(link) = base.link {
                self.links[link].bodies.push(to);
            }
            self.undeformed[to] = base;
            return base;
        };
        let carried_at = far.frame.unwrap_or_default();
        let seats = elastic::attach(graph, self, (study, to, joint), body_elastic, (base, carried_at), used);
        if let Some(link) = seats.undeformed.link {
            self.links[link].bodies.push(to);
        }
        self.undeformed[to] = seats.undeformed;
        let own = seats.frames.first().copied().flatten().unwrap_or(seats.undeformed);
        self.frames[to] = seats.frames;
        own
    }

    /// Adds the motions of `joint`, whose near end is at `place`; returns where body `to` sits.
    fn attach(
        &mut self,
        graph: &mut Graph,
        study: &Study,
        (number, joint): (usize, &Joint),
        (is_reversed, is_asked): (bool, bool),
        place: Seat,
        (to, far): (usize, &Attachment),
    ) -> Seat {
        self.walk.push((number, to));
        let (parent_rotation, rotation) = rotations(graph, joint, is_reversed, place.rotation);
        let mut frame = place.link;
        let mut offset = place.offset;
        let child_rotation = if is_reversed { place.rotation } else { rotation };
        let mut motions = motions(graph, study, joint, is_reversed, (parent_rotation, child_rotation));
        if motions.is_empty() && is_asked {
            motions.push((Axis::Turn(vector::zero(graph)), Coordinate::Weld));
        }
        for (axis, coordinate) in motions {
            self.links.push(Link { predecessor: frame, joint: number, coordinate, axis, offset, bodies: vec![] });
            frame = Some(self.links.len() - 1);
            self.links_of_joint[number].push(self.links.len() - 1);
            offset = vector::zero(graph);
        }
        let arm = vector::apply(graph, rotation, far.position);
        Seat { link: frame, offset: vector::subtract(graph, offset, arm), rotation }
    }
}

/// Seat rotations of the parent and of the outer body, from that of the inner body.
fn rotations(graph: &mut Graph, joint: &Joint, is_reversed: bool, inner: Matrix) -> (Matrix, Matrix) {
    let outer = match joint.orientation {
        None => inner,
        Some(matrix) => {
            let matrix = if is_reversed { vector::transpose(matrix) } else { matrix };
            vector::multiply(graph, inner, matrix)
        }
    };
    if is_reversed { (outer, outer) } else { (inner, outer) }
}

/// The motions of a joint, one after the other. Walked from child to parent they are the opposite ones in opposite
/// order.
fn motions(
    graph: &mut Graph,
    study: &Study,
    joint: &Joint,
    is_reversed: bool,
    (parent_rotation, child_rotation): (Matrix, Matrix),
) -> Vec<(Axis, Coordinate)> {
    let mut result = Vec::new();
    for (at, axis) in joint.axes.iter().enumerate() {
        let direction = vector::constant(graph, axis.motion.direction());
        let mut direction = vector::apply(graph, parent_rotation, direction);
        if is_reversed {
            direction = vector::negate(graph, direction);
        }
        let link_axis = match axis.motion {
            AxisMotion::Shift(_) => Axis::Shift(direction),
            AxisMotion::Turn(_) => Axis::Turn(direction),
        };
        let symbols = axis.symbols;
        let coordinate = match axis.prescribed {
            None => Coordinate::Free { symbols, at },
            Some(position) => {
                let velocity = graph.differentiate(&[position], study.time)[0];
                let acceleration = graph.differentiate(&[velocity], study.time)[0];
                Coordinate::Prescribed { symbols, at, motion: [position, velocity, acceleration] }
            }
        };
        result.push((link_axis, coordinate));
    }
    if is_reversed {
        result.reverse();
    }
    if let Some(symbols) = joint.rotation {
        let axes = child_rotation;
        let component = |component: usize| {
            let axis = axes.map(|row| row[component]);
            (axis, Coordinate::Rotation { symbols, component, axes, is_reversed })
        };
        let components = (0..3).map(component);
        if is_reversed {
            let mut turning: Vec<_> =
                components.map(|(axis, own)| (Axis::Turn(vector::negate(graph, axis)), own)).collect();
            turning.push((Axis::Turn(vector::zero(graph)), Coordinate::Turned { symbols, axes }));
            result.splice(0..0, turning);
        } else {
            result.extend(components.map(|(axis, own)| (Axis::Turn(axis), own)));
        }
    }
    result
}
