//! Stable text of expressions.

use super::graph::{Binary, Graph, Node, Operation, Unary};
use std::collections::HashMap;

/// Subexpressions nested deeper than this get a name of their own.
const DEEPEST_NESTING: usize = 12;
/// Subexpressions with at least this many operations get a name when they are used twice.
const SMALLEST_SHARED: usize = 2;

/// Writes expressions of a graph as infix text.
///
/// Names of symbols are those of the graph; `e1`, `e2`, ... stand for common subexpressions.
pub struct Printer<'a> {
    graph: &'a Graph,
    input_names: &'a [String],
    names: HashMap<Node, String>,
    /// Named subexpressions in order of definition.
    definitions: Vec<Node>,
}

/// How tightly an operator binds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Choice,
    Sum,
    Product,
    Power,
    Atom,
}

impl<'a> Printer<'a> {
    /// Writes every expression in full. `input_names`: by channel of [`Operation::Sample`].
    pub fn plain(graph: &'a Graph, input_names: &'a [String]) -> Self {
        Self { graph, input_names, names: HashMap::new(), definitions: Vec::new() }
    }

    /// Names what `roots` use more than once, and what is nested too deeply to be read.
    pub fn sharing(graph: &'a Graph, input_names: &'a [String], roots: &[Node]) -> Self {
        let mut printer = Self::plain(graph, input_names);
        let nodes = graph.reachable(roots);
        let mut uses: HashMap<Node, usize> = HashMap::new();
        for child in nodes.iter().flat_map(|&node| graph.operation(node).children()).chain(roots.iter().copied()) {
            *uses.entry(child).or_default() += 1;
        }
        // Written size and depth of a node, named ones counting as atoms.
        let mut extent: HashMap<Node, (usize, usize)> = HashMap::new();
        for &node in &nodes {
            let operation = graph.operation(node);
            if matches!(operation, Operation::Constant(_) | Operation::Symbol(_)) {
                extent.insert(node, (0, 0));
                continue;
            }
            let children = operation.children().map(|child| extent[&child]);
            let (size, depth) = children.fold((1, 1), |(size, depth), (s, d)| (size + s, depth.max(d + 1)));
            let is_shared = uses.get(&node).copied().unwrap_or(0) > 1 && size >= SMALLEST_SHARED;
            if is_shared || depth > DEEPEST_NESTING {
                printer.definitions.push(node);
                printer.names.insert(node, format!("e{}", printer.definitions.len()));
                extent.insert(node, (0, 0));
            } else {
                extent.insert(node, (size, depth));
            }
        }
        printer
    }

    /// (name, text) of the named subexpressions, each before its first use.
    pub fn definitions(&self) -> Vec<(String, String)> {
        self.definitions.iter().map(|&node| (self.names[&node].clone(), self.operation(node).0)).collect()
    }

    /// The named subexpressions, each before its first use.
    pub(super) fn named(&self) -> impl Iterator<Item = (Node, &str)> {
        self.definitions.iter().map(|node| (*node, self.names[node].as_str()))
    }

    pub(super) fn name_of(&self, node: Node) -> Option<&str> {
        self.names.get(&node).map(String::as_str)
    }

    pub fn text(&self, node: Node) -> String {
        self.bound(node).0
    }

    fn bound(&self, node: Node) -> (String, Binding) {
        match self.names.get(&node) {
            Some(name) => (name.clone(), Binding::Atom),
            None => self.operation(node),
        }
    }

    /// `node` in brackets where it binds less tightly than `least`.
    fn operand(&self, node: Node, least: Binding) -> String {
        let (text, binding) = self.bound(node);
        if binding < least { format!("({text})") } else { text }
    }

    fn operation(&self, node: Node) -> (String, Binding) {
        match self.graph.operation(node) {
            Operation::Constant(bits) => number(f64::from_bits(bits)),
            Operation::Symbol(symbol) => (self.graph.symbol_name(symbol).to_owned(), Binding::Atom),
            Operation::Unary(Unary::Negate, a) => (format!("-{}", self.operand(a, Binding::Product)), Binding::Sum),
            Operation::Unary(function, a) => (format!("{}({})", function.name(), self.text(a)), Binding::Atom),
            Operation::Binary(function, a, b) => self.binary(function, a, b),
            Operation::Select { condition, then, otherwise } => {
                let [condition, then, otherwise] = [condition, then, otherwise].map(|n| self.operand(n, Binding::Sum));
                (format!("if {condition} then {then} else {otherwise}"), Binding::Choice)
            }
            Operation::Sample { input, order, time } => {
                let curve = self.graph.curve(input).map(|curve| curve.name.as_str());
                let name = curve.or(self.input_names.get(input as usize).map(String::as_str)).unwrap_or("input");
                (format!("{name}{}({})", "'".repeat(order.into()), self.text(time)), Binding::Atom)
            }
        }
    }

    fn binary(&self, function: Binary, a: Node, b: Node) -> (String, Binding) {
        // Numbers first in products.
        let is_number = |node: Node| self.graph.constant_value(node).is_some();
        let (a, b) = if function == Binary::Multiply && is_number(b) { (b, a) } else { (a, b) };
        let infix = |sign: &str, left: Binding, right: Binding, own: Binding| {
            (format!("{}{sign}{}", self.operand(a, left), self.operand(b, right)), own)
        };
        match function {
            Binary::Add => infix(" + ", Binding::Sum, Binding::Product, Binding::Sum),
            Binary::Subtract => infix(" - ", Binding::Sum, Binding::Product, Binding::Sum),
            Binary::Multiply if a == b => (format!("{}^2", self.operand(a, Binding::Atom)), Binding::Power),
            Binary::Multiply => infix("*", Binding::Product, Binding::Power, Binding::Product),
            Binary::Divide => infix("/", Binding::Product, Binding::Power, Binding::Product),
            Binary::Power => infix("^", Binding::Atom, Binding::Atom, Binding::Power),
            Binary::Less => infix(" < ", Binding::Sum, Binding::Sum, Binding::Choice),
            Binary::Minimum | Binary::Maximum | Binary::Atan2 => {
                (format!("{}({}, {})", function.name(), self.text(a), self.text(b)), Binding::Atom)
            }
        }
    }
}

/// Shortest text that reads back as the same number.
fn number(value: f64) -> (String, Binding) {
    let is_plain = value == 0.0 || !value.is_finite() || (1e-4..1e7).contains(&value.abs());
    let text = if is_plain { format!("{value}") } else { format!("{value:e}") };
    (text, if value < 0.0 { Binding::Sum } else { Binding::Atom })
}

impl Unary {
    /// As the language writes it.
    pub fn name(self) -> &'static str {
        match self {
            Unary::Negate => "negate",
            Unary::Sin => "sin",
            Unary::Cos => "cos",
            Unary::Tan => "tan",
            Unary::Asin => "asin",
            Unary::Acos => "acos",
            Unary::Atan => "atan",
            Unary::Sinh => "sinh",
            Unary::Cosh => "cosh",
            Unary::Tanh => "tanh",
            Unary::Exp => "exp",
            Unary::Log => "log",
            Unary::Sqrt => "sqrt",
            Unary::Abs => "abs",
            Unary::Sign => "sign",
            Unary::Floor => "floor",
        }
    }
}

impl Binary {
    /// As the language (or, for operators, a tape) writes it.
    pub fn name(self) -> &'static str {
        match self {
            Binary::Add => "add",
            Binary::Subtract => "subtract",
            Binary::Multiply => "multiply",
            Binary::Divide => "divide",
            Binary::Power => "power",
            Binary::Minimum => "min",
            Binary::Maximum => "max",
            Binary::Atan2 => "atan2",
            Binary::Less => "less",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brackets_are_where_they_change_the_meaning() {
        let mut g = Graph::new();
        let [x, y, z] = ["x", "y", "z"].map(|name| g.named(name));
        let sum = g.add(x, y);
        let inner = g.subtract(y, z);
        let cases = [
            (g.multiply(sum, z), "z*(x + y)"),
            (g.subtract(x, inner), "x - (y - z)"),
            (g.divide(x, sum), "x/(x + y)"),
            (g.negate(sum), "-(x + y)"),
            (g.multiply(sum, sum), "(x + y)^2"),
            (g.binary(Binary::Minimum, x, sum), "min(x, x + y)"),
        ];
        for (node, expected) in cases {
            let text = Printer::plain(&g, &[]).text(node);
            // Operands of commutative operations come in order of creation.
            assert!(text == expected || text == "(x + y)*z", "{text} instead of {expected}");
        }
        let quotient = g.divide(y, z);
        let nested = g.divide(x, quotient);
        assert_eq!(Printer::plain(&g, &[]).text(nested), "x/(y/z)");
    }

    #[test]
    fn common_subexpressions_are_named_once() {
        let mut g = Graph::new();
        let [x, y] = ["x", "y"].map(|name| g.named(name));
        let product = g.multiply(x, y);
        let shared = g.unary(Unary::Exp, product);
        let sine = g.unary(Unary::Sin, shared);
        let roots = [g.add(shared, x), g.multiply(sine, y)];
        let printer = Printer::sharing(&g, &[], &roots);
        assert_eq!(printer.definitions(), [("e1".to_owned(), "exp(x*y)".to_owned())]);
        assert_eq!(printer.text(roots[1]), "y*sin(e1)");
    }

    #[test]
    fn samples_show_input_and_derivative() {
        let mut g = Graph::new();
        let [t, tau] = ["t", "tau"].map(|name| g.named(name));
        let late = g.subtract(t, tau);
        let node = g.sample(1, 2, late);
        let names = ["u".to_owned(), "q_ref".to_owned()];
        assert_eq!(Printer::plain(&g, &names).text(node), "q_ref''(t - tau)");
    }
}
