//! Units as text: `kN*s/m`, `N*m/rad`, `m/s^2`, `1/s`, `N/(m*s)`, `m²`.

use super::Unit;
use super::symbols::{PREFIXES, SLIPS, SYMBOLS, find};
use crate::diagnostics::similar_name;
use std::fmt;

/// Why a text is no unit.
#[derive(Clone, Debug, PartialEq)]
pub enum UnitError {
    /// Nothing, or an operator without a symbol behind it.
    Missing { text: String },
    /// A symbol that is not known.
    Unknown { symbol: String, text: String },
    /// A unit with offset (`degC`) in a product or with a power.
    Offset { symbol: String, text: String },
    /// `dB` is a logarithm and stands only where the language asks for it.
    Decibel { text: String },
    /// Exponents are whole numbers up to 9.
    Exponent { text: String },
    /// Anything else, from this byte on.
    Unexpected { text: String, at: usize },
}

impl fmt::Display for UnitError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UnitError::Missing { text } if text.is_empty() => write!(formatter, "the unit is missing"),
            UnitError::Missing { text } => write!(formatter, "the unit `{text}` is incomplete"),
            UnitError::Unknown { symbol, text } if symbol == text => write!(formatter, "unknown unit `{symbol}`"),
            UnitError::Unknown { symbol, text } => write!(formatter, "unknown unit `{symbol}` in `{text}`"),
            UnitError::Offset { symbol, .. } => write!(formatter, "`{symbol}` has an offset and must stand alone"),
            UnitError::Decibel { .. } => write!(formatter, "`dB` stands for a ratio and has no meaning here"),
            UnitError::Exponent { text } => {
                write!(formatter, "the exponents in `{text}` must be whole numbers up to 9")
            }
            UnitError::Unexpected { text, at } => {
                let rest = text.get(*at..).unwrap_or_default();
                write!(formatter, "`{rest}` cannot stand in the unit `{text}`")
            }
        }
    }
}

impl std::error::Error for UnitError {}

impl UnitError {
    /// The likely fix.
    pub fn help(&self) -> Option<String> {
        match self {
            UnitError::Unknown { symbol, text } => suggestion(symbol, text),
            UnitError::Offset { .. } => Some("differences of temperature are written in `K`".to_owned()),
            UnitError::Decibel { .. } => Some("write the ratio itself, e.g. `0.5` or `50 %`".to_owned()),
            UnitError::Missing { .. } | UnitError::Unexpected { .. } => {
                Some("units are written without spaces, e.g. `kN*s/m`, `m/s^2`, `1/s`".to_owned())
            }
            UnitError::Exponent { .. } => None,
        }
    }
}

fn suggestion(symbol: &str, text: &str) -> Option<String> {
    if let Some((_, right)) = SLIPS.iter().find(|(wrong, _)| *wrong == symbol) {
        return Some(match *right {
            "g0" => "write `g0` for the standard acceleration of gravity (`g` is the gram)".to_owned(),
            right => format!("write `{right}`"),
        });
    }
    if symbol != text && !text.starts_with(symbol) {
        return Some(format!(
            "to multiply or divide a quantity by something that is no unit, put spaces around the operator: `2 mm * {symbol}`"
        ));
    }
    let known: Vec<String> = spelled_symbols();
    let is_known = |text: &str| known.iter().any(|name| name == text);
    let similar = similar_name(symbol, known.iter().map(String::as_str));
    // `kNs`: two units without the sign between them.
    let product = (1..symbol.len()).rev().filter(|&at| symbol.is_char_boundary(at)).map(|at| symbol.split_at(at));
    let product = product.into_iter().find(|(left, right)| is_known(left) && is_known(right));
    match (similar, product) {
        (Some(name), _) if name.eq_ignore_ascii_case(symbol) => Some(format!("did you mean `{name}`?")),
        (_, Some((left, right))) => Some(format!("units are multiplied by `*`: `{left}*{right}`")),
        (similar, None) => similar.map(|name| format!("did you mean `{name}`?")),
    }
}

/// All symbols, without and with the prefixes that are in common use.
fn spelled_symbols() -> Vec<String> {
    let plain = SYMBOLS.iter().map(|symbol| symbol.text.to_owned());
    let prefixed = SYMBOLS.iter().filter(|symbol| symbol.prefixed).flat_map(|symbol| {
        let common = PREFIXES.iter().filter(|(prefix, _)| matches!(*prefix, "k" | "m" | "M" | "c" | "u"));
        common.map(|(prefix, _)| format!("{prefix}{}", symbol.text))
    });
    plain.chain(prefixed).collect()
}

pub(super) fn parse(text: &str) -> Result<Unit, UnitError> {
    let trimmed = text.trim();
    if trimmed == "dB" {
        return Err(UnitError::Decibel { text: trimmed.to_owned() });
    }
    let mut parser = Parser { text: trimmed, at: 0, nesting: 0 };
    let unit = parser.product()?;
    if parser.at < trimmed.len() {
        return Err(UnitError::Unexpected { text: trimmed.to_owned(), at: parser.at });
    }
    Ok(Unit { symbol: trimmed.to_owned(), ..unit })
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    nesting: u8,
}

/// Parentheses in units beyond this depth are refused.
const DEEPEST_NESTING: u8 = 8;
const LARGEST_EXPONENT: i32 = 9;

impl Parser<'_> {
    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        if found {
            self.at += wanted.len_utf8();
        }
        found
    }

    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut unit = self.power()?;
        loop {
            let divide = match self.peek() {
                Some('*' | '·') => false,
                Some('/') => true,
                _ => return Ok(unit),
            };
            self.at += self.peek().map_or(0, char::len_utf8);
            let factor = self.power()?;
            self.refuse_offset(&unit)?;
            self.refuse_offset(&factor)?;
            unit.dimension = if divide { unit.dimension / factor.dimension } else { unit.dimension * factor.dimension };
            unit.factor = if divide { unit.factor / factor.factor } else { unit.factor * factor.factor };
        }
    }

    fn power(&mut self) -> Result<Unit, UnitError> {
        let unit = self.atom()?;
        let Some(exponent) = self.exponent()? else {
            return Ok(unit);
        };
        self.refuse_offset(&unit)?;
        let dimension =
            unit.dimension.power(exponent).ok_or_else(|| UnitError::Exponent { text: self.text.to_owned() })?;
        Ok(Unit { dimension, factor: unit.factor.powi(exponent), ..unit })
    }

    fn exponent(&mut self) -> Result<Option<i32>, UnitError> {
        let superscript = self.peek().and_then(|sign| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|digit| digit == sign));
        if let Some(exponent) = superscript {
            self.at += self.peek().map_or(0, char::len_utf8);
            return Ok(Some(exponent as i32));
        }
        if !self.take('^') {
            return Ok(None);
        }
        let negative = self.take('-');
        let digits: String = self.text[self.at..].chars().take_while(char::is_ascii_digit).collect();
        self.at += digits.len();
        match digits.parse::<i32>() {
            Ok(exponent) if exponent <= LARGEST_EXPONENT => Ok(Some(if negative { -exponent } else { exponent })),
            _ => Err(UnitError::Exponent { text: self.text.to_owned() }),
        }
    }

    fn atom(&mut self) -> Result<Unit, UnitError> {
        if self.take('(') {
            return self.parenthesis();
        }
        if self.take('1') {
            return Ok(Unit::dimensionless());
        }
        let word: String = self.text[self.at..].chars().take_while(|&sign| is_symbol(sign)).collect();
        if word.is_empty() {
            return Err(match self.peek() {
                None => UnitError::Missing { text: self.text.to_owned() },
                Some(_) => UnitError::Unexpected { text: self.text.to_owned(), at: self.at },
            });
        }
        let Some((symbol, scale)) = find(&word) else {
            return Err(UnitError::Unknown { symbol: word, text: self.text.to_owned() });
        };
        self.at += word.len();
        Ok(Unit { symbol: word, dimension: symbol.dimension, factor: scale * symbol.factor, offset: symbol.offset })
    }

    fn parenthesis(&mut self) -> Result<Unit, UnitError> {
        self.nesting += 1;
        if self.nesting > DEEPEST_NESTING {
            return Err(UnitError::Unexpected { text: self.text.to_owned(), at: self.at });
        }
        let unit = self.product()?;
        self.nesting -= 1;
        if self.take(')') {
            Ok(unit)
        } else if self.at == self.text.len() {
            Err(UnitError::Missing { text: self.text.to_owned() })
        } else {
            Err(UnitError::Unexpected { text: self.text.to_owned(), at: self.at })
        }
    }

    fn refuse_offset(&self, unit: &Unit) -> Result<(), UnitError> {
        if unit.offset == 0.0 {
            return Ok(());
        }
        Err(UnitError::Offset { symbol: unit.symbol.clone(), text: self.text.to_owned() })
    }
}

fn is_symbol(sign: char) -> bool {
    (sign.is_alphanumeric() && !"⁰¹²³⁴⁵⁶⁷⁸⁹".contains(sign)) || matches!(sign, '_' | '%' | '‰' | '°')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_helped() {
        let help = |text: &str| parse(text).expect_err("no unit").help().unwrap_or_default();
        assert_eq!(help("Nm"), "write `N*m`");
        assert_eq!(help("kmh"), "write `km/h`");
        assert_eq!(help("KN"), "did you mean `kN`?");
        assert_eq!(help("kNs/m"), "units are multiplied by `*`: `kN*s`");
        assert_eq!(help("Pas"), "units are multiplied by `*`: `Pa*s`");
        assert!(help("G").contains("`g0`"));
        assert!(help("mm*x_0").contains("`2 mm * x_0`"));
        assert_eq!(help("degC/s"), "differences of temperature are written in `K`");
    }

    #[test]
    fn bad_units_are_refused_with_a_reason() {
        for (text, message) in [
            ("", "the unit is missing"),
            ("N*", "the unit `N*` is incomplete"),
            ("(N", "the unit `(N` is incomplete"),
            ("blah", "unknown unit `blah`"),
            ("kN*blah", "unknown unit `blah` in `kN*blah`"),
            ("m^x", "the exponents in `m^x` must be whole numbers up to 9"),
            ("m^99", "the exponents in `m^99` must be whole numbers up to 9"),
            ("m)", "`)` cannot stand in the unit `m)`"),
            ("m s", "` s` cannot stand in the unit `m s`"),
            ("dB", "`dB` stands for a ratio and has no meaning here"),
            ("degC^2", "`degC` has an offset and must stand alone"),
            ("*m", "`*m` cannot stand in the unit `*m`"),
        ] {
            assert_eq!(parse(text).expect_err(text).to_string(), message);
        }
        assert!(parse(&"(".repeat(100_000)).is_err());
    }
}
