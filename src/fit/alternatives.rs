//! Other ways to the minimum, for comparison and for costs that Levenberg-Marquardt does not fit.

use super::chosen::Chosen;
use super::multi_start::latin_hypercube;
use super::problem::{Bounds, Control, LeastSquares, Progress};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Ways to search the minimum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Optimiser {
    #[default]
    LevenbergMarquardt,
    /// Sequential quadratic programming for bounds: BFGS steps of the free parameters, projected (Nocedal-Wright-2006).
    Sequential,
    /// Without derivatives: the simplex method (Nelder-Mead-1965).
    Simplex,
    /// Global and without derivatives: differential evolution (Storn-Price-1997).
    Evolution,
}

impl Optimiser {
    pub const ALL: [Optimiser; 4] = [Self::LevenbergMarquardt, Self::Sequential, Self::Simplex, Self::Evolution];

    pub fn name(self) -> &'static str {
        match self {
            Self::LevenbergMarquardt => "Levenberg-Marquardt",
            Self::Sequential => "sequential quadratic",
            Self::Simplex => "simplex (Nelder-Mead)",
            Self::Evolution => "differential evolution",
        }
    }
}

/// What a search found within its budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    pub theta: Vec<f64>,
    pub cost: f64,
    /// Improvements of the best cost over the work done until then: (evaluations, cost), both strictly monotonic. A
    /// gradient counts as many evaluations as it has columns.
    pub history: Vec<(usize, f64)>,
    /// Evaluations in all.
    pub work: usize,
    /// The search ended by itself, not by its budget.
    pub converged: bool,
    /// The observer wished its end.
    pub stopped: bool,
}

/// Relative change of the cost below which a search has converged.
const COST_TOLERANCE: f64 = 1e-9;
/// Size of steps, simplex or population relative to the bounds below which a search has converged.
const SIZE_TOLERANCE: f64 = 1e-6;

/// The cost over parameters scaled to the bounds, with a budget and the best so far.
pub(super) struct Counted<'a, P: ?Sized> {
    problem: &'a mut P,
    bounds: &'a Bounds,
    budget: usize,
    work: usize,
    best: (Vec<f64>, f64),
    history: Vec<(usize, f64)>,
    /// Told of every improvement.
    observer: &'a mut dyn FnMut(&Progress) -> Control,
    stopped: bool,
}

impl<'a, P: LeastSquares + ?Sized> Counted<'a, P> {
    fn exhausted(&self) -> bool {
        self.stopped || self.work >= self.budget
    }

    fn theta(&self, x: &[f64]) -> Vec<f64> {
        let inside = |j: usize| {
            (self.bounds.origin(j) + x[j] * self.bounds.scale(j)).clamp(self.bounds.lower[j], self.bounds.upper[j])
        };
        (0..x.len()).map(inside).collect()
    }

    fn scaled(&self, theta: &[f64]) -> Vec<f64> {
        (0..theta.len()).map(|j| (theta[j] - self.bounds.origin(j)) / self.bounds.scale(j)).collect()
    }

    /// Bounds of the scaled parameter.
    fn limits(&self, j: usize) -> (f64, f64) {
        let scaled = |bound: f64| (bound - self.bounds.origin(j)) / self.bounds.scale(j);
        (scaled(self.bounds.lower[j]), scaled(self.bounds.upper[j]))
    }

    fn note(&mut self, x: &[f64], cost: f64) {
        if cost < self.best.1 {
            self.best = (self.theta(x), cost);
            self.history.push((self.work, cost));
            let iteration = self.history.len();
            let progress = Progress { iteration, theta: &self.best.0, cost, evaluations: self.work };
            self.stopped |= (self.observer)(&progress) == Control::Stop;
        }
    }

    /// Infinite where the model cannot be evaluated.
    fn cost(&mut self, x: &[f64]) -> f64 {
        self.work += 1;
        let theta = self.theta(x);
        let cost = match self.problem.residual(&theta) {
            Ok(residual) => residual.iter().map(|value| value * value).sum::<f64>(),
            Err(_) => f64::INFINITY,
        };
        let cost = if cost.is_nan() { f64::INFINITY } else { cost };
        self.note(x, cost);
        cost
    }

    /// Cost and its gradient by the scaled parameters.
    fn slope(&mut self, x: &[f64]) -> Option<(f64, Vec<f64>)> {
        self.work += 1 + x.len();
        let theta = self.theta(x);
        let (residual, gradient) = self.problem.residual_and_gradient(&theta).ok()?;
        let rows = residual.len().max(1);
        let cost: f64 = residual.iter().map(|value| value * value).sum();
        let by = |(j, column): (usize, &[f64])| {
            2.0 * self.bounds.scale(j) * column.iter().zip(&residual).map(|(a, r)| a * r).sum::<f64>()
        };
        let slope: Vec<f64> = gradient.chunks_exact(rows).enumerate().map(by).collect();
        if !(cost.is_finite() && slope.iter().all(|value| value.is_finite())) {
            return None;
        }
        self.note(x, cost);
        Some((cost, slope))
    }

    fn finish(mut self, start: &[f64], converged: bool) -> Search {
        if self.best.0.is_empty() {
            self.best.0 = start.to_vec();
        }
        let converged = converged && !self.stopped;
        Search {
            theta: self.best.0,
            cost: self.best.1,
            history: self.history,
            work: self.work,
            converged,
            stopped: self.stopped,
        }
    }
}

/// Searches with one of the alternatives; `Optimiser::LevenbergMarquardt` is not among them and does nothing but
/// evaluate the start.
/// `budget`: evaluations.
pub fn search<P: LeastSquares + ?Sized>(
    optimiser: Optimiser,
    problem: &mut P,
    start: &[f64],
    bounds: &Bounds,
    budget: usize,
    seed: u64,
) -> Search {
    observed_search(Chosen { optimiser, budget, seed }, problem, start, bounds, &mut |_| Control::Continue)
}

/// As [`search`]; `observer` is told of every improvement and may end the search.
pub fn observed_search<P: LeastSquares + ?Sized>(
    Chosen { optimiser, budget, seed }: Chosen,
    problem: &mut P,
    start: &[f64],
    bounds: &Bounds,
    observer: &mut dyn FnMut(&Progress) -> Control,
) -> Search {
    let best = (Vec::new(), f64::INFINITY);
    let mut counted = Counted { problem, bounds, budget, work: 0, best, history: Vec::new(), observer, stopped: false };
    let x = counted.scaled(start);
    let converged = match optimiser {
        Optimiser::LevenbergMarquardt => {
            counted.cost(&x);
            true
        }
        Optimiser::Sequential => sequential(&mut counted, x),
        Optimiser::Simplex => simplex(&mut counted, &x),
        Optimiser::Evolution => evolution(&mut counted, &x, seed),
    };
    counted.finish(start, converged)
}

fn sequential<P: LeastSquares + ?Sized>(counted: &mut Counted<P>, mut x: Vec<f64>) -> bool {
    let count = x.len();
    let Some((mut cost, mut slope)) = counted.slope(&x) else { return false };
    let length = |vector: &[f64]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
    let first = 0.1 / length(&slope).max(f64::MIN_POSITIVE);
    let identity = |factor: f64| -> Vec<f64> {
        (0..count * count).map(|k| if k % count == k / count { factor } else { 0.0 }).collect()
    };
    let mut inverse = identity(first);
    let mut quiet = 0;
    while !counted.exhausted() {
        let free: Vec<bool> = (0..count)
            .map(|j| {
                let (low, high) = counted.limits(j);
                !(x[j] <= low && slope[j] > 0.0 || x[j] >= high && slope[j] < 0.0)
            })
            .collect();
        let mut direction: Vec<f64> = (0..count)
            .map(|i| {
                if free[i] {
                    -(0..count).filter(|&j| free[j]).map(|j| inverse[j * count + i] * slope[j]).sum::<f64>()
                } else {
                    0.0
                }
            })
            .collect();
        let mut descent: f64 = direction.iter().zip(&slope).map(|(d, g)| d * g).sum();
        if descent >= 0.0 {
            inverse = identity(first);
            direction = (0..count).map(|j| if free[j] { -first * slope[j] } else { 0.0 }).collect();
            descent = direction.iter().zip(&slope).map(|(d, g)| d * g).sum();
        }
        if length(&direction) < SIZE_TOLERANCE || descent == 0.0 {
            return true;
        }
        let Some((next, next_cost)) = line_search(counted, &x, &direction, cost, descent) else { return true };
        let Some((_, next_slope)) = counted.slope(&next) else { return false };
        let step: Vec<f64> = next.iter().zip(&x).map(|(a, b)| a - b).collect();
        let change: Vec<f64> = next_slope.iter().zip(&slope).map(|(a, b)| a - b).collect();
        update_inverse(&mut inverse, &step, &change);
        quiet = if cost - next_cost <= COST_TOLERANCE * cost { quiet + 1 } else { 0 };
        (x, cost, slope) = (next, next_cost, next_slope);
        if quiet >= 2 {
            return true;
        }
    }
    false
}

/// Backtracking along the projected path (Armijo's rule).
fn line_search<P: LeastSquares + ?Sized>(
    counted: &mut Counted<P>,
    x: &[f64],
    direction: &[f64],
    cost: f64,
    descent: f64,
) -> Option<(Vec<f64>, f64)> {
    let mut length = 1.0;
    for _ in 0..30 {
        let next: Vec<f64> = (0..x.len())
            .map(|j| {
                let (low, high) = counted.limits(j);
                (x[j] + length * direction[j]).clamp(low, high)
            })
            .collect();
        let found = counted.cost(&next);
        if found <= cost + 1e-4 * length * descent {
            return Some((next, found));
        }
        if counted.exhausted() {
            return None;
        }
        length *= if found.is_finite() { 0.4 } else { 0.2 };
    }
    None
}

/// BFGS update of the inverse Hessian; left out where the curvature is not positive.
fn update_inverse(inverse: &mut [f64], step: &[f64], change: &[f64]) {
    let count = step.len();
    let curvature: f64 = step.iter().zip(change).map(|(s, y)| s * y).sum();
    if curvature <= 1e-14 {
        return;
    }
    let image: Vec<f64> = (0..count).map(|i| (0..count).map(|j| inverse[j * count + i] * change[j]).sum()).collect();
    let weight = 1.0 + change.iter().zip(&image).map(|(y, h)| y * h).sum::<f64>() / curvature;
    for j in 0..count {
        for i in 0..count {
            inverse[j * count + i] +=
                (weight * step[i] * step[j] - image[i] * step[j] - step[i] * image[j]) / curvature;
        }
    }
}

fn simplex<P: LeastSquares + ?Sized>(counted: &mut Counted<P>, start: &[f64]) -> bool {
    const FIRST_SIZE: f64 = 0.1;
    let count = start.len();
    let clamped = |counted: &Counted<P>, point: Vec<f64>| -> Vec<f64> {
        point
            .into_iter()
            .enumerate()
            .map(|(j, value)| {
                let (low, high) = counted.limits(j);
                value.clamp(low, high)
            })
            .collect()
    };
    let mut corners: Vec<(Vec<f64>, f64)> = Vec::new();
    for corner in 0..=count {
        let mut point = start.to_vec();
        if let Some(j) = corner.checked_sub(1) {
            let (_, high) = counted.limits(j);
            point[j] += if point[j] + FIRST_SIZE <= high { FIRST_SIZE } else { -FIRST_SIZE };
        }
        let cost = counted.cost(&point);
        corners.push((point, cost));
    }
    // Coefficients that suit the dimension (Gao-Han-2012).
    let n = count.max(2) as f64;
    let (expansion, contraction, shrinkage) = (1.0 + 2.0 / n, 0.75 - 0.5 / n, 1.0 - 1.0 / n);
    while !counted.exhausted() {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (corners[0].1, corners[count].1);
        let apart = |corner: &(Vec<f64>, f64)| {
            corner.0.iter().zip(&corners[0].0).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let size = corners.iter().map(apart).fold(0.0, f64::max);
        if size < SIZE_TOLERANCE || (worst - best <= COST_TOLERANCE * best && size < 1e-3) {
            return true;
        }
        let centre: Vec<f64> =
            (0..count).map(|j| corners[..count].iter().map(|corner| corner.0[j]).sum::<f64>() / count as f64).collect();
        let along = |factor: f64| -> Vec<f64> {
            centre.iter().zip(&corners[count].0).map(|(c, w)| c + factor * (c - w)).collect()
        };
        let reflected = clamped(counted, along(1.0));
        let cost = counted.cost(&reflected);
        let second = corners[count - 1].1;
        if cost < best {
            let expanded = clamped(counted, along(expansion));
            let further = counted.cost(&expanded);
            corners[count] = if further < cost { (expanded, further) } else { (reflected, cost) };
        } else if cost < second {
            corners[count] = (reflected, cost);
        } else {
            let inner = clamped(counted, along(if cost < worst { contraction } else { -contraction }));
            let contracted = counted.cost(&inner);
            if contracted < cost.min(worst) {
                corners[count] = (inner, contracted);
            } else {
                let first = corners[0].0.clone();
                for corner in corners.iter_mut().skip(1) {
                    corner.0.iter_mut().zip(&first).for_each(|(value, b)| *value = b + shrinkage * (*value - b));
                    corner.1 = counted.cost(&corner.0);
                }
            }
        }
    }
    false
}

fn evolution<P: LeastSquares + ?Sized>(counted: &mut Counted<P>, start: &[f64], seed: u64) -> bool {
    const FACTOR: f64 = 0.7;
    const CROSSOVER: f64 = 0.9;
    let count = start.len();
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = move || (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let size = (6 * count).max(12);
    let place = |counted: &Counted<P>, point: &[f64]| -> Vec<f64> {
        (0..count)
            .map(|j| {
                let (low, high) = counted.limits(j);
                if low.is_finite() && high.is_finite() {
                    low + point[j] * (high - low)
                } else {
                    start[j] * (0.5 + point[j])
                }
            })
            .collect()
    };
    let mut population: Vec<(Vec<f64>, f64)> = Vec::new();
    let begin = counted.cost(start);
    population.push((start.to_vec(), begin));
    for point in latin_hypercube(size - 1, count, seed) {
        let placed = place(counted, &point);
        let cost = counted.cost(&placed);
        population.push((placed, cost));
    }
    while !counted.exhausted() {
        for target in 0..size {
            if counted.exhausted() {
                break;
            }
            let mut members: Vec<usize> = (0..size).filter(|member| *member != target).collect();
            let mut pick = || members.swap_remove((uniform() * members.len() as f64) as usize % members.len());
            let (a, b, c) = (pick(), pick(), pick());
            let forced = (uniform() * count as f64) as usize;
            let trial: Vec<f64> = (0..count)
                .map(|j| {
                    let (low, high) = counted.limits(j);
                    let own = population[target].0[j];
                    let mutant = population[a].0[j] + FACTOR * (population[b].0[j] - population[c].0[j]);
                    if j == forced || uniform() < CROSSOVER { mutant.clamp(low, high) } else { own }
                })
                .collect();
            let cost = counted.cost(&trial);
            if cost <= population[target].1 {
                population[target] = (trial, cost);
            }
        }
        let costs = || population.iter().map(|member| member.1);
        let (low, high) = (costs().fold(f64::INFINITY, f64::min), costs().fold(0.0, f64::max));
        if high - low <= COST_TOLERANCE * low {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::EvaluationFailure;

    /// Rosenbrock's valley; beyond 1.5 the model breaks down.
    struct Valley;

    impl LeastSquares for Valley {
        fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
            if theta[0] > 1.5 {
                return Err(EvaluationFailure { explanation: "broke down".to_owned() });
            }
            Ok(vec![10.0 * (theta[1] - theta[0] * theta[0]), 1.0 - theta[0]])
        }

        fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
            Ok((self.residual(theta)?, vec![-20.0 * theta[0], -1.0, 10.0, 0.0]))
        }
    }

    #[test]
    fn every_alternative_finds_the_minimum_beside_failing_evaluations() {
        let bounds = Bounds::new(vec![-3.0; 2], vec![3.0; 2]);
        for optimiser in [Optimiser::Sequential, Optimiser::Simplex, Optimiser::Evolution] {
            let found = search(optimiser, &mut Valley, &[-1.2, 1.0], &bounds, 20_000, 1);
            assert!(
                (found.theta[0] - 1.0).abs() < 1e-3 && (found.theta[1] - 1.0).abs() < 2e-3,
                "{optimiser:?} {found:?}"
            );
            assert!(found.history.windows(2).all(|pair| pair[0].0 <= pair[1].0 && pair[0].1 >= pair[1].1));
        }
    }

    /// The minimum lies on a bound.
    #[test]
    fn bounds_hold() {
        let bounds = Bounds::new(vec![-3.0; 2], vec![0.5, 3.0]);
        for optimiser in [Optimiser::Sequential, Optimiser::Simplex, Optimiser::Evolution] {
            let found = search(optimiser, &mut Valley, &[-1.2, 1.0], &bounds, 20_000, 1);
            assert!((found.cost - 0.25).abs() < 1e-3 && found.theta[0] <= 0.5, "{optimiser:?} {found:?}");
        }
    }

    #[test]
    fn a_budget_is_kept() {
        let bounds = Bounds::new(vec![-3.0; 2], vec![3.0; 2]);
        for optimiser in [Optimiser::Sequential, Optimiser::Simplex, Optimiser::Evolution] {
            let found = search(optimiser, &mut Valley, &[-1.2, 1.0], &bounds, 40, 1);
            assert!(!found.converged && found.history.iter().all(|(work, _)| *work <= 45), "{optimiser:?} {found:?}");
        }
    }
}
