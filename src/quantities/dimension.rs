//! Algebra of dimensions, and their names for messages.

use std::fmt;
use std::ops::{Div, Mul};

/// Exponents of kg, m, s, A, K. Angles are dimensionless.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Dimension {
    pub mass: i8,
    pub length: i8,
    pub time: i8,
    pub current: i8,
    pub temperature: i8,
}

impl Dimension {
    pub const ONE: Dimension = Dimension::new(0, 0, 0, 0, 0);
    pub const MASS: Dimension = Dimension::new(1, 0, 0, 0, 0);
    pub const LENGTH: Dimension = Dimension::new(0, 1, 0, 0, 0);
    pub const TIME: Dimension = Dimension::new(0, 0, 1, 0, 0);
    pub const CURRENT: Dimension = Dimension::new(0, 0, 0, 1, 0);
    pub const TEMPERATURE: Dimension = Dimension::new(0, 0, 0, 0, 1);
    /// 1/s: also that of angular velocities, angles being dimensionless.
    pub const FREQUENCY: Dimension = Dimension::new(0, 0, -1, 0, 0);
    pub const VELOCITY: Dimension = Dimension::new(0, 1, -1, 0, 0);
    pub const ACCELERATION: Dimension = Dimension::new(0, 1, -2, 0, 0);
    pub const FORCE: Dimension = Dimension::new(1, 1, -2, 0, 0);
    /// N m: also that of energy.
    pub const TORQUE: Dimension = Dimension::new(1, 2, -2, 0, 0);
    pub const INERTIA: Dimension = Dimension::new(1, 2, 0, 0, 0);

    /// Exponents of kg, m, s, A, K.
    pub const fn new(mass: i8, length: i8, time: i8, current: i8, temperature: i8) -> Dimension {
        Dimension { mass, length, time, current, temperature }
    }

    pub fn is_one(self) -> bool {
        self == Dimension::ONE
    }

    /// Dimension of a product. Exponents beyond what `i8` holds stay at its limit; no quantity comes near it.
    pub fn multiply(self, other: Dimension) -> Dimension {
        self.combine(other, i8::saturating_add)
    }

    /// Dimension of a quotient.
    pub fn divide(self, other: Dimension) -> Dimension {
        self.combine(other, i8::saturating_sub)
    }

    /// Dimension of an integer power; `None` where an exponent leaves the range of `i8`.
    pub fn power(self, exponent: i32) -> Option<Dimension> {
        self.map(|own| i32::from(own).checked_mul(exponent).and_then(|power| i8::try_from(power).ok()))
    }

    /// Dimension of the root of this degree; `None` where an exponent is not divisible (or `degree` is 0).
    pub fn root(self, degree: u8) -> Option<Dimension> {
        let degree = i8::try_from(degree).ok().filter(|degree| *degree > 0)?;
        self.map(|own| (own % degree == 0).then_some(own / degree))
    }

    /// Dimension of the power with a rational exponent, e.g. `x^1.5`; `None` where it is not a whole one.
    /// Exponents are recognised as multiples of 1/12.
    pub fn power_real(self, exponent: f64) -> Option<Dimension> {
        if self.is_one() {
            return Some(Dimension::ONE);
        }
        let twelfths = exponent * 12.0;
        if !twelfths.is_finite() || twelfths.abs() > 12.0 * 127.0 || (twelfths - twelfths.round()).abs() > 1e-9 {
            return None;
        }
        let twelfths = twelfths.round() as i32;
        self.map(|own| {
            let product = i32::from(own) * twelfths;
            (product % 12 == 0).then(|| i8::try_from(product / 12).ok()).flatten()
        })
    }

    fn combine(self, other: Dimension, operation: fn(i8, i8) -> i8) -> Dimension {
        Dimension {
            mass: operation(self.mass, other.mass),
            length: operation(self.length, other.length),
            time: operation(self.time, other.time),
            current: operation(self.current, other.current),
            temperature: operation(self.temperature, other.temperature),
        }
    }

    fn map(self, operation: impl Fn(i8) -> Option<i8>) -> Option<Dimension> {
        Some(Dimension {
            mass: operation(self.mass)?,
            length: operation(self.length)?,
            time: operation(self.time)?,
            current: operation(self.current)?,
            temperature: operation(self.temperature)?,
        })
    }

    /// The coherent SI unit as an engineer writes it, readable by [`crate::quantities::Unit::parse`]: `N*s/m`; `1`
    /// for dimensionless.
    pub fn symbol(self) -> String {
        if let Some((_, symbol)) = CUSTOMARY.iter().find(|(dimension, _)| *dimension == self) {
            return (*symbol).to_owned();
        }
        let forms = CARRIERS.iter().filter_map(|(symbol, carrier)| self.factors(symbol, *carrier));
        let shortest =
            forms.min_by_key(|factors| factors.iter().map(|(_, exponent)| exponent.unsigned_abs()).sum::<u32>());
        spell(&shortest.unwrap_or_default())
    }

    /// This dimension as powers of one unit that carries the mass and of m, s, A, K.
    fn factors(self, symbol: &'static str, carrier: Dimension) -> Option<Vec<(&'static str, i32)>> {
        let rest = if self.mass == 0 { self } else { self.divide(carrier.power(i32::from(self.mass))?) };
        let factors =
            [(symbol, self.mass), ("m", rest.length), ("s", rest.time), ("A", rest.current), ("K", rest.temperature)];
        Some(factors.into_iter().filter(|(_, exponent)| *exponent != 0).map(|(unit, n)| (unit, i32::from(n))).collect())
    }
}

/// Units in which the exponent of mass may be expressed, the first preferred.
const CARRIERS: [(&str, Dimension); 4] = [
    ("N", Dimension::FORCE),
    ("kg", Dimension::MASS),
    ("W", Dimension::new(1, 2, -3, 0, 0)),
    ("V", Dimension::new(1, 2, -3, -1, 0)),
];

/// Dimensions whose shortest form is not the one mechanics uses.
const CUSTOMARY: [(Dimension, &str); 5] = [
    (Dimension::new(1, 0, -1, 0, 0), "N*s/m"),
    (Dimension::new(1, -1, 0, 0, 0), "N*s^2/m^2"),
    (Dimension::new(1, -1, -2, 0, 0), "Pa"),
    (Dimension::new(1, 2, -3, 0, 0), "W"),
    (Dimension::new(1, -3, 0, 0, 0), "kg/m^3"),
];

fn spell(factors: &[(&str, i32)]) -> String {
    let power = |(unit, exponent): &(&str, i32)| match exponent.abs() {
        1 => (*unit).to_owned(),
        exponent => format!("{unit}^{exponent}"),
    };
    let above: Vec<String> = factors.iter().filter(|(_, exponent)| *exponent > 0).map(power).collect();
    let below = factors.iter().filter(|(_, exponent)| *exponent < 0).map(power);
    let mut text = if above.is_empty() { "1".to_owned() } else { above.join("*") };
    for unit in below {
        text += &format!("/{unit}");
    }
    text
}

/// `N*s/m`, or `dimensionless`.
impl fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_one() { formatter.write_str("dimensionless") } else { formatter.write_str(&self.symbol()) }
    }
}

impl Mul for Dimension {
    type Output = Dimension;

    fn mul(self, other: Dimension) -> Dimension {
        self.multiply(other)
    }
}

impl Div for Dimension {
    type Output = Dimension;

    fn div(self, other: Dimension) -> Dimension {
        self.divide(other)
    }
}

#[cfg(test)]
mod tests {
    use super::Dimension;
    use crate::quantities::Unit;
    use proptest::prelude::*;

    #[test]
    fn dimensions_read_as_mechanics_writes_them() {
        let cases = [
            (Dimension::ONE, "dimensionless"),
            (Dimension::FORCE, "N"),
            (Dimension::TORQUE, "N*m"),
            (Dimension::INERTIA, "kg*m^2"),
            (Dimension::FORCE / Dimension::LENGTH, "N/m"),
            (Dimension::FORCE / Dimension::VELOCITY, "N*s/m"),
            (Dimension::FORCE / Dimension::VELOCITY / Dimension::VELOCITY, "N*s^2/m^2"),
            (Dimension::TORQUE * Dimension::TIME, "N*m*s"),
            (Dimension::FREQUENCY, "1/s"),
            (Dimension::new(1, 2, -3, -1, 0), "V"),
            (Dimension::new(1, 2, -3, -2, 0), "V/A"),
            (Dimension::new(1, -1, -2, 0, 0), "Pa"),
            (Dimension::new(0, 0, 0, 0, -1), "1/K"),
        ];
        for (dimension, text) in cases {
            assert_eq!(dimension.to_string(), text);
        }
    }

    #[test]
    fn powers_and_roots_refuse_what_is_not_whole() {
        assert_eq!(Dimension::LENGTH.power(200), None);
        assert_eq!(Dimension::VELOCITY.power(2).and_then(|square| square.root(2)), Some(Dimension::VELOCITY));
        assert_eq!(Dimension::VELOCITY.root(2), None);
        assert_eq!(Dimension::VELOCITY.root(0), None);
        assert_eq!(Dimension::new(0, 2, -4, 0, 0).power_real(1.5), Some(Dimension::new(0, 3, -6, 0, 0)));
        assert_eq!(Dimension::LENGTH.power_real(0.5), None);
        assert_eq!(Dimension::LENGTH.power_real(0.123), None);
        assert_eq!(Dimension::ONE.power_real(0.123), Some(Dimension::ONE));
        assert_eq!(Dimension::LENGTH.power_real(f64::NAN), None);
    }

    fn any_dimension() -> impl Strategy<Value = Dimension> {
        (-5i8..=5, -5i8..=5, -5i8..=5, -5i8..=5, -5i8..=5).prop_map(|(m, l, t, i, k)| Dimension::new(m, l, t, i, k))
    }

    proptest! {
        #[test]
        fn dimensions_form_a_group(a in any_dimension(), b in any_dimension(), n in -6i32..=6) {
            prop_assert_eq!(a * b, b * a);
            prop_assert_eq!(a * b / b, a);
            prop_assert_eq!(a / a, Dimension::ONE);
            let product = (a * b).power(n);
            let powers = a.power(n).zip(b.power(n)).map(|(a, b)| a * b);
            prop_assert_eq!(product, powers);
        }

        #[test]
        fn symbols_are_readable_units(dimension in any_dimension()) {
            let unit = Unit::parse(&dimension.symbol()).expect("a unit");
            prop_assert_eq!(unit.dimension, dimension);
            prop_assert!((unit.factor - 1.0).abs() < 1e-12);
        }
    }
}
