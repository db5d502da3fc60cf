//! The table of unit symbols and prefixes.
//!
//! Sources: BIPM-2019 (SI brochure, tables 1 to 8), NIST-SP811 (inch, foot, pound-force, psi, mile).

use super::Dimension;
use std::f64::consts::PI;

/// A unit symbol with its conversion `SI = factor * value + offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Symbol {
    pub text: &'static str,
    pub dimension: Dimension,
    pub factor: f64,
    pub offset: f64,
    /// SI prefixes may stand in front.
    pub prefixed: bool,
}

const fn si(text: &'static str, dimension: Dimension, factor: f64) -> Symbol {
    Symbol { text, dimension, factor, offset: 0.0, prefixed: true }
}

const fn plain(text: &'static str, dimension: Dimension, factor: f64) -> Symbol {
    Symbol { text, dimension, factor, offset: 0.0, prefixed: false }
}

const ONE: Dimension = Dimension::ONE;
const PRESSURE: Dimension = Dimension::new(1, -1, -2, 0, 0);
const POWER: Dimension = Dimension::new(1, 2, -3, 0, 0);
const VOLTAGE: Dimension = Dimension::new(1, 2, -3, -1, 0);
/// m/s^2, by definition.
pub(super) const STANDARD_GRAVITY: f64 = 9.80665;
const POUND: f64 = 0.45359237;
const INCH: f64 = 0.0254;

pub(super) const SYMBOLS: &[Symbol] = &[
    si("m", Dimension::LENGTH, 1.0),
    si("g", Dimension::MASS, 1e-3),
    si("s", Dimension::TIME, 1.0),
    si("A", Dimension::CURRENT, 1.0),
    si("K", Dimension::TEMPERATURE, 1.0),
    si("N", Dimension::FORCE, 1.0),
    si("Pa", PRESSURE, 1.0),
    si("J", Dimension::TORQUE, 1.0),
    si("W", POWER, 1.0),
    si("V", VOLTAGE, 1.0),
    si("Hz", Dimension::FREQUENCY, 1.0),
    si("Ohm", Dimension::new(1, 2, -3, -2, 0), 1.0),
    si("Ω", Dimension::new(1, 2, -3, -2, 0), 1.0),
    si("F", Dimension::new(-1, -2, 4, 2, 0), 1.0),
    si("H", Dimension::new(1, 2, -2, -2, 0), 1.0),
    si("Wb", Dimension::new(1, 2, -2, -1, 0), 1.0),
    si("T", Dimension::new(1, 0, -2, -1, 0), 1.0),
    si("rad", ONE, 1.0),
    si("bar", PRESSURE, 1e5),
    si("l", Dimension::new(0, 3, 0, 0, 0), 1e-3),
    si("L", Dimension::new(0, 3, 0, 0, 0), 1e-3),
    plain("deg", ONE, PI / 180.0),
    plain("°", ONE, PI / 180.0),
    plain("rev", ONE, 2.0 * PI),
    plain("rpm", Dimension::FREQUENCY, 2.0 * PI / 60.0),
    plain("%", ONE, 1e-2),
    plain("‰", ONE, 1e-3),
    plain("ppm", ONE, 1e-6),
    plain("min", Dimension::TIME, 60.0),
    plain("h", Dimension::TIME, 3600.0),
    plain("t", Dimension::MASS, 1e3),
    plain("g0", Dimension::ACCELERATION, STANDARD_GRAVITY),
    plain("inch", Dimension::LENGTH, INCH),
    plain("ft", Dimension::LENGTH, 12.0 * INCH),
    plain("mile", Dimension::LENGTH, 5280.0 * 12.0 * INCH),
    plain("mph", Dimension::VELOCITY, 5280.0 * 12.0 * INCH / 3600.0),
    plain("lb", Dimension::MASS, POUND),
    plain("lbf", Dimension::FORCE, POUND * STANDARD_GRAVITY),
    plain("psi", PRESSURE, POUND * STANDARD_GRAVITY / (INCH * INCH)),
    plain("atm", PRESSURE, 101_325.0),
    Symbol { text: "degC", dimension: Dimension::TEMPERATURE, factor: 1.0, offset: 273.15, prefixed: false },
    Symbol { text: "°C", dimension: Dimension::TEMPERATURE, factor: 1.0, offset: 273.15, prefixed: false },
];

/// Longest first where one starts like another (`da`, `d`).
pub(super) const PREFIXES: &[(&str, f64)] = &[
    ("da", 1e1),
    ("T", 1e12),
    ("G", 1e9),
    ("M", 1e6),
    ("k", 1e3),
    ("h", 1e2),
    ("d", 1e-1),
    ("c", 1e-2),
    ("m", 1e-3),
    ("u", 1e-6),
    ("µ", 1e-6),
    ("μ", 1e-6),
    ("n", 1e-9),
    ("p", 1e-12),
    ("f", 1e-15),
];

/// What people write that is no unit symbol here, and what to write instead.
pub(super) const SLIPS: &[(&str, &str)] = &[
    ("Nm", "N*m"),
    ("kNm", "kN*m"),
    ("mNm", "mN*m"),
    ("Ns", "N*s"),
    ("kmh", "km/h"),
    ("kph", "km/h"),
    ("kmph", "km/h"),
    ("sec", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("msec", "ms"),
    ("hr", "h"),
    ("hour", "h"),
    ("meter", "m"),
    ("metre", "m"),
    ("micron", "um"),
    ("Kg", "kg"),
    ("kgs", "kg"),
    ("in", "inch"),
    ("C", "degC"),
    ("celsius", "degC"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("gr", "g"),
    ("G", "g0"),
    ("gn", "g0"),
    ("percent", "%"),
    ("pct", "%"),
    ("hz", "Hz"),
    ("U/min", "rpm"),
    ("RPM", "rpm"),
    ("kWh", "kW*h"),
    ("Wh", "W*h"),
    ("Vs", "V*s"),
    ("As", "A*s"),
    ("ohm", "Ohm"),
    ("tonne", "t"),
    ("ton", "t"),
];

/// The symbol a word stands for, with the factor of its prefix. Symbols without prefix win (`min`, `ft`).
pub(super) fn find(word: &str) -> Option<(Symbol, f64)> {
    if let Some(symbol) = SYMBOLS.iter().find(|symbol| symbol.text == word) {
        return Some((*symbol, 1.0));
    }
    PREFIXES.iter().find_map(|(prefix, scale)| {
        let rest = word.strip_prefix(prefix)?;
        let symbol = SYMBOLS.iter().find(|symbol| symbol.prefixed && symbol.text == rest)?;
        Some((*symbol, *scale))
    })
}
