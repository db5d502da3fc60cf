//! The stage's one entry.

use super::articulated::{self, Accelerated, Inertia, Loads};
use super::assemble::{assemble, quaternion_rates};
use super::closing::{closing_coordinate, closing_rotation};
use super::couplings::Places;
use super::elastic::refuse_large_modes;
use super::events;
use super::forces::{self, ForceGeometry};
use super::inertia::refuse_missing_inertia;
use super::kinematics::{self, FrameMotion, SpatialMotion};
use super::multipliers::Loops;
use super::reactions::add_reactions;
use super::system::System;
use super::topology::{Axis, Coordinate, Tree, spanning_tree};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::vector;
use crate::expression::{Graph, Node, Symbol};
use crate::study::{PointMotion, Study};
use std::collections::{HashMap, HashSet};

/// The equations of motion of a study.
///
/// States are ordered: joint positions, joint velocities (both in order of declaration), law states. The accelerations
/// are explicit expressions (articulated-body algorithm, Featherstone-2008). Closed loops add multipliers
/// (Gear-Gupta-Leimkuhler-1985), see [`System`].
///
/// # Errors
///
/// All mechanical faults found: bodies without connection to ground, loops that cannot be closed or leave nothing to
/// move, joints that move no mass, force elements without direction, loads that depend on accelerations, start values
/// that nothing determines.
pub fn derive(study: &Study) -> Result<System, Vec<Diagnostic>> {
    let mut graph = study.graph.clone();
    refuse_large_modes(&mut graph, study)?;
    let tree = spanning_tree(study, &mut graph)?;
    let frames = kinematics::motion(&mut graph, &tree);
    let inertias = articulated::link_inertias(&mut graph, study, &tree);

    let geometries = force_geometries(&mut graph, study, &tree, &frames)?;
    let mut meaning = kinematic_meaning(&mut graph, study, &tree, &frames, &inertias, &geometries);
    let places = Places { study, tree: &tree, frames: &frames, geometries: &geometries, meaning: &meaning };
    let loops = Loops::close(&mut graph, &places)?;
    let in_couplings = loops.coupling_loads(&mut graph, study);
    meaning.extend(study.couplings.iter().map(|coupling| coupling.load).zip(in_couplings));
    let loads: Vec<Node> = study.forces.iter().map(|force| force.load).collect();
    let loads = graph.substitute(&loads, &meaning);
    refuse_accelerations(&graph, study, &tree, &loads, &meaning)?;

    let accelerated = accelerate(&mut graph, study, &tree, &frames, &inertias, (&geometries, &loads), &loops);
    refuse_missing_inertia(&graph, study, &tree, &accelerated)?;
    add_accelerations(&mut graph, study, &tree, &frames, &accelerated, &mut meaning);
    let reactions =
        add_reactions(&mut graph, study, (&tree, &frames), &accelerated, (&geometries, &loads), &loops, &mut meaning);
    let changes =
        events::changes(&mut graph, study, &tree, (&geometries, &loads), &meaning, &loops, |graph, loads| {
            accelerate(graph, study, &tree, &frames, &inertias, (&geometries, loads), &loops)
        })?;
    assemble(graph, study, &tree, &frames, &accelerated, &meaning, (loops, reactions, changes))
}

fn force_geometries(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
) -> Result<Vec<ForceGeometry>, Vec<Diagnostic>> {
    let mut geometries = Vec::new();
    let mut errors = Vec::new();
    for force in &study.forces {
        match forces::geometry(graph, study, tree, frames, force) {
            Ok(geometry) => geometries.push(geometry),
            Err(error) => errors.push(error),
        }
    }
    if errors.is_empty() { Ok(geometries) } else { Err(errors) }
}

/// Expressions for the kinematic symbols of the study, accelerations excepted.
fn kinematic_meaning(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    inertias: &[Inertia],
    geometries: &[ForceGeometry],
) -> HashMap<Symbol, Node> {
    let mut meaning = HashMap::new();
    for (force, geometry) in study.forces.iter().zip(geometries) {
        meaning.insert(force.coordinate, geometry.coordinate);
        meaning.insert(force.rate, geometry.rate);
    }
    for link in &tree.links {
        let (symbols, given) = match link.coordinate {
            Coordinate::Free { symbols, .. } => (symbols, None),
            Coordinate::Prescribed { symbols, motion, .. } => (symbols, Some(motion)),
            Coordinate::Rotation { .. }
            | Coordinate::Turned { .. }
            | Coordinate::Weld
            | Coordinate::Mode { .. }
            | Coordinate::Follower { .. } => continue,
        };
        // Only the last link of a joint carries bodies.
        let Some(&last) = tree.links_of_joint[link.joint].last() else { continue };
        let (matrix, axis) = match link.axis {
            Axis::Turn(axis) => (inertias[last].rotational, axis),
            Axis::Shift(axis) => (inertias[last].translational, axis),
        };
        let along = vector::apply(graph, matrix, axis);
        let moved = vector::dot(graph, axis, along);
        meaning.insert(symbols.inertia, moved);
        if let Some([position, velocity, _]) = given {
            meaning.insert(symbols.position, position);
            meaning.insert(symbols.velocity, velocity);
        }
    }
    for (number, joint) in study.joints.iter().enumerate().filter(|(_, joint)| joint.closes_loop) {
        for (at, axis) in joint.axes.iter().enumerate() {
            if let Some(geometry) = closing_coordinate(graph, study, tree, frames, (number, at)) {
                meaning.insert(axis.symbols.position, geometry.coordinate);
                meaning.insert(axis.symbols.velocity, geometry.rate);
            }
        }
        if let Some(symbols) = joint.rotation {
            let (quaternion, velocity) = closing_rotation(graph, tree, frames, joint);
            meaning.extend(symbols.quaternion.into_iter().zip(quaternion));
            meaning.extend(symbols.velocity.into_iter().zip(velocity));
        }
    }
    for quantity in &study.point_quantities {
        let point = tree.place(graph, &quantity.point);
        let value = match quantity.motion {
            PointMotion::Position => kinematics::point_position(graph, frames, point),
            PointMotion::Velocity => kinematics::point_velocity(graph, frames, point),
            PointMotion::AngularVelocity => kinematics::angular_velocity(graph, frames, point.link),
            PointMotion::Axis(axis) => {
                let orientation = kinematics::orientation(graph, frames, point.link);
                let of_body = vector::transpose(point.rotation);
                // Column of the seat's rotation: the body's axis in link axes.
                vector::apply(graph, orientation, of_body[axis])
            }
            PointMotion::Acceleration | PointMotion::AngularAcceleration => continue,
        };
        meaning.insert(quantity.symbol, value[quantity.axis]);
    }
    // Geometry may itself be written with the kinematics of other places (a free length set by a joint).
    let symbols: Vec<Symbol> = meaning.keys().copied().collect();
    let mut ordered: Vec<Symbol> = symbols;
    ordered.sort();
    let nodes: Vec<Node> = ordered.iter().map(|symbol| meaning[symbol]).collect();
    let nodes = graph.substitute(&nodes, &meaning);
    ordered.into_iter().zip(nodes).collect()
}

/// Accelerations of closing joints' coordinates that measures ask for: their rates, derived along the motion.
fn closing_accelerations(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    joint_accelerations: &[Node],
    meaning: &mut HashMap<Symbol, Node>,
) {
    let outputs: Vec<Node> = study.outputs().map(|(_, value, _)| value).collect();
    let asked: HashSet<Symbol> = graph.symbols_of(&outputs).into_iter().collect();
    let closing = study.joints.iter().filter(|joint| joint.closes_loop);
    let pairs = closing.flat_map(|joint| {
        let axes = joint.axes.iter().map(|axis| (axis.symbols.velocity, axis.symbols.acceleration));
        let turning =
            joint.rotation.into_iter().flat_map(|symbols| symbols.velocity.into_iter().zip(symbols.acceleration));
        axes.chain(turning)
    });
    let asked: Vec<(Node, Symbol)> = pairs
        .filter(|(_, acceleration)| asked.contains(acceleration))
        .filter_map(|(velocity, acceleration)| Some((*meaning.get(&velocity)?, acceleration)))
        .collect();
    if asked.is_empty() {
        return;
    }
    let rates = motion_rates(graph, tree, joint_accelerations);
    for (rate, acceleration) in asked {
        let mut total = graph.differentiate(&[rate], study.time)[0];
        for symbol in graph.symbols_of(&[rate]) {
            let Some(&change) = rates.get(&symbol) else { continue };
            let slope = graph.differentiate(&[rate], symbol)[0];
            let share = graph.multiply(slope, change);
            total = graph.add(total, share);
        }
        meaning.insert(acceleration, total);
    }
}

/// Derivatives of positions and velocities along the motion.
fn motion_rates(graph: &mut Graph, tree: &Tree, joint_accelerations: &[Node]) -> HashMap<Symbol, Node> {
    let mut rates = HashMap::new();
    for (link, &acceleration) in tree.links.iter().zip(joint_accelerations) {
        match link.coordinate {
            Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
                rates.insert(symbols.position, graph.variable(symbols.velocity));
                rates.insert(symbols.velocity, acceleration);
            }
            Coordinate::Rotation { symbols, component, .. } => {
                if component == 0 {
                    let velocity = symbols.velocity.map(|symbol| graph.variable(symbol));
                    let changes = quaternion_rates(graph, symbols.quaternion, velocity);
                    rates.extend(symbols.quaternion.into_iter().zip(changes));
                }
                rates.insert(symbols.velocity[component], acceleration);
            }
            Coordinate::Prescribed { .. }
            | Coordinate::Turned { .. }
            | Coordinate::Weld
            | Coordinate::Follower { .. } => {}
        }
    }
    rates
}

/// Symbols of accelerations, with the study's word for each.
fn acceleration_symbols(study: &Study, tree: &Tree) -> Vec<(Symbol, String)> {
    let joints = tree.links.iter().filter_map(|link| link.free_symbols().map(|(_, acceleration)| acceleration));
    let closing = study.joints.iter().filter(|joint| joint.closes_loop);
    let closing = closing.flat_map(|joint| {
        let turning = joint.rotation.into_iter().flat_map(|symbols| symbols.acceleration);
        joint.axes.iter().map(|axis| axis.symbols.acceleration).chain(turning)
    });
    let points = study.point_quantities.iter().filter(|quantity| quantity.motion.is_acceleration());
    joints
        .chain(closing)
        .chain(points.map(|quantity| quantity.symbol))
        .map(|symbol| (symbol, study.graph.symbol_name(symbol).to_owned()))
        .collect()
}

fn refuse_accelerations(
    graph: &Graph,
    study: &Study,
    tree: &Tree,
    loads: &[Node],
    meaning: &HashMap<Symbol, Node>,
) -> Result<(), Vec<Diagnostic>> {
    let accelerations = acceleration_symbols(study, tree);
    debug_assert!(accelerations.iter().all(|(symbol, _)| !meaning.contains_key(symbol)));
    let mut errors = Vec::new();
    for (force, &load) in study.forces.iter().zip(loads) {
        let used = graph.symbols_of(&[load]);
        for (_, name) in accelerations.iter().filter(|(symbol, _)| used.contains(symbol)) {
            let message = format!("the load of `{}` depends on the acceleration `{name}`", force.name);
            errors.push(
                Diagnostic::error(Code::ACCELERATION_IN_LOAD, message)
                    .label(force.span, "loads may depend on positions and velocities only")
                    .help(
                        "model what is accelerated as mass or inertia of a body, or pass the acceleration through a \
                         sensor (a law with a state)",
                    ),
            );
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

fn accelerate(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    inertias: &[Inertia],
    (geometries, loads): (&[ForceGeometry], &[Node]),
    loops: &Loops,
) -> Vec<Accelerated> {
    let mut acting = Loads::none(graph, tree);
    for (geometry, &load) in geometries.iter().zip(loads) {
        acting.act(graph, &geometry.effect, load);
    }
    for modal in &tree.modal {
        for (link, load) in modal.loads(graph, study) {
            acting.coordinates[link] = graph.add(acting.coordinates[link], load);
        }
        let weight = modal.weight(graph, study, &frames[modal.seat()]);
        acting.wrenches[modal.seat()] = acting.wrenches[modal.seat()].add(graph, weight);
    }
    loops.load(graph, frames, &loops.multipliers, &mut acting);
    articulated::articulated_bodies(graph, tree, frames, inertias, &acting, study.gravity)
}

/// Meaning of all accelerations.
fn add_accelerations(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    accelerated: &[Accelerated],
    meaning: &mut HashMap<Symbol, Node>,
) {
    let joint_accelerations: Vec<Node> = accelerated.iter().map(|a| a.acceleration).collect();
    for (link, &acceleration) in tree.links.iter().zip(&joint_accelerations) {
        match link.coordinate {
            Coordinate::Free { symbols, .. }
            | Coordinate::Prescribed { symbols, .. }
            | Coordinate::Mode { symbols, .. } => {
                meaning.insert(symbols.acceleration, acceleration);
            }
            Coordinate::Rotation { symbols, component, .. } => {
                meaning.insert(symbols.acceleration[component], acceleration);
            }
            Coordinate::Turned { .. } | Coordinate::Weld | Coordinate::Follower { .. } => {}
        }
    }
    closing_accelerations(graph, study, tree, &joint_accelerations, meaning);
    let quantities: Vec<_> = study.point_quantities.iter().filter(|q| q.motion.is_acceleration()).collect();
    if quantities.is_empty() {
        return;
    }
    let spatial: Vec<SpatialMotion> = kinematics::accelerations(graph, tree, frames, &joint_accelerations);
    for quantity in quantities {
        let point = tree.place(graph, &quantity.point);
        let value = match quantity.motion {
            PointMotion::AngularAcceleration => kinematics::angular_acceleration(graph, frames, &spatial, point.link),
            _ => kinematics::point_acceleration(graph, frames, &spatial, point),
        };
        meaning.insert(quantity.symbol, value[quantity.axis]);
    }
}
