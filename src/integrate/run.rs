//! One integration from start to end: segments between discontinuities, and the method in each.

use super::augmented::Augmented;
use super::bdf::Bdf;
use super::choice::{Advice, Monitor, Stiffness};
use super::consistent::{Consistency, make_consistent};
use super::events::Events;
use super::norm::ErrorNorm;
use super::problem::{Dynamics, FailureCause, MethodChoice, Options, Plan, Start};
use super::recorder::Recorder;
use super::runge_kutta::{Pair, RungeKutta};
use super::stepper::{Limits, Refusal};

/// At this relative tolerance and below, the method of order 8 needs fewer evaluations than that of order 5.
const TIGHT: f64 = 1e-8;
const BDF_NAME: &str = "BDF";
/// Start values may miss a constraint by this multiple of the relative tolerance.
const START_ACCURACY: f64 = 10.0;
/// Constraints are differenced with respect to time over this share of a segment.
const TIME_SHARE: f64 = 1e-6;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Explicit,
    Bdf,
}

impl Method {
    fn name(self, pair: Pair) -> &'static str {
        match self {
            Method::Explicit => pair.name(),
            Method::Bdf => BDF_NAME,
        }
    }
}

pub(super) struct Run<'d, 't> {
    pub system: Augmented<'d>,
    pub recorder: Recorder<'t>,
    limits: Limits,
    method: Method,
    runge_kutta: RungeKutta,
    bdf: Bdf,
    monitor: Option<Monitor>,
    events: Option<Events>,
    has_passed_start: bool,
    /// The present state is in `z`, not in the method.
    has_settled: bool,
    tolerance: f64,
    time: f64,
    z: Vec<f64>,
    z_prime: Vec<f64>,
}

impl<'d, 't> Run<'d, 't> {
    /// The request must have been checked.
    pub fn new(dynamics: &'d mut dyn Dynamics, start: &Start, times: &'t [f64], options: &Options) -> Self {
        let with_sensitivities = !start.sensitivity.is_empty();
        let mut system = Augmented::new(dynamics, with_sensitivities, start.time, &start.y, &start.y_prime);
        let (n, p) = (system.n, system.p);
        let controlled = if options.control_sensitivities { p } else { 0 };
        let norm = |system: &Augmented| ErrorNorm::new(system, options, controlled);
        let mut z = start.y.clone();
        z.extend((0..n).flat_map(|i| (0..p).map(move |j| start.sensitivity[j * n + i])));
        let mut z_prime = vec![0.0; z.len()];
        z_prime[..n].copy_from_slice(&start.y_prime);
        let (method, reason) = first_method(system.explicit, options.method);
        let pair = explicit_pair(options);
        system.work.method = method.name(pair);
        system.work.reason = reason.to_owned();
        system.work.span = (start.time, times.last().copied().unwrap_or(start.time));
        let switches = system.dynamics.switch_count();
        let has_clocks = !system.dynamics.clock_periods().is_empty();
        let events = (switches > 0 || has_clocks).then(|| Events::new(switches, z.len()));
        let kinks = if p > 0 { system.dynamics.kink_count() } else { 0 };
        let automatic = method == Method::Explicit && options.method == MethodChoice::Automatic;
        Self {
            recorder: Recorder::new(n, p, times, options.record_plan),
            limits: Limits::new(options),
            method,
            runge_kutta: RungeKutta::new(pair, z.len(), (kinks, n), norm(&system)),
            bdf: Bdf::new(&system, norm(&system)),
            monitor: (automatic && options.follow_plan.is_none()).then(Monitor::default),
            system,
            events,
            has_passed_start: false,
            has_settled: false,
            tolerance: options.relative_tolerance,
            time: start.time,
            z,
            z_prime,
        }
    }

    /// Whether the method in charge can do without explicit rates.
    pub fn is_possible(&self) -> bool {
        self.method == Method::Bdf || self.system.explicit
    }

    /// The last state reached, length n.
    pub fn state(&self) -> Vec<f64> {
        let solution = match self.method {
            _ if self.system.work.steps == 0 => &self.z[..],
            Method::Explicit => self.runge_kutta.solution(),
            Method::Bdf => self.bdf.solution(),
        };
        solution[..self.system.n].to_vec()
    }

    /// Completes the start for an integration to `end` and takes the requested times at the start itself.
    ///
    /// # Errors
    ///
    /// Start values that do not satisfy the constraints.
    pub fn take_start(&mut self, end: f64) -> Result<(), Refusal> {
        if self.method == Method::Bdf {
            self.require_constraints()?;
            self.make_consistent(end)?;
        }
        let z = &self.z;
        self.recorder.take_until(self.time, |_, out| out.copy_from_slice(z));
        Ok(())
    }

    /// Refuses values that miss a constraint by more than the tolerances allow.
    fn require_constraints(&mut self) -> Result<(), Refusal> {
        if !self.system.structure.has_constraints() {
            return Ok(());
        }
        let n = self.system.n;
        let mut residual = vec![0.0; n];
        self.system.residual(self.time, &self.z[..n], &self.z_prime[..n], &mut residual);
        self.system.linearise(self.time, &self.z[..n], &self.z_prime[..n], 0.0);
        let mut effect = vec![0.0; n];
        let places = self.system.jacobian_rows.iter().zip(&self.system.jacobian_columns);
        for ((&row, &column), value) in places.zip(&self.system.jacobian) {
            effect[row] += value.abs() * (self.system.dynamics.scale()[column] + self.z[column].abs());
        }
        let missed = |row: &&usize| residual[**row].abs() > START_ACCURACY * self.tolerance * effect[**row];
        match self.system.structure.constraints.iter().find(missed) {
            Some(&row) => Err(Refusal {
                time: self.time,
                cause: FailureCause::InconsistentStart,
                component: None,
                equation: Some(row),
            }),
            None => Ok(()),
        }
    }

    fn make_consistent(&mut self, end: f64) -> Result<(), Refusal> {
        let time_step = time_step(self.time, end);
        match make_consistent(&mut self.system, self.time, time_step, &mut self.z, &mut self.z_prime) {
            Consistency::NotFinite(component) => {
                Err(Refusal { component: Some(component), ..Refusal::new(self.time, FailureCause::NotFinite) })
            }
            Consistency::Reached | Consistency::Undetermined => Ok(()),
        }
    }

    /// Integrates to `end` under error control; `discontinuous`: the right-hand side may jump there.
    pub fn segment(&mut self, end: f64, discontinuous: bool) -> Result<(), Refusal> {
        self.begin_segment(end, discontinuous)?;
        while self.time < end {
            let step = match self.method {
                Method::Explicit => self.runge_kutta.step(&mut self.system, &self.limits, end)?,
                Method::Bdf => self.bdf.step(&mut self.system, &self.limits, end)?,
            };
            self.recorder.note(step);
            if !self.heed_events(end)? {
                self.take_step();
                self.heed_kinks(end)?;
                self.heed_monitor(end)?;
            }
        }
        self.end_segment();
        Ok(())
    }

    /// Follows the part of a recorded plan that ends at `end`, starting with its step `next`; returns the step after.
    pub fn follow(&mut self, plan: &Plan, mut next: usize, end: f64, discontinuous: bool) -> Result<usize, Refusal> {
        let method_of = |order: u8| if order == 0 || order == 8 { Method::Explicit } else { Method::Bdf };
        let run_out = |time| Refusal::new(time, FailureCause::InvalidRequest);
        if let Some(step) = plan.steps.get(next) {
            self.method = method_of(step.order);
        }
        self.begin_segment(end, discontinuous)?;
        while self.time < end {
            let step = plan.steps.get(next).filter(|s| s.end > self.time && s.end <= end).ok_or(run_out(self.time))?;
            if method_of(step.order) != self.method {
                self.change_method(method_of(step.order), end)?;
            }
            match self.method {
                Method::Explicit => {
                    let pair = if step.order == Pair::Eight.order() { Pair::Eight } else { Pair::Five };
                    if pair != self.runge_kutta.pair {
                        self.change_pair(pair, end)?;
                    }
                    self.runge_kutta.follow(&mut self.system, step)?;
                }
                Method::Bdf => self.bdf.follow(&mut self.system, step.end, step.order as usize)?,
            }
            self.recorder.note(step.clone());
            self.take_step();
            next += 1;
        }
        self.end_segment();
        Ok(next)
    }

    /// Lets clocks tick between two segments.
    pub fn tick(&mut self, clocks: &[usize]) -> Result<(), Refusal> {
        if let (Some(events), false) = (&mut self.events, clocks.is_empty()) {
            events.tick(&mut self.system, clocks, self.time, &mut self.z)?;
            self.has_passed_start = true;
        }
        Ok(())
    }

    fn begin_segment(&mut self, end: f64, discontinuous: bool) -> Result<(), Refusal> {
        self.system.last_time = if discontinuous { end.next_down() } else { f64::INFINITY };
        if self.method == Method::Bdf && self.has_passed_start {
            self.make_consistent(end)?;
        }
        self.has_passed_start = true;
        if let Some(events) = &mut self.events {
            if self.method == Method::Explicit {
                self.system.rates(self.time, &self.z, &mut self.z_prime);
            }
            let n = self.system.n;
            events.begin(&mut self.system, self.time, &self.z, &self.z_prime[..n]);
        }
        self.start_method(end)
    }

    /// Lets the values of kink functions decide on their sides again.
    pub fn release_kinks(&mut self) {
        self.runge_kutta.release_kinks(&mut self.system);
    }

    fn end_segment(&mut self) {
        // After an event at the very end the state is that after its reset.
        if !std::mem::take(&mut self.has_settled) {
            self.keep_solution();
        }
    }

    fn start_method(&mut self, end: f64) -> Result<(), Refusal> {
        match self.method {
            Method::Explicit => self.runge_kutta.restart(&mut self.system, self.time, &self.z, &self.limits, end),
            Method::Bdf => {
                self.bdf.restart(self.time, &self.z, &self.z_prime, &self.limits, end);
                Ok(())
            }
        }
    }

    /// Takes the solution over from the method in charge.
    fn keep_solution(&mut self) {
        match self.method {
            Method::Explicit => self.z.copy_from_slice(self.runge_kutta.solution()),
            Method::Bdf => {
                self.z.copy_from_slice(self.bdf.solution());
                self.z_prime.copy_from_slice(self.bdf.derivative());
            }
        }
    }

    fn take_step(&mut self) {
        self.time = self.step_end();
        self.take_interpolated();
    }

    fn take_interpolated(&mut self) {
        if self.method == Method::Explicit && self.recorder.wants(self.time) {
            self.runge_kutta.prepare_interpolation(&mut self.system);
        }
        match self.method {
            Method::Explicit => self.recorder.take_until(self.time, |t, z| self.runge_kutta.interpolate(t, z)),
            Method::Bdf => self.recorder.take_until(self.time, |t, z| self.bdf.interpolate(t, z)),
        }
    }

    /// Whether the step just taken ended in an event; the solution then goes on from there.
    fn heed_events(&mut self, end: f64) -> Result<bool, Refusal> {
        let to = self.step_end();
        if self.method == Method::Explicit && self.system.dynamics.switch_count() > 0 {
            self.runge_kutta.prepare_interpolation(&mut self.system);
        }
        let Some(events) = self.events.as_mut().filter(|events| events.has_switches()) else { return Ok(false) };
        let system = &mut self.system;
        let found = match self.method {
            Method::Explicit => events.find(system, self.time, to, |t, z| self.runge_kutta.interpolate(t, z)),
            Method::Bdf => events.find(system, self.time, to, |t, z| self.bdf.interpolate(t, z)),
        };
        let Some(event) = found else { return Ok(false) };
        self.time = event.time;
        self.take_interpolated();
        match self.method {
            Method::Explicit => self.runge_kutta.interpolate(event.time, &mut self.z),
            Method::Bdf => self.bdf.interpolate(event.time, &mut self.z),
        }
        self.release_kinks();
        let time_step = time_step(event.time, end);
        if let Some(events) = &mut self.events {
            events.cross(&mut self.system, event, time_step, &mut self.z)?;
        }
        self.system.work.events.push((event.time, event.switch));
        self.has_settled = true;
        if self.time < end {
            if self.method == Method::Bdf {
                self.make_consistent(end)?;
            }
            self.start_method(end)?;
            self.has_settled = false;
        }
        Ok(true)
    }

    /// Where the method in charge has got to.
    fn step_end(&self) -> f64 {
        match self.method {
            Method::Explicit => self.runge_kutta.time(),
            Method::Bdf => self.bdf.time(),
        }
    }

    /// The method of order 8 pays only where the solution is smooth.
    fn heed_kinks(&mut self, end: f64) -> Result<(), Refusal> {
        if self.method == Method::Explicit && self.runge_kutta.meets_kinks() {
            self.system.work.reason += ", order 5 because order 8 had too many steps rejected at kinks";
            self.system.work.switches.push((self.time, Pair::Five.name()));
            self.change_pair(Pair::Five, end)?;
        }
        Ok(())
    }

    fn change_pair(&mut self, pair: Pair, end: f64) -> Result<(), Refusal> {
        self.keep_solution();
        self.runge_kutta.pair = pair;
        self.system.work.method = pair.name();
        if self.time < end { self.start_method(end) } else { Ok(()) }
    }

    fn heed_monitor(&mut self, end: f64) -> Result<(), Refusal> {
        let Some(monitor) = &mut self.monitor else { return Ok(()) };
        let stiffness = match self.method {
            Method::Explicit if self.runge_kutta.near_stability => Stiffness::NearBound,
            Method::Bdf if self.bdf.is_mild(self.runge_kutta.pair.stability()) => Stiffness::Mild,
            Method::Explicit | Method::Bdf => Stiffness::Unremarkable,
        };
        let method = match monitor.observe(self.time, stiffness, &self.system.work) {
            Advice::Stay => return Ok(()),
            Advice::Try => Method::Bdf,
            Advice::Return => Method::Explicit,
        };
        self.system.work.reason = monitor.reason();
        self.system.work.switches.push((self.time, method.name(self.runge_kutta.pair)));
        self.change_method(method, end)
    }

    /// Continues with another method from the end of the last step.
    fn change_method(&mut self, method: Method, end: f64) -> Result<(), Refusal> {
        self.keep_solution();
        self.release_kinks();
        self.method = method;
        self.system.work.method = method.name(self.runge_kutta.pair);
        if self.time >= end {
            return Ok(());
        }
        if method == Method::Bdf {
            self.system.rates(self.time, &self.z, &mut self.z_prime);
        }
        self.start_method(end)
    }
}

/// The explicit pair that suits the tolerance.
fn explicit_pair(options: &Options) -> Pair {
    if options.relative_tolerance <= TIGHT { Pair::Eight } else { Pair::Five }
}

/// Distance of differences in time.
fn time_step(time: f64, end: f64) -> f64 {
    TIME_SHARE * (end - time).max(f64::MIN_POSITIVE.sqrt())
}

fn first_method(explicit: bool, choice: MethodChoice) -> (Method, &'static str) {
    match choice {
        MethodChoice::Bdf => (Method::Bdf, "asked for"),
        MethodChoice::RungeKutta => (Method::Explicit, "asked for"),
        MethodChoice::Automatic if explicit => (Method::Explicit, "no stiffness seen"),
        MethodChoice::Automatic => (Method::Bdf, "the equations are implicit"),
    }
}
