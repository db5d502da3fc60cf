//! Cost per channel and down the tree of groups (method 9); weights.

use crate::signal::Prefilter;
use crate::study::Group;

/// Cost of a channel and of the model "this channel is its mean", under the same weight and filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChannelCost {
    /// `weight^2 |F (measured - simulated)|^2`
    pub cost: f64,
    /// `weight^2 |F (measured - mean)|^2`
    pub reference: f64,
}

impl ChannelCost {
    /// Of one channel in one record; both slices of equal length, `weight` in 1/unit of the samples.
    pub fn new(measured: &[f64], simulated: &[f64], weight: f64, filter: &Prefilter) -> Self {
        let error: Vec<f64> = measured.iter().zip(simulated).map(|(y, model)| y - model).collect();
        let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
        let deviation: Vec<f64> = measured.iter().map(|y| y - mean).collect();
        let weighted = |mut column: Vec<f64>| {
            filter.apply(&mut column);
            weight * weight * column.iter().map(|value| value * value).sum::<f64>()
        };
        Self { cost: weighted(error), reference: weighted(deviation) }
    }

    /// Discrepancy index in %: 0 is perfect, 100 no better than a constant. Infinite for a wrong model of a constant
    /// channel.
    pub fn discrepancy(&self) -> f64 {
        if self.cost == 0.0 { 0.0 } else { 100.0 * self.cost / self.reference }
    }
}

impl std::ops::Add for ChannelCost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { cost: self.cost + other.cost, reference: self.reference + other.reference }
    }
}

impl std::iter::Sum for ChannelCost {
    fn sum<I: Iterator<Item = Self>>(costs: I) -> Self {
        costs.fold(Self::default(), |sum, cost| sum + cost)
    }
}

/// Costs down the tree of groups; channels are the leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct CostTree {
    pub name: String,
    pub cost: ChannelCost,
    pub children: Vec<CostTree>,
}

impl CostTree {
    /// `costs` and `names` per channel (the indices in the groups); `None` for channels that are not compared. Groups
    /// without compared channels are left out.
    pub fn new(group: &Group, names: &[&str], costs: &[Option<ChannelCost>]) -> Self {
        let groups =
            group.groups.iter().map(|inner| Self::new(inner, names, costs)).filter(|tree| !tree.children.is_empty());
        let channels = group.channels.iter().filter_map(|&index| {
            let cost = (*costs.get(index)?)?;
            let name = names.get(index).map_or_else(String::new, |name| (*name).to_owned());
            Some(Self { name, cost, children: Vec::new() })
        });
        let children: Vec<Self> = groups.chain(channels).collect();
        let cost = children.iter().map(|child| child.cost).sum();
        Self { name: group.name.clone(), cost, children }
    }
}

/// First weight of a channel: 1 / standard deviation of the measured samples (their order of magnitude, without the
/// mean). `None` for a constant channel.
pub fn magnitude_weight(measured: &[f64]) -> Option<f64> {
    let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
    let variance = measured.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / measured.len().max(1) as f64;
    (variance > 0.0 && variance.is_finite()).then(|| 1.0 / variance.sqrt())
}

/// Weight by the standard deviation of the noise. `None` unless it is positive and finite.
pub fn noise_weight(standard_deviation: f64) -> Option<f64> {
    (standard_deviation > 0.0 && standard_deviation.is_finite()).then(|| 1.0 / standard_deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(name: &str, groups: Vec<Group>, channels: Vec<usize>) -> Group {
        Group { name: name.to_owned(), groups, channels }
    }

    #[test]
    fn discrepancy_adds_up_the_tree() {
        let filter = Prefilter::identity();
        let measured = [1.0, 2.0, 3.0, 6.0];
        let half = [2.0, 2.5, 3.0, 4.5];
        let constant = [3.0; 4];
        let costs = [
            Some(ChannelCost::new(&measured, &measured, 1.0, &filter)),
            Some(ChannelCost::new(&measured, &half, 2.0, &filter)),
            Some(ChannelCost::new(&measured, &constant, 1.0, &filter)),
            None,
        ];
        let indices: Vec<f64> = costs.iter().flatten().map(ChannelCost::discrepancy).collect();
        assert_eq!(indices, [0.0, 25.0, 100.0]);
        let forces = group("force", vec![], vec![1, 2]);
        let idle = group("acceleration", vec![], vec![3]);
        let tree = CostTree::new(&group("total", vec![forces, idle], vec![0]), &["a", "b", "c", "d"], &costs);
        assert_eq!(tree.children.len(), 2);
        assert_eq!(tree.children[0].children.len(), 2);
        // |deviation|^2 = 14, weights 1, 4, 1: (0.25 * 56 + 14) / (56 + 14) and with the first channel / 84.
        assert!((tree.children[0].cost.discrepancy() - 40.0).abs() < 1e-12);
        assert!((tree.cost.discrepancy() - 100.0 * 28.0 / 84.0).abs() < 1e-12);
    }

    #[test]
    fn weights() {
        assert_eq!(magnitude_weight(&[1.0, 3.0]), Some(1.0));
        assert_eq!(magnitude_weight(&[2.0, 2.0]), None);
        assert_eq!(noise_weight(0.5), Some(2.0));
        assert_eq!(noise_weight(0.0), None);
        assert_eq!(noise_weight(f64::NAN), None);
    }
}
