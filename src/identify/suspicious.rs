//! Channels that look as if the record was wrong, not the model: reversed signs, wrong units, swapped columns, single
//! wild samples.

use super::{ChannelFit, RecordFit};
use crate::quantities::format_number;
use statrs::statistics::{Data, OrderStatistics};

/// Discrepancy, %, from which on a channel is looked at.
const BAD: f64 = 20.0;
/// Discrepancy, %, at which the model follows next to nothing of a channel.
const NOT_FOLLOWED: f64 = 50.0;
/// A total below this, %, hides such a channel.
const FINE: f64 = 5.0;
/// Correlation from which on two courses are the same one but for their scale.
const ALIKE: f64 = 0.95;
/// Factor from which on a scale is no matter of the mechanism.
const OTHER_UNIT: f64 = 5.0;
/// Another channel must leave less than this share of what the channel's own simulation leaves.
const BETTER: f64 = 0.1;
/// Samples further off than this many usual deviations are wild if they are few, and with them goes most of the error.
const WILD: f64 = 20.0;
const FEW: f64 = 0.01;
const MOST: f64 = 0.5;
/// Median absolute deviation of a normal distribution, in standard deviations.
const NORMAL_MEDIAN: f64 = 0.6745;

/// What readers should check in their files before they believe the model to be wrong.
pub(super) fn remarks(fits: &[RecordFit]) -> Vec<String> {
    let mut remarks = Vec::new();
    for fit in fits {
        for channel in fit.channels.iter().filter(|channel| channel.discrepancy > BAD) {
            let name = format!("{} of {}", channel.name, fit.experiment);
            match cause(channel, fit) {
                Some(cause) => remarks.push(format!("{name}: {cause}")),
                None if channel.discrepancy > NOT_FOLLOWED && fit.discrepancy.discrepancy < FINE => {
                    remarks.push(format!(
                        "{name}: the model follows next to nothing of it, so that it hardly weighs, and the total hides it: check its column, unit, sign and start, or compare without it"
                    ));
                }
                None => {}
            }
        }
    }
    remarks
}

fn cause(channel: &ChannelFit, fit: &RecordFit) -> Option<String> {
    if let Some(wild) = wild(channel, &fit.time) {
        return Some(wild);
    }
    let (own, gain) = likeness(&channel.measured, &channel.simulated)?;
    let others = fit.channels.iter().filter(|other| other.name != channel.name);
    let alike = others.filter_map(|other| Some((likeness(&channel.measured, &other.simulated)?.0, other)));
    let best = alike.max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((other, follows)) =
        best.filter(|(other, _)| *other > ALIKE && 1.0 - other * other < BETTER * (1.0 - own * own))
    {
        return Some(format!(
            "follows the simulated {} (correlation {other:.3}), not its own (correlation {own:.3}): are columns swapped?",
            follows.name
        ));
    }
    if own < -ALIKE {
        let times = format_number(gain, 3);
        return Some(format!("runs against its simulation, as {times} times that: is the sensor's sign reversed?"));
    }
    let is_scaled = own > ALIKE && !(1.0 / OTHER_UNIT..=OTHER_UNIT).contains(&gain);
    is_scaled.then(|| {
        let times = format_number(gain, 3);
        format!("runs as its simulation, but {times} times as large: is the unit in the head of its column right?")
    })
}

/// Correlation of two courses, and by how much the first is larger.
fn likeness(measured: &[f64], simulated: &[f64]) -> Option<(f64, f64)> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (a, b) = (mean(measured), mean(simulated));
    let (mut of_measured, mut of_simulated, mut of_both) = (0.0, 0.0, 0.0);
    for (m, s) in measured.iter().zip(simulated) {
        of_measured += (m - a).powi(2);
        of_simulated += (s - b).powi(2);
        of_both += (m - a) * (s - b);
    }
    let correlation = of_both / (of_measured * of_simulated).sqrt();
    let gain = correlation.signum() * (of_measured / of_simulated).sqrt();
    (correlation.is_finite() && gain.is_finite()).then_some((correlation, gain))
}

/// Few samples that stand off far from the others' residuals and make most of the error.
fn wild(channel: &ChannelFit, time: &[f64]) -> Option<String> {
    let residual: Vec<f64> = channel.measured.iter().zip(&channel.simulated).map(|(m, s)| m - s).collect();
    let finite: Vec<f64> = residual.iter().copied().filter(|r| r.is_finite()).collect();
    if finite.is_empty() {
        return None;
    }
    let middle = Data::new(finite.clone()).median();
    let distances: Vec<f64> = finite.iter().map(|r| (r - middle).abs()).collect();
    let usual = Data::new(distances).median() / NORMAL_MEDIAN;
    let is_wild = |r: &f64| (r - middle).abs() > WILD * usual;
    let (mut count, mut squares, mut first) = (0usize, 0.0, None);
    for (index, r) in residual.iter().enumerate().filter(|(_, r)| is_wild(r)) {
        count += 1;
        squares += r * r;
        first = first.or(Some(index));
    }
    let total: f64 = residual.iter().map(|r| r * r).sum();
    let index = first?;
    let at = format!(
        "{} {} at {} s",
        format_number(channel.measured[index], 4),
        channel.unit,
        format_number(*time.get(index)?, 6)
    );
    let is_few = count as f64 <= (FEW * residual.len() as f64).max(1.0) && squares > MOST * total;
    is_few.then(|| {
        let (samples, make) =
            if count == 1 { ("1 sample stands".to_owned(), "makes") } else { (format!("{count} samples stand"), "make") };
        format!("{samples} far off (the first: {at}) and {make} most of its error: correct them, or write `loss = huber` in the solver")
    })
}

#[cfg(test)]
mod tests {
    use super::remarks;
    use crate::identify::{ChannelFit, DiscrepancyNode, RecordFit};

    fn sine(k: usize) -> f64 {
        (0.1 * k as f64).sin()
    }

    fn other(k: usize) -> f64 {
        (0.37 * k as f64 + 1.0).cos()
    }

    /// What is said of a channel `a` that was measured so while `a` is simulated as a sine and `b` otherwise.
    fn said(measured: impl Fn(usize) -> f64) -> Vec<String> {
        let channel = |name: &str, measured: Vec<f64>, simulated: fn(usize) -> f64, discrepancy: f64| ChannelFit {
            name: name.to_owned(),
            title: String::new(),
            unit: "mm".to_owned(),
            measured,
            simulated: (0..400).map(simulated).collect(),
            discrepancy,
            relative_error: 0.0,
            residual_rms: 0.0,
            noise: 0.0,
            noise_source: String::new(),
        };
        let fit = RecordFit {
            experiment: "run".to_owned(),
            role: String::new(),
            file: String::new(),
            time: (0..400).map(|k| 0.01 * f64::from(k)).collect(),
            channels: vec![
                channel("a", (0..400).map(&measured).collect(), sine, 90.0),
                channel("b", (0..400).map(other).collect(), other, 0.1),
            ],
            discrepancy: DiscrepancyNode { name: String::new(), discrepancy: 0.2, children: Vec::new() },
        };
        remarks(&[fit])
    }

    #[test]
    fn faults_of_records_are_told_from_faults_of_models() {
        let one = |measured: &dyn Fn(usize) -> f64| said(measured).join("; ");
        assert!(one(&|k| -1.02 * sine(k)).contains("as -1.02 times that: is the sensor's sign"));
        assert!(one(&|k| 1e-3 * sine(k)).contains("0.001 times as large: is the unit"));
        assert!(one(&|k| 0.9 * other(k)).contains("follows the simulated b (correlation 1.000)"));
        let wild = one(&|k| if k == 70 { 900.0 } else { sine(k) + 1e-3 * other(3 * k) });
        assert!(wild.contains("1 sample stands far off (the first: 900 mm at 0.7 s)"), "{wild}");
        assert!(one(&|k| (0.9 * k as f64).sin()).contains("the model follows next to nothing of it"));
    }
}
