//! The arena of nodes.

use std::collections::HashMap;

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
    /// a delayed input is `Sample { time: t - delay }` and differentiable with respect to the delay.
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
    index: HashMap<Operation, Node>,
    symbol_names: Vec<String>,
    symbol_index: HashMap<String, Symbol>,
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
        self.intern(Operation::Sample { input, order, time })
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
        let mut needed = vec![false; self.operations.len()];
        let mut stack: Vec<Node> = roots.to_vec();
        while let Some(node) = stack.pop() {
            if std::mem::replace(&mut needed[node.0 as usize], true) {
                continue;
            }
            stack.extend(self.operation(node).children());
        }
        (0..self.operations.len() as u32).map(Node).filter(|n| needed[n.0 as usize]).collect()
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
        let mut image: HashMap<Node, Node> = HashMap::new();
        for node in self.reachable(roots) {
            let new = match self.operation(node) {
                Operation::Constant(_) => node,
                Operation::Symbol(symbol) => replacements.get(&symbol).copied().unwrap_or(node),
                Operation::Unary(function, a) => self.unary(function, image[&a]),
                Operation::Binary(function, a, b) => self.binary(function, image[&a], image[&b]),
                Operation::Select { condition, then, otherwise } => {
                    self.select(image[&condition], image[&then], image[&otherwise])
                }
                Operation::Sample { input, order, time } => self.sample(input, order, image[&time]),
            };
            image.insert(node, new);
        }
        roots.iter().map(|root| image[root]).collect()
    }
}

impl Operation {
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
