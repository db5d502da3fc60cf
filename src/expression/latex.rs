//! Expressions as LaTeX, for papers and reports.

use super::graph::{Binary, Graph, Node, Operation, Unary};
use super::print::Printer;

/// Writes expressions of a graph as LaTeX mathematics.
///
/// Shares the named subexpressions of a [`Printer`]; they become `e_{1}`, `e_{2}`, ...
pub struct LatexPrinter<'a> {
    graph: &'a Graph,
    input_names: &'a [String],
    plain: Printer<'a>,
    symbol: fn(&str) -> String,
}

/// How tightly a formula binds; a fraction needs no brackets within products.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Atom,
}

impl<'a> LatexPrinter<'a> {
    /// `symbol` writes the graph's names, see [`latex_name`].
    pub fn new(graph: &'a Graph, input_names: &'a [String], roots: &[Node], symbol: fn(&str) -> String) -> Self {
        Self { graph, input_names, plain: Printer::sharing(graph, input_names, roots), symbol }
    }

    /// (name, formula) of the named subexpressions, each before its first use.
    pub fn definitions(&self) -> Vec<(String, String)> {
        self.plain.named().map(|(node, name)| (named(name), self.operation(node).0)).collect()
    }

    pub fn text(&self, node: Node) -> String {
        self.bound(node).0
    }

    fn bound(&self, node: Node) -> (String, Binding) {
        match self.plain.name_of(node) {
            Some(name) => (named(name), Binding::Atom),
            None => self.operation(node),
        }
    }

    fn operand(&self, node: Node, least: Binding) -> String {
        let (text, binding) = self.bound(node);
        if binding < least { format!(r"\left({text}\right)") } else { text }
    }

    fn operation(&self, node: Node) -> (String, Binding) {
        match self.graph.operation(node) {
            Operation::Constant(bits) => number(f64::from_bits(bits)),
            Operation::Symbol(symbol) => ((self.symbol)(self.graph.symbol_name(symbol)), Binding::Atom),
            Operation::Unary(function, a) => self.unary(function, a),
            Operation::Binary(function, a, b) => self.binary(function, a, b),
            Operation::Select { condition, then, otherwise } => {
                let [condition, then, otherwise] = [condition, then, otherwise].map(|node| self.text(node));
                let text = format!(
                    r"\begin{{cases}} {then} & \text{{if }} {condition} \\ {otherwise} & \text{{else}} \end{{cases}}"
                );
                (text, Binding::Sum)
            }
            Operation::Sample { input, order, time } => {
                let curve = self.graph.curve(input).map(|curve| curve.name.as_str());
                let name = curve.or(self.input_names.get(input as usize).map(String::as_str)).unwrap_or("input");
                let primes = "'".repeat(order.into());
                (format!(r"{}{primes}\left({}\right)", latex_name(name), self.text(time)), Binding::Atom)
            }
        }
    }

    fn unary(&self, function: Unary, a: Node) -> (String, Binding) {
        let name = match function {
            Unary::Negate => return (format!("-{}", self.operand(a, Binding::Product)), Binding::Sum),
            Unary::Sqrt => return (format!(r"\sqrt{{{}}}", self.text(a)), Binding::Atom),
            Unary::Abs => return (format!(r"\left|{}\right|", self.text(a)), Binding::Atom),
            Unary::Floor => return (format!(r"\left\lfloor {}\right\rfloor", self.text(a)), Binding::Atom),
            Unary::Asin => r"\arcsin",
            Unary::Acos => r"\arccos",
            Unary::Atan => r"\arctan",
            Unary::Log => r"\ln",
            Unary::Sign => r"\operatorname{sign}",
            Unary::Sin => r"\sin",
            Unary::Cos => r"\cos",
            Unary::Tan => r"\tan",
            Unary::Sinh => r"\sinh",
            Unary::Cosh => r"\cosh",
            Unary::Tanh => r"\tanh",
            Unary::Exp => r"\exp",
        };
        (format!(r"{name}\left({}\right)", self.text(a)), Binding::Atom)
    }

    fn binary(&self, function: Binary, a: Node, b: Node) -> (String, Binding) {
        let is_number = |node: Node| self.graph.constant_value(node).is_some();
        let (a, b) = if function == Binary::Multiply && is_number(b) { (b, a) } else { (a, b) };
        let call = |name: &str| (format!(r"{name}\left({}, {}\right)", self.text(a), self.text(b)), Binding::Atom);
        match function {
            Binary::Add => {
                (format!("{} + {}", self.operand(a, Binding::Sum), self.operand(b, Binding::Product)), Binding::Sum)
            }
            Binary::Subtract => {
                (format!("{} - {}", self.operand(a, Binding::Sum), self.operand(b, Binding::Product)), Binding::Sum)
            }
            Binary::Multiply if a == b => (format!("{}^{{2}}", self.operand(a, Binding::Atom)), Binding::Product),
            Binary::Multiply => {
                let sign = if is_number(a) && is_number(b) { r" \cdot " } else { r" \, " };
                let factors = [a, b].map(|node| self.operand(node, Binding::Product));
                (factors.join(sign), Binding::Product)
            }
            Binary::Divide => (format!(r"\frac{{{}}}{{{}}}", self.text(a), self.text(b)), Binding::Product),
            Binary::Power => (format!("{}^{{{}}}", self.operand(a, Binding::Atom), self.text(b)), Binding::Product),
            Binary::Less => {
                (format!("{} < {}", self.operand(a, Binding::Sum), self.operand(b, Binding::Sum)), Binding::Sum)
            }
            Binary::Minimum => call(r"\min"),
            Binary::Maximum => call(r"\max"),
            Binary::Atan2 => call(r"\operatorname{atan2}"),
        }
    }
}

/// `e12` as `e_{12}`.
fn named(name: &str) -> String {
    format!("e_{{{}}}", name.trim_start_matches('e'))
}

/// A name of the study as a symbol: `c_tyre` is c with an index, other words are upright.
pub fn latex_name(name: &str) -> String {
    let escaped = |text: &str| text.replace('_', r"\_").replace('[', "{[}").replace(']', "{]}");
    let (head, index) = name.split_once(['_', '.']).unwrap_or((name, ""));
    let head = if head.chars().count() == 1 { head.to_owned() } else { format!(r"\mathrm{{{}}}", escaped(head)) };
    if index.is_empty() { head } else { format!(r"{head}_{{\mathrm{{{}}}}}", escaped(index)) }
}

fn number(value: f64) -> (String, Binding) {
    let is_plain = value == 0.0 || !value.is_finite() || (1e-4..1e7).contains(&value.abs());
    let text = if is_plain {
        format!("{value}")
    } else {
        let text = format!("{value:e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        format!(r"{mantissa} \cdot 10^{{{exponent}}}")
    };
    let binding = match (value < 0.0, is_plain) {
        (true, _) => Binding::Sum,
        (false, true) => Binding::Atom,
        (false, false) => Binding::Product,
    };
    (text, binding)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_read_as_in_a_paper() {
        let mut g = Graph::new();
        let [x, y, k] = ["x", "y", "c_tyre"].map(|name| g.named(name));
        let sum = g.add(x, y);
        let three = g.constant(3.0);
        let cases = [
            (g.divide(sum, k), r"\frac{x + y}{c_{\mathrm{tyre}}}"),
            (g.multiply(three, sum), r"3 \, \left(x + y\right)"),
            (g.multiply(sum, sum), r"\left(x + y\right)^{2}"),
            (g.unary(Unary::Sqrt, sum), r"\sqrt{x + y}"),
            (g.unary(Unary::Tanh, x), r"\tanh\left(x\right)"),
        ];
        for (node, expected) in cases {
            assert_eq!(LatexPrinter::new(&g, &[], &[node], latex_name).text(node), expected);
        }
        assert_eq!(number(2.5e-9).0, r"2.5 \cdot 10^{-9}");
        assert_eq!(latex_name("strut.z"), r"\mathrm{strut}_{\mathrm{z}}");
    }
}
