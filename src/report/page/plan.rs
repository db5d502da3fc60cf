//! What tests would tell, as a page.

use crate::analyse::{Excitation, Outcome, Plan};
use crate::report::chart::{Bar, Style, bars};
use crate::report::{number, words};
use serde::Serialize;

const BAR_WIDTH: f64 = 260.0;

#[derive(Serialize)]
pub struct PlanPage {
    title: String,
    study: String,
    best: Vec<String>,
    combinations: Vec<CombinationView>,
    combination_note: &'static str,
    excitations: Vec<ExcitationView>,
    fix: Vec<String>,
    remarks: Vec<String>,
    accuracy: String,
}

#[derive(Serialize)]
struct ExcitationView {
    name: String,
    title: String,
    duration: String,
    rate: String,
    useful_rate: String,
    enough: String,
    d: String,
    a: String,
    parameters: Vec<ParameterView>,
    undetermined: Vec<String>,
    criteria: Vec<String>,
    needs: Vec<NeedView>,
    sensors: Vec<SensorView>,
}

#[derive(Serialize)]
struct CombinationView {
    measure: String,
    excitations: String,
    sensors: String,
    value: String,
    everything: String,
}

#[derive(Serialize)]
struct NeedView {
    name: String,
    unit: String,
    wanted: String,
    duration: String,
    repetitions: String,
    rate: String,
}

#[derive(Serialize)]
struct ParameterView {
    name: String,
    unit: String,
    value: String,
    deviation: String,
    relative: String,
    bars_svg: String,
}

#[derive(Serialize)]
struct SensorView {
    name: String,
    alone: String,
    without: String,
}

pub fn view(plan: &Plan) -> PlanPage {
    let best = plan.best.iter().map(|best| {
        let excitation = best.excitation.as_deref().unwrap_or("none determines it");
        match best.measure.as_str() {
            "D" => format!("Smallest confidence ellipsoid of all parameters (D): {excitation}"),
            "A" => format!("Smallest mean variance of the parameters (A): {excitation}"),
            criterion => format!("Best known criterion {criterion}: {excitation}"),
        }
    });
    PlanPage {
        title: "What tests would tell".to_owned(),
        study: format!("{}, variant {}", plan.study, plan.variant),
        best: best.collect(),
        combinations: combinations(plan),
        combination_note: words::combination_note(plan),
        excitations: plan.excitations.iter().map(excitation).collect(),
        fix: plan.fix.clone(),
        remarks: plan.remarks.clone(),
        accuracy: number::short(plan.accuracy, 3),
    }
}

/// Each measure is named once, before its first line.
fn combinations(plan: &Plan) -> Vec<CombinationView> {
    let mut before = "";
    plan.combinations
        .iter()
        .map(|choice| {
            let (value, everything) = words::combination_values(plan, choice);
            let measure = if choice.measure == before { String::new() } else { choice.measure.clone() };
            before = &choice.measure;
            let (excitations, sensors) = (choice.excitations.join(", "), choice.sensors.join(", "));
            CombinationView { measure, excitations, sensors, value, everything }
        })
        .collect()
}

fn share(value: Option<f64>) -> String {
    value.map_or_else(|| "undetermined".to_owned(), |value| format!("{} %", number::significant(100.0 * value, 3)))
}

fn excitation(excitation: &Excitation) -> ExcitationView {
    let outcome = &excitation.outcome;
    ExcitationView {
        name: excitation.name.clone(),
        title: excitation.title.clone(),
        duration: number::short(excitation.duration, 4),
        rate: number::short(excitation.rate, 4),
        useful_rate: number::significant(excitation.useful_rate, 2),
        enough: match (excitation.sufficient_duration, excitation.repetitions) {
            (Some(until), _) => format!("after {} s", number::significant(until, 2)),
            (None, Some(times)) => format!("{} repetitions", number::fixed(times, 0)),
            (None, None) => "never".to_owned(),
        },
        d: share(outcome.d_measure),
        a: share(outcome.a_measure),
        parameters: parameters(outcome),
        undetermined: outcome.undetermined.clone(),
        criteria: outcome
            .criteria
            .iter()
            .map(|criterion| match criterion.standard_deviation {
                Some(deviation) => {
                    format!("{}: deviation {} {}", criterion.name, number::significant(deviation, 3), criterion.unit)
                }
                None => format!("{}: depends on what is not determined", criterion.name),
            })
            .collect(),
        needs: excitation
            .needs
            .iter()
            .map(|need| NeedView {
                name: need.name.clone(),
                unit: need.unit.clone(),
                wanted: number::significant(need.wanted, 3),
                duration: need
                    .duration
                    .map_or("not at all".to_owned(), |time| format!("{} s", number::significant(time, 2))),
                repetitions: need.repetitions.map_or("never".to_owned(), words::repetitions),
                rate: need.rate.map_or(String::new(), |rate| number::significant(rate, 2)),
            })
            .collect(),
        sensors: excitation
            .sensors
            .iter()
            .map(|sensor| SensorView {
                name: sensor.name.clone(),
                alone: share(sensor.alone),
                without: share(sensor.without),
            })
            .collect(),
    }
}

/// Bars: identifiability and relative deviation, both as square roots, so that small ones show. The second is full at
/// 100 % of the value; what is undetermined has none.
fn parameters(outcome: &Outcome) -> Vec<ParameterView> {
    let relative = |k: usize| {
        let parameter = &outcome.parameters[k];
        let deviation = parameter.standard_deviation.filter(|_| parameter.value != 0.0)?;
        Some(deviation / parameter.value.abs())
    };
    outcome
        .parameters
        .iter()
        .enumerate()
        .map(|(k, parameter)| ParameterView {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            value: number::short(parameter.value, 5),
            deviation: parameter
                .standard_deviation
                .map_or("undetermined".to_owned(), |value| number::significant(value, 3)),
            relative: relative(k).map_or(String::new(), |value| number::percent(100.0 * value)),
            bars_svg: bars(
                &[
                    Bar { value: parameter.identifiability.sqrt(), style: Style::After },
                    Bar { value: relative(k).map_or(0.0, f64::sqrt), style: Style::Before },
                ],
                1.0,
                BAR_WIDTH,
            ),
        })
        .collect()
}
