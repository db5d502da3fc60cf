//! A result as a file that other studies of the same parameters read (method 3.17, 3.35).

use super::confidence::Confidence;
use super::fitting::Fitted;
use crate::fit::PriorRow;
use crate::linear::{DecompositionError, SingularValueDecomposition};
use crate::quantities::Unit;
use crate::simulation::Compiled;
use crate::statistics::Information;
use crate::study::Parameter;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name and version of the file's form.
pub const RESULT: &str = "ident.result/1";
/// Eigenvalues of the scaled information below this share of the largest say nothing.
const NOTHING: f64 = 1e-12;
const NOT_FINITE: &str = "its information holds numbers that are not finite";

/// What one identification knows about its parameters.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SavedResult {
    /// `ident.result/1`
    pub schema: String,
    pub study: String,
    pub variant: String,
    /// Names of the records that the result is from: results of the same records are not independent.
    pub records: Vec<String>,
    pub parameters: Vec<SavedParameter>,
    /// Inverse covariance in the parameters' units, rows in their order; zero along directions that were not
    /// determined.
    pub information: Vec<Vec<f64>>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SavedParameter {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// Bounds of the study that wrote it; they scale what counts as determined.
    pub lower: f64,
    pub upper: f64,
}

impl SavedResult {
    /// # Errors
    /// When the covariance holds a number that is not finite.
    pub fn new(
        compiled: &Compiled,
        fitted: &Fitted,
        confidence: &Confidence,
        records: Vec<String>,
    ) -> Result<Self, DecompositionError> {
        let parameters = &compiled.study.parameters;
        let scale: Vec<f64> = parameters.iter().map(Parameter::scale).collect();
        let information =
            Information::from_covariance(&fitted.theta, &confidence.covariance, &confidence.directions, &scale)?.matrix;
        let count = parameters.len();
        let per_unit = |j: usize| parameters[j].unit.difference_to_si(1.0);
        Ok(Self {
            schema: RESULT.to_owned(),
            study: compiled.study.name.clone(),
            variant: compiled.study.variant.clone(),
            records,
            parameters: parameters
                .iter()
                .zip(&fitted.theta)
                .map(|(parameter, value)| SavedParameter {
                    name: parameter.name.clone(),
                    unit: parameter.unit.symbol.clone(),
                    value: parameter.unit.from_si(*value),
                    lower: parameter.unit.from_si(parameter.lower),
                    upper: parameter.unit.from_si(parameter.upper),
                })
                .collect(),
            information: (0..count)
                .map(|i| (0..count).map(|j| information[j * count + i] * per_unit(i) * per_unit(j)).collect())
                .collect(),
        })
    }

    /// The result as rows of prior knowledge about a study's parameters. Parameters that the study does not have are
    /// eliminated (what is known about the others without them stays).
    ///
    /// # Errors
    /// In words: a file of another form, a unit of another kind, nothing in common.
    pub fn rows(&self, parameters: &[Parameter]) -> Result<Vec<PriorRow>, String> {
        let count = self.parameters.len();
        if self.schema != RESULT {
            return Err(format!("it is `{}`, not `{RESULT}`", self.schema));
        }
        if self.information.len() != count || self.information.iter().any(|row| row.len() != count) {
            return Err(format!("its information is not a matrix of {count} x {count}"));
        }
        let mut targets = Vec::new();
        let (mut values, mut units, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        for saved in &self.parameters {
            let unit = Unit::parse(&saved.unit).map_err(|_| format!("`{}` is no unit", saved.unit))?;
            let target = parameters.iter().position(|parameter| parameter.name == saved.name);
            if let Some(index) = target
                && parameters[index].unit.dimension != unit.dimension
            {
                let own = &parameters[index].unit.symbol;
                return Err(format!("{} is in {} there and in {own} here", saved.name, saved.unit));
            }
            targets.push(target);
            values.push(unit.to_si(saved.value));
            units.push(unit.difference_to_si(1.0));
            let width = unit.to_si(saved.upper) - unit.to_si(saved.lower);
            scales.push(if width.is_finite() && width > 0.0 { width } else { 1.0 });
        }
        if targets.iter().all(Option::is_none) {
            return Err("it has no parameter in common with this study".to_owned());
        }
        // Scaled to the bounds, SI.
        let factor: Vec<f64> = scales.iter().zip(&units).map(|(scale, unit)| scale / unit).collect();
        let scaled: Vec<f64> = (0..count * count)
            .map(|k| self.information[k % count][k / count] * factor[k % count] * factor[k / count])
            .collect();
        let kept: Vec<usize> = (0..count).filter(|&i| targets[i].is_some()).collect();
        let marginal = without(&scaled, count, &kept).map_err(|_| NOT_FINITE.to_owned())?;
        let decomposition =
            SingularValueDecomposition::new(kept.len(), kept.len(), &marginal).map_err(|_| NOT_FINITE.to_owned())?;
        let largest = decomposition.singular_values.first().copied().unwrap_or(0.0);
        let known = decomposition.singular_values.iter().enumerate().filter(|(_, value)| **value > NOTHING * largest);
        Ok(known
            .map(|(k, value)| {
                let entries = decomposition.right(k).iter().zip(&kept);
                let weights: Vec<(usize, f64)> =
                    entries.filter_map(|(entry, &i)| Some((targets[i]?, value.sqrt() * entry / scales[i]))).collect();
                let at = kept.iter().map(|&i| values[i]);
                let target = weights.iter().zip(at).map(|((_, weight), value)| weight * value).sum();
                PriorRow { weights, target, linearised: true, variance: 1.0 }
            })
            .collect())
    }
}

/// Information of some parameters when nothing else is known about the rest: `A - B D^+ B^T`.
fn without(matrix: &[f64], count: usize, kept: &[usize]) -> Result<Vec<f64>, DecompositionError> {
    let rest: Vec<usize> = (0..count).filter(|i| !kept.contains(i)).collect();
    let part = |rows: &[usize], columns: &[usize]| -> Vec<f64> {
        columns.iter().flat_map(|&j| rows.iter().map(move |&i| matrix[j * count + i])).collect()
    };
    let mut own = part(kept, kept);
    if rest.is_empty() {
        return Ok(own);
    }
    let (coupling, size) = (part(kept, &rest), kept.len());
    let decomposition = SingularValueDecomposition::new(rest.len(), rest.len(), &part(&rest, &rest))?;
    let largest = decomposition.singular_values.first().copied().unwrap_or(0.0);
    for (k, value) in decomposition.singular_values.iter().enumerate().filter(|(_, value)| **value > NOTHING * largest)
    {
        let along: Vec<f64> = (0..size)
            .map(|i| decomposition.right(k).iter().enumerate().map(|(r, entry)| coupling[r * size + i] * entry).sum())
            .collect();
        for j in 0..size {
            for i in 0..size {
                own[j * size + i] -= along[i] * along[j] / value;
            }
        }
    }
    Ok(own)
}
