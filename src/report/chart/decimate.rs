//! Long curves made short without losing their peaks.

use statrs::statistics::{Data, OrderStatistics};

/// Minimum and maximum per bucket of `size` samples, in the order in which they occur: two values per bucket.
///
/// A bucket without finite values yields two NaN (a gap). With `size` below 3 the curve is returned as it is.
pub fn envelope(values: &[f64], size: usize) -> Vec<f64> {
    if size < 3 {
        return values.to_vec();
    }
    let mut kept = Vec::with_capacity(2 * values.len().div_ceil(size));
    for bucket in values.chunks(size) {
        let finite = || bucket.iter().copied().enumerate().filter(|(_, value)| value.is_finite());
        let lowest = finite().min_by(|a, b| a.1.total_cmp(&b.1));
        let highest = finite().max_by(|a, b| a.1.total_cmp(&b.1));
        match (lowest, highest) {
            (Some(low), Some(high)) if low.0 <= high.0 => kept.extend([low.1, high.1]),
            (Some(low), Some(high)) => kept.extend([high.1, low.1]),
            _ => kept.extend([f64::NAN, f64::NAN]),
        }
    }
    kept
}

/// Median of `y` in `bins` equally wide bins of `x`: (bin centre, median), bins with fewer than `least` points left
/// out.
pub fn median_by_bin(x: &[f64], y: &[f64], bins: usize, least: usize) -> Vec<(f64, f64)> {
    let finite: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let low = finite.iter().map(|point| point.0).fold(f64::INFINITY, f64::min);
    let high = finite.iter().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
    if bins == 0 || !(high - low).is_finite() || high <= low {
        return Vec::new();
    }
    let width = (high - low) / bins as f64;
    let mut members: Vec<Vec<f64>> = vec![Vec::new(); bins];
    for (x, y) in finite {
        let bin = (((x - low) / width) as usize).min(bins - 1);
        members[bin].push(y);
    }
    let centre = |bin: usize| low + (bin as f64 + 0.5) * width;
    let filled = members.into_iter().enumerate().filter(|(_, values)| values.len() >= least.max(1));
    filled.map(|(bin, values)| (centre(bin), Data::new(values).median())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn envelope_keeps_every_peak_in_order() {
        let mut values = vec![0.0; 1000];
        values[503] = 7.0;
        values[508] = -3.0;
        let kept = envelope(&values, 10);
        assert_eq!(kept.len(), 200);
        assert_eq!(&kept[100..102], &[7.0, -3.0]);
        assert_eq!(kept.iter().copied().fold(0.0, f64::max), 7.0);
    }

    #[test]
    fn envelope_shows_gaps() {
        assert!(envelope(&[f64::NAN; 6], 3).iter().all(|value| value.is_nan()));
    }

    #[test]
    fn medians_follow_a_step() {
        let x: Vec<f64> = (-50..50).map(|index| index as f64 + 0.5).collect();
        let y: Vec<f64> = x.iter().map(|x| x.signum() * 2.0).collect();
        let medians = median_by_bin(&x, &y, 10, 1);
        assert_eq!(medians.len(), 10);
        assert!(medians[..5].iter().all(|(_, median)| *median == -2.0));
        assert!(medians[5..].iter().all(|(_, median)| *median == 2.0));
    }
}
