//! What can be minimised, how, and what comes out.

use std::fmt;

/// Weighted residuals `r(theta)` with N rows; the cost is `V = r^T r` (method 3.21).
///
/// Methods take `&mut self` so that an implementation may keep scratch memory and count its work.
pub trait LeastSquares {
    /// The N residuals at `theta` (length p).
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure>;

    /// The N residuals and their gradient dr/dtheta, N x p column-major.
    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure>;
}

impl<P: LeastSquares + ?Sized> LeastSquares for &mut P {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        (**self).residual(theta)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        (**self).residual_and_gradient(theta)
    }
}

/// The model could not be evaluated at some parameters (typically: the simulation broke down). Information, not an
/// end: the optimiser shortens its step.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluationFailure {
    /// What failed, where and when, in the study's words.
    pub explanation: String,
}

impl fmt::Display for EvaluationFailure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.explanation)
    }
}

impl std::error::Error for EvaluationFailure {}

/// Bounds per parameter; infinite where there are none.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
}

impl Bounds {
    pub fn new(lower: Vec<f64>, upper: Vec<f64>) -> Self {
        Self { lower, upper }
    }

    /// `count` parameters without bounds.
    pub fn none(count: usize) -> Self {
        Self { lower: vec![f64::NEG_INFINITY; count], upper: vec![f64::INFINITY; count] }
    }

    pub fn len(&self) -> usize {
        self.lower.len()
    }

    pub fn is_empty(&self) -> bool {
        self.lower.is_empty()
    }

    /// Width where both bounds are finite, else 1: the scale that maps a bounded parameter to `[0,1]` (method 2).
    pub fn scale(&self, index: usize) -> f64 {
        let width = self.upper[index] - self.lower[index];
        if width.is_finite() && width > 0.0 { width } else { 1.0 }
    }

    /// Origin of the scaled parameter: the lower bound where both are finite, else 0.
    pub fn origin(&self, index: usize) -> f64 {
        let width = self.upper[index] - self.lower[index];
        if width.is_finite() && width > 0.0 { self.lower[index] } else { 0.0 }
    }

    /// Whether the parameter is searched by its logarithm: one between positive bounds scales the model, and residuals
    /// depend on its factor more evenly than on its difference.
    fn is_logarithmic(&self, index: usize) -> bool {
        self.lower[index] > 0.0 && self.upper[index].is_finite() && self.upper[index] > self.lower[index]
    }

    /// ln(upper / lower): maps the logarithm to `[0,1]`.
    fn logarithmic_width(&self, index: usize) -> f64 {
        (self.upper[index] / self.lower[index]).ln()
    }

    /// d(theta)/d(coordinate) at `value`, in the coordinate in which the search moves: `[0,1]` between two finite
    /// bounds, else the parameter itself.
    pub(super) fn slope(&self, index: usize, value: f64) -> f64 {
        if self.is_logarithmic(index) { value * self.logarithmic_width(index) } else { self.scale(index) }
    }

    /// Difference of two values in that coordinate.
    pub(super) fn distance(&self, index: usize, from: f64, to: f64) -> f64 {
        if self.is_logarithmic(index) {
            (to / from).ln() / self.logarithmic_width(index)
        } else {
            (to - from) / self.scale(index)
        }
    }

    /// The value at a distance in that coordinate, held within the bounds.
    pub(super) fn moved(&self, index: usize, from: f64, distance: f64) -> f64 {
        let value = if self.is_logarithmic(index) {
            from * (distance * self.logarithmic_width(index)).exp()
        } else {
            from + distance * self.scale(index)
        };
        value.clamp(self.lower[index], self.upper[index])
    }

    pub fn contains(&self, theta: &[f64]) -> bool {
        theta.iter().zip(&self.lower).zip(&self.upper).all(|((value, low), high)| value >= low && value <= high)
    }
}

/// Settings of the Levenberg-Marquardt iteration. All tolerances are relative.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Stop when an accepted step lowers the cost by less than this share, and the linear model promises no more.
    pub cost_tolerance: f64,
    /// Stop when the trust region is smaller than this share of the parameters (both in scaled norm).
    pub step_tolerance: f64,
    /// Stop when the cosine between residual and every gradient column that may still be followed is below this.
    pub gradient_tolerance: f64,
    pub maximum_iterations: usize,
    pub maximum_evaluations: usize,
    /// First trust region as a multiple of the scaled norm of the start (More-1978).
    pub initial_radius: f64,
    /// Singular values below this multiple of the largest count as zero in undamped steps: directions that the data
    /// do not determine are not followed. Must exceed the relative error of the gradient.
    pub rank_threshold: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cost_tolerance: 1e-8,
            step_tolerance: 1e-6,
            gradient_tolerance: 1e-8,
            maximum_iterations: 100,
            maximum_evaluations: 1000,
            initial_radius: 1.0,
            rank_threshold: 1e-6,
        }
    }
}

impl Options {
    /// Down to rounding level, for problems whose residuals are exact formulas.
    pub fn exact() -> Self {
        Self {
            cost_tolerance: 1e-15,
            step_tolerance: 1e-14,
            gradient_tolerance: 0.0,
            maximum_iterations: 5000,
            maximum_evaluations: 50_000,
            initial_radius: 1.0,
            rank_threshold: 1e-15,
        }
    }
}

/// Why an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The residual is zero.
    PerfectFit,
    CostConverged,
    StepConverged,
    GradientConverged,
    /// All parameters are at bounds that the cost pushes against.
    AllAtBounds,
    IterationLimit,
    EvaluationLimit,
    Interrupted,
    /// Every trial step failed to evaluate until the step shrank to nothing.
    EvaluationsFail,
}

impl StopReason {
    /// True where the result is a minimum as far as the tolerances tell.
    pub fn converged(self) -> bool {
        matches!(
            self,
            Self::PerfectFit | Self::CostConverged | Self::StepConverged | Self::GradientConverged | Self::AllAtBounds
        )
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::PerfectFit => "the residual is zero",
            Self::CostConverged => "the cost no longer falls",
            Self::StepConverged => "the parameters no longer move",
            Self::GradientConverged => "the cost is stationary",
            Self::AllAtBounds => "all parameters are at their bounds",
            Self::IterationLimit => "the limit of iterations was reached",
            Self::EvaluationLimit => "the limit of simulations was reached",
            Self::Interrupted => "interrupted",
            Self::EvaluationsFail => "the simulation fails for every step from here",
        })
    }
}

/// Where a parameter stands against its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundState {
    Interior,
    AtLower,
    AtUpper,
}

/// Result of a minimisation; the best point seen, whatever ended the iteration.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Length p.
    pub theta: Vec<f64>,
    /// `r^T r` at `theta`.
    pub cost: f64,
    /// Residuals at `theta`, length N.
    pub residual: Vec<f64>,
    /// dr/dtheta at `theta`, N x p column-major, in the parameters' own units (not scaled).
    pub gradient: Vec<f64>,
    pub bound_states: Vec<BoundState>,
    /// Cost at the start and after every accepted step.
    pub cost_history: Vec<f64>,
    pub stop_reason: StopReason,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations of the residual alone, failed ones included.
    pub residual_evaluations: usize,
    /// Evaluations with gradient, failed ones included.
    pub gradient_evaluations: usize,
    pub failed_evaluations: usize,
    /// The last failure met, in words.
    pub last_failure: Option<String>,
}

/// What an observer sees after every accepted step.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    pub iteration: usize,
    pub theta: &'a [f64],
    pub cost: f64,
    pub evaluations: usize,
}

/// The observer's wish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    Continue,
    /// End with the best point so far.
    Stop,
}

/// The minimisation cannot begin.
#[derive(Clone, Debug, PartialEq)]
pub enum FitError {
    /// The model cannot be evaluated at the start.
    StartFails(EvaluationFailure),
    /// Parameter `index` starts outside its bounds.
    StartOutsideBounds { index: usize },
    /// Lower bound above the upper one, or not a number.
    InvalidBounds { index: usize },
    /// The problem returned arrays of unexpected length.
    Shape { explanation: String },
}

impl fmt::Display for FitError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StartFails(failure) => write!(formatter, "the model cannot be evaluated at the start: {failure}"),
            Self::StartOutsideBounds { index } => write!(formatter, "parameter {index} starts outside its bounds"),
            Self::InvalidBounds { index } => write!(formatter, "parameter {index} has no valid bounds"),
            Self::Shape { explanation } => formatter.write_str(explanation),
        }
    }
}

impl std::error::Error for FitError {}
