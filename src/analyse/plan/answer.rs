//! What a plan answers, in the study's units.

use super::combinations::Combination;
use schemars::JsonSchema;
use serde::Serialize;

/// The offered excitations (the study's manoeuvres) and sensors (its measures), in the study's units.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Plan {
    pub study: String,
    pub variant: String,
    /// Largest half-width of a 95 % interval that is wanted, %.
    pub accuracy: f64,
    /// One per manoeuvre, with all sensors.
    pub excitations: Vec<Excitation>,
    /// All manoeuvres, one after the other.
    pub together: Outcome,
    /// Best excitation by the volume of the confidence ellipsoid (D), by the mean variance (A), by each criterion.
    pub best: Vec<Best>,
    /// By the same measures: the best choices of tests and sensors, growing, as long as more of them help.
    pub combinations: Vec<Combination>,
    /// Parameters that are better given a value than identified, and why.
    pub fix: Vec<String>,
    pub remarks: Vec<String>,
}

/// The winner by one measure.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Best {
    /// `D`, `A` or the name of a criterion.
    pub measure: String,
    /// Name of the manoeuvre; absent where none determines what is asked.
    pub excitation: Option<String>,
}

/// One manoeuvre as a test.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Excitation {
    pub name: String,
    pub title: String,
    /// s
    pub duration: f64,
    /// Hz
    pub rate: f64,
    pub outcome: Outcome,
    /// Rate that resolves what the parameters do, Hz.
    pub useful_rate: f64,
    /// Duration after which every parameter and criterion is as accurate as wanted, s; absent where the whole manoeuvre
    /// is not enough.
    pub sufficient_duration: Option<f64>,
    /// Repetitions (or factor on the rate, as long as the noise stays white) that make every parameter and criterion as
    /// accurate as wanted; absent where something stays undetermined.
    pub repetitions: Option<f64>,
    /// The same one by one.
    pub needs: Vec<Need>,
    /// What each sensor is worth here, the most valuable first.
    pub sensors: Vec<Sensor>,
}

/// How much of a manoeuvre a wanted accuracy takes.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Need {
    /// Of a parameter, or of a criterion that states `within`.
    pub name: String,
    pub unit: String,
    /// Wanted half-width of the interval: at 95 % for parameters, at its own confidence for a criterion.
    pub wanted: f64,
    /// Duration after which it is as accurate, s; absent where the whole manoeuvre is not enough.
    pub duration: Option<f64>,
    /// Repetitions, or factor on the sampling rate as long as the noise stays white: a fraction where less than the
    /// manoeuvre is enough; absent where it stays undetermined.
    pub repetitions: Option<f64>,
    /// The rate that does it in the manoeuvre's duration, not below the useful one, Hz.
    pub rate: Option<f64>,
}

/// What would be known.
#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Outcome {
    pub parameters: Vec<Expected>,
    /// Of the weighted gradient scaled by the bounds, descending.
    pub singular_values: Vec<f64>,
    pub undetermined: Vec<String>,
    /// Geometric mean of the ellipsoid's half-axes relative to the bounds; absent where a direction is undetermined.
    pub d_measure: Option<f64>,
    /// Root mean square of the deviations relative to the bounds; likewise.
    pub a_measure: Option<f64>,
    pub criteria: Vec<ExpectedCriterion>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Expected {
    pub name: String,
    pub unit: String,
    pub value: f64,
    pub standard_deviation: Option<f64>,
    /// Relative to the best determined parameter, 0 to 1.
    pub identifiability: f64,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct ExpectedCriterion {
    pub name: String,
    pub unit: String,
    /// Absent where it depends on an undetermined direction.
    pub standard_deviation: Option<f64>,
}

#[derive(Clone, Debug, JsonSchema, Serialize)]
pub struct Sensor {
    pub name: String,
    /// D-measure with this sensor alone, and with all others; absent where a direction would be undetermined.
    pub alone: Option<f64>,
    pub without: Option<f64>,
}
