//! Can the loops be closed, and which of their constraints say something new? Answered near every start of the study.

use super::linkage::{CLOSED, Linkage, OtherPosition};
use super::loops::{Direction, Owner, Row, without_sign};
use super::selection::{Group, Jacobian, groups};
use super::topology::Tree;
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node, Symbol};
use crate::quantities::Dimension;
use crate::study::{AxisMotion, Joint, JointAxis, JointKind, Start, Study};
use std::collections::HashMap;

/// What was found out about the constraints.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    /// Rows that are independent of those before them.
    pub kept: Vec<usize>,
    /// Per start of the study ([`Study::starts`]), positions at which the loops are closed; the first entry stands for
    /// a study without any.
    pub positions: Vec<HashMap<Symbol, f64>>,
    /// A closed position that is not special.
    pub general: HashMap<Symbol, f64>,
    /// Where other rows than the kept ones count in other positions.
    pub groups: Vec<Group>,
    pub warnings: Vec<Diagnostic>,
}

/// A row whose part independent of the rows before is smaller than this, relative to the row, is redundant.
const INDEPENDENT: f64 = 1e-7;

/// The constraints as expressions: positions of the first rows, velocities of all, cosines that are positive where no
/// joint is turned over.
pub(super) struct Constraints<'a> {
    pub rows: &'a [Row],
    pub positions: &'a [Node],
    pub velocities: &'a [Node],
    pub upright: &'a [Node],
}

/// # Errors
/// Loops that cannot be closed near a start; mechanisms that cannot move.
pub(super) fn assemble_loops(
    graph: &Graph,
    study: &Study,
    tree: &Tree,
    constraints: &Constraints,
) -> Result<Assembly, Vec<Diagnostic>> {
    let rows = constraints.rows;
    if rows.is_empty() {
        return Ok(Assembly::default());
    }
    let mut linkage = Linkage::new(graph, study, tree, constraints);
    let drawn = Start { base: crate::study::StartBase::Rest, overrides: vec![] };
    let mut starts: Vec<Start> = study.starts().map(|(_, start, _)| start.clone()).collect();
    if starts.is_empty() {
        starts.push(drawn);
    }
    let mut positions: Vec<HashMap<Symbol, f64>> = Vec::new();
    let mut known: Vec<(HashMap<Symbol, f64>, HashMap<Symbol, f64>)> = Vec::new();
    let mut warnings = Vec::new();
    for start in &starts {
        let given = linkage.given(study, start);
        if let Some((_, closed)) = known.iter().find(|(before, _)| *before == given) {
            positions.push(closed.clone());
            continue;
        }
        let order: Vec<Symbol> =
            start.overrides.iter().map(|&(symbol, _)| symbol).filter(|s| given.contains_key(s)).collect();
        let closed = linkage.assembled(&given, &order).map_err(|residual| vec![not_closed(study, rows, &residual)])?;
        if let Some(other) = linkage.other_position(&given, &closed)
            && warnings.is_empty()
        {
            warnings.push(other_position(study, &other));
        }
        known.push((given, closed.clone()));
        positions.push(closed);
    }
    let (general, jacobian) = linkage.general_position(&positions[0]);
    let kept = independent_rows(&jacobian, rows);
    let freedom = linkage.freedom() - kept.len();
    let is_driven = study.joints.iter().flat_map(|joint| &joint.axes).any(|axis| axis.prescribed.is_some());
    if freedom == 0 && !is_driven {
        return Err(vec![cannot_move(study, rows)]);
    }
    if is_driven
        && kept.len() < rows.len()
        && let Some(row) = linkage.contradicted(&positions[0], &kept)
    {
        return Err(vec![contradicted(study, &rows[row])]);
    }
    let groups = changing(&mut linkage, is_driven, &kept, &jacobian, (&general, &positions));
    warnings.extend(redundancies(study, rows, &kept, &groups));
    Ok(Assembly { warnings, kept, positions, general, groups })
}

/// Mechanisms of more freedoms keep the constraints that are independent near their start.
const MOST_FREEDOMS: usize = 30;

/// Groups of rows on positions of which different ones are independent in different positions.
fn changing(
    linkage: &mut Linkage,
    is_driven: bool,
    kept: &[usize],
    jacobian: &[f64],
    (general, starts): (&HashMap<Symbol, f64>, &[HashMap<Symbol, f64>]),
) -> Vec<Group> {
    let n = linkage.freedom();
    let m = jacobian.len() / n.max(1);
    let largest = jacobian.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    let says_nothing = |row: usize| (0..n).all(|j| jacobian[j * m + row].abs() < 1e-9 * largest);
    let of_positions = linkage.of_positions();
    let kept: Vec<usize> = kept.iter().copied().filter(|row| *row < of_positions).collect();
    let is_spatial = (0..of_positions).any(|row| !kept.contains(&row) && !says_nothing(row));
    if !is_spatial || n == 0 || n > MOST_FREEDOMS {
        return vec![];
    }
    let along = linkage.jacobians_along(general, is_driven);
    let starts: Vec<Vec<f64>> = starts.iter().map(|closed| linkage.jacobian_at(closed)).collect();
    groups(&kept, &all(of_positions, &along), &all(of_positions, &starts))
}

fn all(rows: usize, jacobians: &[Vec<f64>]) -> Vec<Jacobian<'_>> {
    jacobians.iter().map(|values| Jacobian { rows, values }).collect()
}

/// Prescribed motions that the loops do not allow.
fn contradicted(study: &Study, row: &Row) -> Diagnostic {
    let driven: Vec<&crate::study::Joint> =
        study.joints.iter().filter(|joint| joint.axes.iter().any(|axis| axis.prescribed.is_some())).collect();
    let names: Vec<String> = driven.iter().map(|joint| format!("`{}`", joint.name)).collect();
    let (held, moved) = (row.owner.name(study), names.join(", "));
    let message = match row.owner {
        Owner::Joint(_) => format!("the prescribed motions of {moved} tear the loop apart at joint `{held}`"),
        Owner::Coupling(_) => format!("the prescribed motions of {moved} do not fit coupling `{held}`"),
    };
    let mut diagnostic = Diagnostic::error(Code::MOTIONS_CONTRADICT, message)
        .label(row.owner.span(study), format!("cannot keep on holding {}", row.holds));
    for joint in driven.iter().filter(|joint| joint.name != held) {
        diagnostic = diagnostic.secondary(joint.span, "its motion is prescribed");
    }
    diagnostic.help(
        "the rest of the mechanism decides on a motion that is prescribed: prescribe as many as it has freedoms, or let the \
         held direction go",
    )
}

/// A loop that closes elsewhere, too.
fn other_position(study: &Study, other: &OtherPosition) -> Diagnostic {
    let of_joint =
        |joint: &&crate::study::Joint| joint.axes.iter().any(|axis| axis.symbols.position == other.coordinate);
    let joint = study.joints.iter().find(of_joint);
    let path = study.graph.symbol_name(other.coordinate);
    let value = |amount: f64| {
        if other.is_turn { format!("{:.4} deg", amount.to_degrees()) } else { format!("{:.6} m", amount) }
    };
    let (chosen, alternative) = (value(other.chosen), value(other.alternative));
    let name = joint.map_or(path, |joint| joint.name.as_str());
    let message = format!("the loops can be assembled in several ways: joint `{name}` starts at {chosen}");
    Diagnostic::warning(Code::SEVERAL_POSITIONS, message)
        .label(joint.map_or_else(Default::default, |joint| joint.span), format!("could stand at {alternative}, too"))
        .note("the drawn position is far from one that closes the loops, so that it does not tell which is meant")
        .help(format!("say it in the start: `start = rest {{ {path} = {chosen} }}`"))
}

/// Gram-Schmidt over the rows, shifts before turns: a mechanism loses turning constraints first, after couplings, those
/// of rates before all.
fn independent_rows(jacobian: &[f64], rows: &[Row]) -> Vec<usize> {
    let (m, n) = (rows.len(), jacobian.len() / rows.len().max(1));
    let row = |i: usize| -> Vec<f64> { (0..n).map(|j| jacobian[j * m + i]).collect() };
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by_key(|&i| match rows[i].direction {
        Direction::Shift(_) | Direction::Distance => 0,
        Direction::Turn(_) => 1,
        Direction::Relation(_) if rows[i].has_position() => 2,
        Direction::Relation(_) => 3,
    });
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut kept = Vec::new();
    let typical = (0..m).map(|i| norm(&row(i))).fold(0.0, f64::max);
    for i in order {
        let mut rest = row(i);
        let size = norm(&rest);
        for _ in 0..2 {
            for direction in &basis {
                let along: f64 = direction.iter().zip(&rest).map(|(a, b)| a * b).sum();
                rest.iter_mut().zip(direction).for_each(|(r, d)| *r -= along * d);
            }
        }
        let left = norm(&rest);
        if left > INDEPENDENT * size && size > 1e-9 * typical {
            rest.iter_mut().for_each(|r| *r /= left);
            basis.push(rest);
            kept.push(i);
        }
    }
    kept.sort_unstable();
    kept
}

fn not_closed(study: &Study, rows: &[Row], residual: &[f64]) -> Diagnostic {
    let worst = (0..rows.len()).max_by(|&a, &b| residual[a].abs().total_cmp(&residual[b].abs())).unwrap_or(0);
    let owner = rows[worst].owner;
    let gap = match rows[worst].direction {
        _ if residual[worst].abs() < CLOSED => "closes only with its parts turned over".to_owned(),
        Direction::Turn(_) => format!("{:.3} deg are left ({})", residual[worst].to_degrees(), rows[worst].holds),
        Direction::Relation(dimension) => format!("{} are left between its sides", amount(dimension, residual[worst])),
        _ => format!("{:.4} mm are left ({})", residual[worst] * 1e3, rows[worst].holds),
    };
    if let Owner::Coupling(_) = owner {
        let message =
            format!("coupling `{}` cannot be kept: no position near the start satisfies it", owner.name(study));
        return Diagnostic::error(Code::CANNOT_ASSEMBLE, message).label(owner.span(study), gap).help(
            "all coordinates are zero in the reference configuration; add a number to one side, or say in the `start` \
             where the coupled joints stand",
        );
    }
    let message = format!("the loop closed by joint `{}` cannot be assembled", owner.name(study));
    Diagnostic::error(Code::CANNOT_ASSEMBLE, message).label(owner.span(study), gap).help(
        "check lengths and points of the bodies in the loop; or start nearer: `start = rest { JOINT.position = .. }` \
             in the first experiment says how the mechanism stands",
    )
}

/// A length in mm, an angle in degrees, anything else in SI.
fn amount(dimension: Dimension, value: f64) -> String {
    match dimension {
        Dimension::LENGTH => format!("{:.4} mm", value * 1e3),
        Dimension::ONE => format!("{:.3} deg", value.to_degrees()),
        _ => format!("{value:.4e} {dimension}"),
    }
}

fn cannot_move(study: &Study, rows: &[Row]) -> Diagnostic {
    let mut names: Vec<String> = rows.iter().map(|row| format!("`{}`", row.owner.name(study))).collect();
    names.dedup();
    let verb = if names.len() == 1 { "takes" } else { "take" };
    let message = format!("the mechanism cannot move: {} {verb} away all its freedom", names.join(", "));
    let mut diagnostic = Diagnostic::error(Code::CANNOT_MOVE, message);
    let mut seen = Vec::new();
    for row in rows {
        if !seen.contains(&row.owner) {
            seen.push(row.owner);
            let what = if matches!(row.owner, Owner::Joint(_)) { "closes a loop" } else { "couples positions" };
            diagnostic = diagnostic.label(row.owner.span(study), what);
        }
    }
    diagnostic.help("remove a joint, replace it by one with more freedom, or prescribe a motion")
}

/// One warning per joint with redundant constraints, with the joint that would do without them; one per coupling that
/// says nothing new anywhere.
fn redundancies(study: &Study, rows: &[Row], kept: &[usize], groups: &[Group]) -> Vec<Diagnostic> {
    let takes_turns = |row: &usize| groups.iter().any(|group| group.sets.iter().any(|set| set.contains(row)));
    let mut warnings = Vec::new();
    let mut owners: Vec<Owner> = rows.iter().map(|row| row.owner).collect();
    owners.dedup();
    for owner in owners {
        let own = || (0..rows.len()).filter(move |&i| rows[i].owner == owner);
        let dropped: Vec<usize> = own().filter(|i| !kept.contains(i)).collect();
        if dropped.is_empty() {
            continue;
        }
        let Owner::Joint(index) = owner else {
            // Where other constraints fail it decides: a parallelogram passes its flat position by the coupling of its
            // cranks.
            if dropped.iter().any(takes_turns) {
                continue;
            }
            let name = owner.name(study);
            let message = format!("coupling `{name}` says what joints and other couplings say already");
            let warning = Diagnostic::warning(Code::REDUNDANT_CONSTRAINT, message)
                .label(owner.span(study), "redundant")
                .note("the motion is the same without; its own load is undetermined and shown as zero")
                .help(format!("remove coupling `{name}`, or replace one of the others by elastic elements"));
            warnings.push(warning);
            continue;
        };
        let joint = &study.joints[index];
        let held: Vec<&str> = dropped.iter().map(|&i| rows[i].holds.as_str()).collect();
        let message =
            format!("joint `{}` holds what the rest of its loop holds already: {}", joint.name, held.join(", "));
        let count = |is_turn: bool| {
            own().filter(|i| kept.contains(i) && matches!(rows[*i].direction, Direction::Turn(_)) == is_turn).count()
        };
        let cure = cure(joint, (count(false), count(true)), &dropped, rows);
        let mut warning = Diagnostic::warning(Code::REDUNDANT_CONSTRAINT, message)
            .label(joint.span, "closes the loop; redundant")
            .note("the motion is the same without; reactions in these directions are undetermined and shown as zero");
        if let Some(cure) = cure {
            warning = warning.help(cure);
        }
        warnings.push(warning);
    }
    warnings
}

/// The edit after which the joint holds only what is needed.
fn cure(joint: &Joint, (shifts, turns): (usize, usize), dropped: &[usize], rows: &[Row]) -> Option<String> {
    let name = &joint.name;
    let is_shift = |axis: &&JointAxis| matches!(axis.motion, AxisMotion::Shift(_));
    let turns_first = joint.axes.iter().skip_while(is_shift).any(|axis| is_shift(&axis));
    let in_list = |axis: [f64; 3]| format!("shift {}", super::emit::axis_in_list(without_sign(axis)));
    let kept = joint.axes.iter().filter(is_shift).map(|axis| in_list(axis.motion.direction()));
    let let_go = dropped.iter().filter_map(|&i| match rows[i].direction {
        Direction::Shift(axis) => Some(in_list(axis)),
        _ => None,
    });
    let free: Vec<String> = kept.chain(let_go).collect();
    match (shifts, turns) {
        (3, 0) if joint.kind != JointKind::Spherical => {
            Some(format!("replace it by a spherical joint: `joint {name}: spherical ..`"))
        }
        (0, 0) => Some(format!("remove joint `{name}`: it holds nothing that the others do not hold")),
        (_, 0) if !free.is_empty() && !turns_first => Some(format!(
            "replace it: `joint {name}: axes({}, turn x, turn y, turn z) ..` holds only what is needed",
            free.join(", ")
        )),
        _ => None,
    }
}
