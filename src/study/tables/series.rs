//! Tables as sums of harmonics: listed ones, or those of a spectrum with phases by chance.

use super::{SCOPE, Table, TableShape};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Graph, Node, Unary};
use crate::quantities::Dimension;
use crate::study::checker::{Allowed, Checker, Scope};
use crate::study::evaluate::Typed;
use crate::study::fields::find;
use crate::study::identify::written_unit;
use crate::study::kinds::Kinds;
use crate::study::model::Motion;
use crate::syntax::{Expression, Field, Name, TableDeclaration, Value};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// `amplitude * cos(factor * x + phase)`; amplitude and phase may depend on parameters.
pub(in crate::study) struct Component {
    factor: f64,
    amplitude: Node,
    phase: Node,
}

/// More harmonics are refused: every one is part of the equations.
const MOST_COMPONENTS: usize = 500;
const NAMED: Scope = Scope::Study(Allowed::Constant);

pub(super) fn sum(graph: &mut Graph, components: &[Component], x: Node) -> Node {
    let mut value = graph.constant(0.0);
    for component in components {
        let factor = graph.constant(component.factor);
        let turned = graph.multiply(factor, x);
        let angle = graph.add(turned, component.phase);
        let wave = graph.unary(Unary::Cos, angle);
        let term = graph.multiply(component.amplitude, wave);
        value = graph.add(value, term);
    }
    value
}

impl<'a> Checker<'a> {
    pub(super) fn read_series(&mut self, table: &'a TableDeclaration) -> Option<Table> {
        let owner = format!("table `{}`", table.name.text);
        self.known_fields(&owner, &table.fields, &["spectrum", "wavelengths", "components", "seed"]);
        if let Some((_, span)) = &table.points {
            let diagnostic = Diagnostic::error(Code::TABLE_FORM, format!("{owner} has points and harmonics"))
                .label(*span, "the points")
                .help("remove one of them; the sum of two tables is `a(x) + b(x)`");
            return self.fail(diagnostic, SCOPE);
        }
        let (argument, value) = self.series_dimensions(table)?;
        let components = match (&table.harmonics, find(&table.fields, "spectrum")) {
            (Some((list, _)), None) => self.harmonics(list, argument, value)?,
            (None, Some(field)) => self.spectrum(table, field, argument, value)?,
            _ => {
                let diagnostic = Diagnostic::error(Code::TABLE_FORM, format!("{owner} has harmonics and a spectrum"))
                    .label(table.name.span, "which of them?")
                    .help("write two tables and add them: `a(x) + b(x)`");
                return self.fail(diagnostic, SCOPE);
            }
        };
        Some(Table { arguments: vec![argument], value, shape: TableShape::Sum(components) })
    }

    /// Of argument and value as declared; a table of harmonics has no points that tell them.
    fn series_dimensions(&mut self, table: &'a TableDeclaration) -> Option<(Dimension, Dimension)> {
        let kind = match table.arguments.as_slice() {
            [argument] => argument.kind.as_ref(),
            _ => None,
        };
        let Some(kind) = kind else {
            let message = format!("table `{}` needs one argument with its type", table.name.text);
            let diagnostic = Diagnostic::error(Code::TABLE_FORM, message)
                .label(table.name.span, "a function of one argument")
                .help("write e.g. `(s: length)`");
            return self.fail(diagnostic, SCOPE);
        };
        let (first, second) = (self.form(kind)?, self.form(&table.result)?);
        let kinds = Kinds::of(Motion::Translational);
        match (first.dimension(&kinds), second.dimension(&kinds)) {
            (Some(argument), Some(value)) => Some((argument, value)),
            _ => {
                let diagnostic = Diagnostic::error(Code::TABLE_FORM, "the types of harmonics must be known")
                    .label(kind.span.to(table.result.span), "an open type")
                    .help("write named types: `length`, `angle`, `time`");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    /// `(order, amplitude, phase)` of an angle, `(period, amplitude, phase)` of anything else.
    fn harmonics(
        &mut self,
        list: &'a [Vec<Expression>],
        argument: Dimension,
        value: Dimension,
    ) -> Option<Vec<Component>> {
        let column = |at: usize| list.iter().filter_map(move |entries| entries.get(at));
        let units: [Option<&'a Name>; 3] = [0, 1, 2].map(|at| column(at).find_map(written_unit));
        let mut components = Vec::new();
        for entries in list {
            let [order, amplitude, phase] = entries.as_slice() else {
                let span = entries.first().map_or(Span::default(), |first| first.span);
                let diagnostic = Diagnostic::error(Code::TABLE_POINTS, "a harmonic has an order, an amplitude and a phase")
                    .label(span, format!("this one has {} numbers", entries.len()))
                    .help("write `(3, 0.1 mm, 20 deg)`; where the argument is no angle, the first is the period: `(12 m, ..)`");
                return self.fail(diagnostic, SCOPE);
            };
            let because = (order.span, "the table's argument has");
            let number = self.fixed_number(order, units[0], argument, because)?;
            if number <= 0.0 || !number.is_finite() {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "an order or period must be positive")
                    .label(order.span, "not above zero");
                return self.fail(diagnostic, SCOPE);
            }
            let factor = if argument == Dimension::ONE { number } else { TAU / number };
            let amplitude = self.named_or_number(amplitude, units[1], value)?;
            let phase = self.named_or_number(phase, units[2], Dimension::ONE)?;
            components.push(Component { factor, amplitude, phase });
        }
        self.check_count(components.len(), list.first().and_then(|entries| entries.first()).map(|first| first.span))?;
        Some(components)
    }

    fn named_or_number(&mut self, written: &'a Expression, unit: Option<&'a Name>, wanted: Dimension) -> Option<Node> {
        let value = match crate::study::evaluate::literal(written) {
            Some((_, None)) => self.number_with(written, unit)?,
            _ => self.evaluate(written, NAMED)?,
        };
        Some(self.expect(value, written.span, wanted, (written.span, "the table has"), NAMED)?.node)
    }

    fn check_count(&mut self, count: usize, span: Option<Span>) -> Option<()> {
        if (1..=MOST_COMPONENTS).contains(&count) {
            return Some(());
        }
        let diagnostic = Diagnostic::error(Code::TABLE_POINTS, format!("{count} harmonics"))
            .label(span.unwrap_or_default(), format!("between 1 and {MOST_COMPONENTS} can be treated"));
        self.fail(diagnostic, SCOPE)
    }

    /// Harmonics with the power of the one-sided density over the wavenumber (rad per unit of the argument) in bands of
    /// equal width on a logarithmic scale, each at the geometric middle of its band, phases by chance.
    fn spectrum(
        &mut self,
        table: &'a TableDeclaration,
        field: &'a Field,
        argument: Dimension,
        value: Dimension,
    ) -> Option<Vec<Component>> {
        let (shortest, longest) = self.wavelengths(table, argument)?;
        let count = self.whole_number(table, "components")?;
        let seed = self.whole_number(table, "seed")?;
        self.check_count(count as usize, find(&table.fields, "components").map(|field| field.span))?;
        let expression = self.field_expression(field)?;
        let symbol = self.graph.symbol("wavenumber");
        let variable = self.graph.variable(symbol);
        self.wavenumber = Some(Typed::new(variable, Dimension::ONE / argument));
        let density = self.evaluate(expression, NAMED);
        self.wavenumber = None;
        let because = (field.key.span, "squared value per wavenumber");
        let density = self.expect(density?, expression.span, value * value * argument, because, NAMED)?.node;
        let (low, high) = (TAU / longest, TAU / shortest);
        let ratio = (high / low).powf(1.0 / f64::from(count));
        let mut components = Vec::new();
        for k in 0..count {
            let (from, to) = (low * ratio.powi(k as i32), low * ratio.powi(k as i32 + 1));
            let factor = (from * to).sqrt();
            let middle = self.graph.constant(factor);
            let power = *self.graph.substitute(&[density], &HashMap::from([(symbol, middle)])).first()?;
            let twice_width = self.graph.constant(2.0 * (to - from));
            let square = self.graph.multiply(twice_width, power);
            if self.graph.constant_value(square).is_some_and(|square| square.is_nan() || square < 0.0) {
                let diagnostic = Diagnostic::error(Code::NOT_FINITE, "a spectral density is not negative")
                    .label(expression.span, format!("it is at the wavelength {} (SI)", TAU / factor));
                return self.fail(diagnostic, SCOPE);
            }
            let amplitude = self.graph.unary(Unary::Sqrt, square);
            let phase = self.graph.constant(TAU * chance(u64::from(seed), u64::from(k)));
            components.push(Component { factor, amplitude, phase });
        }
        Some(components)
    }

    /// `wavelengths = 3 m .. 100 m`
    fn wavelengths(&mut self, table: &'a TableDeclaration, argument: Dimension) -> Option<(f64, f64)> {
        let Some(field) = find(&table.fields, "wavelengths") else {
            return self.series_field_missing(table, "wavelengths", "wavelengths = 3 m .. 100 m");
        };
        let Value::Range(lower, upper) = &field.value else {
            return self.wrong_value(field, "a range of wavelengths `3 m .. 100 m`");
        };
        let what = (field.key.span, "a wavelength");
        let low = self.fixed_number(lower, written_unit(upper), argument, what)?;
        let high = self.fixed_number(upper, None, argument, what)?;
        if low > 0.0 && low < high && high.is_finite() {
            return Some((low, high));
        }
        let diagnostic = Diagnostic::error(Code::BOUNDS, "wavelengths are positive, the shorter first")
            .label(field.span, "not a range of wavelengths");
        self.fail(diagnostic, SCOPE)
    }

    fn whole_number(&mut self, table: &'a TableDeclaration, key: &str) -> Option<u32> {
        let Some(field) = find(&table.fields, key) else {
            return self.series_field_missing(table, key, &format!("{key} = {}", if key == "seed" { 1 } else { 60 }));
        };
        let expression = self.field_expression(field)?;
        let number = self.fixed_number(expression, None, Dimension::ONE, (field.key.span, "a whole number"))?;
        if number >= 0.0 && number.fract() == 0.0 && number <= f64::from(u32::MAX) {
            return Some(number as u32);
        }
        let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("`{key}` must be a whole number"))
            .label(expression.span, "not a whole number");
        self.fail(diagnostic, SCOPE)
    }

    fn series_field_missing<T>(&mut self, table: &'a TableDeclaration, key: &str, example: &str) -> Option<T> {
        let diagnostic = Diagnostic::error(Code::MISSING_FIELD, format!("table `{}` needs `{key}`", table.name.text))
            .label(table.name.span, format!("`{key}` is missing"))
            .help(format!("add `{example}`"));
        self.fail(diagnostic, SCOPE)
    }
}

/// A number in 0 .. 1 that looks random: the same on every machine (SplitMix64, Steele-Lea-Flood-2014).
fn chance(seed: u64, index: u64) -> f64 {
    let mut z = seed.wrapping_mul(0xD134_2543_DE82_EF95).wrapping_add((index + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
