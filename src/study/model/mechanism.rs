//! Bodies, joints, elements, states and events of the checked study.

use crate::diagnostics::Span;
use crate::expression::{Node, Symbol};
use crate::quantities::Dimension;
use crate::study::elastic::Elastic;

#[derive(Clone, Debug)]
pub struct Body {
    pub name: String,
    pub mass: Node,
    /// Centre of gravity in body axes, m.
    pub centre_of_gravity: [Node; 3],
    /// Inertia about the centre of gravity in body axes: xx, yy, zz, xy, xz, yz as tensor elements (products of
    /// inertia with the tensor's sign, I_xy = -int x y dm), kg m^2.
    pub inertia: [Node; 6],
    pub points: Vec<Point>,
    /// Its deformation; `None`: rigid.
    pub elastic: Option<Elastic>,
    pub span: Span,
}

/// A named point of a body, in body axes (m).
#[derive(Clone, Debug)]
pub struct Point {
    pub name: String,
    pub position: [Node; 3],
}

/// Body index, `None` for ground; and the position in that body's axes (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    pub body: Option<usize>,
    pub position: [Node; 3],
    /// On an elastic body: index into [`Elastic::frames`].
    pub frame: Option<usize>,
}

/// A joint. In the reference configuration (all coordinates zero) the two attachments coincide and the bodies' axes are
/// parallel, or turned by `orientation`. The joint turns and shifts `child` relative to `parent`.
#[derive(Clone, Debug)]
pub struct Joint {
    pub name: String,
    pub kind: JointKind,
    pub parent: Attachment,
    pub child: Attachment,
    /// Child axes to parent axes at coordinates zero; `None`: parallel.
    pub orientation: Option<[[Node; 3]; 3]>,
    /// Single motions, one after the other from parent to child: each moves the directions of those behind it.
    pub axes: Vec<JointAxis>,
    /// Free rotation behind the axes, as unit quaternion.
    pub rotation: Option<RotationSymbols>,
    /// Distance of the attachments, m, for [`JointKind::Distance`].
    pub length: Option<Node>,
    /// The joint does not carry a body but closes a kinematic loop: it becomes constraints.
    pub closes_loop: bool,
    pub span: Span,
}

impl Joint {
    /// The one axis of a joint that has no other freedom.
    pub fn single_axis(&self) -> Option<&JointAxis> {
        match (self.axes.as_slice(), self.rotation) {
            ([axis], None) => Some(axis),
            _ => None,
        }
    }
}

/// One single motion of a joint.
#[derive(Clone, Debug)]
pub struct JointAxis {
    /// As places and paths name it: `slide` (the joint has this axis only), `wheelset.turn_z`.
    pub name: String,
    pub motion: AxisMotion,
    pub symbols: JointSymbols,
    /// Prescribed motion: the coordinate as expression of time, inputs and parameters.
    pub prescribed: Option<Node>,
}

/// Unit vector in the axes of the parent (turned by the axes before it).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisMotion {
    Shift([f64; 3]),
    Turn([f64; 3]),
}

impl AxisMotion {
    pub fn direction(self) -> [f64; 3] {
        match self {
            AxisMotion::Shift(axis) | AxisMotion::Turn(axis) => axis,
        }
    }

    pub fn motion(self) -> Motion {
        match self {
            AxisMotion::Shift(_) => Motion::Translational,
            AxisMotion::Turn(_) => Motion::Rotational,
        }
    }
}

/// Symbols of a free rotation: quaternion (scalar first), relative angular velocity and its derivative in the turned
/// axes.
#[derive(Clone, Copy, Debug)]
pub struct RotationSymbols {
    pub quaternion: [Symbol; 4],
    pub velocity: [Symbol; 3],
    pub acceleration: [Symbol; 3],
}

#[derive(Clone, Copy, Debug)]
pub struct JointSymbols {
    pub position: Symbol,
    pub velocity: Symbol,
    pub acceleration: Symbol,
    /// The generalised inertia that the joint moves by itself: the child body's mass (prismatic) or its moment
    /// of inertia about the joint axis (revolute), in the reference configuration.
    pub inertia: Symbol,
}

/// A relation of positions that always holds: gears, racks, screws, belts, cams; or one of rates: rolling.
#[derive(Clone, Debug)]
pub struct Coupling {
    pub name: String,
    /// Left side minus right side, in terms of positions of joint axes, modes and points, elongations, time, inputs,
    /// parameters; of rates (linear in them) with factors of positions and axes of bodies besides.
    pub difference: Node,
    pub level: CouplingLevel,
    /// Of both sides; of rates that of their integral.
    pub dimension: Dimension,
    /// What holds the relation: acts along the growing left side, against the growing right side.
    pub load: Symbol,
    pub span: Span,
}

/// What a coupling relates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CouplingLevel {
    Positions,
    /// Rates only: a rolling wheel reaches every position.
    Rates,
}

/// What the study calls the joint; its freedom is in [`Joint::axes`] and [`Joint::rotation`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    Fixed,
    Prismatic,
    Revolute,
    Cylindrical,
    Universal,
    Planar,
    Spherical,
    Free,
    /// Listed axes.
    Axes,
    /// Massless rod with balls at both ends: only the distance of the attachments is held.
    Distance,
}

/// Translational places speak of length, velocity, force; rotational ones of angle, angular velocity, torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    Translational,
    Rotational,
}

/// A force law with its place. `load` acts on the second body (or the joint's child) along the growing coordinate,
/// and reversed on the first (or the parent).
#[derive(Clone, Debug)]
pub struct Force {
    pub name: String,
    /// The law's name, for messages.
    pub law: String,
    pub is_actuator: bool,
    pub place: ForcePlace,
    /// N or N m; in terms of `coordinate`, `rate`, joint symbols, states, parameters, inputs, time.
    pub load: Node,
    /// Symbols that mechanics replaces by the element's elongation and its rate.
    pub coordinate: Symbol,
    pub rate: Symbol,
    pub span: Span,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForcePlace {
    /// Along or about one axis of a joint; elongation = the axis' coordinate.
    Joint { joint: usize, axis: usize },
    /// Between two points. With `along`, see [`ForceDirection`]. Without, the elongation is the distance of the points
    /// minus
    /// `free_length`.
    Between { first: Attachment, second: Attachment, along: Option<ForceDirection>, free_length: Option<Node> },
}

/// A direction for a force element: the elongation is the displacement of the second point against the first along it
/// (translational, from the reference configuration), or the angle by which the second body is turned about it against
/// the first (rotational).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceDirection {
    /// Unit vector.
    pub axis: [f64; 3],
    /// The body in whose axes it is given and with which it turns; `None`: ground.
    pub body: Option<usize>,
    pub motion: Motion,
}

#[derive(Clone, Debug)]
pub struct Signal {
    pub name: String,
    pub value: Node,
    pub dimension: Dimension,
    pub span: Span,
}

/// A first-order state of a law.
#[derive(Clone, Debug)]
pub struct State {
    /// Dotted, e.g. `strut.z`.
    pub name: String,
    pub symbol: Symbol,
    pub derivative: Node,
    /// Value at the start when the experiment starts from rest; equilibrium replaces it.
    pub initial: Node,
    /// Typical size (SI) where the study states it; else it follows from the dimension.
    pub nominal: Option<f64>,
    pub dimension: Dimension,
    pub span: Span,
}

/// A law changes states at once; all values are those before.
#[derive(Clone, Debug)]
pub struct Event {
    /// The element whose law declares it.
    pub owner: String,
    pub trigger: EventTrigger,
    pub changes: Vec<(ChangeTarget, Node)>,
    pub span: Span,
}

impl Event {
    /// Everything it is made of.
    pub fn nodes(&self) -> impl Iterator<Item = Node> {
        self.trigger.nodes_with(&self.changes)
    }
}

#[derive(Clone, Copy, Debug)]
pub enum EventTrigger {
    /// The value becomes positive.
    Rises(Node),
    /// At all multiples of this time, s, from the start on.
    Every(f64),
}

impl EventTrigger {
    /// What the condition and the new values are made of.
    pub fn nodes_with<T>(self, changes: &[(T, Node)]) -> impl Iterator<Item = Node> {
        let condition = match self {
            EventTrigger::Rises(condition) => Some(condition),
            EventTrigger::Every(_) => None,
        };
        condition.into_iter().chain(changes.iter().map(|(_, value)| *value))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeTarget {
    /// State of a law.
    State(Symbol),
    /// Rate of a force element (index in [`Study::forces`](super::Study::forces)), changed by an impulse along the
    /// element.
    Rate(usize),
}
