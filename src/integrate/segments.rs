//! Parts of a run between instants that are known beforehand: jumps of inputs and ticks of clocks.

/// Instants closer than this share of a clock's period are the same.
const SAME: f64 = 1e-9;

/// A part of the run, from the end of the one before it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    pub end: f64,
    /// The right-hand side may jump at the end.
    pub discontinuous: bool,
    /// Clocks that tick at the end.
    pub clocks: Vec<usize>,
}

/// Between start, breakpoints, ticks of clocks and last requested time. None where clocks tick more than `most` times.
pub(super) fn segments(
    start: f64,
    times: &[f64],
    breakpoints: &[f64],
    periods: &[f64],
    most: usize,
) -> Option<Vec<Segment>> {
    let Some(&last) = times.last().filter(|&&last| last > start) else { return Some(Vec::new()) };
    let mut instants: Vec<(f64, Option<usize>)> = breakpoints.iter().map(|&time| (time, None)).collect();
    for (clock, period) in periods.iter().enumerate() {
        let (first, end) = ((start / period).floor(), (last / period).ceil());
        if end - first > most as f64 {
            return None;
        }
        let ticks = (0..=(end - first) as usize).map(|k| (first + k as f64) * period);
        instants.extend(ticks.filter(|tick| tick - start > SAME * period).map(|tick| (tick, Some(clock))));
    }
    instants.retain(|(time, _)| *time > start && *time < last);
    instants.sort_by(|a, b| a.0.total_cmp(&b.0));
    let near = SAME * periods.iter().copied().fold(0.0, f64::max);
    let mut segments: Vec<Segment> = Vec::new();
    for (time, clock) in instants {
        let segment = match segments.last_mut() {
            Some(segment) if time - segment.end <= near => segment,
            _ => {
                segments.push(Segment { end: time, discontinuous: false, clocks: Vec::new() });
                segments.last_mut()?
            }
        };
        match clock {
            Some(clock) => segment.clocks.push(clock),
            None => segment.discontinuous = true,
        }
    }
    segments.push(Segment { end: last, discontinuous: breakpoints.contains(&last), clocks: Vec::new() });
    Some(segments)
}

/// Clocks that tick at the start itself.
pub(super) fn first_clocks(start: f64, periods: &[f64]) -> Vec<usize> {
    let is_multiple = |period: &f64| ((start / period).round() * period - start).abs() <= SAME * period;
    periods.iter().enumerate().filter(|(_, period)| is_multiple(period)).map(|(clock, _)| clock).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instants_that_coincide_are_one() {
        let found = segments(0.0, &[1.0], &[0.5], &[0.25, 0.1], 100).expect("few ticks");
        let ends: Vec<f64> = found.iter().map(|segment| segment.end).collect();
        assert_eq!(ends.len(), 12);
        let half = found.iter().find(|segment| segment.discontinuous).expect("the breakpoint");
        assert_eq!((half.end, &half.clocks[..]), (0.5, &[0, 1][..]));
        assert_eq!(first_clocks(0.0, &[0.25, 0.1]), [0, 1]);
        assert_eq!(first_clocks(0.3, &[0.25, 0.1]), [1]);
        assert_eq!(segments(0.0, &[1.0], &[], &[1e-9], 1000), None);
    }
}
