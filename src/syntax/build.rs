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
    pub offset: usize,
    /// The declaration's text; wrong statements are blanked out.
    pub text: &'a str,
    tokens: &'a [Token],
    pub diagnostics: Vec<Diagnostic>,
}

/// The parts of a rule without punctuation and keywords.
pub(super) struct Parts<'i> {
    pub pairs: Peekable<Pairs<'i, Rule>>,
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
            | coupling_word
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
            | nominal_word
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

pub(super) type Built<T> = Option<T>;

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
            Rule::coupling => self.coupling(parts),
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

    pub fn optional_text(&self, parts: &mut Parts<'_>) -> Option<Name> {
        parts.take(Rule::text).map(|pair| self.quoted(pair))
    }

    pub fn optional_unit(&self, parts: &mut Parts<'_>) -> Option<Name> {
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

    fn coupling(&mut self, mut parts: Parts<'_>) -> Built<ItemKind> {
        let name = self.name(parts.next()?);
        let left = self.expression(parts.next()?);
        Some(ItemKind::Coupling { name, left, right: self.expression(parts.next()?) })
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
fn axis_kind(text: &str) -> Option<DirectionKind> {
    let (negative, letter) = match text.strip_prefix('-') {
        Some(letter) => (true, letter),
        None => (false, text),
    };
    let axis = ["x", "y", "z"].iter().position(|name| *name == letter.trim())?;
    Some(DirectionKind::Axis { axis, negative })
}
