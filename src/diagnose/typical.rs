//! Typical magnitudes at the places of a study, from the base model's own simulation.

use crate::simulation::{Compiled, Trajectory};
use crate::study::PlaceQuantity;

/// Root mean squares at one place.
#[derive(Clone, Debug, Default)]
pub(super) struct Typical {
    quantities: Vec<(PlaceQuantity, f64)>,
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

/// One entry per place of the study, from the probes along `trajectories`.
pub(super) fn typical(compiled: &Compiled, trajectories: &[Trajectory]) -> Vec<Typical> {
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
            Typical { quantities }
        })
        .collect()
}

fn root_mean_square<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value * value;
        count += 1;
    }
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}
