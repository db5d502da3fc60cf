//! From pest's pairs to the tree: declarations.

use super::grammar::Rule;
use super::scan::Token;
use super::tree::*;
use crate::diagnostics::{Code, Diagnostic, Span};
use pest::iterators::{Pair, Pairs};
use std::iter::Peekable;

/// Builds the tree of one declaration. Methods return `None` only where the pairs do not have the shape the grammar
/// promises, or after reporting.
pub(super) struct Builder<'a> {
    file: u32,
    offset: usize,
    /// The declaration's text; wrong statements are blanked out.
    text: &'a str,
    tokens: &'a [Token],
    pub diagnostics: Vec<Diagnostic>,
}

/// The parts of a rule without punctuation and keywords.
pub(super) struct Parts<'i> {
    pairs: Peekable<Pairs<'i, Rule>>,
}

impl<'i> Parts<'i> {
    pub fn of(pair: Pair<'i, Rule>) -> Parts<'i> {
        Parts { pairs: pair.into_inner().peekable() }
    }

    /// The next part, whatever it is.
    pub fn next(&mut self) -> Option<Pair<'i, Rule>> {
        while self.pairs.peek().is_some_and(|pair| is_punctuation(pair.as_rule())) {
            self.pairs.next();
        }
        self.pairs.next()
    }

    /// The next part if it is of this kind.
    pub fn take(&mut self, rule: Rule) -> Option<Pair<'i, Rule>> {
        while self.pairs.peek().is_some_and(|pair| is_punctuation(pair.as_rule())) {
            self.pairs.next();
        }
        self.pairs.next_if(|pair| pair.as_rule() == rule)
    }
}

fn is_punctuation(rule: Rule) -> bool {
    use Rule::*;
    matches!(
        rule,
        open_brace
            | close_brace
            | open_paren
            | close_paren
            | open_bracket
            | close_bracket
            | comma
            | colon
            | becomes
            | equals
            | arrow
            | range_dots
            | plus_minus
            | EOI
    ) || is_keyword(rule)
}

fn is_keyword(rule: Rule) -> bool {
    use Rule::*;
    matches!(
        rule,
        study_word
            | use_word
            | gravity_word
            | constant_word
            | input_word
            | body_word
            | point_word
            | joint_word
            | force_word
            | actuator_word
            | signal_word
            | effect_word
            | measure_word
            | group_word
            | experiment_word
            | identify_word
            | filter_word
            | solver_word
            | variant_word
            | law_word
            | manoeuvre_word
            | criterion_word
            | model_word
            | part_word
            | for_word
            | per_word
            | constrain_word
            | table_word
            | points_word
            | harmonics_word
            | add_word
            | remove_word
            | replace_word
            | on_word
            | along_word
            | of_word
            | in_word
            | from_word
            | prior_word
            | at_word
            | any_word
            | where_word
            | param_word
            | let_word
            | state_word
            | amplitude_word
            | shape_word
            | adds_word
            | replaces_word
            | by_word
            | neutral_word
            | if_word
            | then_word
            | else_word
            | lowpass_word
            | butterworth_word
            | pass_word
            | stop_word
    )
}

type Built<T> = Option<T>;

impl<'a> Builder<'a> {
    pub fn new(file: u32, offset: usize, text: &'a str, tokens: &'a [Token]) -> Builder<'a> {
        Builder { file, offset, text, tokens, diagnostics: Vec::new() }
    }

    /// The item of a whole declaration.
    pub fn item(&mut self, mut pairs: Pairs<'_, Rule>) -> Built<Item> {
        let mut parts = Parts::of(pairs.next()?);
        let documentation = self.documentation(&mut parts);
        self.declaration(parts.next()?, documentation)
    }

    pub fn span(&self, pair: &Pair<'_, Rule>) -> Span {
        let span = pair.as_span();
        let (start, end) = (self.offset + span.start(), self.offset + span.end());
        // Rules with optional endings include the blanks behind them.
        let behind = self.tokens.partition_point(|token| token.start < end);
        let last = behind.checked_sub(1).map_or(end, |index| self.tokens[index].end.min(end));
        Span { file: self.file, start: start as u32, end: last.max(start) as u32 }
    }

    pub fn name(&self, pair: Pair<'_, Rule>) -> Name {
        let mut text = pair.as_str().trim().to_owned();
        if pair.as_rule() != Rule::written_unit_inside && text.contains('[') {
            text.retain(|sign| !sign.is_whitespace());
        }
        Name { text, span: self.span(&pair) }
    }

    /// Text without its quotation marks, with the span of both.
    pub fn quoted(&self, pair: Pair<'_, Rule>) -> Name {
        Name { span: self.span(&pair), text: pair.as_str().trim_matches('"').to_owned() }
    }

    pub fn documentation(&self, parts: &mut Parts<'_>) -> String {
        let Some(pair) = parts.take(Rule::documentation) else {
            return String::new();
        };
        let lines = pair.into_inner().map(|line| {
            let text = line.as_str().trim_start_matches("///").trim_end();
            text.strip_prefix(' ').unwrap_or(text)
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    pub fn declaration(&mut self, pair: Pair<'_, Rule>, documentation: String) -> Built<Item> {
        let span = self.span(&pair);
        let kind = self.kind(pair.into_inner().next()?)?;
        Some(Item { documentation, kind, span })
    }

    fn kind(&mut self, pair: Pair<'_, Rule>) -> Built<ItemKind> {
        let rule = pair.as_rule();
        let mut parts = Parts::of(pair);
        match rule {
            Rule::study => {
                let name = self.name(parts.next()?);
                Some(ItemKind::Study { name, title: self.optional_text(&mut parts) })
            }
            Rule::use_file => Some(ItemKind::Use { path: self.quoted(parts.next()?) }),
            Rule::gravity => {
                let value = self.expression(parts.next()?);
                Some(ItemKind::Gravity { value, direction: self.direction(parts.next()?)? })
            }
            Rule::constant => {
                let name = self.name(parts.next()?);
                Some(ItemKind::Constant { name, value: self.expression(parts.next()?) })
            }
            Rule::input => self.input(parts),
            Rule::body => self.body(parts),
            Rule::joint => self.joint(parts),
            Rule::element => self.element(parts),
            Rule::signal_formula => {
                let name = self.name(parts.next()?);
                Some(ItemKind::Formula { name, value: self.expression(parts.next()?) })
            }
            Rule::measure => self.measure(parts),
            Rule::group => self.group(parts),
            Rule::experiment => self.experiment(parts),
            Rule::manoeuvre => self.manoeuvre(parts),
            Rule::criterion => self.criterion(parts),
            Rule::identify => self.identify(parts),
            Rule::filter => self.filter(parts),
            Rule::solver => Some(ItemKind::Solver { fields: self.fields(parts.next()?) }),
            Rule::variant => self.variant(parts),
            Rule::law => self.law(parts),
            Rule::effect_declaration => self.effect(parts),
            Rule::model => self.model(parts),
            Rule::part => self.part(parts),
            Rule::family => self.family(parts),
            Rule::table => self.table(parts),
            _ => None,
        }
    }

    fn optional_text(&self, parts: &mut Parts<'_>) -> Option<Name> {
        parts.take(Rule::text).map(|pair| self.quoted(pair))
    }

    fn optional_unit(&self, parts: &mut Parts<'_>) -> Option<Name> {
        let pair = parts.take(Rule::written_unit)?;
        Parts::of(pair).next().map(|inside| self.name(inside))
    }

    pub fn optional_fields(&mut self, parts: &mut Parts<'_>) -> Vec<Field> {
        parts.take(Rule::fields).map(|pair| self.fields(pair)).unwrap_or_default()
    }

    fn input(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let unit = self.optional_unit(&mut parts);
        let title = self.optional_text(&mut parts);
        Some(ItemKind::Input { name, unit, title, fields: self.optional_fields(&mut parts) })
    }

    fn body(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let (mut fields, mut points, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(pair) = parts.next() {
            let is_point = pair.as_rule() == Rule::point;
            let field = self.field(pair)?;
            spans.push(field.span);
            if is_point { &mut points } else { &mut fields }.push(field);
        }
        self.check_separators(&spans);
        Some(ItemKind::Body { name, fields, points })
    }

    fn joint(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let kind = self.name(parts.next()?);
        let axes = match parts.take(Rule::joint_axes) {
            Some(pair) => self.joint_axes(pair)?,
            None => Vec::new(),
        };
        let parent = self.name(parts.next()?);
        let child = self.name(parts.next()?);
        Some(ItemKind::Joint { name, kind, axes, parent, child, fields: self.optional_fields(&mut parts) })
    }

    fn joint_axes(&mut self, pair: Pair<'_, Rule>) -> Built<Vec<JointAxis>> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let mut axes = Vec::new();
        let mut bare = Vec::new();
        while let Some(pair) = parts.next() {
            let span = self.span(&pair);
            let mut inside = Parts::of(pair);
            let motion = inside.take(Rule::joint_motion).map(|pair| self.name(pair));
            let what = inside.next()?;
            let direction_span = self.span(&what);
            let kind = match what.as_rule() {
                Rule::axis => axis_kind(what.as_str())?,
                _ => match self.tuple_of(&what) {
                    Some(components) => DirectionKind::Vector(components),
                    None => {
                        bare.push(self.expression(what));
                        continue;
                    }
                },
            };
            if !bare.is_empty() {
                self.report(
                    Code::UNEXPECTED_TEXT,
                    "axes and single numbers cannot be mixed",
                    span,
                    "write several axes as `(x, z)`, or each in its own parenthesis: `((1, 0, 0), (0, 0.6, 0.8))`",
                );
                return None;
            }
            axes.push(JointAxis { motion, direction: Direction { kind, span: direction_span } });
        }
        if !bare.is_empty() {
            let direction = Direction { kind: DirectionKind::Vector(bare), span };
            axes.push(JointAxis { motion: None, direction });
        }
        Some(axes)
    }

    fn direction(&mut self, pair: Pair<'_, Rule>) -> Built<Direction> {
        let span = self.span(&pair);
        let inside = Parts::of(pair).next()?;
        let kind = match inside.as_rule() {
            Rule::axis => axis_kind(inside.as_str())?,
            Rule::body_axis => {
                let mut parts = Parts::of(inside);
                let negative = parts.take(Rule::sign).is_some();
                DirectionKind::OfBody { path: self.name(parts.next()?), negative }
            }
            _ => DirectionKind::Vector(self.expressions(inside)),
        };
        Some(Direction { kind, span })
    }

    fn element(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let role = match parts.next()?.as_str().trim() {
            "force" => ElementRole::Force,
            "actuator" => ElementRole::Actuator,
            "signal" => ElementRole::Signal,
            _ => ElementRole::Effect,
        };
        let name = self.name(parts.next()?);
        let law = self.name(parts.next()?);
        let place = if let Some(pair) = parts.take(Rule::place_on) {
            ElementPlace::On(self.name(Parts::of(pair).next()?))
        } else if let Some(pair) = parts.take(Rule::place_between) {
            self.place_between(pair)?
        } else {
            ElementPlace::Nowhere
        };
        Some(ItemKind::Element { role, name, law, place, fields: self.optional_fields(&mut parts) })
    }

    fn place_between(&mut self, pair: Pair<'_, Rule>) -> Built<ElementPlace> {
        let mut parts = Parts::of(pair);
        let first = self.name(parts.next()?);
        let second = self.name(parts.next()?);
        let use_of_axis = match parts.take(Rule::about_word) {
            Some(_) => PlaceAxis::About,
            None => PlaceAxis::Along,
        };
        let axis = match parts.take(Rule::direction) {
            Some(pair) => Some((use_of_axis, self.direction(pair)?)),
            None => None,
        };
        Some(ElementPlace::Between { first, second, axis })
    }

    fn measure(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let unit = self.optional_unit(&mut parts);
        let title = self.optional_text(&mut parts);
        let value = self.expression(parts.next()?);
        Some(ItemKind::Measure { name, unit, title, value, fields: self.optional_fields(&mut parts) })
    }

    fn group(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let mut members = Vec::new();
        while let Some(member) = parts.next() {
            members.push(self.name(member.into_inner().next()?));
        }
        let spans: Vec<Span> = members.iter().map(|member| member.span).collect();
        self.check_separators(&spans);
        Some(ItemKind::Group { name, members })
    }

    fn manoeuvre(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
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

    fn criterion(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let unit = self.optional_unit(&mut parts);
        let title = self.optional_text(&mut parts);
        let value = self.expression(parts.next()?);
        let manoeuvre = self.name(parts.next()?);
        let fields = self.optional_fields(&mut parts);
        Some(ItemKind::Criterion { name, unit, title, value, manoeuvre, fields })
    }

    fn experiment(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let role = parts.take(Rule::role).map(|pair| self.name(pair));
        Some(ItemKind::Experiment { name, role, fields: self.optional_fields(&mut parts) })
    }

    fn identify(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
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

    fn identify_line(&mut self, pair: Pair<'_, Rule>) -> Built<IdentifyLine> {
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

    fn filter(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
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

    fn lowpass(&mut self, pair: Pair<'_, Rule>) -> Built<Lowpass> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let pass = self.expression(parts.next()?);
        let pass_drop = self.expression(parts.next()?);
        let stop = self.expression(parts.next()?);
        let stop_attenuation = self.expression(parts.next()?);
        let single_pass = parts.next()?.as_rule() == Rule::single_pass;
        Some(Lowpass { pass, pass_drop, stop, stop_attenuation, single_pass, span })
    }

    fn variant(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let base = self.name(parts.next()?);
        let mut changes = Vec::new();
        while let Some(pair) = parts.next() {
            changes.push(self.change(pair)?);
        }
        Some(ItemKind::Variant { name, base, changes })
    }

    fn change(&mut self, pair: Pair<'_, Rule>) -> Built<Change> {
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

    fn law(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
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

    fn effect(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
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
    fn value_below(&self, last: &mut Declared) -> Option<Expression> {
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

    fn declared_part(&mut self, part: Pair<'_, Rule>, declared: &mut Declared) -> Built<()> {
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

    fn type_factor(&mut self, pair: Pair<'_, Rule>, sign: i8) -> Built<Option<(Name, i8)>> {
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

    fn state(&mut self, mut parts: Parts<'_>, span: Span) -> Built<StateDeclaration> {
        let name = self.name(parts.next()?);
        let kind = match parts.take(Rule::type_expression) {
            Some(pair) => Some(self.type_expression(pair)?),
            None => None,
        };
        let initial = self.expression(parts.next()?);
        let Some(derivative_name) = parts.next() else {
            return Some(StateDeclaration { name, kind, initial, derivative: None, span });
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
        Some(StateDeclaration { name, kind, initial, derivative, span })
    }

    fn event(&mut self, mut parts: Parts<'_>, span: Span) -> Built<EventDeclaration> {
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

    /// Reports neighbours that are separated neither by a comma nor by a new line.
    pub fn check_separators(&mut self, spans: &[Span]) {
        for pair in spans.windows(2) {
            let (before, after) = (pair[0].end as usize, pair[1].start as usize);
            let gap = self.text.get(before - self.offset..after - self.offset).unwrap_or("\n");
            if !gap.contains([',', '\n']) {
                let finding = Diagnostic::error(Code::UNEXPECTED_TEXT, "expected `,` or a new line")
                    .label(pair[1], "the next entry begins here")
                    .help("entries within braces are separated by a comma or stand on lines of their own");
                self.diagnostics.push(finding);
            }
        }
    }

    pub fn report_repeated(&mut self, message: &str, second: Span, first: Span) {
        let finding = Diagnostic::error(Code::REPEATED_CLAUSE, message)
            .label(second, "written again here")
            .secondary(first, "first written here");
        self.diagnostics.push(finding);
    }

    pub fn report(&mut self, code: Code, message: impl Into<String>, span: Span, label: &str) {
        self.diagnostics.push(Diagnostic::error(code, message).label(span, label));
    }
}

/// What the braces of laws and effects contain.
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

fn axis_kind(text: &str) -> Option<DirectionKind> {
    let (negative, letter) = match text.strip_prefix('-') {
        Some(letter) => (true, letter),
        None => (false, text),
    };
    let axis = ["x", "y", "z"].iter().position(|name| *name == letter.trim())?;
    Some(DirectionKind::Axis { axis, negative })
}
