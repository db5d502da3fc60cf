//! Typical magnitudes of quantities in machines and vehicles.

use super::system::VariableKind;
use crate::quantities::Dimension;

/// Typical length of a displacement, m.
const LENGTH: f64 = 1e-2;
/// Typical angle, rad, and typical dimensionless state.
const ANGLE: f64 = 1e-1;
/// Typical time of a motion, s.
const TIME: f64 = 1e-1;
/// Typical moved mass, kg; with length and time it makes the typical force 100 N.
const MASS: f64 = 1e2;
/// Typical electric current, A.
const CURRENT: f64 = 1.0;
/// Typical change of temperature, K.
const TEMPERATURE: f64 = 1.0;

/// Typical magnitude (SI) of a variable of this dimension; the integrator's absolute tolerance refers to it.
///
/// Positions: 1 cm or 0.1 rad; velocities: 0.1 m/s or 1 rad/s; forces 100 N; torques 1 N m; other dimensions by their
/// exponents from the same base.
pub(super) fn typical_magnitude(dimension: Dimension, kind: VariableKind) -> f64 {
    let exponents = [dimension.mass, dimension.length, dimension.time, dimension.current, dimension.temperature];
    let rotational = exponents[0] == 0 && exponents[1] == 0 && exponents[3] == 0 && exponents[4] == 0;
    if rotational && (kind != VariableKind::Law || exponents[2] == 0) {
        return ANGLE * TIME.powi(i32::from(exponents[2]));
    }
    let bases = [MASS, LENGTH, TIME, CURRENT, TEMPERATURE];
    bases.iter().zip(exponents).map(|(base, exponent)| base.powi(i32::from(exponent))).product()
}
