//! Expressions to nodes, with the dimension of every part checked.

use super::checker::{Checker, DEEPEST_EVALUATION, Scope};
use super::units::read_unit;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Binary, Node};
use crate::quantities::{AngleContent, Dimension};
use crate::syntax::{Expression, ExpressionKind, Name, Operator};

/// A node with its dimension.
#[derive(Clone, Copy, Debug)]
pub(super) struct Typed {
    pub node: Node,
    pub dimension: Dimension,
    /// Whether it was written in periods or in turned angle, as far as that is known.
    pub writing: AngleContent,
    /// The result of a comparison: 1 or 0.
    pub is_condition: bool,
}

impl Typed {
    pub fn new(node: Node, dimension: Dimension) -> Typed {
        Typed { node, dimension, writing: AngleContent::Neutral, is_condition: false }
    }
}

/// Whether the expression is one number as written, perhaps negated.
pub(super) fn literal(expression: &Expression) -> Option<(f64, Option<&Name>)> {
    match &expression.kind {
        ExpressionKind::Number { value, unit } => Some((*value, unit.as_ref())),
        ExpressionKind::Negate(inner) => literal(inner).map(|(value, unit)| (-value, unit)),
        _ => None,
    }
}

impl<'a> Checker<'a> {
    /// The value of `expression`; `None` after a finding has been reported.
    pub fn evaluate(&mut self, expression: &'a Expression, scope: Scope) -> Option<Typed> {
        if self.depth >= DEEPEST_EVALUATION {
            let message = format!("more than {DEEPEST_EVALUATION} definitions depend on each other");
            let diagnostic = Diagnostic::error(Code::TOO_DEEP, message)
                .label(expression.span, "while following this one")
                .help("give one of them as a number");
            return self.fail(diagnostic, scope);
        }
        self.depth += 1;
        let value = self.evaluate_kind(expression, scope);
        self.depth -= 1;
        let value = value?;
        let is_calculated = matches!(expression.kind, ExpressionKind::Binary { .. } | ExpressionKind::Call { .. });
        match self.graph.constant_value(value.node) {
            Some(number) if is_calculated && !number.is_finite() && !self.may_be_undefined(&expression.kind) => {
                let message = if number.is_nan() { "this has no value" } else { "this is infinite" };
                let diagnostic = Diagnostic::error(Code::NOT_FINITE, message)
                    .label(expression.span, "whatever the simulation does")
                    .help("a division by zero, or a root, logarithm or inverse function outside of its range");
                self.fail(diagnostic, scope)
            }
            _ => Some(value),
        }
    }

    /// A table that is asked beyond its points says so when it is simulated.
    fn may_be_undefined(&self, kind: &ExpressionKind) -> bool {
        matches!(kind, ExpressionKind::Call { function, .. } if self.is_table(&function.text))
    }

    fn evaluate_kind(&mut self, expression: &'a Expression, scope: Scope) -> Option<Typed> {
        match &expression.kind {
            ExpressionKind::Number { value, unit } => self.number(*value, unit.as_ref(), scope),
            ExpressionKind::Path(name) => self.path(name, scope),
            ExpressionKind::Negate(inner) => {
                let inner = self.evaluate(inner, scope)?;
                Some(Typed { node: self.graph.negate(inner.node), is_condition: false, ..inner })
            }
            ExpressionKind::Binary { operator, left, right } => self.operation(*operator, left, right, scope),
            ExpressionKind::Call { function, arguments } => self.call(function, arguments, expression.span, scope),
            ExpressionKind::If { condition, then, otherwise } => self.choice(condition, then, otherwise, scope),
            ExpressionKind::Invalid => None,
        }
    }

    fn number(&mut self, value: f64, unit: Option<&'a Name>, scope: Scope) -> Option<Typed> {
        let Some(unit) = unit else {
            return Some(Typed::new(self.graph.constant(value), Dimension::ONE));
        };
        match read_unit(unit) {
            Ok(read) => {
                let node = self.graph.constant(read.to_si(value));
                Some(Typed { writing: read.angle_content(), ..Typed::new(node, read.dimension) })
            }
            Err(diagnostic) => match self.product_without_sign(value, unit) {
                Some(product) => self.fail(product, scope),
                None => self.fail(diagnostic, scope),
            },
        }
    }

    /// `2 c_strut`: the word behind a number is read as its unit, but is a name of the study.
    fn product_without_sign(&mut self, value: f64, unit: &Name) -> Option<Diagnostic> {
        let end = unit.text.find(['*', '/', '^', '(']).unwrap_or(unit.text.len());
        let name = &unit.text[..end];
        let is_known = self.parameter(name).is_some() || self.entities.contains_key(name);
        is_known.then(|| {
            Diagnostic::error(Code::PRODUCT, format!("`{name}` is no unit"))
                .label(unit.span, "read as the unit of the number before it")
                .help(format!("a product needs its sign: `{value} * {name}`"))
        })
    }

    fn operation(
        &mut self,
        operator: Operator,
        left: &'a Expression,
        right: &'a Expression,
        scope: Scope,
    ) -> Option<Typed> {
        let (a, b) = (self.evaluate(left, scope), self.evaluate(right, scope));
        let (a, b) = (a?, b?);
        match operator {
            Operator::Add | Operator::Subtract => {
                let verb = if operator == Operator::Add { "added to" } else { "subtracted from" };
                let (moved, target) = if operator == Operator::Add { (a, b) } else { (b, a) };
                let message = || format!("{} cannot be {verb} {}", (moved.dimension), (target.dimension));
                self.same_dimension((a, left.span), (b, right.span), message, scope)?;
                let function = if operator == Operator::Add { Binary::Add } else { Binary::Subtract };
                Some(Typed::new(self.graph.binary(function, a.node, b.node), a.dimension))
            }
            Operator::Multiply => Some(Typed::new(self.graph.multiply(a.node, b.node), a.dimension * b.dimension)),
            Operator::Divide if self.graph.is_zero(b.node) => {
                let diagnostic =
                    Diagnostic::error(Code::NOT_FINITE, "division by zero").label(right.span, "this is zero");
                self.fail(diagnostic, scope)
            }
            Operator::Divide => Some(Typed::new(self.graph.divide(a.node, b.node), a.dimension / b.dimension)),
            Operator::Power => self.power((a, left.span), (b, right.span), scope),
            Operator::Less | Operator::LessEqual | Operator::Greater | Operator::GreaterEqual => {
                let message = || format!("{} cannot be compared with {}", (a.dimension), (b.dimension));
                self.same_dimension((a, left.span), (b, right.span), message, scope)?;
                Some(self.comparison(operator, a.node, b.node))
            }
            Operator::And | Operator::Or => {
                self.condition(a, left.span, scope)?;
                self.condition(b, right.span, scope)?;
                let function = if operator == Operator::And { Binary::Minimum } else { Binary::Maximum };
                let node = self.graph.binary(function, a.node, b.node);
                Some(Typed { is_condition: true, ..Typed::new(node, Dimension::ONE) })
            }
        }
    }

    fn comparison(&mut self, operator: Operator, a: Node, b: Node) -> Typed {
        let node = match operator {
            Operator::Less => self.graph.binary(Binary::Less, a, b),
            Operator::Greater => self.graph.binary(Binary::Less, b, a),
            // The others are negations: a <= b is not b < a.
            _ => {
                let (low, high) = if operator == Operator::LessEqual { (b, a) } else { (a, b) };
                let strictly = self.graph.binary(Binary::Less, low, high);
                let one = self.graph.constant(1.0);
                self.graph.subtract(one, strictly)
            }
        };
        Typed { is_condition: true, ..Typed::new(node, Dimension::ONE) }
    }

    fn choice(
        &mut self,
        condition: &'a Expression,
        then: &'a Expression,
        otherwise: &'a Expression,
        scope: Scope,
    ) -> Option<Typed> {
        let chosen = self.evaluate(condition, scope);
        let (a, b) = (self.evaluate(then, scope), self.evaluate(otherwise, scope));
        let (chosen, a, b) = (chosen?, a?, b?);
        self.condition(chosen, condition.span, scope)?;
        let message = || "both branches must have the same dimension".to_owned();
        self.same_dimension((a, then.span), (b, otherwise.span), message, scope)?;
        Some(Typed::new(self.graph.select(chosen.node, a.node, b.node), a.dimension))
    }

    pub(super) fn condition(&mut self, value: Typed, span: Span, scope: Scope) -> Option<()> {
        if value.is_condition {
            return Some(());
        }
        let diagnostic = Diagnostic::error(Code::CONDITION, "a condition is expected here")
            .label(span, format!("this is a number ({})", (value.dimension)))
            .help("compare it: `x > 0 mm`");
        self.fail(diagnostic, scope)
    }

    /// Exponents must be numbers if the base has a dimension, and the resulting exponents integers.
    fn power(&mut self, base: (Typed, Span), exponent: (Typed, Span), scope: Scope) -> Option<Typed> {
        let node = self.graph.binary(Binary::Power, base.0.node, exponent.0.node);
        if exponent.0.dimension != Dimension::ONE {
            let diagnostic = Diagnostic::error(Code::EXPONENT, "an exponent must be dimensionless")
                .label(exponent.1, format!("this is {}", (exponent.0.dimension)));
            return self.fail(diagnostic, scope);
        }
        if base.0.dimension == Dimension::ONE {
            return Some(Typed::new(node, Dimension::ONE));
        }
        let Some(value) = self.graph.constant_value(exponent.0.node) else {
            let diagnostic = Diagnostic::error(Code::EXPONENT, "the dimension of this power is not known")
                .label(exponent.1, "this exponent is not a number")
                .secondary(base.1, format!("this is {}", (base.0.dimension)))
                .help("make the base dimensionless, e.g. `(x / (1 m)) ^ n`");
            return self.fail(diagnostic, scope);
        };
        match base.0.dimension.power_real(value) {
            Some(dimension) => Some(Typed::new(node, dimension)),
            None => {
                let diagnostic = Diagnostic::error(Code::EXPONENT, "this power has no proper dimension")
                    .label(exponent.1, format!("the exponent is {value}"))
                    .secondary(base.1, format!("this is {}", (base.0.dimension)))
                    .help("make the base dimensionless, e.g. `(x / (1 m)) ^ 1.5`");
                self.fail(diagnostic, scope)
            }
        }
    }

    /// Reports `message` with both places unless the dimensions agree.
    pub fn same_dimension(
        &mut self,
        a: (Typed, Span),
        b: (Typed, Span),
        message: impl FnOnce() -> String,
        scope: Scope,
    ) -> Option<()> {
        if a.0.dimension == b.0.dimension {
            return Some(());
        }
        let diagnostic = Diagnostic::error(Code::DIMENSION_MISMATCH, message())
            .label(a.1, format!("this is {}", (a.0.dimension)))
            .label(b.1, format!("this is {}", (b.0.dimension)));
        self.fail(diagnostic, scope)
    }

    /// Reports unless the value has the dimension wanted; `because` names the place that wants it.
    pub fn expect(
        &mut self,
        value: Typed,
        span: Span,
        wanted: Dimension,
        because: (Span, &str),
        scope: Scope,
    ) -> Option<Typed> {
        if value.dimension == wanted {
            return Some(value);
        }
        let message = format!("{} expected, found {}", (wanted), (value.dimension));
        let mut diagnostic =
            Diagnostic::error(Code::DIMENSION_MISMATCH, message).label(span, format!("this is {}", (value.dimension)));
        if because.0 != span {
            diagnostic = diagnostic.secondary(because.0, format!("{}: {}", because.1, (wanted)));
        }
        if value.dimension == Dimension::ONE && self.graph.constant_value(value.node).is_some() {
            diagnostic = diagnostic.help("write the number with its unit");
        }
        self.fail(diagnostic, scope)
    }
}
