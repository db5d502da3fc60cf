//! The candidates of one round: every effect of the catalogue at every place it fits, and every number the study holds
//! fixed. A candidate is nothing but the text of a variant with start values to try.

use super::typical::Typical;
use crate::expression::{Node, Operation};
use crate::quantities::{Dimension, Unit};
use crate::study::{
    AxisMotion, Body, EffectDeclaration, EffectParameter, ForcePlace, Place, PlaceKind, PlaceQuantity, Study,
};
use std::fmt::Write;

/// A unit vector's component this near to one is the axis itself.
const ALONG: f64 = 1e-9;
/// Amplitudes of effects that declare no range may grow to this multiple of their natural scale.
const AMPLITUDE_REACH: f64 = 1000.0;
/// Shortest period along a rounded value, in the steps of its rounding.
const STEPS_PER_PERIOD: f64 = 4.0;
/// Significant digits of numbers in generated text.
const DIGITS: usize = 6;
/// A number held fixed may be off by this factor either way.
const CONSTANT_REACH: f64 = 4.0;
/// Finite strengths tried for effects without a derivative at their neutral value, log-spaced over the range.
const FINITE_STRENGTHS: usize = 8;
/// Range of finite strengths, relative to the natural scale, where the effect declares none.
const FINITE_RANGE: (f64, f64) = (0.05, 5.0);
/// Values tried for a shape parameter, log-spaced over its range.
const SHAPE_VALUES: usize = 5;

/// Something that may be missing in the model.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// `dry_friction at slide` or `slide.mass set free`.
    pub name: String,
    pub effect: String,
    pub place: String,
    pub title: String,
    /// Parameters the candidate adds, in the order of its `identify` lines.
    pub unknowns: Vec<Unknown>,
    /// Elements at which the same effect would be the very same force.
    pub aliases: Vec<String>,
    /// Name of the element that an effect adds; parameters begin with it. Empty for a freed constant.
    pub element: String,
    /// How the change reads in a variant, without the `identify` block; empty for a freed constant.
    pub change: String,
}

/// A parameter that a candidate adds, SI.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    /// Parameter name or path of the freed constant.
    pub target: String,
    pub dimension: Dimension,
    pub lower: f64,
    pub upper: f64,
    pub neutral: f64,
    /// Standard deviation of a prior about the neutral value. Points of a free curve have one: what the curve shares
    /// with other parameters (its mean slope with a stiffness) stays with those.
    pub prior: Option<f64>,
    pub role: UnknownRole,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum UnknownRole {
    /// Strength with a score at its neutral value.
    Amplitude,
    /// Strength that must be scanned at these finite values.
    FiniteAmplitude(Vec<f64>),
    /// Shape, to be scanned at these values.
    Shape(Vec<f64>),
    /// Frequency, Hz: scanned at the peaks of the residual's spectrum.
    Frequency,
    /// Period over a quantity of this typical magnitude: all are scanned that the motion can tell apart.
    Period { magnitude: f64 },
}

impl Candidate {
    /// The candidate as a variant of `base` with the unknowns starting at `values` (SI).
    pub(super) fn variant(&self, name: &str, base: &str, values: &[f64]) -> String {
        let mut text = format!("variant {name} of {base} {{\n");
        if !self.change.is_empty() {
            let _ = writeln!(text, "  add {}", self.change);
        }
        let _ = writeln!(text, "  identify {{");
        for (unknown, &value) in self.unknowns.iter().zip(values) {
            let unit = Unit::coherent(unknown.dimension);
            let quantity = |value: f64| unit.format(value, DIGITS);
            let prior = unknown.prior.map_or(String::new(), |deviation| {
                format!(" prior {} +- {}", quantity(unknown.neutral), quantity(deviation))
            });
            let _ = writeln!(
                text,
                "    {} in {} .. {} from {}{prior}",
                unknown.target,
                quantity(unknown.lower),
                quantity(unknown.upper),
                quantity(value.clamp(unknown.lower, unknown.upper)),
            );
        }
        text.push_str("  }\n}\n");
        text
    }

    /// Strengths of an effect with their neutral values; none for a freed constant.
    pub(super) fn strengths(&self) -> Vec<(String, f64)> {
        if self.change.is_empty() {
            return Vec::new();
        }
        self.unknowns
            .iter()
            .filter(|unknown| matches!(unknown.role, UnknownRole::Amplitude | UnknownRole::FiniteAmplitude(_)))
            .map(|unknown| (unknown.target.clone(), unknown.neutral))
            .collect()
    }

    /// Names of the shape parameters.
    pub(super) fn shapes(&self) -> impl Iterator<Item = String> + '_ {
        let is_shape = |unknown: &&Unknown| {
            matches!(unknown.role, UnknownRole::Shape(_) | UnknownRole::Frequency | UnknownRole::Period { .. })
        };
        self.unknowns.iter().filter(is_shape).map(|unknown| unknown.target.clone())
    }

    /// Values of all unknowns at which the candidate changes nothing, with shapes in the middle of their grids.
    pub(super) fn neutral(&self) -> Vec<f64> {
        self.unknowns
            .iter()
            .map(|unknown| match &unknown.role {
                UnknownRole::Shape(values) => values[values.len() / 2],
                UnknownRole::Frequency | UnknownRole::Period { .. } => (unknown.lower * unknown.upper).sqrt(),
                _ => unknown.neutral,
            })
            .collect()
    }
}

/// All candidates for `study`, in order of catalogue and place. `typical` holds one entry per place.
pub(super) fn candidates(study: &Study, typical: &[Typical]) -> Vec<Candidate> {
    let mut list = at_all_places(study, typical, |effect| !effect.is_unnamed());
    list.extend(study.constants.iter().filter_map(|constant| freed_constant(study, constant)));
    list.extend(study.bodies.iter().enumerate().filter_map(|(index, body)| eccentric_body(study, index, body)));
    list
}

/// A body that turns about an axis through its centre of gravity, as far as the study says: unbalance, eccentric
/// wheels.
fn eccentric_body(study: &Study, index: usize, body: &Body) -> Option<Candidate> {
    let turns = study.joints.iter().filter(|joint| joint.child.body == Some(index) && joint.orientation.is_none());
    let turns: Vec<[f64; 3]> = turns
        .flat_map(|joint| &joint.axes)
        .filter(|axis| matches!(axis.motion, AxisMotion::Turn(_)))
        .map(|axis| axis.motion.direction())
        .collect();
    let mass = start_value(study, body.mass).filter(|mass| *mass > 0.0)?;
    let moments = [0, 1, 2].map(|axis| start_value(study, body.inertia[axis]).unwrap_or(0.0));
    let radius = (moments.into_iter().fold(0.0, f64::max) / mass).sqrt();
    let across = |axis: &usize| turns.iter().any(|turn| turn[*axis].abs() < 1.0 - ALONG);
    let central = |axis: &usize| study.graph.is_zero(body.centre_of_gravity[*axis]);
    let unknowns: Vec<Unknown> = (0..3)
        .filter(|axis| across(axis) && central(axis))
        .map(|axis| Unknown {
            target: format!("{}.centre_of_gravity.{}", body.name, ["x", "y", "z"][axis]),
            dimension: Dimension { length: 1, ..Dimension::default() },
            lower: -radius,
            upper: radius,
            neutral: 0.0,
            prior: None,
            role: UnknownRole::Amplitude,
        })
        .collect();
    (radius > 0.0 && body.elastic.is_none() && !unknowns.is_empty()).then(|| Candidate {
        name: format!("{}.centre_of_gravity set free", body.name),
        effect: "constant".to_owned(),
        place: format!("{}.centre_of_gravity", body.name),
        aliases: Vec::new(),
        title: format!("The centre of gravity of {} is not where the study has it: unbalance", body.name),
        unknowns,
        element: String::new(),
        change: String::new(),
    })
}

/// A number, or where a parameter starts.
fn start_value(study: &Study, node: Node) -> Option<f64> {
    let starts = study.graph.symbols_of(&[node]);
    match starts.as_slice() {
        [] => study.graph.constant_value(node),
        [symbol] if study.graph.operation(node) == Operation::Symbol(*symbol) => {
            study.parameters.iter().find(|parameter| parameter.symbol == *symbol).map(|parameter| parameter.start)
        }
        _ => None,
    }
}

/// Forces of free shape at all places.
pub(super) fn unnamed(study: &Study, typical: &[Typical]) -> Vec<Candidate> {
    at_all_places(study, typical, EffectDeclaration::is_unnamed)
}

fn at_all_places(study: &Study, typical: &[Typical], wanted: impl Fn(&EffectDeclaration) -> bool) -> Vec<Candidate> {
    let mut list = Vec::new();
    for effect in study.effects.iter().filter(|effect| wanted(effect)) {
        for (place, typical) in study.places.iter().zip(typical) {
            let elsewhere = stands_at_joint(study, effect, place) || stands_beside(study, effect, place).is_some();
            if effect.fits(place) && !elsewhere {
                list.extend(effect_candidate(study, effect, place, typical));
            }
        }
    }
    list
}

/// Names of the candidates that [`stands_at_joint`] and [`stands_beside`] leave out in favour of this one.
fn aliases(study: &Study, effect: &EffectDeclaration, place: &Place) -> Vec<String> {
    if place.kind != PlaceKind::Joint {
        let beside = |other: &&Place| {
            effect.fits(other) && stands_beside(study, effect, other).is_some_and(|first| first.name == place.name)
        };
        return study.places.iter().filter(beside).map(|other| format!("{} at {}", effect.name, other.name)).collect();
    }
    let same = |force: &&crate::study::Force| study.axis_of(force).is_some_and(|axis| axis.name == place.name);
    let fitting =
        |force: &&crate::study::Force| study.places.iter().any(|other| other.name == force.name && effect.fits(other));
    study.forces.iter().filter(same).filter(fitting).map(|force| format!("{} at {}", effect.name, force.name)).collect()
}

/// What an effect adds at a force element on a joint it adds at the joint itself; effects known at both are tried once.
fn stands_at_joint(study: &Study, effect: &EffectDeclaration, place: &Place) -> bool {
    let on_joint =
        study.forces.iter().any(|force| force.name == place.name && matches!(force.place, ForcePlace::Joint { .. }));
    on_joint && effect.kinds.contains(&PlaceKind::Joint)
}

/// What an effect adds to one of several elements between the same points is the same force at each: the first of them,
/// where it is not this one.
fn stands_beside<'a>(study: &'a Study, effect: &EffectDeclaration, place: &Place) -> Option<&'a Place> {
    if place.kind != PlaceKind::Force || !effect.replaces.is_empty() {
        return None;
    }
    let at = |name: &str| study.forces.iter().find(|force| force.name == name).map(|force| force.place);
    let own = at(&place.name)?;
    let first = study
        .places
        .iter()
        .find(|other| other.kind == PlaceKind::Force && effect.fits(other) && at(&other.name) == Some(own))?;
    (first.name != place.name).then_some(first)
}

fn effect_candidate(study: &Study, effect: &EffectDeclaration, place: &Place, typical: &Typical) -> Option<Candidate> {
    let element = unused_name(study, &format!("{}_{}", place.name.replace('.', "_"), effect.name));
    let mut unknowns = Vec::new();
    for parameter in &effect.amplitudes {
        unknowns.push(amplitude(&element, parameter, place, typical)?);
    }
    for parameter in &effect.shapes {
        unknowns.push(shape(&element, parameter, place, typical)?);
    }
    let fields: Vec<String> = effect
        .amplitudes
        .iter()
        .chain(&effect.shapes)
        .zip(&unknowns)
        .map(|(parameter, unknown)| format!("{} = {}", parameter.name, unknown.target))
        .collect();
    Some(Candidate {
        name: format!("{} at {}", effect.name, place.name),
        effect: effect.name.clone(),
        place: place.name.clone(),
        title: effect.title.clone(),
        aliases: aliases(study, effect, place),
        unknowns,
        change: format!("effect {element}: {} on {} {{ {} }}", effect.name, place.name, fields.join(", ")),
        element,
    })
}

/// `wanted`, or with a number behind it where the study uses the name already (a second dose of the same effect).
fn unused_name(study: &Study, wanted: &str) -> String {
    let used = |name: &str| {
        study.places.iter().any(|place| place.name == name)
            || study.parameters.iter().any(|parameter| parameter.name.starts_with(&format!("{name}_")))
    };
    if !used(wanted) {
        return wanted.to_owned();
    }
    (2..).map(|count| format!("{wanted}_{count}")).find(|name| !used(name)).unwrap_or_else(|| wanted.to_owned())
}

/// Natural scale of a parameter at a place: its monomial evaluated with typical magnitudes. `None` where the place
/// never moves or carries nothing, so the effect could not show.
fn natural_scale(parameter: &EffectParameter, typical: &Typical) -> Option<f64> {
    let mut scale = 1.0;
    for &(quantity, exponent) in &parameter.monomial {
        let magnitude = typical.of(quantity)?;
        scale *= magnitude.powi(i32::from(exponent));
    }
    (scale.is_finite() && scale > 0.0).then_some(scale)
}

fn dimension_at(parameter: &EffectParameter, place: &Place) -> Dimension {
    parameter.dimension.unwrap_or_else(|| {
        parameter.monomial.iter().fold(Dimension::default(), |product, &(quantity, exponent)| {
            let factor = place.quantity_dimension(quantity).power(i32::from(exponent)).unwrap_or_default();
            product.multiply(factor)
        })
    })
}

fn amplitude(element: &str, parameter: &EffectParameter, place: &Place, typical: &Typical) -> Option<Unknown> {
    let scale = if parameter.monomial.is_empty() { None } else { Some(natural_scale(parameter, typical)?) };
    let relative = parameter.relative_range.zip(scale).map(|((low, high), scale)| (low * scale, high * scale));
    let reach = rounded_up(scale.unwrap_or(1.0) * AMPLITUDE_REACH);
    let (mut lower, upper) =
        parameter.range.or(relative).unwrap_or((parameter.neutral - reach, parameter.neutral + reach));
    if parameter.one_sided {
        lower = lower.max(parameter.neutral);
    }
    let role = if parameter.finite_only {
        let declared = parameter.range.or(relative);
        let (from, to) = match (declared, scale) {
            (None, Some(scale)) => (FINITE_RANGE.0 * scale, FINITE_RANGE.1 * scale),
            _ => (lower.max(upper * 1e-3), upper),
        };
        UnknownRole::FiniteAmplitude(log_spaced(from, to, FINITE_STRENGTHS))
    } else {
        UnknownRole::Amplitude
    };
    Some(Unknown {
        target: format!("{element}_{}", parameter.name),
        dimension: dimension_at(parameter, place),
        lower,
        upper,
        neutral: parameter.neutral,
        prior: scale.filter(|_| parameter.unnamed),
        role,
    })
}

fn shape(element: &str, parameter: &EffectParameter, place: &Place, typical: &Typical) -> Option<Unknown> {
    let dimension = dimension_at(parameter, place);
    let scale = if parameter.monomial.is_empty() { None } else { Some(natural_scale(parameter, typical)?) };
    let relative = match parameter.relative_range {
        Some((low, high)) => {
            let scale = scale?;
            Some((low * scale, high * scale))
        }
        None => None,
    };
    let (mut lower, upper) = parameter.range.or(relative).or(scale.map(|scale| (0.1 * scale, 2.0 * scale)))?;
    if parameter.periodic {
        // The errors of rounding repeat along the value, too, with the step and its fractions as periods.
        lower = lower.max(typical.resolution.map_or(0.0, |step| STEPS_PER_PERIOD * step));
        if lower >= upper {
            return None;
        }
    }
    let is_frequency = parameter.monomial.is_empty() && dimension == (Dimension { time: -1, ..Dimension::default() });
    let role = if is_frequency {
        UnknownRole::Frequency
    } else if let Some(magnitude) = scale.filter(|_| parameter.periodic && lower > 0.0) {
        UnknownRole::Period { magnitude }
    } else if lower > 0.0 {
        UnknownRole::Shape(log_spaced(lower, upper, SHAPE_VALUES))
    } else {
        UnknownRole::Shape(evenly_spaced(lower, upper, SHAPE_VALUES))
    };
    Some(Unknown {
        target: format!("{element}_{}", parameter.name),
        dimension,
        lower,
        upper,
        neutral: parameter.neutral,
        prior: None,
        role,
    })
}

fn freed_constant(study: &Study, constant: &crate::study::Constant) -> Option<Candidate> {
    if constant.value == 0.0 || study.parameters.iter().any(|parameter| parameter.name == constant.path) {
        return None;
    }
    let ends = [constant.value / CONSTANT_REACH, constant.value * CONSTANT_REACH];
    Some(Candidate {
        name: format!("{} set free", constant.path),
        effect: "constant".to_owned(),
        place: constant.path.clone(),
        aliases: Vec::new(),
        title: format!("The value {} of {} is not right", constant.unit.format(constant.value, DIGITS), constant.path),
        unknowns: vec![Unknown {
            target: constant.path.clone(),
            dimension: constant.unit.dimension,
            lower: ends[0].min(ends[1]),
            upper: ends[0].max(ends[1]),
            neutral: constant.value,
            prior: None,
            role: UnknownRole::Amplitude,
        }],
        element: String::new(),
        change: String::new(),
    })
}

/// The next of 1, 2, 5 times a power of ten: bounds that a reader can take in, and that do not change with every
/// record.
fn rounded_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|rounded| *rounded >= value).unwrap_or(10.0 * power)
}

/// Interior points of a logarithmic division of `lower .. upper` (both positive).
fn log_spaced(lower: f64, upper: f64, count: usize) -> Vec<f64> {
    let ratio = (upper / lower).ln();
    (0..count).map(|i| lower * (ratio * (i as f64 + 0.5) / count as f64).exp()).collect()
}

/// Interior points of an even division.
fn evenly_spaced(lower: f64, upper: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| lower + (upper - lower) * (i as f64 + 0.5) / count as f64).collect()
}

impl Place {
    /// Dimension of a quantity of this place.
    pub(super) fn quantity_dimension(&self, quantity: PlaceQuantity) -> Dimension {
        use crate::study::Motion;
        let rotational = self.motion == Some(Motion::Rotational);
        let coordinate =
            if rotational { Dimension::default() } else { Dimension { length: 1, ..Dimension::default() } };
        let second = Dimension { time: 1, ..Dimension::default() };
        match quantity {
            PlaceQuantity::Coordinate => coordinate,
            PlaceQuantity::Rate => coordinate.divide(second),
            PlaceQuantity::Time => second,
            PlaceQuantity::Load | PlaceQuantity::Value => match self.kind {
                PlaceKind::Joint | PlaceKind::Force | PlaceKind::Actuator => {
                    let force = Dimension { mass: 1, length: 1, time: -2, ..Dimension::default() };
                    if rotational { force.multiply(Dimension { length: 1, ..Dimension::default() }) } else { force }
                }
                _ => self.dimension,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{log_spaced, rounded_up};

    #[test]
    fn bounds_are_round() {
        for (value, round) in [(702_611.0, 1e6), (1.0, 1.0), (0.0213, 0.05), (190.0, 200.0)] {
            assert!((rounded_up(value) / round - 1.0).abs() < 1e-12, "{value}");
        }
    }

    #[test]
    fn log_spacing_lies_inside() {
        let values = log_spaced(1.0, 1000.0, 3);
        assert!((values[1] - 1000_f64.sqrt()).abs() < 1e-9);
        assert!(values[0] > 1.0 && values[2] < 1000.0);
    }
}
