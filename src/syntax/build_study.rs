//! From pest's pairs to the tree: what is measured, tried and identified, and variants.

use super::build::{Builder, Built, Parts};
use super::grammar::Rule;
use super::tree::*;
use crate::diagnostics::Span;
use pest::iterators::Pair;

impl Builder<'_> {
    pub fn measure(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let unit = self.optional_unit(&mut parts);
        let title = self.optional_text(&mut parts);
        let value = self.expression(parts.next()?);
        Some(ItemKind::Measure { name, unit, title, value, fields: self.optional_fields(&mut parts) })
    }

    pub fn group(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let mut members = Vec::new();
        while let Some(member) = parts.next() {
            members.push(self.name(member.into_inner().next()?));
        }
        let spans: Vec<Span> = members.iter().map(|member| member.span).collect();
        self.check_separators(&spans);
        Some(ItemKind::Group { name, members })
    }

    pub fn manoeuvre(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let title = self.optional_text(&mut parts);
        let (mut durations, mut fields, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(pair) = parts.next() {
            spans.push(self.span(&pair));
            if pair.as_rule() == Rule::duration {
                durations.push(self.expression(Parts::of(pair).next()?));
            } else {
                fields.push(self.field(pair)?);
            }
        }
        self.check_separators(&spans);
        Some(ItemKind::Manoeuvre { name, title, durations, fields })
    }

    pub fn criterion(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let unit = self.optional_unit(&mut parts);
        let title = self.optional_text(&mut parts);
        let value = self.expression(parts.next()?);
        let manoeuvre = self.name(parts.next()?);
        let fields = self.optional_fields(&mut parts);
        Some(ItemKind::Criterion { name, unit, title, value, manoeuvre, fields })
    }

    pub fn experiment(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let role = parts.take(Rule::role).map(|pair| self.name(pair));
        Some(ItemKind::Experiment { name, role, fields: self.optional_fields(&mut parts) })
    }

    pub fn identify(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let (mut lines, mut constraints, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(pair) = parts.next() {
            if pair.as_rule() == Rule::constrain {
                let mut inside = Parts::of(pair);
                self.documentation(&mut inside);
                let constraint = self.expression(inside.next()?);
                spans.push(constraint.span);
                constraints.push(constraint);
            } else {
                let line = self.identify_line(pair)?;
                spans.push(line.span);
                lines.push(line);
            }
        }
        self.check_separators(&spans);
        Some(ItemKind::Identify { lines, constraints })
    }

    pub fn identify_line(&mut self, pair: Pair<'_, Rule>) -> Built<IdentifyLine> {
        let whole = self.span(&pair);
        let mut parts = Parts::of(pair);
        self.documentation(&mut parts);
        let target = self.name(parts.next()?);
        let lower = self.expression(parts.next()?);
        let upper = self.expression(parts.next()?);
        let start = self.expression(parts.next()?);
        let prior = match parts.take(Rule::expression) {
            Some(mean) => Some((self.expression(mean), self.expression(parts.next()?))),
            None => None,
        };
        let per_experiment = parts.take(Rule::per_experiment).is_some();
        let span = target.span.to(whole);
        Some(IdentifyLine { target, lower, upper, start, prior, per_experiment, span })
    }

    pub fn filter(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let (mut lowpass, mut remove_mean, mut spans) = (None, false, Vec::new());
        while let Some(pair) = parts.next() {
            let span = self.span(&pair);
            spans.push(span);
            if pair.as_rule() == Rule::remove_mean {
                remove_mean = true;
                continue;
            }
            let design = self.lowpass(pair)?;
            if let Some(Lowpass { span: first, .. }) = lowpass {
                self.report_repeated("the filter has two low-pass designs", span, first);
            } else {
                lowpass = Some(design);
            }
        }
        self.check_separators(&spans);
        Some(ItemKind::Filter { lowpass, remove_mean })
    }

    pub fn lowpass(&mut self, pair: Pair<'_, Rule>) -> Built<Lowpass> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let pass = self.expression(parts.next()?);
        let pass_drop = self.expression(parts.next()?);
        let stop = self.expression(parts.next()?);
        let stop_attenuation = self.expression(parts.next()?);
        let single_pass = parts.next()?.as_rule() == Rule::single_pass;
        Some(Lowpass { pass, pass_drop, stop, stop_attenuation, single_pass, span })
    }

    pub fn variant(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let base = self.name(parts.next()?);
        let mut changes = Vec::new();
        while let Some(pair) = parts.next() {
            changes.push(self.change(pair)?);
        }
        Some(ItemKind::Variant { name, base, changes })
    }

    pub fn change(&mut self, pair: Pair<'_, Rule>) -> Built<Change> {
        let mut parts = Parts::of(pair);
        let above = self.documentation(&mut parts);
        let inner = parts.next()?;
        let rule = inner.as_rule();
        let span = self.span(&inner);
        let mut inside = Parts::of(inner);
        match rule {
            Rule::identify => {
                let kind = self.identify(inside)?;
                Some(Change::Add(Box::new(Item { documentation: above, kind, span })))
            }
            Rule::change_remove => Some(Change::Remove(self.name(inside.next()?))),
            _ => {
                let own = self.documentation(&mut inside);
                let documentation = if own.is_empty() { above } else { own };
                let item = Box::new(self.declaration(inside.next()?, documentation)?);
                Some(if rule == Rule::change_add { Change::Add(item) } else { Change::Replace(item) })
            }
        }
    }
}
