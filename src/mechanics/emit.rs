//! Stable text of a study's mechanics (`ident compile --emit tree|model|equations`). All numbers SI.

use super::system::{StartEquation, System, VariableKind};
use super::topology::{Tree, spanning_tree};
use crate::diagnostics::Diagnostic;
use crate::expression::{Graph, Node, Printer};
use crate::study::{
    Attachment, AxisMotion, ChangeTarget, Elastic, EventTrigger, Force, ForcePlace, Joint, JointKind, Motion,
    StartBase, Study,
};
use std::fmt::Write;

/// Number of the form of the texts (docs/emitted_text.md): grows when a line that was there is written otherwise.
pub const TEXT_FORM: u32 = 1;

/// First line of every text: what it is of, and in which form.
pub(crate) fn head(kind: &str, study: &Study) -> String {
    format!("{kind} {} ({}), form {TEXT_FORM}\n", study.name, study.variant)
}

/// The spanning tree: ground, joints with their coordinates, bodies.
///
/// # Errors
///
/// Those of the topology: bodies without connection to ground, closed loops.
pub fn emit_tree(study: &Study) -> Result<String, Vec<Diagnostic>> {
    let mut graph = study.graph.clone();
    let tree = spanning_tree(study, &mut graph)?;
    let mut text = head("tree", study) + "ground\n";
    branches(&mut text, study, &tree, None, 1);
    let moving = tree.links.iter().filter(|link| link.free_symbols().is_some()).count();
    for joint in study.joints.iter().filter(|joint| joint.closes_loop) {
        let ends =
            [&joint.parent, &joint.child].map(|end| end.body.map_or("ground", |body| study.bodies[body].name.as_str()));
        let _ = writeln!(text, "loop closed by {}: {} {} -> {}", joint.name, kind_text(joint), ends[0], ends[1]);
    }
    for coupling in &study.couplings {
        let _ = writeln!(text, "coupled by {}", coupling.name);
    }
    let closing = study.joints.iter().filter(|joint| joint.closes_loop).count();
    let mut held = Vec::new();
    if closing > 0 {
        held.push(format!("{closing} closed loops"));
    }
    if !study.couplings.is_empty() {
        held.push(format!("{} couplings", study.couplings.len()));
    }
    let loops = if held.is_empty() { String::new() } else { format!(" of the tree, {}", held.join(", ")) };
    let _ = writeln!(
        text,
        "\n{} bodies, {} joints, {moving} degrees of freedom{loops}",
        study.bodies.len(),
        study.joints.len()
    );
    Ok(text)
}

/// What hangs on body `on` (`None`: ground), indented.
fn branches(text: &mut String, study: &Study, tree: &Tree, on: Option<usize>, depth: usize) {
    for &(number, body) in &tree.walk {
        let joint = &study.joints[number];
        let is_reversed = joint.parent.body == Some(body);
        let from = if is_reversed { joint.child.body } else { joint.parent.body };
        if from != on {
            continue;
        }
        let note = if is_reversed { "  (declared from this body)" } else { "" };
        let mut coordinates: Vec<String> = joint.axes.iter().map(|axis| format!("{}.position", axis.name)).collect();
        coordinates.extend(joint.rotation.map(|_| format!("{}.quaternion", joint.name)));
        let modes = study.bodies[body].elastic.iter().flat_map(|elastic| &elastic.modes);
        coordinates.extend(modes.map(|mode| format!("{}.position", mode.name)));
        let coordinate = if coordinates.is_empty() { String::new() } else { format!("  [{}]", coordinates.join(", ")) };
        let _ = writeln!(
            text,
            "{}{} <- {}: {}{coordinate}{note}",
            "  ".repeat(depth),
            study.bodies[body].name,
            joint.name,
            kind_text(joint)
        );
        branches(text, study, tree, Some(body), depth + 1);
    }
}

/// As the study writes it.
fn kind_text(joint: &Joint) -> String {
    let axis = |at: usize| joint.axes.get(at).map_or(String::new(), |axis| axis_in_list(axis.motion.direction()));
    let single = |at: usize| joint.axes.get(at).map_or(String::new(), |axis| axis_text(axis.motion.direction()));
    match joint.kind {
        JointKind::Fixed => "fixed".into(),
        JointKind::Spherical => "spherical".into(),
        JointKind::Free => "free".into(),
        JointKind::Distance => "distance".into(),
        JointKind::Prismatic => format!("prismatic({})", single(0)),
        JointKind::Revolute => format!("revolute({})", single(0)),
        JointKind::Cylindrical => format!("cylindrical({})", single(0)),
        JointKind::Planar => format!("planar({})", single(2)),
        JointKind::Universal => format!("universal({}, {})", axis(0), axis(1)),
        JointKind::Axes => {
            let words = joint.axes.iter().map(|axis| match axis.motion {
                AxisMotion::Shift(direction) => format!("shift {}", axis_in_list(direction)),
                AxisMotion::Turn(direction) => format!("turn {}", axis_in_list(direction)),
            });
            format!("axes({})", words.collect::<Vec<_>>().join(", "))
        }
    }
}

/// As [`axis_text`], components in parentheses.
pub(super) fn axis_in_list(axis: [f64; 3]) -> String {
    let text = axis_text(axis);
    if text.contains(',') { format!("({text})") } else { text }
}

/// `x`, `-z`, or components.
pub(super) fn axis_text(axis: [f64; 3]) -> String {
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        let others_vanish = (0..3).all(|j| j == i || axis[j] == 0.0);
        if others_vanish && axis[i].abs() == 1.0 {
            return if axis[i] > 0.0 { name.into() } else { format!("-{name}") };
        }
    }
    format!("{}, {}, {}", axis[0], axis[1], axis[2])
}

/// The study as it was understood: bodies, joints, forces with their loads, states, measures, starts.
pub fn emit_model(study: &Study, system: &System) -> String {
    let inputs = input_names(study);
    let printer = Printer::plain(&study.graph, &inputs);
    let mut text = head("model", study);
    let _ = writeln!(text, "gravity = {}", vector_text(&printer, &study.gravity));
    for parameter in &study.parameters {
        let _ = writeln!(
            text,
            "parameter {} in {} .. {} from {}",
            parameter.name, parameter.lower, parameter.upper, parameter.start
        );
    }
    for input in &study.inputs {
        let _ = writeln!(text, "input {} [{}]", input.name, input.unit.symbol);
    }
    text.push('\n');
    for body in &study.bodies {
        let _ = writeln!(text, "body {}: mass {}", body.name, printer.text(body.mass));
        if !is_zero(&study.graph, &body.centre_of_gravity) {
            let _ = writeln!(text, "  centre of gravity {}", vector_text(&printer, &body.centre_of_gravity));
        }
        if !is_zero(&study.graph, &body.inertia) {
            let _ = writeln!(text, "  inertia {}", vector_text(&printer, &body.inertia));
        }
        if let Some(elastic) = &body.elastic {
            elastic_text(&mut text, &printer, elastic);
        }
    }
    for joint in &study.joints {
        let ends = [&joint.parent, &joint.child].map(|end| attachment_text(study, &printer, end));
        let _ = writeln!(text, "joint {}: {} {} -> {}", joint.name, kind_text(joint), ends[0], ends[1]);
        if let Some(matrix) = joint.orientation {
            let rows: Vec<String> = matrix.iter().map(|row| vector_text(&printer, row)).collect();
            let _ = writeln!(text, "  orientation {}", rows.join(" "));
        }
        if let Some(length) = joint.length {
            let _ = writeln!(text, "  length {}", printer.text(length));
        }
        for axis in &joint.axes {
            if let Some(motion) = axis.prescribed {
                let _ = writeln!(text, "  {} = {}", axis.name, printer.text(motion));
            }
        }
    }
    for coupling in &study.couplings {
        let _ = writeln!(text, "coupling {}: 0 = {}", coupling.name, printer.text(coupling.difference));
    }
    for force in &study.forces {
        force_text(&mut text, study, &printer, force);
    }
    for signal in &study.signals {
        let _ = writeln!(text, "signal {} = {}", signal.name, printer.text(signal.value));
    }
    for state in &study.states {
        let _ = writeln!(text, "state {} from {}", state.name, printer.text(state.initial));
        let _ = writeln!(text, "  {}' = {}", state.name, printer.text(state.derivative));
    }
    for event in &study.events {
        let _ = writeln!(text, "event of {}: {}", event.owner, trigger_text(event.trigger, |node| printer.text(node)));
        for (target, value) in &event.changes {
            let name = match target {
                ChangeTarget::State(symbol) => study.graph.symbol_name(*symbol).to_owned(),
                ChangeTarget::Rate(force) => format!("{}.rate", study.forces[*force].name),
            };
            let _ = writeln!(text, "  {name} := {}", printer.text(*value));
        }
    }
    for measure in &study.measures {
        let _ = writeln!(text, "measure {} [{}] = {}", measure.name, measure.unit.symbol, printer.text(measure.value));
        if let Some(delay) = measure.delay {
            let _ = writeln!(text, "  delayed by {}", printer.text(delay));
        }
        if let Some(step) = measure.quantisation {
            let _ = writeln!(
                text,
                "  rounded to multiples of {step}; in fits noise of standard deviation {}",
                step / 12f64.sqrt()
            );
        }
    }
    for (owner, start, _) in study.starts() {
        let base = match start.base {
            StartBase::Equilibrium => "equilibrium",
            StartBase::Rest => "rest",
        };
        let _ = writeln!(text, "{} from {base}", owner.replace('`', ""));
        for &(symbol, value) in &start.overrides {
            let _ = writeln!(text, "  {} = {}", study.graph.symbol_name(symbol), printer.text(value));
        }
    }
    for criterion in &study.criteria {
        let (statistic, value) = (criterion.statistic.name(), printer.text(criterion.value));
        let manoeuvre = study.manoeuvres.get(criterion.manoeuvre).map_or("", |manoeuvre| &manoeuvre.name);
        let unit = &criterion.unit.symbol;
        let _ = writeln!(text, "criterion {} [{unit}] = {statistic}({value}) in {manoeuvre}", criterion.name);
    }
    let closing: Vec<&str> =
        study.joints.iter().filter(|joint| joint.closes_loop).map(|joint| joint.name.as_str()).collect();
    let velocities = system.states.iter().filter(|state| state.kind == VariableKind::Velocity).count();
    let loops = match closing.as_slice() {
        [] => String::new(),
        [one] => format!(", one loop closed by {one}"),
        several => format!(", {} loops closed by {}", several.len(), several.join(", ")),
    };
    let _ = writeln!(
        text,
        "\n{} bodies, {} joints{loops}, {} degrees of freedom",
        study.bodies.len(),
        study.joints.len(),
        velocities.saturating_sub(system.loop_constraints)
    );
    let _ = writeln!(
        text,
        "{} states, {} algebraic variables, {} parameters, {} outputs",
        system.states.len(),
        system.algebraic.len(),
        system.parameters.len(),
        system.outputs.len()
    );
    text
}

fn elastic_text(text: &mut String, printer: &Printer, elastic: &Elastic) {
    for (number, mode) in elastic.modes.iter().enumerate() {
        let (frequency, damping) = (printer.text(mode.frequency), printer.text(mode.damping));
        let _ = writeln!(text, "  {}: frequency {frequency}, damping {damping}", mode.name);
        let _ = writeln!(text, "    takes along {}, {}", numbers_text(mode.participation), numbers_text(mode.moment));
        for frame in elastic.frames.iter().skip(1) {
            let shape = frame.shapes[number];
            let (shift, turn) = (numbers_text(shape.shift), numbers_text(shape.turn));
            let _ = writeln!(text, "    {} shifts {shift}, turns {turn}", frame.name);
        }
    }
}

fn numbers_text(values: [f64; 3]) -> String {
    let [x, y, z] = values;
    format!("({x}, {y}, {z})")
}

fn force_text(text: &mut String, study: &Study, printer: &Printer, force: &Force) {
    let kind = if force.is_actuator { "actuator" } else { "force" };
    let place = match &force.place {
        ForcePlace::Joint { joint, axis } => format!("on {}", study.joints[*joint].axes[*axis].name),
        ForcePlace::Between { first, second, along, free_length } => {
            let mut place = [first, second].map(|end| attachment_text(study, printer, end)).join(" -> ");
            if let Some(direction) = along {
                let word = if direction.motion == Motion::Rotational { "about" } else { "along" };
                let of = direction.body.map_or(String::new(), |body| format!(" of {}", study.bodies[body].name));
                let _ = write!(place, " {word} {}{of}", axis_text(direction.axis));
            }
            if let Some(length) = free_length {
                let _ = write!(place, " free length {}", printer.text(*length));
            }
            place
        }
    };
    let _ = writeln!(text, "{kind} {}: {} {place}", force.name, force.law);
    let _ = writeln!(text, "  load = {}", printer.text(force.load));
}

fn attachment_text(study: &Study, printer: &Printer, attachment: &Attachment) -> String {
    let body = attachment.body.map_or("ground", |body| study.bodies[body].name.as_str());
    if is_zero(&study.graph, &attachment.position) {
        return body.to_owned();
    }
    format!("{body}{}", vector_text(printer, &attachment.position))
}

fn is_zero(graph: &Graph, components: &[Node]) -> bool {
    components.iter().all(|&component| graph.is_zero(component))
}

fn vector_text(printer: &Printer, components: &[Node]) -> String {
    let components: Vec<String> = components.iter().map(|&component| printer.text(component)).collect();
    format!("({})", components.join(", "))
}

fn input_names(study: &Study) -> Vec<String> {
    study.inputs.iter().map(|input| input.name.clone()).collect()
}

fn plain_text(system: &System, inputs: &[String], node: Node) -> String {
    Printer::plain(&system.graph, inputs).text(node)
}

fn trigger_text(trigger: EventTrigger, print: impl Fn(Node) -> String) -> String {
    match trigger {
        EventTrigger::Rises(condition) => format!("when 0 < {}", print(condition)),
        EventTrigger::Every(period) => format!("every {period} s"),
    }
}

/// Rates, constraints, outputs and given start values as formulas; common subexpressions are named once.
pub fn emit_equations(study: &Study, system: &System) -> String {
    let inputs = input_names(study);
    let mut roots: Vec<Node> = system.rates.iter().chain(&system.constraints).copied().collect();
    roots.extend(system.outputs.iter().map(|output| output.value));
    let printer = Printer::sharing(&system.graph, &inputs, &roots);
    let mut text = head("equations", study);
    let definitions = printer.definitions();
    if !definitions.is_empty() {
        text.push_str("\nwhere\n");
        for (name, formula) in definitions {
            let _ = writeln!(text, "  {name} = {formula}");
        }
    }
    text.push_str("\nrates\n");
    for (state, &rate) in system.states.iter().zip(&system.rates) {
        let _ = writeln!(text, "  {}' = {}", state.name, printer.text(rate));
    }
    if !system.constraints.is_empty() {
        text.push_str("\nconstraints\n");
    }
    for &constraint in &system.constraints {
        let _ = writeln!(text, "  0 = {}", printer.text(constraint));
    }
    if !system.events.is_empty() {
        text.push_str("\nevents\n");
    }
    for event in &system.events {
        let trigger = trigger_text(event.trigger, |node| plain_text(system, &inputs, node));
        let _ = writeln!(text, "  {}: {trigger}", event.name);
        for &(state, value) in &event.changes {
            let _ = writeln!(text, "    {} := {}", system.states[state].name, plain_text(system, &inputs, value));
        }
    }
    text.push_str("\noutputs\n");
    for output in &system.outputs {
        let _ = writeln!(text, "  {} = {}", output.name, printer.text(output.value));
    }
    let plain = Printer::plain(&system.graph, &inputs);
    for (equations, (owner, ..)) in system.starts.iter().zip(study.starts()) {
        let name = owner.split('`').nth(1).unwrap_or_default();
        let _ = writeln!(text, "\nstart {name}");
        for (state, equation) in system.states.iter().zip(equations) {
            let value = match equation {
                StartEquation::Value(node) => plain.text(*node),
                StartEquation::Equilibrium => "equilibrium".into(),
            };
            let _ = writeln!(text, "  {} = {value}", state.name);
        }
    }
    text
}
