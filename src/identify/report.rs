//! From a fit to what a reader is shown: units of the study, intervals, discrepancy tree, remarks.

use super::confidence::{Confidence, confidence};
use super::constraints::active_constraints;
use super::errors::error_report;
use super::fitting::{Fitted, prefilters};
use super::problem::Problem;
use super::resolution::resolution;
use super::{ChannelFit, DiscrepancyNode, Identification, ParameterEstimate, RecordFit};
use crate::quantities::format_number;
use crate::signal::AutoRegression;
use crate::simulation::{Compiled, Record, Trajectory, certify};
use crate::study::{ErrorDefinition, Group, Role};

/// Reports `fitted` on all `records` (the estimation records among them). Records that cannot be simulated with these
/// parameters are left out and mentioned in the remarks.
pub fn identification(compiled: &Compiled, fitted: &Fitted, records: &[&Record]) -> Identification {
    let confidence = confidence(compiled, fitted);
    let mut remarks = Vec::new();
    let mut fits = Vec::new();
    let mut totals = Totals::default();
    for record in records {
        match record_fit(compiled, fitted, record) {
            Ok((fit, squares, mean_squares)) => {
                totals.add(record.role, squares, mean_squares);
                fits.push(fit);
            }
            Err(explanation) => remarks.push(format!("{} could not be simulated: {explanation}", record.name)),
        }
    }
    remarks.extend(super::suspicious::remarks(&fits));
    remarks.extend(unstated_rounding(compiled, &fits));
    remarks.extend(parameter_remarks(compiled, fitted, &confidence));
    remarks.extend(way_remarks(compiled, fitted, &confidence));
    let estimation: Vec<&Record> = records.iter().copied().filter(|r| r.role == Role::Estimation).collect();
    let gradient_digits = gradient_digits(compiled, fitted, &estimation, &mut remarks);
    Identification {
        variant: compiled.study.variant.clone(),
        parameters: parameters(compiled, fitted, &confidence),
        correlation: confidence.correlation.clone(),
        covariance: covariance(compiled, &confidence),
        freedom: confidence.freedom(),
        profiles: Vec::new(),
        singular_values: confidence.singular_values.clone(),
        undetermined: confidence.undetermined.clone(),
        records: fits,
        estimation_discrepancy: totals.of(Role::Estimation).unwrap_or_else(|| fitted.discrepancy()),
        validation_discrepancy: totals.of(Role::Validation),
        cost: fitted.cost(),
        cost_history: fitted.cost_history.clone(),
        residual_count: fitted.residual.len(),
        effective_count: confidence.effective_count,
        bic: confidence.bic,
        iterations: fitted.iterations,
        simulations: fitted.simulations,
        failed_simulations: fitted.failed_simulations,
        stop_reason: fitted.stop_reason.to_string(),
        gradient_digits,
        structure: None,
        error: error_report(compiled, fitted, &estimation),
        remarks,
    }
}

/// Digits to which the gradient agrees with an independent derivative, on the estimation records.
fn gradient_digits(
    compiled: &Compiled,
    fitted: &Fitted,
    estimation: &[&Record],
    remarks: &mut Vec<String>,
) -> Option<f64> {
    match certify(compiled, estimation, &fitted.theta) {
        Ok(digits) => {
            if compiled.model.switch_count() > 0 {
                let how = "events move with the parameters: the gradient was compared with differences of whole runs";
                remarks.push(how.to_owned());
            }
            digits
        }
        Err(failure) => {
            remarks.push(format!("the gradient could not be checked: {failure}"));
            None
        }
    }
}

/// Sums of V and V_mean per role.
#[derive(Default)]
struct Totals {
    sums: Vec<(Role, f64, f64)>,
}

impl Totals {
    fn add(&mut self, role: Role, squares: f64, mean_squares: f64) {
        self.sums.push((role, squares, mean_squares));
    }

    fn of(&self, role: Role) -> Option<f64> {
        let sum = |pick: fn(&(Role, f64, f64)) -> f64| {
            self.sums.iter().filter(|entry| entry.0 == role).map(pick).sum::<f64>()
        };
        let mean = sum(|entry| entry.2);
        (mean > 0.0).then(|| 100.0 * sum(|entry| entry.1) / mean)
    }
}

fn parameters(compiled: &Compiled, fitted: &Fitted, confidence: &Confidence) -> Vec<ParameterEstimate> {
    compiled
        .study
        .parameters
        .iter()
        .enumerate()
        .map(|(j, parameter)| ParameterEstimate {
            name: parameter.name.clone(),
            unit: parameter.unit.symbol.clone(),
            lower: parameter.unit.from_si(parameter.lower),
            upper: parameter.unit.from_si(parameter.upper),
            start: parameter.unit.from_si(parameter.start),
            value: parameter.unit.from_si(fitted.theta[j]),
            standard_deviation: confidence.standard_deviation(j).map(|sd| parameter.unit.difference_from_si(sd)),
            interval: confidence
                .interval(j)
                .map(|(low, high)| (parameter.unit.from_si(low), parameter.unit.from_si(high))),
            at_bound: fitted.at_bound[j],
            identifiability: confidence.identifiability[j],
        })
        .collect()
}

fn parameter_remarks(compiled: &Compiled, fitted: &Fitted, confidence: &Confidence) -> Vec<String> {
    let mut remarks = Vec::new();
    for (parameter, &at_bound) in compiled.study.parameters.iter().zip(&fitted.at_bound) {
        if at_bound {
            remarks.push(format!(
                "{} is at its bound: a sign of a structural error nearby, or of bounds that are too narrow",
                parameter.name
            ));
        }
    }
    for constraint in active_constraints(&compiled.study, &fitted.theta) {
        remarks.push(format!("the constraint `{constraint}` holds back the fit: intervals do not know of it"));
    }
    remarks.extend(confidence.undetermined.iter().map(|direction| format!("not determined by this data: {direction}")));
    if !fitted.stop_reason.converged() {
        remarks.push(format!("the fit of {} stopped early: {}", compiled.study.variant, fitted.stop_reason));
    }
    if fitted.failed_simulations > 0 {
        remarks.push(format!("{} simulations failed and shortened a step", fitted.failed_simulations));
    }
    remarks
}

fn covariance(compiled: &Compiled, confidence: &Confidence) -> Vec<Vec<f64>> {
    let parameters = &compiled.study.parameters;
    let units = |j: usize| parameters[j].unit.difference_to_si(1.0);
    let count = parameters.len();
    let entry =
        |i: usize, j: usize| confidence.covariance.get(j * count + i).map_or(0.0, |v| v / (units(i) * units(j)));
    (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
}

/// The way to the result: bands, noise models.
fn way_remarks(compiled: &Compiled, fitted: &Fitted, confidence: &Confidence) -> Vec<String> {
    let mut remarks: Vec<String> = fitted
        .bands
        .iter()
        .map(|(stop, discrepancy)| {
            format!("fitted first below {} Hz: discrepancy {discrepancy:.2} % there", number(*stop))
        })
        .collect();
    let channel = |index: usize| compiled.study.measures[fitted.blocks[index].measure].name.as_str();
    for (index, model) in fitted.whitening.iter().enumerate() {
        if let Some(order) = model.as_ref().map(AutoRegression::order).filter(|order| *order > 0) {
            let name = channel(index);
            remarks.push(format!("noise of {name} modelled as autoregressive of order {order}, and weighted by it"));
        }
    }
    remarks.extend(fitted.gap.filter(|gap| *gap > OPEN_GAP).map(|gap| {
        format!(
            "the stretches could not be joined: gaps of up to {:.1} % of a state's course were left; the output error went on from there",
            100.0 * gap
        )
    }));
    if fitted.error == ErrorDefinition::Filter {
        remarks.push(
            "discrepancies and curves are those of free simulations: noise in the process lets these run out of step, the fit's own predictions do not"
                .to_owned(),
        );
    }
    remarks.extend(rounding_remarks(compiled, fitted, confidence));
    let coloured = confidence.noise_orders.iter().enumerate().filter(|(_, order)| **order > 0);
    let coloured: Vec<&str> = coloured.map(|(index, _)| channel(index)).collect();
    if fitted.whitening.is_empty() && fitted.error != ErrorDefinition::Equation && !coloured.is_empty() {
        remarks.push(format!(
            "coloured residual in {}: the intervals know of it; `--noise coloured` weights by it, too",
            coloured.join(", ")
        ));
    }
    remarks
}

/// What sensors that round contribute to the noise, and where that is no noise any more.
fn rounding_remarks(compiled: &Compiled, fitted: &Fitted, confidence: &Confidence) -> Vec<String> {
    let compared = |measure: usize| fitted.blocks.iter().any(|block| block.measure == measure);
    let measures = compiled.study.measures.iter().enumerate().filter(|(index, _)| compared(*index));
    measures
        .filter_map(|(index, measure)| {
            let step = measure.quantisation?;
            let noise = measure.noise.or(confidence.noise.get(index).copied().flatten())?;
            let share = (measure.rounding() / noise).powi(2);
            let step = number(measure.unit.difference_from_si(step));
            let advice = if share > MOSTLY_ROUNDING {
                ": its errors follow the signal and repeat with it, intervals may be too narrow"
            } else {
                ""
            };
            Some(format!(
                "{} rounds to {step} {}, {:.0} % of the variance of its noise{advice}",
                measure.name,
                measure.unit.symbol,
                100.0 * share.min(1.0)
            ))
        })
        .collect()
}

/// Channels that were rounded to steps of which the study does not know, where these make much of what is left.
fn unstated_rounding(compiled: &Compiled, fits: &[RecordFit]) -> Vec<String> {
    let unaware = compiled.study.measures.iter().filter(|measure| measure.quantisation.is_none());
    unaware
        .filter_map(|measure| {
            let channels = fits.iter().flat_map(|fit| &fit.channels).filter(|channel| channel.name == measure.name);
            // A model that leaves far less than rounding would has the steps itself, such as a switch.
            let makes_most = |step: &f64, rms: f64| {
                (MOSTLY_ROUNDING..1.0 / MOSTLY_ROUNDING).contains(&(step / 12f64.sqrt() / rms).powi(2))
            };
            let steps = channels
                .filter_map(|channel| resolution(&channel.measured).filter(|step| makes_most(step, channel.residual_rms)));
            let (name, unit) = (&measure.name, &measure.unit.symbol);
            steps.max_by(f64::total_cmp).map(|step| {
                let step = format_number(step, 3);
                format!(
                    "{name} comes in steps of {step} {unit}, which make most of what is left of it: `quantisation = {step} {unit}` in the measure tells the model"
                )
            })
        })
        .collect()
}

/// Gaps between stretches above this share of a state's course are told: they are closed below 1e-5.
const OPEN_GAP: f64 = 1e-3;
/// Rounding errors of a signal with less noise than a third of the step are no longer independent of it (Widrow-1961):
/// the variance q^2 / 12 is then this share of all.
const MOSTLY_ROUNDING: f64 = 0.43;

fn number(value: f64) -> String {
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}

/// One record, with V and V_mean of its channels summed.
fn record_fit(compiled: &Compiled, fitted: &Fitted, record: &Record) -> Result<(RecordFit, f64, f64), String> {
    let filters = prefilters(compiled, &[record]).map_err(|diagnostic| diagnostic.message)?;
    let mut problem = Problem::new(compiled, vec![record], filters, fitted.weighting.weights.clone());
    let trajectories = problem.trajectories(&fitted.theta).map_err(|failure| failure.explanation)?;
    let trajectory = &trajectories[0];
    let residuals = problem.filtered_residuals(0, trajectory);
    let mean_squares = problem.mean_squares();
    let weights = &fitted.weighting.weights;
    let squares: Vec<f64> = residuals
        .iter()
        .zip(&record.measures)
        .map(|(residual, &measure)| residual.iter().map(|r| (weights[measure] * r).powi(2)).sum())
        .collect();
    let of_measure = |values: &[f64], measure: usize| -> f64 {
        record.measures.iter().position(|&m| m == measure).map_or(0.0, |c| values[c])
    };
    let tree = discrepancy_tree(compiled, &compiled.study.groups, &record.measures, &|measure| {
        (of_measure(&squares, measure), of_measure(&mean_squares, measure))
    });
    let channels = (0..record.measures.len())
        .map(|c| channel_fit(compiled, fitted, record, trajectory, c, 100.0 * squares[c] / mean_squares[c]))
        .collect();
    let fit = RecordFit {
        experiment: record.name.clone(),
        role: role_name(record.role).to_owned(),
        file: record.file.display().to_string(),
        time: record.compared_times().to_vec(),
        channels,
        discrepancy: tree,
    };
    Ok((fit, squares.iter().sum(), mean_squares.iter().sum()))
}

fn role_name(role: Role) -> &'static str {
    match role {
        Role::Estimation => "estimation",
        Role::Validation => "validation",
        Role::Test => "test",
    }
}

fn channel_fit(
    compiled: &Compiled,
    fitted: &Fitted,
    record: &Record,
    trajectory: &Trajectory,
    channel: usize,
    discrepancy: f64,
) -> ChannelFit {
    let measure_index = record.measures[channel];
    let measure = &compiled.study.measures[measure_index];
    let (measured, simulated) = (&record.measured[channel], &trajectory.channels[channel]);
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
    let residual = squares(&mut measured.iter().zip(simulated).map(|(m, s)| m - s));
    let magnitude = squares(&mut measured.iter().copied());
    let noise = measure.weight / fitted.weighting.weights[measure_index];
    ChannelFit {
        name: measure.name.clone(),
        title: measure.title.clone(),
        unit: measure.unit.symbol.clone(),
        measured: measured.iter().map(|&value| measure.unit.from_si(value)).collect(),
        simulated: simulated.iter().map(|&value| measure.unit.from_si(value)).collect(),
        discrepancy,
        relative_error: 100.0 * (residual / magnitude).sqrt(),
        residual_rms: measure.unit.difference_from_si((residual / measured.len().max(1) as f64).sqrt()),
        noise: measure.unit.difference_from_si(noise),
        noise_source: fitted.weighting.sources[measure_index].to_owned(),
    }
}

/// V / V_mean down the groups (method 4.4.1); groups without a compared channel are left out.
fn discrepancy_tree(
    compiled: &Compiled,
    group: &Group,
    compared: &[usize],
    sums: &dyn Fn(usize) -> (f64, f64),
) -> DiscrepancyNode {
    fn add(
        compiled: &Compiled,
        group: &Group,
        compared: &[usize],
        sums: &dyn Fn(usize) -> (f64, f64),
    ) -> (DiscrepancyNode, f64, f64) {
        let mut children = Vec::new();
        let (mut total, mut mean) = (0.0, 0.0);
        for inner in &group.groups {
            let (node, v, v_mean) = add(compiled, inner, compared, sums);
            if v_mean > 0.0 {
                children.push(node);
            }
            total += v;
            mean += v_mean;
        }
        for &channel in group.channels.iter().filter(|channel| compared.contains(channel)) {
            let (v, v_mean) = sums(channel);
            let name = compiled.study.measures[channel].name.clone();
            children.push(DiscrepancyNode { name, discrepancy: 100.0 * v / v_mean, children: Vec::new() });
            total += v;
            mean += v_mean;
        }
        let discrepancy = if mean > 0.0 { 100.0 * total / mean } else { 0.0 };
        (DiscrepancyNode { name: group.name.clone(), discrepancy, children }, total, mean)
    }
    add(compiled, group, compared, sums).0
}
