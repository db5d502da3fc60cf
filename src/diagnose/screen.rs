//! The screen: every candidate tried at finite strengths with the full nonlinear simulation, the fitted parameters
//! moving along to first order.
//!
//! For each grid point the residual is simulated and what the fitted parameters can absorb (the span of the base
//! gradient) is projected out; the candidate's rank is the concentrated deviance of what remains. Strengths come from
//! the score at zero strength (Breusch-Pagan-1980, Rao-1948) where it exists, else from a grid.

use super::candidates::{Candidate, Unknown, UnknownRole};
use super::periods::periods;
use super::round::Round;
use crate::fit::LeastSquares;
use crate::identify::Problem;
use crate::linear::least_squares;

/// Multiples of the strength estimated at zero that are tried.
const STRENGTH_FACTORS: [f64; 4] = [0.5, 1.0, 2.5, 8.0];

/// Shapes at which finite strengths are tried, those with the best score.
const SHAPES_TRIED: usize = 2;

/// Estimated strengths: (index of the unknown, difference from its neutral value).
type Strengths = Vec<(usize, f64)>;

/// What the screen found for one candidate.
#[derive(Clone, Debug)]
pub(super) struct Screened {
    /// Values of the candidate's unknowns at the best grid point (SI).
    pub values: Vec<f64>,
    /// Deviance after projection at the best grid point; infinite where nothing could be simulated.
    pub deviance: f64,
    /// Largest score statistic over the shapes, with its degrees of freedom.
    pub score: Option<(f64, usize)>,
    /// |s~|/|s| of the first strength, at the best-scoring shape.
    pub visibility: Option<f64>,
    /// Strength at which the score would just be significant, SI.
    pub smallest_detectable: Option<f64>,
    pub simulations: usize,
}

/// Screens one candidate. `None` where its variant cannot be built (e.g. the place does not admit it).
pub(super) fn screen(round: &Round, candidate: &Candidate) -> Option<Screened> {
    let compiled = round.compile(candidate, &candidate.neutral(), true)?;
    let mut trial = Trial { round, candidate, problem: round.problem(&compiled) };
    let mut best = Screened {
        values: candidate.neutral(),
        deviance: f64::INFINITY,
        score: None,
        visibility: None,
        smallest_detectable: None,
        simulations: 0,
    };
    for values in trial.points(&mut best) {
        if let Some(deviance) = trial.projected_deviance(&values)
            && deviance < best.deviance
        {
            best.deviance = deviance;
            best.values = values;
        }
    }
    best.simulations = trial.problem.simulations;
    Some(best)
}

/// Relative difference below which two screens saw the same force.
const EQUAL: f64 = 1e-6;
/// Chi-square statistic above which two causes that score alike do so not by both doing nothing.
const SHOWS: f64 = 1.0;

/// One effect at elements that move alike (between the same bodies, or along the axis of their joint) is the very same
/// force, and so are a constant load on a single slider and its tilted support: the first one stands for all, the
/// others become its aliases.
pub(super) fn merge_equal(candidates: &mut [Candidate], screened: &mut [Option<Screened>], current_deviance: f64) {
    for first in 0..candidates.len() {
        for other in first + 1..candidates.len() {
            let (Some(a), Some(b)) = (&screened[first], &screened[other]) else { continue };
            let are_effects = !candidates[first].change.is_empty() && !candidates[other].change.is_empty();
            let is_same = if candidates[first].effect == candidates[other].effect {
                a.equals(b, current_deviance)
            } else {
                a.changes_as(b)
            };
            if are_effects && is_same {
                let mut names = std::mem::take(&mut candidates[other].aliases);
                names.insert(0, candidates[other].name.clone());
                candidates[first].aliases.extend(names);
                screened[other] = None;
            }
        }
    }
}

impl Screened {
    /// At its shapes, but with strengths at their neutral values: where a refit can follow the score.
    pub(super) fn without_strength(&self, candidate: &Candidate) -> Self {
        let at = |(value, unknown): (&f64, &Unknown)| match unknown.role {
            UnknownRole::Amplitude => unknown.neutral,
            _ => *value,
        };
        Self { values: self.values.iter().zip(&candidate.unknowns).map(at).collect(), ..self.clone() }
    }

    /// Other strengths, but the very same change of all channels, and one that shows.
    fn changes_as(&self, other: &Self) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= EQUAL * a.abs().max(b.abs());
        let scores =
            matches!((self.score, other.score), (Some(a), Some(b)) if a.1 == b.1 && a.0 > SHOWS && close(a.0, b.0));
        scores && close(self.deviance, other.deviance)
    }

    /// The same strengths have the same effect. What changes nothing tells nothing about that.
    fn equals(&self, other: &Self, current_deviance: f64) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= EQUAL * a.abs().max(b.abs());
        let visible = !close(self.deviance, current_deviance);
        let strengths = match (self.smallest_detectable, other.smallest_detectable) {
            (Some(a), Some(b)) => close(a, b),
            (None, None) => visible,
            _ => false,
        };
        let scores = match (self.score, other.score) {
            (Some(a), Some(b)) => a.1 == b.1 && close(a.0, b.0),
            (None, None) => visible,
            _ => false,
        };
        strengths && scores && close(self.deviance, other.deviance)
    }
}

/// All combinations of shape values, as full vectors of unknowns with strengths at neutral, and the simulations spent
/// on finding them.
fn shape_grid(round: &Round, candidate: &Candidate) -> (Vec<Vec<f64>>, usize) {
    let mut simulations = 0;
    let mut grid = vec![candidate.neutral()];
    for (position, unknown) in candidate.unknowns.iter().enumerate() {
        let values: Vec<f64> = match &unknown.role {
            UnknownRole::Shape(values) => values.clone(),
            UnknownRole::Frequency => round.peak_frequencies(unknown.lower, unknown.upper),
            UnknownRole::Period { magnitude } => {
                let (found, work) = periods(round, candidate, position, *magnitude);
                simulations += work;
                found
            }
            _ => continue,
        };
        grid = grid
            .into_iter()
            .flat_map(|point| {
                values.iter().map(move |&value| {
                    let mut next = point.clone();
                    next[position] = value;
                    next
                })
            })
            .collect();
    }
    (grid, simulations)
}

struct Trial<'a> {
    round: &'a Round<'a>,
    candidate: &'a Candidate,
    problem: Problem<'a>,
}

impl Trial<'_> {
    /// Deviance of the projected residual at `values`; `None` where the simulation fails.
    fn projected_deviance(&mut self, values: &[f64]) -> Option<f64> {
        let mut residual = self.problem.residual(values).ok()?;
        self.round.basis.project_out(&mut residual);
        Some(self.round.deviance(&residual))
    }

    /// Points to try: all finite strengths at all shapes, or multiples of the strength estimated at zero at the shapes
    /// whose score is best. Notes the score on the way.
    fn points(&mut self, best: &mut Screened) -> Vec<Vec<f64>> {
        let (grid, simulations) = shape_grid(self.round, self.candidate);
        self.problem.simulations += simulations;
        let finite = self.candidate.unknowns.iter().position(|u| matches!(u.role, UnknownRole::FiniteAmplitude(_)));
        if let Some(position) = finite {
            let UnknownRole::FiniteAmplitude(values) = &self.candidate.unknowns[position].role else {
                return Vec::new();
            };
            return grid
                .iter()
                .flat_map(|shapes| values.iter().map(move |&value| with(shapes, position, value)))
                .collect();
        }
        let mut scores: Vec<(f64, Vec<f64>, Strengths)> = grid
            .into_iter()
            .filter_map(|shapes| {
                let (statistic, estimate) = self.score(&shapes, best)?;
                Some((statistic, shapes, estimate))
            })
            .collect();
        scores.sort_by(|a, b| b.0.total_cmp(&a.0));
        scores.truncate(SHAPES_TRIED);
        scores
            .iter()
            .flat_map(|(_, shapes, estimate)| {
                STRENGTH_FACTORS.iter().map(|factor| self.scaled(shapes, estimate, *factor)).collect::<Vec<_>>()
            })
            .collect()
    }

    /// Score statistic and linear estimate of the strengths at their neutral values; `None` where all have the wrong
    /// sign or no influence.
    fn score(&mut self, shapes: &[f64], best: &mut Screened) -> Option<(f64, Strengths)> {
        let amplitudes: Vec<usize> = (0..self.candidate.unknowns.len())
            .filter(|&i| self.candidate.unknowns[i].role == UnknownRole::Amplitude)
            .collect();
        let (residual, gradient) = self.problem.residual_and_gradient(shapes).ok()?;
        let rows = residual.len();
        let mut projected = Vec::with_capacity(rows * amplitudes.len());
        let mut shares = Vec::new();
        for &i in &amplitudes {
            // The gradient of the residual is minus that of the model; a strength explains what reduces the residual.
            let mut column: Vec<f64> = gradient[i * rows..(i + 1) * rows].iter().map(|g| -g).collect();
            let before = norm(&column);
            self.round.basis.project_out(&mut column);
            shares.push(if before > 0.0 { norm(&column) / before } else { 0.0 });
            projected.extend(column);
        }
        let remaining = &self.round.projected_residual;
        let mut estimate = least_squares(&projected, rows, remaining)?;
        for (value, &i) in estimate.iter_mut().zip(&amplitudes) {
            let unknown = &self.candidate.unknowns[i];
            if unknown.neutral + *value < unknown.lower && unknown.lower == unknown.neutral {
                *value = 0.0;
            }
        }
        let explained = explained_by(&projected, rows, &estimate, remaining);
        let statistic = self.round.score_scale() * explained / self.round.projected_mean_square();
        if best.score.is_none_or(|(previous, _)| statistic > previous) {
            best.score = Some((statistic, amplitudes.len()));
            best.visibility = shares.first().copied();
            let column_norm = norm(&projected[..rows]);
            best.smallest_detectable = self.round.detectable_strength(column_norm);
        }
        if estimate.iter().all(|value| *value == 0.0) {
            return None;
        }
        Some((statistic, amplitudes.into_iter().zip(estimate).collect()))
    }

    fn scaled(&self, shapes: &[f64], estimate: &[(usize, f64)], factor: f64) -> Vec<f64> {
        let mut values = shapes.to_vec();
        for &(i, amplitude) in estimate {
            let unknown: &Unknown = &self.candidate.unknowns[i];
            values[i] = (unknown.neutral + factor * amplitude).clamp(unknown.lower, unknown.upper);
        }
        values
    }
}

/// Decrease of the sum of squares of `target` when `columns * estimate` is taken away.
pub(super) fn explained_by(columns: &[f64], rows: usize, estimate: &[f64], target: &[f64]) -> f64 {
    let mut rest = target.to_vec();
    for (column, value) in columns.chunks_exact(rows).zip(estimate) {
        rest.iter_mut().zip(column).for_each(|(r, c)| *r -= value * c);
    }
    let square = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
    (square(target) - square(&rest)).max(0.0)
}

fn with(values: &[f64], position: usize, value: f64) -> Vec<f64> {
    let mut changed = values.to_vec();
    changed[position] = value;
    changed
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}
