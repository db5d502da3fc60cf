//! The rule table that is applied whenever a node is built.

use super::graph::{Binary, Graph, Node, Operation, Unary};

/// A function of one argument, folded where the argument is constant.
pub(super) fn unary(graph: &mut Graph, function: Unary, argument: Node) -> Node {
    if let Some(value) = graph.constant_value(argument) {
        return graph.constant(function.evaluate(value));
    }
    match (function, graph.operation(argument)) {
        (Unary::Negate, Operation::Unary(Unary::Negate, inner)) => inner,
        (Unary::Negate, Operation::Binary(Binary::Subtract, a, b)) => graph.subtract(b, a),
        (Unary::Abs, Operation::Unary(Unary::Negate | Unary::Abs, inner)) => graph.unary(Unary::Abs, inner),
        (Unary::Cos, Operation::Unary(Unary::Negate, inner)) => graph.unary(Unary::Cos, inner),
        (Unary::Sin | Unary::Tanh, Operation::Unary(Unary::Negate, inner)) => {
            let positive = graph.unary(function, inner);
            graph.negate(positive)
        }
        _ => graph.intern(Operation::Unary(function, argument)),
    }
}

/// A function of two arguments: constants folded, neutral elements dropped, commutative operands ordered.
pub(super) fn binary(graph: &mut Graph, function: Binary, left: Node, right: Node) -> Node {
    let (a, b) = (graph.constant_value(left), graph.constant_value(right));
    if let (Some(a), Some(b)) = (a, b) {
        return graph.constant(function.evaluate(a, b));
    }
    match function {
        Binary::Add => add(graph, left, right, a, b),
        Binary::Subtract => subtract(graph, left, right, a, b),
        Binary::Multiply => multiply(graph, left, right, a, b),
        Binary::Divide => divide(graph, left, right, a, b),
        Binary::Power => power(graph, left, right, b),
        Binary::Minimum | Binary::Maximum if left == right => left,
        _ => graph.intern(Operation::Binary(function, left, right)),
    }
}

/// A choice whose condition or branches are known collapses.
pub(super) fn select(graph: &mut Graph, condition: Node, then: Node, otherwise: Node) -> Node {
    match graph.constant_value(condition) {
        Some(0.0) => otherwise,
        Some(_) => then,
        None if then == otherwise => then,
        None => graph.intern(Operation::Select { condition, then, otherwise }),
    }
}

fn negated(graph: &Graph, node: Node) -> Option<Node> {
    match graph.operation(node) {
        Operation::Unary(Unary::Negate, inner) => Some(inner),
        _ => None,
    }
}

fn add(graph: &mut Graph, left: Node, right: Node, a: Option<f64>, b: Option<f64>) -> Node {
    if a == Some(0.0) {
        return right;
    }
    if b == Some(0.0) {
        return left;
    }
    if let Some(inner) = negated(graph, right) {
        return graph.subtract(left, inner);
    }
    if let Some(inner) = negated(graph, left) {
        return graph.subtract(right, inner);
    }
    let (first, second) = if left <= right { (left, right) } else { (right, left) };
    graph.intern(Operation::Binary(Binary::Add, first, second))
}

fn subtract(graph: &mut Graph, left: Node, right: Node, a: Option<f64>, b: Option<f64>) -> Node {
    if left == right {
        return graph.constant(0.0);
    }
    if b == Some(0.0) {
        return left;
    }
    if a == Some(0.0) {
        return graph.negate(right);
    }
    if let Some(inner) = negated(graph, right) {
        return graph.add(left, inner);
    }
    graph.intern(Operation::Binary(Binary::Subtract, left, right))
}

fn multiply(graph: &mut Graph, left: Node, right: Node, a: Option<f64>, b: Option<f64>) -> Node {
    for (constant, other) in [(a, right), (b, left)] {
        match constant {
            Some(0.0) => return graph.constant(0.0),
            Some(1.0) => return other,
            Some(-1.0) => return graph.negate(other),
            _ => {}
        }
    }
    match (negated(graph, left), negated(graph, right)) {
        (Some(l), Some(r)) => return graph.multiply(l, r),
        (Some(l), None) => {
            let product = graph.multiply(l, right);
            return graph.negate(product);
        }
        (None, Some(r)) => {
            let product = graph.multiply(left, r);
            return graph.negate(product);
        }
        (None, None) => {}
    }
    let (first, second) = if left <= right { (left, right) } else { (right, left) };
    graph.intern(Operation::Binary(Binary::Multiply, first, second))
}

fn divide(graph: &mut Graph, left: Node, right: Node, a: Option<f64>, b: Option<f64>) -> Node {
    if a == Some(0.0) {
        return left;
    }
    match b {
        Some(1.0) => return left,
        Some(-1.0) => return graph.negate(left),
        _ => {}
    }
    if left == right {
        return graph.constant(1.0);
    }
    if let Some(inner) = negated(graph, left) {
        let quotient = graph.divide(inner, right);
        return graph.negate(quotient);
    }
    graph.intern(Operation::Binary(Binary::Divide, left, right))
}

fn power(graph: &mut Graph, base: Node, exponent: Node, value: Option<f64>) -> Node {
    match value {
        Some(0.0) => graph.constant(1.0),
        Some(1.0) => base,
        Some(2.0) => graph.multiply(base, base),
        Some(0.5) => graph.unary(Unary::Sqrt, base),
        Some(-1.0) => {
            let one = graph.constant(1.0);
            graph.divide(one, base)
        }
        _ => graph.intern(Operation::Binary(Binary::Power, base, exponent)),
    }
}

impl Unary {
    /// The value of the function.
    pub fn evaluate(self, x: f64) -> f64 {
        match self {
            Unary::Negate => -x,
            Unary::Sin => x.sin(),
            Unary::Cos => x.cos(),
            Unary::Tan => x.tan(),
            Unary::Asin => x.asin(),
            Unary::Acos => x.acos(),
            Unary::Atan => x.atan(),
            Unary::Sinh => x.sinh(),
            Unary::Cosh => x.cosh(),
            Unary::Tanh => x.tanh(),
            Unary::Exp => x.exp(),
            Unary::Log => x.ln(),
            Unary::Sqrt => x.sqrt(),
            Unary::Abs => x.abs(),
            Unary::Sign => {
                if x > 0.0 {
                    1.0
                } else if x < 0.0 {
                    -1.0
                } else {
                    0.0
                }
            }
            Unary::Floor => x.floor(),
        }
    }
}

impl Binary {
    /// The value of the function.
    pub fn evaluate(self, a: f64, b: f64) -> f64 {
        match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Divide => a / b,
            Binary::Power => a.powf(b),
            Binary::Minimum => a.min(b),
            Binary::Maximum => a.max(b),
            Binary::Atan2 => a.atan2(b),
            Binary::Less => f64::from(u8::from(a < b)),
        }
    }
}
