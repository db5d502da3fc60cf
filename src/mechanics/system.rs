//! The equations of a study.

use crate::diagnostics::{Diagnostic, Span};
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::EventTrigger;
use std::collections::HashMap;

/// Name of the probe of an elastic body, behind that of the body: squared ratio of its angular velocity and its lowest
/// circular frequency.
pub const TURNING: &str = "turning";

/// Name of the state that says which constraints of a loop are in force where several sets of them take turns, behind
/// that of their joint.
pub const IN_FORCE: &str = "constraints_in_force";

/// `x' = rates(t, x, w, theta)`, `0 = constraints(t, x, w, theta)`, `y = outputs(t, x, w, theta)`.
///
/// Plain trees have no algebraic variables w: the accelerations are eliminated symbolically (articulated-body
/// algorithm), so the system is an explicit ordinary differential equation. Closed loops add multipliers in the
/// Gear-Gupta-Leimkuhler form (Gear-Gupta-Leimkuhler-1985): `q' = T(q) (v + G^T mu)`, `v' = a(q, v, lambda)`,
/// `0 = G v + g_t`, `0 = g`; what rolls has no
/// g and no mu.
#[derive(Clone, Debug)]
pub struct System {
    pub graph: Graph,
    pub time: Symbol,
    pub states: Vec<Variable>,
    pub rates: Vec<Node>,
    /// Multipliers of constraints on velocity level, those on position level (Gear-Gupta-Leimkuhler), then reactions
    /// that loads depend on.
    pub algebraic: Vec<Variable>,
    /// One per algebraic variable: velocity constraints, position constraints, definitions of the reactions.
    pub constraints: Vec<Node>,
    /// In the study's words, one per constraint.
    pub constraint_names: Vec<String>,
    /// Number of constraints that closed loops and couplings leave, each with a multiplier on velocity level ...
    pub loop_constraints: usize,
    /// ... and so many of them, the first ones, with one on position level; the others relate rates only.
    pub position_constraints: usize,
    /// Per such constraint the joint or coupling that it belongs to, with its place.
    pub loop_owners: Vec<(String, Span)>,
    /// What was found on the way and changes nothing: redundant constraints.
    pub warnings: Vec<Diagnostic>,
    pub parameters: Vec<Symbol>,
    pub parameter_names: Vec<String>,
    /// One per output of the study ([`crate::study::Study::outputs`]), in its order: measures, then criteria.
    pub outputs: Vec<Output>,
    /// What changes states at instants.
    pub events: Vec<Event>,
    /// Further quantities that can be evaluated along a solution: place probes in the study's order of
    /// `places[..].probes[..]`, flattened; then per elastic body [`TURNING`].
    pub probes: Vec<Output>,
    /// Per experiment, then per manoeuvre: start value of each state as far as given (see [`StartEquation`]), in state
    /// order.
    pub starts: Vec<Vec<StartEquation>>,
    /// Likewise a position near the start in which the loops are closed, SI.
    pub references: Vec<Vec<f64>>,
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
    /// Value in the reference configuration: zero, but for the first component of quaternions; with closed loops, in a
    /// position near it (near the first start of the study) that closes them.
    pub reference: f64,
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

/// States that change at once; all values are those before.
#[derive(Clone, Debug)]
pub struct Event {
    /// The element whose law declares it.
    pub name: String,
    pub trigger: EventTrigger,
    /// Index into [`System::states`] and the value after the event.
    pub changes: Vec<(usize, Node)>,
}

impl Event {
    /// Everything it is made of.
    pub fn nodes(&self) -> impl Iterator<Item = Node> {
        self.trigger.nodes_with(&self.changes)
    }
}

/// How a state starts.
#[derive(Clone, Copy, Debug)]
pub enum StartEquation {
    /// The value is this node (of parameters, inputs and time; also of other states that are `Value`s themselves).
    Value(Node),
    /// From the condition of equilibrium: velocities zero, all rates zero.
    Equilibrium,
}

impl System {
    /// Replaces parameters by numbers (SI): they become constants of the equations and are parameters no longer.
    pub fn freeze(&mut self, values: &[(Symbol, f64)]) {
        let replacements: HashMap<Symbol, Node> =
            values.iter().map(|&(symbol, value)| (symbol, self.graph.constant(value))).collect();
        let mut substitute = |nodes: Vec<&mut Node>| {
            let old: Vec<Node> = nodes.iter().map(|node| **node).collect();
            let new = self.graph.substitute(&old, &replacements);
            nodes.into_iter().zip(new).for_each(|(node, new)| *node = new);
        };
        substitute(self.rates.iter_mut().chain(&mut self.constraints).collect());
        let conditions = self.events.iter_mut().filter_map(|event| match &mut event.trigger {
            EventTrigger::Rises(condition) => Some(condition),
            EventTrigger::Every(_) => None,
        });
        substitute(conditions.collect());
        let changes = self.events.iter_mut().flat_map(|event| &mut event.changes);
        substitute(changes.map(|(_, value)| value).collect());
        substitute(self.outputs.iter_mut().chain(&mut self.probes).map(|output| &mut output.value).collect());
        substitute(
            self.starts
                .iter_mut()
                .flatten()
                .filter_map(|equation| match equation {
                    StartEquation::Value(node) => Some(node),
                    StartEquation::Equilibrium => None,
                })
                .collect(),
        );
        let kept: Vec<bool> = self.parameters.iter().map(|symbol| !replacements.contains_key(symbol)).collect();
        let mut keep = kept.iter();
        self.parameters.retain(|_| *keep.next().unwrap_or(&true));
        let mut keep = kept.iter();
        self.parameter_names.retain(|_| *keep.next().unwrap_or(&true));
    }
}
