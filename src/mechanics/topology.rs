//! The spanning tree: which joint carries which body.

use super::vector::{self, Vector};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::Graph;
use crate::study::{Attachment, Joint, JointKind, JointSymbols, Study};
use std::collections::VecDeque;

/// One degree of freedom: a frame that shifts along or turns about a constant axis relative to its predecessor. A joint
/// with several axes becomes a chain of links, all but the last without bodies.
#[derive(Clone, Debug)]
pub(super) struct Link {
    /// `None`: ground.
    pub predecessor: Option<usize>,
    pub joint: usize,
    pub symbols: JointSymbols,
    pub axis: Axis,
    /// This link's origin at coordinate zero, in predecessor axes from the predecessor's origin.
    pub offset: Vector,
    /// Bodies that move with this frame, in order of the walk from ground.
    pub bodies: Vec<usize>,
}

/// Motion per unit of the coordinate's rate, in the axes of the link (and of its predecessor: it is invariant).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Axis {
    Turn([f64; 3]),
    Shift([f64; 3]),
}

/// Where a body sits: frame (`None`: ground) and the body's origin in the frame's axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub link: Option<usize>,
    pub offset: Vector,
}

/// Links in an order in which predecessors come first.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub links: Vec<Link>,
    /// Per body of the study.
    pub seats: Vec<Seat>,
    /// Per joint of the study; `None` for fixed joints.
    pub link_of_joint: Vec<Option<usize>>,
    /// Joints in the order of the walk, with the body each carries.
    pub walk: Vec<(usize, usize)>,
}

impl Tree {
    /// The frame and the position in it of a point of the study.
    pub fn place(&self, graph: &mut Graph, point: &Attachment) -> Seat {
        match point.body {
            None => Seat { link: None, offset: point.position },
            Some(body) => {
                let seat = self.seats[body];
                Seat { link: seat.link, offset: vector::add(graph, seat.offset, point.position) }
            }
        }
    }
}

/// Walks from ground over the joints, breadth first in order of declaration.
pub(super) fn spanning_tree(study: &Study, graph: &mut Graph) -> Result<Tree, Vec<Diagnostic>> {
    let ground = study.bodies.len();
    let index = |attachment: &Attachment| attachment.body.unwrap_or(ground);
    let mut joints_at = vec![Vec::new(); ground + 1];
    let mut errors = Vec::new();
    // The joint declared last in a loop is the one that closes it.
    let mut group: Vec<usize> = (0..=ground).collect();
    for (number, joint) in study.joints.iter().enumerate() {
        let (kept, merged) = (group[index(&joint.parent)], group[index(&joint.child)]);
        if kept == merged {
            errors.push(closed_loop(joint));
            continue;
        }
        group.iter_mut().filter(|member| **member == merged).for_each(|member| *member = kept);
        joints_at[index(&joint.parent)].push(number);
        joints_at[index(&joint.child)].push(number);
    }
    let mut seats: Vec<Option<Seat>> = vec![None; ground + 1];
    seats[ground] = Some(Seat { link: None, offset: vector::zero(graph) });
    let mut tree = Tree { links: vec![], seats: vec![], link_of_joint: vec![None; study.joints.len()], walk: vec![] };
    let mut queue = VecDeque::from([ground]);
    while let Some(from) = queue.pop_front() {
        for &number in &joints_at[from] {
            let joint = &study.joints[number];
            let is_reversed = index(&joint.parent) != from;
            let to = if is_reversed { index(&joint.parent) } else { index(&joint.child) };
            let (Some(seat), None) = (seats[from], seats[to]) else { continue };
            seats[to] = Some(tree.attach(graph, (number, joint), is_reversed, seat, to));
            queue.push_back(to);
        }
    }
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

fn closed_loop(joint: &Joint) -> Diagnostic {
    Diagnostic::error(Code::CLOSED_LOOP, format!("joint `{}` closes a kinematic loop", joint.name))
        .label(joint.span, "both bodies are already connected by other joints")
        .help("only trees of joints are supported: remove this joint or replace it by a stiff force element")
}

impl Tree {
    /// Adds what `joint` carries; returns where body `to` sits.
    fn attach(
        &mut self,
        graph: &mut Graph,
        (number, joint): (usize, &Joint),
        is_reversed: bool,
        seat: Seat,
        to: usize,
    ) -> Seat {
        let (near, far) = if is_reversed { (&joint.child, &joint.parent) } else { (&joint.parent, &joint.child) };
        self.walk.push((number, to));
        let mut frame = seat.link;
        let mut offset = vector::add(graph, seat.offset, near.position);
        for (axis, symbols) in axes(joint.kind, is_reversed).into_iter().zip(joint.coordinate) {
            self.links.push(Link { predecessor: frame, joint: number, symbols, axis, offset, bodies: vec![] });
            frame = Some(self.links.len() - 1);
            self.link_of_joint[number] = frame;
            offset = vector::zero(graph);
        }
        if let Some(link) = frame {
            self.links[link].bodies.push(to);
        }
        Seat { link: frame, offset: vector::subtract(graph, offset, far.position) }
    }
}

/// The axes a joint moves along, one after the other. Walked from child to parent the motion is the opposite one.
fn axes(kind: JointKind, is_reversed: bool) -> Vec<Axis> {
    let sign = if is_reversed { -1.0 } else { 1.0 };
    match kind {
        JointKind::Fixed => vec![],
        JointKind::Prismatic { axis } => vec![Axis::Shift(axis.map(|x| sign * x))],
        JointKind::Revolute { axis } => vec![Axis::Turn(axis.map(|x| sign * x))],
    }
}
