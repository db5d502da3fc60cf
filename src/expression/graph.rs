//! The arena of nodes.

use super::curve::Curve;
use rustc_hash::FxHashMap;
use std::collections::HashMap;
use std::sync::Arc;

/// A node of a [`Graph`]; meaningless without it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Node(pub(super) u32);

/// A named free variable of a [`Graph`] (time, a state, a parameter, a kinematic quantity of an element).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub(super) u32);

/// Functions of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Unary {
    Negate,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Log,
    Sqrt,
    Abs,
    /// -1, 0 or 1.
    Sign,
    Floor,
}

/// Functions of two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    /// `base ^ exponent`.
    Power,
    Minimum,
    Maximum,
    Atan2,
    /// 1 where left < right, else 0.
    Less,
}

/// What a node computes. Constants are kept as bits so that equality and hashing are exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    Constant(u64),
    Symbol(Symbol),
    Unary(Unary, Node),
    Binary(Binary, Node, Node),
    /// `condition != 0 ? then : otherwise`.
    Select {
        condition: Node,
        then: Node,
        otherwise: Node,
    },
    /// The `order`-th time derivative of sampled input channel `input`, at an arbitrary time argument, so that
    /// a delayed input is `Sample { time: t - delay }` and differentiable with respect to the delay. From [`CURVES`] on
    /// the channels are the curves of the graph, functions of any argument.
    Sample {
        input: u32,
        order: u8,
        time: Node,
    },
}

/// Hash-consed arena of operations. Children always precede their parents, so ascending node order is an
/// evaluation order.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    operations: Vec<Operation>,
    index: FxHashMap<Operation, Node>,
    symbol_names: Vec<String>,
    symbol_index: FxHashMap<String, Symbol>,
    curves: Vec<Arc<Curve>>,
}

/// Channels of [`Operation::Sample`] from here on are curves.
pub const CURVES: u32 = 1 << 30;
/// Channels from here on are no curves.
const CURVES_END: u32 = 1 << 31;

/// The curve that a channel of samples means.
pub fn curve_of(curves: &[Arc<Curve>], channel: u32) -> Option<&Arc<Curve>> {
    (CURVES..CURVES_END).contains(&channel).then(|| curves.get((channel - CURVES) as usize))?
}

impl Graph {
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of distinct nodes.
    pub fn len(&self) -> usize {
        self.operations.len()
    }

    pub fn is_empty(&self) -> bool {
        self.operations.is_empty()
    }

    pub fn operation(&self, node: Node) -> Operation {
        self.operations[node.0 as usize]
    }

    /// The symbol of this name, made on first use.
    pub fn symbol(&mut self, name: &str) -> Symbol {
        if let Some(&symbol) = self.symbol_index.get(name) {
            return symbol;
        }
        let symbol = Symbol(self.symbol_names.len() as u32);
        self.symbol_names.push(name.to_owned());
        self.symbol_index.insert(name.to_owned(), symbol);
        symbol
    }

    pub fn symbol_name(&self, symbol: Symbol) -> &str {
        &self.symbol_names[symbol.0 as usize]
    }

    /// The node that stands for a symbol.
    pub fn variable(&mut self, symbol: Symbol) -> Node {
        self.intern(Operation::Symbol(symbol))
    }

    /// Short for [`Graph::symbol`] followed by [`Graph::variable`].
    pub fn named(&mut self, name: &str) -> Node {
        let symbol = self.symbol(name);
        self.variable(symbol)
    }

    pub fn constant(&mut self, value: f64) -> Node {
        // One zero: -0.0 and 0.0 must be the same node.
        let value = if value == 0.0 { 0.0 } else { value };
        self.intern(Operation::Constant(value.to_bits()))
    }

    pub fn constant_value(&self, node: Node) -> Option<f64> {
        match self.operation(node) {
            Operation::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    pub fn is_zero(&self, node: Node) -> bool {
        self.constant_value(node) == Some(0.0)
    }

    pub fn unary(&mut self, function: Unary, argument: Node) -> Node {
        super::simplify::unary(self, function, argument)
    }

    pub fn binary(&mut self, function: Binary, left: Node, right: Node) -> Node {
        super::simplify::binary(self, function, left, right)
    }

    pub fn add(&mut self, left: Node, right: Node) -> Node {
        self.binary(Binary::Add, left, right)
    }

    pub fn subtract(&mut self, left: Node, right: Node) -> Node {
        self.binary(Binary::Subtract, left, right)
    }

    pub fn multiply(&mut self, left: Node, right: Node) -> Node {
        self.binary(Binary::Multiply, left, right)
    }

    pub fn divide(&mut self, left: Node, right: Node) -> Node {
        self.binary(Binary::Divide, left, right)
    }

    pub fn negate(&mut self, argument: Node) -> Node {
        self.unary(Unary::Negate, argument)
    }

    pub fn select(&mut self, condition: Node, then: Node, otherwise: Node) -> Node {
        super::simplify::select(self, condition, then, otherwise)
    }

    /// See [`Operation::Sample`].
    pub fn sample(&mut self, input: u32, order: u8, time: Node) -> Node {
        if let Some(curve) = self.curve(input) {
            let known = if order > curve.degree {
                Some(0.0)
            } else {
                self.constant_value(time).map(|x| curve.evaluate(x, order))
            };
            if let Some(value) = known {
                return self.constant(value);
            }
        }
        self.intern(Operation::Sample { input, order, time })
    }

    /// Takes a curve in; the channel by which [`Graph::sample`] means it.
    pub fn add_curve(&mut self, curve: Curve) -> u32 {
        self.curves.push(Arc::new(curve));
        CURVES + (self.curves.len() - 1) as u32
    }

    pub fn curve(&self, channel: u32) -> Option<&Arc<Curve>> {
        curve_of(&self.curves, channel)
    }

    /// All curves, by channel from [`CURVES`] on.
    pub fn curves(&self) -> &[Arc<Curve>] {
        &self.curves
    }

    /// The node for an operation as it stands, without simplification.
    pub(super) fn intern(&mut self, operation: Operation) -> Node {
        if let Some(&node) = self.index.get(&operation) {
            return node;
        }
        let node = Node(self.operations.len() as u32);
        self.operations.push(operation);
        self.index.insert(operation, node);
        node
    }

    /// All nodes that `roots` need, each once, children before parents.
    pub fn reachable(&self, roots: &[Node]) -> Vec<Node> {
        let size = roots.iter().map(|root| root.index() + 1).max().unwrap_or(0);
        let mut needed = vec![false; size];
        let mut stack: Vec<Node> = roots.to_vec();
        while let Some(node) = stack.pop() {
            if std::mem::replace(&mut needed[node.0 as usize], true) {
                continue;
            }
            stack.extend(self.operation(node).children());
        }
        (0..size as u32).map(Node).filter(|n| needed[n.index()]).collect()
    }

    /// The symbols that `roots` depend on, in order of symbol creation.
    pub fn symbols_of(&self, roots: &[Node]) -> Vec<Symbol> {
        let mut symbols: Vec<Symbol> = self
            .reachable(roots)
            .into_iter()
            .filter_map(|node| match self.operation(node) {
                Operation::Symbol(symbol) => Some(symbol),
                _ => None,
            })
            .collect();
        symbols.sort();
        symbols
    }

    /// `roots` with symbols replaced by nodes (simultaneously; replacements are not substituted again).
    pub fn substitute(&mut self, roots: &[Node], replacements: &HashMap<Symbol, Node>) -> Vec<Node> {
        let mut image: Vec<Node> = (0..self.operations.len() as u32).map(Node).collect();
        for node in self.reachable(roots) {
            let of = |child: Node| image[child.index()];
            let operation = self.operation(node);
            if let Operation::Symbol(symbol) = operation {
                image[node.index()] = replacements.get(&symbol).copied().unwrap_or(node);
            } else if operation.children().any(|child| of(child) != child) {
                let new = self.rebuild(operation, of);
                image[node.index()] = new;
            }
        }
        roots.iter().map(|root| image[root.index()]).collect()
    }

    /// A graph of its own with only what `roots` need, same symbols; and the roots in it.
    pub fn extract(&self, roots: &[Node]) -> (Graph, Vec<Node>) {
        let needed = self.reachable(roots);
        let mut graph = Graph {
            operations: Vec::with_capacity(2 * needed.len()),
            index: FxHashMap::with_capacity_and_hasher(2 * needed.len(), Default::default()),
            symbol_names: self.symbol_names.clone(),
            symbol_index: self.symbol_index.clone(),
            curves: self.curves.clone(),
        };
        let mut image: Vec<Node> = vec![Node(0); self.operations.len()];
        for node in needed {
            let operation = self.operation(node).map_children(|child| image[child.index()]);
            image[node.index()] = graph.intern(operation);
        }
        (graph, roots.iter().map(|root| image[root.index()]).collect())
    }

    /// Values of `roots` where symbols and input samples have the given values. For checks at single points;
    /// repeated evaluation is the business of tapes.
    pub fn evaluate(
        &self,
        roots: &[Node],
        symbol: impl Fn(Symbol) -> f64,
        sample: impl Fn(u32, u8, f64) -> f64,
    ) -> Vec<f64> {
        let mut value = vec![0.0; self.operations.len()];
        for node in self.reachable(roots) {
            value[node.index()] = match self.operation(node) {
                Operation::Constant(bits) => f64::from_bits(bits),
                Operation::Symbol(s) => symbol(s),
                Operation::Unary(function, a) => function.evaluate(value[a.index()]),
                Operation::Binary(function, a, b) => function.evaluate(value[a.index()], value[b.index()]),
                Operation::Select { condition, then, otherwise } => {
                    value[if value[condition.index()] != 0.0 { then } else { otherwise }.index()]
                }
                Operation::Sample { input, order, time } => match self.curve(input) {
                    Some(curve) => curve.evaluate(value[time.index()], order),
                    None => sample(input, order, value[time.index()]),
                },
            };
        }
        roots.iter().map(|root| value[root.index()]).collect()
    }

    /// `operation` with other operands, simplified.
    pub fn rebuild(&mut self, operation: Operation, of: impl Fn(Node) -> Node) -> Node {
        match operation {
            Operation::Constant(_) | Operation::Symbol(_) => self.intern(operation),
            Operation::Unary(function, a) => self.unary(function, of(a)),
            Operation::Binary(function, a, b) => self.binary(function, of(a), of(b)),
            Operation::Select { condition, then, otherwise } => self.select(of(condition), of(then), of(otherwise)),
            Operation::Sample { input, order, time } => self.sample(input, order, of(time)),
        }
    }
}

impl Node {
    /// Position in the graph's order of evaluation, below [`Graph::len`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl Operation {
    fn map_children(self, of: impl Fn(Node) -> Node) -> Operation {
        match self {
            Operation::Constant(_) | Operation::Symbol(_) => self,
            Operation::Unary(function, a) => Operation::Unary(function, of(a)),
            Operation::Binary(function, a, b) => Operation::Binary(function, of(a), of(b)),
            Operation::Select { condition, then, otherwise } => {
                Operation::Select { condition: of(condition), then: of(then), otherwise: of(otherwise) }
            }
            Operation::Sample { input, order, time } => Operation::Sample { input, order, time: of(time) },
        }
    }

    /// The nodes this operation reads.
    pub fn children(self) -> impl Iterator<Item = Node> {
        let list = match self {
            Operation::Constant(_) | Operation::Symbol(_) => [None, None, None],
            Operation::Unary(_, a) | Operation::Sample { time: a, .. } => [Some(a), None, None],
            Operation::Binary(_, a, b) => [Some(a), Some(b), None],
            Operation::Select { condition, then, otherwise } => [Some(condition), Some(then), Some(otherwise)],
        };
        list.into_iter().flatten()
    }
}
