//! Typical magnitudes at the places of a study, from the base model's own simulation.

use crate::identify::resolution;
use crate::simulation::{Compiled, Record, Trajectory, probe};
use crate::study::{Place, PlaceKind, PlaceQuantity, Study};

/// Root mean squares at one place.
#[derive(Clone, Debug, Default)]
pub(super) struct Typical {
    quantities: Vec<(PlaceQuantity, f64)>,
    /// Of a sensor: the step to whose multiples its values are rounded.
    pub resolution: Option<f64>,
}

impl Typical {
    /// The magnitude, where the place has the quantity and it ever differs from zero.
    pub(super) fn of(&self, quantity: PlaceQuantity) -> Option<f64> {
        if quantity == PlaceQuantity::Time {
            let coordinate = self.of(PlaceQuantity::Coordinate)?;
            return Some(coordinate / self.of(PlaceQuantity::Rate)?);
        }
        self.quantities.iter().find(|(q, _)| *q == quantity).map(|&(_, value)| value).filter(|value| *value > 0.0)
    }
}

/// One entry per place of the study, from the probes along the model's answers to `records`.
pub(super) fn typical(compiled: &Compiled, records: &[&Record], theta: &[f64]) -> Vec<Typical> {
    let trajectories: Vec<Trajectory> =
        records.iter().filter_map(|record| probe(compiled, record, theta).ok()).collect();
    let mut probe = 0;
    compiled
        .study
        .places
        .iter()
        .map(|place| {
            let quantities = place
                .probes
                .iter()
                .map(|&(quantity, _)| {
                    let magnitude = root_mean_square(trajectories.iter().flat_map(|t| &t.probes[probe]));
                    probe += 1;
                    (quantity, magnitude)
                })
                .collect();
            Typical { quantities, resolution: steps(&compiled.study, place, records) }
        })
        .collect()
}

/// As the study states them or the records show them.
fn steps(study: &Study, place: &Place, records: &[&Record]) -> Option<f64> {
    if place.kind != PlaceKind::Measure {
        return None;
    }
    let measure = study.measures.iter().position(|measure| measure.name == place.name)?;
    let seen = records.iter().filter_map(|record| {
        let position = record.measures.iter().position(|&index| index == measure)?;
        resolution(&record.measured[position])
    });
    study.measures[measure].quantisation.into_iter().chain(seen).max_by(f64::total_cmp)
}

fn root_mean_square<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value * value;
        count += 1;
    }
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}
