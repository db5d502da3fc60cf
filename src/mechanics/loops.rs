//! Joints that close kinematic loops, as constraints on position and velocity level.
//!
//! A row is the dot product of two vectors that move with the bodies; its rate is a linear function of the velocities,
//! and a multiplier acts on the bodies by exactly the transpose of that function.

use super::articulated::{Loads, Wrench};
use super::chain::{Chain, Ends, FreeShift, unit};
use super::forces::Effect;
use super::kinematics::{self, FrameMotion};
use super::topology::{Seat, Tree};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::vector::{self, Vector};
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{Joint, JointKind, Study};

/// One constraint `0 = g(q, t)`.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub owner: Owner,
    /// What it holds, in words.
    pub holds: String,
    pub direction: Direction,
    pub form: Form,
}

/// What a row belongs to: index of a joint or of a coupling of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    Joint(usize),
    Coupling(usize),
}

impl Owner {
    pub fn name(self, study: &Study) -> &str {
        match self {
            Owner::Joint(joint) => &study.joints[joint].name,
            Owner::Coupling(coupling) => &study.couplings[coupling].name,
        }
    }

    pub fn span(self, study: &Study) -> Span {
        match self {
            Owner::Joint(joint) => study.joints[joint].span,
            Owner::Coupling(coupling) => study.couplings[coupling].span,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) enum Form {
    Ends(Box<Held>),
    Relation(Relation),
}

/// A relation of coordinates.
#[derive(Clone, Debug)]
pub(super) struct Relation {
    /// g; none where only rates are related.
    pub position: Option<Node>,
    /// dg/dt.
    pub velocity: Node,
    /// What multiplier 1 does: so many times each.
    pub loads: Vec<(Node, Effect)>,
}

/// Something held between the two ends of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    ends: MovingEnds,
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
    /// Of a coupling between quantities of this dimension.
    Relation(Dimension),
}

/// Points of the two ends, which prescribed motions move in their links, and the points where reactions are stated.
#[derive(Clone, Copy, Debug)]
struct MovingEnds {
    near: Seat,
    far: Seat,
    /// Rates of the points against their links, link axes.
    rates: [Vector; 2],
    /// The child's attachment.
    child: Seat,
    is_swapped: bool,
}

/// A vector in the axes of a link, with its rate against them.
#[derive(Clone, Copy, Debug)]
struct Arrow {
    now: Vector,
    rate: Vector,
}

impl Arrow {
    fn new(graph: &mut Graph, time: Symbol, now: Vector) -> Self {
        let rate = graph.differentiate(&now, time);
        Arrow { now, rate: [rate[0], rate[1], rate[2]] }
    }
}

#[derive(Clone, Copy, Debug)]
enum Geometry {
    /// A ground-fixed direction times the distance vector.
    Fixed(Vector),
    /// A direction of the near link times the distance vector.
    Carried(Arrow),
    /// The distance vector's part across a direction of the near link and one of the far link.
    Across { near: Arrow, far: Arrow },
    /// A direction of the near link times one of the far link, minus their product as meant (and its rate).
    Angle { near: Arrow, far: Arrow, meant: [Node; 2] },
    /// Distance of the points, m.
    Distance(Node),
}

/// The distance along a direction of the near link, in the form of a constraint.
pub(super) fn along(graph: &mut Graph, ends: &Ends, direction: Vector) -> Held {
    let zero = vector::zero(graph);
    let geometry = Geometry::Carried(Arrow { now: direction, rate: zero });
    let ends = MovingEnds { near: ends.near, far: ends.far, rates: [zero; 2], child: ends.far, is_swapped: false };
    Held { ends, geometry }
}

/// Rows of all joints that close loops.
///
/// # Errors
/// Joints whose freedom cannot be written as constraints: shifts between turns.
pub(super) fn rows(graph: &mut Graph, study: &Study, tree: &Tree) -> Result<Vec<Row>, Vec<Diagnostic>> {
    let mut rows = Vec::new();
    let mut errors = Vec::new();
    for (index, joint) in study.joints.iter().enumerate().filter(|(_, joint)| joint.closes_loop) {
        let Some(chain) = Chain::new(graph, tree, joint) else {
            errors.push(no_constraint_form(joint));
            continue;
        };
        let ends = moving_ends(graph, study.time, &chain);
        let mut add = |(direction, geometry): (Direction, Geometry)| {
            let form = Form::Ends(Box::new(Held { ends, geometry }));
            rows.push(Row { owner: Owner::Joint(index), holds: holds(direction), direction, form });
        };
        if let (JointKind::Distance, Some(length)) = (joint.kind, joint.length) {
            add((Direction::Distance, Geometry::Distance(length)));
            continue;
        }
        position_rows(graph, study.time, &chain).into_iter().for_each(&mut add);
        if joint.rotation.is_none() {
            angle_rows(graph, study.time, &chain).into_iter().for_each(add);
        }
    }
    if errors.is_empty() { Ok(rows) } else { Err(errors) }
}

fn moving_ends(graph: &mut Graph, time: Symbol, chain: &Chain) -> MovingEnds {
    let Ends { near, far, .. } = chain.ends;
    let rates = [near, far].map(|end| Arrow::new(graph, time, end.offset).rate);
    let child = if chain.is_swapped { chain.attached.near } else { chain.attached.far };
    MovingEnds { near, far, rates, child, is_swapped: chain.is_swapped }
}

pub(super) fn holds(direction: Direction) -> String {
    match direction {
        Direction::Shift(axis) => format!("shifting along {}", super::emit::axis_text(without_sign(axis))),
        Direction::Turn(axis) => format!("turning about {}", super::emit::axis_text(without_sign(axis))),
        Direction::Distance => "the distance of its ends".to_owned(),
        Direction::Relation(_) => "both sides equal".to_owned(),
    }
}

/// An axis that is not directed: the first component that is not zero is positive.
pub(super) fn without_sign(axis: [f64; 3]) -> [f64; 3] {
    let is_negative = axis.iter().find(|component| **component != 0.0).is_some_and(|component| *component < 0.0);
    if is_negative { axis.map(|component| 0.0 - component) } else { axis }
}

fn no_constraint_form(joint: &Joint) -> Diagnostic {
    Diagnostic::error(Code::CLOSED_LOOP, format!("joint `{}` cannot close its loop", joint.name))
        .label(joint.span, "it shifts between two turns")
        .help("list its shifts first, `axes(shift y, shift x, turn z)`, or its turns")
}

/// Directions that the shifts leave held.
fn position_rows(graph: &mut Graph, time: Symbol, chain: &Chain) -> Vec<(Direction, Geometry)> {
    let in_link = |graph: &mut Graph, shift: &FreeShift, direction: [f64; 3]| {
        let direction = vector::constant(graph, direction);
        vector::apply(graph, shift.axes, direction)
    };
    let carried = |graph: &mut Graph, shift: &FreeShift, held: [f64; 3]| {
        let now = in_link(graph, shift, held);
        (Direction::Shift(held), Geometry::Carried(Arrow::new(graph, time, now)))
    };
    match (chain.leading.as_slice(), chain.trailing.as_slice()) {
        ([], []) => (0..3).map(|i| fixed(graph, i)).collect(),
        ([shift], []) => vector::perpendicular(shift.direction).map(|held| carried(graph, shift, held)).to_vec(),
        ([a, b], []) if a.axes == b.axes => vec![carried(graph, a, normal(a.direction, b.direction))],
        ([a, b], []) => {
            let [first, second] = [a, b].map(|shift| in_link(graph, shift, shift.direction));
            let now = vector::cross(graph, first, second);
            let held = normal(a.direction, b.direction);
            vec![(Direction::Shift(held), Geometry::Carried(Arrow::new(graph, time, now)))]
        }
        ([a], [b]) => {
            let [near, far] = [a, b].map(|shift| {
                let now = in_link(graph, shift, shift.direction);
                Arrow::new(graph, time, now)
            });
            vec![(Direction::Shift(normal(a.direction, b.direction)), Geometry::Across { near, far })]
        }
        _ => vec![],
    }
}

fn fixed(graph: &mut Graph, index: usize) -> (Direction, Geometry) {
    (Direction::Shift(unit(index)), Geometry::Fixed(vector::constant(graph, unit(index))))
}

/// Perpendicular to both; of parallel directions any perpendicular one.
fn normal(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let product: [f64; 3] = std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
    let length = product.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { product.map(|x| x / length) } else { vector::perpendicular(a)[0] }
}

/// Pairs of directions that keep the angle between them, or have it prescribed.
fn angle_rows(graph: &mut Graph, time: Symbol, chain: &Chain) -> Vec<(Direction, Geometry)> {
    // Each pair: direction of the near end, direction of the far end.
    let pairs: Vec<([f64; 3], [f64; 3])> = match chain.turns.as_slice() {
        [] => (0..3).map(|i| (unit(i), unit((i + 1) % 3))).collect(),
        [axis] => vector::perpendicular(*axis).map(|across| (across, *axis)).to_vec(),
        [first, second] => vec![(*first, *second)],
        _ => vec![],
    };
    let rows = pairs.into_iter().map(|(of_near, of_far)| {
        let [near, _] = chain.ends.carried(graph, of_near);
        let [_, far] = chain.ends.carried(graph, of_far);
        let [near, far] = [near, far].map(|now| Arrow::new(graph, time, now));
        let meant = match chain.between {
            None => {
                let drawn: f64 = of_near.iter().zip(of_far).map(|(a, b)| a * b).sum();
                graph.constant(if drawn.abs() < f64::EPSILON { 0.0 } else { drawn })
            }
            Some(turn) => {
                let [a, b] = [of_near, of_far].map(|direction| vector::constant(graph, direction));
                let turned = vector::apply(graph, turn, b);
                vector::dot(graph, a, turned)
            }
        };
        let rate = graph.differentiate(&[meant], time)[0];
        (Direction::Turn(normal(of_near, of_far)), Geometry::Angle { near, far, meant: [meant, rate] })
    });
    rows.collect()
}

/// Cosines that are one where a joint is closed as meant and not turned over: rows of angles hold in both positions.
pub(super) fn upright(graph: &mut Graph, study: &Study, tree: &Tree, frames: &[FrameMotion]) -> Vec<Node> {
    let mut cosines = Vec::new();
    for joint in study.joints.iter().filter(|joint| joint.closes_loop && joint.rotation.is_none()) {
        let Some(chain) = Chain::new(graph, tree, joint).filter(|_| joint.kind != JointKind::Distance) else {
            continue;
        };
        for direction in chain.parallel() {
            let directions = chain.ends.carried(graph, direction);
            let [near, far] = chain.ends.in_ground(graph, frames, directions);
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
    /// g; none where only rates are related.
    pub fn position(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Option<Node> {
        match &self.form {
            Form::Ends(held) => Some(held.position(graph, frames)),
            Form::Relation(relation) => relation.position,
        }
    }

    /// Whether it is a relation of positions, not of rates only.
    pub fn has_position(&self) -> bool {
        !matches!(&self.form, Form::Relation(Relation { position: None, .. }))
    }

    /// dg/dt.
    pub fn velocity(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Node {
        match &self.form {
            Form::Ends(held) => held.velocity(graph, frames),
            Form::Relation(relation) => relation.velocity,
        }
    }

    /// Adds what `multiplier` does: wrenches on links and loads on their coordinates.
    pub fn act(&self, graph: &mut Graph, frames: &[FrameMotion], multiplier: Node, loads: &mut Loads) {
        match &self.form {
            Form::Ends(held) => {
                for (link, wrench) in held.wrenches(graph, frames, multiplier) {
                    loads.wrenches[link] = loads.wrenches[link].add(graph, wrench);
                }
            }
            Form::Relation(relation) => {
                for (slope, effect) in &relation.loads {
                    let load = graph.multiply(multiplier, *slope);
                    loads.act(graph, effect, load);
                }
            }
        }
    }

    /// Force or moment on the child per multiplier 1, at its attachment, ground axes; of a coupling none.
    pub fn reaction(&self, graph: &mut Graph, frames: &[FrameMotion], is_moment: bool) -> Vector {
        match &self.form {
            Form::Ends(held) => held.reaction(graph, frames, is_moment),
            Form::Relation(_) => vector::zero(graph),
        }
    }
}

impl Held {
    fn moving(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Moving {
        let ends = [self.ends.near, self.ends.far];
        let [p, c] = ends.map(|end| kinematics::point_position(graph, frames, end));
        let [v_p, v_c] = [0, 1].map(|i| {
            let carried = kinematics::point_velocity(graph, frames, ends[i]);
            let orientation = kinematics::orientation(graph, frames, ends[i].link);
            let own = vector::apply(graph, orientation, self.ends.rates[i]);
            vector::add(graph, carried, own)
        });
        let turning = ends.map(|end| kinematics::angular_velocity(graph, frames, end.link));
        Moving {
            distance: vector::subtract(graph, c, p),
            relative_velocity: vector::subtract(graph, v_c, v_p),
            turning,
        }
    }

    /// Vectors of the near and the far link in ground axes.
    fn in_ground(&self, graph: &mut Graph, frames: &[FrameMotion], vectors: [Vector; 2]) -> [Vector; 2] {
        let links = [self.ends.near.link, self.ends.far.link];
        [0, 1].map(|i| {
            let orientation = kinematics::orientation(graph, frames, links[i]);
            vector::apply(graph, orientation, vectors[i])
        })
    }

    /// Directions of the near and the far link in ground axes, and their rates against the links.
    fn directions(&self, graph: &mut Graph, frames: &[FrameMotion]) -> [[Vector; 2]; 2] {
        let zero = vector::zero(graph);
        match self.geometry {
            Geometry::Fixed(u) => [[u, u], [zero; 2]],
            Geometry::Carried(u) => [u.now, u.rate].map(|v| self.in_ground(graph, frames, [v, zero])),
            Geometry::Angle { near, far, .. } | Geometry::Across { near, far } => {
                [[near.now, far.now], [near.rate, far.rate]].map(|pair| self.in_ground(graph, frames, pair))
            }
            Geometry::Distance(_) => [[zero; 2]; 2],
        }
    }

    /// g.
    pub fn position(&self, graph: &mut Graph, frames: &[FrameMotion]) -> Node {
        let moving = self.moving(graph, frames);
        let [[u, w], _] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) | Geometry::Carried(_) => vector::dot(graph, u, moving.distance),
            Geometry::Across { .. } => {
                let across = vector::cross(graph, u, w);
                vector::dot(graph, across, moving.distance)
            }
            Geometry::Angle { meant, .. } => {
                let now = vector::dot(graph, u, w);
                graph.subtract(now, meant[0])
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
        let [[u, w], [u_rate, w_rate]] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) => vector::dot(graph, u, moving.relative_velocity),
            Geometry::Carried(_) => {
                let swept = vector::cross(graph, moving.turning[0], moving.distance);
                let relative = vector::subtract(graph, moving.relative_velocity, swept);
                let along = vector::dot(graph, u, relative);
                let prescribed = vector::dot(graph, u_rate, moving.distance);
                graph.add(along, prescribed)
            }
            Geometry::Across { .. } => {
                let across = vector::cross(graph, u, w);
                let mut rate = vector::dot(graph, across, moving.relative_velocity);
                let [near, far] = moments_across(graph, [u, w], moving.distance);
                let changes = [[u_rate, w], [u, w_rate]].map(|[a, b]| vector::cross(graph, a, b));
                for [a, b] in [
                    [near, moving.turning[0]],
                    [far, moving.turning[1]],
                    [changes[0], moving.distance],
                    [changes[1], moving.distance],
                ] {
                    let share = vector::dot(graph, a, b);
                    rate = graph.add(rate, share);
                }
                rate
            }
            Geometry::Angle { meant, .. } => {
                let relative = vector::subtract(graph, moving.turning[1], moving.turning[0]);
                let about = vector::cross(graph, w, u);
                let rate = vector::dot(graph, relative, about);
                let [near, far] = [[u_rate, w], [u, w_rate]].map(|[a, b]| vector::dot(graph, a, b));
                let prescribed = graph.add(near, far);
                let prescribed = graph.subtract(prescribed, meant[1]);
                graph.add(rate, prescribed)
            }
            Geometry::Distance(length) => {
                let rate = vector::dot(graph, moving.distance, moving.relative_velocity);
                graph.divide(rate, length)
            }
        }
    }

    /// What multiplier 1 does: force and moment on the far body at its end (ground axes), and the moment on the near
    /// one at its own, where the opposite force acts.
    fn load(&self, graph: &mut Graph, frames: &[FrameMotion]) -> (Vector, [Vector; 2]) {
        let zero = vector::zero(graph);
        let [[u, w], _] = self.directions(graph, frames);
        match self.geometry {
            Geometry::Fixed(_) => (u, [zero; 2]),
            Geometry::Carried(_) => {
                // The near body is touched where the far one's end is.
                let distance = self.moving(graph, frames).distance;
                (u, [vector::cross(graph, u, distance), zero])
            }
            Geometry::Across { .. } => {
                let distance = self.moving(graph, frames).distance;
                (vector::cross(graph, u, w), moments_across(graph, [u, w], distance))
            }
            Geometry::Angle { .. } => {
                let moment = vector::cross(graph, w, u);
                (zero, [vector::negate(graph, moment), moment])
            }
            Geometry::Distance(length) => {
                let distance = self.moving(graph, frames).distance;
                let one = graph.constant(1.0);
                let inverse = graph.divide(one, length);
                (vector::scale(graph, inverse, distance), [zero; 2])
            }
        }
    }

    /// Wrenches of `multiplier` on the links.
    pub fn wrenches(&self, graph: &mut Graph, frames: &[FrameMotion], multiplier: Node) -> Vec<(usize, Wrench)> {
        let (force, moments) = self.load(graph, frames);
        let force = vector::scale(graph, multiplier, force);
        let moments = moments.map(|moment| vector::scale(graph, multiplier, moment));
        let reversed = vector::negate(graph, force);
        let mut wrenches = Vec::new();
        for (end, force, moment) in [(self.ends.near, reversed, moments[0]), (self.ends.far, force, moments[1])] {
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
    fn reaction(&self, graph: &mut Graph, frames: &[FrameMotion], is_moment: bool) -> Vector {
        let (force, [_, moment]) = self.load(graph, frames);
        let mut on_far = force;
        if is_moment {
            let [end, child] =
                [self.ends.far, self.ends.child].map(|end| kinematics::point_position(graph, frames, end));
            let arm = vector::subtract(graph, end, child);
            let by_force = vector::cross(graph, arm, force);
            on_far = vector::add(graph, moment, by_force);
        }
        if self.ends.is_swapped { vector::negate(graph, on_far) } else { on_far }
    }
}

/// Moments of a unit load across `near` and `far` on the bodies that carry these directions.
fn moments_across(graph: &mut Graph, [near, far]: [Vector; 2], distance: Vector) -> [Vector; 2] {
    let of_near = vector::cross(graph, far, distance);
    let of_far = vector::cross(graph, distance, near);
    [vector::cross(graph, near, of_near), vector::cross(graph, far, of_far)]
}
