//! Symbolic derivatives, forward through the graph.

use super::graph::{Binary, Graph, Node, Operation, Symbol, Unary};
use std::collections::HashMap;

impl Graph {
    /// d(root)/d(symbol) for every root.
    ///
    /// Kinks (`abs`, `min`, `select`) get the derivative of the branch that holds; `sign`, `floor` and
    /// comparisons have derivative zero.
    pub fn differentiate(&mut self, roots: &[Node], symbol: Symbol) -> Vec<Node> {
        let zero = self.constant(0.0);
        let mut derivative: HashMap<Node, Node> = HashMap::new();
        for node in self.reachable(roots) {
            let d = |child: Node| derivative.get(&child).copied().unwrap_or(zero);
            let value = match self.operation(node) {
                Operation::Constant(_) => zero,
                Operation::Symbol(s) if s == symbol => self.constant(1.0),
                Operation::Symbol(_) => zero,
                Operation::Unary(function, a) => {
                    let da = d(a);
                    self.unary_derivative(function, node, a, da)
                }
                Operation::Binary(function, a, b) => {
                    let (da, db) = (d(a), d(b));
                    self.binary_derivative(function, node, [a, b], [da, db])
                }
                Operation::Select { condition, then, otherwise } => {
                    let (dt, de) = (d(then), d(otherwise));
                    self.select(condition, dt, de)
                }
                Operation::Sample { input, order, time } => {
                    let dt = d(time);
                    if dt == zero {
                        zero
                    } else {
                        let slope = self.sample(input, order + 1, time);
                        self.multiply(slope, dt)
                    }
                }
            };
            if value != zero {
                derivative.insert(node, value);
            }
        }
        roots.iter().map(|root| derivative.get(root).copied().unwrap_or(zero)).collect()
    }

    fn unary_derivative(&mut self, function: Unary, node: Node, a: Node, da: Node) -> Node {
        if self.is_zero(da) {
            return da;
        }
        let one = self.constant(1.0);
        let outer = match function {
            Unary::Negate => return self.negate(da),
            Unary::Sin => self.unary(Unary::Cos, a),
            Unary::Cos => {
                let sine = self.unary(Unary::Sin, a);
                self.negate(sine)
            }
            Unary::Tan => {
                let square = self.multiply(node, node);
                self.add(one, square)
            }
            Unary::Asin | Unary::Acos => {
                let square = self.multiply(a, a);
                let rest = self.subtract(one, square);
                let root = self.unary(Unary::Sqrt, rest);
                let slope = self.divide(one, root);
                if function == Unary::Asin { slope } else { self.negate(slope) }
            }
            Unary::Atan => {
                let square = self.multiply(a, a);
                let sum = self.add(one, square);
                self.divide(one, sum)
            }
            Unary::Sinh => self.unary(Unary::Cosh, a),
            Unary::Cosh => self.unary(Unary::Sinh, a),
            Unary::Tanh => {
                let square = self.multiply(node, node);
                self.subtract(one, square)
            }
            Unary::Exp => node,
            Unary::Log => return self.divide(da, a),
            Unary::Sqrt => {
                let two = self.constant(2.0);
                let denominator = self.multiply(two, node);
                return self.divide(da, denominator);
            }
            Unary::Abs => self.unary(Unary::Sign, a),
            Unary::Sign | Unary::Floor => return self.constant(0.0),
        };
        self.multiply(outer, da)
    }

    fn binary_derivative(&mut self, function: Binary, node: Node, [a, b]: [Node; 2], [da, db]: [Node; 2]) -> Node {
        if self.is_zero(da) && self.is_zero(db) {
            return da;
        }
        match function {
            Binary::Add => self.add(da, db),
            Binary::Subtract => self.subtract(da, db),
            Binary::Multiply => {
                let left = self.multiply(da, b);
                let right = self.multiply(a, db);
                self.add(left, right)
            }
            Binary::Divide => {
                let carried = self.multiply(node, db);
                let numerator = self.subtract(da, carried);
                self.divide(numerator, b)
            }
            Binary::Power => self.power_derivative(node, [a, b], [da, db]),
            Binary::Minimum | Binary::Maximum => {
                let condition = self.binary(Binary::Less, a, b);
                let (low, high) = if function == Binary::Minimum { (da, db) } else { (db, da) };
                self.select(condition, low, high)
            }
            Binary::Atan2 => {
                let (bda, adb) = (self.multiply(b, da), self.multiply(a, db));
                let numerator = self.subtract(bda, adb);
                let (aa, bb) = (self.multiply(a, a), self.multiply(b, b));
                let square = self.add(aa, bb);
                self.divide(numerator, square)
            }
            Binary::Less => self.constant(0.0),
        }
    }

    /// d(a^b) = b a^(b-1) da + a^b log(a) db, the second part only where the exponent varies.
    fn power_derivative(&mut self, node: Node, [a, b]: [Node; 2], [da, db]: [Node; 2]) -> Node {
        let one = self.constant(1.0);
        let lowered = self.subtract(b, one);
        let power = self.binary(Binary::Power, a, lowered);
        let slope = self.multiply(b, power);
        let by_base = self.multiply(slope, da);
        if self.is_zero(db) {
            return by_base;
        }
        let log = self.unary(Unary::Log, a);
        let scaled = self.multiply(node, log);
        let by_exponent = self.multiply(scaled, db);
        self.add(by_base, by_exponent)
    }
}
