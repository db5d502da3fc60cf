//! The stage's one entry.

use super::articulated::{self, Accelerated, Inertia, Wrench};
use super::assembly::assemble_loops;
use super::forces::{self, Effect, ForceGeometry};
use super::kinematics::{self, FrameMotion, SpatialMotion};
use super::loops::{self, Direction, Row};
use super::scale::typical_magnitude;
use super::starts::starts;
use super::system::{Output, StartEquation, System, Variable, VariableKind};
use super::topology::{Axis, Coordinate, Tree, spanning_tree};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::vector::{self, Vector};
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{AxisMotion, ForcePlace, PointMotion, ReactionQuantity, Study};
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
    let loops = Loops::close(&mut graph, study, &tree, &frames)?;

    let geometries = force_geometries(&mut graph, study, &tree, &frames)?;
    let mut meaning = kinematic_meaning(&mut graph, study, &tree, &frames, &inertias, &geometries);
    let loads: Vec<Node> = study.forces.iter().map(|force| force.load).collect();
    let loads = graph.substitute(&loads, &meaning);
    refuse_accelerations(&graph, study, &tree, &loads, &meaning)?;

    let accelerated = accelerate(&mut graph, study, &tree, &frames, &inertias, (&geometries, &loads), &loops);
    refuse_missing_inertia(&graph, study, &tree, &accelerated)?;
    let hidden = add_accelerations(&mut graph, study, &tree, &frames, &accelerated, &loops, &mut meaning);
    let reactions =
        add_reactions(&mut graph, study, (&tree, &frames), &accelerated, (&geometries, &loads), &loops, &mut meaning);
    assemble(graph, study, &tree, &frames, &accelerated, &meaning, (loops, hidden, reactions))
}

/// Constraints of closed loops with their multipliers.
struct Loops {
    rows: Vec<Row>,
    /// On velocity and on position level, one per row.
    multipliers: Vec<Symbol>,
    projections: Vec<Symbol>,
    positions: Vec<Node>,
    velocities: Vec<Node>,
    warnings: Vec<Diagnostic>,
}

impl Loops {
    fn close(graph: &mut Graph, study: &Study, tree: &Tree, frames: &[FrameMotion]) -> Result<Self, Vec<Diagnostic>> {
        let rows = loops::rows(graph, study, tree)?;
        let positions: Vec<Node> = rows.iter().map(|row| row.position(graph, frames)).collect();
        let velocities: Vec<Node> = rows.iter().map(|row| row.velocity(graph, frames)).collect();
        let assembly = assemble_loops(graph, study, tree, &rows, (&positions, &velocities))?;
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
            warnings: assembly.warnings,
        })
    }

    /// Adds what the multipliers do to the links.
    fn load(&self, graph: &mut Graph, frames: &[FrameMotion], multipliers: &[Symbol], wrenches: &mut [Wrench]) {
        for (row, &multiplier) in self.rows.iter().zip(multipliers) {
            let multiplier = graph.variable(multiplier);
            for (link, wrench) in row.wrenches(graph, frames, multiplier) {
                wrenches[link] = wrenches[link].add(graph, wrench);
            }
        }
    }

    /// G^T mu per link.
    fn projection(&self, graph: &mut Graph, tree: &Tree, frames: &[FrameMotion]) -> Vec<Node> {
        let zero = graph.constant(0.0);
        if self.rows.is_empty() {
            return vec![zero; tree.links.len()];
        }
        let mut wrenches: Vec<Wrench> = tree.links.iter().map(|_| Wrench::zero(graph)).collect();
        self.load(graph, frames, &self.projections, &mut wrenches);
        let mut result = vec![zero; tree.links.len()];
        for (i, link) in tree.links.iter().enumerate().rev() {
            let axis = kinematics::motion_axis(graph, link.axis);
            result[i] = wrenches[i].on(graph, axis);
            if let Some(p) = link.predecessor {
                let carried = wrenches[i].carried_back(graph, &frames[i]);
                wrenches[p] = wrenches[p].add(graph, carried);
            }
        }
        result
    }
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
            Coordinate::Rotation { .. } | Coordinate::Weld => continue,
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
            if let Some(geometry) = loops::closing_coordinate(graph, study, tree, frames, (number, at)) {
                meaning.insert(axis.symbols.position, geometry.coordinate);
                meaning.insert(axis.symbols.velocity, geometry.rate);
            }
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

/// Symbols of accelerations, with the study's word for each.
fn acceleration_symbols(study: &Study, tree: &Tree) -> Vec<(Symbol, String)> {
    let joints = tree.links.iter().filter_map(|link| link.free_symbols().map(|(_, acceleration)| acceleration));
    let closing = study.joints.iter().filter(|joint| joint.closes_loop);
    let closing = closing.flat_map(|joint| joint.axes.iter().map(|axis| axis.symbols.acceleration));
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
    loops.load(graph, frames, &loops.multipliers, &mut wrenches);
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
        match link.coordinate {
            Coordinate::Free { symbols, .. } => {
                point.insert(symbols.position, general);
            }
            Coordinate::Rotation { symbols, component: 0 } => {
                symbols.quaternion.iter().zip([0.8, 0.3, -0.4, 0.2]).for_each(|(&symbol, value)| {
                    point.insert(symbol, value + 0.01 * number as f64);
                });
            }
            _ => {}
        }
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
        let is_moving = link.free_symbols().is_none() || values[0] > NEGLIGIBLE_INERTIA * scale;
        if !is_moving && !is_in_shadow[number] {
            errors.push(no_inertia(study, tree, link.joint, link.axis));
        }
        if let Some(p) = link.predecessor {
            is_in_shadow[p] |= is_in_shadow[number] || !is_moving;
            reference[p] = std::array::from_fn(|k| reference[p][k].max(around[k]));
        }
    }
    errors.reverse();
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

fn no_inertia(study: &Study, tree: &Tree, joint: usize, axis: Axis) -> Diagnostic {
    let body = tree.walk.iter().find(|(number, _)| *number == joint).map(|&(_, body)| &study.bodies[body]);
    let joint = &study.joints[joint];
    let body_name = body.map_or("ground", |body| body.name.as_str());
    let (lacks, field) = match axis {
        Axis::Turn(_) => ("moment of inertia", "inertia = 0.1 kg*m^2"),
        Axis::Shift(_) => ("mass", "mass = 1 kg"),
    };
    let mut finding =
        Diagnostic::error(Code::NO_INERTIA, format!("joint `{}` moves body `{body_name}` without {lacks}", joint.name))
            .label(joint.span, format!("its acceleration is undetermined: it moves no {lacks}"));
    if let Some(body) = body {
        finding = finding.secondary(body.span, format!("`{body_name}` and what hangs on it is without {lacks} here"));
    }
    finding.help(format!("give `{body_name}` a positive {lacks} (`{field}`), or replace the joint by a fixed one"))
}

/// Meaning of all accelerations; returns the time derivatives of the velocity constraints.
fn add_accelerations(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    accelerated: &[Accelerated],
    loops: &Loops,
    meaning: &mut HashMap<Symbol, Node>,
) -> Vec<Node> {
    let joint_accelerations: Vec<Node> = accelerated.iter().map(|a| a.acceleration).collect();
    for (link, &acceleration) in tree.links.iter().zip(&joint_accelerations) {
        match link.coordinate {
            Coordinate::Free { symbols, .. } | Coordinate::Prescribed { symbols, .. } => {
                meaning.insert(symbols.acceleration, acceleration);
            }
            Coordinate::Rotation { symbols, component } => {
                meaning.insert(symbols.acceleration[component], acceleration);
            }
            Coordinate::Weld => {}
        }
    }
    let quantities: Vec<_> = study.point_quantities.iter().filter(|q| q.motion.is_acceleration()).collect();
    if quantities.is_empty() && loops.rows.is_empty() {
        return Vec::new();
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
    loops.rows.iter().map(|row| row.acceleration(graph, frames, &spatial)).collect()
}

/// Meaning of what joints transmit. Where loads depend on it (friction by a normal force) it becomes an unknown of its own:
/// returned with its definition.
fn add_reactions(
    graph: &mut Graph,
    study: &Study,
    (tree, frames): (&Tree, &[FrameMotion]),
    accelerated: &[Accelerated],
    (geometries, loads): (&[ForceGeometry], &[Node]),
    loops: &Loops,
    meaning: &mut HashMap<Symbol, Node>,
) -> Vec<(ReactionQuantity, Node)> {
    let in_loads = graph.symbols_of(loads);
    let mut unknowns = Vec::new();
    for reaction in &study.reactions {
        let vector = if study.joints[reaction.joint].closes_loop {
            closing_reaction(graph, study, frames, reaction, (geometries, loads), loops)
        } else {
            carried_reaction(graph, study, tree, frames, accelerated, reaction)
        };
        let value = vector[reaction.axis];
        if in_loads.contains(&reaction.symbol) {
            unknowns.push((*reaction, value));
        } else {
            meaning.insert(reaction.symbol, value);
        }
    }
    unknowns
}

/// On the child at its attachment, ground axes.
fn carried_reaction(
    graph: &mut Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    accelerated: &[Accelerated],
    reaction: &ReactionQuantity,
) -> Vector {
    let Some(&link) = tree.links_of_joint[reaction.joint].last() else { return vector::zero(graph) };
    let transmitted = accelerated[link].transmitted;
    let local = if reaction.is_moment { transmitted.moment } else { transmitted.force };
    let on_outer = vector::apply(graph, frames[link].orientation, local);
    if tree.is_reversed(study, reaction.joint) { vector::negate(graph, on_outer) } else { on_outer }
}

fn closing_reaction(
    graph: &mut Graph,
    study: &Study,
    frames: &[FrameMotion],
    reaction: &ReactionQuantity,
    (geometries, loads): (&[ForceGeometry], &[Node]),
    loops: &Loops,
) -> Vector {
    let mut sum = vector::zero(graph);
    for (row, &multiplier) in loops.rows.iter().zip(&loops.multipliers).filter(|(row, _)| row.joint == reaction.joint) {
        let multiplier = graph.variable(multiplier);
        let unit = row.reaction(graph, frames, reaction.is_moment);
        let share = vector::scale(graph, multiplier, unit);
        sum = vector::add(graph, sum, share);
    }
    // Elements on the joint's own axes belong to what it transmits.
    let child = study.joints[reaction.joint].child.body;
    for ((force, geometry), &load) in study.forces.iter().zip(geometries).zip(loads) {
        let ForcePlace::Joint { joint, axis } = force.place else { continue };
        let (Effect::Links(wrenches), true) = (&geometry.effect, joint == reaction.joint) else { continue };
        let is_turn = matches!(study.joints[joint].axes[axis].motion, AxisMotion::Turn(_));
        if is_turn != reaction.is_moment || child.is_none() {
            continue;
        }
        if let Some((link, wrench)) = wrenches.last() {
            let local = if reaction.is_moment { wrench.moment } else { wrench.force };
            let turned = vector::apply(graph, frames[*link].orientation, local);
            let share = vector::scale(graph, load, turned);
            sum = vector::add(graph, sum, share);
        }
    }
    sum
}

/// How fast a quaternion whose length has drifted returns to length one, 1/s: slow against every motion, so that it costs no
/// step, and enough to make the length of a quaternion at rest determined.
const QUATERNION_RETURN: f64 = 1.0;

fn assemble(
    mut graph: Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    accelerated: &[Accelerated],
    meaning: &HashMap<Symbol, Node>,
    (loops, hidden, reactions): (Loops, Vec<Node>, Vec<(ReactionQuantity, Node)>),
) -> Result<System, Vec<Diagnostic>> {
    let moving: Vec<usize> = tree.links_of_joint.iter().flatten().copied().collect();
    let projection = loops.projection(&mut graph, tree, frames);
    let states = state_variables(study, tree, &moving);
    let mut rates: Vec<Node> =
        moving.iter().flat_map(|&link| position_rates(&mut graph, tree, link, &projection)).collect();
    let free = moving.iter().filter(|&&link| tree.links[link].free_symbols().is_some());
    rates.extend(free.map(|&link| accelerated[link].acceleration));
    let derivatives: Vec<Node> = study.states.iter().map(|state| state.derivative).collect();
    rates.extend(graph.substitute(&derivatives, meaning));

    let values: Vec<Node> = study.outputs().map(|(_, value, _)| value).collect();
    let values = graph.substitute(&values, meaning);
    let name_and_value = |((name, ..), value): ((&str, Node, Span), Node)| Output { name: name.to_owned(), value };
    let outputs: Vec<Output> = study.outputs().zip(values).map(name_and_value).collect();
    let probes = probes(&mut graph, study, meaning);
    let starts = all_starts(&mut graph, study, &states, meaning)?;
    let (algebraic, constraints) = algebraic_part(&mut graph, &loops, &reactions);
    let index_two = (0..algebraic.len()).map(|i| i < 2 * loops.rows.len()).collect();

    let system = System {
        graph,
        time: study.time,
        states,
        rates,
        algebraic,
        constraints,
        hidden,
        index_two,
        warnings: loops.warnings,
        parameters: study.parameters.iter().map(|p| p.symbol).collect(),
        parameter_names: study.parameters.iter().map(|p| p.name.clone()).collect(),
        outputs,
        probes,
        starts,
    };
    refuse_unknown_symbols(study, tree, &system)?;
    Ok(system)
}

/// Unknowns without derivative, with one equation each.
fn algebraic_part(
    graph: &mut Graph,
    loops: &Loops,
    reactions: &[(ReactionQuantity, Node)],
) -> (Vec<Variable>, Vec<Node>) {
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
    let mut constraints = [&loops.velocities[..], &loops.positions].concat();
    for (reaction, value) in reactions {
        let dimension = if reaction.is_moment { Dimension::TORQUE } else { Dimension::FORCE };
        algebraic.push(variable(graph, reaction.symbol, dimension));
        let unknown = graph.variable(reaction.symbol);
        constraints.push(graph.subtract(unknown, *value));
    }
    debug_assert_eq!(algebraic.len(), constraints.len());
    (algebraic, constraints)
}

/// Rates of the positions that belong to a link.
fn position_rates(graph: &mut Graph, tree: &Tree, link: usize, projection: &[Node]) -> Vec<Node> {
    match tree.links[link].coordinate {
        Coordinate::Free { symbols, .. } => {
            let velocity = graph.variable(symbols.velocity);
            vec![graph.add(velocity, projection[link])]
        }
        Coordinate::Rotation { symbols, component: 0 } => {
            let rate = |graph: &mut Graph, k: usize| {
                let own = graph.variable(symbols.velocity[k]);
                graph.add(own, projection[link + k])
            };
            let rates: Vector = std::array::from_fn(|k| rate(graph, k));
            quaternion_rates(graph, symbols.quaternion, rates)
        }
        Coordinate::Rotation { .. } | Coordinate::Prescribed { .. } | Coordinate::Weld => vec![],
    }
}

/// `q' = q (0, w) / 2 + k (1 - |q|^2) q`.
fn quaternion_rates(graph: &mut Graph, quaternion: [Symbol; 4], rates: Vector) -> Vec<Node> {
    let [w, x, y, z] = quaternion.map(|symbol| graph.variable(symbol));
    let [a, b, c] = rates;
    let mut sum = |terms: [(Node, Node, f64); 3]| {
        let products = terms.map(|(p, q, sign)| {
            let factor = graph.constant(0.5 * sign);
            let product = graph.multiply(p, q);
            graph.multiply(factor, product)
        });
        let partial = graph.add(products[0], products[1]);
        graph.add(partial, products[2])
    };
    let turning = [
        sum([(x, a, -1.0), (y, b, -1.0), (z, c, -1.0)]),
        sum([(w, a, 1.0), (y, c, 1.0), (z, b, -1.0)]),
        sum([(w, b, 1.0), (z, a, 1.0), (x, c, -1.0)]),
        sum([(w, c, 1.0), (x, b, 1.0), (y, a, -1.0)]),
    ];
    let mut excess = graph.constant(QUATERNION_RETURN);
    for component in [w, x, y, z] {
        let square = graph.multiply(component, component);
        let weight = graph.constant(QUATERNION_RETURN);
        let square = graph.multiply(weight, square);
        excess = graph.subtract(excess, square);
    }
    [w, x, y, z]
        .into_iter()
        .zip(turning)
        .map(|(component, turning)| {
            let returning = graph.multiply(excess, component);
            graph.add(turning, returning)
        })
        .collect()
}

fn state_variables(study: &Study, tree: &Tree, moving: &[usize]) -> Vec<Variable> {
    let variable = |symbol: Symbol, dimension: Dimension, kind: VariableKind, reference: f64| Variable {
        symbol,
        name: study.graph.symbol_name(symbol).to_owned(),
        kind,
        dimension,
        scale: typical_magnitude(dimension, kind),
        reference,
    };
    let mut positions = Vec::new();
    let mut velocities = Vec::new();
    for &link in moving {
        let link = &tree.links[link];
        let length = i8::from(matches!(link.axis, Axis::Shift(_)));
        let position = Dimension { length, ..Dimension::default() };
        let velocity = Dimension { length, time: -1, ..Dimension::default() };
        match link.coordinate {
            Coordinate::Free { symbols, .. } => {
                positions.push(variable(symbols.position, position, VariableKind::Position, 0.0));
                velocities.push(variable(symbols.velocity, velocity, VariableKind::Velocity, 0.0));
            }
            Coordinate::Rotation { symbols, component } => {
                if component == 0 {
                    positions.extend(symbols.quaternion.iter().enumerate().map(|(i, &symbol)| {
                        variable(symbol, position, VariableKind::Position, f64::from(u8::from(i == 0)))
                    }));
                }
                velocities.push(variable(symbols.velocity[component], velocity, VariableKind::Velocity, 0.0));
            }
            Coordinate::Prescribed { .. } | Coordinate::Weld => {}
        }
    }
    let laws = study.states.iter().map(|state| variable(state.symbol, state.dimension, VariableKind::Law, 0.0));
    positions.into_iter().chain(velocities).chain(laws).collect()
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
fn refuse_unknown_symbols(study: &Study, tree: &Tree, system: &System) -> Result<(), Vec<Diagnostic>> {
    let mut known: std::collections::HashSet<Symbol> = system.states.iter().map(|state| state.symbol).collect();
    known.extend(&system.parameters);
    known.extend(system.algebraic.iter().map(|variable| variable.symbol));
    known.insert(system.time);
    let mut roots: Vec<Node> = system.rates.clone();
    roots.extend(system.outputs.iter().map(|output| output.value));
    roots.extend(system.starts.iter().flatten().filter_map(|equation| match equation {
        StartEquation::Value(node) => Some(*node),
        StartEquation::Equilibrium => None,
    }));
    if system.graph.symbols_of(&roots).iter().all(|symbol| known.contains(symbol)) {
        return Ok(());
    }
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
    let state_span = |symbol: Symbol| {
        let law = study.states.iter().find(|state| state.symbol == symbol).map(|state| state.span);
        let joint = || {
            let link = tree.links.iter().find(|link| match link.coordinate {
                Coordinate::Free { symbols, .. } => symbols.position == symbol || symbols.velocity == symbol,
                Coordinate::Rotation { symbols, .. } => {
                    symbols.quaternion.contains(&symbol) || symbols.velocity.contains(&symbol)
                }
                Coordinate::Prescribed { .. } | Coordinate::Weld => false,
            });
            link.map(|link| study.joints[link.joint].span)
        };
        law.or_else(joint).unwrap_or_default()
    };
    let spans: Vec<Span> = system.states.iter().map(|state| state_span(state.symbol)).collect();
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
