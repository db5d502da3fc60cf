//! Symbolic derivatives, forward through the graph.

use super::graph::{Binary, Graph, Node, Operation, Symbol, Unary};

/// One structurally non-zero element of a matrix of derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    pub row: usize,
    pub column: usize,
    pub value: Node,
}

impl Graph {
    /// d(root)/d(symbol) for every root.
    ///
    /// Kinks (`abs`, `min`, `select`) get the derivative of the branch that holds; `sign`, `floor` and
    /// comparisons have derivative zero.
    pub fn differentiate(&mut self, roots: &[Node], symbol: Symbol) -> Vec<Node> {
        let zero = self.constant(0.0);
        let order = self.reachable(roots);
        let mut derivative = vec![zero; self.len()];
        self.sweep(&order, symbol, zero, &mut derivative);
        roots.iter().map(|root| derivative[root.index()]).collect()
    }

    /// The structurally non-zero elements of d(roots)/d(symbols), ordered by column, then row.
    pub fn jacobian(&mut self, roots: &[Node], symbols: &[Symbol]) -> Vec<Entry> {
        let zero = self.constant(0.0);
        let order = self.reachable(roots);
        let mut derivative = vec![zero; self.len()];
        let mut entries = Vec::new();
        for (column, &symbol) in symbols.iter().enumerate() {
            derivative.fill(zero);
            self.sweep(&order, symbol, zero, &mut derivative);
            let values = roots.iter().map(|root| derivative[root.index()]).enumerate();
            entries.extend(values.filter(|&(_, value)| value != zero).map(|(row, value)| Entry { row, column, value }));
        }
        entries
    }

    /// Derivatives of the nodes in `order` into `derivative`, which holds `zero` everywhere.
    fn sweep(&mut self, order: &[Node], symbol: Symbol, zero: Node, derivative: &mut [Node]) {
        for &node in order {
            let operation = self.operation(node);
            if let Operation::Symbol(s) = operation {
                if s == symbol {
                    derivative[node.index()] = self.constant(1.0);
                }
                continue;
            }
            let d = |child: Node| derivative[child.index()];
            if operation.children().all(|child| d(child) == zero) {
                continue;
            }
            let value = match operation {
                Operation::Constant(_) | Operation::Symbol(_) => zero,
                Operation::Unary(function, a) => self.unary_derivative(function, node, a, d(a)),
                Operation::Binary(function, a, b) => self.binary_derivative(function, node, [a, b], [d(a), d(b)]),
                Operation::Select { condition, then, otherwise } => self.select(condition, d(then), d(otherwise)),
                Operation::Sample { input, order, time } => {
                    let slope = self.sample(input, order + 1, time);
                    self.multiply(slope, d(time))
                }
            };
            derivative[node.index()] = value;
        }
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

    /// d(a^b) = b a^(b-1) da + a^b log(a) db, the second part only where the exponent varies; at base zero it is
    /// zero (the limit for positive exponents), not the 0 * infinity of the formula.
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
        let zero = self.constant(0.0);
        let is_positive = self.binary(Binary::Less, zero, a);
        let guarded = self.select(is_positive, scaled, zero);
        let by_exponent = self.multiply(guarded, db);
        self.add(by_base, by_exponent)
    }
}
