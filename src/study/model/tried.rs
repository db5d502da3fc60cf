//! What a diagnosis may try: numbers that the study holds fixed, places, effects.

use super::Motion;
use crate::diagnostics::Span;
use crate::expression::Node;
use crate::quantities::{Dimension, Unit};

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
    /// A component of gravity, by ground axis.
    Gravity,
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
    /// A shape that no law describes: tried only where the named effects leave something.
    pub fn is_unnamed(&self) -> bool {
        self.amplitudes.iter().any(|amplitude| amplitude.unnamed)
    }

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
    /// Point of a free shape, not the strength of a known cause.
    pub unnamed: bool,
    /// Shape that is a period: a coarse grid would miss it.
    pub periodic: bool,
    pub unit: Option<Unit>,
}
