//! Comparisons on which branches of the rates depend: where one changes, the rates may have a kink.

use super::bound::Bound;
use super::program::Program;
use crate::expression::{Binary, Graph, Node, Operation};

/// What computes the comparisons, and the rates for given ones.
#[derive(Clone, Debug, Default)]
pub(super) struct Kinks {
    /// Runs by itself after the prologue.
    pub program: Program,
    /// Per comparison: register of the difference of its sides. It holds where that is negative.
    pub differences: Vec<u32>,
    /// Per comparison: its register in the rates.
    pub comparisons: Vec<u32>,
    /// The rates without the comparisons.
    pub held_rates: Program,
}

/// Comparisons that `roots` depend on, each with the difference of its sides.
pub(super) fn comparisons(graph: &mut Graph, roots: &[Node]) -> Vec<(Node, Node)> {
    let sides = |node: &Node| match graph.operation(*node) {
        Operation::Binary(Binary::Less, a, b) => Some((*node, a, b)),
        _ => None,
    };
    let found: Vec<(Node, Node, Node)> = graph.reachable(roots).iter().filter_map(sides).collect();
    found.into_iter().map(|(node, a, b)| (node, graph.subtract(a, b))).collect()
}

impl Bound<'_> {
    pub(super) fn evaluate_kinks(&mut self, t: f64, y: &[f64], values: &mut [f64]) {
        self.set_point(t, y);
        let kinks = &self.model.kinks;
        kinks.program.execute(&mut self.registers, &self.inputs);
        self.gather(&kinks.differences, values);
    }

    pub(super) fn hold_comparisons(&mut self, sides: Option<&[bool]>) {
        self.forget_rates();
        self.is_held = sides.is_some();
        for (&register, &side) in self.model.kinks.comparisons.iter().zip(sides.unwrap_or_default()) {
            self.registers[register as usize] = f64::from(u8::from(side));
        }
    }
}
