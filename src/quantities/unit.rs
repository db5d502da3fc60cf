//! Units: conversion and printing of values.

use super::parse::{UnitError, parse};
use super::{Dimension, symbols};

/// A unit as written, with its conversion `SI = factor * value + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    pub symbol: String,
    pub dimension: Dimension,
    pub factor: f64,
    pub offset: f64,
}

/// Units of angles and of full turns measure the same dimension; quantities of a declared type accept only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngleContent {
    Neutral,
    /// `Hz`: full periods
    Cycles,
    /// `rad`, `deg`, `rev`, `rpm`: turned angle
    Angle,
}

impl Unit {
    /// Reads `kN*s/m`, `N*m/rad`, `m/s^2`, `1/s`, `%`, `degC`, ... The symbol is kept as written.
    pub fn parse(text: &str) -> Result<Unit, UnitError> {
        parse(text)
    }

    /// The unit `1`.
    pub fn dimensionless() -> Unit {
        Unit::coherent(Dimension::ONE)
    }

    /// The SI unit of a dimension, e.g. `N*s/m`.
    pub fn coherent(dimension: Dimension) -> Unit {
        Unit { symbol: dimension.symbol(), dimension, factor: 1.0, offset: 0.0 }
    }

    /// The SI value of `value` in this unit.
    pub fn to_si(&self, value: f64) -> f64 {
        self.factor * value + self.offset
    }

    /// The value in this unit of an SI value.
    pub fn from_si(&self, value: f64) -> f64 {
        (value - self.offset) / self.factor
    }

    /// The value in this unit of a difference (standard deviation, step) given in SI: the offset does not count.
    pub fn difference_from_si(&self, value: f64) -> f64 {
        value / self.factor
    }

    /// The SI value of a difference in this unit.
    pub fn difference_to_si(&self, value: f64) -> f64 {
        value * self.factor
    }

    /// An SI value in this unit, e.g. `1.23 kN*s/m`, with `digits` significant digits. The unit `1` is not shown.
    pub fn format(&self, si_value: f64, digits: usize) -> String {
        let number = format_number(self.from_si(si_value), digits);
        if self.symbol == "1" { number } else { format!("{number} {}", self.symbol) }
    }

    /// Whether the unit names turned angles (`rad/s`, `rpm`, `deg`) or periods (`Hz`).
    pub fn angle_content(&self) -> AngleContent {
        let words = self.symbol.split(|sign: char| !(sign.is_alphanumeric() || sign == '°'));
        let mut content = AngleContent::Neutral;
        for (symbol, _) in words.filter_map(symbols::find) {
            match symbol.text {
                "Hz" => content = AngleContent::Cycles,
                "rad" | "deg" | "°" | "rev" | "rpm" => return AngleContent::Angle,
                _ => {}
            }
        }
        content
    }
}

/// A number with so many significant digits, without trailing zeros, in plain notation where that is readable.
pub fn format_number(value: f64, digits: usize) -> String {
    let digits = digits.max(1);
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { value.to_string() };
    }
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if !(-4..7).contains(&exponent) {
        return format!("{}e{exponent}", without_trailing_zeros(mantissa));
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    let rounded: f64 = scientific.parse().unwrap_or(value);
    without_trailing_zeros(&format!("{rounded:.decimals$}")).to_owned()
}

fn without_trailing_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit(text: &str) -> Unit {
        Unit::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    fn close(left: f64, right: f64) -> bool {
        (left - right).abs() <= 1e-12 * left.abs().max(right.abs())
    }

    #[test]
    fn units_of_the_language_convert_to_si() {
        let pi = std::f64::consts::PI;
        for (text, factor, dimension) in [
            ("kN*s/m", 1e3, Dimension::new(1, 0, -1, 0, 0)),
            ("N*m/rad", 1.0, Dimension::TORQUE),
            ("m/s^2", 1.0, Dimension::ACCELERATION),
            ("m/s²", 1.0, Dimension::ACCELERATION),
            ("mm", 1e-3, Dimension::LENGTH),
            ("µm", 1e-6, Dimension::LENGTH),
            ("%", 1e-2, Dimension::ONE),
            ("deg", pi / 180.0, Dimension::ONE),
            ("g", 1e-3, Dimension::MASS),
            ("kg", 1.0, Dimension::MASS),
            ("g0", 9.80665, Dimension::ACCELERATION),
            ("rpm", pi / 30.0, Dimension::FREQUENCY),
            ("Hz", 1.0, Dimension::FREQUENCY),
            ("kHz", 1e3, Dimension::FREQUENCY),
            ("1/s", 1.0, Dimension::FREQUENCY),
            ("bar", 1e5, Dimension::new(1, -1, -2, 0, 0)),
            ("N/mm^2", 1e6, Dimension::new(1, -1, -2, 0, 0)),
            ("km/h", 1.0 / 3.6, Dimension::VELOCITY),
            ("min", 60.0, Dimension::TIME),
            ("ms", 1e-3, Dimension::TIME),
            ("inch", 0.0254, Dimension::LENGTH),
            ("kg*m^2", 1.0, Dimension::INERTIA),
            ("N/(m*s)", 1.0, Dimension::new(1, 0, -3, 0, 0)),
            ("s^-1", 1.0, Dimension::FREQUENCY),
            ("dag", 1e-2, Dimension::MASS),
            ("V/A", 1.0, Dimension::new(1, 2, -3, -2, 0)),
            ("1", 1.0, Dimension::ONE),
            ("MW", 1e6, Dimension::new(1, 2, -3, 0, 0)),
            ("mN", 1e-3, Dimension::FORCE),
        ] {
            let unit = unit(text);
            assert!(close(unit.factor, factor), "{text}: {} against {factor}", unit.factor);
            assert_eq!(unit.dimension, dimension, "{text}");
            assert_eq!(unit.symbol, text);
        }
        assert!(close(unit("psi").factor, 6894.757293168361));
        assert!(close(unit("lbf").factor, 4.4482216152605));
        assert!(close(unit("degC").to_si(20.0), 293.15));
        assert!((unit("degC").from_si(293.15) - 20.0).abs() < 1e-10);
        assert_eq!(unit("degC").difference_to_si(20.0), 20.0);
    }

    #[test]
    fn angles_and_periods_are_told_apart() {
        for (text, content) in [
            ("Hz", AngleContent::Cycles),
            ("kHz", AngleContent::Cycles),
            ("rpm", AngleContent::Angle),
            ("rad/s", AngleContent::Angle),
            ("mrad/s", AngleContent::Angle),
            ("N*m/deg", AngleContent::Angle),
            ("1/s", AngleContent::Neutral),
            ("kN*s/m", AngleContent::Neutral),
        ] {
            assert_eq!(unit(text).angle_content(), content, "{text}");
        }
    }

    #[test]
    fn values_are_printed_in_the_unit_the_user_wrote() {
        assert_eq!(unit("kN*s/m").format(1234.5, 4), "1.234 kN*s/m");
        assert_eq!(unit("%").format(0.305, 4), "30.5 %");
        assert_eq!(Unit::dimensionless().format(0.3, 4), "0.3");
        for (value, text) in [
            (0.0, "0"),
            (99.996, "100"),
            (1234.0, "1234"),
            (1234567.0, "1235000"),
            (12345678.0, "1.235e7"),
            (0.00012, "0.00012"),
            (0.000012, "1.2e-5"),
            (-0.5, "-0.5"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(format_number(value, 4), text);
        }
    }

    fn any_unit() -> impl Strategy<Value = String> {
        let symbol =
            prop::sample::select(vec!["m", "mm", "kg", "s", "ms", "N", "kN", "rad", "Hz", "V", "A", "K", "bar"]);
        let factor = (symbol, -3i32..=3).prop_map(|(symbol, exponent)| format!("{symbol}^{exponent}"));
        let operator = prop::sample::select(vec!["*", "/"]);
        (factor.clone(), prop::collection::vec((operator, factor), 0..4)).prop_map(|(first, rest)| {
            rest.into_iter().fold(first, |text, (operator, factor)| format!("{text}{operator}{factor}"))
        })
    }

    proptest! {
        #[test]
        fn products_of_units_multiply_factors_and_dimensions(left in any_unit(), right in any_unit()) {
            let (a, b) = (unit(&left), unit(&right));
            let product = unit(&format!("{left}*({right})"));
            let quotient = unit(&format!("{left}/({right})"));
            prop_assert_eq!(product.dimension, a.dimension * b.dimension);
            prop_assert_eq!(quotient.dimension, a.dimension / b.dimension);
            prop_assert!(close(product.factor, a.factor * b.factor));
            prop_assert!(close(quotient.factor, a.factor / b.factor));
        }

        #[test]
        fn conversion_there_and_back_is_identity(text in any_unit(), value in -1e6f64..1e6) {
            let unit = unit(&text);
            prop_assert!((unit.from_si(unit.to_si(value)) - value).abs() <= 1e-12 * value.abs());
        }

        #[test]
        fn no_text_makes_the_reader_fall_over(text in "[a-zA-Z0-9µ°%²³*/^()·. -]{0,24}") {
            if let Err(error) = Unit::parse(&text) {
                prop_assert!(!error.to_string().is_empty());
                error.help();
            }
        }

        #[test]
        fn printed_numbers_keep_their_digits(value in prop::num::f64::NORMAL) {
            let printed: f64 = format_number(value, 9).parse().expect("a number");
            prop_assert!((printed - value).abs() <= 1e-8 * value.abs(), "{value} became {printed}");
        }
    }
}
