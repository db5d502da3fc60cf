//! Axes with round ticks.

use crate::report::number;

/// A linear axis from data range to pixels.
#[derive(Clone, Debug)]
pub struct Axis {
    pub lower: f64,
    pub upper: f64,
    pub ticks: Vec<f64>,
    step: f64,
}

/// Ticks stand at multiples of these (times a power of ten).
const ROUND_STEPS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

impl Axis {
    /// An axis over `lower .. upper` with about `count` round ticks inside; a range of no width is widened.
    pub fn over(lower: f64, upper: f64, count: usize) -> Axis {
        let (lower, upper) = widened(lower, upper);
        let step = round_step((upper - lower) / count.max(1) as f64);
        let first = (lower / step - 1e-9).ceil() as i64;
        let last = (upper / step + 1e-9).floor() as i64;
        let ticks = (first..=last).map(|index| index as f64 * step).collect();
        Axis { lower, upper, ticks, step }
    }

    /// An axis over all finite values, with a margin (share of the range) on both sides; `None` without finite values.
    pub fn around<'a>(values: impl IntoIterator<Item = &'a f64>, margin: f64, count: usize) -> Option<Axis> {
        let mut range: Option<(f64, f64)> = None;
        for value in values.into_iter().filter(|value| value.is_finite()) {
            range = Some(range.map_or((*value, *value), |(low, high)| (low.min(*value), high.max(*value))));
        }
        let (low, high) = range?;
        let (low, high) = widened(low, high);
        let room = margin * (high - low);
        Some(Axis::over(low - room, high + room, count))
    }

    /// Where `value` lies between `from` (at `lower`) and `to` (at `upper`).
    pub fn place(&self, value: f64, from: f64, to: f64) -> f64 {
        from + (value - self.lower) / (self.upper - self.lower) * (to - from)
    }

    /// Text of a tick, with the decimals its step needs.
    pub fn label(&self, tick: f64) -> String {
        let largest = self.lower.abs().max(self.upper.abs());
        if !(1e-4..1e6).contains(&largest) {
            return if tick == 0.0 { "0".into() } else { number::significant(tick, 3) };
        }
        let decimals = (-(self.step.log10() + 1e-9).floor()).max(0.0) as usize;
        number::fixed(tick, decimals)
    }
}

fn widened(lower: f64, upper: f64) -> (f64, f64) {
    let (lower, upper) = if lower <= upper { (lower, upper) } else { (upper, lower) };
    let magnitude = lower.abs().max(upper.abs());
    if upper - lower > 1e-12 * magnitude {
        (lower, upper)
    } else if magnitude == 0.0 {
        (-1.0, 1.0)
    } else {
        (lower - 0.5 * magnitude, upper + 0.5 * magnitude)
    }
}

fn round_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    let ratio = raw / power;
    ROUND_STEPS.iter().find(|step| **step >= ratio - 1e-9).copied().unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::over(-0.13, 0.26, 5);
        assert_eq!(axis.ticks.iter().map(|tick| axis.label(*tick)).collect::<Vec<_>>(), ["-0.1", "0.0", "0.1", "0.2"]);
        let axis = Axis::over(0.0, 25.0, 6);
        assert_eq!(
            axis.ticks.iter().map(|tick| axis.label(*tick)).collect::<Vec<_>>(),
            ["0", "5", "10", "15", "20", "25"]
        );
    }

    #[test]
    fn a_constant_channel_still_has_an_axis() {
        let axis = Axis::around(&[3.0, 3.0, f64::NAN], 0.05, 4).unwrap();
        assert!(axis.lower < 3.0 && axis.upper > 3.0 && axis.ticks.len() >= 2);
        assert!(Axis::around(&[f64::NAN], 0.05, 4).is_none());
    }

    #[test]
    fn places_ends_at_ends() {
        let axis = Axis::over(-2.0, 2.0, 4);
        assert_eq!(axis.place(-2.0, 10.0, 110.0), 10.0);
        assert_eq!(axis.place(2.0, 10.0, 110.0), 110.0);
    }
}
