//! Answers made up for the tests of reports, with the shape and size of real ones: a drive axis with dry friction (one
//! channel, 25 000 samples) and a quarter vehicle (three channels) whose causes cannot be told apart.
//!
//! Figures of fit are computed from the made-up histories, so that text and pictures agree.

mod drive_axis;
mod quarter_vehicle;

pub use drive_axis::drive_axis;
pub use quarter_vehicle::quarter_vehicle;

use ident::diagnose::{Candidate, Refit};
use ident::identify::{ChannelFit, DiscrepancyNode, Identification, ParameterEstimate, RecordFit};

/// Reproducible noise, about normal with unit deviation.
pub struct Noise(pub u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn next(&mut self) -> f64 {
        (0..6).map(|_| self.uniform() - 0.5).sum::<f64>() * std::f64::consts::SQRT_2
    }
}

pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value * value, count + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// `100 |measured - simulated|^2 / |measured - mean|^2`, square-rooted to an amplitude ratio.
fn discrepancy(measured: &[f64], simulated: &[f64]) -> f64 {
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    100.0 * rms(measured.iter().zip(simulated).map(|(m, s)| m - s)) / rms(measured.iter().map(|m| m - mean))
}

pub fn channel(name: &str, title: &str, unit: &str, measured: Vec<f64>, simulated: Vec<f64>, noise: f64) -> ChannelFit {
    let residual_rms = rms(measured.iter().zip(&simulated).map(|(m, s)| m - s));
    ChannelFit {
        name: name.into(),
        title: title.into(),
        unit: unit.into(),
        discrepancy: discrepancy(&measured, &simulated),
        relative_error: 100.0 * residual_rms / rms(measured.iter().copied()),
        residual_rms,
        noise,
        noise_source: "residual of the best fit".into(),
        measured,
        simulated,
    }
}

pub fn node(name: &str, discrepancy: f64, children: Vec<DiscrepancyNode>) -> DiscrepancyNode {
    DiscrepancyNode { name: name.into(), discrepancy, children }
}

pub fn record(
    experiment: &str,
    role: &str,
    time: &[f64],
    channels: Vec<ChannelFit>,
    groups: &[(&str, &[usize])],
) -> RecordFit {
    let leaf = |index: &usize| node(&channels[*index].name, channels[*index].discrepancy, vec![]);
    let mean = |nodes: &[DiscrepancyNode]| rms(nodes.iter().map(|node| node.discrepancy));
    let children: Vec<DiscrepancyNode> = if groups.is_empty() {
        (0..channels.len()).map(|index| leaf(&index)).collect()
    } else {
        let group = |(name, members): &(&str, &[usize])| {
            let leaves: Vec<_> = members.iter().map(leaf).collect();
            node(name, mean(&leaves), leaves)
        };
        groups.iter().map(group).collect()
    };
    RecordFit {
        experiment: experiment.into(),
        role: role.into(),
        file: format!("data/{experiment}.csv"),
        time: time.to_vec(),
        discrepancy: node("total", mean(&children), children),
        channels,
    }
}

/// (name, unit, lower, upper, start, value, standard deviation)
pub type Row<'a> = (&'a str, &'a str, f64, f64, f64, f64, Option<f64>);

pub fn parameters(rows: &[Row]) -> Vec<ParameterEstimate> {
    let estimate = |&(name, unit, lower, upper, start, value, deviation): &Row| ParameterEstimate {
        name: name.into(),
        unit: unit.into(),
        lower,
        upper,
        start,
        value,
        standard_deviation: deviation,
        interval: deviation.map(|deviation| (value - 1.96 * deviation, value + 1.96 * deviation)),
        at_bound: value <= lower || value >= upper,
        identifiability: deviation.map_or(0.0, |deviation| (0.02 * (upper - lower) / deviation).min(1.0)),
    };
    rows.iter().map(estimate).collect()
}

pub fn identification(variant: &str, parameters: Vec<ParameterEstimate>, records: Vec<RecordFit>) -> Identification {
    let of_role = |role: &str| {
        let chosen: Vec<f64> =
            records.iter().filter(|record| record.role == role).map(|record| record.discrepancy.discrepancy).collect();
        (!chosen.is_empty()).then(|| rms(chosen.into_iter()))
    };
    let count = parameters.len();
    let residual_count =
        records.iter().filter(|r| r.role == "estimation").map(|r| r.time.len() * r.channels.len()).sum();
    let estimation_discrepancy = of_role("estimation").unwrap_or(0.0);
    let cost = estimation_discrepancy.powi(2) * residual_count as f64 * 1e-4;
    Identification {
        variant: variant.into(),
        correlation: (0..count)
            .map(|row| {
                (0..count)
                    .map(|column| if row == column { 1.0 } else { 0.2 / (1.0 + row.abs_diff(column) as f64) })
                    .collect()
            })
            .collect(),
        covariance: (0..count).map(|i| (0..count).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect(),
        freedom: 40.0,
        profiles: vec![],
        singular_values: (0..count).map(|index| 310.0 * 0.21f64.powi(index as i32)).collect(),
        undetermined: vec![],
        estimation_discrepancy,
        validation_discrepancy: of_role("validation"),
        cost,
        cost_history: (0..6).map(|index| cost * (1.0 + 40.0 * 0.08f64.powi(index))).collect(),
        residual_count,
        effective_count: residual_count as f64 / 37.0,
        bic: residual_count as f64 / 37.0 * (cost / residual_count as f64).ln()
            + count as f64 * (residual_count as f64 / 37.0).ln(),
        iterations: 6,
        simulations: 9,
        failed_simulations: 0,
        stop_reason: "relative change of the cost below 1e-8".into(),
        gradient_digits: Some(7.4),
        structure: None,
        error: ident::identify::ErrorReport {
            used: "output".into(),
            reason: "free simulation from the experiment's start".into(),
            others: vec![ident::identify::OtherError { name: "equation".into(), why: "`strut.z` not measured".into() }],
            process_noise: vec![],
        },
        remarks: vec![],
        parameters,
        records,
    }
}

/// A candidate that was screened but not refitted.
pub fn screened(name: &str, title: &str, score: Option<f64>, visibility: f64, predicted_gain: f64) -> Candidate {
    let (effect, place) = name.split_once(" at ").unwrap_or((name, ""));
    Candidate {
        name: name.into(),
        effect: effect.into(),
        place: place.into(),
        same_as: Vec::new(),
        title: title.into(),
        score: score.map(|score| (score, 1)),
        visibility: Some(visibility),
        predicted_gain,
        refit: None,
        confidence: None,
        smallest_detectable: None,
    }
}

pub struct Judged {
    pub estimation: f64,
    pub validation: f64,
    pub change: (f64, f64),
    pub bic: f64,
    pub p_value: f64,
    pub confidence: f64,
}

pub fn refitted(
    mut candidate: Candidate,
    judged: Judged,
    parameters: &[(&str, f64, f64, &str)],
    objection: Option<&str>,
) -> Candidate {
    candidate.confidence = Some(judged.confidence);
    candidate.refit = Some(Refit {
        estimation_discrepancy: judged.estimation,
        validation_discrepancy: Some(judged.validation),
        validation_change: Some(judged.change),
        bic_difference: judged.bic,
        p_value: judged.p_value,
        parameters: parameters
            .iter()
            .map(|&(name, value, deviation, unit)| {
                (name.into(), value, Some((value - 1.96 * deviation, value + 1.96 * deviation)), unit.into())
            })
            .collect(),
        plausible: true,
        objection: objection.map(Into::into),
    });
    candidate
}
