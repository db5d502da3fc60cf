//! What can be integrated, and what comes out.

use crate::linear::SparsityPattern;

/// A differential-algebraic system `0 = F(t, y, y'; theta)` of index 0, 1 or 2.
///
/// Systems of index 2 have Hessenberg form: `x' = f(t, x, w)`, `0 = c(t, x)`, where f may contain further algebraic
/// components with equations of their own. Mechanisms with loops are brought to it by the method of
/// Gear-Gupta-Leimkuhler-1985: constraints on position and on velocity level, a multiplier for each. Which equations
/// are constraints and which components their multipliers is found from the entries of the Jacobian.
///
/// `n` = [`Dynamics::dimension`], `p` = [`Dynamics::parameter_count`]. Methods take `&mut self` so that an
/// implementation may keep scratch memory. Non-finite results are allowed; the integrator treats them as a failed step.
pub trait Dynamics {
    fn dimension(&self) -> usize;

    fn parameter_count(&self) -> usize;

    /// True for components whose derivative appears in F; false for algebraic ones. Length n.
    fn differential(&self) -> &[bool];

    /// Typical magnitude per component (SI), the absolute tolerance is relative to it. Length n.
    fn scale(&self) -> &[f64];

    /// F into `residual`, length n.
    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]);

    /// Fixed pattern of dF/dy + c dF/dy', compressed sparse columns.
    fn pattern(&self) -> &SparsityPattern;

    /// Values of dF/dy + c dF/dy' in the order of [`Dynamics::pattern`].
    fn jacobian(&mut self, t: f64, y: &[f64], y_prime: &[f64], c: f64, values: &mut [f64]);

    /// Structure of a square matrix that has further unknowns behind the n components, each with an equation of its own
    /// behind those of F, and from which dF/dy + c dF/dy' follows by their elimination. Given for large systems of the
    /// form
    /// `y' = f`, `0 = g` where it has far fewer entries than the Jacobian itself.
    fn expanded_pattern(&self) -> Option<&SparsityPattern> {
        None
    }

    /// Values of that matrix in the order of [`Dynamics::expanded_pattern`], the columns of components in units of
    /// `scale` (positive, length n). Must be given along with a pattern.
    fn expanded_jacobian(&mut self, _t: f64, _y: &[f64], _c: f64, _scale: &[f64], _values: &mut [f64]) {}

    /// dF/dtheta, n x p column-major.
    fn parameter_derivative(&mut self, t: f64, y: &[f64], y_prime: &[f64], values: &mut [f64]);

    /// Structure of dF/dtheta (n x p) where the implementation knows it; none means full, column-major. Explicit
    /// integration of large systems spends much of its time on the zeros of a full one.
    fn parameter_pattern(&self) -> Option<&SparsityPattern> {
        None
    }

    /// Values of dF/dtheta in the order of [`Dynamics::parameter_pattern`]. Must be given along with a pattern.
    fn parameter_entries(&mut self, t: f64, y: &[f64], y_prime: &[f64], values: &mut [f64]) {
        self.parameter_derivative(t, y, y_prime, values);
    }

    /// Typical magnitude per parameter (SI, positive), length p: the absolute tolerance of a sensitivity is that of its
    /// component divided by it. Empty where unknown; then each column is measured by its own largest value so far.
    fn parameter_scale(&self) -> &[f64] {
        &[]
    }

    /// For systems of the form `y' - f(t, y) = 0` without algebraic components: `f` into `rates`, and true.
    /// Explicit methods need it.
    fn explicit_rates(&mut self, _t: f64, _y: &[f64], _rates: &mut [f64]) -> bool {
        false
    }

    /// `f`, dF/dy (values of [`Dynamics::jacobian`] with c = 0) and [`Dynamics::parameter_entries`] at one point, for
    /// systems with [`Dynamics::explicit_rates`]. One call, so that an implementation can share common work; this is
    /// the inner loop of explicit integration with sensitivities.
    fn linearised_rates(
        &mut self,
        t: f64,
        y: &[f64],
        rates: &mut [f64],
        jacobian: &mut [f64],
        parameter_entries: &mut [f64],
    ) -> bool {
        if !self.explicit_rates(t, y, rates) {
            return false;
        }
        self.jacobian(t, y, rates, 0.0, jacobian);
        self.parameter_entries(t, y, rates, parameter_entries);
        true
    }

    /// Number of functions at whose zeros the right-hand side may have a kink although no event is declared there.
    fn kink_count(&self) -> usize {
        0
    }

    /// Values of these functions.
    fn kinks(&mut self, _t: f64, _y: &[f64], _values: &mut [f64]) {}

    /// From now on the right-hand side and its derivatives are those of one side of each kink, whatever the function's
    /// value: that of negative values where true. They are smooth then. Without sides the values decide again.
    fn hold_sides(&mut self, _sides: Option<&[bool]>) {}

    /// Number of switching functions: as long as none changes its sign, the right-hand side is smooth.
    fn switch_count(&self) -> usize {
        0
    }

    /// Values of the switching functions; in modes in which one has no meaning it keeps a constant sign.
    fn switches(&mut self, _t: f64, _y: &[f64], _values: &mut [f64]) {}

    /// Derivatives of switching function `k`; zero on entry.
    fn switch_derivatives(&mut self, _k: usize, _t: f64, _y: &[f64], _derivatives: &mut SwitchDerivatives) {}

    /// Derivatives of the reset that a zero of function `k` brings; those of no reset on entry. `y` and the mode are
    /// those before it.
    fn reset_derivatives(
        &mut self,
        _k: usize,
        _rising: bool,
        _t: f64,
        _y: &[f64],
        _derivatives: &mut ResetDerivatives,
    ) {
    }

    /// At a zero of function `k`: changes the mode of the equations, and the state where it jumps.
    fn reset(&mut self, _k: usize, _rising: bool, _t: f64, _y: &mut [f64]) {}

    /// Whether a change of sign of function `k` is an event; where not, the right-hand side is smooth there.
    fn switch_acts(&self, _k: usize, _rising: bool) -> bool {
        true
    }

    /// Whether a function that becomes positive by the jump of another event acts at once.
    fn acts_on_jumps(&self) -> bool {
        false
    }

    /// Periods of clocks, s, positive: at all multiples of them from the start on the state changes by
    /// [`Dynamics::tick`].
    fn clock_periods(&self) -> &[f64] {
        &[]
    }

    /// Changes the state where these clocks tick at the same time.
    fn tick(&mut self, _clocks: &[usize], _t: f64, _y: &mut [f64]) {}

    /// Derivatives of [`Dynamics::tick`]; those of no change on entry. `y` is the state before it.
    fn tick_derivatives(&mut self, _clocks: &[usize], _t: f64, _y: &[f64], _derivatives: &mut ResetDerivatives) {}

    /// Name of component `i` in the study's words, for messages.
    fn component_name(&self, i: usize) -> String {
        format!("y[{i}]")
    }

    /// Name of equation (row of F) `i` in the study's words, for messages: of a constraint, the loop it closes.
    fn equation_name(&self, i: usize) -> String {
        format!("equation of {}", self.component_name(i))
    }
}

/// Derivatives of a switching function.
#[derive(Clone, Debug, PartialEq)]
pub struct SwitchDerivatives {
    pub by_time: f64,
    /// Length n.
    pub by_state: Vec<f64>,
    /// Length p (0 in a nominal run).
    pub by_parameter: Vec<f64>,
}

impl SwitchDerivatives {
    pub fn zero(n: usize, p: usize) -> Self {
        Self { by_time: 0.0, by_state: vec![0.0; n], by_parameter: vec![0.0; p] }
    }
}

/// Derivatives of the state after a reset.
#[derive(Clone, Debug, PartialEq)]
pub struct ResetDerivatives {
    /// Length n.
    pub by_time: Vec<f64>,
    /// With respect to the state before, n x n column-major.
    pub by_state: Vec<f64>,
    /// n x p column-major (p = 0 in a nominal run).
    pub by_parameter: Vec<f64>,
}

impl ResetDerivatives {
    /// Of no reset.
    pub fn identity(n: usize, p: usize) -> Self {
        let by_state = (0..n * n).map(|k| if k % (n + 1) == 0 { 1.0 } else { 0.0 }).collect();
        Self { by_time: vec![0.0; n], by_state, by_parameter: vec![0.0; n * p] }
    }
}

/// Where the solution is wanted and how exactly.
#[derive(Clone, Debug)]
pub struct Options {
    pub relative_tolerance: f64,
    /// Absolute tolerance of component i = `relative_tolerance * absolute_factor * scale[i]`.
    pub absolute_factor: f64,
    /// Include the sensitivities in the error control.
    pub control_sensitivities: bool,
    pub method: MethodChoice,
    pub maximum_steps: usize,
    pub initial_step: Option<f64>,
    /// Upper bound of the step. Without one, a start at rest lets the step grow past short inputs that begin later.
    pub maximum_step: Option<f64>,
    /// Keep the sequence of steps in [`Solution::plan`].
    pub record_plan: bool,
    /// Follow this sequence of steps instead of controlling the error: the solution becomes a smooth function of the
    /// parameters, whose derivative the sensitivities of the recorded run are (internal differentiation). Impossible
    /// for systems with switching functions, whose events move with the parameters.
    pub follow_plan: Option<std::sync::Arc<Plan>>,
}

/// A sequence of accepted steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    pub steps: Vec<PlannedStep>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PlannedStep {
    /// Time at the end of the step.
    pub end: f64,
    /// Order of the BDF; 0 for an explicit step of order 5, 8 for one of order 8.
    pub order: u8,
    pub branches: Branches,
}

/// How the sides of kinks are chosen in a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Branches {
    /// By the values, stage by stage.
    #[default]
    Free,
    /// Likewise, after a step back from a kink that was not crossed.
    Freed,
    /// As they are listed ([`Dynamics::hold_sides`]).
    Held(std::sync::Arc<[bool]>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodChoice {
    Automatic,
    Bdf,
    RungeKutta,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-6,
            absolute_factor: 1e-3,
            control_sensitivities: true,
            method: MethodChoice::Automatic,
            maximum_steps: 2_000_000,
            initial_step: None,
            maximum_step: None,
            record_plan: false,
            follow_plan: None,
        }
    }
}

/// Start of an integration.
#[derive(Clone, Debug)]
pub struct Start {
    pub time: f64,
    /// Length n.
    pub y: Vec<f64>,
    /// Length n; consistent with `y`.
    pub y_prime: Vec<f64>,
    /// dy/dtheta at the start, n x p column-major; empty for a nominal run.
    pub sensitivity: Vec<f64>,
}

/// The solution at the requested times (N of them).
#[derive(Clone, Debug, Default)]
pub struct Solution {
    pub times: Vec<f64>,
    /// N x n, row per time.
    pub y: Vec<f64>,
    /// N blocks of n x p column-major; empty for a nominal run.
    pub sensitivity: Vec<f64>,
    pub work: Work,
    /// With [`Options::record_plan`].
    pub plan: Option<Plan>,
}

/// Counts of work.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Work {
    /// The method at the end of the run.
    pub method: &'static str,
    /// Why this method.
    pub reason: String,
    /// Times of events and the switching functions that caused them.
    pub events: Vec<(f64, usize)>,
    /// Changes of method: time and the method from there on.
    pub switches: Vec<(f64, &'static str)>,
    pub steps: usize,
    pub rejected_error: usize,
    pub rejected_newton: usize,
    pub residuals: usize,
    pub jacobians: usize,
    pub factorisations: usize,
    pub newton_iterations: usize,
    /// Steps whose size was limited by component i.
    pub limited_by: Vec<usize>,
    /// The same over time: counts per equal part of the run, empty for components that never limited a step.
    pub limited_when: Vec<Vec<u32>>,
    /// Start and end of the run.
    pub span: (f64, f64),
}

impl Work {
    /// Shortest time span that holds `share` of the steps limited by component `i`, to the resolution of the record;
    /// none where it limited no step.
    pub fn limited_span(&self, i: usize, share: f64) -> Option<(f64, f64)> {
        let counts = self.limited_when.get(i)?;
        let needed = (share * counts.iter().sum::<u32>() as f64).ceil().max(1.0) as u32;
        let shortest = (0..counts.len())
            .filter_map(|first| {
                let mut sum = 0;
                let last = counts[first..].iter().position(|count| {
                    sum += count;
                    sum >= needed
                })?;
                Some((last + 1, first))
            })
            .min()?;
        let part = (self.span.1 - self.span.0) / counts.len() as f64;
        let begin = self.span.0 + part * shortest.1 as f64;
        Some((begin, begin + part * shortest.0 as f64))
    }
}

/// Why an integration could not go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    pub time: f64,
    pub cause: FailureCause,
    /// The component to blame, where one can be named.
    pub component: Option<usize>,
    /// The equations (rows of F) that contradict or repeat each other, where the cause is such.
    pub equations: Vec<usize>,
    /// The last state reached, length n; empty where the integration could not begin.
    pub state: Vec<f64>,
    pub work: Box<Work>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureCause {
    /// The step shrank to rounding level.
    StepTooSmall,
    TooManySteps,
    /// The solution grew without bound or the model returned a non-finite number.
    NotFinite,
    SingularMatrix,
    InconsistentStart,
    /// Constraints repeat each other: the multipliers (forces) that go with them are not determined.
    RedundantConstraints,
    NoEquilibrium,
    /// The implicit equations of a step could not be solved however small the step.
    NoConvergence,
    /// Events follow each other without end.
    Chattering,
    /// Times not ascending or before the start, wrong lengths, tolerances or scales not positive, or an explicit method
    /// forced on a system without explicit rates, or a plan on one with switching functions.
    InvalidRequest,
}
