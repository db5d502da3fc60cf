//! What limited the steps of a run, in the study's words.

use crate::integrate::Work;
use serde::Serialize;
use std::fmt;

/// Share of the steps that the named time span holds.
const SPAN_SHARE: f64 = 0.8;
/// Components below this share of the steps are not named.
const SMALLEST_SHARE: f64 = 0.01;

/// Counts of work and who is to blame for them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slowness {
    pub method: String,
    /// Why this method.
    pub reason: String,
    pub steps: usize,
    /// Steps tried again because their error was too large, and because their equations could not be solved.
    pub rejected_error: usize,
    pub rejected_equations: usize,
    pub evaluations: usize,
    pub factorisations: usize,
    /// Simulated time, s.
    pub duration: f64,
    /// The largest share first.
    pub limits: Vec<Limit>,
}

/// A state that limited the step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// In the study's words: `slide.velocity`.
    pub name: String,
    /// Share of all accepted steps, 0 to 1.
    pub share: f64,
    /// Shortest time span with four fifths of them, s.
    pub from: f64,
    pub to: f64,
}

impl Slowness {
    pub(super) fn new(work: &Work, name: impl Fn(usize) -> String) -> Self {
        let mut order: Vec<usize> = (0..work.limited_by.len()).filter(|&i| work.limited_by[i] > 0).collect();
        order.sort_by_key(|&i| (std::cmp::Reverse(work.limited_by[i]), i));
        let limit = |i: usize| {
            let share = work.limited_by[i] as f64 / work.steps.max(1) as f64;
            let (from, to) = work.limited_span(i, SPAN_SHARE)?;
            (share >= SMALLEST_SHARE).then(|| Limit { name: name(i), share, from, to })
        };
        Self {
            method: work.method.to_owned(),
            reason: work.reason.clone(),
            steps: work.steps,
            rejected_error: work.rejected_error,
            rejected_equations: work.rejected_newton,
            evaluations: work.residuals,
            factorisations: work.factorisations,
            duration: work.span.1 - work.span.0,
            limits: order.into_iter().filter_map(limit).collect(),
        }
    }

    /// The one that limited most steps: `slide.velocity in 83 % of the steps, 3.2 to 3.4 s`.
    pub fn foremost(&self) -> Option<String> {
        self.limits.first().map(ToString::to_string)
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} in {:.0} % of the steps, ", self.name, 100.0 * self.share)?;
        write!(formatter, "{} to {} s", rounded(self.from, self.to), rounded(self.to, self.from))
    }
}

/// With as many digits as it takes to tell the two times apart.
fn rounded(time: f64, other: f64) -> String {
    let distance = (time - other).abs();
    let decimals = if distance > 0.0 { (1.0 - distance.log10().floor()).clamp(0.0, 9.0) as usize } else { 3 };
    format!("{time:.decimals$}")
}

/// In the unit that gives one to three digits before the point.
fn duration(seconds: f64) -> String {
    let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")];
    let (size, unit) = units.into_iter().find(|(size, _)| seconds >= *size).unwrap_or(units[3]);
    format!("{:.3} {unit}", seconds / size)
}

impl fmt::Display for Slowness {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mean = duration(self.duration / self.steps.max(1) as f64);
        writeln!(formatter, "{} steps for {} s, {mean} on average", self.steps, self.duration)?;
        writeln!(
            formatter,
            "tried again: {} for their error, {} for their equations",
            self.rejected_error, self.rejected_equations
        )?;
        writeln!(
            formatter,
            "{}: {}; {} evaluations, {} factorisations",
            self.method, self.reason, self.evaluations, self.factorisations
        )?;
        writeln!(formatter, "the step was limited by")?;
        self.limits.iter().try_for_each(|limit| writeln!(formatter, "  {limit}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work() -> Work {
        let mut when = vec![0; 200];
        when[64] = 500;
        when[65] = 300;
        when[10] = 30;
        Work {
            method: "BDF",
            steps: 1000,
            limited_by: vec![170, 830, 0],
            limited_when: vec![vec![1; 200], when, Vec::new()],
            span: (0.0, 10.0),
            ..Work::default()
        }
    }

    #[test]
    fn names_the_foremost_with_share_and_span() {
        let slowness = Slowness::new(&work(), |i| ["a", "glide_front.velocity", "c"][i].to_owned());
        assert_eq!(slowness.foremost().as_deref(), Some("glide_front.velocity in 83 % of the steps, 3.20 to 3.30 s"));
        assert_eq!(slowness.limits.len(), 2);
        assert!(slowness.to_string().starts_with("1000 steps for 10 s, 10.000 ms on average"), "{slowness}");
        assert_eq!(
            [duration(2.5e11), duration(3.1e-5), duration(1e-12)],
            ["250000000000.000 s", "31.000 us", "0.001 ns"]
        );
        assert!(slowness.to_string().contains("a in 17 % of the steps, 0.0 to 8.0 s"), "{slowness}");
    }
}
