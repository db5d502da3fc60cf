//! Multiple shooting (method 3.5; Bock-1983): stretches with start states of their own, which the fit joins.
//!
//! A free simulation over a whole record forgets its start (self-excited, chaotic) or swings out of step (weakly
//! damped), and its cost has minima everywhere. Stretches start near the measured states; the conditions that join them
//! are rows whose weight grows until no gap is left. From there the output error of the free simulation goes on.

use super::filter::courses;
use super::kalman::pass;
use super::process::first_levels;
use crate::fit::{Bounds, Control, Estimate, EvaluationFailure, LeastSquares, Options, Progress, levenberg_marquardt};
use crate::identify::Problem;
use crate::simulation::{Compiled, Record, State, Stretches};
use rayon::prelude::*;

/// Weights of the gaps (relative to a stretch's residual) grow by this factor per round.
const GROWTH: f64 = 10.0;
const ROUNDS: usize = 6;
/// Gaps below this share of a state's course are closed.
const CLOSED: f64 = 1e-5;
/// Iterations per round: nodes and parameters have to follow the growing weights, not to converge in between.
const ITERATIONS: usize = 40;

/// Where the stretches have been joined.
pub struct Joined {
    pub theta: Vec<f64>,
    /// Largest gap that is left, relative to the state's course.
    pub gap: f64,
    pub simulations: usize,
    pub failures: usize,
}

/// Parameters (and states between stretches) by multiple shooting with `stretches` stretches per record; weights and
/// filters as of
/// `problem`. `refine` turns the parameters' part of an observer's view away.
///
/// # Errors
/// A model that cannot be simulated at the start even in stretches, in words.
pub fn shooting(
    problem: &Problem,
    bounds: &Bounds,
    start: &[f64],
    stretches: usize,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Result<Joined, String> {
    let compiled = problem.compiled;
    let records: Vec<&Record> = problem.records.clone();
    let courses = measured_courses(compiled, &records, start)?;
    let noise = first_levels(compiled, &records, &courses.iter().map(|course| 10.0 * course).collect::<Vec<_>>());
    let mut layout = Vec::new();
    let mut variables: Vec<f64> = start.to_vec();
    for record in &records {
        let samples = record.sample_count();
        let count = stretches.clamp(1, (samples / 4).max(1));
        let nodes: Vec<usize> = (1..count).map(|k| k * samples / count).collect();
        let estimates = pass(compiled, record, start, &noise)?.estimates;
        for &node in &nodes {
            variables.extend(estimates[node].iter().zip(&courses).map(|(value, course)| value / course));
        }
        layout.push(nodes);
    }
    let mut shots = Shots { problem: problem.clone(), layout, courses, weight: 0.0, count: start.len() };
    (shots.problem.simulations, shots.problem.failures) = (0, 0);
    let rows = shots.problem.residual_count() as f64;
    shots.weight = (rows / shots.layout.iter().map(|nodes| nodes.len() + 1).sum::<usize>() as f64).sqrt();
    let extra = variables.len() - start.len();
    let unbounded =
        |bound: &[f64], value: f64| bound.iter().copied().chain(std::iter::repeat_n(value, extra)).collect();
    let all = Bounds::new(unbounded(&bounds.lower, f64::NEG_INFINITY), unbounded(&bounds.upper, f64::INFINITY));
    let options = Options { maximum_iterations: ITERATIONS, cost_tolerance: 1e-6, ..Options::default() };
    let mut gap = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut stopped = false;
        let mut shown = |progress: &Progress| {
            let control = observer(&Progress { theta: &progress.theta[..start.len()], ..*progress });
            stopped |= control == Control::Stop;
            control
        };
        let estimate = levenberg_marquardt(&mut shots, &variables, &all, &options, &mut shown)
            .map_err(|error| error.to_string())?;
        variables.clone_from(&estimate.theta);
        gap = shots.largest_gap(&estimate);
        if stopped || gap < CLOSED {
            break;
        }
        shots.weight *= GROWTH;
    }
    Ok(Joined {
        theta: variables[..start.len()].to_vec(),
        gap,
        simulations: shots.problem.simulations,
        failures: shots.problem.failures,
    })
}

/// Typical course of every state: of a free simulation where it succeeds, of the filter's estimates where those are
/// larger.
fn measured_courses(compiled: &Compiled, records: &[&Record], theta: &[f64]) -> Result<Vec<f64>, String> {
    let typical: Vec<f64> = compiled.model.variables().iter().map(|variable| variable.scale).collect();
    let free = courses(compiled, records, theta).unwrap_or_else(|_| typical.clone());
    let first: Vec<f64> = free.iter().zip(&typical).map(|(a, b)| if *a > 0.0 { *a } else { *b }).collect();
    let noise = first_levels(compiled, records, &first.iter().map(|course| 10.0 * course).collect::<Vec<_>>());
    let mut largest = vec![0.0_f64; first.len()];
    for record in records {
        let estimates = pass(compiled, record, theta, &noise)?.estimates;
        for estimate in &estimates {
            let moved = estimate.iter().zip(&estimates[0]).map(|(a, b)| (a - b).abs());
            largest.iter_mut().zip(moved).for_each(|(course, value)| *course = course.max(value));
        }
    }
    Ok(largest.iter().zip(&first).map(|(own, free)| if *own > 0.0 { *own } else { *free }).collect())
}

/// Variables: parameters, then per record and node the state in units of its course.
struct Shots<'a> {
    problem: Problem<'a>,
    /// Per record, samples (compared ones) at which stretches begin, but for the first.
    layout: Vec<Vec<usize>>,
    courses: Vec<f64>,
    weight: f64,
    /// Parameters.
    count: usize,
}

/// One stretch of one record: channel values per compared sample, and the state at its end.
struct Shot {
    samples: std::ops::Range<usize>,
    /// Per sample and measure.
    values: Vec<Vec<f64>>,
    /// Per sample: measures x (p + n).
    slopes: Vec<Vec<f64>>,
    end: State,
    /// d(end)/d(first state).
    transition: Vec<f64>,
}

impl Shots<'_> {
    fn largest_gap(&self, estimate: &Estimate) -> f64 {
        let rows = self.problem.residual_count();
        estimate.residual[rows..].iter().map(|value| (value / self.weight).abs()).fold(0.0, f64::max)
    }

    /// First variable of a record's node.
    fn place(&self, record: usize, node: usize) -> usize {
        let before: usize = self.layout[..record].iter().map(Vec::len).sum();
        self.count + (before + node) * self.courses.len()
    }

    fn shots(&mut self, variables: &[f64], derivatives: bool) -> Result<Vec<Vec<Shot>>, EvaluationFailure> {
        self.problem.simulations += self.problem.records.len();
        let jobs: Vec<(usize, usize)> =
            self.layout.iter().enumerate().flat_map(|(r, nodes)| (0..=nodes.len()).map(move |k| (r, k))).collect();
        let this: &Self = self;
        let outcomes: Vec<Result<Shot, String>> =
            jobs.par_iter().map(|&(r, k)| this.shot(variables, r, k, derivatives)).collect();
        let mut found: Vec<Vec<Shot>> = self.layout.iter().map(|_| Vec::new()).collect();
        for ((r, _), outcome) in jobs.into_iter().zip(outcomes) {
            match outcome {
                Ok(shot) => found[r].push(shot),
                Err(explanation) => {
                    self.problem.failures += 1;
                    return Err(EvaluationFailure { explanation });
                }
            }
        }
        Ok(found)
    }

    fn shot(&self, variables: &[f64], r: usize, k: usize, derivatives: bool) -> Result<Shot, String> {
        let (record, nodes) = (self.problem.records[r], &self.layout[r]);
        let (p, n, m) = (self.count, self.courses.len(), record.measures.len());
        let mut stretches = Stretches::new(self.problem.compiled, record, &variables[..p]);
        let last = nodes.get(k).copied().unwrap_or(record.sample_count() - 1);
        let (first, state, from) = match k.checked_sub(1) {
            None => (0, stretches.start()?, 0),
            Some(node) => {
                let place = self.place(r, node);
                let y = (0..n).map(|i| variables[place + i] * self.courses[i]).collect();
                (nodes[node], State { y, sensitivity: vec![0.0; n * p] }, record.first + nodes[node])
            }
        };
        let identity: Vec<f64> = (0..n * n).map(|at| if at % (n + 1) == 0 { 1.0 } else { 0.0 }).collect();
        let to = record.first + last;
        let stretch = if to > from { stretches.advance(&state, from, to, derivatives)? } else { Default::default() };
        let mut states = vec![state];
        let mut transitions = vec![identity];
        states.extend(stretch.states);
        transitions.extend(stretch.transitions);
        let samples = first..if k < nodes.len() { last } else { last + 1 };
        let (mut values, mut slopes) = (Vec::new(), Vec::new());
        for sample in samples.clone() {
            let at = record.first + sample;
            let own = &states[at - from];
            let observation = stretches.observe(&own.y, at, derivatives);
            if derivatives {
                let mut block = observation.by_parameter.clone();
                let transition = &transitions[at - from];
                block.extend(vec![0.0; m * n]);
                for (column, target) in block.chunks_exact_mut(m).enumerate() {
                    let through = if column < p {
                        &own.sensitivity[column * n..(column + 1) * n]
                    } else {
                        &transition[(column - p) * n..(column - p + 1) * n]
                    };
                    for (i, value) in through.iter().enumerate() {
                        (0..m).for_each(|c| target[c] += observation.by_state[i * m + c] * value);
                    }
                }
                slopes.push(block);
            }
            values.push(observation.values);
        }
        let (end, transition) = (states.pop(), transitions.pop());
        Ok(Shot {
            samples,
            values,
            slopes,
            end: end.ok_or("a stretch without states")?,
            transition: transition.ok_or("a stretch without states")?,
        })
    }

    fn stacked(&self, variables: &[f64], shots: &[Vec<Shot>], derivatives: bool) -> (Vec<f64>, Vec<f64>) {
        let (p, n) = (self.count, self.courses.len());
        let gaps: usize = self.layout.iter().map(|nodes| nodes.len() * n).sum();
        let data = self.problem.residual_count();
        let rows = data + gaps;
        let mut residual = vec![0.0; rows];
        let mut gradient = vec![0.0; if derivatives { rows * variables.len() } else { 0 }];
        for block in self.problem.blocks() {
            let (record, weight) = (self.problem.records[block.record], self.problem.weights[block.measure]);
            let Some(c) = record.measures.iter().position(|&measure| measure == block.measure) else { continue };
            let filter = &self.problem.prefilters[block.record];
            let m = record.measures.len();
            let own = &mut residual[block.rows.clone()];
            for (k, shot) in shots[block.record].iter().enumerate() {
                for (sample, values) in shot.samples.clone().zip(&shot.values) {
                    own[sample] = weight * (record.measured[c][sample] - values[c]);
                }
                for (sample, slopes) in shot.samples.clone().zip(&shot.slopes) {
                    let row = block.rows.start + sample;
                    (0..p).for_each(|j| gradient[j * rows + row] = -weight * slopes[j * m + c]);
                    if let Some(node) = k.checked_sub(1) {
                        let place = self.place(block.record, node);
                        for i in 0..n {
                            gradient[(place + i) * rows + row] = -weight * slopes[(p + i) * m + c] * self.courses[i];
                        }
                    }
                }
            }
            filter.apply(own);
            for column in gradient.chunks_exact_mut(rows) {
                if column[block.rows.clone()].iter().any(|value| *value != 0.0) {
                    filter.apply(&mut column[block.rows.clone()]);
                }
            }
        }
        self.gap_rows(variables, shots, &mut residual, &mut gradient, data);
        (residual, gradient)
    }

    fn gap_rows(
        &self,
        variables: &[f64],
        shots: &[Vec<Shot>],
        residual: &mut [f64],
        gradient: &mut [f64],
        data: usize,
    ) {
        let (p, n, rows) = (self.count, self.courses.len(), residual.len());
        let mut row = data;
        for (r, nodes) in self.layout.iter().enumerate() {
            for (node, shot) in shots[r].iter().enumerate().take(nodes.len()) {
                let place = self.place(r, node);
                for i in 0..n {
                    let factor = self.weight / self.courses[i];
                    residual[row] = self.weight * variables[place + i] - factor * shot.end.y[i];
                    if !gradient.is_empty() {
                        gradient[(place + i) * rows + row] = self.weight;
                        (0..p).for_each(|j| gradient[j * rows + row] = -factor * shot.end.sensitivity[j * n + i]);
                        if let Some(before) = node.checked_sub(1) {
                            let from = self.place(r, before);
                            for j in 0..n {
                                let slope = shot.transition[j * n + i] * self.courses[j];
                                gradient[(from + j) * rows + row] = -factor * slope;
                            }
                        }
                    }
                    row += 1;
                }
            }
        }
    }
}

impl LeastSquares for Shots<'_> {
    fn residual(&mut self, variables: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let shots = self.shots(variables, false)?;
        Ok(self.stacked(variables, &shots, false).0)
    }

    fn residual_and_gradient(&mut self, variables: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        let shots = self.shots(variables, true)?;
        Ok(self.stacked(variables, &shots, true))
    }
}
