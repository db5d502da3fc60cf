//! Equation error: measured states put into the equations of motion, which are linear in many parameters.
//!
//! The equations are taken in their weak form: multiplied with smooth test functions of limited length and integrated
//! by parts, so that no rate has to be differentiated from samples (Shinbrot-1957). Noise in the states biases the
//! result; it is a start for the other definitions, or an answer where the measurements are very clean.

use super::super::fitting::{bounds, prior_rows};
use crate::diagnostics::{Code, Diagnostic};
use crate::fit::{Control, EvaluationFailure, LeastSquares, Options, WithPriors, levenberg_marquardt};
use crate::linear::least_squares;
use crate::mechanics::VariableKind;
use crate::signal::{Interpolant, effective_count};
use crate::simulation::{Compiled, Record, Stretches, stretches_refused};
use crate::study::Interpolation;

/// Test functions reach over at least so many samples to each side, and at most so many fit into a record.
const SHORTEST: usize = 12;
const WINDOWS: usize = 60;
/// Test function (1 - s^2)^q.
const EXPONENT: i32 = 7;
/// Slopes that differ by less than this share are equal.
const SAME: f64 = 1e-7;

/// What the equations of motion say about the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationFit {
    /// SI, all parameters; those that the equations of motion do not contain keep their start.
    pub theta: Vec<f64>,
    /// The equations are linear in the parameters: one step.
    pub linear: bool,
    pub steps: usize,
}

/// Parameters by equation error, from `start` where the equations are not linear in them. The study's priors count
/// beside the equations as further rows, which are then weighted by their own scatter about a first solution without
/// priors.
///
/// # Errors
/// Why the definition does not fit: states that are not measured, loops, records without a start.
pub fn equation_error(compiled: &Compiled, records: &[&Record], start: &[f64]) -> Result<EquationFit, Diagnostic> {
    let refuse = |why: String| {
        Diagnostic::error(Code::FIT_FAILED, format!("equation error does not fit this study: {why}"))
            .help("use the output error (`--error output`)")
    };
    if let Some(why) = stretches_refused(compiled) {
        return Err(refuse(why.to_owned()));
    }
    let courses: Result<Vec<_>, String> =
        records.iter().map(|record| measured_states(compiled, record, start)).collect();
    let courses = courses.map_err(refuse)?;
    let mut problem = Equations { compiled, records, courses: &courses, scales: Vec::new() };
    problem.scales = problem.scales(start);
    let bounds = bounds(&compiled.study);
    let start: Vec<f64> = (0..start.len()).map(|j| start[j].clamp(bounds.lower[j], bounds.upper[j])).collect();
    let linear = problem.is_linear(&start, &bounds.lower, &bounds.upper);
    let options = Options { initial_radius: 1e3, ..Options::default() };
    let search = |problem: &mut WithPriors<'_, &mut Equations>, start: &[f64]| {
        levenberg_marquardt(problem, start, &bounds, &options, &mut |_| Control::Continue)
            .map_err(|error| refuse(error.to_string()))
    };
    let mut estimate = search(&mut WithPriors { problem: &mut problem, rows: &[] }, &start)?;
    let priors = prior_rows(&compiled.study);
    if !priors.is_empty() {
        problem.weigh(&estimate.residual, estimate.theta.len());
        estimate = search(&mut WithPriors { problem: &mut problem, rows: &priors }, &estimate.theta)?;
    }
    Ok(EquationFit { theta: estimate.theta, linear, steps: if linear { 1 } else { estimate.iterations } })
}

/// Why not all states follow from the measurements; `None` where they do.
pub(super) fn unmeasured(compiled: &Compiled, records: &[&Record], theta: &[f64]) -> Option<String> {
    if let Some(why) = stretches_refused(compiled) {
        return Some(why.to_owned());
    }
    records.iter().find_map(|record| measured_states(compiled, record, theta).err())
}

/// Per state its course at the compared samples, from the channels that are linear in the states alone; velocities that
/// are not measured are the derivatives of their positions.
fn measured_states(compiled: &Compiled, record: &Record, theta: &[f64]) -> Result<Vec<Vec<f64>>, String> {
    let variables = compiled.model.variables();
    let (n, samples) = (variables.len(), record.sample_count());
    let mut stretches = Stretches::new(compiled, record, theta);
    let start = stretches.start()?;
    let m = record.measures.len();
    // Slopes at three states and instants: equal where the channel is linear.
    let scale: Vec<f64> = variables.iter().map(|variable| variable.scale).collect();
    let moved = |factor: f64| -> Vec<f64> {
        (0..n).map(|i| start.y[i] + factor * scale[i] * (1.0 + 0.37 * i as f64).sin()).collect()
    };
    let probes: Vec<_> = [0.0, 0.7, -1.3]
        .iter()
        .enumerate()
        .map(|(k, factor)| stretches.observe(&moved(*factor), record.first + k * (samples - 1) / 2, true))
        .collect();
    let close = |a: f64, b: f64, size: f64| (a - b).abs() <= SAME * size;
    let linear = |c: usize| {
        let row = |probe: usize, i: usize| probes[probe].by_state[i * m + c] * scale[i];
        let size = (0..n).map(|i| row(0, i).abs()).fold(0.0, f64::max);
        let constant = (0..n).all(|i| close(row(1, i), row(0, i), size) && close(row(2, i), row(0, i), size));
        let free = probes.iter().all(|probe| probe.by_parameter.chunks_exact(m).all(|column| column[c] == 0.0));
        // The value itself must not depend on time or inputs.
        let offset = |probe: usize| {
            let state = moved([0.0, 0.7, -1.3][probe]);
            probes[probe].values[c] - (0..n).map(|i| probes[0].by_state[i * m + c] * state[i]).sum::<f64>()
        };
        size > 0.0 && constant && free && close(offset(1), offset(0), size) && close(offset(2), offset(0), size)
    };
    let used: Vec<usize> = (0..m).filter(|&c| linear(c)).collect();
    let offset =
        |c: usize| probes[0].values[c] - (0..n).map(|i| probes[0].by_state[i * m + c] * moved(0.0)[i]).sum::<f64>();
    // Channels as further rows: derivatives of positions stand for velocities that no channel shows.
    let mut rows: Vec<(Vec<f64>, Vec<f64>)> = used
        .iter()
        .map(|&c| {
            let slopes = (0..n).map(|i| probes[0].by_state[i * m + c] * scale[i]).collect();
            (slopes, record.measured[c].iter().map(|value| value - offset(c)).collect())
        })
        .collect();
    for (i, variable) in variables.iter().enumerate().filter(|(_, v)| v.kind == VariableKind::Velocity) {
        let alone = |rows: &[(Vec<f64>, Vec<f64>)]| rows.iter().any(|(slopes, _)| slopes[i] != 0.0);
        let stem = variable.name.trim_end_matches("velocity");
        let position = variables.iter().position(|other| other.name == format!("{stem}position"));
        let course = position.and_then(|at| state_course(&rows, at, n, samples));
        if let (false, Some(course)) = (alone(&rows), course) {
            let at = position.unwrap_or(i);
            let times = record.compared_times();
            let spline = Interpolant::new(times[0], record.sample_step(), &course, Interpolation::Cubic);
            let mut slopes = vec![0.0; n];
            slopes[i] = scale[i];
            // The course is in units of its scale.
            rows.push((slopes, times.iter().map(|t| scale[at] * spline.evaluate(*t, 1)).collect()));
        }
    }
    let mut courses = Vec::new();
    let mut missing = Vec::new();
    for (i, variable) in variables.iter().enumerate() {
        match state_course(&rows, i, n, samples) {
            Some(course) => courses.push(course.iter().map(|value| value * scale[i]).collect()),
            None => missing.push(format!("`{}`", variable.name)),
        }
    }
    if missing.is_empty() { Ok(courses) } else { Err(format!("{} not measured", missing.join(", "))) }
}

/// Course of state `i` in units of its scale, where the rows determine it.
fn state_course(rows: &[(Vec<f64>, Vec<f64>)], i: usize, n: usize, samples: usize) -> Option<Vec<f64>> {
    // Weights w with sum_r w_r slopes_r = e_i.
    let columns: Vec<f64> = rows.iter().flat_map(|(slopes, _)| slopes.iter().copied()).collect();
    let mut target = vec![0.0; n];
    target[i] = 1.0;
    let weights = least_squares(&columns, n, &target)?;
    let reached = |j: usize| rows.iter().zip(&weights).map(|((slopes, _), w)| w * slopes[j]).sum::<f64>();
    let exact = (0..n).all(|j| (reached(j) - target[j]).abs() < SAME);
    exact.then(|| (0..samples).map(|k| rows.iter().zip(&weights).map(|((_, y), w)| w * y[k]).sum()).collect())
}

/// Weak equations of all states whose rates depend on parameters.
struct Equations<'a> {
    compiled: &'a Compiled,
    records: &'a [&'a Record],
    /// Per record and state.
    courses: &'a [Vec<Vec<f64>>],
    /// Per state, the size of its equation; 0 where it has no parameter.
    scales: Vec<f64>,
}

impl Equations<'_> {
    /// Rows: per record, state with a scale, window: `-int phi' x - int phi f`.
    fn evaluate(&self, theta: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (mut residual, mut gradient) = (Vec::new(), vec![Vec::new(); theta.len()]);
        for (record, courses) in self.records.iter().zip(self.courses) {
            let (n, samples) = (courses.len(), record.sample_count());
            let mut stretches = Stretches::new(self.compiled, record, theta);
            let along: Vec<(Vec<f64>, Vec<f64>)> = (0..samples)
                .map(|k| {
                    let y: Vec<f64> = courses.iter().map(|course| course[k]).collect();
                    stretches.rates(&y, record.first + k)
                })
                .collect();
            let (reach, step) = (reach(samples), record.sample_step());
            let test = TestFunction::new(reach, step);
            for i in (0..n).filter(|&i| self.scales[i] > 0.0) {
                for first in windows(samples) {
                    let window = first..first + 2 * reach + 1;
                    let weak = |value: &dyn Fn(usize) -> f64, weights: &[f64]| -> f64 {
                        window.clone().zip(weights).map(|(k, weight)| weight * value(k)).sum::<f64>() / self.scales[i]
                    };
                    residual.push(weak(&|k| -courses[i][k], &test.slopes) - weak(&|k| along[k].0[i], &test.values));
                    for (j, column) in gradient.iter_mut().enumerate() {
                        column.push(-weak(&|k| along[k].1[j * n + i], &test.values));
                    }
                }
            }
        }
        (residual, gradient)
    }

    /// Scales every state's equation to residuals of variance one, by `residual` at a solution with `fitted`
    /// parameters. Windows overlap: rows count as many as are independent.
    fn weigh(&mut self, residual: &[f64], fitted: usize) {
        let freedom = (residual.len() as f64 / (residual.len().saturating_sub(fitted)).max(1) as f64).sqrt();
        let used: Vec<usize> = (0..self.scales.len()).filter(|&i| self.scales[i] > 0.0).collect();
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); self.scales.len()];
        let mut rest = residual;
        for record in self.records {
            let count = windows(record.sample_count()).count();
            for &i in &used {
                let (own, further) = rest.split_at(count.min(rest.len()));
                rows[i].extend_from_slice(own);
                rest = further;
            }
        }
        for i in used {
            let squares: f64 = rows[i].iter().map(|value| value * value).sum();
            let deviation = (squares / effective_count(&rows[i]).max(1.0)).sqrt() * freedom;
            // Equations that hold exactly outweigh any prior.
            self.scales[i] *= deviation.max(f64::EPSILON);
        }
    }

    /// Root mean square of the parameters' part of every state's rate over the bounds.
    fn scales(&self, theta: &[f64]) -> Vec<f64> {
        let n = self.compiled.model.variables().len();
        let (mut squares, mut count) = (vec![0.0; n], 0.0);
        let widths: Vec<f64> = self.compiled.study.parameters.iter().map(crate::study::Parameter::scale).collect();
        for (record, courses) in self.records.iter().zip(self.courses) {
            let mut stretches = Stretches::new(self.compiled, record, theta);
            for k in 0..record.sample_count() {
                let y: Vec<f64> = courses.iter().map(|course| course[k]).collect();
                let (_, slopes) = stretches.rates(&y, record.first + k);
                for (j, width) in widths.iter().enumerate() {
                    (0..n).for_each(|i| squares[i] += (slopes[j * n + i] * width).powi(2));
                }
                count += 1.0;
            }
        }
        squares.into_iter().map(|square: f64| (square / f64::max(count, 1.0)).sqrt()).collect()
    }

    /// The gradient is the same at two other places of the bounds.
    fn is_linear(&self, theta: &[f64], lower: &[f64], upper: &[f64]) -> bool {
        let at = |share: f64| -> Vec<f64> {
            let inside =
                |j: usize| theta[j] + share * ((if share > 0.0 { upper[j] } else { lower[j] }) - theta[j]).abs();
            let finite = |j: usize| if inside(j).is_finite() { inside(j) } else { theta[j] * (1.0 + share) };
            (0..theta.len()).map(finite).collect()
        };
        let here = self.evaluate(theta).1;
        [0.31, -0.23].into_iter().all(|share| {
            let there = self.evaluate(&at(share)).1;
            here.iter().zip(&there).all(|(a, b)| {
                let size = a.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
                a.iter().zip(b).all(|(x, y)| (x - y).abs() <= SAME * size)
            })
        })
    }
}

impl LeastSquares for Equations<'_> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        Ok(self.evaluate(theta).0)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let (residual, gradient) = self.evaluate(theta);
        Ok((residual, gradient.into_iter().flatten().collect()))
    }
}

/// Samples of a test function to each side of its middle.
fn reach(samples: usize) -> usize {
    (samples / WINDOWS).max(SHORTEST).min(samples.saturating_sub(1) / 2)
}

/// First samples of the windows of a record.
fn windows(samples: usize) -> impl Iterator<Item = usize> {
    let reach = reach(samples);
    (0..samples.saturating_sub(2 * reach)).step_by((reach / 2).max(1))
}

/// (1 - s^2)^q and its derivative by time at the samples of a window, times the sampling step (trapezoidal rule).
struct TestFunction {
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl TestFunction {
    fn new(reach: usize, step: f64) -> Self {
        let places = (0..=2 * reach).map(|k| k as f64 / reach.max(1) as f64 - 1.0);
        let (values, slopes) = places
            .map(|s| {
                let base = 1.0 - s * s;
                let slope = -2.0 * f64::from(EXPONENT) * s * base.powi(EXPONENT - 1) / (reach.max(1) as f64 * step);
                (step * base.powi(EXPONENT), step * slope)
            })
            .unzip();
        Self { values, slopes }
    }
}
