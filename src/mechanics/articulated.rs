//! Accelerations by the articulated-body algorithm on expressions (Featherstone-2008, table 7.1).

use super::forces::Effect;
use super::kinematics::{FrameMotion, SpatialMotion, carry, motion_axis};
use super::modal_pass::{Modes, Reduced};
use super::topology::{Coordinate, Link, Seat, Tree};
use crate::expression::vector::{self, Matrix, Vector};
use crate::expression::{Graph, Node};
use crate::study::{Body, Study};

/// Spatial inertia about a link's origin in its axes: [[rotational, coupling], [coupling^T, translational]].
#[derive(Clone, Copy, Debug)]
pub(super) struct Inertia {
    pub rotational: Matrix,
    pub coupling: Matrix,
    pub translational: Matrix,
}

/// Moment about a link's origin and force, in its axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wrench {
    pub moment: Vector,
    pub force: Vector,
}

impl Wrench {
    pub fn zero(graph: &mut Graph) -> Self {
        Self { moment: vector::zero(graph), force: vector::zero(graph) }
    }

    pub fn add(self, graph: &mut Graph, other: Wrench) -> Wrench {
        Wrench {
            moment: vector::add(graph, self.moment, other.moment),
            force: vector::add(graph, self.force, other.force),
        }
    }

    pub fn subtract(self, graph: &mut Graph, other: Wrench) -> Wrench {
        Wrench {
            moment: vector::subtract(graph, self.moment, other.moment),
            force: vector::subtract(graph, self.force, other.force),
        }
    }

    pub fn scale(self, graph: &mut Graph, factor: Node) -> Wrench {
        Wrench { moment: vector::scale(graph, factor, self.moment), force: vector::scale(graph, factor, self.force) }
    }

    /// Power on a motion (angular, linear).
    pub fn on(self, graph: &mut Graph, motion: (Vector, Vector)) -> Node {
        let turning = vector::dot(graph, self.moment, motion.0);
        let shifting = vector::dot(graph, self.force, motion.1);
        graph.add(turning, shifting)
    }

    /// The same load about the predecessor's origin in its axes.
    pub fn carried_back(self, graph: &mut Graph, frame: &FrameMotion) -> Wrench {
        let force = vector::apply(graph, frame.rotation, self.force);
        let moment = vector::apply(graph, frame.rotation, self.moment);
        let lever = vector::cross(graph, frame.shift, force);
        Wrench { moment: vector::add(graph, moment, lever), force }
    }
}

/// Loads on the coordinates of the links, and wrenches on the links.
#[derive(Clone, Debug)]
pub(super) struct Loads {
    pub coordinates: Vec<Node>,
    pub wrenches: Vec<Wrench>,
}

impl Loads {
    pub fn none(graph: &mut Graph, tree: &Tree) -> Self {
        let coordinates = vec![graph.constant(0.0); tree.links.len()];
        Self { coordinates, wrenches: tree.links.iter().map(|_| Wrench::zero(graph)).collect() }
    }

    /// Adds `load` times what load 1 does.
    pub fn act(&mut self, graph: &mut Graph, effect: &Effect, load: Node) {
        match effect {
            Effect::Coordinate(link) => self.coordinates[*link] = graph.add(self.coordinates[*link], load),
            Effect::Links(unit) => {
                for &(link, wrench) in unit {
                    let wrench = wrench.scale(graph, load);
                    self.wrenches[link] = self.wrenches[link].add(graph, wrench);
                }
            }
        }
    }
}

impl Inertia {
    pub fn zero(graph: &mut Graph) -> Self {
        let zero = vector::zero_matrix(graph);
        Self { rotational: zero, coupling: zero, translational: zero }
    }

    pub fn add(self, graph: &mut Graph, other: Inertia) -> Inertia {
        Inertia {
            rotational: vector::add_matrix(graph, self.rotational, other.rotational),
            coupling: vector::add_matrix(graph, self.coupling, other.coupling),
            translational: vector::add_matrix(graph, self.translational, other.translational),
        }
    }

    /// `I (angular, linear)`.
    pub fn apply(&self, graph: &mut Graph, (angular, linear): (Vector, Vector)) -> Wrench {
        let by_rotation = vector::apply(graph, self.rotational, angular);
        let by_shift = vector::apply(graph, self.coupling, linear);
        let moment = vector::add(graph, by_rotation, by_shift);
        let by_rotation = vector::apply_transposed(graph, self.coupling, angular);
        let by_shift = vector::apply(graph, self.translational, linear);
        Wrench { moment, force: vector::add(graph, by_rotation, by_shift) }
    }

    /// The same inertia about the predecessor's origin in its axes.
    fn carried_back(&self, graph: &mut Graph, frame: &FrameMotion) -> Inertia {
        let rotational = vector::turn_symmetric(graph, frame.rotation, self.rotational);
        let coupling = vector::turn(graph, frame.rotation, self.coupling);
        let translational = vector::turn_symmetric(graph, frame.rotation, self.translational);
        let lever = vector::skew(graph, frame.shift);
        let shifted = vector::multiply(graph, lever, translational);
        let new_coupling = vector::add_matrix(graph, coupling, shifted);
        // J + lever (H + lever M)^T - H lever, with lever^T = -lever.
        let outer = vector::multiply(graph, lever, vector::transpose(new_coupling));
        let inner = vector::multiply(graph, coupling, lever);
        let change = vector::subtract_matrix(graph, outer, inner);
        let rotational = vector::add_matrix(graph, rotational, change);
        Inertia { rotational: vector::mirrored(rotational), coupling: new_coupling, translational }
    }

    /// `I - U (U / D)^T`.
    pub fn without(&self, graph: &mut Graph, along: Wrench, scaled: Wrench) -> Inertia {
        let mut reduce = |m: Matrix, left: Vector, right: Vector| -> Matrix {
            std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let product = graph.multiply(left[i], right[j]);
                    graph.subtract(m[i][j], product)
                })
            })
        };
        let rotational = reduce(self.rotational, along.moment, scaled.moment);
        let translational = reduce(self.translational, along.force, scaled.force);
        let coupling = reduce(self.coupling, along.moment, scaled.force);
        Inertia { rotational: vector::mirrored(rotational), coupling, translational: vector::mirrored(translational) }
    }

    /// The elements on the diagonal: rotational, translational.
    fn diagonals(&self) -> [Vector; 2] {
        [self.rotational, self.translational].map(|m| std::array::from_fn(|i| m[i][i]))
    }
}

/// `U / D`. Where D is an element of U (an axis along a frame's axis) the ratio folds to one, and the direction that
/// the joint frees vanishes structurally from the inertia.
fn ratio(graph: &mut Graph, along: Wrench, divisor: Node) -> Wrench {
    let one = graph.constant(1.0);
    let inverse = graph.divide(one, divisor);
    let mut ratio = |v: Vector| {
        v.map(|component| {
            let quotient = graph.divide(component, divisor);
            match graph.constant_value(quotient) {
                Some(_) => quotient,
                None => graph.multiply(component, inverse),
            }
        })
    };
    Wrench { moment: ratio(along.moment), force: ratio(along.force) }
}

/// Inertia of a body about the origin of the link it sits on, in the link's axes.
pub(super) fn body_inertia(graph: &mut Graph, body: &Body, seat: Seat) -> Inertia {
    let [xx, yy, zz, xy, xz, yz] = body.inertia;
    let central = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let central = vector::turn_symmetric(graph, seat.rotation, central);
    let arm = vector::apply(graph, seat.rotation, body.centre_of_gravity);
    let lever = vector::add(graph, seat.offset, arm);
    let moment = vector::scale(graph, body.mass, lever);
    let coupling = vector::skew(graph, moment);
    let arm = vector::skew(graph, lever);
    let steiner = vector::multiply(graph, coupling, arm);
    let rotational = vector::subtract_matrix(graph, central, steiner);
    let zero = graph.constant(0.0);
    let translational = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { body.mass } else { zero }));
    Inertia { rotational: vector::mirrored(rotational), coupling, translational }
}

/// Inertia of everything that moves rigidly with each link.
pub(super) fn link_inertias(graph: &mut Graph, study: &Study, tree: &Tree) -> Vec<Inertia> {
    tree.links
        .iter()
        .map(|link| {
            let mut sum = Inertia::zero(graph);
            for &body in &link.bodies {
                let own = body_inertia(graph, &study.bodies[body], tree.undeformed[body]);
                sum = sum.add(graph, own);
            }
            sum
        })
        .collect()
}

/// What the algorithm finds per link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accelerated {
    /// Second derivative of the coordinate.
    pub acceleration: Node,
    /// What is transmitted to the link from its predecessor, about the link's origin in its axes.
    pub transmitted: Wrench,
    /// S^T I^A S: what the joint has to move, the outer joints free. Zero: the acceleration is undetermined.
    pub moved_inertia: Node,
    /// Diagonal of I^A, rotational and translational: what `moved_inertia` is a projection of.
    pub around: [Vector; 2],
}

/// Accelerations of all coordinates under loads.
pub(super) fn articulated_bodies(
    graph: &mut Graph,
    tree: &Tree,
    frames: &[FrameMotion],
    inertias: &[Inertia],
    Loads { coordinates: loads, wrenches }: &Loads,
    gravity: Vector,
) -> Vec<Accelerated> {
    let count = tree.links.len();
    let axes: Vec<(Vector, Vector)> = tree.links.iter().map(|link| motion_axis(graph, link.axis)).collect();
    let mut inertia = inertias.to_vec();
    let mut bias: Vec<Wrench> = (0..count)
        .map(|i| {
            let gyroscopic = velocity_load(graph, tree, i, &frames[i], &inertias[i]);
            gyroscopic.subtract(graph, wrenches[i])
        })
        .collect();
    let mut along: Vec<Wrench> = Vec::new();
    let mut moved: Vec<(Node, Node)> = Vec::new();
    let mut modes = Modes::new(graph, tree);
    for i in (0..count).rev() {
        let frame = &frames[i];
        if let Some(open) = open_modes(graph, tree, i, axes[i], frame, loads[i], (inertia[i], bias[i]), &mut modes) {
            along.push(Wrench::zero(graph));
            moved.push((open.1, open.2));
            if let Some(p) = tree.links[i].predecessor {
                let (carried, total) =
                    (open.0.inertia.carried_back(graph, frame), open.0.bias.carried_back(graph, frame));
                inertia[p] = inertia[p].add(graph, carried);
                bias[p] = bias[p].add(graph, total);
                modes.carry_back(graph, i, p, frame);
            }
            continue;
        }
        let u = inertia[i].apply(graph, axes[i]);
        let divisor = u.on(graph, axes[i]);
        let resisting = bias[i].on(graph, axes[i]);
        let driving = graph.subtract(loads[i], resisting);
        along.push(u);
        moved.push((divisor, driving));
        if let Some(p) = tree.links[i].predecessor {
            let (reduced, total) = match given_acceleration(graph, &tree.links[i]) {
                Some(given) => {
                    let angular = vector::scale(graph, given, axes[i].0);
                    let linear = vector::scale(graph, given, axes[i].1);
                    let angular = vector::add(graph, frame.angular_bias, angular);
                    let linear = vector::add(graph, frame.bias, linear);
                    let by_bias = inertia[i].apply(graph, (angular, linear));
                    (inertia[i], bias[i].add(graph, by_bias))
                }
                None => {
                    let scaled = ratio(graph, u, divisor);
                    let reduced = inertia[i].without(graph, u, scaled);
                    let by_bias = reduced.apply(graph, (frame.angular_bias, frame.bias));
                    let by_drive = scaled.scale(graph, driving);
                    (reduced, bias[i].add(graph, by_bias).add(graph, by_drive))
                }
            };
            let total = total.carried_back(graph, frame);
            let carried = reduced.carried_back(graph, frame);
            inertia[p] = inertia[p].add(graph, carried);
            bias[p] = bias[p].add(graph, total);
        }
    }
    along.reverse();
    moved.reverse();

    let base = SpatialMotion { angular: vector::zero(graph), linear: vector::negate(graph, gravity) };
    let mut result: Vec<Accelerated> = Vec::with_capacity(count);
    let mut spatial: Vec<SpatialMotion> = Vec::with_capacity(count);
    for i in 0..count {
        let frame = &frames[i];
        let before = tree.links[i].predecessor.map_or(base, |p| spatial[p]);
        let (angular, linear) = carry(graph, frame.rotation, frame.shift, before);
        let angular = vector::add(graph, angular, frame.angular_bias);
        let linear = vector::add(graph, linear, frame.bias);
        let (divisor, driving) = moved[i];
        let earlier = |link: usize| result[link].acceleration;
        let acceleration = match (given_acceleration(graph, &tree.links[i]), tree.links[i].coordinate) {
            (Some(given), _) => given,
            (None, Coordinate::Follower { weights, .. }) => weighted(graph, &tree.weights[weights], earlier),
            (None, Coordinate::Mode { .. }) => {
                let taken = modes.taken(graph, i, (angular, linear), earlier);
                let rest = graph.subtract(driving, taken);
                graph.divide(rest, divisor)
            }
            _ => {
                let carried = along[i].on(graph, (angular, linear));
                let rest = graph.subtract(driving, carried);
                graph.divide(rest, divisor)
            }
        };
        let (turning, shifting) = axes[i];
        let turning = vector::scale(graph, acceleration, turning);
        let shifting = vector::scale(graph, acceleration, shifting);
        let motion = SpatialMotion {
            angular: vector::add(graph, angular, turning),
            linear: vector::add(graph, linear, shifting),
        };
        let transmitted = inertia[i].apply(graph, (motion.angular, motion.linear)).add(graph, bias[i]);
        spatial.push(motion);
        result.push(Accelerated { acceleration, transmitted, moved_inertia: divisor, around: inertia[i].diagonals() });
    }
    result
}

/// The acceleration of a motion that is prescribed.
fn given_acceleration(graph: &mut Graph, link: &Link) -> Option<Node> {
    match link.coordinate {
        Coordinate::Prescribed { motion, .. } => Some(motion[2]),
        Coordinate::Turned { .. } | Coordinate::Weld => Some(graph.constant(0.0)),
        Coordinate::Free { .. }
        | Coordinate::Rotation { .. }
        | Coordinate::Mode { .. }
        | Coordinate::Follower { .. } => None,
    }
}

/// The step inwards over a link of an elastic body: reduced inertia and bias, and for a mode its divisor and driving
/// load.
#[allow(clippy::too_many_arguments, reason = "one step of the algorithm above, which holds all of them")]
fn open_modes(
    graph: &mut Graph,
    tree: &Tree,
    link: usize,
    axis: (Vector, Vector),
    frame: &FrameMotion,
    load: Node,
    own: (Inertia, Wrench),
    modes: &mut Modes,
) -> Option<(Reduced, Node, Node)> {
    let one = graph.constant(1.0);
    match tree.links[link].coordinate {
        Coordinate::Mode { .. } => Some(modes.eliminate(graph, link, load, own)),
        Coordinate::Follower { weights, .. } => {
            let reduced = modes.follow(graph, (link, axis), &tree.weights[weights], frame, own);
            Some((reduced, one, one))
        }
        _ => None,
    }
}

/// The sum of values with weights.
fn weighted(graph: &mut Graph, weights: &[(usize, Node)], value: impl Fn(usize) -> Node) -> Node {
    let mut sum = graph.constant(0.0);
    for &(link, weight) in weights {
        let share = graph.multiply(weight, value(link));
        sum = graph.add(sum, share);
    }
    sum
}

/// v x* (I v): centrifugal and gyroscopic load.
fn velocity_load(graph: &mut Graph, tree: &Tree, link: usize, frame: &FrameMotion, inertia: &Inertia) -> Wrench {
    let mut momentum = inertia.apply(graph, (frame.angular_velocity, frame.velocity));
    if let Some(modal) = tree.modal.iter().find(|modal| modal.seat() == link) {
        let own = modal.momentum(graph);
        momentum = momentum.add(graph, own);
    }
    let turned = vector::cross(graph, frame.angular_velocity, momentum.moment);
    let dragged = vector::cross(graph, frame.velocity, momentum.force);
    Wrench {
        moment: vector::add(graph, turned, dragged),
        force: vector::cross(graph, frame.angular_velocity, momentum.force),
    }
}
