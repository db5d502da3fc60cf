//! The checked study. All numbers are SI; all expressions are nodes of [`Study::graph`].

use super::elastic::Elastic;
use crate::diagnostics::Span;
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::{Dimension, Unit};
use std::path::PathBuf;

/// A study with one variant applied; everything later stages need, nothing about how it was written but spans.
#[derive(Clone, Debug)]
pub struct Study {
    pub name: String,
    pub title: String,
    /// `base` or the name of the variant that was applied.
    pub variant: String,
    /// Names of all variants declared in the text, `base` not included.
    pub variants: Vec<String>,
    pub graph: Graph,
    /// The symbol `t`.
    pub time: Symbol,
    /// Gravitational acceleration in ground axes, m/s^2; zero where the study declares none.
    pub gravity: [Node; 3],
    pub parameters: Vec<Parameter>,
    /// What must hold between parameters.
    pub constraints: Vec<Constraint>,
    pub inputs: Vec<Input>,
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    pub forces: Vec<Force>,
    /// Signals (controllers, filters, formulas): named values without a mechanical place.
    pub signals: Vec<Signal>,
    /// States of laws, signals, sensors and effects, in order of declaration.
    pub states: Vec<State>,
    /// What changes states at instants.
    pub events: Vec<Event>,
    pub measures: Vec<Measure>,
    /// Symbols for coordinates of points that expressions mention.
    pub point_quantities: Vec<PointQuantity>,
    /// Symbols for what joints transmit.
    pub reactions: Vec<ReactionQuantity>,
    /// The tree of channel groups; the root is called `total`.
    pub groups: Group,
    pub experiments: Vec<Experiment>,
    /// Uses of the model that were not measured.
    pub manoeuvres: Vec<Manoeuvre>,
    /// What the model is to predict in them.
    pub criteria: Vec<Criterion>,
    pub filter: Option<Filter>,
    pub remove_mean: bool,
    pub solver: Solver,
    /// Numbers the study holds fixed and that an extension may free, e.g. `tyre.stiffness`.
    pub constants: Vec<Constant>,
    /// The catalogue of candidate effects: prelude, then the study's own.
    pub effects: Vec<EffectDeclaration>,
    /// Everything an effect can attach to.
    pub places: Vec<Place>,
}

impl Study {
    /// The axis that a force element stands on, if it stands on a joint.
    pub fn axis_of(&self, force: &Force) -> Option<&JointAxis> {
        match force.place {
            ForcePlace::Joint { joint, axis } => self.joints.get(joint)?.axes.get(axis),
            ForcePlace::Between { .. } => None,
        }
    }
}

/// A parameter to identify.
#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: String,
    pub symbol: Symbol,
    /// As written; results are shown in it.
    pub unit: Unit,
    pub lower: f64,
    pub upper: f64,
    pub start: f64,
    pub prior: Option<Prior>,
    pub span: Span,
}

impl Parameter {
    /// Typical variation, SI, positive: the width of the bounds where it is finite, else the size of the start value (1
    /// where that is zero).
    pub fn scale(&self) -> f64 {
        let width = self.upper - self.lower;
        if width.is_finite() && width > 0.0 {
            width
        } else if self.start != 0.0 {
            self.start.abs()
        } else {
            1.0
        }
    }
}

/// `value <= 0`, of parameters and numbers only.
#[derive(Clone, Debug)]
pub struct Constraint {
    pub value: Node,
    /// As written.
    pub text: String,
    pub span: Span,
}

#[derive(Clone, Copy, Debug)]
pub struct Prior {
    pub mean: f64,
    pub standard_deviation: f64,
}

/// A sampled input. Appears in expressions as `Operation::Sample { input: index in Study::inputs, .. }`.
#[derive(Clone, Debug)]
pub struct Input {
    pub name: String,
    pub title: String,
    pub unit: Unit,
    pub interpolation: Interpolation,
    pub span: Span,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    Hold,
    Linear,
    Cubic,
}

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
#[derive(Clone, Copy, Debug)]
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

/// Symbols of a free rotation: quaternion (scalar first), relative angular velocity and its derivative in the turned axes.
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

#[derive(Clone, Copy, Debug)]
pub enum ForcePlace {
    /// Along or about one axis of a joint; elongation = the axis' coordinate.
    Joint { joint: usize, axis: usize },
    /// Between two points. With `along`, see [`ForceDirection`]. Without, the elongation is the distance of the points minus
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
        let condition = match self.trigger {
            EventTrigger::Rises(condition) => Some(condition),
            EventTrigger::Every(_) => None,
        };
        condition.into_iter().chain(self.changes.iter().map(|(_, value)| *value))
    }
}

#[derive(Clone, Copy, Debug)]
pub enum EventTrigger {
    /// The value becomes positive.
    Rises(Node),
    /// At all multiples of this time, s, from the start on.
    Every(f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeTarget {
    /// State of a law.
    State(Symbol),
    /// Rate of a force element (index in [`Study::forces`]), changed by an impulse along the element.
    Rate(usize),
}

#[derive(Clone, Debug)]
pub struct Measure {
    pub name: String,
    pub title: String,
    pub unit: Unit,
    /// May contain joint accelerations and point quantities.
    pub value: Node,
    /// Standard deviation of the noise in SI where the study states it, that of the rounding included.
    pub noise: Option<f64>,
    /// Further factor on the channel's residual; 1 unless stated.
    pub weight: f64,
    /// By which the channel shows the value late, s; of parameters and numbers.
    pub delay: Option<Node>,
    /// Step to whose multiples the sensor rounds, SI.
    pub quantisation: Option<f64>,
    pub span: Span,
}

impl Measure {
    /// What the sensor shows of a value: rounded to its steps.
    pub fn shown(&self, value: f64) -> f64 {
        self.quantisation.map_or(value, |step| (value / step).round() * step)
    }

    /// Standard deviation of the rounding, SI; 0 without. Steps q are noise of the variance q^2 / 12 (Widrow-1961).
    pub fn rounding(&self) -> f64 {
        self.quantisation.map_or(0.0, |step| step / 12f64.sqrt())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PointMotion {
    Position,
    Velocity,
    Acceleration,
    /// Of the body.
    AngularVelocity,
    AngularAcceleration,
    /// The body's axis 0, 1, 2 as unit vector.
    Axis(usize),
}

impl PointMotion {
    /// Whether it follows from the loads at the same instant.
    pub fn is_acceleration(self) -> bool {
        matches!(self, PointMotion::Acceleration | PointMotion::AngularAcceleration)
    }
}

/// `symbol` stands for one ground-axis component of what a joint transmits to its child, at its place.
#[derive(Clone, Copy, Debug)]
pub struct ReactionQuantity {
    pub symbol: Symbol,
    pub joint: usize,
    /// Torque; else force.
    pub is_moment: bool,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    pub span: Span,
}

/// `symbol` stands for one ground-axis component of the motion of a point.
#[derive(Clone, Debug)]
pub struct PointQuantity {
    pub symbol: Symbol,
    pub point: Attachment,
    pub motion: PointMotion,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
}

#[derive(Clone, Debug)]
pub struct Group {
    pub name: String,
    pub groups: Vec<Group>,
    /// Indices into [`Study::measures`].
    pub channels: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Fitted and screened.
    Estimation,
    /// Decides whether an extension transfers.
    Validation,
    /// Looked at once, for the final figure.
    Test,
}

#[derive(Clone, Debug)]
pub struct Experiment {
    pub name: String,
    pub role: Role,
    /// As written, relative to the study's file (or to `--data DIR`).
    pub data: PathBuf,
    /// Column of the time; `t` unless stated.
    pub time_column: String,
    /// (input or measure name, column name) where they differ.
    pub columns: Vec<(String, String)>,
    /// Inputs (index into [`Study::inputs`], value in SI) that the record does not hold and that the experiment states
    /// as constant: `inputs = { pulse = 0 V }`. Every other input needs its column.
    pub constant_inputs: Vec<(usize, f64)>,
    /// Indices of the measures compared in this experiment (default: all).
    pub measures: Vec<usize>,
    /// Samples compared, s; the simulation starts at the record's first sample (or at `begin`).
    pub window: Option<(f64, f64)>,
    pub start: Start,
    pub span: Span,
    pub data_span: Span,
}

/// A simulation without data: inputs as formulas of time.
#[derive(Clone, Debug)]
pub struct Manoeuvre {
    pub name: String,
    pub title: String,
    /// One per input of the study: of time and numbers only.
    pub inputs: Vec<Node>,
    /// s; the simulation starts at time zero.
    pub duration: f64,
    /// Interval of the instants at which criteria look at it, s.
    pub step: f64,
    pub start: Start,
    pub span: Span,
}

/// A scalar of a manoeuvre, and what is demanded of it.
#[derive(Clone, Debug)]
pub struct Criterion {
    pub name: String,
    pub title: String,
    pub unit: Unit,
    pub statistic: Statistic,
    /// The quantity over time; like a measure.
    pub value: Node,
    /// Index into [`Study::manoeuvres`].
    pub manoeuvre: usize,
    pub below: Option<f64>,
    pub above: Option<f64>,
    /// Largest half-width of its confidence interval that is acceptable.
    pub within: Option<f64>,
    /// At which the demand must hold, e.g. 0.95.
    pub confidence: f64,
    pub span: Span,
}

/// From a history to a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    Minimum,
    Maximum,
    RootMeanSquare,
    Mean,
    Final,
}

impl Statistic {
    pub const NAMES: [(&str, Statistic); 5] = [
        ("min", Statistic::Minimum),
        ("max", Statistic::Maximum),
        ("rms", Statistic::RootMeanSquare),
        ("mean", Statistic::Mean),
        ("final", Statistic::Final),
    ];

    /// As written in the study.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, statistic)| *statistic == self).map_or("", |(name, _)| name)
    }
}

impl Study {
    /// How simulations start, experiments first, then manoeuvres: (what it is, start, place). Simulations refer to this order.
    pub fn starts(&self) -> impl Iterator<Item = (String, &Start, Span)> {
        let experiments = self.experiments.iter().map(|e| (format!("experiment `{}`", e.name), &e.start, e.span));
        experiments.chain(self.manoeuvres.iter().map(|m| (format!("manoeuvre `{}`", m.name), &m.start, m.span)))
    }

    /// What is evaluated along a solution, measures first, then criteria: (name, value, place).
    pub fn outputs(&self) -> impl Iterator<Item = (&str, Node, Span)> {
        let measures = self.measures.iter().map(|m| (m.name.as_str(), m.value, m.span));
        measures.chain(self.criteria.iter().map(|c| (c.name.as_str(), c.value, c.span)))
    }
}

#[derive(Clone, Debug)]
pub struct Start {
    pub base: StartBase,
    /// Joint positions/velocities or law states (by symbol) set to a value that may depend on parameters.
    pub overrides: Vec<(Symbol, Node)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartBase {
    Equilibrium,
    /// Reference configuration at rest, law states at their declared `from` value.
    Rest,
}

/// Low-pass Butterworth design by edges (Hz) and attenuations (dB, of the whole zero-phase operation unless
/// `single_pass`).
#[derive(Clone, Copy, Debug)]
pub struct Filter {
    pub pass: f64,
    pub pass_drop: f64,
    pub stop: f64,
    pub stop_attenuation: f64,
    pub single_pass_specification: bool,
    pub span: Span,
}

#[derive(Clone, Copy, Debug)]
pub struct Solver {
    pub relative_tolerance: f64,
    pub method: Method,
    pub loss: Loss,
    pub error: ErrorDefinition,
    /// Coloured noise is modelled and the cost weighted by it (pre-whitening).
    pub coloured_noise: bool,
}

/// What counts as error between model and measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ErrorDefinition {
    /// Free simulation from the start.
    #[default]
    Output,
    /// Measured states in the equations of motion.
    Equation,
    /// One-step predictions by an extended Kalman filter.
    Filter,
    /// Stretches that the fit joins.
    Shooting,
}

impl ErrorDefinition {
    pub const ALL: [Self; 4] = [Self::Output, Self::Equation, Self::Filter, Self::Shooting];
    /// As written in the study, in the order of [`ErrorDefinition::ALL`].
    pub const NAMES: [&str; 4] = ["output", "equation", "filter", "shooting"];

    pub fn name(self) -> &'static str {
        Self::ALL.iter().zip(Self::NAMES).find(|(own, _)| **own == self).map_or("", |(_, name)| name)
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.name() == name)
    }
}

/// How residuals count in the cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loss {
    #[default]
    Squares,
    /// Squares up to 1.345 standard deviations, linear beyond: outliers count less.
    Huber,
    /// Of a Student distribution with 4 degrees of freedom: far outliers hardly count.
    Student,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    Automatic,
    Bdf,
    RungeKutta,
}

/// A number given in the study for an element's property that is not identified.
#[derive(Clone, Debug)]
pub struct Constant {
    /// Path usable as a target of `identify`, e.g. `tyre.stiffness`.
    pub path: String,
    pub value: f64,
    pub unit: Unit,
    pub span: Span,
}

/// What an effect may attach to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PlaceKind {
    Joint,
    /// A force element that is no actuator.
    Force,
    Actuator,
    Input,
    Measure,
    Signal,
}

#[derive(Clone, Debug)]
pub struct Place {
    pub kind: PlaceKind,
    /// The element's name.
    pub name: String,
    /// For joints, forces, actuators.
    pub motion: Option<Motion>,
    /// Dimension of the value (input, measure, signal) or of the load.
    pub dimension: Dimension,
    /// What an effect can replace here: `load`, `x`, `v`, `command`, ... Empty for joints.
    pub ports: Vec<String>,
    /// Nodes for the place's typical magnitudes, where they exist: `coordinate`, `rate`, `load`, `value`.
    /// For a joint, `load` is the sum of the loads acting on it (kinematic symbols included).
    pub probes: Vec<(PlaceQuantity, Node)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PlaceQuantity {
    Coordinate,
    Rate,
    Load,
    Value,
    Time,
}

/// A candidate effect as declared; see the language reference.
#[derive(Clone, Debug)]
pub struct EffectDeclaration {
    pub name: String,
    pub title: String,
    pub kinds: Vec<PlaceKind>,
    /// Restricts to places of this motion.
    pub motion: Option<Motion>,
    /// `None`: any; else the dimension the place's value must have.
    pub dimension: Option<Dimension>,
    /// Ports that it replaces.
    pub replaces: Vec<String>,
    pub amplitudes: Vec<EffectParameter>,
    pub shapes: Vec<EffectParameter>,
    /// Shown with the candidate (`/// ...` in the declaration).
    pub documentation: String,
    pub is_prelude: bool,
}

impl EffectDeclaration {
    /// Whether the effect can act at this place of the study.
    pub fn fits(&self, place: &Place) -> bool {
        self.kinds.contains(&place.kind)
            && self.motion.is_none_or(|motion| place.motion == Some(motion))
            && self.dimension.is_none_or(|dimension| dimension == place.dimension)
            && self.replaces.iter().all(|port| place.ports.contains(port))
    }
}

/// An amplitude (zero means: not there) or a shape parameter of an effect.
#[derive(Clone, Debug)]
pub struct EffectParameter {
    pub name: String,
    /// The type as a monomial of place quantities, e.g. `load/rate^2` = [(Load, 1), (Rate, -2)]. Gives the dimension
    /// at a place and, evaluated with typical magnitudes, the natural scale.
    pub monomial: Vec<(PlaceQuantity, i8)>,
    /// Fixed dimension where the type is not a place monomial (time, frequency, ratio).
    pub dimension: Option<Dimension>,
    /// Declared range (SI), absolute.
    pub range: Option<(f64, f64)>,
    /// Declared range relative to the natural scale, e.g. `0.01 .. 1 of rate`.
    pub relative_range: Option<(f64, f64)>,
    /// Only positive amplitudes make physical sense.
    pub one_sided: bool,
    /// Value at which the effect is absent: 0 for amplitudes unless declared (`neutral 1`).
    pub neutral: f64,
    /// The effect is not differentiable (or not defined) at its neutral value: scan finite strengths only.
    pub finite_only: bool,
    pub unit: Option<Unit>,
}
