//! One record simulated.

use super::branching::{Branching, branchings};
use super::delay::{Delays, Schedule};
use super::failure::{Detail, Failure};
use super::involved::with_elements;
use super::prepare::Record;
use super::singular_joint::singular_joint;
use super::slowness::Slowness;
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::Symbol;
use crate::integrate::{self, Dynamics, FailureCause, MethodChoice, Options, Plan, Solution, Start, Work};
use crate::mechanics::{self, System, Variable, VariableKind};
use crate::study::{Method, Parameter, Study};
use crate::tape::{Bound, Model};
use std::sync::Arc;

/// A study with its equations and closures.
#[derive(Clone, Debug)]
pub struct Compiled {
    pub study: Study,
    pub system: System,
    pub model: Model,
    pub(super) delays: Delays,
}

impl Compiled {
    /// # Errors
    /// What makes the mechanism impossible, in the study's words.
    pub fn new(study: Study) -> Result<Self, Vec<Diagnostic>> {
        let system = mechanics::derive(&study)?;
        let model = Model::compile(&system);
        let delays = Delays::new(&study);
        let idle = parameters_without_influence(&study, &model, &delays);
        if idle.is_empty() { Ok(Self { study, system, model, delays }) } else { Err(idle) }
    }

    /// As [`Compiled::new`], with the named parameters held at these values (SI): they become constants of the
    /// equations.
    ///
    /// # Errors
    /// As [`Compiled::new`].
    pub fn frozen(mut study: Study, fixed: &[(String, f64)]) -> Result<Self, Vec<Diagnostic>> {
        let symbols: Vec<(Symbol, f64)> = study
            .parameters
            .iter()
            .filter_map(|parameter| {
                let (_, value) = fixed.iter().find(|(name, _)| *name == parameter.name)?;
                Some((parameter.symbol, *value))
            })
            .collect();
        let mut system = mechanics::derive(&study)?;
        system.freeze(&symbols);
        study.parameters.retain(|parameter| fixed.iter().all(|(name, _)| *name != parameter.name));
        let values = symbols.iter().map(|(symbol, value)| (*symbol, study.graph.constant(*value))).collect();
        for measure in &mut study.measures {
            measure.delay = measure.delay.map(|delay| study.graph.substitute(&[delay], &values)[0]);
        }
        let (model, delays) = (Model::compile(&system), Delays::new(&study));
        Ok(Self { study, system, model, delays })
    }
}

/// A parameter from which no path leads to any measured channel cannot be identified by any data.
fn parameters_without_influence(study: &Study, model: &Model, delays: &Delays) -> Vec<Diagnostic> {
    study
        .parameters
        .iter()
        .zip(model.parameter_reach())
        .enumerate()
        .filter(|(k, (_, reach))| !reach[..study.measures.len()].contains(&true) && !delays.depend_on(*k))
        .map(|(_, (parameter, _))| {
            Diagnostic::error(
                Code::NO_INFLUENCE,
                format!("parameter `{}` has no influence on any measure", parameter.name),
            )
            .label(parameter.span, "nothing that is measured depends on it")
            .help("measure a quantity that depends on it, or take it out of `identify` and give its value in the study")
        })
        .collect()
}

/// Whether the gradient is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gradient {
    None,
    AllParameters,
}

/// What limited the steps of a run, with the model's names.
pub fn slowness(compiled: &Compiled, trajectory: &Trajectory) -> Slowness {
    Slowness::new(&trajectory.work, |i| compiled.model.variables()[i].name.clone())
}

/// The model's answer to one record, SI, at the compared samples.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// One per measure of the record: N samples.
    pub channels: Vec<Vec<f64>>,
    /// One per measure of the record: N x p column-major; empty where no gradient was asked for.
    pub gradient: Vec<Vec<f64>>,
    /// Place probes (`System::probes`), each N samples; empty unless [`probe`] filled them.
    pub probes: Vec<Vec<f64>>,
    /// Where closed loops could have gone on in another way; empty unless [`probe`] filled it.
    pub branchings: Vec<Branching>,
    /// Stated start values that the loops do not allow.
    pub moved: Vec<Moved>,
    pub work: Work,
}

/// Simulates `record` with parameters `theta` (SI, length p).
///
/// # Errors
/// [`Failure`] with time, cause and the state to blame.
pub fn simulate(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    gradient: Gradient,
) -> Result<Trajectory, Failure> {
    Ok(run(compiled, record, theta, gradient, false, options(&compiled.study))?.0)
}

/// As [`simulate`] without gradient, and with the place probes along the solution and its branchings.
///
/// # Errors
/// [`Failure`] with time, cause and the state to blame.
pub fn probe(compiled: &Compiled, record: &Record, theta: &[f64]) -> Result<Trajectory, Failure> {
    Ok(run(compiled, record, theta, Gradient::None, true, options(&compiled.study))?.0)
}

/// As [`simulate`], and the sequence of steps taken.
pub(super) fn record_plan(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    gradient: Gradient,
) -> Result<(Trajectory, Plan), Failure> {
    let options = Options { record_plan: true, ..options(&compiled.study) };
    let (trajectory, plan) = run(compiled, record, theta, gradient, false, options)?;
    Ok((trajectory, plan.unwrap_or_default()))
}

/// As [`simulate`] without gradient, along a given sequence of steps.
pub(super) fn follow(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    plan: Arc<Plan>,
) -> Result<Trajectory, Failure> {
    let options = Options { follow_plan: Some(plan), ..options(&compiled.study) };
    Ok(run(compiled, record, theta, Gradient::None, false, options)?.0)
}

fn run(
    compiled: &Compiled,
    record: &Record,
    theta: &[f64],
    gradient: Gradient,
    with_probes: bool,
    options: Options,
) -> Result<(Trajectory, Option<Plan>), Failure> {
    let with_gradient = gradient == Gradient::AllParameters;
    let mut bound = Bound::new(&compiled.model, &record.inputs, theta);
    bound.set_parameter_scale(compiled.study.parameters.iter().map(Parameter::scale).collect());
    let name = |i: usize| compiled.model.variables()[i].name.clone();
    let blame = |bound: &Bound, failure: integrate::Failure| {
        let equation = |i: usize| with_elements(compiled, i, bound.equation_name(i));
        let mut told = Failure::from_integration(&record.title(), &failure, name, equation);
        if let Some(cause) = singular_joint(compiled, &failure.state, failure.component) {
            told.help = cause;
        }
        told
    };
    let start = start(compiled, &mut bound, record, with_gradient).map_err(|failure| blame(&bound, failure))?;
    let schedule = Schedule::new(&compiled.delays, record, theta).ok_or_else(|| no_schedule(record, start.time))?;
    let mut solution = integrate::integrate(&mut bound, &start, &schedule.times, &record.breakpoints, &options)
        .map_err(|failure| blame(&bound, failure))?;
    let moved = moved_starts(compiled, &mut bound, record, &start);
    if !moved.is_empty() {
        let names: Vec<&str> =
            moved.iter().map(|moved| compiled.model.variables()[moved.state].name.as_str()).collect();
        solution.work.reason += &format!("; start values moved to close the loops: {}", names.join(", "));
    }
    let (channels, gradients) = outputs(&mut bound, record, &solution, &schedule, with_gradient);
    let finite = channels.iter().flatten().chain(gradients.iter().flatten()).all(|value| value.is_finite());
    if !finite {
        return Err(Failure {
            record: record.title(),
            time: record.times.last().copied().unwrap_or(start.time),
            cause: "a measured quantity became infinite or not a number".to_owned(),
            component: None,
            detail: Box::new(Detail { equations: Vec::new(), slowness: Slowness::new(&solution.work, name) }),
            help: "a measure or criterion divides by zero or takes the root of a negative number".to_owned(),
        });
    }
    let (mut places, mut passed) = (Vec::new(), Vec::new());
    if with_probes {
        places = probes(&mut bound, record, &solution, &schedule);
        passed = branchings(compiled, &mut bound, &solution.times, &solution.y);
    }
    let plan = solution.plan.take();
    let trajectory =
        Trajectory { channels, gradient: gradients, probes: places, branchings: passed, moved, work: solution.work };
    Ok((trajectory, plan))
}

pub(super) fn no_schedule(record: &Record, time: f64) -> Failure {
    Failure {
        record: record.title(),
        time,
        cause: "the delay of a measure is negative or not a number".to_owned(),
        component: None,
        detail: Box::new(Detail {
            equations: Vec::new(),
            slowness: Slowness::new(&Work::default(), |_| String::new()),
        }),
        help: "bound the parameters of the delay so that it stays above zero".to_owned(),
    }
}

pub(super) fn start(
    compiled: &Compiled,
    bound: &mut Bound,
    record: &Record,
    with_gradient: bool,
) -> Result<Start, integrate::Failure> {
    let t0 = record.start_time();
    let given = bound.start_values(record.experiment, t0);
    let (mut y, mut sensitivity) = (given.values, given.derivatives);
    if given.equilibrium[..compiled.model.state_count()].contains(&true) {
        let balanced = integrate::equilibrium(bound, t0, &y, &sensitivity, &given.equilibrium)?;
        y = balanced.y;
        sensitivity = balanced.sensitivity;
    }
    if !with_gradient {
        sensitivity.clear();
    }
    if bound.differential().contains(&false) {
        let stated = stated(compiled, record.experiment);
        let first = integrate::consistent_start(bound, t0, &y, &sensitivity, &stated);
        let Err(failure) = first else { return first };
        if failure.cause != FailureCause::InconsistentStart {
            return Err(failure);
        }
        // More positions of a loop are stated than it has freedoms: the first ones are kept, the others say where it
        // stands, not to the last digit. Then the same of velocities.
        let [positions, velocities] = [VariableKind::Position, VariableKind::Velocity].map(|kind| {
            let order = stated_order(compiled, record.experiment);
            order.into_iter().filter(|&i| compiled.model.variables()[i].kind == kind).collect::<Vec<usize>>()
        });
        let mut attempt = |kept_positions: usize, kept_velocities: usize| {
            let mut kept = stated.clone();
            let given_up = positions[kept_positions..].iter().chain(&velocities[kept_velocities..]);
            given_up.for_each(|&i| kept[i] = false);
            let (mut near, mut slopes) = (y.clone(), sensitivity.clone());
            if let Some(references) = compiled.system.references.get(record.experiment) {
                for &i in &positions[kept_positions..] {
                    near[i] = references[i];
                    slopes.iter_mut().skip(i).step_by(y.len()).for_each(|slope| *slope = 0.0);
                }
            }
            integrate::consistent_start(bound, t0, &near, &slopes, &kept)
        };
        let most = (0..=positions.len()).rev().find(|&count| attempt(count, 0).is_ok());
        let Some(most) = most else { return Err(failure) };
        for count in (0..=velocities.len()).rev() {
            if let Ok(start) = attempt(most, count) {
                return Ok(start);
            }
        }
        return Err(failure);
    }
    let mut y_prime = vec![0.0; y.len()];
    bound.explicit_rates(t0, &y, &mut y_prime);
    Ok(Start { time: t0, y, y_prime, sensitivity })
}

/// A stated start value that did not close the loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Index into [`System::states`].
    pub state: usize,
    /// SI
    pub stated: f64,
    pub taken: f64,
}

fn moved_starts(compiled: &Compiled, bound: &mut Bound, record: &Record, start: &Start) -> Vec<Moved> {
    let given = bound.start_values(record.experiment, start.time).values;
    let variables = compiled.model.variables().iter().zip(stated(compiled, record.experiment));
    let moved = variables.enumerate().filter(|(i, (variable, is_stated))| {
        *is_stated && (start.y[*i] - given[*i]).abs() > VISIBLE_MOVE * variable.scale
    });
    moved.map(|(state, _)| Moved { state, stated: given[state], taken: start.y[state] }).collect()
}

/// Start values that move by less, relative to their typical magnitude, count as kept.
const VISIBLE_MOVE: f64 = 1e-6;

/// Variables whose start values are stated: by the experiment, or by a law for its states. Those of the reference
/// configuration at rest are where the mechanism starts from to close its loops.
fn stated(compiled: &Compiled, experiment: usize) -> Vec<bool> {
    let start = compiled.study.starts().nth(experiment);
    let overrides = start.as_ref().map_or(&[][..], |(_, start, _)| &start.overrides[..]);
    let is_stated = |variable: &Variable| {
        variable.kind == VariableKind::Law || overrides.iter().any(|(symbol, _)| *symbol == variable.symbol)
    };
    compiled.system.states.iter().map(is_stated).chain(compiled.system.algebraic.iter().map(|_| false)).collect()
}

/// The variables whose start values the experiment states, in the order in which it does.
fn stated_order(compiled: &Compiled, experiment: usize) -> Vec<usize> {
    let start = compiled.study.starts().nth(experiment);
    let overrides = start.as_ref().map_or(&[][..], |(_, start, _)| &start.overrides[..]);
    let place = |symbol: Symbol| compiled.system.states.iter().position(|variable| variable.symbol == symbol);
    let mut order: Vec<usize> = Vec::new();
    for at in overrides.iter().filter_map(|(symbol, _)| place(*symbol)) {
        if !order.contains(&at) {
            order.push(at);
        }
    }
    order
}

pub(super) fn options(study: &Study) -> Options {
    Options {
        relative_tolerance: study.solver.relative_tolerance,
        method: match study.solver.method {
            Method::Automatic => MethodChoice::Automatic,
            Method::Bdf => MethodChoice::Bdf,
            Method::RungeKutta => MethodChoice::RungeKutta,
        },
        ..Options::default()
    }
}

/// Measured channels (and their gradient) at the compared samples, from the solution at the times of the schedule.
fn outputs(
    bound: &mut Bound,
    record: &Record,
    solution: &Solution,
    schedule: &Schedule,
    with_gradient: bool,
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let model = bound.model();
    let (n, m, p) = (model.dimension(), model.output_count(), model.parameter_count());
    let samples = record.sample_count();
    let mut values = vec![0.0; m];
    let mut slopes = vec![0.0; m * p];
    let mut others = values.clone();
    let mut channels = vec![vec![0.0; samples]; record.measures.len()];
    let mut gradients = vec![vec![0.0; if with_gradient { samples * p } else { 0 }]; record.measures.len()];
    for k in 0..samples {
        let mut evaluated = None;
        for (c, &measure) in record.measures.iter().enumerate() {
            let row = schedule.row(c, k);
            let (t, y) = (solution.times[row], &solution.y[row * n..(row + 1) * n]);
            // Channels without delay share an instant.
            if evaluated.replace(row) != Some(row) {
                bound.outputs(t, y, &mut values);
                if with_gradient {
                    let block = &solution.sensitivity[row * n * p..(row + 1) * n * p];
                    bound.output_sensitivity(t, y, block, &mut slopes);
                }
            }
            channels[c][k] = values[measure];
            if !with_gradient {
                continue;
            }
            for j in 0..p {
                gradients[c][j * samples + k] = slopes[j * m + measure];
            }
            let through_delay = schedule.slopes(c, k, |row| output(bound, solution, row, measure, &mut others));
            for (j, slope) in through_delay.into_iter().flatten().enumerate() {
                gradients[c][j * samples + k] += slope;
            }
        }
    }
    (channels, gradients)
}

/// One output at one row of a solution.
fn output(bound: &mut Bound, solution: &Solution, row: usize, measure: usize, values: &mut [f64]) -> f64 {
    let n = bound.model().dimension();
    bound.outputs(solution.times[row], &solution.y[row * n..(row + 1) * n], values);
    values[measure]
}

fn probes(bound: &mut Bound, record: &Record, solution: &Solution, schedule: &Schedule) -> Vec<Vec<f64>> {
    let model = bound.model();
    let (n, count) = (model.dimension(), model.probe_count());
    let mut values = vec![0.0; count];
    let mut histories = vec![vec![0.0; record.sample_count()]; count];
    for (k, &row) in schedule.base.iter().enumerate() {
        bound.probes(solution.times[row], &solution.y[row * n..(row + 1) * n], &mut values);
        for (history, value) in histories.iter_mut().zip(&values) {
            history[k] = *value;
        }
    }
    histories
}
