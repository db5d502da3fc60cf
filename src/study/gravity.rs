//! Gravity: its components as declared, and as places where effects may act.

use super::checker::{Allowed, Checker, Entity, Scope, Site};
use super::evaluate::Typed;
use super::model::{Place, PlaceKind, PlaceQuantity};
use crate::expression::{Node, Unary};
use crate::quantities::Dimension;

const SCOPE: Scope = Scope::Study(Allowed::Constant);
const COMPONENTS: [&str; 3] = ["gravity.x", "gravity.y", "gravity.z"];

impl<'a> Checker<'a> {
    /// Components in ground axes with what effects add to them; zero where no gravity is declared.
    pub fn finished_gravity(&mut self) -> [Node; 3] {
        let zero = self.graph.constant(0.0);
        self.gravity = self.declared_gravity();
        let Some(span) = self.declared.gravity.map(|(value, _)| value.span) else { return [zero; 3] };
        [0, 1, 2].map(|axis| self.site_value(Site::Gravity(axis), span).map_or(zero, |value| value.node))
    }

    fn declared_gravity(&mut self) -> Option<[Typed; 3]> {
        let (value, direction) = self.declared.gravity?;
        let magnitude = self.field_value("gravity", value, Allowed::Constant);
        let because = (value.span, "gravity has");
        let magnitude =
            magnitude.and_then(|typed| self.expect(typed, value.span, Dimension::ACCELERATION, because, SCOPE));
        let (magnitude, direction) = (magnitude?, self.direction(direction)?);
        Some(direction.map(|component| {
            let factor = self.graph.constant(component);
            Typed::new(self.graph.multiply(factor, magnitude.node), Dimension::ACCELERATION)
        }))
    }

    /// `gravity.x` as a place, where the study has gravity.
    pub fn gravity_component(&self, name: &str) -> Option<Entity> {
        self.declared.gravity?;
        COMPONENTS.iter().position(|component| *component == name).map(Entity::Gravity)
    }

    pub fn gravity_name(axis: usize) -> &'static str {
        COMPONENTS[axis]
    }

    /// The components that the study says to be zero: where gravity has one the support is not level. Their typical
    /// magnitude is that of gravity.
    pub fn gravity_places(&mut self) -> Vec<Place> {
        let Some(declared) = self.gravity else { return Vec::new() };
        let squares = declared.map(|component| self.graph.multiply(component.node, component.node));
        let two = self.graph.add(squares[0], squares[1]);
        let sum = self.graph.add(two, squares[2]);
        let magnitude = self.graph.unary(Unary::Sqrt, sum);
        (0..3)
            .filter(|axis| self.graph.constant_value(declared[*axis].node) == Some(0.0))
            .map(|axis| Place {
                kind: PlaceKind::Gravity,
                name: COMPONENTS[axis].to_owned(),
                motion: None,
                dimension: Dimension::ACCELERATION,
                ports: vec!["value".to_owned()],
                probes: vec![(PlaceQuantity::Value, magnitude)],
            })
            .collect()
    }

    /// The declared component, before effects.
    pub fn gravity_before_effects(&self, axis: usize) -> Option<Typed> {
        self.gravity.map(|components| components[axis])
    }
}
