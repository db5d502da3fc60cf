//! The cost over the work of several optimisers (the document's Figs. 3.4 and 3.5).

use crate::diagnostics::Diagnostic;
use crate::fit::{Bounds, Control, LeastSquares, Optimiser, Options, Search, levenberg_marquardt, search};
use crate::identify::{Fitted, Problem, Settings, Weighting, fit, prefilters};
use crate::simulation::{Compiled, Record};
use schemars::JsonSchema;
use serde::Serialize;

/// Courses of all optimisers on one study.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Courses {
    pub study: String,
    pub variant: String,
    pub parameters: Vec<String>,
    /// Parameters held at their estimates.
    pub held: Vec<String>,
    /// Allowed work in simulations of all records; a gradient by internal differentiation counts as one per parameter
    /// more.
    pub budget: usize,
    pub courses: Vec<Course>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Course {
    pub optimiser: String,
    /// Improvements of the best cost: [simulations until then, cost], both strictly monotonic.
    pub history: Vec<(usize, f64)>,
    /// Simulations in all.
    pub work: usize,
    pub cost: f64,
    /// The search ended by itself.
    pub converged: bool,
    /// Work until the cost was within 1 % of the best of all; absent where it never was.
    pub work_to_best: Option<usize>,
}

/// A cost within this share of the best counts as reached.
const REACHED: f64 = 0.01;

/// Runs every optimiser from the study's start, with the weights of a first fit's end so that all minimise the same
/// cost.
/// `chosen`: names of the parameters to search (empty: all); the others keep the values of that fit.
///
/// # Errors
/// The study cannot be fitted at all.
pub fn courses(
    compiled: &Compiled,
    records: &[&Record],
    chosen: &[String],
    budget: usize,
    seed: u64,
) -> Result<Courses, Vec<Diagnostic>> {
    let fitted = fit(compiled, records, &Settings::default(), &mut |_| Control::Continue).map_err(|one| vec![one])?;
    let parameters = &compiled.study.parameters;
    let held: Vec<(String, f64)> = parameters
        .iter()
        .zip(&fitted.theta)
        .filter(|(parameter, _)| !chosen.is_empty() && !chosen.contains(&parameter.name))
        .map(|(parameter, value)| (parameter.name.clone(), *value))
        .collect();
    let reduced = if held.is_empty() { compiled.clone() } else { Compiled::frozen(compiled.study.clone(), &held)? };
    let held = held.into_iter().map(|(name, _)| name).collect();
    side_by_side(&reduced, records, &fitted, held, (budget, seed)).map_err(|one| vec![one])
}

fn side_by_side(
    compiled: &Compiled,
    records: &[&Record],
    fitted: &Fitted,
    held: Vec<String>,
    (budget, seed): (usize, u64),
) -> Result<Courses, Diagnostic> {
    let study = &compiled.study;
    let start: Vec<f64> = study.parameters.iter().map(|parameter| parameter.start).collect();
    let bounds = Bounds::new(
        study.parameters.iter().map(|parameter| parameter.lower).collect(),
        study.parameters.iter().map(|parameter| parameter.upper).collect(),
    );
    let mut found = Vec::new();
    for optimiser in Optimiser::ALL {
        let mut problem = problem(compiled, records, &fitted.weighting)?;
        let course = match optimiser {
            Optimiser::LevenbergMarquardt => gauss_newton(&mut problem, &start, &bounds, budget),
            other => search(other, &mut problem, &start, &bounds, budget, seed),
        };
        found.push((optimiser, course));
    }
    let best = found.iter().map(|(_, course)| course.cost).fold(f64::INFINITY, f64::min);
    Ok(Courses {
        study: study.name.clone(),
        variant: study.variant.clone(),
        parameters: study.parameters.iter().map(|parameter| parameter.name.clone()).collect(),
        held,
        budget,
        courses: found.into_iter().map(|(optimiser, course)| finished(optimiser, course, best)).collect(),
    })
}

fn finished(optimiser: Optimiser, course: Search, best: f64) -> Course {
    let reached = course.history.iter().find(|(_, cost)| *cost <= (1.0 + REACHED) * best);
    Course {
        optimiser: optimiser.name().to_owned(),
        cost: course.cost,
        converged: course.converged,
        work_to_best: reached.map(|(work, _)| *work),
        history: course.history,
        work: course.work,
    }
}

fn problem<'a>(
    compiled: &'a Compiled,
    records: &[&'a Record],
    weighting: &Weighting,
) -> Result<Problem<'a>, Diagnostic> {
    let filters = prefilters(compiled, records)?;
    Ok(Problem::new(compiled, records.to_vec(), filters, weighting.weights.clone()))
}

/// Levenberg-Marquardt with its work counted like that of the others.
fn gauss_newton<P: LeastSquares>(problem: &mut P, start: &[f64], bounds: &Bounds, budget: usize) -> Search {
    let columns = start.len();
    let work = |evaluations: usize, iterations: usize| evaluations + columns * (iterations + 1);
    let mut found = Improvements::default();
    let outcome = levenberg_marquardt(problem, start, bounds, &Options::default(), &mut |progress| {
        let done = work(progress.evaluations, progress.iteration);
        found.note(done, progress.cost);
        if done >= budget { Control::Stop } else { Control::Continue }
    });
    match outcome {
        Ok(estimate) => {
            let done = work(estimate.residual_evaluations + estimate.gradient_evaluations, estimate.iterations);
            let mut all = Improvements::default();
            all.note(work(1, 0), estimate.cost_history[0]);
            found.history.into_iter().for_each(|(work, cost)| all.note(work, cost));
            all.note(done, estimate.cost);
            Search {
                converged: estimate.stop_reason.converged(),
                theta: estimate.theta,
                // Costs of runs with and without gradient agree to the integration's accuracy: the best that was seen.
                cost: all.history.last().map_or(estimate.cost, |(_, cost)| *cost),
                history: all.history,
                work: done,
                stopped: false,
            }
        }
        Err(_) => Search {
            theta: start.to_vec(),
            cost: f64::INFINITY,
            history: found.history,
            work: 0,
            converged: false,
            stopped: false,
        },
    }
}

/// The best cost so far wherever it fell.
#[derive(Default)]
struct Improvements {
    history: Vec<(usize, f64)>,
}

impl Improvements {
    fn note(&mut self, work: usize, cost: f64) {
        if self.history.last().is_none_or(|(before, best)| work > *before && cost < *best) {
            self.history.push((work, cost));
        }
    }
}
