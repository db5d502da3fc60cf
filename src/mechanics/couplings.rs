//! Couplings: relations of positions as constraints (gears, racks, screws, belts, cams).

use super::kinematics::{self, FrameMotion};
use super::loops::{Direction, Form, Owner, Relation, Row, holds};
use super::topology::Tree;
use crate::expression::{Graph, Node, Symbol};
use crate::study::{Coupling, Joint, PointMotion, Study};
use std::collections::HashMap;

/// One row per coupling of the study. `meaning` gives the kinematic symbols of the study in terms of the tree's
/// coordinates.
pub(super) fn rows(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    meaning: &HashMap<Symbol, Node>,
) -> Vec<Row> {
    let mut rows = Vec::new();
    for (index, coupling) in study.couplings.iter().enumerate() {
        let rate = rate(graph, study, tree, frames, coupling);
        let both = graph.substitute(&[coupling.difference, rate], meaning);
        let direction = Direction::Relation(coupling.dimension);
        let form = Form::Relation(relation(graph, tree, both[0], both[1]));
        rows.push(Row { owner: Owner::Coupling(index), holds: holds(direction), direction, form });
    }
    rows
}

/// The rate of the difference, as a sum over the positions that it mentions.
fn rate(graph: &mut Graph, study: &Study, tree: &Tree, frames: &[FrameMotion], coupling: &Coupling) -> Node {
    let mut sum = graph.differentiate(&[coupling.difference], study.time)[0];
    for symbol in graph.symbols_of(&[coupling.difference]) {
        let Some(own) = rate_of(graph, study, tree, frames, symbol) else { continue };
        let slope = graph.differentiate(&[coupling.difference], symbol)[0];
        let share = graph.multiply(slope, own);
        sum = graph.add(sum, share);
    }
    sum
}

fn rate_of(graph: &mut Graph, study: &Study, tree: &Tree, frames: &[FrameMotion], symbol: Symbol) -> Option<Node> {
    let axes = study.joints.iter().flat_map(|joint| &joint.axes).map(|axis| axis.symbols);
    let elastic = study.bodies.iter().filter_map(|body| body.elastic.as_ref());
    let modes = elastic.flat_map(|elastic| elastic.modes.iter().map(|mode| mode.symbols));
    let elements = study.forces.iter().map(|force| (force.coordinate, force.rate));
    let pairs = axes.chain(modes).map(|symbols| (symbols.position, symbols.velocity)).chain(elements);
    if let Some((_, rate)) = pairs.into_iter().find(|(position, _)| *position == symbol) {
        return Some(graph.variable(rate));
    }
    let is_position = |motion: PointMotion| matches!(motion, PointMotion::Position);
    let quantity = study.point_quantities.iter().find(|own| own.symbol == symbol && is_position(own.motion))?;
    let point = tree.place(graph, &quantity.point);
    Some(kinematics::point_velocity(graph, frames, point)[quantity.axis])
}

fn relation(graph: &mut Graph, tree: &Tree, position: Node, velocity: Node) -> Relation {
    let mut levers = Vec::new();
    for (link, own) in tree.links.iter().enumerate() {
        let Some((rate, _)) = own.free_symbols() else { continue };
        let lever = graph.differentiate(&[velocity], rate)[0];
        if !graph.is_zero(lever) {
            levers.push((link, lever));
        }
    }
    Relation { position, velocity, levers }
}

/// What couplings do on the axes of a joint: index of the axis and load on its coordinate.
pub(super) fn loads_on(
    graph: &mut Graph,
    study: &Study,
    joint: &Joint,
    loads: &[Node],
    meaning: &HashMap<Symbol, Node>,
) -> Vec<(usize, Node)> {
    let mut result = Vec::new();
    for (coupling, &load) in study.couplings.iter().zip(loads) {
        for (at, axis) in joint.axes.iter().enumerate() {
            let slope = graph.differentiate(&[coupling.difference], axis.symbols.position)[0];
            if !graph.is_zero(slope) {
                let slope = graph.substitute(&[slope], meaning)[0];
                result.push((at, graph.multiply(load, slope)));
            }
        }
    }
    result
}
