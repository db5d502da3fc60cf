//! Fields between braces.

use super::checker::{Allowed, Checker, Scope};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::syntax::{Expression, ExpressionKind, Field, Name, Value};

/// A field with the names of the groups it stands in: `compression.slope`.
pub(super) struct FlatField<'a> {
    pub path: String,
    pub span: Span,
    pub expression: Option<&'a Expression>,
}

/// Fields of nested groups as one list; a path that is given twice is reported.
pub(super) fn flatten<'a>(fields: &'a [Field], diagnostics: &mut Vec<Diagnostic>) -> Vec<FlatField<'a>> {
    let mut flat: Vec<FlatField<'a>> = Vec::new();
    flatten_into("", fields, &mut flat);
    for (index, field) in flat.iter().enumerate() {
        if let Some(first) = flat[..index].iter().find(|other| other.path == field.path) {
            diagnostics.push(given_twice(&field.path, field.span, first.span));
        }
    }
    flat
}

fn flatten_into<'a>(prefix: &str, fields: &'a [Field], flat: &mut Vec<FlatField<'a>>) {
    for field in fields {
        let path = if prefix.is_empty() { field.key.text.clone() } else { format!("{prefix}.{}", field.key.text) };
        match &field.value {
            Value::Block { word: None, fields, .. } => flatten_into(&path, fields, flat),
            Value::Expression(expression) => {
                flat.push(FlatField { path, span: field.key.span, expression: Some(expression) });
            }
            _ => flat.push(FlatField { path, span: field.key.span, expression: None }),
        }
    }
}

fn given_twice(name: &str, second: Span, first: Span) -> Diagnostic {
    Diagnostic::error(Code::DUPLICATE_NAME, format!("`{name}` is given twice"))
        .label(second, "second value")
        .secondary(first, "first value")
}

/// The field of this key.
pub(super) fn find<'a>(fields: &'a [Field], key: &str) -> Option<&'a Field> {
    fields.iter().find(|field| field.key.text == key)
}

/// The span of a value.
pub(super) fn value_span(field: &Field) -> Span {
    match &field.value {
        Value::Expression(expression) => expression.span,
        Value::Text(text) => text.span,
        Value::Tuple(_, span) | Value::List(_, span) | Value::Block { span, .. } => *span,
        Value::Range(lower, upper) => lower.span.to(upper.span),
    }
}

impl<'a> Checker<'a> {
    /// Reports fields that `owner` does not have, and repeated ones.
    pub fn known_fields(&mut self, owner: &str, fields: &'a [Field], known: &[&'static str]) {
        let scope = Scope::Study(Allowed::Constant);
        self.check_repeated(fields);
        for field in fields {
            let key = field.key.text.as_str();
            if !known.contains(&key) {
                let diagnostic = Diagnostic::error(Code::UNKNOWN_FIELD, format!("{owner} has no `{key}`"))
                    .label(field.key.span, "not known here")
                    .suggest(similar_name(key, known.iter().copied()))
                    .note(format!("fields: {}", known.join(", ")));
                self.report(diagnostic, scope);
            }
        }
    }

    /// Reports keys that are given twice.
    pub fn check_repeated(&mut self, fields: &'a [Field]) {
        for (index, field) in fields.iter().enumerate() {
            if let Some(first) = fields[..index].iter().find(|other| other.key.text == field.key.text) {
                self.report(
                    given_twice(&field.key.text, field.key.span, first.key.span),
                    Scope::Study(Allowed::Constant),
                );
            }
        }
    }

    /// The expression of a field, if that is what it holds.
    pub fn field_expression(&mut self, field: &'a Field) -> Option<&'a Expression> {
        match &field.value {
            Value::Expression(expression) => Some(expression),
            _ => self.wrong_value(field, "a number or an expression"),
        }
    }

    /// The text of a field.
    pub fn field_text(&mut self, field: &'a Field) -> Option<&'a Name> {
        match &field.value {
            Value::Text(text) => Some(text),
            value => {
                let message = format!("`{}` must be a text in quotation marks", field.key.text);
                let mut diagnostic = Diagnostic::error(Code::WRONG_VALUE, message).label(value_span(field), "not that");
                if let Value::Expression(Expression { kind: ExpressionKind::Path(name), .. }) = value {
                    diagnostic = diagnostic.help(format!("write `{} = \"{}\"`", field.key.text, name.text));
                }
                self.fail(diagnostic, Scope::Study(Allowed::Constant))
            }
        }
    }

    /// The single word of a field (`interpolation = hold`).
    pub fn field_word(&mut self, field: &'a Field, words: &[&'static str]) -> Option<&'static str> {
        let found = match &field.value {
            Value::Expression(Expression { kind: crate::syntax::ExpressionKind::Path(name), .. }) => name,
            Value::Block { word: Some(name), .. } => name,
            _ => return self.wrong_value(field, &words.join(", ")),
        };
        match words.iter().find(|word| **word == found.text) {
            Some(word) => Some(word),
            None => {
                let diagnostic =
                    Diagnostic::error(Code::WRONG_VALUE, format!("`{}` cannot be `{}`", field.key.text, found.text))
                        .label(found.span, "not one of the choices")
                        .suggest(similar_name(&found.text, words.iter().copied()))
                        .note(format!("choices: {}", words.join(", ")));
                self.fail(diagnostic, Scope::Study(Allowed::Constant))
            }
        }
    }

    pub fn wrong_value<T>(&mut self, field: &'a Field, expected: &str) -> Option<T> {
        let message = format!("`{}` must be {expected}", field.key.text);
        let diagnostic = Diagnostic::error(Code::WRONG_VALUE, message).label(value_span(field), "not that");
        self.fail(diagnostic, Scope::Study(Allowed::Constant))
    }
}
