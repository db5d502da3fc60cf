//! What to know of a simulation that succeeded: what is neglected in the model would count, or chance decided.

use super::prepare::Record;
use super::run::{Compiled, Moved, Trajectory, probe};
use crate::diagnostics::{Code, Diagnostic};
use crate::mechanics::{TURNING, VariableKind};
use crate::quantities::Dimension;
use crate::study::Body;

/// Angular velocity over the lowest circular frequency from which on it is told: centrifugal forces, which go with its
/// square, then change the stiffness by some percent.
const FAST: f64 = 0.2;

/// Whether there may be cautions at all: for elastic bodies and closed loops.
pub fn needs_caution(compiled: &Compiled) -> bool {
    compiled.system.loop_constraints > 0 || compiled.study.bodies.iter().any(|body| body.elastic.is_some())
}

/// Warnings about this record with the parameters `theta` (SI). A record that cannot be simulated has none: that it
/// fails is told elsewhere.
pub fn cautions(compiled: &Compiled, record: &Record, theta: &[f64]) -> Vec<Diagnostic> {
    if !needs_caution(compiled) {
        return Vec::new();
    }
    probe(compiled, record, theta)
        .map_or_else(|_| Vec::new(), |trajectory| cautions_about(compiled, record, &trajectory))
}

/// As [`cautions`], of a trajectory by [`probe`].
pub fn cautions_about(compiled: &Compiled, record: &Record, trajectory: &Trajectory) -> Vec<Diagnostic> {
    let turning = compiled.study.bodies.iter().filter_map(|body| fast_turning(compiled, record, trajectory, body));
    turning.chain(moved_start(compiled, record, trajectory)).chain(branching(compiled, record, trajectory)).collect()
}

/// Whether an elastic body turns so fast that what is neglected of its deformation would count.
fn fast_turning(compiled: &Compiled, record: &Record, trajectory: &Trajectory, body: &Body) -> Option<Diagnostic> {
    let span = body.elastic.as_ref()?.span;
    let name = format!("{}.{TURNING}", body.name);
    let at = compiled.system.probes.iter().position(|probe| probe.name == name)?;
    let fastest = trajectory.probes.get(at)?.iter().fold(0.0_f64, |most, square| most.max(*square)).sqrt();
    if fastest <= FAST {
        return None;
    }
    let message = format!(
        "elastic body `{}` turns at up to {:.0} % of its lowest circular frequency in {}",
        body.name,
        100.0 * fastest,
        record.name
    );
    let diagnostic = Diagnostic::warning(Code::ELASTIC_TURNS_FAST, message)
        .label(span, "these modes do not know what centrifugal forces do to their stiffness")
        .help("divide the body into several by joints with bending springs, or keep to slower records");
    Some(diagnostic)
}

/// Stated positions that say which way a mechanism stands are moved by less than this share and so many typical
/// magnitudes; stated velocities are meant.
const ROUGHLY: (f64, f64) = (0.2, 2.0);
const EXACTLY: (f64, f64) = (0.01, 0.1);

/// Stated start values that the loops do not allow, not even roughly.
fn moved_start(compiled: &Compiled, record: &Record, trajectory: &Trajectory) -> Option<Diagnostic> {
    let (_, _, span) = compiled.study.starts().nth(record.experiment)?;
    let variables = compiled.model.variables();
    let is_far = |moved: &&Moved| {
        let variable = &variables[moved.state];
        let (share, magnitudes) = if variable.kind == VariableKind::Velocity { EXACTLY } else { ROUGHLY };
        (moved.taken - moved.stated).abs() > share * moved.stated.abs() + magnitudes * variable.scale
    };
    let told: Vec<String> = trajectory
        .moved
        .iter()
        .filter(is_far)
        .map(|moved| {
            let variable = &variables[moved.state];
            let unit = unit(variable.dimension);
            // Without a sign of zero.
            let [taken, stated] = [moved.taken, moved.stated].map(|value| (value * 1e4).round() / 1e4 + 0.0);
            format!("`{}` starts at {taken:.4}{unit} instead of {stated:.4}{unit}", variable.name)
        })
        .collect();
    if told.is_empty() {
        return None;
    }
    let message = format!("the loops do not allow what the start of {} states: {}", record.name, told.join(", "));
    let diagnostic = Diagnostic::warning(Code::START_MOVED, message)
        .label(span, "started here")
        .note("what is stated first is kept as far as the loops allow")
        .help("state as many coordinates as the mechanism has freedoms, those that matter first; the others follow");
    Some(diagnostic)
}

fn unit(dimension: Dimension) -> String {
    match dimension {
        Dimension::ONE => " rad".to_owned(),
        other if other == Dimension::ONE / Dimension::TIME => " rad/s".to_owned(),
        other => format!(" {other}"),
    }
}

/// The first position in which a loop could have gone on in another way, and how many there are.
fn branching(compiled: &Compiled, record: &Record, trajectory: &Trajectory) -> Option<Diagnostic> {
    let first = trajectory.branchings.first()?;
    let (owner, span) = compiled.system.loop_owners.get(first.constraint)?;
    let more = match trajectory.branchings.len() - 1 {
        0 => String::new(),
        1 => ", and once more later".to_owned(),
        times => format!(", and {times} times more later"),
    };
    let message = format!(
        "the loop through `{owner}` could go on in two ways at t = {:.4} s in {}{more}",
        first.time, record.name
    );
    let diagnostic = Diagnostic::warning(Code::LOOP_BRANCHES, message)
        .label(*span, "its constraints depend on each other in that position")
        .note(
            "simulated is the motion that keeps its direction; in the machine play, friction and elasticity decide: a \
             parallelogram that stretches out flat may leave that position crossed",
        )
        .help(
            "let the model decide as the machine does: `coupling same: crank_1.position = crank_2.position`, a second \
             linkage out of phase, or an end stop before that position",
        );
    Some(diagnostic)
}
