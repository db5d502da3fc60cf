//! Levenberg-Marquardt with bounds, tolerant of rank deficiency and of failing evaluations.

use super::problem::{
    BoundState, Bounds, Control, Estimate, EvaluationFailure, FitError, LeastSquares, Options, Progress, StopReason,
};
use super::step::{LinearModel, norm};

/// Steps whose actual reduction is below this share of the predicted one are refused (More-1978).
const ACCEPTANCE_RATIO: f64 = 1e-4;
/// A failed simulation shortens the trust region by this factor of the step that failed.
const FAILURE_SHRINKAGE: f64 = 0.25;
/// Scaling of a bounded parameter is at least this share of the largest: a parameter without influence is not thrown
/// across its whole range.
const SCALE_FLOOR: f64 = 1e-3;

/// Minimises `|r(theta)|^2` over `bounds` from `start`.
///
/// Gauss-Newton model in a trust region scaled by the gradient's columns (Levenberg-1944, Marquardt-1963,
/// More-1978); parameters with two finite bounds are mapped to `[0,1]`, by their logarithm where both are positive.
/// Bounds hold exactly at every evaluation: the bounded model is minimised by an active set, parameters at a bound that
/// the cost pushes against are left out. Directions without influence are not followed. An evaluation that fails, or
/// gives a non-finite number, shortens the step. `observer` is called after every accepted step and may stop the
/// iteration.
///
/// # Errors
/// [`FitError`] when the start is outside its bounds or cannot be evaluated.
pub fn levenberg_marquardt<P: LeastSquares + ?Sized>(
    problem: &mut P,
    start: &[f64],
    bounds: &Bounds,
    options: &Options,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Estimate, FitError> {
    check_start(start, bounds)?;
    let mut iteration = Iteration::begin(problem, start, bounds, options)?;
    let stop_reason = loop {
        if let Some(reason) = iteration.advance(observer) {
            break reason;
        }
    };
    Ok(iteration.finish(stop_reason))
}

fn check_start(start: &[f64], bounds: &Bounds) -> Result<(), FitError> {
    if bounds.lower.len() != start.len() || bounds.upper.len() != start.len() {
        let explanation = format!("{} parameters, but {} bounds", start.len(), bounds.len());
        return Err(FitError::Shape { explanation });
    }
    for (index, &value) in start.iter().enumerate() {
        let (low, high) = (bounds.lower[index], bounds.upper[index]);
        if low.is_nan() || high.is_nan() || low > high {
            return Err(FitError::InvalidBounds { index });
        }
        if !(value.is_finite() && value >= low && value <= high) {
            return Err(FitError::StartOutsideBounds { index });
        }
    }
    Ok(())
}

struct Iteration<'a, P: ?Sized> {
    problem: &'a mut P,
    bounds: &'a Bounds,
    options: &'a Options,
    theta: Vec<f64>,
    residual: Vec<f64>,
    gradient: Vec<f64>,
    /// |residual|
    length: f64,
    /// Share of the cost by which a run with the gradient differed from one without, at the last step tried with both:
    /// steps that promise less cannot be judged.
    resolution: f64,
    /// D, per parameter mapped to `[0,1]`.
    scaling: Vec<f64>,
    radius: f64,
    cost_history: Vec<f64>,
    residual_evaluations: usize,
    gradient_evaluations: usize,
    failed_evaluations: usize,
    last_failure: Option<String>,
}

/// What became of one trial step.
enum Trial {
    /// With the reason to end, if that was the last step needed.
    Accepted(Option<StopReason>),
    Refused,
    Stop(StopReason),
}

impl<'a, P: LeastSquares + ?Sized> Iteration<'a, P> {
    fn begin(problem: &'a mut P, start: &[f64], bounds: &'a Bounds, options: &'a Options) -> Result<Self, FitError> {
        let (residual, gradient) = problem.residual_and_gradient(start).map_err(FitError::StartFails)?;
        if gradient.len() != residual.len() * start.len() {
            let explanation = format!(
                "a gradient of {} numbers for {} residuals and {} parameters",
                gradient.len(),
                residual.len(),
                start.len()
            );
            return Err(FitError::Shape { explanation });
        }
        if !all_finite(&residual) || !all_finite(&gradient) {
            return Err(FitError::StartFails(not_finite()));
        }
        let length = norm(&residual);
        let mut iteration = Self {
            problem,
            bounds,
            options,
            theta: start.to_vec(),
            residual,
            gradient,
            length,
            resolution: 0.0,
            scaling: vec![0.0; start.len()],
            radius: 0.0,
            cost_history: vec![length * length],
            residual_evaluations: 0,
            gradient_evaluations: 1,
            failed_evaluations: 0,
            last_failure: None,
        };
        iteration.update_scaling();
        iteration.radius = options.initial_radius * iteration.reference_length();
        if iteration.radius == 0.0 {
            iteration.radius = options.initial_radius;
        }
        Ok(iteration)
    }

    /// Linearise, step until one is accepted; the reason when the iteration is over.
    fn advance(&mut self, observer: &mut dyn FnMut(&Progress) -> Control) -> Option<StopReason> {
        if self.length == 0.0 {
            return Some(StopReason::PerfectFit);
        }
        if self.cost_history.len() > self.options.maximum_iterations {
            return Some(StopReason::IterationLimit);
        }
        let model = match self.linearise() {
            Ok(model) => model,
            Err(reason) => return Some(reason),
        };
        let pinned = self.pinned(&model.cost_gradient());
        if !self.theta.is_empty() && pinned.iter().all(|&is_pinned| is_pinned) {
            return Some(StopReason::AllAtBounds);
        }
        if self.stationarity(&model, &pinned) <= self.options.gradient_tolerance {
            return Some(StopReason::GradientConverged);
        }
        let verdict = loop {
            match self.attempt(&model, &pinned) {
                Trial::Stop(reason) => return Some(reason),
                Trial::Refused => continue,
                Trial::Accepted(verdict) => break verdict,
            }
        };
        let progress = Progress {
            iteration: self.cost_history.len() - 1,
            theta: &self.theta,
            cost: self.length * self.length,
            evaluations: self.evaluations(),
        };
        match observer(&progress) {
            Control::Stop => Some(StopReason::Interrupted),
            Control::Continue => verdict,
        }
    }

    fn linearise(&self) -> Result<LinearModel, StopReason> {
        let rows = self.residual.len();
        let mut scaled = self.gradient.clone();
        for (j, column) in scaled.chunks_exact_mut(rows.max(1)).enumerate() {
            let factor = self.bounds.slope(j, self.theta[j]) / self.scaling[j];
            column.iter_mut().for_each(|value| *value *= factor);
        }
        LinearModel::new(&self.residual, &scaled, self.theta.len(), self.options.rank_threshold)
            .map_err(|_| StopReason::EvaluationsFail)
    }

    /// One trial step from the current point.
    fn attempt(&mut self, model: &LinearModel, pinned: &[bool]) -> Trial {
        if self.evaluations() >= self.options.maximum_evaluations {
            return Trial::Stop(StopReason::EvaluationLimit);
        }
        let (lower, upper) = self.step_limits();
        let Ok(step) = model.step(self.radius, &lower, &upper, pinned) else {
            return Trial::Stop(StopReason::EvaluationsFail);
        };
        let step_length = norm(&step.z);
        let cost = self.length * self.length;
        // The whole Gauss-Newton step promises nothing: there is no need to try it.
        let promise = step.predicted_reduction / cost;
        if step.undamped && self.cost_history.len() > 1 && promise <= self.options.cost_tolerance {
            return Trial::Stop(StopReason::CostConverged);
        }
        if step_length == 0.0 || step.predicted_reduction <= 0.0 {
            return Trial::Stop(StopReason::GradientConverged);
        }
        let theta = self.moved(&step.z, &lower, &upper);
        if self.cost_history.len() == 1 {
            self.radius = self.radius.min(step_length);
        }
        self.residual_evaluations += 1;
        let residual = match self.problem.residual(&theta).and_then(finite_residual) {
            Ok(residual) => residual,
            Err(failure) => return self.shorten_after(failure, step_length),
        };
        let length = norm(&residual);
        let relative = length / self.length;
        let actual = if 0.1 * relative < 1.0 { 1.0 - relative * relative } else { -1.0 };
        let predicted = step.predicted_reduction / cost;
        let ratio = actual / predicted;
        self.update_radius(ratio, actual, step.slope / cost, relative, step_length, step.undamped);
        if ratio >= ACCEPTANCE_RATIO {
            return match self.accept(theta, length, predicted) {
                Ok(true) => Trial::Accepted(self.verdict(actual, predicted)),
                Ok(false) => {
                    self.radius = FAILURE_SHRINKAGE * step_length.min(self.radius);
                    self.refused(0.0, predicted)
                }
                Err(failure) => self.shorten_after(failure, step_length),
            };
        }
        self.refused(actual, predicted)
    }

    /// What follows from a refused step: the end, where the model promises less than the evaluations can tell.
    fn refused(&self, actual: f64, predicted: f64) -> Trial {
        let indiscernible = predicted <= self.resolution && actual.abs() <= self.resolution;
        let verdict = if indiscernible { Some(StopReason::CostConverged) } else { self.verdict(actual, predicted) };
        verdict.map_or(Trial::Refused, Trial::Stop)
    }

    /// The stopping tests of MINPACK's `lmder` after a trial step (More-1978).
    fn verdict(&self, actual: f64, predicted: f64) -> Option<StopReason> {
        let tolerance = self.options.cost_tolerance.max(f64::EPSILON);
        if actual.abs() <= tolerance && predicted <= tolerance && actual <= 2.0 * predicted {
            return Some(StopReason::CostConverged);
        }
        let smallest = self.options.step_tolerance.max(f64::EPSILON) * self.reference_length();
        (self.radius <= smallest).then_some(StopReason::StepConverged)
    }

    fn shorten_after(&mut self, failure: EvaluationFailure, step_length: f64) -> Trial {
        self.failed_evaluations += 1;
        self.last_failure = Some(failure.explanation);
        self.radius = FAILURE_SHRINKAGE * step_length.min(self.radius);
        if self.radius <= self.options.step_tolerance.max(f64::EPSILON) * self.reference_length() {
            return Trial::Stop(StopReason::EvaluationsFail);
        }
        Trial::Refused
    }

    /// Trust-region update of More-1978 (MINPACK `lmder`); `slope` is relative to the cost.
    fn update_radius(&mut self, ratio: f64, actual: f64, slope: f64, relative: f64, step_length: f64, undamped: bool) {
        if ratio <= 0.25 {
            let mut shrinkage = if actual >= 0.0 { 0.5 } else { 0.5 * slope / (slope + 0.5 * actual) };
            if 0.1 * relative >= 1.0 || shrinkage < 0.1 {
                shrinkage = 0.1;
            }
            self.radius = shrinkage * self.radius.min(10.0 * step_length);
        } else if undamped || ratio >= 0.75 {
            self.radius = 2.0 * step_length;
        }
    }

    /// Moves there with residual and gradient, unless the cost of that run, which alone compares with the cost so far,
    /// does not fall: simulations with gradient take other steps than those without. `length` is that of the residual
    /// evaluated alone.
    fn accept(&mut self, theta: Vec<f64>, length: f64, predicted: f64) -> Result<bool, EvaluationFailure> {
        self.gradient_evaluations += 1;
        let (residual, gradient) = self.problem.residual_and_gradient(&theta)?;
        if !all_finite(&residual) || !all_finite(&gradient) || gradient.len() != self.gradient.len() {
            return Err(not_finite());
        }
        let with_gradient = norm(&residual);
        self.resolution = ((with_gradient / self.length).powi(2) - (length / self.length).powi(2)).abs();
        if 1.0 - (with_gradient / self.length).powi(2) < ACCEPTANCE_RATIO * predicted {
            return Ok(false);
        }
        self.theta = theta;
        self.length = with_gradient;
        self.residual = residual;
        self.gradient = gradient;
        self.cost_history.push(self.length * self.length);
        self.update_scaling();
        Ok(true)
    }

    /// D grows with the columns' norms and never shrinks (More-1978).
    fn update_scaling(&mut self) {
        let rows = self.residual.len().max(1);
        let norms: Vec<f64> = self
            .gradient
            .chunks_exact(rows)
            .enumerate()
            .map(|(j, column)| norm(column) * self.bounds.slope(j, self.theta[j]))
            .collect();
        let largest = norms.iter().fold(0.0_f64, |a, &b| a.max(b));
        for j in 0..self.scaling.len() {
            let column = norms.get(j).copied().unwrap_or(0.0);
            let floored = if self.is_boxed(j) { column.max(SCALE_FLOOR * largest) } else { column };
            self.scaling[j] = self.scaling[j].max(floored);
            if self.scaling[j] == 0.0 {
                self.scaling[j] = 1.0;
            }
        }
    }

    fn is_boxed(&self, j: usize) -> bool {
        self.bounds.lower[j].is_finite() && self.bounds.upper[j].is_finite()
    }

    /// Scaled norm of the parameters; a boxed parameter counts with its whole range.
    fn reference_length(&self) -> f64 {
        let squared: f64 = (0..self.theta.len())
            .map(|j| {
                let magnitude = if self.is_boxed(j) { 1.0 } else { self.theta[j].abs() };
                (self.scaling[j] * magnitude).powi(2)
            })
            .sum();
        squared.sqrt()
    }

    /// Room to the bounds in units of D.
    fn step_limits(&self) -> (Vec<f64>, Vec<f64>) {
        let room = |bound: &[f64]| {
            (0..self.theta.len())
                .map(|j| self.bounds.distance(j, self.theta[j], bound[j]) * self.scaling[j])
                .collect::<Vec<f64>>()
        };
        (room(&self.bounds.lower), room(&self.bounds.upper))
    }

    fn moved(&self, z: &[f64], lower: &[f64], upper: &[f64]) -> Vec<f64> {
        (0..z.len())
            .map(|j| {
                if z[j] <= lower[j] {
                    self.bounds.lower[j]
                } else if z[j] >= upper[j] {
                    self.bounds.upper[j]
                } else {
                    self.bounds.moved(j, self.theta[j], z[j] / self.scaling[j])
                }
            })
            .collect()
    }

    /// Parameters at a bound that the cost pushes against.
    fn pinned(&self, cost_gradient: &[f64]) -> Vec<bool> {
        (0..self.theta.len())
            .map(|j| {
                let at_lower = self.theta[j] <= self.bounds.lower[j] && cost_gradient[j] >= 0.0;
                let at_upper = self.theta[j] >= self.bounds.upper[j] && cost_gradient[j] <= 0.0;
                at_lower || at_upper
            })
            .collect()
    }

    /// Largest cosine between the residual and a gradient column that may still be followed.
    fn stationarity(&self, model: &LinearModel, pinned: &[bool]) -> f64 {
        let rows = self.residual.len().max(1);
        let gradient = model.cost_gradient();
        let mut largest = 0.0_f64;
        for (j, column) in self.gradient.chunks_exact(rows).enumerate() {
            let column_norm = norm(column) * self.bounds.slope(j, self.theta[j]) / self.scaling[j];
            if !pinned[j] && column_norm > 0.0 {
                largest = largest.max((gradient[j] / (column_norm * self.length)).abs());
            }
        }
        largest
    }

    fn evaluations(&self) -> usize {
        self.residual_evaluations + self.gradient_evaluations
    }

    fn finish(self, stop_reason: StopReason) -> Estimate {
        let bound_states = (0..self.theta.len())
            .map(|j| {
                if self.theta[j] <= self.bounds.lower[j] {
                    BoundState::AtLower
                } else if self.theta[j] >= self.bounds.upper[j] {
                    BoundState::AtUpper
                } else {
                    BoundState::Interior
                }
            })
            .collect();
        Estimate {
            iterations: self.cost_history.len() - 1,
            cost: self.length * self.length,
            theta: self.theta,
            residual: self.residual,
            gradient: self.gradient,
            bound_states,
            cost_history: self.cost_history,
            stop_reason,
            residual_evaluations: self.residual_evaluations,
            gradient_evaluations: self.gradient_evaluations,
            failed_evaluations: self.failed_evaluations,
            last_failure: self.last_failure,
        }
    }
}

fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

fn not_finite() -> EvaluationFailure {
    EvaluationFailure { explanation: "the residual or its gradient is not a finite number".to_string() }
}

fn finite_residual(residual: Vec<f64>) -> Result<Vec<f64>, EvaluationFailure> {
    if all_finite(&residual) { Ok(residual) } else { Err(not_finite()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residual functions with forward differences of the given step as gradient.
    struct Formula<F> {
        function: F,
        evaluations: usize,
    }

    impl<F: Fn(&[f64]) -> Result<Vec<f64>, EvaluationFailure>> LeastSquares for Formula<F> {
        fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
            self.evaluations += 1;
            (self.function)(theta)
        }

        fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
            let residual = (self.function)(theta)?;
            let mut gradient = Vec::new();
            for j in 0..theta.len() {
                let increment = 1e-7 * theta[j].abs().max(1e-3);
                let mut moved = theta.to_vec();
                moved[j] += increment;
                let varied = (self.function)(&moved)?;
                gradient.extend(varied.iter().zip(&residual).map(|(a, b)| (a - b) / increment));
            }
            Ok((residual, gradient))
        }
    }

    fn fit<F: Fn(&[f64]) -> Result<Vec<f64>, EvaluationFailure>>(
        function: F,
        start: &[f64],
        bounds: &Bounds,
    ) -> Estimate {
        let mut problem = Formula { function, evaluations: 0 };
        let options = Options::default();
        levenberg_marquardt(&mut problem, start, bounds, &options, &mut |_| Control::Continue).unwrap()
    }

    fn rosenbrock(theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        Ok(vec![10.0 * (theta[1] - theta[0] * theta[0]), 1.0 - theta[0]])
    }

    #[test]
    fn rosenbrock_inside_its_bounds() {
        let bounds = Bounds::new(vec![-3.0, -3.0], vec![3.0, 3.0]);
        let estimate = fit(rosenbrock, &[-1.2, 1.0], &bounds);
        assert!((estimate.theta[0] - 1.0).abs() < 1e-6 && (estimate.theta[1] - 1.0).abs() < 1e-6);
        assert!(estimate.stop_reason.converged(), "{:?}", estimate.stop_reason);
        assert!(estimate.cost_history.windows(2).all(|pair| pair[1] <= pair[0]));
    }

    /// With theta_0 <= 0.5 the minimum lies on the bound: theta = (0.5, 0.25), V = 0.25.
    #[test]
    fn rosenbrock_with_its_minimum_outside() {
        let bounds = Bounds::new(vec![-3.0, -3.0], vec![0.5, 3.0]);
        let estimate = fit(rosenbrock, &[-1.2, 1.0], &bounds);
        assert_eq!(estimate.bound_states, [BoundState::AtUpper, BoundState::Interior]);
        assert_eq!(estimate.theta[0], 0.5);
        assert!((estimate.theta[1] - 0.25).abs() < 1e-6, "{:?}", estimate.theta);
        assert!((estimate.cost - 0.25).abs() < 1e-9);
    }

    /// A linear problem with correlated columns: the bounded minimum by enumeration of all faces of the box.
    #[test]
    fn bounded_linear_problems_reach_the_minimum_of_all_faces() {
        let rows = [[3.0, 1.0, 0.5], [1.0, 2.0, -1.0], [0.2, -1.5, 2.5], [1.0, 1.0, 1.0]];
        for target in [[4.0, -3.0, 5.0, 1.0], [-2.0, 6.0, 1.0, 0.0], [9.0, 9.0, -9.0, 2.0]] {
            let function = |theta: &[f64]| {
                Ok((0..4)
                    .map(|i| rows[i].iter().zip(theta).map(|(a, b)| a * b).sum::<f64>() - target[i])
                    .collect::<Vec<f64>>())
            };
            let bounds = Bounds::new(vec![-1.0; 3], vec![1.0; 3]);
            let estimate = fit(function, &[0.1, 0.2, 0.3], &bounds);
            let cost = |theta: &[f64]| function(theta).unwrap().iter().map(|r| r * r).sum::<f64>();
            let lattice = 80;
            let mut smallest = f64::INFINITY;
            for code in 0..(lattice + 1_usize).pow(3) {
                let point: Vec<f64> = (0..3_u32)
                    .map(|axis| (code / (lattice + 1).pow(axis) % (lattice + 1)) as f64 / lattice as f64 * 2.0 - 1.0)
                    .collect();
                smallest = smallest.min(cost(&point));
            }
            assert!(estimate.cost <= smallest + 1e-9, "{} against {smallest}", estimate.cost);
        }
    }

    /// Only the sum of two parameters matters: the fit is perfect and the difference stays where it was.
    #[test]
    fn rank_deficiency_leaves_the_undetermined_direction_alone() {
        let function = |theta: &[f64]| Ok((0..10).map(|i| (theta[0] + theta[1] - 3.0) * i as f64).collect());
        let estimate = fit(function, &[0.5, 1.5], &Bounds::new(vec![0.0; 2], vec![5.0; 2]));
        assert!((estimate.theta[0] + estimate.theta[1] - 3.0).abs() < 1e-6);
        assert!((estimate.theta[1] - estimate.theta[0] - 1.0).abs() < 1e-6, "{:?}", estimate.theta);
    }

    /// The search moves along one coordinate: distances undo moves, and slopes are the derivatives of moves.
    #[test]
    fn coordinates_of_the_search_agree_with_each_other() {
        let bounds = Bounds::new(vec![1e-3, -2.0, f64::NEG_INFINITY], vec![10.0, 4.0, f64::INFINITY]);
        for (index, value) in [(0, 0.02), (1, 0.5), (2, -7.0)] {
            let moved = bounds.moved(index, value, 0.125);
            assert!((bounds.distance(index, value, moved) - 0.125).abs() < 1e-12);
            let increment = 1e-6;
            let difference =
                (bounds.moved(index, value, increment) - bounds.moved(index, value, -increment)) / (2.0 * increment);
            assert!((difference / bounds.slope(index, value) - 1.0).abs() < 1e-8, "parameter {index}");
        }
        assert_eq!(bounds.moved(0, 0.02, 2.0), 10.0, "held by its bound");
        assert!((bounds.moved(0, 0.02, 0.25) / 0.02 - 10.0).abs() < 1e-12, "a quarter of four decades");
    }

    /// A rate that starts a thousand times too small, between bounds six decades apart, needs a few steps only.
    #[test]
    fn positive_parameters_are_searched_by_their_logarithm() {
        let (level, rate) = (3.0, 0.2);
        let function = |theta: &[f64]| {
            let course = |t: f64| (theta[0] / level).ln() - theta[1] * t + rate * t;
            Ok((0..20).map(|i| course(f64::from(i))).collect())
        };
        let bounds = Bounds::new(vec![1e-4, 1e-4], vec![100.0, 100.0]);
        let estimate = fit(function, &[0.003, 2e-4], &bounds);
        assert!((estimate.theta[0] / level - 1.0).abs() < 1e-6, "{:?}", estimate.theta);
        assert!((estimate.theta[1] / rate - 1.0).abs() < 1e-6, "{:?}", estimate.theta);
        assert!(estimate.cost_history.len() <= 20, "{} iterations", estimate.cost_history.len());
    }

    #[test]
    fn a_parameter_without_influence_stays() {
        let function =
            |theta: &[f64]| Ok((0..10).map(|i| (theta[0] - 2.0) * i as f64 + 0.1 * f64::from(i % 3)).collect());
        let estimate = fit(function, &[0.5, 0.7], &Bounds::new(vec![0.0; 2], vec![5.0; 2]));
        assert_eq!(estimate.theta[1], 0.7);
        assert!(estimate.stop_reason.converged());
    }

    /// The simulation breaks down just beyond the minimum and far away: the steps get shorter, the fit goes on.
    #[test]
    fn failing_evaluations_shorten_the_step() {
        let function = |theta: &[f64]| {
            if theta[0] > 1.05 {
                return Err(EvaluationFailure { explanation: format!("diverged at {}", theta[0]) });
            }
            rosenbrock(theta)
        };
        let estimate = fit(function, &[-1.2, 1.0], &Bounds::new(vec![-3.0, -3.0], vec![3.0, 3.0]));
        assert!((estimate.theta[0] - 1.0).abs() < 1e-6, "{:?} {:?}", estimate.theta, estimate.stop_reason);
        let steep = |theta: &[f64]| {
            if theta[0] > 2.0 {
                Err(EvaluationFailure { explanation: "diverged".into() })
            } else {
                Ok(vec![theta[0] - 4.0])
            }
        };
        let estimate = fit(steep, &[0.0], &Bounds::new(vec![-10.0], vec![10.0]));
        assert!(estimate.failed_evaluations > 0);
        assert_eq!(estimate.stop_reason, StopReason::EvaluationsFail);
        assert!(estimate.theta[0] > 1.99 && estimate.theta[0] <= 2.0, "{:?}", estimate.theta);
    }

    #[test]
    fn starts_that_make_no_sense_are_refused() {
        let mut problem = Formula { function: rosenbrock, evaluations: 0 };
        let bounds = Bounds::new(vec![0.0, 0.0], vec![1.0, 1.0]);
        let result =
            levenberg_marquardt(&mut problem, &[2.0, 0.0], &bounds, &Options::default(), &mut |_| Control::Continue);
        assert_eq!(result.err(), Some(FitError::StartOutsideBounds { index: 0 }));
    }

    /// Runs with gradient and runs without agree to a few digits only, as simulations with different steps do.
    struct TwoKinds;

    impl LeastSquares for TwoKinds {
        fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
            Ok(vec![theta[0] - 1.0, 0.98])
        }

        fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
            let ripple = 1e-3 * (1e6 * theta[0]).sin();
            Ok((vec![theta[0] - 1.0 + ripple, 1.0 + ripple], vec![1.0, 0.0]))
        }
    }

    #[test]
    fn what_the_evaluations_cannot_tell_ends_the_search() {
        let options = Options::default();
        let estimate =
            levenberg_marquardt(&mut TwoKinds, &[3.0], &Bounds::none(1), &options, &mut |_| Control::Continue).unwrap();
        assert!(estimate.stop_reason.converged(), "{:?}", estimate.stop_reason);
        assert!(estimate.iterations < 10 && (estimate.theta[0] - 1.0).abs() < 5e-3, "{estimate:?}");
        assert!(estimate.cost_history.windows(2).all(|pair| pair[1] < pair[0]), "{:?}", estimate.cost_history);
    }

    #[test]
    fn an_observer_ends_the_iteration_with_the_best_so_far() {
        let mut problem = Formula { function: rosenbrock, evaluations: 0 };
        let bounds = Bounds::none(2);
        let mut seen = 0;
        let estimate = levenberg_marquardt(&mut problem, &[-1.2, 1.0], &bounds, &Options::default(), &mut |progress| {
            seen = progress.iteration;
            if progress.iteration == 3 { Control::Stop } else { Control::Continue }
        })
        .unwrap();
        assert_eq!((seen, estimate.iterations, estimate.stop_reason), (3, 3, StopReason::Interrupted));
    }
}
