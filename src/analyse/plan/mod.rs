//! What tests would tell, before they are made (method 7, 8; Atkinson-2007 for the measures of a design).

mod answer;
mod combinations;

use super::criterion::evaluate;
use crate::fit::PriorRow;
use crate::linear::SingularValueDecomposition;
use crate::signal::welch;
use crate::simulation::{Compiled, Gradient, Record, Trajectory, excitation, simulate};
use crate::statistics::{Covariance, identifiability, normal_quantile};
use crate::study::{Parameter, Study};
pub use answer::*;
pub use combinations::Combination;
use combinations::{Chosen, Offer, Worth};
use rayon::prelude::*;

/// Noise of a measure that states none, as a share of its largest deviation from the mean in the offered tests.
const ASSUMED_NOISE: f64 = 0.01;
/// As after a fit: singular values below this share of the largest are no knowledge.
const RANK_THRESHOLD: f64 = 1e-6;
/// A parameter whose deviation would exceed this share of its bounds is better given a value.
const HARDLY_DETERMINED: f64 = 0.25;
/// Information beside which a parameter counts as held, in units of the largest there is.
const HELD: f64 = 1e4;
/// Deviations that fall below this share of what they were are worth a word.
const NOTABLY: f64 = 0.9;
/// The useful band holds this share of the power of all sensitivities; samples should come ten times as fast as its
/// end.
const BAND_SHARE: f64 = 0.99;
const SAMPLES_PER_PERIOD: f64 = 10.0;

/// What is asked.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// Parameter values (SI) at which tests are imagined.
    pub theta: Vec<f64>,
    /// Samples per second; the manoeuvre's own step where absent.
    pub rate: Option<f64>,
    /// Largest half-width of a 95 % interval, as a share of the value.
    pub accuracy: f64,
    /// What is known already.
    pub knowledge: Vec<PriorRow>,
}

/// Information matrices of one excitation, scaled by the bounds: per sensor.
struct Knowledge {
    per_sensor: Vec<Vec<f64>>,
    /// Of all sensors up to each of some instants.
    growth: Vec<(f64, Vec<f64>)>,
    useful_rate: f64,
}

/// Plans with what the study offers.
///
/// # Errors
/// In words: nothing is offered, or no manoeuvre can be simulated.
pub fn plan(compiled: &Compiled, options: &PlanOptions) -> Result<Plan, String> {
    let study = &compiled.study;
    if study.manoeuvres.is_empty() {
        return Err("the study offers no excitation: declare `manoeuvre NAME { u = ..., for 10 s }`".to_owned());
    }
    let planner = Planner::new(compiled, options);
    let mut remarks = planner.remarks.clone();
    let tests: Vec<(Record, Result<Trajectory, String>)> = (0..study.manoeuvres.len())
        .into_par_iter()
        .map(|index| {
            let step = options.rate.map_or(study.manoeuvres[index].step, |rate| 1.0 / rate);
            let record = excitation(study, index, step);
            let trajectory = simulate(compiled, &record, &options.theta, Gradient::AllParameters);
            (record, trajectory.map_err(|failure| failure.to_string()))
        })
        .collect();
    let noise = noise(study, &tests, &mut remarks);
    let (mut excitations, mut all, mut offered) = (Vec::new(), planner.before.clone(), Vec::new());
    for (index, (record, trajectory)) in tests.iter().enumerate() {
        match trajectory.as_ref().map_err(Clone::clone).and_then(|found| planner.knowledge(record, found, &noise)) {
            Ok(knowledge) => {
                knowledge.per_sensor.iter().for_each(|information| add(&mut all, information));
                excitations.push(planner.excitation(index, record, &knowledge));
                offered.push(knowledge.per_sensor);
            }
            Err(explanation) => remarks.push(format!("{} could not be simulated: {explanation}", record.name)),
        }
    }
    if excitations.is_empty() {
        return Err(remarks.join("; "));
    }
    let together = planner.outcome(&all);
    Ok(Plan {
        study: study.name.clone(),
        variant: study.variant.clone(),
        accuracy: 100.0 * options.accuracy,
        best: best(&excitations),
        combinations: planner.combinations(&excitations, &offered),
        fix: planner.fix(&together, &all),
        together,
        excitations,
        remarks,
    })
}

/// Standard deviation of the noise per measure, SI; what is not stated is assumed, and said.
fn noise(study: &Study, tests: &[(Record, Result<Trajectory, String>)], remarks: &mut Vec<String>) -> Vec<f64> {
    let simulated = || tests.iter().filter_map(|(_, trajectory)| trajectory.as_ref().ok());
    let assumed =
        |index: usize| ASSUMED_NOISE * simulated().map(|found| deviation(&found.channels[index])).fold(0.0, f64::max);
    let mut noise = Vec::new();
    for (index, measure) in study.measures.iter().enumerate() {
        noise.push(measure.noise.unwrap_or_else(|| {
            let value = assumed(index);
            let shown = measure.unit.difference_from_si(value);
            let shown = format!("{} {}", crate::quantities::format_number(shown, 2), measure.unit.symbol);
            remarks.push(format!(
                "the noise of {} is not stated: {shown} is assumed, {} % of what the largest test moves it",
                measure.name,
                100.0 * ASSUMED_NOISE
            ));
            value.hypot(measure.rounding())
        }));
    }
    noise
}

struct Planner<'a> {
    compiled: &'a Compiled,
    options: &'a PlanOptions,
    scale: Vec<f64>,
    /// Information known before, scaled.
    before: Vec<f64>,
    /// Gradients of the criteria.
    criteria: Vec<Vec<f64>>,
    remarks: Vec<String>,
}

impl<'a> Planner<'a> {
    fn new(compiled: &'a Compiled, options: &'a PlanOptions) -> Self {
        let study = &compiled.study;
        let scale: Vec<f64> = study.parameters.iter().map(Parameter::scale).collect();
        let count = scale.len();
        let mut rows = options.knowledge.clone();
        rows.extend(study.parameters.iter().enumerate().filter_map(|(j, parameter)| {
            parameter.prior.map(|prior| PriorRow::gaussian(j, prior.mean, prior.standard_deviation))
        }));
        let mut before = vec![0.0; count * count];
        for row in rows {
            let scaled: Vec<f64> = (0..count).map(|j| row.slope(j) * scale[j]).collect();
            add_square(&mut before, &scaled, 1.0);
        }
        let mut remarks = vec![
            "planned with the parameters' present values: deviations hold near them, for white noise and a model without structural error".to_owned(),
        ];
        let criteria = match evaluate(compiled, &options.theta, Gradient::AllParameters) {
            Ok(values) => values.gradients,
            Err(failure) => {
                remarks.push(format!("criteria are not planned for: {failure}"));
                Vec::new()
            }
        };
        Self { compiled, options, scale, before, criteria, remarks }
    }

    fn knowledge(&self, record: &Record, trajectory: &Trajectory, noise: &[f64]) -> Result<Knowledge, String> {
        let study = &self.compiled.study;
        let filter = record.prefilter(study).map_err(|diagnostic| diagnostic.message)?;
        let (count, samples) = (self.scale.len(), record.sample_count());
        let mut knowledge = Knowledge { per_sensor: Vec::new(), growth: Vec::new(), useful_rate: 0.0 };
        let parts = 40.min(samples);
        let mut growth = vec![self.before.clone(); parts];
        for (&noise, gradient) in noise.iter().zip(&trajectory.gradient) {
            let mut information = vec![0.0; count * count];
            if noise > 0.0 {
                let columns: Vec<Vec<f64>> = (0..count)
                    .map(|j| {
                        let mut column = gradient[j * samples..(j + 1) * samples].to_vec();
                        filter.apply(&mut column);
                        column.iter_mut().for_each(|value| *value *= self.scale[j] / noise);
                        column
                    })
                    .collect();
                for (part, sum) in growth.iter_mut().enumerate() {
                    let range = part * samples / parts..(part + 1) * samples / parts;
                    add_gram(sum, &columns, range);
                }
                add_gram(&mut information, &columns, 0..samples);
                let rate = 1.0 / record.sample_step();
                let end = columns.iter().map(|column| band_end(column, rate)).fold(0.0, f64::max);
                knowledge.useful_rate = knowledge.useful_rate.max(SAMPLES_PER_PERIOD * end);
            }
            knowledge.per_sensor.push(information);
        }
        let mut sum = self.before.clone();
        for (part, own) in growth.into_iter().enumerate() {
            let gained: Vec<f64> = own.iter().zip(&self.before).map(|(a, b)| a - b).collect();
            add(&mut sum, &gained);
            let until = record.times[(part + 1) * samples / parts - 1];
            knowledge.growth.push((until, sum.clone()));
        }
        Ok(knowledge)
    }

    fn excitation(&self, index: usize, record: &Record, knowledge: &Knowledge) -> Excitation {
        let manoeuvre = &self.compiled.study.manoeuvres[index];
        let with = |use_sensor: &dyn Fn(usize) -> bool| {
            let mut sum = self.before.clone();
            let chosen = knowledge.per_sensor.iter().enumerate().filter(|(s, _)| use_sensor(*s));
            chosen.for_each(|(_, information)| add(&mut sum, information));
            sum
        };
        let all = with(&|_| true);
        let mut sensors: Vec<Sensor> = self
            .compiled
            .study
            .measures
            .iter()
            .enumerate()
            .map(|(s, measure)| Sensor {
                name: measure.name.clone(),
                alone: self.outcome(&with(&|other| other == s)).d_measure,
                without: self.outcome(&with(&|other| other != s)).d_measure,
            })
            .collect();
        // The greater the loss without it, the more valuable.
        let loss = |sensor: &Sensor| sensor.without.unwrap_or(f64::INFINITY);
        sensors.sort_by(|a, b| loss(b).total_cmp(&loss(a)));
        let rate = 1.0 / record.sample_step();
        let needs = self.needs(&all, knowledge, rate);
        let every = |value: fn(&Need) -> Option<f64>| {
            needs.iter().map(value).try_fold(0.0_f64, |most, own| Some(most.max(own?)))
        };
        Excitation {
            name: manoeuvre.name.clone(),
            title: manoeuvre.title.clone(),
            duration: manoeuvre.duration,
            rate,
            outcome: self.outcome(&all),
            useful_rate: knowledge.useful_rate,
            sufficient_duration: every(|need| need.duration),
            repetitions: every(|need| need.repetitions).map(|factor| factor.max(1.0).ceil()),
            needs,
            sensors,
        }
    }

    /// Rows whose Gram matrix is the information, unscaled: a gradient with the same statistics.
    fn root(&self, information: &[f64]) -> Option<Vec<f64>> {
        let count = self.scale.len();
        let decomposition = SingularValueDecomposition::new(count, count, information).ok()?;
        let mut root = vec![0.0; count * count];
        for (k, value) in decomposition.singular_values.iter().enumerate() {
            for (j, entry) in decomposition.right(k).iter().enumerate() {
                root[j * count + k] = value.max(0.0).sqrt() * entry / self.scale[j];
            }
        }
        Some(root)
    }

    fn covariance(&self, information: &[f64]) -> Option<Covariance> {
        Covariance::new(&self.root(information)?, &self.scale, 1.0, None, RANK_THRESHOLD).ok()
    }

    /// Everything whose accuracy is wanted.
    fn demands(&self) -> Vec<Demanded> {
        let study = &self.compiled.study;
        let parameters = study.parameters.iter().zip(&self.options.theta).enumerate();
        let mut demands: Vec<Demanded> = parameters
            .map(|(j, (parameter, value))| Demanded {
                name: parameter.name.clone(),
                unit: parameter.unit.symbol.clone(),
                wanted: self.options.accuracy * value.abs(),
                shown: parameter.unit.difference_from_si(self.options.accuracy * value.abs()),
                quantile: normal_quantile(0.975),
                gradient: (0..self.scale.len()).map(|k| if k == j { 1.0 } else { 0.0 }).collect(),
            })
            .collect();
        for (criterion, gradient) in study.criteria.iter().zip(&self.criteria) {
            demands.extend(criterion.within.map(|within| Demanded {
                name: criterion.name.clone(),
                unit: criterion.unit.symbol.clone(),
                wanted: within,
                shown: criterion.unit.difference_from_si(within),
                quantile: normal_quantile(0.5 + 0.5 * criterion.confidence),
                gradient: gradient.clone(),
            }));
        }
        // No relative accuracy of a value of zero.
        demands.retain(|demand| demand.wanted > 0.0);
        demands
    }

    fn needs(&self, all: &[f64], knowledge: &Knowledge, rate: f64) -> Vec<Need> {
        let whole = self.covariance(all);
        let parts: Vec<(f64, Option<Covariance>)> =
            knowledge.growth.iter().map(|(until, sum)| (*until, self.covariance(sum))).collect();
        self.demands()
            .into_iter()
            .map(|demand| {
                let factor = |covariance: &Option<Covariance>| {
                    let variance = covariance.as_ref()?.variance_of(&demand.gradient, &self.scale)?;
                    Some(demand.quantile * demand.quantile * variance / (demand.wanted * demand.wanted))
                };
                let enough = parts.iter().find(|(_, covariance)| factor(covariance).is_some_and(|times| times <= 1.0));
                let repetitions = factor(&whole);
                Need {
                    name: demand.name.clone(),
                    unit: demand.unit.clone(),
                    wanted: demand.shown,
                    duration: enough.map(|(until, _)| *until),
                    repetitions,
                    rate: repetitions.map(|times| (times * rate).max(knowledge.useful_rate)),
                }
            })
            .collect()
    }

    /// Names of the measures of a design, in the order of [`Planner::worth`].
    fn measure_names(&self) -> Vec<String> {
        let criteria = self.compiled.study.criteria.iter().take(self.criteria.len());
        ["D".to_owned(), "A".to_owned()].into_iter().chain(criteria.map(|criterion| criterion.name.clone())).collect()
    }

    fn worth(&self, information: &[f64]) -> Worth {
        let count = self.scale.len();
        let nothing = || Worth { undetermined: count, measures: vec![None; 2 + self.criteria.len()] };
        let Some(covariance) = self.covariance(information) else { return nothing() };
        let Ok(decomposition) = SingularValueDecomposition::new(count, count, information) else { return nothing() };
        let complete = covariance.undetermined.is_empty() && count > 0;
        let mean_log =
            decomposition.singular_values.iter().map(|value| 0.5 * value.ln()).sum::<f64>() / count.max(1) as f64;
        let shares = (0..count).map(|j| covariance.matrix[j * count + j] / (self.scale[j] * self.scale[j]));
        let mean = shares.sum::<f64>() / count.max(1) as f64;
        let criteria = self.criteria.iter().zip(&self.compiled.study.criteria).map(|(gradient, criterion)| {
            covariance.variance_of(gradient, &self.scale).map(|v| criterion.unit.difference_from_si(v.sqrt()))
        });
        Worth {
            undetermined: covariance.undetermined.len(),
            measures: [complete.then(|| (-mean_log).exp()), complete.then(|| mean.max(0.0).sqrt())]
                .into_iter()
                .chain(criteria)
                .collect(),
        }
    }

    fn combinations(&self, excitations: &[Excitation], offered: &[Vec<Vec<f64>>]) -> Vec<Combination> {
        let names = self.measure_names();
        let sensors = &self.compiled.study.measures;
        let offer = Offer { before: &self.before, information: offered, worth: &|information| self.worth(information) };
        let mut everything = self.before.clone();
        offered.iter().flatten().for_each(|information| add(&mut everything, information));
        let whole = self.worth(&everything);
        let named = |measure: usize, chosen: Chosen| {
            Some(Combination {
                measure: names[measure].clone(),
                excitations: chosen.choice.tests.iter().map(|&k| excitations[k].name.clone()).collect(),
                sensors: chosen.choice.sensors.iter().map(|&k| sensors[k].name.clone()).collect(),
                value: chosen.value,
                with_everything: whole.measures[measure]?,
                exact: chosen.exact,
            })
        };
        let best = offer.best(names.len()).into_iter().enumerate();
        best.flat_map(|(measure, found)| found.into_iter().map(move |chosen| (measure, chosen)))
            .filter_map(|(measure, chosen)| named(measure, chosen))
            .collect()
    }

    fn outcome(&self, information: &[f64]) -> Outcome {
        let study = &self.compiled.study;
        let names: Vec<&str> = study.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        let root = self.root(information).unwrap_or_default();
        let analysis = identifiability(&root, &self.scale, &self.options.theta, &names, RANK_THRESHOLD).ok();
        let covariance = self.covariance(information);
        let count = names.len();
        let deviation = |j: usize| covariance.as_ref().and_then(|found| found.standard_deviations[j]);
        let complete = covariance.as_ref().is_some_and(|found| found.undetermined.is_empty()) && count > 0;
        let singular_values = analysis.as_ref().map_or_else(Vec::new, |found| found.singular_values.clone());
        let mean_log = singular_values.iter().map(|value| value.ln()).sum::<f64>() / count.max(1) as f64;
        let variance = (0..count).map(|j| deviation(j).map_or(f64::NAN, |d| (d / self.scale[j]).powi(2))).sum::<f64>();
        let criteria = study.criteria.iter().zip(&self.criteria).map(|(criterion, gradient)| ExpectedCriterion {
            name: criterion.name.clone(),
            unit: criterion.unit.symbol.clone(),
            standard_deviation: covariance
                .as_ref()
                .and_then(|found| found.variance_of(gradient, &self.scale))
                .map(|variance| criterion.unit.difference_from_si(variance.sqrt())),
        });
        Outcome {
            parameters: study
                .parameters
                .iter()
                .enumerate()
                .map(|(j, parameter)| Expected {
                    name: parameter.name.clone(),
                    unit: parameter.unit.symbol.clone(),
                    value: parameter.unit.from_si(self.options.theta[j]),
                    standard_deviation: deviation(j).map(|d| parameter.unit.difference_from_si(d)),
                    identifiability: analysis.as_ref().map_or(0.0, |found| found.measures[j]),
                })
                .collect(),
            undetermined: analysis.map_or_else(Vec::new, |found| {
                found.undetermined.into_iter().map(|direction| direction.description).collect()
            }),
            d_measure: complete.then(|| (-mean_log).exp()),
            a_measure: complete.then(|| (variance / count as f64).sqrt()),
            singular_values,
            criteria: criteria.collect(),
        }
    }

    /// Parameters that even all tests together hardly determine, and what holding them would do for the others.
    fn fix(&self, together: &Outcome, information: &[f64]) -> Vec<String> {
        let mut lines: Vec<String> = together
            .undetermined
            .iter()
            .map(|direction| format!("{direction}: give one of them a value, or measure it otherwise"))
            .collect();
        for (j, declared) in self.compiled.study.parameters.iter().enumerate() {
            let Some(deviation) = together.parameters[j].standard_deviation else { continue };
            let share = deviation / declared.unit.difference_from_si(declared.scale());
            if share > HARDLY_DETERMINED {
                let percent = crate::quantities::format_number(100.0 * share, 2);
                let helped = self.helped(j, together, information).unwrap_or_default();
                lines.push(format!("{}: its deviation would be {percent} % of its bounds{helped}", declared.name));
            }
        }
        lines
    }

    /// The parameter that gains most when parameter `held` has a value.
    fn helped(&self, held: usize, together: &Outcome, information: &[f64]) -> Option<String> {
        let count = self.scale.len();
        let mut known = information.to_vec();
        let largest = (0..count).map(|j| information[j * count + j]).fold(1.0, f64::max);
        known[held * count + held] += HELD * largest;
        let covariance = self.covariance(&known)?;
        let gain = |j: usize| {
            let before = together.parameters[j].standard_deviation?;
            let unit = &self.compiled.study.parameters[j].unit;
            let after = unit.difference_from_si(covariance.standard_deviations[j]?);
            (before > 0.0 && j != held).then_some((j, after / before))
        };
        let (j, ratio) = (0..count).filter_map(gain).min_by(|a, b| a.1.total_cmp(&b.1))?;
        let percent = crate::quantities::format_number(100.0 * (1.0 - ratio), 2);
        let name = &self.compiled.study.parameters[j].name;
        (ratio < NOTABLY).then(|| format!("; with a value for it the deviation of {name} falls by {percent} %"))
    }
}

/// Something whose accuracy is wanted: a linear function of the parameters.
struct Demanded {
    name: String,
    unit: String,
    /// Half-width of the interval, SI, and as shown.
    wanted: f64,
    shown: f64,
    quantile: f64,
    gradient: Vec<f64>,
}

fn best(excitations: &[Excitation]) -> Vec<Best> {
    let winner = |measure: &str, value: &dyn Fn(&Outcome) -> Option<f64>| {
        let known = excitations.iter().filter_map(|e| Some((value(&e.outcome)?, e)));
        let winner = known.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, excitation)| excitation.name.clone());
        Best { measure: measure.to_owned(), excitation: winner }
    };
    let mut best = vec![winner("D", &|outcome| outcome.d_measure), winner("A", &|outcome| outcome.a_measure)];
    let criteria = excitations.first().map_or(&[][..], |excitation| &excitation.outcome.criteria);
    for (k, criterion) in criteria.iter().enumerate() {
        best.push(winner(&criterion.name, &|outcome| outcome.criteria[k].standard_deviation));
    }
    best
}

fn add(sum: &mut [f64], term: &[f64]) {
    sum.iter_mut().zip(term).for_each(|(a, b)| *a += b);
}

fn add_square(sum: &mut [f64], row: &[f64], factor: f64) {
    let count = row.len();
    for j in 0..count {
        for i in 0..count {
            sum[j * count + i] += factor * row[i] * row[j];
        }
    }
}

fn add_gram(sum: &mut [f64], columns: &[Vec<f64>], range: std::ops::Range<usize>) {
    let count = columns.len();
    for j in 0..count {
        for i in 0..count {
            let pairs = columns[i][range.clone()].iter().zip(&columns[j][range.clone()]);
            sum[j * count + i] += pairs.map(|(a, b)| a * b).sum::<f64>();
        }
    }
}

fn deviation(channel: &[f64]) -> f64 {
    let mean = channel.iter().sum::<f64>() / channel.len().max(1) as f64;
    (channel.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / channel.len().max(1) as f64).sqrt()
}

/// Frequency below which nearly all power of a column lies, Hz.
fn band_end(column: &[f64], rate: f64) -> f64 {
    let spectrum = welch(column, rate, (column.len() / 2).max(8));
    let total: f64 = spectrum.density.iter().sum();
    let mut sum = 0.0;
    for (frequency, density) in spectrum.frequencies.iter().zip(&spectrum.density) {
        sum += density;
        if sum >= BAND_SHARE * total {
            return *frequency;
        }
    }
    0.5 * rate
}
