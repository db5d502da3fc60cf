//! The checked study. All numbers are SI; all expressions are nodes of [`Study::graph`].

mod measured;
mod mechanism;
mod tried;

use crate::diagnostics::Span;
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Unit;

pub use measured::*;
pub use mechanism::*;
pub use tried::*;

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
    pub couplings: Vec<Coupling>,
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
