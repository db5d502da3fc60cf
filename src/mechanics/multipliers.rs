//! Multipliers of closed loops, on velocity and on position level (Gear-Gupta-Leimkuhler-1985).

use super::articulated::Loads;
use super::assembly::{Assembly, Constraints, assemble_loops};
use super::couplings::{self, Places};
use super::kinematics::{self, FrameMotion};
use super::loops::{self, Direction, Owner, Row};
use super::scale::typical_magnitude;
use super::selection::{Choice, is_in_force};
use super::system::{IN_FORCE, Variable, VariableKind};
use super::topology::{Coordinate, Tree};
use crate::diagnostics::{Diagnostic, Span};
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{ReactionQuantity, Study};
use std::collections::HashMap;

/// Constraints of closed loops with their multipliers.
pub(super) struct Loops {
    /// Those that count somewhere.
    pub rows: Vec<Row>,
    /// Per row the constraints it is and where (1: in force).
    shares: Vec<Vec<(usize, Node)>>,
    /// Per constraint a row in it.
    labels: Vec<usize>,
    /// Which rows are in force where they take turns.
    pub choices: Vec<Choice>,
    /// On velocity level, one per constraint.
    pub multipliers: Vec<Symbol>,
    /// On position level; those of rates alone, which come last, have none.
    projections: Vec<Symbol>,
    positions: Vec<Node>,
    /// Rate of every constraint.
    pub velocities: Vec<Node>,
    /// Per start of the study, where the loops are closed.
    pub closed: Vec<HashMap<Symbol, f64>>,
    /// A closed position that is not special.
    pub general: HashMap<Symbol, f64>,
    pub warnings: Vec<Diagnostic>,
}

impl Loops {
    pub fn close(graph: &mut Graph, places: &Places) -> Result<Self, Vec<Diagnostic>> {
        let Places { study, tree, frames, .. } = *places;
        let mut rows = loops::rows(graph, study, tree)?;
        rows.extend(couplings::rows(graph, places));
        let positions: Vec<Option<Node>> = rows.iter().map(|row| row.position(graph, frames)).collect();
        let on_positions = positions.iter().flatten().count();
        let positions: Vec<Node> = positions.into_iter().flatten().collect();
        let velocities: Vec<Node> = rows.iter().map(|row| row.velocity(graph, frames)).collect();
        let upright = loops::upright(graph, study, tree, frames);
        let constraints =
            Constraints { rows: &rows, positions: &positions, velocities: &velocities, upright: &upright };
        let assembly = assemble_loops(graph, study, tree, &constraints)?;
        let taken = Taken::new(graph, study, tree, &assembly, (&rows, &velocities));
        let labels: Vec<usize> = taken.slots.iter().map(|slot| slot[0].0).collect();
        let mut symbols = |word: &str, labels: &[usize]| -> Vec<Symbol> {
            let row = |at: &usize| (rows[*at].owner.name(study), &rows[*at].holds);
            labels.iter().map(row).map(|(owner, holds)| graph.symbol(&format!("{owner}.{word}: {holds}"))).collect()
        };
        let multipliers = symbols("reaction", &labels);
        let with_positions = labels.iter().take_while(|row| **row < on_positions).count();
        let projections = symbols("projection", &labels[..with_positions]);
        let positions = constraints_of(graph, &taken.slots[..with_positions], &positions);
        let velocities = constraints_of(graph, &taken.slots, &velocities);
        let counting: Vec<usize> = (0..rows.len()).filter(|&row| !taken.shares(row).is_empty()).collect();
        Ok(Self {
            shares: counting.iter().map(|&row| taken.shares(row)).collect(),
            labels: labels.iter().filter_map(|label| counting.iter().position(|row| row == label)).collect(),
            rows: counting.iter().map(|&row| rows[row].clone()).collect(),
            choices: taken.choices,
            multipliers,
            projections,
            positions,
            velocities,
            closed: assembly.positions,
            general: assembly.general,
            warnings: assembly.warnings,
        })
    }

    /// Per constraint what it belongs to.
    pub fn owners(&self, study: &Study) -> Vec<(String, Span)> {
        let owner = |row: &usize| self.rows[*row].owner;
        self.labels.iter().map(owner).map(|owner| (owner.name(study).to_owned(), owner.span(study))).collect()
    }

    /// The rows with what acts along each; `multipliers` of all constraints, or of the first ones.
    pub fn acting<'l>(&'l self, graph: &mut Graph, multipliers: &[Symbol]) -> Vec<(&'l Row, Node)> {
        let mut acting = Vec::new();
        for (row, shares) in self.rows.iter().zip(&self.shares) {
            let mut sum = graph.constant(0.0);
            for &(constraint, in_force) in shares {
                let Some(&multiplier) = multipliers.get(constraint) else { continue };
                let multiplier = graph.variable(multiplier);
                let zero = graph.constant(0.0);
                let share = graph.select(in_force, multiplier, zero);
                sum = graph.add(sum, share);
            }
            acting.push((row, sum));
        }
        acting
    }

    /// Adds what the multipliers do to the links.
    pub fn load(&self, graph: &mut Graph, frames: &[FrameMotion], multipliers: &[Symbol], loads: &mut Loads) {
        for (row, multiplier) in self.acting(graph, multipliers) {
            if !graph.is_zero(multiplier) {
                row.act(graph, frames, multiplier, loads);
            }
        }
    }

    /// How many constraints are those of positions; they come first.
    pub fn of_positions(&self) -> usize {
        self.projections.len()
    }

    /// Load of every coupling, per coupling of the study: zero where others say the same.
    pub fn coupling_loads(&self, graph: &mut Graph, study: &Study) -> Vec<Node> {
        let mut loads = vec![graph.constant(0.0); study.couplings.len()];
        for (row, multiplier) in self.acting(graph, &self.multipliers) {
            if let Owner::Coupling(index) = row.owner {
                loads[index] = multiplier;
            }
        }
        loads
    }

    /// G^T mu per link.
    pub fn projection(&self, graph: &mut Graph, tree: &Tree, frames: &[FrameMotion]) -> Vec<Node> {
        let mut loads = Loads::none(graph, tree);
        if self.rows.is_empty() {
            return loads.coordinates;
        }
        self.load(graph, frames, &self.projections, &mut loads);
        let Loads { mut wrenches, coordinates: mut result } = loads;
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

/// Which rows make up the constraints.
struct Taken {
    /// Per constraint the rows that take turns in it, with where each is in force.
    slots: Vec<Vec<(usize, Node)>>,
    choices: Vec<Choice>,
}

impl Taken {
    fn new(
        graph: &mut Graph,
        study: &Study,
        tree: &Tree,
        assembly: &Assembly,
        (rows, velocities): (&[Row], &[Node]),
    ) -> Self {
        let always = graph.constant(1.0);
        let states: Vec<Symbol> =
            tree.links.iter().filter_map(|link| link.free_symbols().map(|(velocity, _)| velocity)).collect();
        let in_group = |row: &usize| assembly.groups.iter().any(|group| group.sets[0].contains(row));
        let mut slots: Vec<Vec<(usize, Node)>> =
            assembly.kept.iter().filter(|row| !in_group(row)).map(|&row| vec![(row, always)]).collect();
        let mut choices = Vec::new();
        for group in &assembly.groups {
            let owner = rows[group.sets[0][0]].owner.name(study);
            let symbol = graph.symbol(&format!("{owner}.{IN_FORCE}"));
            let in_force: Vec<Node> = (0..group.sets.len()).map(|number| is_in_force(graph, symbol, number)).collect();
            for (at, &row) in group.sets[0].iter().enumerate() {
                if group.sets.iter().all(|set| set[at] == row) {
                    slots.push(vec![(row, always)]);
                } else {
                    slots.push(group.sets.iter().zip(&in_force).map(|(set, &own)| (set[at], own)).collect());
                }
            }
            choices.push(group.choice(graph, symbol, velocities, &states));
        }
        slots.sort_by_key(|slot| slot[0].0);
        Self { slots, choices }
    }

    /// Constraints that a row is, and where.
    fn shares(&self, row: usize) -> Vec<(usize, Node)> {
        let of_slot = |(number, slot): (usize, &Vec<(usize, Node)>)| {
            slot.iter().filter(|(own, _)| *own == row).map(|&(_, in_force)| (number, in_force)).collect::<Vec<_>>()
        };
        self.slots.iter().enumerate().flat_map(of_slot).collect()
    }
}

/// Per constraint the expression of the row in force.
fn constraints_of(graph: &mut Graph, slots: &[Vec<(usize, Node)>], of_rows: &[Node]) -> Vec<Node> {
    let constraint = |slot: &Vec<(usize, Node)>| {
        let first = of_rows[slot[0].0];
        slot.iter().skip(1).fold(first, |sum, &(row, in_force)| graph.select(in_force, of_rows[row], sum))
    };
    slots.iter().map(constraint).collect()
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
    let dimensions = |row: &Row| match row.direction {
        Direction::Turn(_) => [Dimension::TORQUE, Dimension::ONE / Dimension::TIME],
        Direction::Relation(of) => [Dimension::TORQUE / of, of / Dimension::TIME],
        Direction::Shift(_) | Direction::Distance => [Dimension::FORCE, Dimension::VELOCITY],
    };
    let mut algebraic = Vec::new();
    let labels: Vec<&Row> = loops.labels.iter().map(|&row| &loops.rows[row]).collect();
    for (row, &symbol) in labels.iter().zip(&loops.multipliers) {
        algebraic.push(variable(graph, symbol, dimensions(row)[0]));
    }
    for (row, &symbol) in labels.iter().zip(&loops.projections) {
        algebraic.push(variable(graph, symbol, dimensions(row)[1]));
    }
    let level = |word: &str, labels: &[&Row]| -> Vec<String> {
        labels.iter().map(|row| format!("{word} of `{}` ({})", row.owner.name(study), row.holds)).collect()
    };
    let with_positions = &labels[..loops.projections.len()];
    let mut names = [level("velocity constraint", &labels), level("position constraint", with_positions)].concat();
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
