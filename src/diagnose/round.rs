//! One round of screening: the current model at its optimum and what every candidate is compared with.

use super::candidates::Candidate;
use crate::identify::{Fitted, Problem, prefilters};
use crate::linear::Basis;
use crate::signal::{PowerSpectrum, effective_count, periodogram};
use crate::simulation::{Compiled, Record};
use crate::study::{self, Loaded};

/// Name under which a trial variant is appended to the study; never shown.
const TRIAL: &str = "candidate_trial";
/// A screen looks for shares of the residual, which is far above this tolerance; refits use the study's own.
const SCREENING_TOLERANCE: f64 = 1e-4;
/// Peaks of the residual's spectrum at which an unknown frequency is tried.
const PEAKS: usize = 4;
/// Chi-square distance at which a strength counts as detectable: 5 % over some hundred candidates.
const DETECTABLE_STATISTIC: f64 = 12.0;

/// The current model fitted, and the projections that a screen needs.
pub(super) struct Round<'a> {
    /// The study with all accepted extensions appended.
    pub loaded: &'a Loaded,
    /// Name of the variant that is the current model (`base` at first).
    pub variant: &'a str,
    pub compiled: &'a Compiled,
    /// Estimation records.
    pub records: &'a [&'a Record],
    pub fitted: &'a Fitted,
    /// Span of the fitted parameters' gradient.
    pub basis: Basis,
    /// The residual at the optimum without what the fitted parameters could still absorb.
    pub projected_residual: Vec<f64>,
    /// Effective number of samples per channel (index of measure), from the residual's autocorrelation.
    pub effective: Vec<f64>,
}

impl<'a> Round<'a> {
    pub(super) fn new(
        loaded: &'a Loaded,
        variant: &'a str,
        compiled: &'a Compiled,
        records: &'a [&'a Record],
        fitted: &'a Fitted,
    ) -> Self {
        let rows = fitted.residual.len();
        let basis = Basis::new(&fitted.gradient, rows);
        let mut projected_residual = fitted.residual.clone();
        basis.project_out(&mut projected_residual);
        let effective = effective_counts(compiled.study.measures.len(), fitted, &fitted.residual);
        Self { loaded, variant, compiled, records, fitted, basis, projected_residual, effective }
    }

    /// The candidate's variant compiled. `frozen`: the current parameters become constants at their optimum, so that
    /// only the candidate's own unknowns remain. `None` where the variant is refused or impossible.
    pub(super) fn compile(&self, candidate: &Candidate, values: &[f64], frozen: bool) -> Option<Compiled> {
        let text = candidate.variant(TRIAL, self.variant, values);
        let extended = self.loaded.with_text(&text);
        let mut study = study::check(&extended, Some(TRIAL)).ok()?.study;
        if !frozen {
            return Compiled::new(study).ok();
        }
        study.solver.relative_tolerance = study.solver.relative_tolerance.max(SCREENING_TOLERANCE);
        let current = &self.compiled.study.parameters;
        let fixed: Vec<(String, f64)> =
            current.iter().map(|parameter| parameter.name.clone()).zip(self.fitted.theta.iter().copied()).collect();
        Compiled::frozen(study, &fixed).ok()
    }

    /// Start of a refit: the current optimum followed by the candidate's values, in the extended study's order.
    pub(super) fn start(&self, extended: &Compiled, candidate: &Candidate, values: &[f64]) -> Vec<f64> {
        let current = self.compiled.study.parameters.iter().map(|p| p.name.as_str()).zip(&self.fitted.theta);
        let added = candidate.unknowns.iter().map(|unknown| unknown.target.as_str()).zip(values);
        let known: Vec<(&str, f64)> = current.chain(added).map(|(name, value)| (name, *value)).collect();
        extended
            .study
            .parameters
            .iter()
            .map(|parameter| {
                known
                    .iter()
                    .rev()
                    .find(|(name, _)| *name == parameter.name)
                    .map_or(parameter.start, |(_, value)| *value)
            })
            .collect()
    }

    /// The estimation problem of another compiled model, with this round's records, filters and weights.
    pub(super) fn problem<'b>(&'b self, compiled: &'b Compiled) -> Problem<'b> {
        // The same records passed this design before; a failure here would have stopped the base fit.
        let filters = prefilters(compiled, self.records).unwrap_or_default();
        Problem::new(compiled, self.records.to_vec(), filters, self.fitted.weighting.weights.clone())
    }

    /// `sum over channels of n_eff log(RSS / n)`: minus twice the log-likelihood with unknown variances.
    pub(super) fn deviance(&self, residual: &[f64]) -> f64 {
        deviance(self.fitted, residual, &self.effective)
    }

    /// Deviance of the current model.
    pub(super) fn current_deviance(&self) -> f64 {
        self.deviance(&self.projected_residual)
    }

    pub(super) fn effective_total(&self) -> f64 {
        self.effective.iter().sum()
    }

    /// Share of independent samples: the factor from naive to honest chi-square statistics.
    pub(super) fn score_scale(&self) -> f64 {
        self.effective_total() / self.projected_residual.len().max(1) as f64
    }

    pub(super) fn projected_mean_square(&self) -> f64 {
        let squares: f64 = self.projected_residual.iter().map(|value| value * value).sum();
        squares / self.projected_residual.len().max(1) as f64
    }

    /// Strength whose score statistic would just be significant, for a projected sensitivity of this norm.
    pub(super) fn detectable_strength(&self, sensitivity_norm: f64) -> Option<f64> {
        let variance = self.projected_mean_square() / self.score_scale();
        (sensitivity_norm > 0.0).then(|| (DETECTABLE_STATISTIC * variance).sqrt() / sensitivity_norm)
    }

    /// Frequencies (Hz) of the strongest peaks in the residual's spectra between two limits.
    pub(super) fn peak_frequencies(&self, lower: f64, upper: f64) -> Vec<f64> {
        let mut peaks: Vec<(f64, f64)> = self
            .fitted
            .blocks
            .iter()
            .flat_map(|block| {
                let step = self.records[block.record].sample_step();
                peaks(&self.fitted.residual[block.rows.clone()], 1.0 / step)
            })
            .filter(|(frequency, _)| (lower..=upper).contains(frequency))
            .collect();
        peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
        peaks.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-3 * b.0);
        peaks.truncate(PEAKS);
        peaks.into_iter().map(|(frequency, _)| frequency).collect()
    }
}

/// The strongest local maxima of a periodogram: (frequency in Hz, share of the power).
fn peaks(residual: &[f64], rate: f64) -> Vec<(f64, f64)> {
    let spectrum = periodogram(residual, rate);
    let total: f64 = spectrum.density.iter().sum();
    let mut peaks: Vec<(f64, f64)> = (1..spectrum.density.len().saturating_sub(1))
        .filter(|&k| {
            let [before, here, after] = [spectrum.density[k - 1], spectrum.density[k], spectrum.density[k + 1]];
            here > before && here >= after
        })
        .map(|k| (between_lines(&spectrum, k), spectrum.density[k] / total))
        .collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    peaks.truncate(PEAKS);
    peaks
}

/// Frequency of a harmonic whose highest line is `k`: its distance from there follows from the height of the higher
/// neighbour (of a rectangular window the heights fall with the inverse distance). A refit that starts a whole line off
/// ends elsewhere.
fn between_lines(spectrum: &PowerSpectrum, k: usize) -> f64 {
    let [before, here, after] = [k - 1, k, k + 1].map(|line| spectrum.density[line].sqrt());
    let neighbour = before.max(after);
    let shift = if here > 0.0 { neighbour / (here + neighbour) } else { 0.0 };
    let spacing = spectrum.frequencies[k + 1] - spectrum.frequencies[k];
    spectrum.frequencies[k] + spacing * if after > before { shift } else { -shift }
}

/// Effective sample size per measure of a stacked residual.
pub(super) fn effective_counts(measures: usize, fitted: &Fitted, residual: &[f64]) -> Vec<f64> {
    let mut counts = vec![0.0; measures];
    for block in &fitted.blocks {
        counts[block.measure] += effective_count(&residual[block.rows.clone()]);
    }
    counts
}

/// See [`Round::deviance`].
pub(super) fn deviance(fitted: &Fitted, residual: &[f64], effective: &[f64]) -> f64 {
    let mut squares = vec![0.0; effective.len()];
    let mut counts = vec![0usize; effective.len()];
    for block in &fitted.blocks {
        squares[block.measure] += residual[block.rows.clone()].iter().map(|value| value * value).sum::<f64>();
        counts[block.measure] += block.rows.len();
    }
    (0..effective.len())
        .filter(|&c| counts[c] > 0)
        .map(|c| effective[c] * (squares[c] / counts[c] as f64).max(f64::MIN_POSITIVE).ln())
        .sum()
}

#[cfg(test)]
mod tests {
    use super::peaks;

    /// A harmonic between two lines of 0.1 Hz is found to a hundredth of their distance.
    #[test]
    fn the_frequency_of_a_harmonic_is_found_between_the_lines() {
        for frequency in [7.3, 7.32, 7.348, 7.36, 7.395] {
            let samples: Vec<f64> =
                (0..1000).map(|k| (std::f64::consts::TAU * frequency * f64::from(k) * 0.01 + 0.4).sin()).collect();
            let found = peaks(&samples, 100.0).first().map_or(0.0, |peak| peak.0);
            assert!((found - frequency).abs() < 2e-3, "{frequency}: {found}");
        }
    }
}
