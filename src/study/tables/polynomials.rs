//! Piecewise polynomials as expressions: choices over a balanced tree, so that derivatives follow.

use crate::expression::{Beyond, Binary, Graph, Node};

/// A function of one argument: pieces in powers of the distance from where each begins, whose coefficients may be
/// functions of another argument. `arguments` has one more entry.
pub(super) struct Piecewise<'p> {
    pub arguments: &'p [f64],
    pub pieces: &'p [[Node; 4]],
    pub beyond: Beyond,
}

pub(super) fn constants(graph: &mut Graph, pieces: &[[f64; 4]]) -> Vec<[Node; 4]> {
    pieces.iter().map(|piece| piece.map(|coefficient| graph.constant(coefficient))).collect()
}

impl Piecewise<'_> {
    /// The value at `x`; nothing without a piece.
    pub fn at(&self, graph: &mut Graph, x: Node) -> Option<Node> {
        let (first, last) = (*self.arguments.first()?, *self.arguments.last()?);
        let (low, high) = (graph.constant(first), graph.constant(last));
        if self.beyond == Beyond::Constant {
            let above = graph.binary(Binary::Maximum, x, low);
            let x = graph.binary(Binary::Minimum, above, high);
            return Some(tree(graph, self.arguments, self.pieces, x));
        }
        let inside = tree(graph, self.arguments, self.pieces, x);
        let (below, above) = if self.beyond == Beyond::Linear {
            let [value, slope, ..] = *self.pieces.first()?;
            let below = polynomial(graph, x, first, &[value, slope]);
            let [value, slope] = self.end(graph, last)?;
            (below, polynomial(graph, x, last, &[value, slope]))
        } else {
            let undefined = graph.constant(f64::NAN);
            (undefined, undefined)
        };
        let is_below = graph.binary(Binary::Less, x, low);
        let is_above = graph.binary(Binary::Less, high, x);
        let upper = graph.select(is_above, above, inside);
        Some(graph.select(is_below, below, upper))
    }

    /// Value and slope at the last argument.
    fn end(&self, graph: &mut Graph, last: f64) -> Option<[Node; 2]> {
        let coefficients = *self.pieces.last()?;
        let width = last - self.arguments[self.pieces.len() - 1];
        let width = graph.constant(width);
        let [mut value, mut slope] = [graph.constant(0.0); 2];
        for (power, &coefficient) in coefficients.iter().enumerate().rev() {
            let product = graph.multiply(value, width);
            value = graph.add(coefficient, product);
            if power > 0 {
                let times = graph.constant(power as f64);
                let own = graph.multiply(times, coefficient);
                let product = graph.multiply(slope, width);
                slope = graph.add(own, product);
            }
        }
        Some([value, slope])
    }
}

/// Halves the pieces until one is left.
fn tree(graph: &mut Graph, arguments: &[f64], pieces: &[[Node; 4]], x: Node) -> Node {
    if let [piece] = pieces {
        return polynomial(graph, x, arguments[0], piece);
    }
    let half = pieces.len() / 2;
    let left = tree(graph, &arguments[..=half], &pieces[..half], x);
    let right = tree(graph, &arguments[half..], &pieces[half..], x);
    let middle = graph.constant(arguments[half]);
    let is_left = graph.binary(Binary::Less, x, middle);
    graph.select(is_left, left, right)
}

fn polynomial(graph: &mut Graph, x: Node, from: f64, coefficients: &[Node]) -> Node {
    let from = graph.constant(from);
    let distance = graph.subtract(x, from);
    let mut value: Option<Node> = None;
    for &own in coefficients.iter().rev() {
        value = match value {
            None if graph.is_zero(own) => None,
            None => Some(own),
            Some(value) => {
                let product = graph.multiply(value, distance);
                Some(graph.add(product, own))
            }
        };
    }
    value.unwrap_or_else(|| graph.constant(0.0))
}
