//! The rule table that is applied whenever a node is built.
//!
//! Rules keep the value up to rounding wherever all operands are finite. `0 x = 0`, `x - x = 0` and `x / x = 1` also
//! hold where the unsimplified form would be undefined: a structural zero must vanish whatever it multiplies.

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
        (Unary::Cos | Unary::Cosh, Operation::Unary(Unary::Negate, inner)) => graph.unary(function, inner),
        (Unary::Sin | Unary::Tan | Unary::Tanh | Unary::Sinh | Unary::Atan | Unary::Asin | Unary::Sign, _)
            if negated(graph, argument).is_some() =>
        {
            let positive = negated(graph, argument).unwrap_or(argument);
            let value = graph.unary(function, positive);
            graph.negate(value)
        }
        (Unary::Sign, Operation::Unary(Unary::Sign, _)) => argument,
        (Unary::Floor, Operation::Unary(Unary::Floor, _)) => argument,
        (Unary::Sqrt, Operation::Binary(Binary::Multiply, a, b)) if a == b => graph.unary(Unary::Abs, a),
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
        Binary::Minimum | Binary::Maximum if left > right => graph.intern(Operation::Binary(function, right, left)),
        Binary::Less if left == right => graph.constant(0.0),
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

/// `(c, x)` of `c + x` with constant c; constants may stand on either side.
fn constant_sum(graph: &Graph, node: Node) -> Option<(f64, Node)> {
    match graph.operation(node) {
        Operation::Binary(Binary::Add, a, b) => match (graph.constant_value(a), graph.constant_value(b)) {
            (Some(c), _) => Some((c, b)),
            (_, Some(c)) => Some((c, a)),
            _ => None,
        },
        Operation::Binary(Binary::Subtract, a, b) => graph.constant_value(b).map(|c| (-c, a)),
        _ => None,
    }
}

/// `(c, x)` of `c - x` with constant c.
fn constant_difference(graph: &Graph, node: Node) -> Option<(f64, Node)> {
    match graph.operation(node) {
        Operation::Binary(Binary::Subtract, a, b) => graph.constant_value(a).map(|c| (c, b)),
        _ => None,
    }
}

/// `(c, x)` of `c x` with constant c.
fn constant_product(graph: &Graph, node: Node) -> Option<(f64, Node)> {
    match graph.operation(node) {
        Operation::Binary(Binary::Multiply, a, b) => match (graph.constant_value(a), graph.constant_value(b)) {
            (Some(c), _) => Some((c, b)),
            (_, Some(c)) => Some((c, a)),
            _ => None,
        },
        _ => None,
    }
}

/// The angle of `sin(angle)^2` or `cos(angle)^2`.
fn squared(graph: &Graph, node: Node, function: Unary) -> Option<Node> {
    match graph.operation(node) {
        Operation::Binary(Binary::Multiply, a, b) if a == b => match graph.operation(a) {
            Operation::Unary(f, angle) if f == function => Some(angle),
            _ => None,
        },
        _ => None,
    }
}

fn is_sine_and_cosine_squared(graph: &Graph, left: Node, right: Node) -> bool {
    let sine_first = squared(graph, left, Unary::Sin).zip(squared(graph, right, Unary::Cos));
    let cosine_first = squared(graph, left, Unary::Cos).zip(squared(graph, right, Unary::Sin));
    sine_first.or(cosine_first).is_some_and(|(a, b)| a == b)
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
    for (constant, other) in [(a, right), (b, left)] {
        let Some(c) = constant else { continue };
        if let Some((inner, rest)) = constant_sum(graph, other) {
            let sum = graph.constant(c + inner);
            return graph.add(sum, rest);
        }
        if let Some((inner, rest)) = constant_difference(graph, other) {
            let sum = graph.constant(c + inner);
            return graph.subtract(sum, rest);
        }
        if c < 0.0 {
            let positive = graph.constant(-c);
            return graph.subtract(other, positive);
        }
    }
    if is_sine_and_cosine_squared(graph, left, right) {
        return graph.constant(1.0);
    }
    if let (Operation::Binary(Binary::Subtract, a, b), Operation::Binary(Binary::Subtract, c, d)) =
        (graph.operation(left), graph.operation(right))
        && (a, b) == (d, c)
    {
        return graph.constant(0.0);
    }
    if left == right {
        let two = graph.constant(2.0);
        return graph.multiply(two, left);
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
    if let Some(inner) = negated(graph, left) {
        let sum = graph.add(inner, right);
        return graph.negate(sum);
    }
    if let Some(c) = b {
        let minus = graph.constant(-c);
        if c < 0.0 || constant_sum(graph, left).or(constant_difference(graph, left)).is_some() {
            return graph.add(left, minus);
        }
    }
    if let Some(c) = a {
        if let Some((inner, rest)) = constant_sum(graph, right) {
            let difference = graph.constant(c - inner);
            return graph.subtract(difference, rest);
        }
        if let Some((inner, rest)) = constant_difference(graph, right) {
            let difference = graph.constant(c - inner);
            return graph.add(difference, rest);
        }
        if c < 0.0 {
            let positive = graph.constant(-c);
            let sum = graph.add(positive, right);
            return graph.negate(sum);
        }
    }
    if let Some(difference) = cancelled(graph, left, right) {
        return difference;
    }
    graph.intern(Operation::Binary(Binary::Subtract, left, right))
}

/// `(x + y) - x`, `x - (x + y)`, `(x - y) - x` and `x - (x - y)`, as displacements from a reference produce them.
fn cancelled(graph: &mut Graph, left: Node, right: Node) -> Option<Node> {
    match (graph.operation(left), graph.operation(right)) {
        (Operation::Binary(Binary::Add, a, b), _) if a == right => Some(b),
        (Operation::Binary(Binary::Add, a, b), _) if b == right => Some(a),
        (Operation::Binary(Binary::Subtract, a, b), _) if a == right => Some(graph.negate(b)),
        (_, Operation::Binary(Binary::Add, a, b)) if a == left => Some(graph.negate(b)),
        (_, Operation::Binary(Binary::Add, a, b)) if b == left => Some(graph.negate(a)),
        (_, Operation::Binary(Binary::Subtract, a, b)) if a == left => Some(b),
        _ => None,
    }
}

fn multiply(graph: &mut Graph, left: Node, right: Node, a: Option<f64>, b: Option<f64>) -> Node {
    for (constant, other) in [(a, right), (b, left)] {
        match constant {
            Some(0.0) => return graph.constant(0.0),
            Some(1.0) => return other,
            Some(c) if c < 0.0 => {
                let positive = graph.constant(-c);
                let product = graph.multiply(positive, other);
                return graph.negate(product);
            }
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
    for (constant, other) in [(a, right), (b, left)] {
        if let (Some(c), Some((inner, rest))) = (constant, constant_product(graph, other)) {
            let product = graph.constant(c * inner);
            return graph.multiply(product, rest);
        }
    }
    let (first, second) = if left <= right { (left, right) } else { (right, left) };
    graph.intern(Operation::Binary(Binary::Multiply, first, second))
}

fn divide(graph: &mut Graph, left: Node, right: Node, a: Option<f64>, b: Option<f64>) -> Node {
    if a == Some(0.0) {
        return left;
    }
    match (a, b) {
        (_, Some(1.0)) => return left,
        (_, Some(c)) if c < 0.0 => {
            let positive = graph.constant(-c);
            let quotient = graph.divide(left, positive);
            return graph.negate(quotient);
        }
        (Some(c), _) if c < 0.0 => {
            let positive = graph.constant(-c);
            let quotient = graph.divide(positive, right);
            return graph.negate(quotient);
        }
        _ => {}
    }
    if left == right {
        return graph.constant(1.0);
    }
    if let Some(inner) = negated(graph, left) {
        let quotient = graph.divide(inner, right);
        return graph.negate(quotient);
    }
    if let Some(inner) = negated(graph, right) {
        let quotient = graph.divide(left, inner);
        return graph.negate(quotient);
    }
    graph.intern(Operation::Binary(Binary::Divide, left, right))
}

/// Largest whole exponent that is written out as multiplications.
const LARGEST_WRITTEN_POWER: f64 = 8.0;

fn power(graph: &mut Graph, base: Node, exponent: Node, value: Option<f64>) -> Node {
    match value {
        Some(0.0) => graph.constant(1.0),
        Some(0.5) => graph.unary(Unary::Sqrt, base),
        Some(n) if n.fract() == 0.0 && n.abs() <= LARGEST_WRITTEN_POWER => {
            let written = whole_power(graph, base, n.abs() as u32);
            if n > 0.0 {
                return written;
            }
            let one = graph.constant(1.0);
            graph.divide(one, written)
        }
        _ => graph.intern(Operation::Binary(Binary::Power, base, exponent)),
    }
}

/// `base^n` for n > 0 by repeated squaring.
fn whole_power(graph: &mut Graph, base: Node, n: u32) -> Node {
    if n == 1 {
        return base;
    }
    let half = whole_power(graph, base, n / 2);
    let square = graph.multiply(half, half);
    if n.is_multiple_of(2) { square } else { graph.multiply(square, base) }
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
            // Unlike `f64::min`, an undefined operand makes the result undefined: failures must not be hidden.
            Binary::Minimum if a.is_nan() || a < b => a,
            Binary::Maximum if a.is_nan() || a > b => a,
            Binary::Minimum | Binary::Maximum => b,
            Binary::Atan2 => a.atan2(b),
            Binary::Less => f64::from(u8::from(a < b)),
        }
    }
}
