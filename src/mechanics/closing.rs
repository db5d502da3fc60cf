//! Coordinates of joints that close loops: they follow from the bodies' positions.

use super::articulated::Wrench;
use super::forces::{Effect, ForceGeometry, opposite_moments};
use super::kinematics::{self, FrameMotion};
use super::loops::Ends;
use super::topology::Tree;
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::Graph;
use crate::expression::vector::{self, Vector};
use crate::study::{AxisMotion, Force, Joint, Study};

/// A force element on an axis of a joint that closes a loop.
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

/// Coordinate, rate and effect of an axis of a closing joint. Known where each coordinate can be read off by itself: shifts
/// at right angles that come first, behind them one turn or two at right angles.
pub(super) fn closing_coordinate(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    (index, at): (usize, usize),
) -> Option<ForceGeometry> {
    let joint = &study.joints[index];
    let ends = Ends::new(graph, tree, joint);
    if ends.is_swapped || joint.rotation.is_some() || !is_rectangular(joint) {
        return None;
    }
    let turns: Vec<usize> =
        (0..joint.axes.len()).filter(|&i| matches!(joint.axes[i].motion, AxisMotion::Turn(_))).collect();
    match (joint.axes.get(at)?.motion, turns.as_slice()) {
        (AxisMotion::Shift(axis), _) => Some(shift(graph, frames, &ends, axis)),
        (AxisMotion::Turn(axis), [_]) => {
            let [across, beyond] = vector::perpendicular(axis);
            let [near_across, far_across] = ends.carried(graph, across);
            let [near_beyond, _] = ends.carried(graph, beyond);
            let [across, turned] = ends.in_ground(graph, frames, [near_across, far_across]);
            let [beyond, _] = ends.in_ground(graph, frames, [near_beyond, far_across]);
            let [axis, _] = ends.carried(graph, axis);
            let [axis, _] = ends.in_ground(graph, frames, [axis, axis]);
            Some(turn(graph, frames, &ends, axis, [across, beyond, turned]))
        }
        (AxisMotion::Turn(axis), &[first, second]) => {
            let [a, b] = [first, second].map(|turn| joint.axes[turn].motion.direction());
            let [a_near, a_far] = ends.carried(graph, a);
            let [b_near, b_far] = ends.carried(graph, b);
            let [a_near, a_far] = ends.in_ground(graph, frames, [a_near, a_far]);
            let [b_near, b_far] = ends.in_ground(graph, frames, [b_near, b_far]);
            // The first turn takes the second axis along; the second turns the far body's image of the first axis.
            Some(if at == first {
                let beyond = vector::cross(graph, a_near, b_near);
                turn(graph, frames, &ends, a_near, [b_near, beyond, b_far])
            } else {
                debug_assert_eq!(axis, b);
                let beyond = vector::cross(graph, b_far, a_near);
                turn(graph, frames, &ends, b_far, [a_near, beyond, a_far])
            })
        }
        _ => None,
    }
}

/// Shifts at right angles to each other, turns as well.
fn is_rectangular(joint: &Joint) -> bool {
    let motions: Vec<AxisMotion> = joint.axes.iter().map(|axis| axis.motion).collect();
    let cosine = |a: AxisMotion, b: AxisMotion| -> f64 {
        a.direction().iter().zip(b.direction()).map(|(a, b)| a * b).sum::<f64>().abs()
    };
    motions
        .iter()
        .enumerate()
        .all(|(i, &a)| motions[..i].iter().all(|&b| a.motion() != b.motion() || cosine(a, b) < 1e-12))
}

/// How far the far end is shifted along an axis of the near one.
fn shift(graph: &mut Graph, frames: &[FrameMotion], ends: &Ends, axis: [f64; 3]) -> ForceGeometry {
    let [near, _] = ends.carried(graph, axis);
    let row = ends.along(near);
    let coordinate = row.position(graph, frames);
    let rate = row.velocity(graph, frames);
    let one = graph.constant(1.0);
    ForceGeometry { coordinate, rate, effect: Effect::Links(row.wrenches(graph, frames, one)) }
}

/// How far `turned` has turned about `axis` from `across` towards `beyond` (ground axes).
fn turn(
    graph: &mut Graph,
    frames: &[FrameMotion],
    ends: &Ends,
    axis: Vector,
    [across, beyond, turned]: [Vector; 3],
) -> ForceGeometry {
    let coordinate = kinematics::angle(graph, [across, beyond], turned);
    let links = [ends.near.link, ends.far.link];
    let [slow, fast] = links.map(|link| kinematics::angular_velocity(graph, frames, link));
    let relative = vector::subtract(graph, fast, slow);
    let rate = vector::dot(graph, axis, relative);
    let wrenches: Vec<(usize, Wrench)> = opposite_moments(graph, frames, links, axis);
    ForceGeometry { coordinate, rate, effect: Effect::Links(wrenches) }
}
