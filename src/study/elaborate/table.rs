//! A table used as a law: its value times a factor.

use crate::diagnostics::Span;
use crate::syntax::{
    Declared, Expression, ExpressionKind, LawDeclaration, Name, Operator, TableDeclaration, TypeExpression,
};

pub(super) fn table_law(table: &TableDeclaration) -> LawDeclaration {
    let span = table.name.span;
    let name = |text: &str| Name { text: text.to_owned(), span };
    let path = |text: &str| Expression { kind: ExpressionKind::Path(name(text)), span };
    let arguments = table.arguments.iter().map(|argument| path(&argument.name.text)).collect();
    let value = Expression { kind: ExpressionKind::Call { function: table.name.clone(), arguments }, span };
    let scaled =
        ExpressionKind::Binary { operator: Operator::Multiply, left: Box::new(path("factor")), right: Box::new(value) };
    LawDeclaration {
        name: table.name.clone(),
        ports: table.arguments.clone(),
        result: table.result.clone(),
        parameters: vec![factor(span)],
        bindings: Vec::new(),
        states: Vec::new(),
        events: Vec::new(),
        value: Expression { kind: scaled, span },
    }
}

fn factor(span: Span) -> Declared {
    Declared {
        documentation: "Scales the table.".to_owned(),
        name: Name { text: "factor".to_owned(), span },
        kind: Some(TypeExpression { factors: vec![(Name { text: "ratio".to_owned(), span }, 1)], span }),
        default: Some(Expression { kind: ExpressionKind::Number { value: 1.0, unit: None }, span }),
        range: None,
        range_of: None,
        flags: Vec::new(),
        neutral: None,
        span,
    }
}
