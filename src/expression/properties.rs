//! Random expressions: the graph against plain evaluation of the same tree, derivatives against differences.

use super::{Binary, Graph, Node, Symbol, Unary};
use std::collections::HashMap;

/// An expression as written, without any simplification.
#[derive(Clone, Debug)]
enum Tree {
    Constant(f64),
    Symbol(usize),
    Unary(Unary, Box<Tree>),
    Binary(Binary, Box<Tree>, Box<Tree>),
    Select(Box<[Tree; 3]>),
}

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as usize
    }

    fn real(&mut self) -> f64 {
        self.below(4001) as f64 / 1000.0 - 2.0
    }

    fn tree(&mut self, depth: usize, is_smooth: bool) -> Tree {
        if depth == 0 || self.below(8) == 0 {
            return match self.below(5) {
                0 => Tree::Constant([0.0, 1.0, -1.0, 2.0, 0.5, -3.0][self.below(6)]),
                1 => Tree::Constant(self.real()),
                _ => Tree::Symbol(self.below(3)),
            };
        }
        let sub = |random: &mut Self| Box::new(random.tree(depth - 1, is_smooth));
        match self.below(10) {
            0 | 1 => Tree::Unary(self.unary(is_smooth), sub(self)),
            2 if !is_smooth => Tree::Select(Box::new([*sub(self), *sub(self), *sub(self)])),
            3 => {
                let exponent = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 5.0][self.below(7)];
                Tree::Binary(Binary::Power, sub(self), Box::new(Tree::Constant(exponent)))
            }
            _ => Tree::Binary(self.binary(is_smooth), sub(self), sub(self)),
        }
    }

    fn unary(&mut self, is_smooth: bool) -> Unary {
        use Unary::*;
        let smooth = [Negate, Negate, Sin, Cos, Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Exp, Log, Sqrt];
        if !is_smooth && self.below(4) == 0 { [Abs, Sign, Floor][self.below(3)] } else { smooth[self.below(14)] }
    }

    fn binary(&mut self, is_smooth: bool) -> Binary {
        use Binary::*;
        let smooth = [Add, Add, Subtract, Subtract, Multiply, Multiply, Multiply, Divide, Power, Atan2];
        if !is_smooth && self.below(4) == 0 { [Minimum, Maximum, Less][self.below(3)] } else { smooth[self.below(10)] }
    }
}

impl Tree {
    fn build(&self, graph: &mut Graph, symbols: &[Symbol]) -> Node {
        match self {
            Tree::Constant(value) => graph.constant(*value),
            Tree::Symbol(i) => graph.variable(symbols[*i]),
            Tree::Unary(function, a) => {
                let a = a.build(graph, symbols);
                graph.unary(*function, a)
            }
            Tree::Binary(function, a, b) => {
                let (a, b) = (a.build(graph, symbols), b.build(graph, symbols));
                graph.binary(*function, a, b)
            }
            Tree::Select(parts) => {
                let [condition, then, otherwise] = [0, 1, 2].map(|i| parts[i].build(graph, symbols));
                graph.select(condition, then, otherwise)
            }
        }
    }

    /// Value, and a bound on what rounding can do to it: every operation is also evaluated at operands moved by
    /// their own bounds.
    fn evaluate(&self, x: &[f64]) -> (f64, f64) {
        let spread = |values: &[f64]| {
            let widest = values.iter().map(|value| (value - values[0]).abs()).fold(0.0, f64::max);
            let is_defined = values.iter().all(|value| value.is_finite());
            (values[0], if is_defined { widest + 1e-14 * values[0].abs() } else { f64::INFINITY })
        };
        match self {
            Tree::Constant(value) => (*value, 0.0),
            Tree::Symbol(i) => (x[*i], 0.0),
            Tree::Unary(function, a) => {
                let (a, e) = a.evaluate(x);
                // Kinks and steps within reach of rounding count as undefined, as do ends of a domain.
                let is_at_end = match function {
                    Unary::Sqrt => a <= e,
                    Unary::Asin | Unary::Acos => 1.0 - a.abs() <= e,
                    _ => e.is_infinite(),
                };
                if is_at_end {
                    return (function.evaluate(a), f64::INFINITY);
                }
                spread(&[a, a - 1e-14 * a.abs() - e, a + 1e-14 * a.abs() + e].map(|a| function.evaluate(a)))
            }
            Tree::Binary(function, a, b) => {
                let ((a, ea), (b, eb)) = (a.evaluate(x), b.evaluate(x));
                let is_at_end = match function {
                    Binary::Power => a.abs() <= ea,
                    // Signed zeros decide the side of the cut.
                    Binary::Atan2 => a.abs() <= ea,
                    _ => (ea + eb).is_infinite(),
                };
                if is_at_end {
                    return (function.evaluate(a, b), f64::INFINITY);
                }
                let corners = [(0.0, 0.0), (ea, eb), (ea, -eb), (-ea, eb), (-ea, -eb)];
                spread(&corners.map(|(da, db)| function.evaluate(a + da, b + db)))
            }
            Tree::Select(parts) => {
                let [(condition, e), then, otherwise] = [0, 1, 2].map(|i| parts[i].evaluate(x));
                let is_certain = condition.abs() > e || (condition == 0.0 && e == 0.0);
                let chosen = if condition != 0.0 { then } else { otherwise };
                if is_certain && then.1.is_finite() && otherwise.1.is_finite() {
                    chosen
                } else {
                    (chosen.0, f64::INFINITY)
                }
            }
        }
    }
}

fn value(graph: &Graph, node: Node, symbols: &[Symbol], x: &[f64]) -> f64 {
    let known: HashMap<Symbol, f64> = symbols.iter().copied().zip(x.iter().copied()).collect();
    graph.evaluate(&[node], |symbol| known[&symbol], |_, _, _| f64::NAN)[0]
}

#[test]
fn simplified_expressions_keep_their_value() {
    let mut random = Random(1);
    let mut compared = 0;
    for _ in 0..20_000 {
        let tree = random.tree(5, false);
        let mut graph = Graph::new();
        let symbols = ["x", "y", "z"].map(|name| graph.symbol(name));
        let node = tree.build(&mut graph, &symbols);
        let x = [random.real(), random.real(), random.real()];
        let (expected, bound) = tree.evaluate(&x);
        let is_exact = bound <= 1e-6 * (1.0 + expected.abs());
        if !expected.is_finite() || !is_exact {
            continue;
        }
        compared += 1;
        let actual = value(&graph, node, &symbols, &x);
        let allowed = 100.0 * bound + 1e-12 * (1.0 + expected.abs());
        assert!((actual - expected).abs() <= allowed, "{actual} instead of {expected} at {x:?}: {tree:?}");
    }
    assert!(compared > 5_000, "only {compared} expressions were well-conditioned");
}

#[test]
fn derivatives_match_differences() {
    let mut random = Random(2);
    let mut compared = 0;
    for _ in 0..20_000 {
        let tree = random.tree(4, true);
        let mut graph = Graph::new();
        let symbols = ["x", "y", "z"].map(|name| graph.symbol(name));
        let node = tree.build(&mut graph, &symbols);
        let x = [random.real(), random.real(), random.real()];
        let difference = |h: f64| {
            let moved = |h: f64| tree.evaluate(&[x[0] + h, x[1], x[2]]);
            let ((after, ea), (before, eb)) = (moved(h), moved(-h));
            ((after - before) / (2.0 * h), (ea + eb) / h)
        };
        // Third derivatives show in the step's influence; rounding in the bound.
        let ((coarse, _), (fine, noise)) = (difference(4e-4), difference(2e-4));
        let uncertainty = (coarse - fine).abs() + noise;
        let is_exact = uncertainty < 1e-5 * (1.0 + fine.abs());
        if !fine.is_finite() || !is_exact {
            continue;
        }
        compared += 1;
        let slope = graph.differentiate(&[node], symbols[0])[0];
        let actual = value(&graph, slope, &symbols, &x);
        let allowed = 10.0 * uncertainty + 1e-9 * (1.0 + fine.abs());
        assert!((actual - fine).abs() <= allowed, "{actual} instead of {fine} at {x:?}: {tree:?}");
    }
    assert!(compared > 5_000, "only {compared} derivatives were well-conditioned");
}

#[test]
fn jacobian_collects_what_single_derivatives_give() {
    let mut graph = Graph::new();
    let symbols = ["x", "y", "z"].map(|name| graph.symbol(name));
    let [x, y, z] = symbols.map(|symbol| graph.variable(symbol));
    let product = graph.multiply(x, y);
    let sine = graph.unary(Unary::Sin, z);
    let roots = [product, sine, graph.constant(3.0)];
    let entries = graph.jacobian(&roots, &symbols);
    let places: Vec<(usize, usize)> = entries.iter().map(|entry| (entry.row, entry.column)).collect();
    assert_eq!(places, [(0, 0), (0, 1), (1, 2)]);
    for entry in entries {
        assert_eq!(graph.differentiate(&roots, symbols[entry.column])[entry.row], entry.value);
    }
}

#[test]
fn structural_zeros_and_constants_vanish() {
    let mut g = Graph::new();
    let [x, y] = ["x", "y"].map(|name| g.named(name));
    let [zero, one, two] = [0.0, 1.0, 2.0].map(|c| g.constant(c));
    assert_eq!(g.multiply(zero, x), zero);
    let sum = g.add(x, y);
    assert_eq!(g.subtract(sum, x), y);
    assert_eq!(g.divide(sum, sum), one);
    let (s, c) = (g.unary(Unary::Sin, x), g.unary(Unary::Cos, x));
    let (ss, cc) = (g.multiply(s, s), g.multiply(c, c));
    assert_eq!(g.add(cc, ss), one);
    let shifted = g.add(x, two);
    assert_eq!(g.subtract(shifted, two), x);
    let mirrored = g.subtract(two, x);
    assert_eq!(g.subtract(two, mirrored), x);
    let (a, b) = (g.multiply(x, y), g.multiply(y, x));
    assert_eq!(a, b);
    let (p, q) = (g.negate(x), g.negate(y));
    assert_eq!(g.multiply(p, q), a);
}
