//! Parameters to identify, and the fixed numbers that could be.

use super::checker::{Allowed, Checker, Entity, Scope};
use super::declarations::Identified;
use super::evaluate::{Typed, literal};
use super::model::{Constant, Constraint, Parameter, Prior};
use super::units::read_unit;
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::expression::Node;
use crate::quantities::{Dimension, Unit};
use crate::syntax::{Expression, ExpressionKind, Name, Operator};

const NUMBERS: Scope = Scope::Study(Allowed::Number);

impl<'a> Checker<'a> {
    /// Reads all lines of `identify`; must come before any other expression is evaluated.
    pub fn read_parameters(&mut self) {
        for identified in &self.declared.identify {
            if !self.is_target(&identified.line.target) {
                continue;
            }
            let Some(parameter) = self.read_parameter(*identified) else {
                self.ignore_unknown(&identified.line.target.text);
                continue;
            };
            self.parameter_index.insert(parameter.name.clone(), self.parameters.len());
            if identified.line.per_experiment {
                self.split_by_experiment(parameter);
            } else {
                self.parameters.push(parameter);
                self.parameter_met.push(false);
            }
        }
        self.read_offsets();
    }

    /// What must hold between parameters, as `value <= 0`.
    pub fn finished_constraints(&mut self) -> Vec<Constraint> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        declared.constraints.iter().filter_map(|written| self.constraint(written)).collect()
    }

    fn constraint(&mut self, written: &'a Expression) -> Option<Constraint> {
        let scope = Scope::Study(Allowed::Constant);
        let sides = match &written.kind {
            ExpressionKind::Binary { operator: Operator::Less | Operator::LessEqual, left, right } => (left, right),
            ExpressionKind::Binary { operator: Operator::Greater | Operator::GreaterEqual, left, right } => {
                (right, left)
            }
            _ => {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "a constraint compares two quantities")
                    .label(written.span, "no comparison")
                    .help("write e.g. `constrain d_rebound >= d_compression`");
                return self.fail(diagnostic, scope);
            }
        };
        let (small, large) = (self.evaluate(sides.0, scope), self.evaluate(sides.1, scope));
        let (small, large) = (small?, large?);
        let message = || format!("{} cannot be compared with {}", small.dimension, large.dimension);
        self.same_dimension((small, sides.0.span), (large, sides.1.span), message, scope)?;
        let value = self.graph.subtract(small.node, large.node);
        let symbols = self.graph.symbols_of(&[value]);
        if !symbols.iter().any(|symbol| self.is_parameter(*symbol)) {
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "this constraint holds no parameter")
                .label(written.span, "depends on nothing that is identified");
            return self.fail(diagnostic, scope);
        }
        Some(Constraint { value, text: crate::syntax::print_expression(written), span: written.span })
    }

    /// Free names, constants and paths may be identified; other declared things are no numbers.
    fn is_target(&mut self, target: &'a Name) -> bool {
        let entity = self.entities.get(target.text.as_str()).copied();
        if target.text.is_empty() {
            return false;
        }
        let is_reserved = matches!(target.text.as_str(), "t" | "pi");
        if !is_reserved && matches!(entity, None | Some(Entity::Constant(_))) {
            return true;
        }
        let diagnostic = Diagnostic::error(Code::IDENTIFY_TARGET, format!("`{}` is not a number", target.text))
            .label(target.span, "cannot be identified")
            .help("identify a free name, or a fixed number by its path, e.g. `tyre.stiffness`");
        self.report(diagnostic, NUMBERS);
        false
    }

    fn read_parameter(&mut self, identified: Identified<'a>) -> Option<Parameter> {
        let line = identified.line;
        let unit = self.unit_of_line(&[&line.start, &line.upper, &line.lower])?;
        let hint = written_unit(&line.start).or(written_unit(&line.upper)).or(written_unit(&line.lower));
        let lower = self.number_with(&line.lower, written_unit(&line.upper).or(hint));
        let upper = self.number_with(&line.upper, hint);
        let start = self.number_with(&line.start, hint);
        let (lower, upper, start) = (lower?, upper?, start?);
        let target = (line.target.span, "the parameter has");
        for (value, expression) in [(lower, &line.lower), (upper, &line.upper)] {
            self.expect(value, expression.span, start.dimension, target, NUMBERS)?;
        }
        let unit = unit.unwrap_or_else(|| Unit::coherent(start.dimension));
        let values = [lower, upper, start].map(|value| self.graph.constant_value(value.node));
        let [Some(low), Some(high), Some(value)] = values else { return None };
        self.check_bounds(identified, [low, high, value], &unit)?;
        let prior = match &line.prior {
            Some(prior) => Some(self.read_prior(prior, start.dimension, target)?),
            None => None,
        };
        if let (Some(prior), Some((written, _))) = (&prior, &line.prior)
            && !(low..=high).contains(&prior.mean)
        {
            let message = format!("the prior of `{}` lies outside its bounds", line.target.text);
            let diagnostic = Diagnostic::warning(Code::PRIOR_OUTSIDE, message)
                .label(written.span, unit.format(prior.mean, 6))
                .secondary(line.lower.span.to(line.upper.span), "the bounds")
                .help("the fit will stop at the bound; widen the bounds or correct the prior");
            self.report(diagnostic, NUMBERS);
        }
        let symbol = self.graph.symbol(&line.target.text);
        let name = line.target.text.clone();
        Some(Parameter { name, symbol, unit, lower: low, upper: high, start: value, prior, span: line.target.span })
    }

    fn unit_of_line(&mut self, expressions: &[&'a Expression]) -> Option<Option<Unit>> {
        let Some(name) = expressions.iter().find_map(|expression| written_unit(expression)) else { return Some(None) };
        match read_unit(name) {
            Ok(unit) => Some(Some(unit)),
            Err(diagnostic) => self.fail(diagnostic, NUMBERS),
        }
    }

    fn check_bounds(&mut self, identified: Identified<'a>, [low, high, start]: [f64; 3], unit: &Unit) -> Option<()> {
        let line = identified.line;
        let show = |value: f64| unit.format(value, 6);
        if low >= high {
            let diagnostic = Diagnostic::error(Code::BOUNDS, "the lower bound must be below the upper bound")
                .label(line.lower.span, format!("lower: {}", show(low)))
                .label(line.upper.span, format!("upper: {}", show(high)))
                .help("exchange them, or widen the range");
            return self.fail(diagnostic, NUMBERS);
        }
        if start < low || start > high {
            let message = format!("the start value of `{}` lies outside its bounds", line.target.text);
            let diagnostic = Diagnostic::error(Code::BOUNDS, message)
                .label(line.start.span, show(start))
                .secondary(line.lower.span.to(line.upper.span), format!("{} .. {}", show(low), show(high)))
                .help("move the start between the bounds, or widen the bounds");
            return self.fail(diagnostic, NUMBERS);
        }
        Some(())
    }

    fn read_prior(
        &mut self,
        (mean, deviation): &'a (Expression, Expression),
        dimension: Dimension,
        target: (Span, &str),
    ) -> Option<Prior> {
        let average = self.number_with(mean, written_unit(deviation));
        let spread = match (literal(deviation), written_unit(deviation)) {
            // A difference: the offset of a unit does not count.
            (Some((value, Some(_))), Some(unit)) => {
                let unit = read_unit(unit).ok()?;
                Some(Typed::new(self.graph.constant(unit.difference_to_si(value)), unit.dimension))
            }
            _ => self.number_with(deviation, written_unit(mean)),
        };
        let (average, spread) = (average?, spread?);
        self.expect(average, mean.span, dimension, target, NUMBERS)?;
        self.expect(spread, deviation.span, dimension, target, NUMBERS)?;
        let standard_deviation = self.graph.constant_value(spread.node)?;
        if standard_deviation <= 0.0 {
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "the standard deviation of a prior must be positive")
                .label(deviation.span, "not above zero");
            return self.fail(diagnostic, NUMBERS);
        }
        Some(Prior { mean: self.graph.constant_value(average.node)?, standard_deviation })
    }

    /// A number as written; a bare one takes the unit `hint`.
    pub fn number_with(&mut self, expression: &'a Expression, hint: Option<&'a Name>) -> Option<Typed> {
        match (literal(expression), hint) {
            (Some((value, None)), Some(unit)) => match read_unit(unit) {
                Ok(unit) => Some(Typed::new(self.graph.constant(unit.to_si(value)), unit.dimension)),
                Err(diagnostic) => self.fail(diagnostic, NUMBERS),
            },
            _ => self.evaluate(expression, NUMBERS),
        }
    }

    /// A number of a known dimension; `what` says who wants it.
    pub fn fixed_number(
        &mut self,
        expression: &'a Expression,
        hint: Option<&'a Name>,
        wanted: Dimension,
        what: (Span, &str),
    ) -> Option<f64> {
        let value = self.number_with(expression, hint)?;
        let value = self.expect(value, expression.span, wanted, what, NUMBERS)?;
        self.graph.constant_value(value.node)
    }

    /// Remembers a plain number as one that an extension may free. `hint` is the unit of a bare number.
    pub fn note_constant(&mut self, path: &str, expression: &'a Expression, hint: Option<&'a Name>) {
        let Some((value, unit)) = literal(expression) else { return };
        let unit = match unit.or(hint).map(read_unit) {
            Some(Ok(unit)) => unit,
            Some(Err(_)) => return,
            None => Unit::dimensionless(),
        };
        if !self.constants.iter().any(|constant| constant.path == path) {
            let (path, value) = (path.to_owned(), unit.to_si(value));
            self.constants.push(Constant { path, value, unit, span: expression.span });
        }
    }

    /// Identified paths that lead nowhere, and parameters that nothing depends on. Those of the base that a variant
    /// made idle are left out with a warning; the indices that stay are returned.
    pub fn check_influence(&mut self, roots: &[Node]) -> Vec<usize> {
        let used = self.graph.symbols_of(roots);
        let paths: Vec<String> = self.constants.iter().map(|constant| constant.path.clone()).collect();
        let mut kept = Vec::new();
        for index in 0..self.parameters.len() {
            let parameter = &self.parameters[index];
            let (name, span, symbol) = (parameter.name.clone(), parameter.span, parameter.symbol);
            let is_path = name.contains('.');
            if used.contains(&symbol) {
                kept.push(index);
            } else if is_path && !self.parameter_met[index] && !self.is_idle_in_variant(&name) {
                let similar = similar_name(&name, paths.iter().map(String::as_str));
                let diagnostic = Diagnostic::error(Code::IDENTIFY_TARGET, format!("there is no number `{name}`"))
                    .label(span, "leads to nothing that the study holds fixed")
                    .suggest(similar)
                    .note("a path names the field of an element that is given as a plain number");
                self.report(diagnostic, NUMBERS);
            } else if self.is_idle_in_variant(&name) {
                let message =
                    format!("`{name}` has no influence in variant `{}` and is left out", self.declared.variant);
                self.report(Diagnostic::warning(Code::LEFT_OUT, message).label(span, "identified here"), NUMBERS);
            } else if self.parameter_met[index] && self.diagnostics.iter().any(Diagnostic::is_error) {
                // What it stands in may be wrong.
            } else {
                let diagnostic =
                    Diagnostic::error(Code::UNUSED_PARAMETER, format!("parameter `{name}` has no influence"))
                        .label(span, "nothing that is simulated or measured depends on it")
                        .help("use it in the model, or remove the line");
                self.report(diagnostic, NUMBERS);
            }
        }
        kept
    }

    /// Whether a line of the base study is idle because of the variant applied.
    fn is_idle_in_variant(&self, target: &str) -> bool {
        let line = self.declared.identify.iter().find(|identified| identified.line.target.text == target);
        self.declared.variant != "base" && line.is_some_and(|identified| !identified.by_variant)
    }
}

/// The unit of a plain number.
pub(super) fn written_unit(expression: &Expression) -> Option<&Name> {
    literal(expression).and_then(|(_, unit)| unit)
}
