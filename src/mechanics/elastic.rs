//! Elastic bodies in the tree, by the floating frame of reference (Shabana-2013, chapter 5;
//! Schwertassek-Wallrapp-1999).
//!
//! The modal coordinates of a body are links without motion of their own between the joint that carries the body and
//! the body. A frame of the body that deformation moves is a chain of links behind it, single shifts and turns whose
//! coordinates are weighted sums of the modal ones. Where the joint itself stands on such a frame, the shapes are first
//! reduced by the rigid motion of that frame, so that the modes are seen from the joint.
//!
//! Kept are the inertia coupling between modes and rigid motion at the undeformed shape, with the gyroscopic terms that
//! follow from the kinetic energy, and the moment of the weight about the deformed centre of gravity. Neglected is what
//! deformation changes in the inertia itself (terms of first order in the kinetic energy: centrifugal softening, and
//! with it geometric stiffening).

use super::articulated::{Inertia, Wrench, body_inertia};
use super::kinematics::FrameMotion;
use super::topology::{Axis, Coordinate, Link, Seat, Tree};
use crate::diagnostics::Diagnostic;
use crate::expression::vector::{self, Vector};
use crate::expression::{Binary, Graph, Node, Symbol};
use crate::study::{Body, Elastic, Study};

/// The modes of one body as the tree sees them.
#[derive(Clone, Debug)]
pub(super) struct Modal {
    pub body: usize,
    /// One link per mode; the undeformed body sits on the last.
    pub links: Vec<usize>,
    velocities: Vec<Symbol>,
    /// Modal masses, kg.
    pub mass: Vec<Vec<Node>>,
    /// Per mode the momentum of the body that goes with its rate, about the last link's origin in its axes.
    pub coupling: Vec<Wrench>,
}

/// Where an elastic body sits: undeformed, and its frames by their index.
pub(super) struct ElasticSeats {
    pub undeformed: Seat,
    pub frames: Vec<Option<Seat>>,
}

/// Adds the links of an elastic body to the tree. `base` is its undeformed seat on the joint that carries it at its
/// frame
/// `carried_at`; `used` says which of its frames are needed.
pub(super) fn attach(
    graph: &mut Graph,
    tree: &mut Tree,
    (study, body, joint): (&Study, usize, usize),
    elastic: &Elastic,
    (base, carried_at): (Seat, usize),
    used: &[bool],
) -> ElasticSeats {
    let origin = joint_origin(graph, &study.bodies[body], base, carried_at, elastic);
    let mut predecessor = base.link;
    let mut offset = origin;
    let mut links = Vec::new();
    for (number, mode) in elastic.modes.iter().enumerate() {
        let coordinate = Coordinate::Mode { symbols: mode.symbols, body, number };
        let axis = Axis::Shift(vector::zero(graph));
        tree.links.push(Link { predecessor, joint, coordinate, axis, offset, bodies: vec![] });
        predecessor = Some(tree.links.len() - 1);
        links.extend(predecessor);
        offset = vector::zero(graph);
    }
    let undeformed = match links.last() {
        None => base,
        Some(&last) => {
            let offset = vector::subtract(graph, base.offset, origin);
            Seat { link: Some(last), offset, rotation: base.rotation }
        }
    };
    let rigid = rigid_motions(graph, &study.bodies[body], elastic, carried_at);
    let frames = (0..elastic.frames.len())
        .map(|frame| {
            used[frame].then(|| {
                frame_seat(graph, tree, (&study.bodies[body], joint), (elastic, frame), undeformed, (&links, &rigid))
            })
        })
        .collect();
    if let Some(modal) = modal(graph, &study.bodies[body], (body, links), elastic, undeformed, &rigid) {
        tree.modal.push(modal);
    }
    ElasticSeats { undeformed, frames }
}

/// Where the joint stands, in the axes of the link that carries the body, from that link's origin.
fn joint_origin(graph: &mut Graph, body: &Body, base: Seat, carried_at: usize, elastic: &Elastic) -> Vector {
    let position = frame_position(graph, body, elastic, carried_at);
    let turned = vector::apply(graph, base.rotation, position);
    vector::add(graph, base.offset, turned)
}

/// A frame's place in body axes.
fn frame_position(graph: &mut Graph, body: &Body, elastic: &Elastic, frame: usize) -> Vector {
    let name = &elastic.frames[frame].name;
    match body.points.iter().find(|point| point.name == *name).filter(|_| frame > 0) {
        Some(point) => point.position,
        None if frame > 0 => body.centre_of_gravity,
        None => vector::zero(graph),
    }
}

/// Per mode the rigid motion that the frame `carried_at` makes: angular, and linear at the body's origin (body axes).
fn rigid_motions(graph: &mut Graph, body: &Body, elastic: &Elastic, carried_at: usize) -> Vec<(Vector, Vector)> {
    let place = frame_position(graph, body, elastic, carried_at);
    let shapes = elastic.frames[carried_at].shapes.clone();
    let motion = |shape: &crate::study::ModeShape| {
        let turn = vector::constant(graph, shape.turn);
        let shift = vector::constant(graph, shape.shift);
        let lever = vector::cross(graph, turn, place);
        (turn, vector::subtract(graph, shift, lever))
    };
    shapes.iter().map(motion).collect()
}

/// The chain of links that moves a frame, one per direction in which some mode moves it.
fn frame_seat(
    graph: &mut Graph,
    tree: &mut Tree,
    (body, joint): (&Body, usize),
    (elastic, frame): (&Elastic, usize),
    undeformed: Seat,
    (modes, rigid): (&[usize], &[(Vector, Vector)]),
) -> Seat {
    let place = frame_position(graph, body, elastic, frame);
    let mut shifts: Vec<Vector> = Vec::new();
    let mut turns: Vec<Vector> = Vec::new();
    for (shape, &(angular, linear)) in elastic.frames[frame].shapes.iter().zip(rigid) {
        let shift = vector::constant(graph, shape.shift);
        let lever = vector::cross(graph, angular, place);
        let carried = vector::add(graph, linear, lever);
        shifts.push(vector::subtract(graph, shift, carried));
        let turn = vector::constant(graph, shape.turn);
        turns.push(vector::subtract(graph, turn, angular));
    }
    let turned = vector::apply(graph, undeformed.rotation, place);
    let mut offset = vector::add(graph, undeformed.offset, turned);
    let mut link = undeformed.link;
    let columns = vector::transpose(undeformed.rotation);
    for (shapes, is_turn) in [(&shifts, false), (&turns, true)] {
        for (component, &direction) in columns.iter().enumerate() {
            let weights: Vec<(usize, Node)> =
                modes.iter().zip(shapes.iter()).map(|(&mode, shape)| (mode, shape[component])).collect();
            if weights.iter().all(|&(_, weight)| graph.is_zero(weight)) {
                continue;
            }
            let axis = if is_turn { Axis::Turn(direction) } else { Axis::Shift(direction) };
            let coordinate = follower(graph, tree, weights);
            tree.links.push(Link { predecessor: link, joint, coordinate, axis, offset, bodies: vec![] });
            link = Some(tree.links.len() - 1);
            offset = vector::zero(graph);
        }
    }
    Seat { link, offset, rotation: undeformed.rotation }
}

fn follower(graph: &mut Graph, tree: &mut Tree, weights: Vec<(usize, Node)>) -> Coordinate {
    let zero = graph.constant(0.0);
    let (mut position, mut velocity) = (zero, zero);
    for &(mode, weight) in &weights {
        let Coordinate::Mode { symbols, .. } = tree.links[mode].coordinate else { continue };
        let [x, v] = [symbols.position, symbols.velocity].map(|symbol| {
            let value = graph.variable(symbol);
            graph.multiply(weight, value)
        });
        position = graph.add(position, x);
        velocity = graph.add(velocity, v);
    }
    tree.weights.push(weights);
    Coordinate::Follower { position, velocity, weights: tree.weights.len() - 1 }
}

/// Masses and couplings of the modes, seen from the joint: the shapes without their rigid motions.
fn modal(
    graph: &mut Graph,
    body: &Body,
    (number, links): (usize, Vec<usize>),
    elastic: &Elastic,
    undeformed: Seat,
    rigid: &[(Vector, Vector)],
) -> Option<Modal> {
    let last = *links.last()?;
    let at_origin = Seat { link: Some(last), offset: vector::zero(graph), rotation: vector::identity(graph) };
    let inertia: Inertia = body_inertia(graph, body, at_origin);
    let given: Vec<Wrench> = elastic
        .modes
        .iter()
        .map(|mode| Wrench {
            moment: vector::constant(graph, mode.moment),
            force: vector::constant(graph, mode.participation),
        })
        .collect();
    let carried: Vec<Wrench> = rigid.iter().map(|&motion| inertia.apply(graph, motion)).collect();
    let mut mass = Vec::new();
    for (k, &motion) in rigid.iter().enumerate() {
        let mut row = Vec::new();
        for l in 0..rigid.len() {
            let own = graph.constant(if k == l { 1.0 } else { 0.0 });
            let [first, second, both] =
                [given[l].on(graph, motion), given[k].on(graph, rigid[l]), carried[l].on(graph, motion)];
            let sum = graph.subtract(own, first);
            let sum = graph.subtract(sum, second);
            row.push(graph.add(sum, both));
        }
        mass.push(row);
    }
    let coupling = given
        .into_iter()
        .zip(carried)
        .map(|(given, carried)| {
            let own = given.subtract(graph, carried);
            let force = vector::apply(graph, undeformed.rotation, own.force);
            let moment = vector::apply(graph, undeformed.rotation, own.moment);
            let lever = vector::cross(graph, undeformed.offset, force);
            Wrench { moment: vector::add(graph, moment, lever), force }
        })
        .collect();
    let velocities = elastic.modes.iter().map(|mode| mode.symbols.velocity).collect();
    Some(Modal { body: number, links, velocities, mass, coupling })
}

impl Modal {
    /// The link on which the undeformed body sits.
    pub fn seat(&self) -> usize {
        self.links.last().copied().unwrap_or_default()
    }

    /// Momentum that goes with the rates of the modes.
    pub fn momentum(&self, graph: &mut Graph) -> Wrench {
        let mut sum = Wrench::zero(graph);
        for (coupling, &velocity) in self.coupling.iter().zip(&self.velocities) {
            let velocity = graph.variable(velocity);
            let share = coupling.scale(graph, velocity);
            sum = sum.add(graph, share);
        }
        sum
    }

    /// Moment of the weight on the displaced centre of gravity, about the link's origin in its axes.
    pub fn weight(&self, graph: &mut Graph, study: &Study, frame: &FrameMotion) -> Wrench {
        let mut displaced = vector::zero(graph);
        let modes = study.bodies[self.body].elastic.iter().flat_map(|elastic| &elastic.modes);
        for (coupling, mode) in self.coupling.iter().zip(modes) {
            let position = graph.variable(mode.symbols.position);
            let share = vector::scale(graph, position, coupling.force);
            displaced = vector::add(graph, displaced, share);
        }
        let gravity = vector::apply_transposed(graph, frame.orientation, study.gravity);
        Wrench { moment: vector::cross(graph, displaced, gravity), force: vector::zero(graph) }
    }

    /// How fast the body turns against its lowest mode: squared ratio of angular velocity and circular frequency.
    pub fn turning(&self, graph: &mut Graph, study: &Study, frame: &FrameMotion) -> Option<Node> {
        let modes = study.bodies[self.body].elastic.iter().flat_map(|elastic| &elastic.modes);
        let lowest = modes.map(|mode| mode.frequency).reduce(|a, b| graph.binary(Binary::Minimum, a, b))?;
        let turn = graph.constant(std::f64::consts::TAU);
        let rate = graph.multiply(turn, lowest);
        let square = graph.multiply(rate, rate);
        let speed = vector::dot(graph, frame.angular_velocity, frame.angular_velocity);
        Some(graph.divide(speed, square))
    }

    /// Elastic and damping load on every modal coordinate, N.
    pub fn loads(&self, graph: &mut Graph, study: &Study) -> Vec<(usize, Node)> {
        let modes = study.bodies[self.body].elastic.iter().flat_map(|elastic| &elastic.modes);
        let load = |(&link, mode): (&usize, &crate::study::Mode)| {
            let [position, velocity] =
                [mode.symbols.position, mode.symbols.velocity].map(|symbol| graph.variable(symbol));
            let turn = graph.constant(std::f64::consts::TAU);
            let rate = graph.multiply(turn, mode.frequency);
            let square = graph.multiply(rate, rate);
            let spring = graph.multiply(square, position);
            let two = graph.constant(2.0);
            let damping = graph.multiply(two, mode.damping);
            let damping = graph.multiply(damping, rate);
            let damper = graph.multiply(damping, velocity);
            let sum = graph.add(spring, damper);
            (link, graph.negate(sum))
        };
        self.links.iter().zip(modes).map(load).collect()
    }
}

/// Shares of mass and inertia that modes may exceed by rounding in their file.
const ROUNDING: f64 = 1e-4;

/// Modes of modal mass 1 kg take along no more than there is: the body's inertia less what its modes carry is not
/// negative.
///
/// # Errors
/// One per body whose modes are scaled otherwise.
pub(super) fn refuse_large_modes(graph: &mut Graph, study: &Study) -> Result<(), Vec<Diagnostic>> {
    let mut errors = Vec::new();
    for body in &study.bodies {
        let Some(elastic) = &body.elastic else { continue };
        let seat = Seat { link: None, offset: vector::zero(graph), rotation: vector::identity(graph) };
        let inertia = body_inertia(graph, body, seat);
        let elements: Vec<Node> =
            [inertia.rotational, inertia.coupling, inertia.translational].into_iter().flatten().flatten().collect();
        let parameter = |symbol: Symbol| study.parameters.iter().find(|p| p.symbol == symbol).map_or(0.0, |p| p.start);
        let values = graph.evaluate(&elements, parameter, |_, _, _| 0.0);
        let mut rest = [[0.0; 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                rest[i][j] = values[3 * i + j];
                rest[i][3 + j] = values[9 + 3 * i + j];
                rest[3 + j][i] = values[9 + 3 * i + j];
                rest[3 + i][3 + j] = values[18 + 3 * i + j];
            }
        }
        let scale: [f64; 6] = std::array::from_fn(|i| rest[i][i]);
        for (number, mode) in elastic.modes.iter().enumerate() {
            let carried = [mode.moment, mode.participation].concat();
            for i in 0..6 {
                for j in 0..6 {
                    rest[i][j] -= carried[i] * carried[j];
                }
            }
            if !is_not_negative(rest, scale) {
                errors.push(super::inertia::modes_too_large(body, number));
                break;
            }
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// Elimination with the largest pivot; what is left must not fall below zero by more than rounding of `scale`.
fn is_not_negative(mut matrix: [[f64; 6]; 6], scale: [f64; 6]) -> bool {
    let largest = scale.iter().fold(0.0_f64, |m, v| m.max(*v));
    let root = scale.map(|v| v.max(1e-9 * largest).sqrt());
    for i in 0..6 {
        for j in 0..6 {
            matrix[i][j] /= root[i] * root[j];
        }
    }
    let mut open: Vec<usize> = (0..6).collect();
    while let Some(at) = (0..open.len()).max_by(|&a, &b| matrix[open[a]][open[a]].total_cmp(&matrix[open[b]][open[b]]))
    {
        let pivot = open.swap_remove(at);
        let value = matrix[pivot][pivot];
        if value < -ROUNDING {
            return false;
        }
        if value <= ROUNDING {
            return open.iter().all(|&i| matrix[i][i] >= -ROUNDING);
        }
        for &i in &open {
            let factor = matrix[i][pivot] / value;
            for &j in &open {
                matrix[i][j] -= factor * matrix[pivot][j];
            }
        }
    }
    true
}
