//! The equations of a study.

use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;

/// `x' = rates(t, x, w, theta)`, `0 = constraints(t, x, w, theta)`, `y = outputs(t, x, w, theta)`.
///
/// Plain trees have no algebraic variables w: the accelerations are eliminated symbolically (articulated-body
/// algorithm), so the system is an explicit ordinary differential equation.
#[derive(Clone, Debug)]
pub struct System {
    pub graph: Graph,
    pub time: Symbol,
    pub states: Vec<Variable>,
    pub rates: Vec<Node>,
    pub algebraic: Vec<Variable>,
    pub constraints: Vec<Node>,
    pub parameters: Vec<Symbol>,
    pub parameter_names: Vec<String>,
    /// One per measure of the study, in the study's order.
    pub outputs: Vec<Output>,
    /// Further quantities that can be evaluated along a solution: place probes in the study's order of
    /// `places[..].probes[..]`, flattened.
    pub probes: Vec<Output>,
    /// Per experiment: start value of each state as far as given (see [`StartEquation`]), in state order.
    pub starts: Vec<Vec<StartEquation>>,
}

#[derive(Clone, Debug)]
pub struct Variable {
    pub symbol: Symbol,
    /// In the study's words: `slide.position`, `strut.z`.
    pub name: String,
    pub kind: VariableKind,
    pub dimension: Dimension,
    /// Typical magnitude, SI; the integrator's absolute tolerance refers to it.
    pub scale: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableKind {
    Position,
    Velocity,
    Law,
    Algebraic,
}

#[derive(Clone, Debug)]
pub struct Output {
    pub name: String,
    pub value: Node,
}

/// How a state starts.
#[derive(Clone, Copy, Debug)]
pub enum StartEquation {
    /// The value is this node (of parameters, inputs and time; also of other states that are `Value`s themselves).
    Value(Node),
    /// From the condition of equilibrium: velocities zero, all rates zero.
    Equilibrium,
}
