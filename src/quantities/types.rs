//! The named types of the language that do not depend on a place.

use super::Dimension;

/// A name for a dimension, as laws and effects declare their ports and parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedType {
    pub name: &'static str,
    pub dimension: Dimension,
    /// A unit as example for messages.
    pub unit: &'static str,
}

const fn entry(name: &'static str, dimension: Dimension, unit: &'static str) -> NamedType {
    NamedType { name, dimension, unit }
}

/// In the order in which the language reference lists them. `coordinate`, `rate`, `load` and `value` depend on the
/// place and are resolved where a law or an effect is used.
pub const NAMED_TYPES: &[NamedType] = &[
    entry("ratio", Dimension::ONE, "%"),
    entry("angle", Dimension::ONE, "deg"),
    entry("length", Dimension::LENGTH, "mm"),
    entry("area", Dimension::new(0, 2, 0, 0, 0), "mm^2"),
    entry("volume", Dimension::new(0, 3, 0, 0, 0), "l"),
    entry("time", Dimension::TIME, "s"),
    entry("frequency", Dimension::FREQUENCY, "Hz"),
    entry("velocity", Dimension::VELOCITY, "m/s"),
    entry("acceleration", Dimension::ACCELERATION, "m/s^2"),
    entry("angular_velocity", Dimension::FREQUENCY, "rad/s"),
    entry("angular_acceleration", Dimension::new(0, 0, -2, 0, 0), "rad/s^2"),
    entry("mass", Dimension::MASS, "kg"),
    entry("inertia", Dimension::INERTIA, "kg*m^2"),
    entry("density", Dimension::new(1, -3, 0, 0, 0), "kg/m^3"),
    entry("force", Dimension::FORCE, "N"),
    entry("torque", Dimension::TORQUE, "N*m"),
    entry("stiffness", Dimension::new(1, 0, -2, 0, 0), "N/m"),
    entry("damping", Dimension::new(1, 0, -1, 0, 0), "N*s/m"),
    entry("rotational_stiffness", Dimension::TORQUE, "N*m/rad"),
    entry("rotational_damping", Dimension::new(1, 2, -1, 0, 0), "N*m*s/rad"),
    entry("pressure", Dimension::new(1, -1, -2, 0, 0), "bar"),
    entry("energy", Dimension::TORQUE, "J"),
    entry("power", Dimension::new(1, 2, -3, 0, 0), "W"),
    entry("flow", Dimension::new(0, 3, -1, 0, 0), "l/min"),
    entry("voltage", Dimension::new(1, 2, -3, -1, 0), "V"),
    entry("current", Dimension::CURRENT, "A"),
    entry("resistance", Dimension::new(1, 2, -3, -2, 0), "Ohm"),
    entry("temperature", Dimension::TEMPERATURE, "K"),
];

/// The type with this name.
pub fn named_type(name: &str) -> Option<NamedType> {
    NAMED_TYPES.iter().copied().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantities::Unit;

    #[test]
    fn every_type_has_a_unit_of_its_dimension() {
        for entry in NAMED_TYPES {
            let unit = Unit::parse(entry.unit).expect(entry.name);
            assert_eq!(unit.dimension, entry.dimension, "{}", entry.name);
            assert_eq!(named_type(entry.name).map(|found| found.name), Some(entry.name));
        }
        assert_eq!(named_type("speed"), None);
    }
}
