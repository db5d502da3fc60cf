//! The stage's one entry.

use super::articulated::{self, Accelerated, Inertia, Wrench};
use super::forces::{self, Effect, ForceGeometry};
use super::kinematics::{self, FrameMotion, SpatialMotion};
use super::scale::typical_magnitude;
use super::starts::starts;
use super::system::{Output, StartEquation, System, Variable, VariableKind};
use super::topology::{Axis, Tree, spanning_tree};
use super::vector;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{JointKind, PointMotion, Study};
use std::collections::HashMap;

/// The equations of motion of a study.
///
/// States are ordered: joint positions, joint velocities (both in order of declaration), law states. The accelerations are
/// explicit expressions (articulated-body algorithm, Featherstone-2008), so the system has no algebraic variables.
///
/// # Errors
///
/// All mechanical faults found: bodies without connection to ground, closed loops, joints that move no mass, force
/// elements without direction, loads that depend on accelerations, start values that nothing determines.
pub fn derive(study: &Study) -> Result<System, Vec<Diagnostic>> {
    let mut graph = study.graph.clone();
    let tree = spanning_tree(study, &mut graph)?;
    let frames = kinematics::motion(&mut graph, &tree);
    let inertias = articulated::link_inertias(&mut graph, study, &tree);

    let geometries = force_geometries(&mut graph, study, &tree, &frames)?;
    let mut meaning = kinematic_meaning(&mut graph, study, &tree, &frames, &inertias, &geometries);
    let loads: Vec<Node> = study.forces.iter().map(|force| force.load).collect();
    let loads = graph.substitute(&loads, &meaning);
    refuse_accelerations(&graph, study, &tree, &loads, &meaning)?;

    let accelerated = accelerate(&mut graph, study, &tree, &frames, &inertias, (&geometries, &loads));
    refuse_missing_inertia(&graph, study, &tree, &accelerated)?;
    add_accelerations(&mut graph, study, &tree, &frames, &accelerated, &mut meaning);
    assemble(graph, study, &tree, &accelerated, &meaning)
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
    for (link, inertia) in tree.links.iter().zip(inertias) {
        let (matrix, axis) = match link.axis {
            Axis::Turn(axis) => (inertia.rotational, axis),
            Axis::Shift(axis) => (inertia.translational, axis),
        };
        let axis = vector::constant(graph, axis);
        let along = vector::apply(graph, matrix, axis);
        let moved = vector::dot(graph, axis, along);
        meaning.insert(link.symbols.inertia, moved);
    }
    for quantity in &study.point_quantities {
        let point = tree.place(graph, &quantity.point);
        let value = match quantity.motion {
            PointMotion::Position => kinematics::point_position(graph, frames, point),
            PointMotion::Velocity => kinematics::point_velocity(graph, frames, point),
            PointMotion::Acceleration => continue,
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

/// Symbols of accelerations, with the study's word for each.
fn acceleration_symbols(study: &Study, tree: &Tree) -> Vec<(Symbol, String)> {
    let joints = tree
        .links
        .iter()
        .map(|link| (link.symbols.acceleration, format!("{}.acceleration", study.joints[link.joint].name)));
    let points = study.point_quantities.iter().filter(|quantity| quantity.motion == PointMotion::Acceleration);
    joints
        .chain(points.map(|quantity| (quantity.symbol, study.graph.symbol_name(quantity.symbol).to_owned())))
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
) -> Vec<Accelerated> {
    let zero = graph.constant(0.0);
    let mut coordinate_loads = vec![zero; tree.links.len()];
    let mut wrenches: Vec<Wrench> = tree.links.iter().map(|_| Wrench::zero(graph)).collect();
    for (geometry, &load) in geometries.iter().zip(loads) {
        match &geometry.effect {
            Effect::Coordinate(link) => coordinate_loads[*link] = graph.add(coordinate_loads[*link], load),
            Effect::Links(unit) => {
                for &(link, wrench) in unit {
                    let wrench = wrench.scale(graph, load);
                    wrenches[link] = wrenches[link].add(graph, wrench);
                }
            }
        }
    }
    articulated::articulated_bodies(graph, tree, frames, inertias, &coordinate_loads, &wrenches, study.gravity)
}

/// Below this part of the inertia in other directions, what a joint moves is rounding.
const NEGLIGIBLE_INERTIA: f64 = 1e-12;

/// Evaluates what each joint moves at one general configuration: zero there means zero nearly everywhere.
fn refuse_missing_inertia(
    graph: &Graph,
    study: &Study,
    tree: &Tree,
    accelerated: &[Accelerated],
) -> Result<(), Vec<Diagnostic>> {
    let mut point: HashMap<Symbol, f64> = study.parameters.iter().map(|p| (p.symbol, p.start)).collect();
    for (number, link) in tree.links.iter().enumerate() {
        let general = match link.axis {
            Axis::Turn(_) => 0.3 + 0.1 * number as f64,
            Axis::Shift(_) => 0.01 + 0.003 * number as f64,
        };
        point.insert(link.symbols.position, general);
    }
    let needed: Vec<Node> =
        accelerated.iter().flat_map(|a| [&[a.moved_inertia][..], &a.around[0], &a.around[1]].concat()).collect();
    let values = graph.evaluate(&needed, |s| point.get(&s).copied().unwrap_or(0.0), |_, _, _| 0.0);
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));

    // Outer joints first: where one fails, what lies further in is not determined and not to blame.
    let mut reference = vec![[0.0_f64; 2]; tree.links.len()];
    let mut is_in_shadow = vec![false; tree.links.len()];
    let mut errors = Vec::new();
    for (number, link) in tree.links.iter().enumerate().rev() {
        let values = &values[7 * number..7 * (number + 1)];
        let around = [largest(&values[1..4]), largest(&values[4..7])];
        let around: [f64; 2] = std::array::from_fn(|k| around[k].max(reference[number][k]));
        let scale = if matches!(link.axis, Axis::Turn(_)) { around[0] } else { around[1] };
        let is_moving = values[0] > NEGLIGIBLE_INERTIA * scale;
        if !is_moving && !is_in_shadow[number] {
            errors.push(no_inertia(study, tree, link.joint));
        }
        if let Some(p) = link.predecessor {
            is_in_shadow[p] |= is_in_shadow[number] || !is_moving;
            reference[p] = std::array::from_fn(|k| reference[p][k].max(around[k]));
        }
    }
    errors.reverse();
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

fn no_inertia(study: &Study, tree: &Tree, joint: usize) -> Diagnostic {
    let body = tree.walk.iter().find(|(number, _)| *number == joint).map(|&(_, body)| &study.bodies[body]);
    let joint = &study.joints[joint];
    let body_name = body.map_or("ground", |body| body.name.as_str());
    let (lacks, field) = match joint.kind {
        JointKind::Revolute { .. } => ("moment of inertia", "inertia = 0.1 kg*m^2"),
        JointKind::Prismatic { .. } | JointKind::Fixed => ("mass", "mass = 1 kg"),
    };
    let mut finding =
        Diagnostic::error(Code::NO_INERTIA, format!("joint `{}` moves body `{body_name}` without {lacks}", joint.name))
            .label(joint.span, format!("its acceleration is undetermined: it moves no {lacks}"));
    if let Some(body) = body {
        finding = finding.secondary(body.span, format!("`{body_name}` and what hangs on it is without {lacks} here"));
    }
    finding.help(format!("give `{body_name}` a positive {lacks} (`{field}`), or replace the joint by a fixed one"))
}

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
        meaning.insert(link.symbols.acceleration, acceleration);
    }
    let mut spatial: Option<Vec<SpatialMotion>> = None;
    for quantity in study.point_quantities.iter().filter(|q| q.motion == PointMotion::Acceleration) {
        let spatial =
            spatial.get_or_insert_with(|| kinematics::accelerations(graph, tree, frames, &joint_accelerations));
        let point = tree.place(graph, &quantity.point);
        let value = kinematics::point_acceleration(graph, frames, spatial, point);
        meaning.insert(quantity.symbol, value[quantity.axis]);
    }
}

fn assemble(
    mut graph: Graph,
    study: &Study,
    tree: &Tree,
    accelerated: &[Accelerated],
    meaning: &HashMap<Symbol, Node>,
) -> Result<System, Vec<Diagnostic>> {
    let moving: Vec<usize> = tree.link_of_joint.iter().flatten().copied().collect();
    let states = state_variables(study, tree, &moving);
    let mut rates: Vec<Node> = moving.iter().map(|&link| graph.variable(tree.links[link].symbols.velocity)).collect();
    rates.extend(moving.iter().map(|&link| accelerated[link].acceleration));
    let derivatives: Vec<Node> = study.states.iter().map(|state| state.derivative).collect();
    rates.extend(graph.substitute(&derivatives, meaning));

    let values: Vec<Node> = study.outputs().map(|(_, value, _)| value).collect();
    let values = graph.substitute(&values, meaning);
    let name_and_value = |((name, ..), value): ((&str, Node, Span), Node)| Output { name: name.to_owned(), value };
    let outputs: Vec<Output> = study.outputs().zip(values).map(name_and_value).collect();
    let probes = probes(&mut graph, study, meaning);
    let starts = all_starts(&mut graph, study, &states, meaning)?;

    let system = System {
        graph,
        time: study.time,
        states,
        rates,
        algebraic: vec![],
        constraints: vec![],
        parameters: study.parameters.iter().map(|p| p.symbol).collect(),
        parameter_names: study.parameters.iter().map(|p| p.name.clone()).collect(),
        outputs,
        probes,
        starts,
    };
    refuse_unknown_symbols(study, &system)?;
    Ok(system)
}

fn state_variables(study: &Study, tree: &Tree, moving: &[usize]) -> Vec<Variable> {
    let joint_variable = |link: usize, kind: VariableKind| {
        let link = &tree.links[link];
        let length = i8::from(matches!(link.axis, Axis::Shift(_)));
        let (symbol, word, time) = match kind {
            VariableKind::Velocity => (link.symbols.velocity, "velocity", -1),
            _ => (link.symbols.position, "position", 0),
        };
        let dimension = Dimension { length, time, ..Dimension::default() };
        let name = format!("{}.{word}", study.joints[link.joint].name);
        Variable { symbol, name, kind, dimension, scale: typical_magnitude(dimension, kind) }
    };
    let positions = moving.iter().map(|&link| joint_variable(link, VariableKind::Position));
    let velocities = moving.iter().map(|&link| joint_variable(link, VariableKind::Velocity));
    let laws = study.states.iter().map(|state| Variable {
        symbol: state.symbol,
        name: state.name.clone(),
        kind: VariableKind::Law,
        dimension: state.dimension,
        scale: typical_magnitude(state.dimension, VariableKind::Law),
    });
    positions.chain(velocities).chain(laws).collect()
}

fn probes(graph: &mut Graph, study: &Study, meaning: &HashMap<Symbol, Node>) -> Vec<Output> {
    let mut probes = Vec::new();
    for place in &study.places {
        for (quantity, node) in &place.probes {
            let name = format!("{}.{}", place.name, format!("{quantity:?}").to_lowercase());
            probes.push(Output { name, value: *node });
        }
    }
    let values: Vec<Node> = probes.iter().map(|probe| probe.value).collect();
    for (probe, value) in probes.iter_mut().zip(graph.substitute(&values, meaning)) {
        probe.value = value;
    }
    probes
}

fn all_starts(
    graph: &mut Graph,
    study: &Study,
    states: &[Variable],
    meaning: &HashMap<Symbol, Node>,
) -> Result<Vec<Vec<StartEquation>>, Vec<Diagnostic>> {
    let initial: Vec<Node> = study.states.iter().map(|state| state.initial).collect();
    let initial = graph.substitute(&initial, meaning);
    let initial: HashMap<Symbol, Node> = study.states.iter().map(|state| state.symbol).zip(initial).collect();
    let mut result = Vec::new();
    let mut errors = Vec::new();
    for (name, start, span) in study.starts() {
        let values: Vec<Node> = start.overrides.iter().map(|&(_, value)| value).collect();
        let values = graph.substitute(&values, meaning);
        let overrides: Vec<(Symbol, Node)> = start.overrides.iter().map(|&(symbol, _)| symbol).zip(values).collect();
        match starts(graph, states, (&name, start.base, span), &initial, &overrides) {
            Ok(equations) => result.push(equations),
            Err(found) => errors.extend(found),
        }
    }
    if errors.is_empty() { Ok(result) } else { Err(errors) }
}

/// Everything that is left must be time, a state or a parameter.
fn refuse_unknown_symbols(study: &Study, system: &System) -> Result<(), Vec<Diagnostic>> {
    let mut known: Vec<Symbol> = system.states.iter().map(|state| state.symbol).collect();
    known.extend(&system.parameters);
    known.push(system.time);
    let mut errors = Vec::new();
    let mut check = |what: &str, node: Node, span: Span| {
        for symbol in system.graph.symbols_of(&[node]).into_iter().filter(|symbol| !known.contains(symbol)) {
            let name = system.graph.symbol_name(symbol);
            errors.push(
                Diagnostic::error(Code::UNKNOWN_QUANTITY, format!("{what} depends on `{name}`, which nothing defines"))
                    .label(span, "used here")
                    .help("identify it as a parameter, declare it as a constant, or attach it to an element"),
            );
        }
    };
    let moving: Vec<Span> = study.joints.iter().filter(|j| j.coordinate.is_some()).map(|j| j.span).collect();
    let spans = moving.iter().chain(&moving).copied().chain(study.states.iter().map(|state| state.span));
    for ((state, &rate), span) in system.states.iter().zip(&system.rates).zip(spans) {
        check(&format!("the rate of `{}`", state.name), rate, span);
    }
    let measured: Vec<&str> = study.measures.iter().map(|measure| measure.name.as_str()).collect();
    for (output, (name, _, span)) in system.outputs.iter().zip(study.outputs()) {
        let what = if measured.contains(&name) { "measure" } else { "criterion" };
        check(&format!("{what} `{name}`"), output.value, span);
    }
    for (equations, (_, _, span)) in system.starts.iter().zip(study.starts()) {
        for (state, equation) in system.states.iter().zip(equations) {
            if let StartEquation::Value(node) = equation {
                check(&format!("the start value of `{}`", state.name), *node, span);
            }
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}
