//! Couplings: relations of positions (gears, racks, screws, belts, cams) or of rates (rolling) as constraints.

use super::articulated::Wrench;
use super::closing::closing_coordinate;
use super::forces::{Effect, ForceGeometry};
use super::kinematics::{self, FrameMotion};
use super::loops::{Direction, Form, Owner, Relation, Row, holds};
use super::topology::{Seat, Tree};
use crate::expression::vector;
use crate::expression::{Graph, Node, Symbol};
use crate::study::{Coupling, CouplingLevel, ForcePlace, PointMotion, PointQuantity, Study};
use std::collections::HashMap;

/// The mechanism that couplings act in.
pub(super) struct Places<'a> {
    pub study: &'a Study,
    pub tree: &'a Tree,
    pub frames: &'a [FrameMotion],
    pub geometries: &'a [ForceGeometry],
    /// The kinematic symbols of the study in terms of the tree's coordinates.
    pub meaning: &'a HashMap<Symbol, Node>,
}

/// One row per coupling of the study, those of rates last.
pub(super) fn rows(graph: &mut Graph, places: &Places) -> Vec<Row> {
    let mut rows = Vec::new();
    for level in [CouplingLevel::Positions, CouplingLevel::Rates] {
        let of_level = places.study.couplings.iter().enumerate().filter(|(_, coupling)| coupling.level == level);
        for (index, coupling) in of_level {
            let direction = Direction::Relation(coupling.dimension);
            let form = Form::Relation(relation(graph, places, coupling));
            rows.push(Row { owner: Owner::Coupling(index), holds: holds(direction), direction, form });
        }
    }
    rows
}

fn relation(graph: &mut Graph, places: &Places, coupling: &Coupling) -> Relation {
    let difference = graph.substitute(&[coupling.difference], places.meaning)[0];
    let mut rate = match coupling.level {
        CouplingLevel::Positions => graph.differentiate(&[coupling.difference], places.study.time)[0],
        CouplingLevel::Rates => coupling.difference,
    };
    let mut loads = Vec::new();
    for symbol in graph.symbols_of(&[coupling.difference]) {
        let Some(moved) = Moved::find(places.study, symbol, coupling.level) else { continue };
        let slope = graph.differentiate(&[coupling.difference], symbol)[0];
        if coupling.level == CouplingLevel::Positions {
            let own = moved.rate(graph, places);
            let share = graph.multiply(slope, own);
            rate = graph.add(rate, share);
        }
        let slope = graph.substitute(&[slope], places.meaning)[0];
        loads.extend(moved.effects(graph, places, slope));
    }
    let velocity = graph.substitute(&[rate], places.meaning)[0];
    let position = (coupling.level == CouplingLevel::Positions).then_some(difference);
    Relation { position, velocity, loads }
}

/// What a symbol in a coupling is the position or the rate of.
enum Moved<'a> {
    /// Axis of a joint: rate, index of joint and axis.
    Axis(Symbol, (usize, usize)),
    /// A mode, or a component of a free rotation: its rate.
    Coordinate(Symbol),
    /// Index of the force element.
    Element(usize),
    Point(&'a PointQuantity),
}

impl<'a> Moved<'a> {
    fn find(study: &'a Study, symbol: Symbol, level: CouplingLevel) -> Option<Self> {
        let of_level = |position: Symbol, rate: Symbol| match level {
            CouplingLevel::Positions => position == symbol,
            CouplingLevel::Rates => rate == symbol,
        };
        for (joint, own) in study.joints.iter().enumerate() {
            let is_own = |axis: &crate::study::JointAxis| of_level(axis.symbols.position, axis.symbols.velocity);
            if let Some(at) = own.axes.iter().position(is_own) {
                return Some(Moved::Axis(own.axes[at].symbols.velocity, (joint, at)));
            }
            if level == CouplingLevel::Rates && own.rotation.is_some_and(|symbols| symbols.velocity.contains(&symbol)) {
                return Some(Moved::Coordinate(symbol));
            }
        }
        let mut modes = study.bodies.iter().filter_map(|body| body.elastic.as_ref()).flat_map(|own| &own.modes);
        if let Some(mode) = modes.find(|mode| of_level(mode.symbols.position, mode.symbols.velocity)) {
            return Some(Moved::Coordinate(mode.symbols.velocity));
        }
        if let Some(at) = study.forces.iter().position(|force| of_level(force.coordinate, force.rate)) {
            return Some(Moved::Element(at));
        }
        let is_of_level = |motion: PointMotion| match level {
            CouplingLevel::Positions => matches!(motion, PointMotion::Position),
            CouplingLevel::Rates => matches!(motion, PointMotion::Velocity | PointMotion::AngularVelocity),
        };
        let mut quantities = study.point_quantities.iter();
        quantities.find(|own| own.symbol == symbol && is_of_level(own.motion)).map(Moved::Point)
    }

    fn rate(&self, graph: &mut Graph, places: &Places) -> Node {
        match self {
            Moved::Axis(rate, _) | Moved::Coordinate(rate) => graph.variable(*rate),
            Moved::Element(at) => graph.variable(places.study.forces[*at].rate),
            Moved::Point(quantity) => {
                let seat = places.tree.place(graph, &quantity.point);
                kinematics::point_velocity(graph, places.frames, seat)[quantity.axis]
            }
        }
    }

    /// What load 1 on the relation does there: `slope` times a load on this.
    fn effects(&self, graph: &mut Graph, places: &Places, slope: Node) -> Vec<(Node, Effect)> {
        let effect = match *self {
            Moved::Axis(_, place) if places.study.joints[place.0].closes_loop => {
                let Places { study, tree, frames, .. } = *places;
                closing_coordinate(graph, study, tree, frames, place).map(|geometry| geometry.effect)
            }
            Moved::Element(at) => match &places.geometries[at].effect {
                Effect::Coordinate(link) if places.tree.links[*link].free_symbols().is_none() => None,
                effect => Some(effect.clone()),
            },
            Moved::Point(quantity) => Some(at_point(graph, places, quantity)),
            Moved::Axis(rate, _) | Moved::Coordinate(rate) => return on_coordinates(graph, places, rate, slope),
        };
        effect.map(|effect| (slope, effect)).into_iter().collect()
    }
}

/// Where the rate is one of the tree's coordinates, or made up of them.
fn on_coordinates(graph: &mut Graph, places: &Places, rate: Symbol, slope: Node) -> Vec<(Node, Effect)> {
    let own = graph.variable(rate);
    let own = graph.substitute(&[own], places.meaning)[0];
    let mut effects = Vec::new();
    for (link, moved) in places.tree.links.iter().enumerate() {
        let Some((velocity, _)) = moved.free_symbols() else { continue };
        let lever = graph.differentiate(&[own], velocity)[0];
        if !graph.is_zero(lever) {
            effects.push((graph.multiply(slope, lever), Effect::Coordinate(link)));
        }
    }
    effects
}

/// A unit force at the point, or a unit moment on its body, along an axis of ground.
fn at_point(graph: &mut Graph, places: &Places, quantity: &PointQuantity) -> Effect {
    let Seat { link, offset, .. } = places.tree.place(graph, &quantity.point);
    let Some(link) = link else { return Effect::Links(vec![]) };
    let axis = vector::constant(graph, super::chain::unit(quantity.axis));
    let own = vector::apply_transposed(graph, places.frames[link].orientation, axis);
    let wrench = match quantity.motion {
        PointMotion::AngularVelocity => Wrench { moment: own, force: vector::zero(graph) },
        _ => Wrench { moment: vector::cross(graph, offset, own), force: own },
    };
    Effect::Links(vec![(link, wrench)])
}

/// What couplings do on the axes of a joint: index of the axis and load on its coordinate.
pub(super) fn loads_on(
    graph: &mut Graph,
    study: &Study,
    number: usize,
    loads: &[Node],
    meaning: &HashMap<Symbol, Node>,
) -> Vec<(usize, Node)> {
    let mut result = Vec::new();
    for (coupling, &load) in study.couplings.iter().zip(loads) {
        for (at, axis) in study.joints[number].axes.iter().enumerate() {
            let is_here = |place: &ForcePlace| match place {
                ForcePlace::Joint { joint, axis } => (*joint, *axis) == (number, at),
                ForcePlace::Between { .. } => false,
            };
            let elements = study.forces.iter().filter(|force| is_here(&force.place));
            let of_axis = elements.map(|force| [force.coordinate, force.rate]);
            for pair in of_axis.chain([[axis.symbols.position, axis.symbols.velocity]]) {
                let symbol = pair[usize::from(coupling.level == CouplingLevel::Rates)];
                let slope = graph.differentiate(&[coupling.difference], symbol)[0];
                if !graph.is_zero(slope) {
                    let slope = graph.substitute(&[slope], meaning)[0];
                    result.push((at, graph.multiply(load, slope)));
                }
            }
        }
    }
    result
}
