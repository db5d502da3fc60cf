//! The system from its parts: states, rates, measures, starts.

use super::articulated::Accelerated;
use super::elastic::Modal;
use super::events::Changes;
use super::kinematics::FrameMotion;
use super::multipliers::{Loops, algebraic_part};
use super::scale::typical_magnitude;
use super::selection::Choice;
use super::starts::starts;
use super::system::{Event, Output, StartEquation, System, TURNING, Variable, VariableKind};
use super::topology::{Axis, Coordinate, Tree};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::vector::Vector;
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{EventTrigger, ReactionQuantity, Study};
use std::collections::HashMap;

/// How fast a quaternion whose length has drifted returns to length one, 1/s: slow against every motion, so that it
/// costs no step, and enough to make the length of a quaternion at rest determined.
const QUATERNION_RETURN: f64 = 1.0;

pub(super) fn assemble(
    mut graph: Graph,
    study: &Study,
    tree: &Tree,
    frames: &[FrameMotion],
    accelerated: &[Accelerated],
    meaning: &HashMap<Symbol, Node>,
    (loops, reactions, changes): (Loops, Vec<(ReactionQuantity, Node)>, Vec<Changes>),
) -> Result<System, Vec<Diagnostic>> {
    let modes = tree.modal.iter().flat_map(|modal| &modal.links);
    let moving: Vec<usize> = tree.links_of_joint.iter().flatten().chain(modes).copied().collect();
    let projection = loops.projection(&mut graph, tree, frames);
    let mut states = state_variables(study, tree, &moving);
    if let Some(closed) = loops.closed.first() {
        states
            .iter_mut()
            .for_each(|state| state.reference = closed.get(&state.symbol).copied().unwrap_or(state.reference));
    }
    let mut rates: Vec<Node> =
        moving.iter().flat_map(|&link| position_rates(&mut graph, tree, link, &projection)).collect();
    let free = moving.iter().filter(|&&link| tree.links[link].free_symbols().is_some());
    rates.extend(free.map(|&link| accelerated[link].acceleration));
    let derivatives: Vec<Node> = study.states.iter().map(|state| state.derivative).collect();
    rates.extend(graph.substitute(&derivatives, meaning));
    states.extend(loops.choices.iter().map(|choice| choice_variable(&graph, choice)));
    rates.extend(loops.choices.iter().map(|_| graph.constant(0.0)));

    let values: Vec<Node> = study.outputs().map(|(_, value, _)| value).collect();
    let values = graph.substitute(&values, meaning);
    let name_and_value = |((name, ..), value): ((&str, Node, Span), Node)| Output { name: name.to_owned(), value };
    let outputs: Vec<Output> = study.outputs().zip(values).map(name_and_value).collect();
    let mut probes = probes(&mut graph, study, meaning);
    probes.extend(turning(&mut graph, study, tree, frames));
    let mut events = events(&mut graph, study, &states, meaning, changes);
    events.extend(loops.choices.iter().filter_map(|choice| change_over(&states, choice)));
    let (starts, references) = all_starts(&mut graph, study, &states, meaning, &loops)?;
    let (algebraic, constraints, constraint_names) = algebraic_part(&mut graph, study, &loops, &reactions);

    let system = System {
        graph,
        time: study.time,
        states,
        rates,
        algebraic,
        constraints,
        constraint_names,
        loop_constraints: loops.multipliers.len(),
        position_constraints: loops.of_positions(),
        loop_owners: loops.owners(study),
        warnings: loops.warnings,
        parameters: study.parameters.iter().map(|p| p.symbol).collect(),
        parameter_names: study.parameters.iter().map(|p| p.name.clone()).collect(),
        outputs,
        events,
        probes,
        starts,
        references,
    };
    refuse_unknown_symbols(study, tree, &system)?;
    Ok(system)
}

/// Rates of the positions that belong to a link.
fn position_rates(graph: &mut Graph, tree: &Tree, link: usize, projection: &[Node]) -> Vec<Node> {
    match tree.links[link].coordinate {
        Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
            let velocity = graph.variable(symbols.velocity);
            vec![graph.add(velocity, projection[link])]
        }
        Coordinate::Rotation { symbols, component: 0, .. } => {
            let rate = |graph: &mut Graph, k: usize| {
                let own = graph.variable(symbols.velocity[k]);
                graph.add(own, projection[link + k])
            };
            let rates: Vector = std::array::from_fn(|k| rate(graph, k));
            quaternion_rates(graph, symbols.quaternion, rates)
        }
        Coordinate::Rotation { .. }
        | Coordinate::Prescribed { .. }
        | Coordinate::Turned { .. }
        | Coordinate::Weld
        | Coordinate::Follower { .. } => vec![],
    }
}

/// `q' = q (0, w) / 2 + k (1 - |q|^2) q`.
pub(super) fn quaternion_rates(graph: &mut Graph, quaternion: [Symbol; 4], rates: Vector) -> Vec<Node> {
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
            Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
                positions.push(variable(symbols.position, position, VariableKind::Position, 0.0));
                velocities.push(variable(symbols.velocity, velocity, VariableKind::Velocity, 0.0));
            }
            Coordinate::Rotation { symbols, component, .. } => {
                if component == 0 {
                    positions.extend(symbols.quaternion.iter().enumerate().map(|(i, &symbol)| {
                        variable(symbol, position, VariableKind::Position, f64::from(u8::from(i == 0)))
                    }));
                }
                velocities.push(variable(symbols.velocity[component], velocity, VariableKind::Velocity, 0.0));
            }
            Coordinate::Prescribed { .. }
            | Coordinate::Turned { .. }
            | Coordinate::Weld
            | Coordinate::Follower { .. } => {}
        }
    }
    let laws = study.states.iter().map(|state| {
        let usual = variable(state.symbol, state.dimension, VariableKind::Law, 0.0);
        Variable { scale: state.nominal.unwrap_or(usual.scale), ..usual }
    });
    positions.into_iter().chain(velocities).chain(laws).collect()
}

fn events(
    graph: &mut Graph,
    study: &Study,
    states: &[Variable],
    meaning: &HashMap<Symbol, Node>,
    changes: Vec<Changes>,
) -> Vec<Event> {
    let place = |symbol: Symbol| states.iter().position(|state| state.symbol == symbol);
    let event = |(event, changes): (&crate::study::Event, Changes)| {
        let trigger = match event.trigger {
            EventTrigger::Rises(condition) => EventTrigger::Rises(graph.substitute(&[condition], meaning)[0]),
            every @ EventTrigger::Every(_) => every,
        };
        let changes = changes.into_iter().filter_map(|(symbol, value)| Some((place(symbol)?, value))).collect();
        Event { name: event.owner.clone(), trigger, changes }
    };
    study.events.iter().zip(changes).map(event).collect()
}

/// Which constraints are in force: a number that changes at events only.
fn choice_variable(graph: &Graph, choice: &Choice) -> Variable {
    let name = graph.symbol_name(choice.symbol).to_owned();
    let scale = typical_magnitude(Dimension::ONE, VariableKind::Law);
    Variable { symbol: choice.symbol, name, kind: VariableKind::Law, dimension: Dimension::ONE, scale, reference: 0.0 }
}

/// Other constraints of a loop come into force.
fn change_over(states: &[Variable], choice: &Choice) -> Option<Event> {
    let at = states.iter().position(|state| state.symbol == choice.symbol)?;
    let trigger = EventTrigger::Rises(choice.condition);
    Some(Event { name: states[at].name.clone(), trigger, changes: vec![(at, choice.change)] })
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

/// Per elastic body how fast it turns against its lowest mode.
fn turning(graph: &mut Graph, study: &Study, tree: &Tree, frames: &[FrameMotion]) -> Vec<Output> {
    let of_body = |modal: &Modal| {
        let value = modal.turning(graph, study, &frames[modal.seat()])?;
        Some(Output { name: format!("{}.{TURNING}", study.bodies[modal.body].name), value })
    };
    tree.modal.iter().filter_map(of_body).collect()
}

/// Per start of the study the equations of all states, and a position that closes the loops.
type Starts = (Vec<Vec<StartEquation>>, Vec<Vec<f64>>);

fn all_starts(
    graph: &mut Graph,
    study: &Study,
    states: &[Variable],
    meaning: &HashMap<Symbol, Node>,
    loops: &Loops,
) -> Result<Starts, Vec<Diagnostic>> {
    let initial: Vec<Node> = study.states.iter().map(|state| state.initial).collect();
    let initial = graph.substitute(&initial, meaning);
    let initial: HashMap<Symbol, Node> = study.states.iter().map(|state| state.symbol).zip(initial).collect();
    let mut result = Vec::new();
    let mut references = Vec::new();
    let mut errors = Vec::new();
    for (number, (name, start, span)) in study.starts().enumerate() {
        let mut states = states.to_vec();
        if let Some(closed) = loops.closed.get(number) {
            states
                .iter_mut()
                .for_each(|state| state.reference = closed.get(&state.symbol).copied().unwrap_or(state.reference));
        }
        references.push(states.iter().map(|state| state.reference).collect());
        let values: Vec<Node> = start.overrides.iter().map(|&(_, value)| value).collect();
        let values = graph.substitute(&values, meaning);
        // No balance determines states that change at events only.
        let held = study.states.iter().filter(|state| graph.is_zero(state.derivative));
        let mut overrides: Vec<(Symbol, Node)> =
            held.filter_map(|state| Some((state.symbol, *initial.get(&state.symbol)?))).collect();
        for choice in &loops.choices {
            let set = choice.at_starts.get(number).copied().unwrap_or(0);
            overrides.push((choice.symbol, graph.constant(set as f64)));
        }
        overrides.extend(start.overrides.iter().map(|&(symbol, _)| symbol).zip(values));
        match starts(graph, &states, (&name, start.base, span), &initial, &overrides) {
            Ok(equations) => result.push(equations),
            Err(found) => errors.extend(found),
        }
    }
    if errors.is_empty() { Ok((result, references)) } else { Err(errors) }
}

/// Everything that is left must be time, a state or a parameter.
fn refuse_unknown_symbols(study: &Study, tree: &Tree, system: &System) -> Result<(), Vec<Diagnostic>> {
    let mut known: std::collections::HashSet<Symbol> = system.states.iter().map(|state| state.symbol).collect();
    known.extend(&system.parameters);
    known.extend(system.algebraic.iter().map(|variable| variable.symbol));
    known.insert(system.time);
    let mut roots: Vec<Node> = system.rates.clone();
    roots.extend(system.outputs.iter().map(|output| output.value));
    roots.extend(system.events.iter().flat_map(|event| event.nodes()));
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
                Coordinate::Free { symbols, .. } | Coordinate::Mode { symbols, .. } => {
                    symbols.position == symbol || symbols.velocity == symbol
                }
                Coordinate::Rotation { symbols, .. } => {
                    symbols.quaternion.contains(&symbol) || symbols.velocity.contains(&symbol)
                }
                Coordinate::Prescribed { .. }
                | Coordinate::Turned { .. }
                | Coordinate::Weld
                | Coordinate::Follower { .. } => false,
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
    for (event, declared) in system.events.iter().zip(&study.events) {
        for node in event.nodes() {
            check(&format!("an event of `{}`", event.name), node, declared.span);
        }
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
