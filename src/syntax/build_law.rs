//! From pest's pairs to the tree: laws, effects and what stands in them.

use super::build::{Builder, Built, Parts};
use super::grammar::Rule;
use super::tree::*;
use crate::diagnostics::{Code, Diagnostic, Span};
use pest::iterators::Pair;

impl Builder<'_> {
    pub fn law(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let mut ports = Vec::new();
        while let Some(pair) = parts.take(Rule::declared) {
            ports.push(self.declared(pair, String::new())?);
        }
        let result = self.type_expression(parts.next()?)?;
        let mut statements = Statements::default();
        while let Some(pair) = parts.next() {
            self.statement(pair, &mut statements)?;
        }
        let Statements { parameters, bindings, states, events, mut values, .. } = statements;
        if let [first, .., last] = values.as_slice() {
            let (first, last) = (first.span, last.span);
            self.report_repeated("the law has two values", last, first);
        }
        if values.is_empty() {
            let finding = Diagnostic::error(Code::UNEXPECTED_TEXT, format!("the law `{}` has no value", name.text))
                .label(name.span, "its braces lack a line `= expression`")
                .help("the value of a law stands on a line of its own, e.g. `= -stiffness * x`");
            self.diagnostics.push(finding);
            return None;
        }
        let value = values.swap_remove(0);
        Some(ItemKind::Law(LawDeclaration { name, ports, result, parameters, bindings, states, events, value }))
    }

    pub fn effect(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let mut places = Vec::new();
        let mut restriction = None;
        let mut statements = Statements::default();
        // The restriction is the name behind `where`, so the keyword has to be seen.
        let mut behind_where = false;
        for pair in parts.pairs.by_ref() {
            match pair.as_rule() {
                Rule::where_word => behind_where = true,
                Rule::name if behind_where => restriction = Some(self.name(pair)),
                Rule::name => places.push(self.name(pair)),
                Rule::effect_statement => self.statement(pair, &mut statements)?,
                _ => {}
            }
        }
        let Statements { amplitudes, shapes, bindings, states, actions, .. } = statements;
        if actions.is_empty() {
            let finding =
                Diagnostic::error(Code::UNEXPECTED_TEXT, format!("the effect `{}` changes nothing", name.text))
                    .label(name.span, "its braces lack a line `adds ..` or `replaces .. by ..`");
            self.diagnostics.push(finding);
        }
        let declaration =
            EffectDeclaration { name, places, restriction, amplitudes, shapes, bindings, states, actions };
        Some(ItemKind::Effect(declaration))
    }

    fn statement(&mut self, pair: Pair<'_, Rule>, into: &mut Statements) -> Built<()> {
        let mut parts = Parts::of(pair);
        let documentation = self.documentation(&mut parts);
        let inner = parts.next()?;
        let rule = inner.as_rule();
        let span = self.span(&inner);
        let mut inside = Parts::of(inner);
        match rule {
            Rule::parameters => {
                self.declared_list(inside, documentation, &mut into.parameters)?;
                into.values.extend(into.parameters.last_mut().and_then(|last| self.value_below(last)));
            }
            Rule::amplitudes => self.declared_list(inside, documentation, &mut into.amplitudes)?,
            Rule::shapes => self.declared_list(inside, documentation, &mut into.shapes)?,
            Rule::binding => {
                let name = self.name(inside.next()?);
                into.bindings.push((name, self.expression(inside.next()?)));
            }
            Rule::state => into.states.push(self.state(inside, span)?),
            Rule::event => into.events.push(self.event(inside, span)?),
            Rule::result => into.values.push(self.expression(inside.next()?)),
            Rule::adds => into.actions.push(EffectAction::Adds(self.expression(inside.next()?))),
            _ => {
                let name = self.name(inside.next()?);
                into.actions.push(EffectAction::Replaces(name, self.expression(inside.next()?)));
            }
        }
        Some(())
    }

    pub fn declared_list(&mut self, mut parts: Parts<'_>, above: String, into: &mut Vec<Declared>) -> Built<()> {
        let mut above = above;
        while let Some(pair) = parts.next() {
            into.push(self.declared(pair, std::mem::take(&mut above))?);
        }
        Some(())
    }

    /// A default stands on its parameter's line. `= ..` on a line below is the law's value, which the grammar, blind to
    /// line ends, has read as the default of the last parameter.
    pub fn value_below(&self, last: &mut Declared) -> Option<Expression> {
        let end = last.kind.as_ref().map_or(last.name.span.end, |kind| kind.span.end) as usize;
        let start = last.default.as_ref()?.span.start as usize;
        let between = self.text.get(end - self.offset..start - self.offset)?;
        if between.contains('\n') { last.default.take() } else { None }
    }

    pub fn declared(&mut self, pair: Pair<'_, Rule>, above: String) -> Built<Declared> {
        let whole = self.span(&pair);
        let mut parts = Parts::of(pair);
        let own = self.documentation(&mut parts);
        let name = self.name(parts.next()?);
        let span = name.span.to(whole);
        let documentation = if own.is_empty() { above } else { own };
        let mut declared = Declared {
            documentation,
            name,
            kind: None,
            default: None,
            range: None,
            range_of: None,
            flags: Vec::new(),
            neutral: None,
            span,
        };
        while let Some(part) = parts.next() {
            self.declared_part(part, &mut declared)?;
        }
        Some(declared)
    }

    pub fn declared_part(&mut self, part: Pair<'_, Rule>, declared: &mut Declared) -> Built<()> {
        let rule = part.as_rule();
        match rule {
            Rule::type_expression => declared.kind = Some(self.type_expression(part)?),
            Rule::flag => declared.flags.push(self.name(part)),
            Rule::default => declared.default = Some(self.expression(Parts::of(part).next()?)),
            Rule::neutral => {
                let span = self.span(&part);
                let value = self.expression(Parts::of(part).next()?);
                if let Some(first) = &declared.neutral {
                    self.report_repeated("two neutral values are given", span, first.span);
                }
                declared.neutral = Some(value);
            }
            _ => {
                let mut limits = Parts::of(part);
                let low = self.expression(limits.next()?);
                declared.range = Some((low, self.expression(limits.next()?)));
                declared.range_of = limits.next().map(|name| self.name(name));
            }
        }
        Some(())
    }

    pub fn type_expression(&mut self, pair: Pair<'_, Rule>) -> Built<TypeExpression> {
        let span = self.span(&pair);
        let mut factors = Vec::new();
        let mut sign = 1i8;
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::multiply => sign = 1,
                Rule::divide => sign = -1,
                _ => factors.extend(self.type_factor(part, sign)?),
            }
        }
        Some(TypeExpression { factors, span })
    }

    pub fn type_factor(&mut self, pair: Pair<'_, Rule>, sign: i8) -> Built<Option<(Name, i8)>> {
        let mut parts = Parts::of(pair);
        let Some(name) = parts.take(Rule::type_name) else {
            return Some(None);
        };
        let exponent = match parts.next() {
            None => 1,
            Some(power) => {
                let digits = power.as_str().trim_start_matches('^');
                let exponent = digits.parse::<i8>().ok().filter(|exponent| (1..=9).contains(&exponent.unsigned_abs()));
                let Some(exponent) = exponent else {
                    let message = format!("the exponent {digits} of a type is not a whole number from 1 to 9");
                    let span = self.span(&power);
                    self.diagnostics
                        .push(Diagnostic::error(Code::BAD_NUMBER, message).label(span, "write it as a whole number"));
                    return None;
                };
                exponent
            }
        };
        Some(Some((self.name(name), sign * exponent)))
    }

    pub fn state(&mut self, mut parts: Parts<'_>, span: Span) -> Built<StateDeclaration> {
        let name = self.name(parts.next()?);
        let kind = match parts.take(Rule::type_expression) {
            Some(pair) => Some(self.type_expression(pair)?),
            None => None,
        };
        let initial = self.expression(parts.next()?);
        let nominal = parts.take(Rule::expression).map(|pair| self.expression(pair));
        let Some(derivative_name) = parts.next() else {
            return Some(StateDeclaration { name, kind, initial, nominal, derivative: None, span });
        };
        let derivative_name = self.name(derivative_name.into_inner().next()?);
        let derivative = Some(self.expression(parts.next()?));
        if derivative_name.text != name.text {
            let message = format!("the derivative of `{}` is called `{}'`", name.text, name.text);
            let finding = Diagnostic::error(Code::UNEXPECTED_TEXT, message)
                .label(derivative_name.span, "another name")
                .secondary(name.span, "the state");
            self.diagnostics.push(finding);
        }
        Some(StateDeclaration { name, kind, initial, nominal, derivative, span })
    }

    pub fn event(&mut self, mut parts: Parts<'_>, span: Span) -> Built<EventDeclaration> {
        let trigger = match parts.next()?.as_rule() {
            Rule::when_word => Trigger::When,
            _ => Trigger::Every,
        };
        let expression = self.expression(parts.next()?);
        let mut changes: Vec<(Name, Expression)> = Vec::new();
        let mut spans = Vec::new();
        while let Some(assignment) = parts.next() {
            spans.push(self.span(&assignment));
            let mut sides = Parts::of(assignment);
            let name = self.name(sides.next()?);
            if let Some((first, _)) = changes.iter().find(|(other, _)| other.text == name.text) {
                let first = first.span;
                self.report_repeated(&format!("`{}` is changed twice", name.text), name.span, first);
            }
            let value = self.expression(sides.next()?);
            changes.push((name, value));
        }
        self.check_separators(&spans);
        Some(EventDeclaration { trigger, expression, changes, span })
    }
}

#[derive(Default)]
struct Statements {
    parameters: Vec<Declared>,
    amplitudes: Vec<Declared>,
    shapes: Vec<Declared>,
    bindings: Vec<(Name, Expression)>,
    states: Vec<StateDeclaration>,
    events: Vec<EventDeclaration>,
    actions: Vec<EffectAction>,
    values: Vec<Expression>,
}
