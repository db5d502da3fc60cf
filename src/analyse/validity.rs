//! Is the identified model valid for a criterion? (method 8)

use super::criterion::{evaluate_on, manoeuvres};
use super::increments::relevances;
use super::monte_carlo::{Draws, MonteCarlo, draw};
use crate::identify::{Confidence, Fitted};
use crate::simulation::{Compiled, Gradient};
use crate::statistics::{covariance_root, student_quantile};
use crate::study::{Criterion, Parameter};
use schemars::JsonSchema;
use serde::Serialize;

/// A criterion depends on an undetermined direction when its gradient (per scaled parameter) has more than this share
/// along it. The gradient's error is some hundred times smaller.
const ORTHOGONALITY: f64 = 1e-3;
/// Failed draws beyond this share make the sampled interval meaningless.
const FAILED_SHARE: f64 = 0.05;

/// Verdicts on all criteria of a study, in the units it wrote.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Validity {
    pub study: String,
    pub variant: String,
    pub criteria: Vec<CriterionValidity>,
    /// Parameter vectors drawn per criterion, and the seed.
    pub samples: usize,
    pub seed: u64,
    pub remarks: Vec<String>,
}

/// Whether the model may be used for a criterion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The criterion is known well enough to decide about the demand.
    Valid,
    /// It depends on what the data do not determine, or its interval is wider than allowed.
    NotValid,
    /// The interval contains the limit, or the manoeuvre cannot be simulated.
    CannotBeJudged,
}

/// What becomes of the demand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Demand {
    Met,
    Violated,
    Open,
    /// The study states no limit.
    NotStated,
}

/// One criterion. Values are in `unit`.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct CriterionValidity {
    pub name: String,
    pub title: String,
    pub unit: String,
    pub manoeuvre: String,
    /// As written: `max`, `min`, `rms`, `mean` or `final`.
    pub statistic: String,
    /// At the estimate; absent where the manoeuvre cannot be simulated.
    pub value: Option<f64>,
    pub below: Option<f64>,
    pub above: Option<f64>,
    /// Largest half-width of the interval that is acceptable.
    pub within: Option<f64>,
    /// Confidence that is demanded, 0 to 1; the level of all intervals here.
    pub confidence: f64,
    pub by_gradient: Option<Spread>,
    pub by_increments: Option<Spread>,
    pub by_monte_carlo: Option<Spread>,
    /// What the parameters contribute, largest first.
    pub relevances: Vec<Relevance>,
    /// One test per direction that the data do not determine.
    pub orthogonality: Vec<Orthogonality>,
    pub verdict: Verdict,
    pub demand: Demand,
    pub reason: String,
}

/// Standard deviation of a criterion and its confidence interval.
#[derive(Clone, Copy, Debug, JsonSchema, PartialEq, Serialize)]
pub struct Spread {
    pub standard_deviation: f64,
    pub interval: (f64, f64),
}

/// How a criterion depends on a parameter.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Relevance {
    pub parameter: String,
    /// Change of the criterion over the whole range of the parameter's bounds, linearly.
    pub over_bounds: f64,
    /// Change per standard deviation of the estimate by the gradient, and by a wide increment.
    pub per_deviation: Option<f64>,
    pub per_deviation_wide: Option<f64>,
}

/// The test against one direction of infinite variance (method 4.20).
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Orthogonality {
    /// The direction in words.
    pub direction: String,
    /// Share of the criterion's gradient that lies along it, 0 to 1.
    pub share: f64,
    pub orthogonal: bool,
}

/// Judges every criterion of the study at the fitted parameters.
pub fn validity(compiled: &Compiled, fitted: &Fitted, confidence: &Confidence, options: MonteCarlo) -> Validity {
    let study = &compiled.study;
    let records = manoeuvres(study);
    let mut validity = Validity {
        study: study.name.clone(),
        variant: study.variant.clone(),
        criteria: Vec::new(),
        samples: options.samples,
        seed: options.seed,
        remarks: remarks(compiled, fitted),
    };
    let values = match evaluate_on(compiled, &records, &fitted.theta, Gradient::AllParameters) {
        Ok(values) => values,
        Err(failure) => {
            let reason = format!("a manoeuvre cannot be simulated with the estimate: {failure}; {}", failure.help)
                .replace("experiment ", "manoeuvre ");
            validity.criteria = study.criteria.iter().map(|c| without_value(compiled, c, reason.clone())).collect();
            return validity;
        }
    };
    let count = fitted.theta.len();
    let spread: Vec<Option<f64>> = (0..count).map(|j| confidence.standard_deviation(j)).collect();
    let wide = relevances(compiled, &records, &fitted.theta, &spread);
    let scale: Vec<f64> = study.parameters.iter().map(Parameter::scale).collect();
    let root = covariance_root(&confidence.covariance, &scale).unwrap_or_default();
    let draws = if root.len() == count * count && options.samples > 0 {
        draw(compiled, &records, &fitted.theta, &root, options)
    } else {
        Draws { values: Vec::new(), failed: 0, cut: 0 }
    };
    if draws.cut > 0 {
        validity
            .remarks
            .push(format!("in {} of {} draws a parameter was cut at its bound", draws.cut, options.samples));
    }
    if draws.failed > 0 {
        validity
            .remarks
            .push(format!("{} of {} drawn manoeuvres could not be simulated", draws.failed, options.samples));
    }
    let judge = Judge { compiled, confidence, scale, wide, draws };
    validity.criteria = (0..study.criteria.len())
        .map(|index| judge.criterion(index, values.values[index], &values.gradients[index]))
        .collect();
    validity
}

fn remarks(compiled: &Compiled, fitted: &Fitted) -> Vec<String> {
    let mut remarks = vec![
        "intervals tell what the parameters' uncertainty does to a criterion; an error of the model's structure is not in them"
            .to_owned(),
    ];
    for (parameter, _) in compiled.study.parameters.iter().zip(&fitted.at_bound).filter(|(_, at_bound)| **at_bound) {
        remarks.push(format!("{} is at its bound: a sign of a structural error", parameter.name));
    }
    remarks
}

/// Everything but the outcome.
fn frame(compiled: &Compiled, criterion: &Criterion) -> CriterionValidity {
    let unit = &criterion.unit;
    CriterionValidity {
        name: criterion.name.clone(),
        title: criterion.title.clone(),
        unit: unit.symbol.clone(),
        manoeuvre: compiled.study.manoeuvres[criterion.manoeuvre].name.clone(),
        statistic: criterion.statistic.name().to_owned(),
        value: None,
        below: criterion.below.map(|bound| unit.from_si(bound)),
        above: criterion.above.map(|bound| unit.from_si(bound)),
        within: criterion.within.map(|width| unit.difference_from_si(width)),
        confidence: criterion.confidence,
        by_gradient: None,
        by_increments: None,
        by_monte_carlo: None,
        relevances: Vec::new(),
        orthogonality: Vec::new(),
        verdict: Verdict::CannotBeJudged,
        demand: Demand::Open,
        reason: String::new(),
    }
}

fn without_value(compiled: &Compiled, criterion: &Criterion, reason: String) -> CriterionValidity {
    CriterionValidity { reason, ..frame(compiled, criterion) }
}

struct Judge<'a> {
    compiled: &'a Compiled,
    confidence: &'a Confidence,
    scale: Vec<f64>,
    wide: Vec<Option<Vec<f64>>>,
    draws: Draws,
}

impl Judge<'_> {
    fn criterion(&self, index: usize, value: f64, gradient: &[f64]) -> CriterionValidity {
        let criterion = &self.compiled.study.criteria[index];
        let mut result = frame(self.compiled, criterion);
        let unit = &criterion.unit;
        result.value = Some(unit.from_si(value));
        let factor = student_quantile(0.5 + 0.5 * criterion.confidence, self.confidence.freedom_along(gradient));
        let symmetric = |deviation: f64| Spread {
            standard_deviation: unit.difference_from_si(deviation),
            interval: (unit.from_si(value - factor * deviation), unit.from_si(value + factor * deviation)),
        };
        result.orthogonality = self.orthogonality(gradient);
        result.relevances = self.relevances(index, gradient);
        if result.orthogonality.iter().all(|test| test.orthogonal) {
            result.by_gradient = self.linear_deviation(gradient).map(symmetric);
            let wide: Option<Vec<f64>> =
                self.wide.iter().zip(gradient).map(|(found, slope)| self.wide_slope(found, index, *slope)).collect();
            result.by_increments = wide.and_then(|slopes| self.linear_deviation(&slopes)).map(symmetric);
            result.by_monte_carlo = self.sampled(index, criterion);
        }
        self.judge(&mut result);
        result
    }

    /// A parameter that the data do not determine has no spread to move by; its derivative stands for it, which the
    /// orthogonality test needs anyway.
    fn wide_slope(&self, found: &Option<Vec<f64>>, index: usize, slope: f64) -> Option<f64> {
        match found {
            Some(slopes) => slopes.get(index).copied().filter(|value| value.is_finite()),
            None => Some(slope),
        }
    }

    /// sqrt(R^T Cov R) (method 4.19).
    fn linear_deviation(&self, slopes: &[f64]) -> Option<f64> {
        let (covariance, count) = (&self.confidence.covariance, slopes.len());
        if covariance.len() != count * count {
            return None;
        }
        let pairs = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
        let variance: f64 = pairs.map(|(i, j)| slopes[i] * covariance[j * count + i] * slopes[j]).sum();
        variance.is_finite().then(|| variance.max(0.0).sqrt())
    }

    fn sampled(&self, index: usize, criterion: &Criterion) -> Option<Spread> {
        let mut values: Vec<f64> = self.draws.values.iter().map(|values| values[index]).collect();
        let asked = values.len() + self.draws.failed;
        if values.len() < 20 || self.draws.failed as f64 > FAILED_SHARE * asked as f64 {
            return None;
        }
        values.sort_by(f64::total_cmp);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
        let tail = 0.5 * (1.0 - criterion.confidence);
        let unit = &criterion.unit;
        Some(Spread {
            standard_deviation: unit.difference_from_si(variance.sqrt()),
            interval: (unit.from_si(quantile(&values, tail)), unit.from_si(quantile(&values, 1.0 - tail))),
        })
    }

    fn orthogonality(&self, gradient: &[f64]) -> Vec<Orthogonality> {
        let scaled: Vec<f64> = gradient.iter().zip(&self.scale).map(|(slope, width)| slope * width).collect();
        let length = scaled.iter().map(|value| value * value).sum::<f64>().sqrt();
        self.confidence
            .directions
            .iter()
            .enumerate()
            .map(|(k, direction)| {
                let along: f64 = direction.iter().zip(&scaled).map(|(v, r)| v * r).sum();
                let share = if length > 0.0 { (along / length).abs() } else { 0.0 };
                let words = match self.confidence.undetermined.as_slice() {
                    [] => "a direction that the data do not determine".to_owned(),
                    [only] => only.clone(),
                    several => several.get(k).cloned().unwrap_or_else(|| several.join("; ")),
                };
                Orthogonality { direction: words, share, orthogonal: share <= ORTHOGONALITY }
            })
            .collect()
    }

    fn relevances(&self, index: usize, gradient: &[f64]) -> Vec<Relevance> {
        let unit = &self.compiled.study.criteria[index].unit;
        let mut relevances: Vec<Relevance> = self
            .compiled
            .study
            .parameters
            .iter()
            .enumerate()
            .map(|(j, parameter)| {
                let deviation = self.confidence.standard_deviation(j);
                let shown = |slope: f64| deviation.map(|spread| unit.difference_from_si(slope * spread));
                Relevance {
                    parameter: parameter.name.clone(),
                    over_bounds: unit.difference_from_si(gradient[j] * self.scale[j]),
                    per_deviation: shown(gradient[j]),
                    per_deviation_wide: self.wide[j].as_ref().and_then(|slopes| shown(slopes[index])),
                }
            })
            .collect();
        relevances.sort_by(|a, b| b.over_bounds.abs().total_cmp(&a.over_bounds.abs()));
        relevances
    }

    fn judge(&self, result: &mut CriterionValidity) {
        let touched: Vec<&str> =
            result.orthogonality.iter().filter(|test| !test.orthogonal).map(|test| test.direction.as_str()).collect();
        if !touched.is_empty() {
            result.verdict = Verdict::NotValid;
            result.reason = format!("it depends on what the data do not determine: {}", touched.join("; "));
            return;
        }
        let spreads = [result.by_gradient, result.by_increments, result.by_monte_carlo];
        let Some((low, high)) = hull(&spreads) else {
            result.reason = "no interval could be computed for it".to_owned();
            return;
        };
        let level = format!("{} % confidence", crate::quantities::format_number(100.0 * result.confidence, 4));
        let show = |value: f64| format!("{} {}", crate::quantities::format_number(value, 4), result.unit);
        let half_width = 0.5 * (high - low);
        if let Some(allowed) = result.within
            && half_width > allowed
        {
            result.verdict = Verdict::NotValid;
            result.reason = format!("known to +- {} at {level}, {} is allowed", show(half_width), show(allowed));
            return;
        }
        let interval = format!("{} .. {} at {level}", show(low), show(high));
        let limits: Vec<(f64, bool, String)> = [(result.below, true, "below"), (result.above, false, "above")]
            .into_iter()
            .filter_map(|(limit, upper, word)| limit.map(|limit| (limit, upper, format!("{word} {}", show(limit)))))
            .collect();
        let violated = limits.iter().find(|(limit, upper, _)| if *upper { low >= *limit } else { high <= *limit });
        let open = limits.iter().find(|(limit, upper, _)| if *upper { high >= *limit } else { low <= *limit });
        (result.verdict, result.demand, result.reason) = match (violated, open) {
            (Some((.., words)), _) => {
                (Verdict::Valid, Demand::Violated, format!("{interval}: the demand `{words}` is violated"))
            }
            (None, Some((.., words))) => {
                let reason =
                    format!("{interval} contains the limit of `{words}`: the parameters are not known well enough");
                (Verdict::CannotBeJudged, Demand::Open, reason)
            }
            (None, None) if limits.is_empty() && result.within.is_none() => {
                (Verdict::Valid, Demand::NotStated, format!("{interval}; the study states no limit"))
            }
            (None, None) => {
                let mut words: Vec<String> = limits.into_iter().map(|(.., words)| format!("`{words}`")).collect();
                words.extend(result.within.map(|allowed| format!("`within {}`", show(allowed))));
                (Verdict::Valid, Demand::Met, format!("{interval}: {} is met", words.join(" and ")))
            }
        };
    }
}

/// The smallest interval that contains all: the three ways must agree that a demand is met.
fn hull(spreads: &[Option<Spread>]) -> Option<(f64, f64)> {
    let known = || spreads.iter().flatten();
    let low = known().map(|spread| spread.interval.0).reduce(f64::min)?;
    let high = known().map(|spread| spread.interval.1).reduce(f64::max)?;
    (low.is_finite() && high.is_finite()).then_some((low, high))
}

/// Linear interpolation between order statistics.
fn quantile(sorted: &[f64], probability: f64) -> f64 {
    let place = probability * (sorted.len() - 1) as f64;
    let (low, share) = (place.floor() as usize, place.fract());
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + share * (sorted[high] - sorted[low])
}
