//! Measured channels that arrive late: at which instants the solution is needed, and how the delays enter the gradient.
//!
//! A channel with delay tau shows at the sample time t what the model did at t - tau, exactly, by the solution's
//! interpolant; what lies before the start is the value at the start.

use super::prepare::Record;
use crate::expression::{Graph, Node, Symbol};
use crate::study::Study;

/// Distance of the instants at which the rate of a channel is taken, as a share of the sampling interval.
const STENCIL: f64 = 1e-2;

/// Delays of the study's measures as functions of the parameters.
#[derive(Clone, Debug, Default)]
pub(super) struct Delays {
    graph: Graph,
    /// Per measure with a delay: its index, the delay, its derivatives by the parameters.
    measures: Vec<(usize, Node, Vec<Node>)>,
    symbols: Vec<Symbol>,
}

impl Delays {
    pub fn new(study: &Study) -> Self {
        let delayed: Vec<(usize, Node)> =
            study.measures.iter().enumerate().filter_map(|(k, measure)| Some((k, measure.delay?))).collect();
        let nodes: Vec<Node> = delayed.iter().map(|(_, node)| *node).collect();
        let (mut graph, nodes) = study.graph.extract(&nodes);
        let symbols: Vec<Symbol> = study.parameters.iter().map(|parameter| parameter.symbol).collect();
        let measures = delayed
            .iter()
            .zip(&nodes)
            .map(|((measure, _), node)| {
                let slopes = symbols.iter().map(|symbol| graph.differentiate(&[*node], *symbol)[0]).collect();
                (*measure, *node, slopes)
            })
            .collect();
        Self { graph, measures, symbols }
    }

    /// Whether the delay of some measure depends on the parameter.
    pub fn depend_on(&self, parameter: usize) -> bool {
        self.measures
            .iter()
            .any(|(_, _, slopes)| slopes.get(parameter).is_some_and(|slope| !self.graph.is_zero(*slope)))
    }

    /// Delay of a measure and its derivatives by the parameters; `None` without delay.
    fn of(&self, measure: usize, theta: &[f64]) -> Option<(f64, Vec<f64>)> {
        let (_, node, slopes) = self.measures.iter().find(|(index, ..)| *index == measure)?;
        let value = |symbol: Symbol| {
            let at = self.symbols.iter().position(|known| *known == symbol);
            at.and_then(|at| theta.get(at)).copied().unwrap_or(f64::NAN)
        };
        let roots: Vec<Node> = [*node].into_iter().chain(slopes.iter().copied()).collect();
        let values = self.graph.evaluate(&roots, value, |_, _, _| f64::NAN);
        let (delay, slopes) = values.split_first()?;
        Some((*delay, slopes.to_vec()))
    }
}

/// Where the solution of a record is needed, and which row serves which sample.
pub(super) struct Schedule {
    /// Ascending.
    pub times: Vec<f64>,
    /// Row of each compared sample's own instant.
    pub base: Vec<usize>,
    channels: Vec<Option<Late>>,
}

struct Late {
    rows: Vec<usize>,
    /// Rows at -2, -1, 1, 2 distances; `None` before the start, where nothing moves.
    around: Vec<Option<[usize; 4]>>,
    distance: f64,
    /// Of the delay by the parameters.
    slopes: Vec<f64>,
}

impl Schedule {
    /// `None`: a delay is negative or not a number.
    pub fn new(delays: &Delays, record: &Record, theta: &[f64]) -> Option<Self> {
        let late: Vec<Option<(f64, Vec<f64>)>> =
            record.measures.iter().map(|&measure| delays.of(measure, theta)).collect();
        if late.iter().flatten().any(|(delay, _)| !(*delay >= 0.0 && delay.is_finite())) {
            return None;
        }
        if late.iter().all(Option::is_none) {
            let base = (record.first..record.times.len()).collect();
            let channels = late.iter().map(|_| None).collect();
            return Some(Self { times: record.times.clone(), base, channels });
        }
        let (start, distance) = (record.start_time(), STENCIL * record.sample_step());
        let shifted = |t: f64, delay: f64| (t - delay).max(start);
        let stencil = |t: f64, delay: f64| {
            let t = t - delay;
            let last = *record.times.last().unwrap_or(&t);
            // Within the run, a little off the middle at its ends.
            let middle = t.clamp(start + 2.0 * distance, last - 2.0 * distance);
            (t > start).then(|| [-2.0, -1.0, 1.0, 2.0].map(|k: f64| middle + k * distance))
        };
        let mut times = record.times.clone();
        for (delay, _) in late.iter().flatten() {
            for &t in record.compared_times() {
                times.push(shifted(t, *delay));
                times.extend(stencil(t, *delay).into_iter().flatten());
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        let row = |t: f64| times.partition_point(|other| *other < t);
        let base = record.compared_times().iter().map(|t| row(*t)).collect();
        let channels = late
            .into_iter()
            .map(|late| {
                let (delay, slopes) = late?;
                let compared = record.compared_times().iter();
                let rows = compared.clone().map(|t| row(shifted(*t, delay))).collect();
                let around = compared.map(|t| Some(stencil(*t, delay)?.map(row))).collect();
                Some(Late { rows, around, distance, slopes })
            })
            .collect();
        Some(Self { times, base, channels })
    }

    /// The row that shows in sample `k` of a channel.
    pub fn row(&self, channel: usize, k: usize) -> usize {
        match &self.channels[channel] {
            Some(late) => late.rows[k],
            None => self.base[k],
        }
    }

    /// Derivative of sample `k` of a channel by the parameters through its delay; `value`: of the channel at a row.
    /// `None` where there is nothing to add.
    pub fn slopes(&self, channel: usize, k: usize, mut value: impl FnMut(usize) -> f64) -> Option<Vec<f64>> {
        let late = self.channels[channel].as_ref().filter(|late| late.slopes.iter().any(|slope| *slope != 0.0))?;
        let [a, b, c, d] = late.around[k]?.map(&mut value);
        // Exact for polynomials of degree four.
        let rate = (a - 8.0 * b + 8.0 * c - d) / (12.0 * late.distance);
        Some(late.slopes.iter().map(|slope| -rate * slope).collect())
    }
}
