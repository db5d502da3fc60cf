//! The motions of a joint that closes a loop, one after the other, as its two ends see them.
//!
//! Prescribed motions become part of the ends: shifts move the end's point, turns its axes, from either end inwards up
//! to the first turn that is free. What is left between are free turns (and prescribed ones between those).

use super::kinematics::{self, FrameMotion};
use super::topology::{Seat, Tree};
use crate::expression::vector::{self, Matrix, Vector};
use crate::expression::{Graph, Node};
use crate::study::{AxisMotion, Joint};

/// The two ends of a closing joint as the study attaches them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub near: Seat,
    pub far: Seat,
    /// The joint's axes (the parent's, at the joint's coordinates zero) to the axes of the links of either end.
    pub near_axes: Matrix,
    pub far_axes: Matrix,
}

impl Ends {
    /// From parent to child, or, `is_swapped`, from child to parent.
    pub fn new(graph: &mut Graph, tree: &Tree, joint: &Joint, is_swapped: bool) -> Self {
        let [parent, child] = [&joint.parent, &joint.child].map(|end| tree.place(graph, end));
        let child_axes = match joint.orientation {
            None => child.rotation,
            Some(matrix) => vector::multiply(graph, child.rotation, vector::transpose(matrix)),
        };
        if is_swapped {
            Ends { near: child, far: parent, near_axes: child_axes, far_axes: parent.rotation }
        } else {
            Ends { near: parent, far: child, near_axes: parent.rotation, far_axes: child_axes }
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

/// One motion on the way from the near end to the far one.
#[derive(Clone, Copy, Debug)]
struct Step {
    motion: AxisMotion,
    given: Option<Node>,
}

impl Step {
    fn is_free_turn(&self) -> bool {
        self.given.is_none() && matches!(self.motion, AxisMotion::Turn(_))
    }

    fn is_free_shift(&self) -> bool {
        self.given.is_none() && matches!(self.motion, AxisMotion::Shift(_))
    }
}

/// A free shift as one of the ends sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeShift {
    /// In the joint's axes, and these axes in those of the end's link.
    pub direction: [f64; 3],
    pub axes: Matrix,
}

/// A closing joint with its prescribed motions in its ends.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// As attached.
    pub attached: Ends,
    /// Moved and turned by what is prescribed.
    pub ends: Ends,
    pub is_swapped: bool,
    pub leading: Vec<FreeShift>,
    pub trailing: Vec<FreeShift>,
    /// Free turns in their order.
    pub turns: Vec<[f64; 3]>,
    /// Prescribed turns between the first free turn and the last: rotation of the axes behind against those before.
    pub between: Option<Matrix>,
}

impl Chain {
    /// `None`: shifts between free turns.
    pub fn new(graph: &mut Graph, tree: &Tree, joint: &Joint) -> Option<Self> {
        let mut steps: Vec<Step> =
            joint.axes.iter().map(|axis| Step { motion: axis.motion, given: axis.prescribed }).collect();
        let first_turn = steps.iter().position(Step::is_free_turn).unwrap_or(steps.len());
        // The near end is one that shifts.
        let is_swapped = joint.rotation.is_none()
            && steps.iter().any(Step::is_free_shift)
            && !steps[..first_turn].iter().any(Step::is_free_shift);
        if is_swapped {
            steps.reverse();
            for step in &mut steps {
                step.given = step.given.map(|given| graph.negate(given));
            }
        }
        let attached = Ends::new(graph, tree, joint, is_swapped);
        let turns: Vec<usize> = (0..steps.len()).filter(|&i| steps[i].is_free_turn()).collect();
        let (first, last) = match (turns.first(), turns.last(), joint.rotation) {
            (Some(&first), _, Some(_)) => (first, steps.len()),
            (Some(&first), Some(&last), None) => (first, last + 1),
            _ => (steps.len(), steps.len()),
        };
        let middle = &steps[first..last];
        if middle.iter().any(|step| matches!(step.motion, AxisMotion::Shift(_))) {
            return None;
        }
        let mut ends = attached;
        let leading = take_up(graph, &mut ends.near, &mut ends.near_axes, steps[..first].iter().copied(), 1.0);
        let behind = steps[last..].iter().rev().copied();
        let trailing = take_up(graph, &mut ends.far, &mut ends.far_axes, behind, -1.0);
        let between = middle.iter().any(|step| step.given.is_some()).then(|| rotation_of(graph, middle));
        let turns = turns.into_iter().map(|i| steps[i].motion.direction()).collect();
        Some(Self { attached, ends, is_swapped, leading, trailing, turns, between })
    }

    /// The directions in which the ends are parallel: three without a turn, the axis of a single one.
    pub fn parallel(&self) -> Vec<[f64; 3]> {
        match self.turns.as_slice() {
            [] => (0..3).map(unit).collect(),
            [axis] => vec![*axis],
            _ => vec![],
        }
    }
}

/// Moves an end by the prescribed ones of its steps (`sign` -1: against their sense); returns the free shifts among
/// them.
fn take_up(
    graph: &mut Graph,
    seat: &mut Seat,
    axes: &mut Matrix,
    steps: impl Iterator<Item = Step>,
    sign: f64,
) -> Vec<FreeShift> {
    let mut free = Vec::new();
    for step in steps {
        match (step.motion, step.given) {
            (AxisMotion::Shift(direction), None) => free.push(FreeShift { direction, axes: *axes }),
            (AxisMotion::Shift(direction), Some(given)) => {
                let direction = vector::constant(graph, direction);
                let along = vector::apply(graph, *axes, direction);
                let sign = graph.constant(sign);
                let way = graph.multiply(sign, given);
                let moved = vector::scale(graph, way, along);
                seat.offset = vector::add(graph, seat.offset, moved);
            }
            (AxisMotion::Turn(direction), Some(given)) => {
                let direction = vector::constant(graph, direction);
                let sign = graph.constant(sign);
                let angle = graph.multiply(sign, given);
                let turn = vector::rotation(graph, direction, angle);
                *axes = vector::multiply(graph, *axes, turn);
            }
            (AxisMotion::Turn(_), None) => {}
        }
    }
    free
}

fn rotation_of(graph: &mut Graph, steps: &[Step]) -> Matrix {
    let mut matrix = vector::identity(graph);
    for step in steps {
        let Some(angle) = step.given else { continue };
        let axis = vector::constant(graph, step.motion.direction());
        let turn = vector::rotation(graph, axis, angle);
        matrix = vector::multiply(graph, matrix, turn);
    }
    matrix
}

pub(super) fn unit(index: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == index { 1.0 } else { 0.0 })
}
