//! Functions that expressions can call.

use super::checker::{Checker, Scope};
use super::evaluate::{Typed, literal};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::expression::{Binary, Node, Operation, Unary};
use crate::quantities::Dimension;
use crate::syntax::{Expression, Name};
use std::collections::HashMap;

/// What a function does with the dimensions of its arguments.
#[derive(Clone, Copy)]
pub(super) enum Function {
    /// Dimensionless to dimensionless.
    Ratio(Unary),
    /// Keeps the dimension.
    Kept(Unary),
    Sign,
    Sqrt,
    /// Both arguments and the result have one dimension.
    Pair(Binary),
    Hypot,
    Atan2,
    Smoothstep,
    Delayed,
    Derivative,
}

pub(super) const FUNCTIONS: [(&str, usize, Function); 22] = [
    ("sin", 1, Function::Ratio(Unary::Sin)),
    ("cos", 1, Function::Ratio(Unary::Cos)),
    ("tan", 1, Function::Ratio(Unary::Tan)),
    ("asin", 1, Function::Ratio(Unary::Asin)),
    ("acos", 1, Function::Ratio(Unary::Acos)),
    ("atan", 1, Function::Ratio(Unary::Atan)),
    ("sinh", 1, Function::Ratio(Unary::Sinh)),
    ("cosh", 1, Function::Ratio(Unary::Cosh)),
    ("tanh", 1, Function::Ratio(Unary::Tanh)),
    ("exp", 1, Function::Ratio(Unary::Exp)),
    ("log", 1, Function::Ratio(Unary::Log)),
    ("floor", 1, Function::Ratio(Unary::Floor)),
    ("abs", 1, Function::Kept(Unary::Abs)),
    ("sign", 1, Function::Sign),
    ("sqrt", 1, Function::Sqrt),
    ("min", 2, Function::Pair(Binary::Minimum)),
    ("max", 2, Function::Pair(Binary::Maximum)),
    ("hypot", 2, Function::Hypot),
    ("atan2", 2, Function::Atan2),
    ("smoothstep", 1, Function::Smoothstep),
    ("delayed", 2, Function::Delayed),
    ("derivative", 1, Function::Derivative),
];

impl<'a> Checker<'a> {
    /// The value of `function(arguments)`.
    pub fn call(&mut self, function: &'a Name, arguments: &'a [Expression], span: Span, scope: Scope) -> Option<Typed> {
        let values: Vec<Option<Typed>> = arguments.iter().map(|argument| self.evaluate(argument, scope)).collect();
        if self.is_table(&function.text) {
            return self.call_table(function, arguments, &values, span, scope);
        }
        let Some(&(_, count, what)) = FUNCTIONS.iter().find(|(name, ..)| *name == function.text) else {
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no function `{}`", function.text))
                .label(function.span, "not a function")
                .suggest(similar_name(&function.text, self.function_names()))
                .note(format!("functions: {}", FUNCTIONS.map(|(name, ..)| name).join(", ")));
            return self.fail(diagnostic, scope);
        };
        if arguments.len() != count {
            let expected = if count == 1 { "1 argument".to_owned() } else { format!("{count} arguments") };
            let message = format!("`{}` takes {expected}, found {}", function.text, arguments.len());
            return self.fail(Diagnostic::error(Code::WRONG_ARGUMENTS, message).label(span, ""), scope);
        }
        if let (Function::Ratio(Unary::Sin | Unary::Cos | Unary::Tan), [argument]) = (what, arguments) {
            self.check_bare_angle(function, argument, scope);
        }
        let values: Option<Vec<(Typed, Span)>> =
            values.into_iter().zip(arguments).map(|(value, argument)| Some((value?, argument.span))).collect();
        self.apply_function(what, function, &values?, span, scope)
    }

    /// `sin(30)` is most probably meant in degrees.
    fn check_bare_angle(&mut self, function: &Name, argument: &Expression, scope: Scope) {
        if let Some((value, None)) = literal(argument)
            && value.abs() > std::f64::consts::TAU
        {
            let message = format!("`{}` of {value} rad", function.text);
            let diagnostic = Diagnostic::warning(Code::BARE_ANGLE, message)
                .label(argument.span, "a bare number is an angle in radians")
                .help(format!("write `{value} deg` if degrees are meant, `{value} rad` if not"));
            self.report(diagnostic, scope);
        }
    }

    fn function_names(&self) -> Vec<&'a str> {
        let tables = self.declared.tables.iter().map(|table| table.name.text.as_str());
        FUNCTIONS.iter().map(|(name, ..)| *name).chain(tables).collect()
    }

    fn apply_function(
        &mut self,
        what: Function,
        name: &Name,
        values: &[(Typed, Span)],
        span: Span,
        scope: Scope,
    ) -> Option<Typed> {
        let (first, at) = *values.first()?;
        let (node, dimension) = (first.node, first.dimension);
        match what {
            Function::Ratio(unary) => {
                self.dimensionless(first, at, &name.text, scope)?;
                Some(Typed::new(self.graph.unary(unary, node), Dimension::ONE))
            }
            Function::Kept(unary) => Some(Typed::new(self.graph.unary(unary, node), dimension)),
            Function::Sign => Some(Typed::new(self.graph.unary(Unary::Sign, node), Dimension::ONE)),
            Function::Sqrt => match dimension.root(2) {
                Some(root) => Some(Typed::new(self.graph.unary(Unary::Sqrt, node), root)),
                None => {
                    let diagnostic = Diagnostic::error(Code::DIMENSION_MISMATCH, "this root has no proper dimension")
                        .label(at, format!("this is {}", dimension));
                    self.fail(diagnostic, scope)
                }
            },
            Function::Pair(_) | Function::Hypot | Function::Atan2 => self.pair(what, name, values, scope),
            Function::Smoothstep => {
                self.dimensionless(first, at, &name.text, scope)?;
                Some(Typed::new(self.smoothstep(node), Dimension::ONE))
            }
            Function::Delayed => self.delayed(first, at, *values.get(1)?, scope),
            Function::Derivative => self.derivative(first, at, span, scope),
        }
    }

    fn dimensionless(&mut self, value: Typed, span: Span, function: &str, scope: Scope) -> Option<()> {
        if value.dimension == Dimension::ONE {
            return Some(());
        }
        let message = format!("`{function}` needs a dimensionless number");
        let diagnostic = Diagnostic::error(Code::DIMENSION_MISMATCH, message)
            .label(span, format!("this is {}", value.dimension))
            .help("divide it by a quantity of the same dimension");
        self.fail(diagnostic, scope)
    }

    fn pair(&mut self, what: Function, name: &Name, values: &[(Typed, Span)], scope: Scope) -> Option<Typed> {
        let (a, b) = (*values.first()?, *values.get(1)?);
        self.same_dimension(a, b, || format!("`{}` needs two quantities of one dimension", name.text), scope)?;
        let (left, right) = (a.0.node, b.0.node);
        let graph = &mut self.graph;
        Some(match what {
            Function::Pair(binary) => Typed::new(graph.binary(binary, left, right), a.0.dimension),
            Function::Hypot => {
                let (aa, bb) = (graph.multiply(left, left), graph.multiply(right, right));
                let sum = graph.add(aa, bb);
                Typed::new(graph.unary(Unary::Sqrt, sum), a.0.dimension)
            }
            _ => Typed::new(graph.binary(Binary::Atan2, left, right), Dimension::ONE),
        })
    }

    /// The cubic 3 s^2 - 2 s^3 of s = x limited to 0 .. 1.
    fn smoothstep(&mut self, x: Node) -> Node {
        let graph = &mut self.graph;
        let (zero, one, two, three) =
            (graph.constant(0.0), graph.constant(1.0), graph.constant(2.0), graph.constant(3.0));
        let positive = graph.binary(Binary::Maximum, x, zero);
        let s = graph.binary(Binary::Minimum, positive, one);
        let square = graph.multiply(s, s);
        let twice = graph.multiply(two, s);
        let rest = graph.subtract(three, twice);
        graph.multiply(square, rest)
    }

    /// The value at `t - delay`: time is replaced throughout.
    fn delayed(&mut self, value: Typed, at: Span, delay: (Typed, Span), scope: Scope) -> Option<Typed> {
        self.expect(delay.0, delay.1, Dimension::TIME, (delay.1, "the delay"), scope)?;
        self.only_time(value, at, "delayed", scope)?;
        let time = self.graph.variable(self.time);
        let earlier = self.graph.subtract(time, delay.0.node);
        let replaced = self.graph.substitute(&[value.node], &HashMap::from([(self.time, earlier)]));
        Some(Typed::new(*replaced.first()?, value.dimension))
    }

    fn derivative(&mut self, value: Typed, at: Span, span: Span, scope: Scope) -> Option<Typed> {
        self.only_time(value, at, "derivative", scope)?;
        if let Some(name) = self.held_input(value.node) {
            let message = format!("input `{name}` is held between samples and has no derivative");
            let diagnostic = Diagnostic::error(Code::NOT_AN_INPUT, message)
                .label(span, "")
                .help("give the input `interpolation = linear` or `cubic`");
            return self.fail(diagnostic, scope);
        }
        let rate = self.graph.differentiate(&[value.node], self.time);
        Some(Typed::new(*rate.first()?, value.dimension / Dimension::TIME))
    }

    /// The past and the rate are known of functions of time and inputs only.
    fn only_time(&mut self, value: Typed, at: Span, function: &str, scope: Scope) -> Option<()> {
        let symbols = self.graph.symbols_of(&[value.node]);
        let foreign = symbols.into_iter().find(|symbol| *symbol != self.time && !self.is_parameter(*symbol));
        let Some(foreign) = foreign else { return Some(()) };
        let message = format!("`{function}` works on inputs and functions of time only");
        let diagnostic = Diagnostic::error(Code::NOT_AN_INPUT, message)
            .label(at, format!("depends on `{}`", self.graph.symbol_name(foreign)))
            .help("its past is not kept; `pade_delay` is a law that delays any signal, to second order; a lag (`pt1`) may serve, too");
        self.fail(diagnostic, scope)
    }

    fn held_input(&self, node: Node) -> Option<String> {
        self.graph.reachable(&[node]).into_iter().find_map(|node| match self.graph.operation(node) {
            Operation::Sample { input, .. } => self.held_input_name(input as usize),
            _ => None,
        })
    }
}
