//! Manoeuvres and criteria: what the model is used for.

use super::channels::text_of;
use super::checker::{Allowed, Checker, Scope};
use super::declarations::{Criterion as DeclaredCriterion, Manoeuvre as DeclaredManoeuvre};
use super::evaluate::Typed;
use super::fields::find;
use super::model::{Criterion, Manoeuvre, Start, StartBase, Statistic};
use super::units::read_unit;
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::expression::{Node, Operation};
use crate::quantities::{Dimension, Unit};
use crate::syntax::{Expression, ExpressionKind, Field, Name};

const SCOPE: Scope = Scope::Study(Allowed::Number);
/// Instants at which criteria look at a manoeuvre that states no `step`.
const INSTANTS: f64 = 2000.0;
/// A manoeuvre is looked at no more often than this.
const MOST_INSTANTS: f64 = 1e6;
/// Confidence of a criterion that states none.
const CONFIDENCE: f64 = 0.95;

impl<'a> Checker<'a> {
    pub fn finished_manoeuvres(&mut self) -> Vec<Manoeuvre> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        declared.manoeuvres.iter().filter_map(|manoeuvre| self.manoeuvre(manoeuvre)).collect()
    }

    fn manoeuvre(&mut self, declared: &DeclaredManoeuvre<'a>) -> Option<Manoeuvre> {
        let (name, fields) = (declared.name, declared.fields);
        self.check_repeated(fields);
        let inputs = self.manoeuvre_inputs(name, fields);
        let duration = self.duration(declared);
        let start = match find(fields, "start") {
            Some(field) => self.start(field),
            None => Some(Start { base: StartBase::Equilibrium, overrides: Vec::new() }),
        };
        let step = match find(fields, "step") {
            Some(field) => self.positive_time(field).map(Some),
            None => Some(None),
        };
        let (duration, step) = (duration?, step?);
        let step = step.unwrap_or(duration / INSTANTS);
        if step > duration || duration / step > MOST_INSTANTS {
            let field = find(fields, "step")?;
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "the step does not fit the duration")
                .label(super::fields::value_span(field), "longer than the manoeuvre, or a million times shorter")
                .help("leave it out: a manoeuvre is looked at in 2000 steps");
            return self.fail(diagnostic, SCOPE);
        }
        let title = text_of(declared.title);
        Some(Manoeuvre {
            name: name.text.clone(),
            title,
            inputs: inputs?,
            duration,
            step,
            start: start?,
            span: name.span,
        })
    }

    fn duration(&mut self, declared: &DeclaredManoeuvre<'a>) -> Option<f64> {
        let name = declared.name;
        match declared.durations {
            [duration] => {
                let value = self.fixed_number(duration, None, Dimension::TIME, (duration.span, "a duration has"))?;
                if value > 0.0 && value.is_finite() {
                    return Some(value);
                }
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "a duration must be positive")
                    .label(duration.span, "not above zero");
                self.fail(diagnostic, SCOPE)
            }
            [] => {
                let message = format!("manoeuvre `{}` does not say how long it lasts", name.text);
                let diagnostic = Diagnostic::error(Code::MISSING_FIELD, message)
                    .label(name.span, "`for` is missing")
                    .help("add e.g. `for 4 s`");
                self.fail(diagnostic, SCOPE)
            }
            [first, second, ..] => {
                let diagnostic = Diagnostic::error(Code::DUPLICATE_NAME, "the duration is given twice")
                    .label(second.span, "second value")
                    .secondary(first.span, "first value");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    fn positive_time(&mut self, field: &'a Field) -> Option<f64> {
        let expression = self.field_expression(field)?;
        let what = format!("`{}`", field.key.text);
        let value = self.fixed_number(expression, None, Dimension::TIME, (field.key.span, &what))?;
        if value > 0.0 && value.is_finite() {
            return Some(value);
        }
        let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("{what} must be positive"))
            .label(expression.span, "not above zero");
        self.fail(diagnostic, SCOPE)
    }

    /// Every input of the study as a formula of time.
    fn manoeuvre_inputs(&mut self, name: &'a Name, fields: &'a [Field]) -> Option<Vec<Node>> {
        let known: Vec<(String, Dimension)> =
            self.inputs.iter().map(|input| (input.name.clone(), input.unit.dimension)).collect();
        for field in fields {
            let key = &field.key;
            if ["start", "step"].contains(&key.text.as_str()) || known.iter().any(|(input, _)| *input == key.text) {
                continue;
            }
            let names = known.iter().map(|(input, _)| input.as_str());
            let message = format!("manoeuvre `{}`: there is no input `{}`", name.text, key.text);
            let diagnostic = Diagnostic::error(Code::UNKNOWN_FIELD, message)
                .label(key.span, "not declared")
                .suggest(similar_name(&key.text, names.chain(["start", "step"])))
                .note("fields: the study's inputs, `start`, `step`; and `for` with the duration");
            self.report(diagnostic, SCOPE);
        }
        let mut inputs = Vec::new();
        for (input, dimension) in known {
            inputs.push(match find(fields, &input) {
                Some(field) => self.input_formula(field, dimension),
                None => {
                    let message = format!("manoeuvre `{}` does not say what `{input}` does", name.text);
                    let diagnostic = Diagnostic::error(Code::MISSING_FIELD, message)
                        .label(name.span, format!("`{input}` is missing"))
                        .help(format!("add `{input} = ...`, a formula of the time `t` or a number"));
                    self.fail(diagnostic, SCOPE)
                }
            });
        }
        inputs.into_iter().collect()
    }

    fn input_formula(&mut self, field: &'a Field, dimension: Dimension) -> Option<Node> {
        let expression = self.field_expression(field)?;
        let value = self.evaluate(expression, Scope::Study(Allowed::Motion))?;
        let value = self.expect(value, expression.span, dimension, (field.key.span, "the input has"), SCOPE)?;
        let symbols = self.graph.symbols_of(&[value.node]);
        let is_sampled = |node| match self.graph.operation(node) {
            Operation::Sample { input, .. } => self.graph.curve(input).is_none(),
            _ => false,
        };
        let samples = self.graph.reachable(&[value.node]).into_iter().any(is_sampled);
        let foreign = symbols.into_iter().find(|symbol| *symbol != self.time);
        let on = match foreign {
            Some(symbol) => self.graph.symbol_name(symbol).to_owned(),
            None if samples => "an input".to_owned(),
            None => return Some(value.node),
        };
        let message = "the inputs of a manoeuvre are functions of time and numbers only";
        let diagnostic =
            Diagnostic::error(Code::NOT_AN_INPUT, message).label(expression.span, format!("depends on `{on}`"));
        self.fail(diagnostic, SCOPE)
    }

    pub fn finished_criteria(&mut self) -> Vec<Criterion> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        declared.criteria.iter().filter_map(|criterion| self.criterion(criterion)).collect()
    }

    fn criterion(&mut self, declared: &DeclaredCriterion<'a>) -> Option<Criterion> {
        let (name, fields) = (declared.name, declared.fields);
        self.known_fields(&format!("criterion `{}`", name.text), fields, &["below", "above", "within", "confidence"]);
        let manoeuvre = self.declared_manoeuvre(declared.manoeuvre);
        let (statistic, quantity) = self.statistic(declared.value)?;
        let value = self.evaluate(quantity, Scope::Study(Allowed::Acceleration))?;
        let unit = self.criterion_unit(declared, value, quantity)?;
        let below = self.bound(fields, "below", value.dimension)?;
        let above = self.bound(fields, "above", value.dimension)?;
        let within = self.half_width(fields, value.dimension)?;
        if let (Some(low), Some(high)) = (above, below)
            && low >= high
        {
            let diagnostic = Diagnostic::error(Code::BOUNDS, "nothing lies above and below these bounds")
                .label(name.span, "demands the impossible");
            return self.fail(diagnostic, SCOPE);
        }
        let confidence = match find(fields, "confidence") {
            Some(field) => self.confidence(field)?,
            None => CONFIDENCE,
        };
        Some(Criterion {
            name: name.text.clone(),
            title: text_of(declared.title),
            unit,
            statistic,
            value: value.node,
            manoeuvre: manoeuvre?,
            below,
            above,
            within,
            confidence,
            span: name.span,
        })
    }

    /// Index of a manoeuvre among those declared; faulty ones have reported their own error, which ends the check.
    fn declared_manoeuvre(&mut self, name: &'a Name) -> Option<usize> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let found = declared.manoeuvres.iter().position(|manoeuvre| manoeuvre.name.text == name.text);
        if found.is_none() {
            let names = declared.manoeuvres.iter().map(|manoeuvre| manoeuvre.name.text.as_str());
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no manoeuvre `{}`", name.text))
                .label(name.span, "not declared")
                .suggest(similar_name(&name.text, names))
                .help("declare it: `manoeuvre NAME { u = ..., for 4 s }`");
            return self.fail(diagnostic, SCOPE);
        }
        found
    }

    /// `max(tyre.force)`
    fn statistic(&mut self, expression: &'a Expression) -> Option<(Statistic, &'a Expression)> {
        if let ExpressionKind::Call { function, arguments } = &expression.kind
            && let Some((_, statistic)) = Statistic::NAMES.iter().find(|(name, _)| *name == function.text)
            && let [quantity] = arguments.as_slice()
        {
            return Some((*statistic, quantity));
        }
        let names = Statistic::NAMES.map(|(name, _)| name);
        let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "a criterion is one number of a whole manoeuvre")
            .label(expression.span, "not a `max(..)`, `min(..)`, `rms(..)`, `mean(..)` or `final(..)`")
            .note(format!("statistics: {}", names.join(", ")))
            .help("write e.g. `max(abs(tyre.force) - 3 kN)`");
        self.fail(diagnostic, SCOPE)
    }

    /// The unit written in brackets, else that of a bound, else SI.
    fn criterion_unit(&mut self, declared: &DeclaredCriterion<'a>, value: Typed, at: &'a Expression) -> Option<Unit> {
        let bound =
            ["below", "above", "within"].iter().filter_map(|key| find(declared.fields, key)).find_map(|field| {
                match &field.value {
                    crate::syntax::Value::Expression(expression) => super::identify::written_unit(expression),
                    _ => None,
                }
            });
        let Some(written) = declared.unit.or(bound) else { return Some(Unit::coherent(value.dimension)) };
        match read_unit(written) {
            Ok(unit) => {
                self.expect(value, at.span, unit.dimension, (written.span, "the criterion is in"), SCOPE)?;
                Some(unit)
            }
            Err(diagnostic) => self.fail(diagnostic, SCOPE),
        }
    }

    /// `Some(None)`: not given; `None`: wrong.
    fn bound(&mut self, fields: &'a [Field], key: &str, dimension: Dimension) -> Option<Option<f64>> {
        let Some(field) = find(fields, key) else { return Some(None) };
        let expression = self.field_expression(field)?;
        let because = format!("`{key}` bounds a quantity in");
        self.fixed_number(expression, None, dimension, (field.key.span, &because)).map(Some)
    }

    /// A difference: the offset of a unit does not count.
    fn half_width(&mut self, fields: &'a [Field], dimension: Dimension) -> Option<Option<f64>> {
        let Some(value) = self.bound(fields, "within", dimension)? else { return Some(None) };
        let field = find(fields, "within")?;
        let expression = self.field_expression(field)?;
        let unit = super::identify::written_unit(expression).and_then(|unit| read_unit(unit).ok());
        let width = value - unit.map_or(0.0, |unit| unit.offset);
        if width > 0.0 && width.is_finite() {
            return Some(Some(width));
        }
        let diagnostic =
            Diagnostic::error(Code::WRONG_VALUE, "`within` must be positive").label(expression.span, "not above zero");
        self.fail(diagnostic, SCOPE)
    }

    fn confidence(&mut self, field: &'a Field) -> Option<f64> {
        let expression = self.field_expression(field)?;
        let value = self.fixed_number(expression, None, Dimension::ONE, (field.key.span, "`confidence`"))?;
        if (0.5..1.0).contains(&value) {
            return Some(value);
        }
        let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "a confidence lies between 50 % and 100 %")
            .label(expression.span, "out of range")
            .help("write e.g. `confidence = 99 %`");
        self.fail(diagnostic, SCOPE)
    }
}
