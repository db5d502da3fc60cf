//! Whole numbers: indices of names and limits of families.

use super::Elaborator;
use super::scope::{Argument, Scope};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::syntax::{Expression, ExpressionKind, Name, Operator};

/// Constants may be defined by constants; deeper chains are circles.
const DEEPEST: usize = 64;

/// Why there is no number.
pub(super) enum NoNumber {
    /// The name is unknown or has no number now.
    Name(String),
    HasUnit(String),
    NotWhole(f64),
    /// Not the arithmetic of whole numbers.
    Unsuitable,
}

impl Elaborator<'_, '_> {
    /// `[i+1]` as `[3]`; several indices are separated by commas.
    pub fn index(&mut self, text: &str, span: Span, scope: &Scope) -> Option<String> {
        let mut values = Vec::new();
        for part in text.split(',') {
            let value = IndexText { rest: part, depth: 0 }.whole(&mut |name| self.number_of(name, scope, 0));
            match value.and_then(whole) {
                Ok(value) => values.push(value.to_string()),
                Err(cause) => {
                    self.report_index(part, &cause, span, scope);
                    return None;
                }
            }
        }
        Some(format!("[{}]", values.join(",")))
    }

    fn report_index(&mut self, text: &str, cause: &NoNumber, span: Span, scope: &Scope) {
        let message = match cause {
            NoNumber::Name(name) => format!("`{name}` is no index here"),
            NoNumber::HasUnit(unit) => format!("the index has the unit `{unit}`"),
            NoNumber::NotWhole(value) => format!("the index `{text}` is {value}, not a whole number"),
            NoNumber::Unsuitable => format!("`{text}` is no index"),
        };
        let variables: Vec<String> = scope.variables.iter().map(|(name, _)| format!("`{name}`")).collect();
        let mut diagnostic = Diagnostic::error(Code::INDEX, message)
            .label(span, "an index is a whole number")
            .help("a unit is set apart from the name by a blank: `measure z [mm]`");
        if !variables.is_empty() {
            diagnostic = diagnostic.note(format!("variables here: {}", variables.join(", ")));
        }
        self.report(diagnostic);
    }

    /// The number a name has before anything is simulated.
    fn number_of(&self, name: &str, scope: &Scope, depth: usize) -> Result<f64, NoNumber> {
        if let Some(value) = scope.variable(name) {
            return Ok(value as f64);
        }
        match scope.parameters.get(name) {
            Some(Argument::Number { value, .. } | Argument::Expression(value)) => {
                return self.number(value, &Scope::default(), depth + 1);
            }
            Some(Argument::Missing) => return Err(NoNumber::Unsuitable),
            None => {}
        }
        let unknown = || NoNumber::Name(name.to_owned());
        if let Some(known) = self.numbers.borrow().get(name) {
            return known.ok_or_else(unknown);
        }
        let value = match self.constants.get(name) {
            Some(value) if depth < DEEPEST => self.number(value, &Scope::default(), depth + 1),
            _ => return Err(unknown()),
        };
        self.numbers.borrow_mut().insert(name.to_owned(), value.as_ref().ok().copied());
        value
    }

    /// The value of a dimensionless expression of numbers, variables, constants and arguments.
    pub fn number(&self, expression: &Expression, scope: &Scope, depth: usize) -> Result<f64, NoNumber> {
        match &expression.kind {
            ExpressionKind::Number { unit: Some(unit), .. } => Err(NoNumber::HasUnit(unit.text.clone())),
            ExpressionKind::Number { value, unit: None } => Ok(*value),
            ExpressionKind::Path(Name { text, .. }) => self.number_of(text, scope, depth),
            ExpressionKind::Negate(inner) => Ok(-self.number(inner, scope, depth)?),
            ExpressionKind::Binary { operator, left, right } => {
                let (a, b) = (self.number(left, scope, depth)?, self.number(right, scope, depth)?);
                match operator {
                    Operator::Add => Ok(a + b),
                    Operator::Subtract => Ok(a - b),
                    Operator::Multiply => Ok(a * b),
                    Operator::Divide => Ok(a / b),
                    _ => Err(NoNumber::Unsuitable),
                }
            }
            _ => Err(NoNumber::Unsuitable),
        }
    }
}

pub(super) fn whole(value: f64) -> Result<i64, NoNumber> {
    if value.fract() == 0.0 && value.abs() < 1e9 { Ok(value as i64) } else { Err(NoNumber::NotWhole(value)) }
}

/// The text of an index, read by sums of products of names and numbers.
struct IndexText<'a> {
    rest: &'a str,
    depth: usize,
}

type Lookup<'l> = dyn FnMut(&str) -> Result<f64, NoNumber> + 'l;

impl IndexText<'_> {
    fn whole(mut self, lookup: &mut Lookup<'_>) -> Result<f64, NoNumber> {
        let value = self.sum(lookup)?;
        if self.rest.is_empty() { Ok(value) } else { Err(NoNumber::Unsuitable) }
    }

    fn sum(&mut self, lookup: &mut Lookup<'_>) -> Result<f64, NoNumber> {
        let mut value = self.product(lookup)?;
        loop {
            if self.take('+') {
                value += self.product(lookup)?;
            } else if self.take('-') {
                value -= self.product(lookup)?;
            } else {
                return Ok(value);
            }
        }
    }

    fn product(&mut self, lookup: &mut Lookup<'_>) -> Result<f64, NoNumber> {
        let mut value = self.atom(lookup)?;
        loop {
            if self.take('*') {
                value *= self.atom(lookup)?;
            } else if self.take('/') {
                value /= self.atom(lookup)?;
            } else {
                return Ok(value);
            }
        }
    }

    fn atom(&mut self, lookup: &mut Lookup<'_>) -> Result<f64, NoNumber> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(NoNumber::Unsuitable);
        }
        if self.take('-') {
            return Ok(-self.atom(lookup)?);
        }
        if self.take('(') {
            let value = self.sum(lookup)?;
            return if self.take(')') { Ok(value) } else { Err(NoNumber::Unsuitable) };
        }
        let end = self.rest.find(|sign: char| !(sign.is_alphanumeric() || sign == '_' || sign == '.'));
        let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest;
        match word.chars().next() {
            None => Err(NoNumber::Unsuitable),
            Some(first) if first.is_ascii_digit() => word.parse().map_err(|_| NoNumber::Unsuitable),
            Some(_) => lookup(word),
        }
    }

    fn take(&mut self, sign: char) -> bool {
        match self.rest.strip_prefix(sign) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }
}
