//! Derivatives of single instructions as numbers, for sweeps and dual numbers. At kinks they take the same side as the
//! symbolic ones ([`crate::expression::Graph::differentiate`]).

use crate::expression::{Binary, Unary};

/// Derivative of a function at `a`, where it has the value `result`.
pub(super) fn slope(function: Unary, a: f64, result: f64) -> f64 {
    match function {
        Unary::Negate => -1.0,
        Unary::Sin => a.cos(),
        Unary::Cos => -a.sin(),
        Unary::Tan => 1.0 + result * result,
        Unary::Asin => 1.0 / (1.0 - a * a).sqrt(),
        Unary::Acos => -1.0 / (1.0 - a * a).sqrt(),
        Unary::Atan => 1.0 / (1.0 + a * a),
        Unary::Sinh => a.cosh(),
        Unary::Cosh => a.sinh(),
        Unary::Tanh => 1.0 - result * result,
        Unary::Exp => result,
        Unary::Log => 1.0 / a,
        Unary::Sqrt => 1.0 / (2.0 * result),
        Unary::Abs => Unary::Sign.evaluate(a),
        Unary::Sign | Unary::Floor => 0.0,
    }
}

/// Derivatives by both operands where the function has the value `result`.
pub(super) fn slopes(function: Binary, [a, b]: [f64; 2], result: f64) -> [f64; 2] {
    match function {
        Binary::Add => [1.0, 1.0],
        Binary::Subtract => [1.0, -1.0],
        Binary::Multiply => [b, a],
        Binary::Divide => [1.0 / b, -result / b],
        Binary::Power => {
            let by_base = if b == 0.0 { 0.0 } else { b * a.powf(b - 1.0) };
            // A base of zero does not move with a positive exponent.
            let by_exponent = if a > 0.0 { result * a.ln() } else { 0.0 };
            [by_base, by_exponent]
        }
        Binary::Minimum if a < b => [1.0, 0.0],
        Binary::Minimum => [0.0, 1.0],
        Binary::Maximum if a < b => [0.0, 1.0],
        Binary::Maximum => [1.0, 0.0],
        Binary::Atan2 => {
            let square = a * a + b * b;
            [b / square, -a / square]
        }
        Binary::Less => [0.0, 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::Graph;

    const UNARY: [Unary; 16] = [
        Unary::Negate,
        Unary::Sin,
        Unary::Cos,
        Unary::Tan,
        Unary::Asin,
        Unary::Acos,
        Unary::Atan,
        Unary::Sinh,
        Unary::Cosh,
        Unary::Tanh,
        Unary::Exp,
        Unary::Log,
        Unary::Sqrt,
        Unary::Abs,
        Unary::Sign,
        Unary::Floor,
    ];
    const BINARY: [Binary; 9] = [
        Binary::Add,
        Binary::Subtract,
        Binary::Multiply,
        Binary::Divide,
        Binary::Power,
        Binary::Minimum,
        Binary::Maximum,
        Binary::Atan2,
        Binary::Less,
    ];

    /// Every function against the symbolic rules, ties of minimum and maximum included.
    #[test]
    fn slopes_are_those_of_the_symbolic_rules() {
        for [x, y] in [[0.3, 0.7], [0.7, 0.3], [0.4, 0.4]] {
            let mut graph = Graph::new();
            let symbols = ["x", "y"].map(|name| graph.symbol(name));
            let [a, b] = symbols.map(|symbol| graph.variable(symbol));
            let value = |graph: &Graph, node| {
                graph.evaluate(&[node], |s| if s == symbols[0] { x } else { y }, |_, _, _| 0.0)[0]
            };
            for function in UNARY {
                let node = graph.unary(function, a);
                let derivative = graph.differentiate(&[node], symbols[0])[0];
                let (expected, result) = (value(&graph, derivative), value(&graph, node));
                assert!((slope(function, x, result) - expected).abs() < 1e-14, "{function:?} at {x}");
            }
            for function in BINARY {
                let node = graph.binary(function, a, b);
                let result = value(&graph, node);
                let own = slopes(function, [x, y], result);
                for (symbol, own) in symbols.into_iter().zip(own) {
                    let derivative = graph.differentiate(&[node], symbol)[0];
                    let expected = value(&graph, derivative);
                    assert!((own - expected).abs() < 1e-14, "{function:?} at ({x}, {y}): {own} and {expected}");
                }
            }
        }
    }
}
