//! Multipliers of closed loops, on velocity and on position level (Gear-Gupta-Leimkuhler-1985).

use super::articulated::Wrench;
use super::assembly::{Constraints, assemble_loops};
use super::kinematics::{self, FrameMotion};
use super::loops::{self, Direction, Row};
use super::scale::typical_magnitude;
use super::system::{Variable, VariableKind};
use super::topology::{Coordinate, Tree};
use crate::diagnostics::Diagnostic;
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{ReactionQuantity, Study};
use std::collections::HashMap;

/// Constraints of closed loops with their multipliers.
pub(super) struct Loops {
    pub rows: Vec<Row>,
    /// On velocity and on position level, one per row.
    pub multipliers: Vec<Symbol>,
    projections: Vec<Symbol>,
    positions: Vec<Node>,
    /// Rate of every row.
    pub velocities: Vec<Node>,
    /// Per start of the study, where the loops are closed.
    pub closed: Vec<HashMap<Symbol, f64>>,
    /// A closed position that is not special.
    pub general: HashMap<Symbol, f64>,
    pub warnings: Vec<Diagnostic>,
}

impl Loops {
    pub fn close(
        graph: &mut Graph,
        study: &Study,
        tree: &Tree,
        frames: &[FrameMotion],
    ) -> Result<Self, Vec<Diagnostic>> {
        let rows = loops::rows(graph, study, tree)?;
        let positions: Vec<Node> = rows.iter().map(|row| row.position(graph, frames)).collect();
        let velocities: Vec<Node> = rows.iter().map(|row| row.velocity(graph, frames)).collect();
        let upright = loops::upright(graph, study, tree, frames);
        let constraints =
            Constraints { rows: &rows, positions: &positions, velocities: &velocities, upright: &upright };
        let assembly = assemble_loops(graph, study, tree, &constraints)?;
        let rows: Vec<Row> = assembly.kept.iter().map(|&i| rows[i].clone()).collect();
        let mut symbols = |word: &str| -> Vec<Symbol> {
            rows.iter()
                .map(|row| graph.symbol(&format!("{}.{word}: {}", study.joints[row.joint].name, row.holds)))
                .collect()
        };
        Ok(Self {
            multipliers: symbols("reaction"),
            projections: symbols("projection"),
            positions: assembly.kept.iter().map(|&i| positions[i]).collect(),
            velocities: assembly.kept.iter().map(|&i| velocities[i]).collect(),
            rows,
            closed: assembly.positions,
            general: assembly.general,
            warnings: assembly.warnings,
        })
    }

    /// Adds what the multipliers do to the links.
    pub fn load(&self, graph: &mut Graph, frames: &[FrameMotion], multipliers: &[Symbol], wrenches: &mut [Wrench]) {
        for (row, &multiplier) in self.rows.iter().zip(multipliers) {
            let multiplier = graph.variable(multiplier);
            for (link, wrench) in row.wrenches(graph, frames, multiplier) {
                wrenches[link] = wrenches[link].add(graph, wrench);
            }
        }
    }

    /// G^T mu per link.
    pub fn projection(&self, graph: &mut Graph, tree: &Tree, frames: &[FrameMotion]) -> Vec<Node> {
        let zero = graph.constant(0.0);
        if self.rows.is_empty() {
            return vec![zero; tree.links.len()];
        }
        let mut wrenches: Vec<Wrench> = tree.links.iter().map(|_| Wrench::zero(graph)).collect();
        self.load(graph, frames, &self.projections, &mut wrenches);
        let mut result = vec![zero; tree.links.len()];
        for (i, link) in tree.links.iter().enumerate().rev() {
            let axis = kinematics::motion_axis(graph, link.axis);
            let own = wrenches[i].on(graph, axis);
            if let Coordinate::Follower { weights, .. } = link.coordinate {
                for &(mode, weight) in &tree.weights[weights] {
                    let share = graph.multiply(weight, own);
                    result[mode] = graph.add(result[mode], share);
                }
            } else {
                result[i] = graph.add(result[i], own);
            }
            if let Some(p) = link.predecessor {
                let carried = wrenches[i].carried_back(graph, &frames[i]);
                wrenches[p] = wrenches[p].add(graph, carried);
            }
        }
        result
    }
}

/// Unknowns without derivative, with one equation each and its name.
pub(super) fn algebraic_part(
    graph: &mut Graph,
    study: &Study,
    loops: &Loops,
    reactions: &[(ReactionQuantity, Node)],
) -> (Vec<Variable>, Vec<Node>, Vec<String>) {
    let variable = |graph: &Graph, symbol: Symbol, dimension: Dimension| Variable {
        symbol,
        name: graph.symbol_name(symbol).to_owned(),
        kind: VariableKind::Algebraic,
        dimension,
        scale: typical_magnitude(dimension, VariableKind::Algebraic),
        reference: 0.0,
    };
    let is_turn = |row: &Row| matches!(row.direction, Direction::Turn(_));
    let mut algebraic = Vec::new();
    for (row, &symbol) in loops.rows.iter().zip(&loops.multipliers) {
        algebraic.push(variable(graph, symbol, if is_turn(row) { Dimension::TORQUE } else { Dimension::FORCE }));
    }
    for (row, &symbol) in loops.rows.iter().zip(&loops.projections) {
        let dimension = if is_turn(row) { Dimension::ONE / Dimension::TIME } else { Dimension::VELOCITY };
        algebraic.push(variable(graph, symbol, dimension));
    }
    let level = |word: &str| -> Vec<String> {
        let joints = loops.rows.iter().map(|row| (&study.joints[row.joint].name, &row.holds));
        joints.map(|(joint, holds)| format!("{word} of `{joint}` ({holds})")).collect()
    };
    let mut names = [level("velocity constraint"), level("position constraint")].concat();
    let mut constraints = [&loops.velocities[..], &loops.positions].concat();
    for (reaction, value) in reactions {
        let dimension = if reaction.is_moment { Dimension::TORQUE } else { Dimension::FORCE };
        algebraic.push(variable(graph, reaction.symbol, dimension));
        names.push(format!("definition of `{}`", graph.symbol_name(reaction.symbol)));
        let unknown = graph.variable(reaction.symbol);
        constraints.push(graph.subtract(unknown, *value));
    }
    debug_assert_eq!(algebraic.len(), constraints.len());
    (algebraic, constraints, names)
}
