//! Types of ports and parameters: monomials of the place-dependent types and the named ones.

use super::model::{Motion, PlaceQuantity};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::quantities::{Dimension, NAMED_TYPES, named_type};
use crate::syntax::TypeExpression;

/// What the place-dependent types stand for at one place; `None`: not known, to be inferred from the fields.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Kinds {
    pub coordinate: Option<Dimension>,
    pub load: Option<Dimension>,
    pub value: Option<Dimension>,
}

impl Kinds {
    /// Coordinate and load of a mechanical place.
    pub fn of(motion: Motion) -> Kinds {
        Kinds { coordinate: Some(coordinate_dimension(motion)), load: Some(load_dimension(motion)), value: None }
    }

    pub fn of_value(value: Dimension) -> Kinds {
        Kinds { value: Some(value), ..Kinds::default() }
    }

    fn get(&self, kind: Kind) -> Option<Dimension> {
        match kind {
            Kind::Coordinate => self.coordinate,
            Kind::Load => self.load,
            Kind::Value => self.value,
        }
    }

    fn set(&mut self, kind: Kind, dimension: Dimension) {
        match kind {
            Kind::Coordinate => self.coordinate = Some(dimension),
            Kind::Load => self.load = Some(dimension),
            Kind::Value => self.value = Some(dimension),
        }
    }
}

/// m or 1.
pub(super) fn coordinate_dimension(motion: Motion) -> Dimension {
    match motion {
        Motion::Translational => Dimension::LENGTH,
        Motion::Rotational => Dimension::ONE,
    }
}

/// m/s or 1/s.
pub(super) fn rate_dimension(motion: Motion) -> Dimension {
    coordinate_dimension(motion) / Dimension::TIME
}

/// N or N m.
pub(super) fn load_dimension(motion: Motion) -> Dimension {
    match motion {
        Motion::Translational => Dimension::FORCE,
        Motion::Rotational => Dimension::TORQUE,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Coordinate,
    Load,
    Value,
}

const KINDS: [Kind; 3] = [Kind::Coordinate, Kind::Load, Kind::Value];

const PLACE_TYPES: [&str; 5] = ["coordinate", "rate", "acceleration", "load", "value"];

/// A type: powers of the place-dependent kinds times a fixed dimension.
#[derive(Clone, Copy, Debug)]
pub(super) struct Form {
    exponents: [i8; 3],
    fixed: Dimension,
}

impl Form {
    /// Reads a type expression; unknown names are errors.
    pub fn read(expression: &TypeExpression) -> Result<Form, Diagnostic> {
        let mut form = Form { exponents: [0; 3], fixed: Dimension::ONE };
        for (name, exponent) in &expression.factors {
            let (kind, fixed) = match name.text.as_str() {
                "coordinate" => (Some(Kind::Coordinate), Dimension::ONE),
                "rate" => (Some(Kind::Coordinate), power(Dimension::TIME, -1)),
                "acceleration" => (Some(Kind::Coordinate), power(Dimension::TIME, -2)),
                "load" => (Some(Kind::Load), Dimension::ONE),
                "value" => (Some(Kind::Value), Dimension::ONE),
                other => match named_type(other) {
                    Some(named) => (None, named.dimension),
                    None => return Err(unknown_type(name)),
                },
            };
            if let Some(kind) = kind {
                form.exponents[kind as usize] = form.exponents[kind as usize].saturating_add(*exponent);
            }
            form.fixed = form.fixed * power(fixed, *exponent);
        }
        Ok(form)
    }

    /// The dimension at a place, if all its kinds are known.
    pub fn dimension(&self, kinds: &Kinds) -> Option<Dimension> {
        KINDS.into_iter().try_fold(self.fixed, |product, kind| match self.exponents[kind as usize] {
            0 => Some(product),
            exponent => Some(product * power(kinds.get(kind)?, exponent)),
        })
    }

    /// Whether a kind occurs that is not known at this place.
    pub fn is_open(&self, kinds: &Kinds) -> bool {
        self.dimension(kinds).is_none()
    }

    /// Learns the one unknown kind from the dimension that a value of this type has. False if that is not possible.
    pub fn infer(&self, dimension: Dimension, kinds: &mut Kinds) -> bool {
        let mut unknown =
            KINDS.into_iter().filter(|kind| self.exponents[*kind as usize] != 0 && kinds.get(*kind).is_none());
        let (Some(kind), None) = (unknown.next(), unknown.next()) else { return false };
        let known = KINDS.into_iter().fold(self.fixed, |product, other| match kinds.get(other) {
            Some(known) => product * power(known, self.exponents[other as usize]),
            None => product,
        });
        let Some(solution) = root(dimension / known, self.exponents[kind as usize]) else { return false };
        kinds.set(kind, solution);
        true
    }
}

/// The dimension whose `exponent`-th power this is, if its exponents stay integers.
fn root(dimension: Dimension, exponent: i8) -> Option<Dimension> {
    let positive = if exponent < 0 { Dimension::ONE / dimension } else { dimension };
    positive.root(exponent.unsigned_abs())
}

/// An integer power; exponents beyond what a dimension holds do not occur in sensible types and count as none.
fn power(dimension: Dimension, exponent: i8) -> Dimension {
    dimension.power(i32::from(exponent)).unwrap_or_default()
}

/// Powers of place quantities.
pub(super) type Monomial = Vec<(PlaceQuantity, i8)>;

/// The type as data for diagnosis: a monomial of place quantities, or a fixed dimension when it has none.
pub(super) fn monomial(expression: &TypeExpression) -> Result<(Monomial, Option<Dimension>), Diagnostic> {
    let mut monomial: Vec<(PlaceQuantity, i8)> = Vec::new();
    let mut fixed = Dimension::ONE;
    let mut multiply = |quantity: PlaceQuantity, exponent: i8| match monomial.iter_mut().find(|part| part.0 == quantity)
    {
        Some(part) => part.1 += exponent,
        None => monomial.push((quantity, exponent)),
    };
    let mut has_place = false;
    for (name, exponent) in &expression.factors {
        has_place |= PLACE_TYPES.contains(&name.text.as_str());
        match name.text.as_str() {
            "coordinate" => multiply(PlaceQuantity::Coordinate, *exponent),
            "rate" => multiply(PlaceQuantity::Rate, *exponent),
            "load" => multiply(PlaceQuantity::Load, *exponent),
            "value" => multiply(PlaceQuantity::Value, *exponent),
            "acceleration" => {
                multiply(PlaceQuantity::Rate, *exponent);
                multiply(PlaceQuantity::Time, -exponent);
            }
            other => match named_type(other) {
                Some(named) => fixed = fixed * power(named.dimension, *exponent),
                None => return Err(unknown_type(name)),
            },
        }
    }
    if !has_place {
        return Ok((Vec::new(), Some(fixed)));
    }
    // Beside place quantities only times are admitted: their typical magnitude is known.
    if fixed != power(Dimension::TIME, fixed.time) {
        return Err(Diagnostic::error(Code::INVALID_DECLARATION, "the natural scale of this type is not known")
            .label(expression.span, "mixes types of the place with other quantities")
            .help("write it as a product of `coordinate`, `rate`, `load`, `value` and `time`, or as a fixed type"));
    }
    if fixed.time != 0 {
        match monomial.iter_mut().find(|part| part.0 == PlaceQuantity::Time) {
            Some(part) => part.1 += fixed.time,
            None => monomial.push((PlaceQuantity::Time, fixed.time)),
        }
    }
    Ok((monomial, None))
}

fn unknown_type(name: &crate::syntax::Name) -> Diagnostic {
    let named = || NAMED_TYPES.iter().map(|named| named.name);
    let candidates = || PLACE_TYPES.into_iter().chain(named());
    Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no type `{}`", name.text))
        .label(name.span, "not a type")
        .suggest(similar_name(&name.text, candidates()))
        .note(format!(
            "types of the place: {}; others: {}",
            PLACE_TYPES.join(", "),
            named().collect::<Vec<_>>().join(", ")
        ))
}
