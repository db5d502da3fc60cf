//! One integration from start to end: segments between discontinuities, and the method in each.

use super::augmented::Augmented;
use super::bdf::Bdf;
use super::choice::{Advice, Monitor};
use super::consistent::{Consistency, make_consistent};
use super::norm::ErrorNorm;
use super::problem::{Dynamics, FailureCause, MethodChoice, Options, Plan, Start};
use super::recorder::Recorder;
use super::runge_kutta::RungeKutta;
use super::stepper::{Limits, Refusal};

const EXPLICIT_NAME: &str = "Runge-Kutta 5(4)";
const BDF_NAME: &str = "BDF";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Explicit,
    Bdf,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Method::Explicit => EXPLICIT_NAME,
            Method::Bdf => BDF_NAME,
        }
    }
}

pub(super) struct Run<'d, 't, D: ?Sized> {
    pub system: Augmented<'d, D>,
    pub recorder: Recorder<'t>,
    limits: Limits,
    method: Method,
    runge_kutta: RungeKutta,
    bdf: Bdf,
    monitor: Option<Monitor>,
    time: f64,
    z: Vec<f64>,
    z_prime: Vec<f64>,
}

impl<'d, 't, D: Dynamics + ?Sized> Run<'d, 't, D> {
    /// The request must have been checked.
    pub fn new(dynamics: &'d mut D, start: &Start, times: &'t [f64], options: &Options) -> Self {
        let with_sensitivities = !start.sensitivity.is_empty();
        let mut system = Augmented::new(dynamics, with_sensitivities, start.time, &start.y);
        let (n, p) = (system.n, system.p);
        let controlled = if options.control_sensitivities { p } else { 0 };
        let norm = |system: &Augmented<D>| ErrorNorm::new(system.dynamics, options, controlled);
        let mut z = start.y.clone();
        z.extend((0..n).flat_map(|i| (0..p).map(move |j| start.sensitivity[j * n + i])));
        let mut z_prime = vec![0.0; z.len()];
        z_prime[..n].copy_from_slice(&start.y_prime);
        let (method, reason) = first_method(system.explicit, options.method);
        system.work.method = method.name();
        system.work.reason = reason.to_owned();
        let automatic = method == Method::Explicit && options.method == MethodChoice::Automatic;
        Self {
            recorder: Recorder::new(n, p, times, options.record_plan),
            limits: Limits::new(options),
            method,
            runge_kutta: RungeKutta::new(z.len(), norm(&system)),
            bdf: Bdf::new(&system, norm(&system)),
            monitor: (automatic && options.follow_plan.is_none()).then(Monitor::default),
            system,
            time: start.time,
            z,
            z_prime,
        }
    }

    /// Whether the method in charge can do without explicit rates.
    pub fn is_possible(&self) -> bool {
        self.method == Method::Bdf || self.system.explicit
    }

    pub fn take_start(&mut self) {
        let z = &self.z;
        self.recorder.take_until(self.time, |_, out| out.copy_from_slice(z));
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
            self.take_step();
            self.heed_monitor(end)?;
        }
        self.end_segment();
        Ok(())
    }

    /// Follows the part of a recorded plan that ends at `end`, starting with its step `next`; returns the step after.
    pub fn follow(&mut self, plan: &Plan, mut next: usize, end: f64, discontinuous: bool) -> Result<usize, Refusal> {
        let method_of = |order: u8| if order == 0 { Method::Explicit } else { Method::Bdf };
        let run_out = |time| Refusal { time, cause: FailureCause::InvalidRequest, component: None };
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
                Method::Explicit => self.runge_kutta.follow(&mut self.system, step.end)?,
                Method::Bdf => self.bdf.follow(&mut self.system, step.end, step.order as usize)?,
            }
            self.recorder.note(*step);
            self.take_step();
            next += 1;
        }
        self.end_segment();
        Ok(next)
    }

    fn begin_segment(&mut self, end: f64, discontinuous: bool) -> Result<(), Refusal> {
        self.system.last_time = if discontinuous { end.next_down() } else { f64::INFINITY };
        if self.method == Method::Bdf {
            let consistency = make_consistent(&mut self.system, self.time, &mut self.z, &mut self.z_prime);
            if let Consistency::NotFinite(component) = consistency {
                let cause = FailureCause::NotFinite;
                return Err(Refusal { time: self.time, cause, component: Some(component) });
            }
        }
        self.start_method(end)
    }

    fn end_segment(&mut self) {
        self.keep_solution();
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
        match self.method {
            Method::Explicit => {
                self.time = self.runge_kutta.time();
                self.recorder.take_until(self.time, |t, z| self.runge_kutta.interpolate(t, z));
            }
            Method::Bdf => {
                self.time = self.bdf.time();
                self.recorder.take_until(self.time, |t, z| self.bdf.interpolate(t, z));
            }
        }
    }

    fn heed_monitor(&mut self, end: f64) -> Result<(), Refusal> {
        let Some(monitor) = &mut self.monitor else { return Ok(()) };
        let near_stability = self.method == Method::Explicit && self.runge_kutta.near_stability;
        let method = match monitor.observe(self.time, near_stability, &self.system.work) {
            Advice::Stay => return Ok(()),
            Advice::Try => Method::Bdf,
            Advice::Return => Method::Explicit,
        };
        self.system.work.reason = monitor.reason();
        self.system.work.switches.push((self.time, method.name()));
        self.change_method(method, end)
    }

    /// Continues with another method from the end of the last step.
    fn change_method(&mut self, method: Method, end: f64) -> Result<(), Refusal> {
        self.keep_solution();
        self.method = method;
        self.system.work.method = method.name();
        if self.time >= end {
            return Ok(());
        }
        if method == Method::Bdf {
            self.system.rates(self.time, &self.z, &mut self.z_prime);
        }
        self.start_method(end)
    }
}

fn first_method(explicit: bool, choice: MethodChoice) -> (Method, &'static str) {
    match choice {
        MethodChoice::Bdf => (Method::Bdf, "asked for"),
        MethodChoice::RungeKutta => (Method::Explicit, "asked for"),
        MethodChoice::Automatic if explicit => (Method::Explicit, "no stiffness seen"),
        MethodChoice::Automatic => (Method::Bdf, "the equations are implicit"),
    }
}
