//! Measures, experiments, manoeuvres and criteria of the checked study, and how it is solved.

use super::{Attachment, Study};
use crate::diagnostics::Span;
use crate::expression::{Node, Symbol};
use crate::quantities::Unit;
use std::path::PathBuf;

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
    /// Indices into [`Study::measures`](super::Study::measures).
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
    /// Inputs (index into [`Study::inputs`](super::Study::inputs), value in SI) that the record does not hold and that
    /// the experiment states as constant: `inputs = { pulse = 0 V }`. Every other input needs its column.
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
    /// Index into [`Study::manoeuvres`](super::Study::manoeuvres).
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
    /// How simulations start, experiments first, then manoeuvres: (what it is, start, place). Simulations refer to this
    /// order.
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
