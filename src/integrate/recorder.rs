//! Collects the solution at the requested times.

use super::problem::{Plan, PlannedStep, Solution, Work};

pub(super) struct Recorder<'t> {
    n: usize,
    p: usize,
    times: &'t [f64],
    next: usize,
    y: Vec<f64>,
    sensitivity: Vec<f64>,
    plan: Option<Plan>,
    z: Vec<f64>,
}

impl<'t> Recorder<'t> {
    pub fn new(n: usize, p: usize, times: &'t [f64], with_plan: bool) -> Self {
        Self {
            n,
            p,
            times,
            next: 0,
            y: Vec::with_capacity(n * times.len()),
            sensitivity: vec![0.0; n * p * times.len()],
            plan: with_plan.then(Plan::default),
            z: vec![0.0; n * (1 + p)],
        }
    }

    pub fn note(&mut self, step: PlannedStep) {
        if let Some(plan) = &mut self.plan {
            plan.steps.push(step);
        }
    }

    /// Whether a requested time up to `reached` has not been taken yet.
    pub fn wants(&self, reached: f64) -> bool {
        self.times.get(self.next).is_some_and(|&t| t <= reached)
    }

    /// Takes every requested time up to `reached` from the interpolant.
    pub fn take_until(&mut self, reached: f64, mut interpolate: impl FnMut(f64, &mut [f64])) {
        while let Some(&t) = self.times.get(self.next).filter(|&&t| t <= reached) {
            interpolate(t, &mut self.z);
            self.y.extend_from_slice(&self.z[..self.n]);
            // Row by row within the integrator, column by column for everybody else.
            let block = &mut self.sensitivity[self.next * self.n * self.p..][..self.n * self.p];
            for (i, row) in self.z[self.n..].chunks_exact(self.p.max(1)).enumerate() {
                for (j, &value) in row.iter().enumerate() {
                    block[j * self.n + i] = value;
                }
            }
            self.next += 1;
        }
    }

    pub fn finish(self, work: Work) -> Solution {
        Solution { times: self.times.to_vec(), y: self.y, sensitivity: self.sensitivity, work, plan: self.plan }
    }
}
