//! Coordinates of joints that close loops: they follow from the bodies' positions.

use super::articulated::Wrench;
use super::chain::Ends;
use super::forces::{Effect, ForceGeometry, opposite_moments};
use super::kinematics::{self, FrameMotion};
use super::loops;
use super::topology::Tree;
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::vector::{self, Vector};
use crate::expression::{Graph, Node, Unary};
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

/// Coordinate, rate and effect of an axis of a closing joint. Known where no shift stands between turns; of three turns
/// the middle one must be at right angles to its neighbours, which are not parallel.
pub(super) fn closing_coordinate(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    (index, at): (usize, usize),
) -> Option<ForceGeometry> {
    let joint = &study.joints[index];
    match joint.axes.get(at)?.motion {
        AxisMotion::Shift(_) => shift(graph, tree, frames, joint, at),
        AxisMotion::Turn(_) if joint.rotation.is_some() => None,
        AxisMotion::Turn(_) => {
            let number = joint.axes[..at].iter().filter(|axis| is_turn(axis.motion)).count();
            turn(graph, tree, frames, joint, number)
        }
    }
}

fn is_turn(motion: AxisMotion) -> bool {
    matches!(motion, AxisMotion::Turn(_))
}

fn directions(joint: &Joint, of_turns: bool) -> Vec<[f64; 3]> {
    let motions = joint.axes.iter().map(|axis| axis.motion);
    motions.filter(|motion| is_turn(*motion) == of_turns).map(AxisMotion::direction).collect()
}

/// How far the child is shifted along an axis of the parent, or of the child where it shifts behind its turns.
fn shift(graph: &mut Graph, tree: &Tree, frames: &[FrameMotion], joint: &Joint, at: usize) -> Option<ForceGeometry> {
    let order: Vec<bool> = joint.axes.iter().map(|axis| is_turn(axis.motion)).collect();
    let is_behind = !order.is_sorted();
    if is_behind && (!order.iter().rev().is_sorted() || joint.rotation.is_some()) {
        return shift_around(graph, tree, frames, joint, at);
    }
    let ends = Ends::new(graph, tree, joint, is_behind);
    let number = joint.axes[..at].iter().filter(|axis| !is_turn(axis.motion)).count();
    let [near, _] = ends.carried(graph, reciprocal(&directions(joint, false), number));
    let row = loops::along(graph, &ends, near);
    let (coordinate, rate) = (row.position(graph, frames), row.velocity(graph, frames));
    let sign = graph.constant(if is_behind { -1.0 } else { 1.0 });
    let [coordinate, rate] = [coordinate, rate].map(|value| graph.multiply(sign, value));
    Some(ForceGeometry { coordinate, rate, effect: Effect::Links(row.wrenches(graph, frames, sign)) })
}

/// A shift where some stand before the turns, fixed to the parent, and some behind them, fixed to the child: the
/// distance of the ends is the sum of all, which reciprocal vectors tell apart.
fn shift_around(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    joint: &Joint,
    at: usize,
) -> Option<ForceGeometry> {
    let first_turn = joint.axes.iter().position(|axis| is_turn(axis.motion))?;
    let last_turn = joint.axes.iter().rposition(|axis| is_turn(axis.motion))?;
    if joint.rotation.is_some() || !joint.axes[first_turn..=last_turn].iter().all(|axis| is_turn(axis.motion)) {
        return None;
    }
    let ends = Ends::new(graph, tree, joint, false);
    let shifts: Vec<usize> = (0..joint.axes.len()).filter(|&i| !is_turn(joint.axes[i].motion)).collect();
    let sides: Vec<usize> = shifts.iter().map(|&i| usize::from(i > last_turn)).collect();
    let mut ways: Vec<Vector> = Vec::new();
    for (&shift, &side) in shifts.iter().zip(&sides) {
        let both = ends.carried(graph, joint.axes[shift].motion.direction());
        ways.push(ends.in_ground(graph, frames, both)[side]);
    }
    let number = shifts.iter().position(|&i| i == at)?;
    let reciprocals = reciprocals(graph, &ways)?;
    let seats = [ends.near, ends.far];
    let [near, far] = seats.map(|end| kinematics::point_position(graph, frames, end));
    let distance = vector::subtract(graph, far, near);
    let lengths: Vec<Node> = reciprocals.iter().map(|own| vector::dot(graph, *own, distance)).collect();
    let own = reciprocals[number];
    let [slow, fast] = seats.map(|end| kinematics::point_velocity(graph, frames, end));
    let relative = vector::subtract(graph, fast, slow);
    let mut rate = vector::dot(graph, own, relative);
    // What turns the directions takes part: a moment on the body that carries them.
    let mut moments = [vector::zero(graph); 2];
    for ((&way, &length), &side) in ways.iter().zip(&lengths).zip(&sides) {
        let shifted = vector::scale(graph, length, way);
        let moment = vector::cross(graph, own, shifted);
        moments[side] = vector::add(graph, moments[side], moment);
        let turning = kinematics::angular_velocity(graph, frames, seats[side].link);
        let share = vector::dot(graph, moment, turning);
        rate = graph.add(rate, share);
    }
    let reversed = vector::negate(graph, own);
    let mut wrenches = Vec::new();
    for ((end, force), moment) in seats.into_iter().zip([reversed, own]).zip(moments) {
        let Some(link) = end.link else { continue };
        let [force, moment] =
            [force, moment].map(|global| vector::apply_transposed(graph, frames[link].orientation, global));
        let lever = vector::cross(graph, end.offset, force);
        wrenches.push((link, Wrench { moment: vector::add(graph, moment, lever), force }));
    }
    Some(ForceGeometry { coordinate: lengths[number], rate, effect: Effect::Links(wrenches) })
}

/// Vectors whose product with one of two or three directions is 1 and with the others 0.
fn reciprocals(graph: &mut Graph, ways: &[Vector]) -> Option<Vec<Vector>> {
    let (&first, &second) = (ways.first()?, ways.get(1)?);
    let third = match ways {
        [_, _] => vector::cross(graph, first, second),
        &[_, _, third] => third,
        _ => return None,
    };
    let all = [first, second, third];
    let own = |i: usize| {
        let across = vector::cross(graph, all[(i + 1) % 3], all[(i + 2) % 3]);
        of_unit_rate(graph, across, all[i])
    };
    Some((0..ways.len()).map(own).collect())
}

/// The vector in the span of `directions` whose product with one of them is 1 and with the others 0.
fn reciprocal(directions: &[[f64; 3]], number: usize) -> [f64; 3] {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut own = directions[number];
    let mut basis: Vec<[f64; 3]> = Vec::new();
    for (_, &other) in directions.iter().enumerate().filter(|(i, _)| *i != number) {
        let mut rest = other;
        for known in &basis {
            let along = dot(rest, *known);
            rest = std::array::from_fn(|k| rest[k] - along * known[k]);
        }
        let length = dot(rest, rest).sqrt();
        basis.push(rest.map(|x| x / length));
    }
    for known in &basis {
        let along = dot(own, *known);
        own = std::array::from_fn(|k| own[k] - along * known[k]);
    }
    let product = dot(own, directions[number]);
    own.map(|x| x / product)
}

/// An angle from `across` towards `beyond` to `turned`, about an axis (all in ground axes); what a unit moment on the
/// coordinate is as a vector: reciprocal to the axes of the other turns.
struct Angle {
    plane: [Vector; 2],
    turned: Vector,
    moment: Vector,
    /// Reading in the reference configuration.
    drawn: f64,
}

fn turn(graph: &mut Graph, tree: &Tree, frames: &[FrameMotion], joint: &Joint, number: usize) -> Option<ForceGeometry> {
    let ends = Ends::new(graph, tree, joint, false);
    let carried = |graph: &mut Graph, direction: [f64; 3]| {
        let both = ends.carried(graph, direction);
        ends.in_ground(graph, frames, both)
    };
    let angle = match *directions(joint, true).as_slice() {
        [axis] => {
            let [across, beyond] = vector::perpendicular(axis);
            let [across, turned] = carried(graph, across);
            let [beyond, _] = carried(graph, beyond);
            let [moment, _] = carried(graph, axis);
            Angle { plane: [across, beyond], turned, moment, drawn: 0.0 }
        }
        [a, b] => {
            let ([a_near, a_far], [b_near, b_far]) = (carried(graph, a), carried(graph, b));
            two_turns(graph, number, [a_near, a_far, b_near, b_far], dot(a, b).abs() < RIGHT)
        }
        [a, b, c] if dot(a, b).abs() < RIGHT && dot(b, c).abs() < RIGHT && dot(a, c).abs() < 1.0 - RIGHT => {
            let (near, far) = ([a, b].map(|v| carried(graph, v)[0]), [b, c].map(|v| carried(graph, v)[1]));
            cardan(graph, number, [a, b, c], near, far)
        }
        _ => return None,
    };
    Some(reading(graph, frames, &ends, angle))
}

/// Cosines below this count as right angles.
const RIGHT: f64 = 1e-12;

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The first turn takes the second axis along; the second turns the far body's image of the first axis.
fn two_turns(
    graph: &mut Graph,
    number: usize,
    [a_near, a_far, b_near, b_far]: [Vector; 4],
    is_rectangular: bool,
) -> Angle {
    let (axis, other, across, turned) =
        if number == 0 { (a_near, b_far, b_near, b_far) } else { (b_far, a_near, a_near, a_far) };
    let beyond = vector::cross(graph, axis, across);
    if is_rectangular {
        return Angle { plane: [across, beyond], turned, moment: axis, drawn: 0.0 };
    }
    let across = vector::cross(graph, beyond, axis);
    let normal = vector::cross(graph, axis, other);
    let free = vector::cross(graph, other, normal);
    Angle { plane: [across, beyond], turned, moment: of_unit_rate(graph, free, axis), drawn: 0.0 }
}

/// Three turns, the second at right angles to the others: its axis follows from theirs.
fn cardan(
    graph: &mut Graph,
    number: usize,
    [a, b, c]: [[f64; 3]; 3],
    [a_near, b_near]: [Vector; 2],
    [b_far, c_far]: [Vector; 2],
) -> Angle {
    let product: [f64; 3] = std::array::from_fn(|i| a[(i + 1) % 3] * c[(i + 2) % 3] - a[(i + 2) % 3] * c[(i + 1) % 3]);
    let sign = graph.constant(dot(product, b).signum());
    let second = vector::cross(graph, a_near, c_far);
    let second = vector::scale(graph, sign, second);
    let length = vector::norm(graph, second);
    let one = graph.constant(1.0);
    let inverse = graph.divide(one, length);
    let second = vector::scale(graph, inverse, second);
    let axes = [a_near, second, c_far];
    let [across, turned] = match number {
        0 => [b_near, second],
        1 => [a_near, c_far],
        _ => [second, b_far],
    };
    let beyond = vector::cross(graph, axes[number], across);
    let free = vector::cross(graph, axes[(number + 1) % 3], axes[(number + 2) % 3]);
    let drawn = if number == 1 { dot(product, b).atan2(dot(a, c)) } else { 0.0 };
    Angle { plane: [across, beyond], turned, moment: of_unit_rate(graph, free, axes[number]), drawn }
}

/// `free` scaled so that its product with `axis` is one.
fn of_unit_rate(graph: &mut Graph, free: Vector, axis: Vector) -> Vector {
    let along = vector::dot(graph, free, axis);
    let one = graph.constant(1.0);
    let inverse = graph.divide(one, along);
    vector::scale(graph, inverse, free)
}

fn reading(graph: &mut Graph, frames: &[FrameMotion], ends: &Ends, angle: Angle) -> ForceGeometry {
    let now = kinematics::angle(graph, angle.plane, angle.turned);
    let drawn = graph.constant(angle.drawn);
    let coordinate = graph.subtract(now, drawn);
    let relative = relative_turning(graph, frames, ends);
    let rate = vector::dot(graph, angle.moment, relative);
    let links = [ends.near.link, ends.far.link];
    let wrenches: Vec<(usize, Wrench)> = opposite_moments(graph, frames, links, angle.moment);
    ForceGeometry { coordinate, rate, effect: Effect::Links(wrenches) }
}

/// Angular velocity of the far end against the near one, ground axes.
fn relative_turning(graph: &mut Graph, frames: &[FrameMotion], ends: &Ends) -> Vector {
    let [slow, fast] = [ends.near.link, ends.far.link].map(|link| kinematics::angular_velocity(graph, frames, link));
    vector::subtract(graph, fast, slow)
}

/// Quaternion (up to half a turn from the reference configuration) and angular velocity, in the child's axes, of a free
/// rotation that closes a loop.
pub(super) fn closing_rotation(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    joint: &Joint,
) -> ([Node; 4], Vector) {
    let ends = Ends::new(graph, tree, joint, false);
    let orientation = |graph: &mut Graph, link| kinematics::orientation(graph, frames, link);
    let (near, far) = (orientation(graph, ends.near.link), orientation(graph, ends.far.link));
    let child_axes = vector::multiply(graph, far, ends.far.rotation);
    // The rotation against the reference configuration, in the child's axes.
    let parent_axes = vector::multiply(graph, near, ends.near_axes);
    let drawn = match joint.orientation {
        None => parent_axes,
        Some(matrix) => vector::multiply(graph, parent_axes, matrix),
    };
    let turned = vector::multiply(graph, vector::transpose(drawn), child_axes);
    let one = graph.constant(1.0);
    let trace = (0..3).fold(one, |sum, i| graph.add(sum, turned[i][i]));
    let root = graph.unary(Unary::Sqrt, trace);
    let half = graph.constant(0.5);
    let scalar = graph.multiply(half, root);
    let twice = graph.add(root, root);
    let part: Vector = std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let difference = graph.subtract(turned[k][j], turned[j][k]);
        graph.divide(difference, twice)
    });
    let relative = relative_turning(graph, frames, &ends);
    let velocity = vector::apply_transposed(graph, child_axes, relative);
    ([scalar, part[0], part[1], part[2]], velocity)
}
