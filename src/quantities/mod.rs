//! Dimensions, units, SI as data.

/// Exponents of kg, m, s, A, K. Angles are dimensionless.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Dimension {
    pub mass: i8,
    pub length: i8,
    pub time: i8,
    pub current: i8,
    pub temperature: i8,
}

/// A unit as written, with its conversion `SI = factor * value + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    pub symbol: String,
    pub dimension: Dimension,
    pub factor: f64,
    pub offset: f64,
}
