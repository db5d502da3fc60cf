//! Steps to whose multiples a logger or a sensor has rounded a record.

/// Gaps may miss whole multiples of the step by this share of it: numbers in files are rounded, too.
const ALIGNED: f64 = 0.05;
/// What is rounded visibly shows the same values again: distinct ones are at most this share of the samples.
const DISTINCT: f64 = 0.6;
const FEWEST: usize = 4;
/// Values closer than this share of the range are the same.
const SAME: f64 = 1e-9;

/// The step, in the unit of `values`; none where they show none.
pub fn resolution(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let range = sorted.last()? - sorted.first()?;
    sorted.dedup_by(|later, earlier| *later - *earlier <= SAME * range);
    if sorted.len() < FEWEST || sorted.len() as f64 > DISTINCT * values.len() as f64 {
        return None;
    }
    let gaps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let steps: Vec<f64> = gaps.iter().map(|gap| gap / smallest).collect();
    let is_aligned = steps.iter().all(|step| (step - step.round()).abs() <= ALIGNED);
    is_aligned.then(|| range / steps.iter().map(|step| step.round()).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::resolution;

    fn wave(k: usize) -> f64 {
        3.0 * (0.013 * k as f64).sin() + (0.0071 * k as f64).cos()
    }

    #[test]
    fn rounded_values_show_their_step() {
        for step in [0.02, 0.25] {
            let rounded: Vec<f64> = (0..2000).map(|k| (wave(k) / step).round() * step + 1e-12 * wave(3 * k)).collect();
            let found = resolution(&rounded).expect("a step");
            assert!((found / step - 1.0).abs() < 1e-6, "{found}");
        }
    }

    #[test]
    fn other_values_show_none() {
        let smooth: Vec<f64> = (0..2000).map(wave).collect();
        assert_eq!(resolution(&smooth), None);
        // Few samples in fine steps: the decimals of a file.
        let decimals: Vec<f64> = (0..100).map(|k| (wave(20 * k) * 1e4).round() / 1e4).collect();
        assert_eq!(resolution(&decimals), None);
        // A switch between levels that are no multiples of each other.
        let levels: Vec<f64> = (0..2000).map(|k| [0.0, 1.0, 2.4, 3.1, 7.77][k * k % 5]).collect();
        assert_eq!(resolution(&levels), None);
        assert_eq!(resolution(&[]), None);
        assert_eq!(resolution(&[1.0; 50]), None);
    }
}
