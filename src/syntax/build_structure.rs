//! From pest's pairs to the tree: models, their uses, index families, tables.

use super::build::{Builder, Parts};
use super::grammar::Rule;
use super::tree::*;
use crate::diagnostics::Span;
use pest::iterators::Pair;

impl Builder<'_> {
    pub fn model(&mut self, mut parts: Parts<'_>) -> Option<ItemKind> {
        let name = self.name(parts.next()?);
        let mut ports = Vec::new();
        while let Some(pair) = parts.take(Rule::port) {
            ports.push(self.port(pair)?);
        }
        let (mut parameters, mut items) = (Vec::new(), Vec::new());
        while let Some(pair) = parts.next() {
            let mut inside = Parts::of(pair);
            let documentation = self.documentation(&mut inside);
            let statement = inside.next()?;
            if statement.as_rule() == Rule::parameters {
                self.declared_list(Parts::of(statement), documentation, &mut parameters)?;
            } else {
                items.push(self.declaration(statement, documentation)?);
            }
        }
        self.check_item_separators(&items);
        Some(ItemKind::Model(ModelDeclaration { name, ports, parameters, items }))
    }

    fn port(&mut self, pair: Pair<'_, Rule>) -> Option<Port> {
        let mut parts = Parts::of(pair);
        let documentation = self.documentation(&mut parts);
        let name = self.name(parts.next()?);
        Some(Port { documentation, name, kind: self.name(parts.next()?) })
    }

    pub fn part(&mut self, mut parts: Parts<'_>) -> Option<ItemKind> {
        let name = self.name(parts.next()?);
        let model = self.name(parts.next()?);
        let mut places = Vec::new();
        while let Some(place) = parts.take(Rule::path) {
            places.push(self.name(place));
        }
        Some(ItemKind::Part { name, model, places, fields: self.optional_fields(&mut parts) })
    }

    pub fn family(&mut self, mut parts: Parts<'_>) -> Option<ItemKind> {
        let variable = self.name(parts.next()?);
        let low = self.expression(parts.next()?);
        let high = self.expression(parts.next()?);
        let mut items = Vec::new();
        while let Some(pair) = parts.next() {
            let mut inside = Parts::of(pair);
            let documentation = self.documentation(&mut inside);
            items.push(self.declaration(inside.next()?, documentation)?);
        }
        self.check_item_separators(&items);
        Some(ItemKind::Family { variable, low, high, items })
    }

    pub fn table(&mut self, mut parts: Parts<'_>) -> Option<ItemKind> {
        let name = self.name(parts.next()?);
        let mut arguments = Vec::new();
        while let Some(pair) = parts.take(Rule::declared) {
            arguments.push(self.declared(pair, String::new())?);
        }
        let result = self.type_expression(parts.next()?)?;
        let (mut points, mut harmonics) = (None, None);
        let (mut fields, mut spans) = (Vec::new(), Vec::new());
        while let Some(pair) = parts.next() {
            let span = self.span(&pair);
            spans.push(span);
            if pair.as_rule() == Rule::field {
                fields.push(self.field(pair)?);
                continue;
            }
            let (list, what) = match pair.as_rule() {
                Rule::harmonics => (&mut harmonics, "the table has two lists of harmonics"),
                _ => (&mut points, "the table has two lists of points"),
            };
            let tuples = self.points(Parts::of(pair));
            match list {
                Some((_, first)) => self.report_repeated(what, span, *first),
                None => *list = Some((tuples, span)),
            }
        }
        self.check_separators(&spans);
        Some(ItemKind::Table(TableDeclaration { name, arguments, result, points, harmonics, fields }))
    }

    fn points(&mut self, mut parts: Parts<'_>) -> Vec<Vec<Expression>> {
        let mut points = Vec::new();
        while let Some(point) = parts.next() {
            points.push(self.expressions(point));
        }
        points
    }

    fn check_item_separators(&mut self, items: &[Item]) {
        let spans: Vec<Span> = items.iter().map(|item| item.span).collect();
        self.check_separators(&spans);
    }
}
