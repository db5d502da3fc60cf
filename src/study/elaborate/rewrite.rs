//! Items within a model or family in terms of the flat study.

use super::scope::{Argument, Scope, segments};
use super::{Elaborator, same_place};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::study::evaluate::literal;
use crate::study::names::RESERVED;
use crate::syntax::{
    Direction, DirectionKind, ElementPlace, Expression, ExpressionKind, Field, IdentifyLine, Item, ItemKind, Name,
    Operator, Value,
};

/// What a path stands for.
enum Meaning {
    Path(String),
    Value(Expression),
}

impl Elaborator<'_, '_> {
    pub fn rewrite_item(&mut self, item: &mut Item, scope: &Scope) {
        match &mut item.kind {
            ItemKind::Gravity { value, direction } => {
                self.expression(value, None, scope);
                self.direction(direction, scope);
            }
            ItemKind::Constant { name, value } => {
                self.declared_name(name, scope);
                let path = name.text.clone();
                self.expression(value, Some(&path), scope);
            }
            ItemKind::Formula { name, value } => {
                self.declared_name(name, scope);
                self.expression(value, None, scope);
            }
            ItemKind::Coupling { name, left, right } => {
                self.declared_name(name, scope);
                self.expression(left, None, scope);
                self.expression(right, None, scope);
            }
            ItemKind::Input { name, title, fields, .. } => {
                self.named_fields(name, fields, scope);
                self.title(title, scope);
            }
            ItemKind::Body { name, fields, points } => {
                self.named_fields(name, fields, scope);
                for point in points.iter_mut() {
                    if let Some(key) = self.indexed(&point.key, scope) {
                        point.key.text = key;
                    }
                }
                let path = name.text.clone();
                self.fields(points, &path, scope);
            }
            ItemKind::Joint { name, axes, parent, child, fields, .. } => {
                self.named_fields(name, fields, scope);
                axes.iter_mut().for_each(|axis| self.direction(&mut axis.direction, scope));
                self.reference(parent, scope);
                self.reference(child, scope);
            }
            ItemKind::Element { name, place, fields, .. } => {
                self.named_fields(name, fields, scope);
                self.place(place, scope);
            }
            ItemKind::Measure { name, title, value, fields, .. } => {
                self.named_fields(name, fields, scope);
                self.title(title, scope);
                self.expression(value, None, scope);
            }
            ItemKind::Group { name, members } => {
                self.declared_name(name, scope);
                members.iter_mut().for_each(|member| self.reference(member, scope));
            }
            ItemKind::Manoeuvre { name, title, durations, fields } => {
                self.declared_name(name, scope);
                self.title(title, scope);
                durations.iter_mut().for_each(|duration| {
                    self.expression(duration, None, scope);
                });
                self.experiment_fields(fields, scope);
            }
            ItemKind::Criterion { name, title, value, manoeuvre, fields, .. } => {
                self.named_fields(name, fields, scope);
                self.title(title, scope);
                let word = manoeuvre.text.split('[').next().unwrap_or_default();
                if scope.locals.contains(word) {
                    self.reference(manoeuvre, scope);
                } else if let Some(path) = self.indexed(manoeuvre, scope) {
                    manoeuvre.text = path;
                }
                self.expression(value, None, scope);
            }
            ItemKind::Experiment { name, fields, .. } => {
                self.declared_name(name, scope);
                self.experiment_fields(fields, scope);
            }
            ItemKind::Identify { lines, constraints } => {
                lines.iter_mut().for_each(|line| self.identify_line(line, scope));
                constraints.iter_mut().for_each(|constraint| {
                    self.expression(constraint, None, scope);
                });
            }
            ItemKind::Solver { fields } => self.fields(fields, "", scope),
            // Written out elsewhere, or without names of the study.
            ItemKind::Study { .. }
            | ItemKind::Use { .. }
            | ItemKind::Filter { .. }
            | ItemKind::Variant { .. }
            | ItemKind::Law(_)
            | ItemKind::Effect(_)
            | ItemKind::Model(_)
            | ItemKind::Table(_)
            | ItemKind::Part { .. }
            | ItemKind::Family { .. } => {}
        }
    }

    /// The full name of what is declared here.
    pub fn declared_name(&mut self, name: &mut Name, scope: &Scope) {
        if scope.model.is_some() && name.text.split('[').next().is_some_and(|word| word.contains('.')) {
            let diagnostic = Diagnostic::error(Code::DOTTED_NAME, format!("`{}` contains a dot", name.text))
                .label(name.span, "names declared in a model have none")
                .help(format!("write `{}`", name.text.replace('.', "_")));
            self.report(diagnostic);
        }
        let is_ground = name.text == "ground" && scope.model.is_some();
        if let Some(path) = self.indexed(name, scope)
            && !is_ground
        {
            name.text = format!("{}{path}", scope.prefix);
        }
    }

    fn named_fields(&mut self, name: &mut Name, fields: &mut [Field], scope: &Scope) {
        self.declared_name(name, scope);
        let path = name.text.clone();
        self.fields(fields, &path, scope);
    }

    pub fn fields(&mut self, fields: &mut [Field], owner: &str, scope: &Scope) {
        for field in fields {
            let path = format!("{owner}.{}", field.key.text);
            self.value(&mut field.value, &path, scope);
        }
    }

    fn value(&mut self, value: &mut Value, path: &str, scope: &Scope) {
        match value {
            Value::Expression(expression) => {
                self.expression(expression, Some(path), scope);
            }
            Value::Tuple(components, _) => self.components(components, path, scope),
            Value::Range(low, high) => {
                self.expression(low, None, scope);
                self.expression(high, None, scope);
            }
            Value::Block { fields, .. } => self.fields(fields, path, scope),
            Value::List(names, _) => names.iter_mut().for_each(|name| self.reference(name, scope)),
            Value::Text(text) => self.text(text, scope),
        }
    }

    /// Within families `{i}` in a text stands for the index: `data = "run_{i}.csv"`.
    fn text(&mut self, text: &mut Name, scope: &Scope) {
        if scope.variables.is_empty() {
            return;
        }
        let mut rest = std::mem::take(&mut text.text);
        while let Some((before, index, behind)) = braced(&rest) {
            text.text += before;
            if let Some(number) = self.index(index, text.span, scope) {
                text.text += number.trim_matches(['[', ']']);
            }
            rest = behind.to_owned();
        }
        text.text += &rest;
    }

    fn title(&mut self, title: &mut Option<Name>, scope: &Scope) {
        if let Some(title) = title {
            self.text(title, scope);
        }
    }

    /// Components of a vector are numbers by themselves.
    fn components(&mut self, components: &mut [Expression], path: &str, scope: &Scope) {
        for (component, letter) in components.iter_mut().zip(["x", "y", "z", "xy", "xz", "yz"]) {
            self.expression(component, Some(&format!("{path}.{letter}")), scope);
        }
    }

    /// The keys within `start` and `columns` name quantities of the study.
    fn experiment_fields(&mut self, fields: &mut [Field], scope: &Scope) {
        for field in fields {
            if field.key.text.contains('[') {
                self.reference(&mut field.key, scope);
            }
            if let Value::Block { fields: inner, .. } = &mut field.value {
                inner.iter_mut().for_each(|entry| self.reference(&mut entry.key, scope));
            }
            self.value(&mut field.value, &field.key.text, scope);
        }
    }

    fn identify_line(&mut self, line: &mut IdentifyLine, scope: &Scope) {
        match self.meaning(&line.target, scope) {
            Some(Meaning::Path(path)) => line.target.text = path,
            Some(Meaning::Value(_)) => {
                let message = format!("`{}` is given by an expression where the model is used", line.target.text);
                let diagnostic = Diagnostic::error(Code::IDENTIFY_TARGET, message)
                    .label(line.target.span, "no number of the model")
                    .help("identify what the expression mentions, or a number that the model itself holds");
                self.report(diagnostic);
                line.target.text.clear();
            }
            None => line.target.text.clear(),
        }
        for expression in [&mut line.lower, &mut line.upper, &mut line.start] {
            self.expression(expression, None, scope);
        }
        if let Some((mean, deviation)) = &mut line.prior {
            self.expression(mean, None, scope);
            self.expression(deviation, None, scope);
        }
    }

    /// Directions are plain numbers.
    fn direction(&mut self, direction: &mut Direction, scope: &Scope) {
        match &mut direction.kind {
            DirectionKind::Axis { .. } => {}
            DirectionKind::OfBody { path, .. } => self.reference(path, scope),
            DirectionKind::Vector(components) => components.iter_mut().for_each(|component| {
                self.expression(component, None, scope);
                self.numbers_for_constants(component, scope);
            }),
        }
    }

    /// Where only numbers can stand, arguments appear as numbers instead of as constants.
    fn numbers_for_constants(&self, expression: &mut Expression, scope: &Scope) {
        match &mut expression.kind {
            ExpressionKind::Path(name) => {
                let number = scope.parameters.values().find_map(|argument| match argument {
                    Argument::Number { constant, value } if *constant == name.text => Some(value),
                    _ => None,
                });
                if let Some(value) = number {
                    expression.kind = value.kind.clone();
                }
            }
            ExpressionKind::Negate(inner) => self.numbers_for_constants(inner, scope),
            ExpressionKind::Binary { left, right, .. } => {
                self.numbers_for_constants(left, scope);
                self.numbers_for_constants(right, scope);
            }
            ExpressionKind::Call { arguments, .. } => {
                arguments.iter_mut().for_each(|argument| self.numbers_for_constants(argument, scope));
            }
            ExpressionKind::Number { .. } | ExpressionKind::If { .. } | ExpressionKind::Invalid => {}
        }
    }

    fn place(&mut self, place: &mut ElementPlace, scope: &Scope) {
        match place {
            ElementPlace::Nowhere => {}
            ElementPlace::On(name) => self.reference(name, scope),
            ElementPlace::Between { first, second, axis } => {
                self.reference(first, scope);
                self.reference(second, scope);
                axis.iter_mut().for_each(|(_, direction)| self.direction(direction, scope));
            }
        }
    }

    /// A name that stands for something other than a value; empty after an error.
    pub fn reference(&mut self, name: &mut Name, scope: &Scope) {
        let meaning = self.meaning(name, scope);
        let is_number = scope.parameters.contains_key(&name.text) || scope.variable(&name.text).is_some();
        match meaning {
            Some(Meaning::Path(path)) if !is_number => name.text = path,
            Some(_) => {
                let diagnostic = Diagnostic::error(Code::PORTS, format!("`{}` is a number", name.text))
                    .label(name.span, "a body, joint or element is needed here")
                    .help("what a model is joined to are its ports: `model bogie(frame: point) { .. }`");
                self.report(diagnostic);
                name.text.clear();
            }
            None => name.text.clear(),
        }
    }

    /// Replaces names; `path` is the flat path of the number if the expression is the whole value of a field.
    /// Arithmetic with loop variables is carried out. Returns whether something became a number.
    pub fn expression(&mut self, expression: &mut Expression, path: Option<&str>, scope: &Scope) -> bool {
        let span = expression.span;
        match &mut expression.kind {
            ExpressionKind::Path(name) => {
                let inlined = path.and_then(|path| self.identified_argument(name, path, scope));
                match inlined.map(Meaning::Value).or_else(|| self.meaning(name, scope)) {
                    Some(Meaning::Path(path)) => name.text = path,
                    Some(Meaning::Value(value)) => {
                        let text = value.span.end.saturating_sub(value.span.start) as usize;
                        self.written += text;
                        if self.written >= super::MOST_TEXT {
                            self.report_size(span);
                            expression.kind = ExpressionKind::Invalid;
                            return false;
                        }
                        let is_number = literal(&value).is_some();
                        expression.kind = value.kind;
                        expression.span = if is_number { span } else { value.span };
                        return is_number;
                    }
                    None => expression.kind = ExpressionKind::Invalid,
                }
                false
            }
            ExpressionKind::Negate(inner) => self.expression(inner, None, scope),
            ExpressionKind::Binary { operator, left, right } => {
                let (a, b) = (self.expression(left, None, scope), self.expression(right, None, scope));
                let folded = if a || b { folded(*operator, left, right) } else { None };
                match folded {
                    Some(kind) => {
                        expression.kind = kind;
                        true
                    }
                    None => false,
                }
            }
            ExpressionKind::Call { arguments, .. } => {
                arguments.iter_mut().for_each(|argument| {
                    self.expression(argument, None, scope);
                });
                false
            }
            ExpressionKind::If { condition, then, otherwise } => {
                [condition, then, otherwise].into_iter().for_each(|part| {
                    self.expression(part, None, scope);
                });
                false
            }
            ExpressionKind::Number { .. } | ExpressionKind::Invalid => false,
        }
    }

    /// A parameter of a part whose field is identified by its own path stands there as a number.
    fn identified_argument(&self, name: &Name, path: &str, scope: &Scope) -> Option<Expression> {
        match scope.parameters.get(&name.text) {
            Some(Argument::Number { value, .. }) if self.targets.contains(path) => Some(value.clone()),
            _ => None,
        }
    }

    /// `None`: reported.
    fn meaning(&mut self, name: &Name, scope: &Scope) -> Option<Meaning> {
        if let Some(value) = scope.variable(&name.text) {
            return Some(Meaning::Value(whole_number(value, name)));
        }
        match scope.parameters.get(&name.text) {
            Some(Argument::Number { constant, .. }) => return Some(Meaning::Path(constant.clone())),
            Some(Argument::Expression(value)) => return Some(Meaning::Value(value.clone())),
            Some(Argument::Missing) => return None,
            None => {}
        }
        let path = self.indexed(name, scope)?;
        let Some(model) = &scope.model else { return Some(Meaning::Path(path)) };
        let first = segments(&name.text).first().map_or("", |(first, _)| *first).to_owned();
        if scope.locals.contains(&first) {
            return Some(Meaning::Path(format!("{}{path}", scope.prefix)));
        }
        if let Some(place) = scope.ports.get(&first) {
            return Some(Meaning::Path(format!("{}{}", place.text, &path[first.len()..])));
        }
        let is_shared = RESERVED.contains(&first.as_str()) || self.constants.contains_key(&first);
        if is_shared {
            return Some(Meaning::Path(path));
        }
        let diagnostic = Diagnostic::error(
            Code::OUTSIDE_OF_MODEL,
            format!("model `{}` does not know `{first}`", model.text),
        )
        .label(name.span, "neither declared in the model nor handed in")
        .suggest(similar_name(&first, scope.names()))
        .help(format!(
            "hand it in: a number by `param {first}: TYPE`, a body or an element as a port, `model {}({first}: point)`",
            model.text
        ))
        .note(
            "a model sees its own declarations, ports and parameters, `ground`, `t`, `pi`, and the study's constants",
        );
        self.report(diagnostic);
        None
    }

    /// The path with numbers for its indices.
    fn indexed(&mut self, name: &Name, scope: &Scope) -> Option<String> {
        if !name.text.contains('[') {
            return Some(name.text.clone());
        }
        let mut path = String::new();
        for (word, index) in segments(&name.text) {
            if !path.is_empty() {
                path.push('.');
            }
            path += word;
            if let Some(index) = index {
                path += &self.index(index, name.span, scope)?;
            }
        }
        Some(path)
    }
}

/// What stands before, between and behind the first pair of braces.
fn braced(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once('{')?;
    let (index, behind) = rest.split_once('}')?;
    Some((before, index.trim(), behind))
}

fn whole_number(value: i64, name: &Name) -> Expression {
    Expression { kind: number_kind(value as f64, None), span: name.span }
}

/// Negative numbers are written with a sign before them.
fn number_kind(value: f64, unit: Option<Name>) -> ExpressionKind {
    let span = unit.as_ref().map_or_else(crate::diagnostics::Span::default, |unit| unit.span);
    let number = ExpressionKind::Number { value: value.abs(), unit };
    if value < 0.0 { ExpressionKind::Negate(Box::new(Expression { kind: number, span })) } else { number }
}

/// The number that two numbers make, where the unit of the result is written in one of them.
fn folded(operator: Operator, left: &Expression, right: &Expression) -> Option<ExpressionKind> {
    let ((a, unit_a), (b, unit_b)) = (literal(left)?, literal(right)?);
    let same = unit_a.map(|unit| &unit.text) == unit_b.map(|unit| &unit.text);
    let (value, unit) = match operator {
        Operator::Add if same => (a + b, unit_a),
        Operator::Subtract if same => (a - b, unit_a),
        Operator::Multiply if unit_b.is_none() => (a * b, unit_a),
        Operator::Multiply if unit_a.is_none() => (a * b, unit_b),
        Operator::Divide if unit_b.is_none() => (a / b, unit_a),
        _ => return None,
    };
    // Units with an offset do not scale.
    let has_offset = unit.is_some_and(|unit| unit.text.contains("degC"));
    (value.is_finite() && !has_offset)
        .then(|| number_kind(value, unit.map(|unit| same_place(unit.span, unit.text.clone()))))
}
