//! From pest's pairs to the tree: fields, values and expressions.

use super::build::{Builder, Parts};
use super::grammar::Rule;
use super::tree::*;
use crate::diagnostics::{Code, Diagnostic, Span};
use pest::iterators::Pair;

/// Expressions of greater depth are refused: later stages follow them recursively. A sum of n terms has depth n.
const DEEPEST_EXPRESSION: usize = 200;

/// How strongly an operator binds; unary minus binds like [`SIGN`].
pub(super) fn precedence(operator: Operator) -> u8 {
    match operator {
        Operator::Or => 1,
        Operator::And => 2,
        Operator::Less | Operator::LessEqual | Operator::Greater | Operator::GreaterEqual => 3,
        Operator::Add | Operator::Subtract => 4,
        Operator::Multiply | Operator::Divide => 5,
        Operator::Power => 7,
    }
}

/// Precedence of the unary minus: `-x^2` is `-(x^2)`, `-a*b` is `(-a)*b`.
pub(super) const SIGN: u8 = 6;

impl Builder<'_> {
    /// `{ key = value, ... }`
    pub fn fields(&mut self, pair: Pair<'_, Rule>) -> Vec<Field> {
        let mut parts = Parts::of(pair);
        let mut fields = Vec::new();
        while let Some(field) = parts.next() {
            fields.extend(self.field(field));
        }
        let spans: Vec<Span> = fields.iter().map(|field| field.span).collect();
        self.check_separators(&spans);
        fields
    }

    /// A field or a point.
    pub fn field(&mut self, pair: Pair<'_, Rule>) -> Option<Field> {
        let whole = self.span(&pair);
        let mut parts = Parts::of(pair);
        parts.take(Rule::documentation);
        let key = self.name(parts.next()?);
        let value = self.value(parts.next()?)?;
        Some(Field { span: Span { start: key.span.start, ..whole }, key, value })
    }

    fn value(&mut self, pair: Pair<'_, Rule>) -> Option<Value> {
        let inside = pair.into_inner().next()?;
        match inside.as_rule() {
            Rule::text => Some(Value::Text(self.quoted(inside))),
            Rule::block => self.block(inside),
            Rule::named_block => self.named_block(inside),
            _ => self.range(inside),
        }
    }

    fn range(&mut self, pair: Pair<'_, Rule>) -> Option<Value> {
        let mut parts = Parts::of(pair);
        let first = parts.next()?;
        let second = parts.next();
        if second.is_none()
            && let Some(tuple) = as_tuple(&first)
        {
            let span = self.span(&tuple);
            return Some(Value::Tuple(self.expressions(tuple), span));
        }
        let low = self.expression(first);
        Some(match second {
            Some(high) => Value::Range(low, self.expression(high)),
            None => Value::Expression(low),
        })
    }

    fn named_block(&mut self, pair: Pair<'_, Rule>) -> Option<Value> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let word = self.name(parts.next()?);
        let block = parts.next()?;
        let (names, fields) = self.entries(block)?;
        if let Some(name) = names.first() {
            self.report(
                Code::UNEXPECTED_TEXT,
                format!("`{}` has no value", name.text),
                name.span,
                "expected `= value`",
            );
        }
        Some(Value::Block { word: Some(word), fields, span })
    }

    /// `{ a, b }` is a list of names, `{ a = .., b = .. }` a block; one must not mix them.
    fn block(&mut self, pair: Pair<'_, Rule>) -> Option<Value> {
        let span = self.span(&pair);
        let (names, fields) = self.entries(pair)?;
        if let (Some(name), Some(field)) = (names.first(), fields.first()) {
            let finding = Diagnostic::error(Code::UNEXPECTED_TEXT, format!("`{}` has no value", name.text))
                .label(name.span, "expected `= value`")
                .secondary(field.span, "this entry has one");
            self.diagnostics.push(finding);
        }
        Some(if names.is_empty() { Value::Block { word: None, fields, span } } else { Value::List(names, span) })
    }

    fn entries(&mut self, pair: Pair<'_, Rule>) -> Option<(Vec<Name>, Vec<Field>)> {
        let (mut names, mut fields, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        let mut parts = Parts::of(pair);
        while let Some(entry) = parts.next() {
            let whole = self.span(&entry);
            let mut inside = Parts::of(entry);
            inside.take(Rule::documentation);
            let key = self.name(inside.next()?);
            let span = Span { start: key.span.start, ..whole };
            spans.push(span);
            match inside.next() {
                Some(value) => fields.push(Field { key, value: self.value(value)?, span }),
                None => names.push(key),
            }
        }
        self.check_separators(&spans);
        Some((names, fields))
    }

    /// The expressions within a parenthesis.
    pub fn expressions(&mut self, pair: Pair<'_, Rule>) -> Vec<Expression> {
        let mut parts = Parts::of(pair);
        let mut expressions = Vec::new();
        while let Some(pair) = parts.next() {
            expressions.push(self.expression(pair));
        }
        expressions
    }

    pub fn expression(&mut self, pair: Pair<'_, Rule>) -> Expression {
        self.expression_within(pair, 0)
    }

    /// `depth`: how deep the expression lies in others.
    fn expression_within(&mut self, pair: Pair<'_, Rule>, depth: usize) -> Expression {
        let span = self.span(&pair);
        let invalid = Expression { kind: ExpressionKind::Invalid, span };
        let parts: Vec<Pair<'_, Rule>> = pair.into_inner().collect();
        let links = parts.iter().filter(|part| is_link(part.as_rule())).count();
        if depth + links > DEEPEST_EXPRESSION {
            let finding = Diagnostic::error(Code::TOO_DEEP, "the expression is too long or nested too deeply")
                .label(span, format!("more than {DEEPEST_EXPRESSION} operations follow each other"))
                .help("split it with `let`, `constant` or a `signal`, or put parts of a long sum in parentheses");
            self.diagnostics.push(finding);
            return invalid;
        }
        let mut climber = Climber { parts: parts.into_iter().peekable(), depth: depth + links + 1 };
        climber.binary(self, 0).unwrap_or(invalid)
    }

    fn atom(&mut self, pair: Pair<'_, Rule>, depth: usize) -> Option<Expression> {
        let span = self.span(&pair);
        let kind = match pair.as_rule() {
            Rule::quantity => self.quantity(pair)?,
            Rule::reference => ExpressionKind::Path(self.name(pair)),
            Rule::parenthesis => return self.parenthesis(pair, depth),
            Rule::call => self.call(pair, depth)?,
            Rule::choice => {
                let mut parts = Parts::of(pair);
                let condition = Box::new(self.expression_within(parts.next()?, depth));
                let then = Box::new(self.expression_within(parts.next()?, depth));
                let otherwise = Box::new(self.expression_within(parts.next()?, depth));
                ExpressionKind::If { condition, then, otherwise }
            }
            _ => return None,
        };
        Some(Expression { kind, span })
    }

    fn quantity(&mut self, pair: Pair<'_, Rule>) -> Option<ExpressionKind> {
        let mut parts = Parts::of(pair);
        let number = parts.next()?;
        let unit = parts.next().map(|unit| self.name(unit));
        let value: f64 = number.as_str().parse().ok()?;
        if value.is_infinite() {
            let span = self.span(&number);
            self.report(Code::BAD_NUMBER, "the number is too large", span, "larger than 1.8e308");
            return Some(ExpressionKind::Invalid);
        }
        Some(ExpressionKind::Number { value, unit })
    }

    fn call(&mut self, pair: Pair<'_, Rule>, depth: usize) -> Option<ExpressionKind> {
        let mut parts = Parts::of(pair);
        let function = self.name(parts.next()?);
        let mut arguments = Vec::new();
        while let Some(argument) = parts.next() {
            arguments.push(self.expression_within(argument, depth));
        }
        Some(ExpressionKind::Call { function, arguments })
    }

    /// The components where an expression is nothing but `(a, b, ..)`.
    pub fn tuple_of(&mut self, pair: &Pair<'_, Rule>) -> Option<Vec<Expression>> {
        as_tuple(pair).map(|tuple| self.expressions(tuple))
    }

    /// The span is that of the inside: parentheses are not part of the tree.
    fn parenthesis(&mut self, pair: Pair<'_, Rule>, depth: usize) -> Option<Expression> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let expression = self.expression_within(parts.next()?, depth);
        if parts.next().is_some() {
            self.report(
                Code::UNEXPECTED_TEXT,
                "several values in parentheses cannot be calculated with",
                span,
                "vectors stand alone, as value of a field",
            );
            return Some(Expression { kind: ExpressionKind::Invalid, span });
        }
        Some(expression)
    }
}

/// The parenthesis of an expression that is nothing but `(a, b, ..)`.
fn as_tuple<'i>(pair: &Pair<'i, Rule>) -> Option<Pair<'i, Rule>> {
    let mut inside = pair.clone().into_inner();
    let only = inside.next()?;
    if inside.next().is_some() || only.as_rule() != Rule::parenthesis {
        return None;
    }
    let mut parts = Parts::of(only.clone());
    parts.next()?;
    parts.next().map(|_| only)
}

/// Operators, signs and conditionals lengthen the tree.
fn is_link(rule: Rule) -> bool {
    rule == Rule::sign || rule == Rule::choice || operator(rule).is_some()
}

fn operator(rule: Rule) -> Option<Operator> {
    Some(match rule {
        Rule::power => Operator::Power,
        Rule::multiply => Operator::Multiply,
        Rule::divide => Operator::Divide,
        Rule::add => Operator::Add,
        Rule::subtract => Operator::Subtract,
        Rule::less_equal => Operator::LessEqual,
        Rule::less => Operator::Less,
        Rule::greater_equal => Operator::GreaterEqual,
        Rule::greater => Operator::Greater,
        Rule::both => Operator::And,
        Rule::either => Operator::Or,
        _ => return None,
    })
}

/// Precedence climbing over the flat list of signs, atoms and operators.
struct Climber<'i, I: Iterator<Item = Pair<'i, Rule>>> {
    parts: std::iter::Peekable<I>,
    depth: usize,
}

impl<'i, I: Iterator<Item = Pair<'i, Rule>>> Climber<'i, I> {
    /// An expression of operators that bind at least as strongly as `weakest`.
    fn binary(&mut self, builder: &mut Builder<'_>, weakest: u8) -> Option<Expression> {
        let mut left = self.unary(builder)?;
        while let Some(operator) = self.parts.peek().and_then(|part| operator(part.as_rule())) {
            let strength = precedence(operator);
            if strength < weakest {
                break;
            }
            self.parts.next();
            // Powers group to the right, all others to the left.
            let right = self.binary(builder, if operator == Operator::Power { strength } else { strength + 1 })?;
            let span = left.span.to(right.span);
            let kind = ExpressionKind::Binary { operator, left: Box::new(left), right: Box::new(right) };
            left = Expression { kind, span };
        }
        Some(left)
    }

    fn unary(&mut self, builder: &mut Builder<'_>) -> Option<Expression> {
        let part = self.parts.next()?;
        if part.as_rule() != Rule::sign {
            return builder.atom(part, self.depth);
        }
        let sign = builder.span(&part);
        let operand = self.binary(builder, SIGN)?;
        let span = sign.to(operand.span);
        Some(Expression { kind: ExpressionKind::Negate(Box::new(operand)), span })
    }
}
