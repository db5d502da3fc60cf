//! Inputs of a simulation: sampled in a record, or formulas of time in a manoeuvre.

use crate::expression::{Binary, Graph, Node, Operation, Symbol, Unary};
use crate::signal::Interpolant;
use crate::tape::InputSource;

/// The inputs of a record or manoeuvre, by index of the study's inputs.
#[derive(Clone, Debug)]
pub struct RecordInputs {
    pub(super) channels: Vec<Channel>,
    /// Index of the experiment (beyond the experiments: of a manoeuvre), which the study samples like an input behind
    /// its last one where quantities differ between experiments.
    pub(super) experiment: usize,
}

#[derive(Clone, Debug)]
pub(super) enum Channel {
    Sampled(Interpolant),
    Formula(Formula),
}

impl InputSource for RecordInputs {
    fn sample(&self, input: u32, order: u8, t: f64) -> f64 {
        match self.channels.get(input as usize) {
            Some(Channel::Sampled(interpolant)) => interpolant.evaluate(t, usize::from(order)),
            Some(Channel::Formula(formula)) => formula.evaluate(t, usize::from(order)),
            None if order == 0 => self.experiment as f64,
            None => 0.0,
        }
    }
}

/// Derivatives that a formula offers; equations of motion need two, `derivative` in a study may add some.
const HIGHEST_ORDER: usize = 4;
/// Instants at which jumps and kinks of a formula are looked for; those closer together than this grid may be missed,
/// which costs the integrator short steps but no accuracy.
const SEARCH_GRID: usize = 20_000;

/// A function of time with its derivatives.
#[derive(Clone, Debug)]
pub(super) struct Formula {
    graph: Graph,
    time: Symbol,
    /// The value and its time derivatives.
    orders: Vec<Node>,
}

impl Formula {
    /// `value` must depend on `time` and numbers only.
    pub fn new(graph: &Graph, value: Node, time: Symbol) -> Self {
        let (mut own, roots) = graph.extract(&[value]);
        let mut orders = roots;
        for order in 0..HIGHEST_ORDER {
            let derivative = own.differentiate(&orders[order..=order], time);
            orders.extend(derivative);
        }
        let (graph, orders) = own.extract(&orders);
        Self { graph, time, orders }
    }

    fn evaluate(&self, t: f64, order: usize) -> f64 {
        let Some(node) = self.orders.get(order) else { return f64::NAN };
        self.graph.evaluate(&[*node], |_| t, |_, _, _| f64::NAN)[0]
    }

    /// Instants in `from .. to` at which the formula may jump or kink: where the argument of a minimum, comparison,
    /// absolute value or sign changes its sign.
    pub fn breakpoints(&self, from: f64, to: f64) -> Vec<f64> {
        let mut own = self.graph.clone();
        let mut switches = Vec::new();
        for node in self.graph.reachable(&self.orders[..1]) {
            let switch = match self.graph.operation(node) {
                Operation::Binary(Binary::Minimum | Binary::Maximum | Binary::Less, a, b) => own.subtract(a, b),
                Operation::Unary(Unary::Abs | Unary::Sign, a) => a,
                Operation::Unary(Unary::Floor, a) => {
                    // Changes sign where the argument passes an integer.
                    let pi = own.constant(std::f64::consts::PI);
                    let turned = own.multiply(pi, a);
                    own.unary(Unary::Sin, turned)
                }
                Operation::Sample { input, order: 0, time } => {
                    let kinks = self.graph.curve(input).map(|curve| curve.kinks()).unwrap_or_default();
                    for kink in kinks {
                        let kink = own.constant(kink);
                        switches.push(own.subtract(time, kink));
                    }
                    continue;
                }
                _ => continue,
            };
            if own.symbols_of(&[switch]).contains(&self.time) {
                switches.push(switch);
            }
        }
        let at = |t: f64| own.evaluate(&switches, |_| t, |_, _, _| f64::NAN);
        let mut found = Vec::new();
        if switches.is_empty() {
            return found;
        }
        let instant = |k: usize| from + (to - from) * k as f64 / SEARCH_GRID as f64;
        let mut before = at(from);
        for k in 1..=SEARCH_GRID {
            let after = at(instant(k));
            for (which, (a, b)) in before.iter().zip(&after).enumerate() {
                if (*a < 0.0) != (*b < 0.0) {
                    found.push(bisect(|t| at(t)[which] < 0.0, instant(k - 1), instant(k)));
                }
            }
            before = after;
        }
        // A switch at the very begin or end divides nothing.
        let edge = EDGE * (to - from);
        found.retain(|t| *t > from + edge && *t < to - edge);
        found
    }
}

/// Switches closer to an end than this share of the duration are at that end.
const EDGE: f64 = 1e-9;

fn bisect(is_negative: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    let at_low = is_negative(low);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if is_negative(middle) == at_low { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// max(t - 1, 0)^2 kinks at 1 in its second derivative; derivatives are 2 (t - 1), 2, 0.
    #[test]
    fn formulas_have_derivatives_and_breakpoints() {
        let mut graph = Graph::new();
        let time = graph.symbol("t");
        let (t, one, zero) = (graph.variable(time), graph.constant(1.0), graph.constant(0.0));
        let shifted = graph.subtract(t, one);
        let ramp = graph.binary(Binary::Maximum, shifted, zero);
        let value = graph.multiply(ramp, ramp);
        let formula = Formula::new(&graph, value, time);
        let values: Vec<f64> = (0..4).map(|order| formula.evaluate(3.0, order)).collect();
        assert_eq!(values, [4.0, 4.0, 2.0, 0.0]);
        assert_eq!(formula.evaluate(0.5, 1), 0.0);
        let found = formula.breakpoints(0.0, 3.0);
        assert!(found.len() == 1 && (found[0] - 1.0).abs() < 1e-14, "{found:?}");
        assert!(formula.breakpoints(1.0, 3.0).is_empty() && formula.breakpoints(0.0, 1.0).is_empty());
    }
}
