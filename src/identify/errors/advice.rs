//! Which definition of the error a fit used, and why the others do not fit.

use super::super::fitting::Fitted;
use super::super::noise;
use super::equation::unmeasured;
use crate::simulation::{Compiled, Record, stretches_refused};
use crate::study::ErrorDefinition;
use schemars::JsonSchema;
use serde::Serialize;

/// Share of the residual's power that its own past may predict before process noise (or a structural error) is
/// suspected.
const PREDICTED: f64 = 0.2;
/// Growth of the sensitivities over a record from which on a free simulation is doubtful.
const GROWTH: f64 = 20.0;

/// The definition of the error, in words.
#[derive(Clone, Debug, Default, JsonSchema, PartialEq, Serialize)]
pub struct ErrorReport {
    /// `output`, `equation`, `filter`, `shooting`.
    pub used: String,
    pub reason: String,
    pub others: Vec<OtherError>,
    /// Process noise that the filter error found: (state, root of the spectral density of its rate, SI).
    pub process_noise: Vec<(String, f64)>,
}

/// A definition that was not used.
#[derive(Clone, Debug, JsonSchema, PartialEq, Serialize)]
pub struct OtherError {
    pub name: String,
    /// Why it does not fit, or what would speak for it.
    pub why: String,
}

/// What a fit used and why not the others; `records` are those of the fit.
pub fn error_report(compiled: &Compiled, fitted: &Fitted, records: &[&Record]) -> ErrorReport {
    let used = fitted.error;
    let others = ErrorDefinition::ALL.into_iter().filter(|other| *other != used);
    let others =
        others.map(|other| OtherError { name: other.name().to_owned(), why: why(other, compiled, fitted, records) });
    ErrorReport {
        used: used.name().to_owned(),
        reason: reason(used, fitted),
        others: others.collect(),
        process_noise: fitted.process_noise.clone(),
    }
}

fn reason(used: ErrorDefinition, fitted: &Fitted) -> String {
    match used {
        ErrorDefinition::Output => {
            "free simulation from the experiment's start; noise in the measurements only".to_owned()
        }
        ErrorDefinition::Equation => {
            let steps = match &fitted.equation {
                Some(fit) if fit.linear => "the equations are linear in the parameters: one step".to_owned(),
                Some(fit) => format!("the equations are not linear in the parameters: {} steps", fit.steps),
                None => String::new(),
            };
            format!(
                "measured states in the equations of motion; {steps}; noise in the states biases it, and no intervals are given"
            )
        }
        ErrorDefinition::Filter => {
            "one-step predictions of an extended Kalman filter; noise in the process and in the measurements".to_owned()
        }
        ErrorDefinition::Shooting => format!(
            "stretches joined by the fit (largest gap {:.0e} of a state's course), then the output error from there",
            fitted.gap.unwrap_or(0.0)
        ),
    }
}

fn why(other: ErrorDefinition, compiled: &Compiled, fitted: &Fitted, records: &[&Record]) -> String {
    match other {
        ErrorDefinition::Output => match fitted.error {
            ErrorDefinition::Equation => {
                "not asked for: it needs simulations, and is what intervals can be had from".to_owned()
            }
            ErrorDefinition::Filter => "process noise would be taken for noise of the measurements".to_owned(),
            _ => "it ends the fit, from where the stretches are joined".to_owned(),
        },
        ErrorDefinition::Equation => match unmeasured(compiled, records, &fitted.theta) {
            Some(why) => why,
            None => "all states are measured, but noise in them biases it: good for start values (`--start equation`)"
                .to_owned(),
        },
        ErrorDefinition::Filter => match stretches_refused(compiled) {
            Some(why) => why.to_owned(),
            None if fitted.error == ErrorDefinition::Equation => "needs simulations".to_owned(),
            None => process_noise(fitted),
        },
        ErrorDefinition::Shooting => match stretches_refused(compiled) {
            Some(why) => why.to_owned(),
            None => growth(fitted),
        },
    }
}

fn process_noise(fitted: &Fitted) -> String {
    let share = noise::predicted_share(fitted);
    if share < PREDICTED {
        return format!("no sign of process noise: its past predicts {:.0} % of the residual", 100.0 * share);
    }
    format!(
        "its past predicts {:.0} % of the residual: `ident diagnose` for a cause in the model, `--error filter` for process noise",
        100.0 * share
    )
}

fn growth(fitted: &Fitted) -> String {
    let rows = fitted.residual.len().max(1);
    let mut largest = 0.0_f64;
    for block in &fitted.blocks {
        let fifth = block.rows.len() / 5;
        for column in fitted.gradient.chunks_exact(rows) {
            let own = &column[block.rows.clone()];
            let power = |part: &[f64]| part.iter().map(|value| value * value).sum::<f64>() / part.len().max(1) as f64;
            let (early, late) = (power(&own[..2 * fifth]), power(&own[own.len() - fifth..]));
            if early > 0.0 {
                largest = largest.max((late / early).sqrt());
            }
        }
    }
    if largest < GROWTH {
        return format!("not needed: sensitivities grow by a factor of {largest:.1} over the records");
    }
    format!("sensitivities grow by a factor of {largest:.0} over the records: `--error shooting` is less easily caught")
}
