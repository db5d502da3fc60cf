//! Declarations of effects as data for diagnosis.

use super::checker::{Allowed, Checker, Scope};
use super::declarations::Effect;
use super::identify::written_unit;
use super::kinds::monomial;
use super::model::{EffectDeclaration, EffectParameter, Motion, PlaceKind, PlaceQuantity};
use super::units::read_unit;
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::quantities::{Dimension, named_type};
use crate::syntax::{Declared, EffectAction, Name};

const SCOPE: Scope = Scope::Study(Allowed::Number);

const KINDS: [(&str, PlaceKind); 7] = [
    ("joint", PlaceKind::Joint),
    ("force", PlaceKind::Force),
    ("actuator", PlaceKind::Actuator),
    ("input", PlaceKind::Input),
    ("measure", PlaceKind::Measure),
    ("signal", PlaceKind::Signal),
    ("gravity", PlaceKind::Gravity),
];

/// What may stand behind an amplitude or a shape.
const FLAGS: [&str; 4] = ["one_sided", "finite", "unnamed", "periodic"];

/// The word by which declarations name a kind of place.
pub(super) fn kind_word(kind: PlaceKind) -> &'static str {
    KINDS.iter().find(|(_, other)| *other == kind).map_or("place", |(word, _)| word)
}

impl<'a> Checker<'a> {
    /// All declared effects; those with faults are reported and left out.
    pub fn effect_catalogue(&mut self) -> Vec<EffectDeclaration> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        declared.effect_declarations.iter().filter_map(|effect| self.effect_data(effect)).collect()
    }

    fn effect_data(&mut self, effect: &Effect<'a>) -> Option<EffectDeclaration> {
        let declaration = effect.declaration;
        let kinds: Vec<Option<PlaceKind>> = declaration.places.iter().map(|place| self.read_kind(place)).collect();
        let kinds: Vec<PlaceKind> = kinds.into_iter().collect::<Option<_>>()?;
        let (motion, dimension) = match &declaration.restriction {
            Some(restriction) => self.read_restriction(restriction)?,
            None => (None, None),
        };
        self.check_actions(effect, &kinds)?;
        let read = |checker: &mut Self, list: &'a [Declared], is_amplitude: bool| {
            let read: Vec<_> = list.iter().map(|declared| checker.effect_parameter(declared, is_amplitude)).collect();
            read.into_iter().collect::<Option<Vec<EffectParameter>>>()
        };
        let amplitudes = read(self, &declaration.amplitudes, true);
        let shapes = read(self, &declaration.shapes, false);
        let (amplitudes, shapes) = (amplitudes?, shapes?);
        if amplitudes.is_empty() {
            let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, "an effect needs an amplitude")
                .label(declaration.name.span, "its strength cannot be varied")
                .help("declare `amplitude NAME: TYPE`; at its neutral value the effect is not there");
            return self.fail(diagnostic, SCOPE);
        }
        let documentation = effect.documentation.trim().to_owned();
        let title = documentation.lines().next().unwrap_or_default().split(". ").next().unwrap_or_default();
        Some(EffectDeclaration {
            name: declaration.name.text.clone(),
            title: title.trim_end_matches('.').to_owned(),
            kinds,
            motion,
            dimension,
            replaces: replaced_ports(declaration),
            amplitudes,
            shapes,
            documentation,
            is_prelude: effect.is_prelude,
        })
    }

    fn read_kind(&mut self, place: &'a Name) -> Option<PlaceKind> {
        if let Some((_, kind)) = KINDS.iter().find(|(word, _)| *word == place.text) {
            return Some(*kind);
        }
        let words = KINDS.map(|(word, _)| word);
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no kind of place `{}`", place.text))
            .label(place.span, "not known")
            .suggest(similar_name(&place.text, words))
            .note(format!("kinds of places: {}", words.join(", ")));
        self.fail(diagnostic, SCOPE)
    }

    fn read_restriction(&mut self, restriction: &'a Name) -> Option<(Option<Motion>, Option<Dimension>)> {
        match restriction.text.as_str() {
            "translational" => Some((Some(Motion::Translational), None)),
            "rotational" => Some((Some(Motion::Rotational), None)),
            other => match named_type(other) {
                Some(named) => Some((None, Some(named.dimension))),
                None => {
                    let message = format!("places cannot be restricted to `{other}`");
                    let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
                        .label(restriction.span, "not known")
                        .help("write `translational`, `rotational` or the type of the place's value, e.g. `length`");
                    self.fail(diagnostic, SCOPE)
                }
            },
        }
    }

    /// Something happens, and only ports that every admitted place has are replaced.
    fn check_actions(&mut self, effect: &Effect<'a>, kinds: &[PlaceKind]) -> Option<()> {
        let declaration = effect.declaration;
        if declaration.actions.is_empty() {
            let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, "an effect must do something")
                .label(declaration.name.span, "neither `adds` nor `replaces`");
            return self.fail(diagnostic, SCOPE);
        }
        for action in &declaration.actions {
            let EffectAction::Replaces(port, _) = action else { continue };
            let refusing = kinds.iter().copied().find(|kind| !has_port(*kind, &port.text));
            if let Some(kind) = refusing {
                let message = format!("a {} has no `{}` that could be replaced", kind_word(kind), port.text);
                let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, message)
                    .label(port.span, "not replaceable there")
                    .help("joints: only `adds`; forces: x, v, load; actuators: also command; inputs: u; measures: y; signals: value");
                return self.fail(diagnostic, SCOPE);
            }
        }
        Some(())
    }

    fn effect_parameter(&mut self, declared: &'a Declared, is_amplitude: bool) -> Option<EffectParameter> {
        let (monomial, dimension) = match &declared.kind {
            Some(kind) => match monomial(kind) {
                Ok(read) => read,
                Err(diagnostic) => return self.fail(diagnostic, SCOPE),
            },
            None => {
                let message = format!("`{}` needs a type", declared.name.text);
                let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, message)
                    .label(declared.name.span, "declared without type")
                    .help(format!("write e.g. `{}: load`", declared.name.text));
                return self.fail(diagnostic, SCOPE);
            }
        };
        let (range, relative_range) = self.range_of(declared, &monomial, dimension)?;
        if !is_amplitude && range.is_none() && relative_range.is_none() && declared.default.is_none() {
            let message = format!("shape `{}` needs a range", declared.name.text);
            let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, message)
                .label(declared.name.span, "its values cannot be scanned")
                .help("write `in LOWER .. UPPER`, or `in 0.01 .. 1 of rate` relative to what is typical at the place");
            return self.fail(diagnostic, SCOPE);
        }
        let mut flags = [false; FLAGS.len()];
        for flag in &declared.flags {
            match FLAGS.iter().position(|known| *known == flag.text) {
                Some(at) => flags[at] = true,
                None => {
                    let message = format!("there is no property `{}`", flag.text);
                    let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
                        .label(flag.span, "not known")
                        .suggest(similar_name(&flag.text, FLAGS))
                        .note(format!("properties: {}", FLAGS.join(", ")));
                    return self.fail(diagnostic, SCOPE);
                }
            }
        }
        let neutral = match &declared.neutral {
            Some(expression) => {
                let wanted = dimension.unwrap_or_default();
                self.fixed_number(expression, None, wanted, (declared.name.span, "the neutral value of"))?
            }
            None => 0.0,
        };
        let unit = declared.range.as_ref().and_then(|(lower, upper)| written_unit(upper).or(written_unit(lower)));
        Some(EffectParameter {
            name: declared.name.text.clone(),
            monomial,
            dimension,
            range,
            relative_range,
            one_sided: flags[0],
            neutral,
            finite_only: flags[1],
            unnamed: flags[2],
            periodic: flags[3],
            unit: unit.and_then(|unit| read_unit(unit).ok()),
        })
    }

    /// Absolute and relative range.
    #[allow(clippy::type_complexity)]
    fn range_of(
        &mut self,
        declared: &'a Declared,
        monomial: &[(PlaceQuantity, i8)],
        dimension: Option<Dimension>,
    ) -> Option<(Option<(f64, f64)>, Option<(f64, f64)>)> {
        let Some((lower, upper)) = &declared.range else { return Some((None, None)) };
        let name = declared.name.span;
        let (low, high) = if declared.range_of.is_some() {
            let what = (name, "a relative range has");
            (
                self.fixed_number(lower, None, Dimension::ONE, what)?,
                self.fixed_number(upper, None, Dimension::ONE, what)?,
            )
        } else {
            let what = (name, "the parameter has");
            let upper_value = self.number_with(upper, None)?;
            let wanted = dimension.unwrap_or(upper_value.dimension);
            (
                self.fixed_number(lower, written_unit(upper), wanted, what)?,
                self.fixed_number(upper, None, wanted, what)?,
            )
        };
        if low >= high {
            let diagnostic = Diagnostic::error(Code::BOUNDS, "the lower bound must be below the upper bound")
                .label(lower.span.to(upper.span), "empty range");
            return self.fail(diagnostic, SCOPE);
        }
        if let Some(of) = &declared.range_of {
            self.check_range_of(of, monomial)?;
            return Some((None, Some((low, high))));
        }
        Some((Some((low, high)), None))
    }

    /// `of rate` must name what the parameter is measured in.
    fn check_range_of(&mut self, of: &'a Name, monomial: &[(PlaceQuantity, i8)]) -> Option<()> {
        let word = |quantity: PlaceQuantity| match quantity {
            PlaceQuantity::Coordinate => "coordinate",
            PlaceQuantity::Rate => "rate",
            PlaceQuantity::Load => "load",
            PlaceQuantity::Value => "value",
            PlaceQuantity::Time => "time",
        };
        if let [(quantity, 1)] = monomial
            && word(*quantity) == of.text
        {
            return Some(());
        }
        let expected = match monomial {
            [(quantity, 1)] => format!("write `of {}`", word(*quantity)),
            _ => "relative ranges are for parameters of one type of the place (`coordinate`, `rate`, `load`, `value`)"
                .to_owned(),
        };
        let diagnostic =
            Diagnostic::error(Code::INVALID_DECLARATION, format!("this range cannot be relative to `{}`", of.text))
                .label(of.span, "not the parameter's type")
                .help(expected);
        self.fail(diagnostic, SCOPE)
    }
}

fn replaced_ports(declaration: &crate::syntax::EffectDeclaration) -> Vec<String> {
    let ports = declaration.actions.iter().filter_map(|action| match action {
        EffectAction::Replaces(port, _) => Some(port.text.clone()),
        EffectAction::Adds(_) => None,
    });
    ports.collect()
}

fn has_port(kind: PlaceKind, port: &str) -> bool {
    match kind {
        PlaceKind::Joint => false,
        PlaceKind::Force | PlaceKind::Actuator => !matches!(port, "u" | "y" | "value" | "inertia"),
        PlaceKind::Input => matches!(port, "u" | "value"),
        PlaceKind::Measure => matches!(port, "y" | "value"),
        PlaceKind::Signal => !matches!(port, "u" | "y" | "x" | "v" | "load"),
        PlaceKind::Gravity => port == "value",
    }
}
