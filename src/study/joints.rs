//! Kinds of joints: which motions they leave free, and under which names.

use super::checker::{Allowed, Checker, Scope};
use super::fields::{find, value_span};
use super::model::{AxisMotion, Joint, JointAxis, JointKind, JointSymbols, RotationSymbols};
use super::topology::is_parallel;
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::expression::{Node, vector};
use crate::quantities::Dimension;
use crate::syntax::{Direction, DirectionKind, Expression, ExpressionKind, Field, Value};

const SCOPE: Scope = Scope::Study(Allowed::Number);

/// What a joint leaves free.
#[derive(Clone, Debug)]
pub(super) struct JointFreedom {
    pub kind: JointKind,
    pub axes: Vec<AxisEntry>,
    pub rotation: Option<RotationSymbols>,
    /// It has an `orientation`: the bodies' axes are not parallel in the reference configuration.
    pub is_turned: bool,
}

#[derive(Clone, Debug)]
pub(super) struct AxisEntry {
    pub name: String,
    pub motion: AxisMotion,
    pub symbols: JointSymbols,
}

impl JointFreedom {
    pub fn turns(&self) -> bool {
        self.rotation.is_some() || self.axes.iter().any(|axis| matches!(axis.motion, AxisMotion::Turn(_)))
    }

    /// Such a joint cannot be written as constraints on directions of its two bodies.
    pub fn shifts_between_turns(&self) -> bool {
        let is_turn = |axis: &AxisEntry| matches!(axis.motion, AxisMotion::Turn(_));
        let first = self.axes.iter().position(is_turn);
        let last = self.axes.iter().rposition(is_turn);
        first.zip(last).is_some_and(|(first, last)| !self.axes[first..=last].iter().all(is_turn))
    }

    pub fn degrees_of_freedom(&self) -> usize {
        self.axes.len() + if self.rotation.is_some() { 3 } else { 0 }
    }
}

/// Kinds with the number of axes they are written with.
const KINDS: [(&str, JointKind, usize); 10] = [
    ("fixed", JointKind::Fixed, 0),
    ("prismatic", JointKind::Prismatic, 1),
    ("revolute", JointKind::Revolute, 1),
    ("cylindrical", JointKind::Cylindrical, 1),
    ("universal", JointKind::Universal, 2),
    ("planar", JointKind::Planar, 1),
    ("spherical", JointKind::Spherical, 0),
    ("free", JointKind::Free, 0),
    ("axes", JointKind::Axes, usize::MAX),
    ("distance", JointKind::Distance, 0),
];

const LETTERS: [&str; 3] = ["x", "y", "z"];

/// A motion with the letter of its axis, if it has one.
type Motion = (AxisMotion, Option<usize>);

impl<'a> Checker<'a> {
    /// Kind and axes of a declared joint.
    pub fn joint_freedom(&mut self, index: usize) -> Option<JointFreedom> {
        let declared = &self.declared.joints[index];
        let word = declared.kind;
        let Some(&(_, kind, count)) = KINDS.iter().find(|(name, ..)| *name == word.text) else {
            let names = KINDS.map(|(name, ..)| name);
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no joint kind `{}`", word.text))
                .label(word.span, "not known")
                .suggest(similar_name(&word.text, names))
                .note(format!("kinds: {}", names.join(", ")));
            return self.fail(diagnostic, SCOPE);
        };
        self.check_axis_count(index, count)?;
        let mut directions = Vec::new();
        for axis in declared.axes {
            let letter = match &axis.direction.kind {
                DirectionKind::Axis { axis, .. } => Some(*axis),
                _ => None,
            };
            directions.push((self.direction(&axis.direction)?, letter));
        }
        let motions = match kind {
            JointKind::Axes => self.listed_motions(index, &directions)?,
            _ => motions(kind, &directions),
        };
        self.check_distinct(index, kind, &motions)?;
        let name = &declared.name.text;
        let has_rotation = matches!(kind, JointKind::Spherical | JointKind::Free);
        let is_single = motions.len() == 1 && !has_rotation;
        let axes = motions
            .iter()
            .enumerate()
            .map(|(at, motion)| {
                // The second turn about one letter (Euler angles) is counted.
                let is_repeated = motions[..at].iter().any(|before| axis_name(before, 0) == axis_name(motion, 0));
                let motion_name = if is_repeated { axis_name(&(motion.0, None), at) } else { axis_name(motion, at) };
                let name = if is_single { name.clone() } else { format!("{name}.{motion_name}") };
                AxisEntry { symbols: self.axis_symbols(&name), motion: motion.0, name }
            })
            .collect();
        let rotation = has_rotation.then(|| self.rotation_symbols(name));
        let is_turned = find(declared.fields, "orientation").is_some();
        Some(JointFreedom { kind, axes, rotation, is_turned })
    }

    fn check_axis_count(&mut self, index: usize, count: usize) -> Option<()> {
        let declared = &self.declared.joints[index];
        let (given, kind) = (declared.axes.len(), declared.kind);
        let article = if kind.text == "universal" { "a" } else { super::names::article(&kind.text) };
        let diagnostic = match (count, given) {
            (usize::MAX, 1..) => return Some(()),
            (usize::MAX, _) => Diagnostic::error(Code::AXIS, "`axes` lists the motions that the joint leaves free")
                .label(kind.span, "no motion listed")
                .help("write e.g. `axes(shift y, turn z)`"),
            _ if count == given => return Some(()),
            (0, _) => {
                let span = declared.axes.first().map_or(kind.span, |axis| axis.direction.span);
                Diagnostic::error(Code::AXIS, format!("{article} {} joint has no axis", kind.text))
                    .label(span, "remove it")
            }
            (1, 0) => Diagnostic::error(Code::AXIS, format!("{article} {} joint needs an axis", kind.text))
                .label(kind.span, "no axis given")
                .help(format!("write e.g. `{}(z)`", kind.text)),
            (1, _) => Diagnostic::error(Code::AXIS, format!("{article} {} joint has one axis", kind.text))
                .label(declared.axes[1].direction.span, "one too many")
                .help("`universal(x, z)` has two axes; `axes(shift y, turn z)` any combination"),
            _ => Diagnostic::error(Code::AXIS, format!("{article} {} joint has two axes", kind.text))
                .label(kind.span, format!("{given} given"))
                .help("write e.g. `universal(x, z)`: the first is fixed to the parent, the second to the child"),
        };
        self.fail(diagnostic, SCOPE)
    }

    /// `axes(shift y, turn z)`
    fn listed_motions(&mut self, index: usize, directions: &[([f64; 3], Option<usize>)]) -> Option<Vec<Motion>> {
        let declared = &self.declared.joints[index];
        let mut motions = Vec::new();
        for (axis, &(direction, letter)) in declared.axes.iter().zip(directions) {
            let motion = match axis.motion.as_ref().map(|word| word.text.as_str()) {
                Some("shift") => AxisMotion::Shift(direction),
                Some(_) => AxisMotion::Turn(direction),
                None => {
                    let diagnostic = Diagnostic::error(Code::AXIS, "the motion along or about this axis is not named")
                        .label(axis.direction.span, "shift or turn?")
                        .help("write e.g. `axes(shift y, turn z)`");
                    return self.fail(diagnostic, SCOPE);
                }
            };
            motions.push((motion, letter));
        }
        Some(motions)
    }

    /// Two motions about or along the same axis are one freedom.
    fn check_distinct(&mut self, index: usize, kind: JointKind, motions: &[Motion]) -> Option<()> {
        let declared = &self.declared.joints[index];
        if kind != JointKind::Axes
            && let Some(word) = declared.axes.iter().find_map(|axis| axis.motion.as_ref())
        {
            let message = format!("`{}` says by itself what its axes do", declared.kind.text);
            let diagnostic = Diagnostic::error(Code::AXIS, message)
                .label(word.span, "not needed here")
                .help("only `axes(shift y, turn z)` lists motions");
            return self.fail(diagnostic, SCOPE);
        }
        for (at, (motion, _)) in motions.iter().enumerate() {
            let same = |other: &Motion| {
                other.0.motion() == motion.motion() && is_parallel(other.0.direction(), motion.direction())
            };
            // Turns about one axis with another turn between them are different freedoms (Euler angles).
            let before = &motions[..at];
            // So are shifts along one axis, unless the turns between them leave that axis where it is.
            let turns_away = |other: &Motion| {
                matches!(other.0, AxisMotion::Turn(_)) && !is_parallel(other.0.direction(), motion.direction())
            };
            let is_repeated = match motion {
                AxisMotion::Shift(_) => before.iter().rev().take_while(|other| !turns_away(other)).any(same),
                AxisMotion::Turn(_) => {
                    before.iter().rev().find(|other| matches!(other.0, AxisMotion::Turn(_))).is_some_and(same)
                }
            };
            if is_repeated {
                let span =
                    declared.axes.get(at).or(declared.axes.last()).map_or(declared.kind.span, |a| a.direction.span);
                let diagnostic = Diagnostic::error(Code::AXIS, "two axes of the joint are parallel")
                    .label(span, "the same freedom twice")
                    .help("remove one; with a turn about another axis between them they are two freedoms");
                return self.fail(diagnostic, SCOPE);
            }
        }
        Some(())
    }

    fn axis_symbols(&mut self, name: &str) -> JointSymbols {
        let mut symbol = |quantity: &str| self.graph.symbol(&format!("{name}.{quantity}"));
        JointSymbols {
            position: symbol("position"),
            velocity: symbol("velocity"),
            acceleration: symbol("acceleration"),
            inertia: symbol("inertia"),
        }
    }

    fn rotation_symbols(&mut self, name: &str) -> RotationSymbols {
        let mut symbol = |quantity: &str, part: &str| self.graph.symbol(&format!("{name}.{quantity}.{part}"));
        RotationSymbols {
            quaternion: ["w", "x", "y", "z"].map(|part| symbol("quaternion", part)),
            velocity: LETTERS.map(|part| symbol("angular_velocity", part)),
            acceleration: LETTERS.map(|part| symbol("angular_acceleration", part)),
        }
    }

    /// A direction as unit vector in ground (or parent) axes.
    pub fn direction(&mut self, direction: &'a Direction) -> Option<[f64; 3]> {
        let vector = match &direction.kind {
            DirectionKind::Axis { axis, negative } => return Some(unit_vector(*axis, *negative)),
            DirectionKind::OfBody { path, .. } => {
                let label = if path.text.contains('.') { "an axis of a body" } else { "not a direction" };
                let diagnostic = Diagnostic::error(Code::AXIS, "a direction fixed in space is needed here")
                    .label(path.span, label)
                    .help("write `x`, `y`, `z`, or three numbers");
                return self.fail(diagnostic, SCOPE);
            }
            DirectionKind::Vector(vector) => vector,
        };
        if let [Expression { kind: ExpressionKind::Path(name), span }] = vector.as_slice() {
            let diagnostic = Diagnostic::error(Code::AXIS, format!("`{}` is no axis", name.text))
                .label(*span, "not known as a direction")
                .suggest(LETTERS.into_iter().find(|letter| letter.eq_ignore_ascii_case(&name.text)))
                .help("an axis is `x`, `y`, `z`, `-z`, or three numbers: `0, 0.6, 0.8`");
            return self.fail(diagnostic, SCOPE);
        }
        let what = (direction.span, "a direction has");
        let values: Vec<Option<f64>> =
            vector.iter().map(|component| self.fixed_number(component, None, Dimension::ONE, what)).collect();
        let values: Vec<f64> = values.into_iter().collect::<Option<_>>()?;
        let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        match values.as_slice() {
            [x, y, z] if length > 0.0 && length.is_finite() => Some([x / length, y / length, z / length]),
            _ => {
                let diagnostic =
                    Diagnostic::error(Code::AXIS, "a direction is `x`, `y`, `z`, or three numbers not all zero")
                        .label(direction.span, "not a direction");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    /// Child axes to parent axes in the reference configuration, where the joint states it: `orientation = (90 deg, 0
    /// deg, 0 deg)` turns about x, then about the turned y, then about the turned z.
    pub fn joint_orientation(&mut self, joint: usize) -> Option<[[Node; 3]; 3]> {
        if let Some(known) = self.orientations.get(&joint) {
            return *known;
        }
        let declared = &self.declared.joints[joint];
        let name = &declared.name.text;
        let matrix = find(declared.fields, "orientation").and_then(|field| {
            let Value::Tuple(components, _) = &field.value else {
                return self.wrong_value(field, "three angles `(90 deg, 0 deg, 0 deg)` about x, y and z");
            };
            if components.len() != 3 {
                return self.wrong_value(field, "three angles `(90 deg, 0 deg, 0 deg)` about x, y and z");
            }
            let angles = self.tuple(&format!("{name}.orientation"), components, &LETTERS, Dimension::ONE, field)?;
            let mut matrix = vector::identity(&mut self.graph);
            for (axis, angle) in angles.iter().enumerate() {
                let turn = {
                    let axis = vector::constant(&mut self.graph, unit_vector(axis, false));
                    vector::rotation(&mut self.graph, axis, angle.node)
                };
                matrix = vector::multiply(&mut self.graph, matrix, turn);
            }
            Some(matrix)
        });
        self.orientations.insert(joint, matrix);
        matrix
    }

    /// The joints, inner ones before outer ones.
    pub fn finished_joints(&mut self) -> Vec<Joint> {
        let mut joints = Vec::new();
        for index in self.topology.order.clone() {
            let Some(read) = self.topology.joint(index).cloned() else { continue };
            let (parent, child) = (self.attachment(read.parent), self.attachment(read.child));
            let declared = &self.declared.joints[index];
            let mut prescribed = self.prescribed_motions(index, &read.freedom);
            let axes = read
                .freedom
                .axes
                .into_iter()
                .enumerate()
                .map(|(at, axis)| JointAxis {
                    name: axis.name,
                    motion: axis.motion,
                    symbols: axis.symbols,
                    prescribed: prescribed.get_mut(at).and_then(Option::take),
                })
                .collect();
            let length = if read.freedom.kind == JointKind::Distance { self.rod_length(index) } else { None };
            joints.push(Joint {
                name: declared.name.text.clone(),
                kind: read.freedom.kind,
                parent,
                child,
                orientation: self.joint_orientation(index),
                axes,
                rotation: read.freedom.rotation,
                length,
                closes_loop: self.topology.closes_loop[index],
                span: declared.name.span,
            });
        }
        joints
    }

    fn rod_length(&mut self, joint: usize) -> Option<Node> {
        let declared = &self.declared.joints[joint];
        let Some(field) = find(declared.fields, "length") else {
            let diagnostic =
                Diagnostic::error(Code::MISSING_FIELD, format!("rod `{}` has no length", declared.name.text))
                    .label(declared.name.span, "`length` is missing")
                    .help("add `{ length = 1 m }`");
            return self.fail(diagnostic, SCOPE);
        };
        let expression = self.field_expression(field)?;
        let path = format!("{}.length", declared.name.text);
        let value = self.field_value(&path, expression, Allowed::Constant)?;
        let value = self.expect(value, expression.span, Dimension::LENGTH, (field.key.span, "`length`"), SCOPE)?;
        match self.graph.constant_value(value.node) {
            Some(number) if number <= 0.0 => {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "the length of a rod must be positive")
                    .label(expression.span, "not above zero")
                    .help("points that coincide are joined by a `spherical` joint");
                self.fail(diagnostic, SCOPE)
            }
            _ => Some(value.node),
        }
    }

    /// `motion = 2 rad/s * t`, or per axis `motion = { turn_z = .. }`.
    fn prescribed_motions(&mut self, joint: usize, freedom: &JointFreedom) -> Vec<Option<Node>> {
        let mut result = vec![None; freedom.axes.len()];
        let declared = &self.declared.joints[joint];
        let Some(field) = find(declared.fields, "motion") else { return result };
        if freedom.axes.is_empty() {
            let message = format!("joint `{}` has no axis whose motion could be prescribed", declared.name.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message).label(field.key.span, "no axis");
            self.report(diagnostic, SCOPE);
            return result;
        }
        let prefix = format!("{}.", declared.name.text);
        match &field.value {
            Value::Expression(_) if freedom.axes.len() == 1 => {
                result[0] = self.prescribed_motion(field, &freedom.axes[0]);
            }
            Value::Block { word: None, fields, .. } if freedom.axes.len() > 1 => {
                for inner in fields {
                    let path = format!("{prefix}{}", inner.key.text);
                    match freedom.axes.iter().position(|axis| axis.name == path) {
                        Some(at) => result[at] = self.prescribed_motion(inner, &freedom.axes[at]),
                        None => {
                            let names: Vec<&str> =
                                freedom.axes.iter().filter_map(|axis| axis.name.strip_prefix(&prefix)).collect();
                            let message = format!("joint `{}` has no axis `{}`", declared.name.text, inner.key.text);
                            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
                                .label(inner.key.span, "not an axis")
                                .suggest(similar_name(&inner.key.text, names.iter().copied()))
                                .note(format!("axes: {}", names.join(", ")));
                            self.report(diagnostic, SCOPE);
                        }
                    }
                }
            }
            _ => {
                let expected = if freedom.axes.len() == 1 {
                    "an expression of time, e.g. `motion = 2 * t`"
                } else {
                    "one expression per axis, e.g. `motion = { turn_z = 2 * t }`"
                };
                let _: Option<()> = self.wrong_value(field, expected);
            }
        }
        result
    }

    fn prescribed_motion(&mut self, field: &'a Field, axis: &AxisEntry) -> Option<Node> {
        let expression = self.field_expression(field)?;
        let scope = Scope::Study(Allowed::Motion);
        let value = self.evaluate(expression, scope)?;
        let wanted = super::kinds::coordinate_dimension(axis.motion.motion());
        let value = self.expect(value, expression.span, wanted, (field.key.span, "the coordinate has"), scope)?;
        let moving = self.graph.symbols_of(&[value.node]);
        let foreign = moving.into_iter().find(|symbol| *symbol != self.time && !self.is_parameter(*symbol));
        if let Some(symbol) = foreign {
            let message = format!("the motion of `{}` depends on `{}`", axis.name, self.graph.symbol_name(symbol));
            let diagnostic = Diagnostic::error(Code::NOT_CONSTANT, message)
                .label(value_span(field), "follows from the motion of the mechanism")
                .help(
                    "a prescribed motion is a function of time, inputs and parameters; an actuator with a law reacts",
                );
            return self.fail(diagnostic, scope);
        }
        Some(value.node)
    }

    /// Whether an axis has a prescribed motion.
    pub fn is_prescribed(&self, joint: usize, axis: usize) -> bool {
        let declared = &self.declared.joints[joint];
        let Some(read) = self.topology.joint(joint) else { return false };
        let Some(field) = find(declared.fields, "motion") else { return false };
        match &field.value {
            Value::Block { fields, .. } => {
                let name = read.freedom.axes.get(axis).map(|axis| axis.name.as_str()).unwrap_or_default();
                fields.iter().any(|inner| name == format!("{}.{}", declared.name.text, inner.key.text))
            }
            _ => true,
        }
    }
}

fn unit_vector(axis: usize, negative: bool) -> [f64; 3] {
    std::array::from_fn(|i| match (i == axis, negative) {
        (true, false) => 1.0,
        (true, true) => -1.0,
        _ => 0.0,
    })
}

/// The motions of the kinds whose axes are plain directions.
fn motions(kind: JointKind, directions: &[([f64; 3], Option<usize>)]) -> Vec<Motion> {
    let turn = |(direction, letter): ([f64; 3], Option<usize>)| (AxisMotion::Turn(direction), letter);
    let shift = |(direction, letter): ([f64; 3], Option<usize>)| (AxisMotion::Shift(direction), letter);
    let axis = |index: usize| (unit_vector(index, false), Some(index));
    match (kind, directions) {
        (JointKind::Prismatic, &[a]) => vec![shift(a)],
        (JointKind::Revolute, &[a]) => vec![turn(a)],
        (JointKind::Cylindrical, &[a]) => vec![shift(a), turn(a)],
        (JointKind::Universal, &[a, b]) => vec![turn(a), turn(b)],
        (JointKind::Planar, &[(normal, Some(letter))]) => {
            vec![shift(axis((letter + 1) % 3)), shift(axis((letter + 2) % 3)), turn((normal, Some(letter)))]
        }
        (JointKind::Planar, &[(normal, None)]) => {
            let [first, second] = vector::perpendicular(normal);
            vec![shift((first, None)), shift((second, None)), turn((normal, None))]
        }
        (JointKind::Free, _) => (0..3).map(|index| shift(axis(index))).collect(),
        _ => Vec::new(),
    }
}

/// `shift_y`, or `shift_2` where the direction is no coordinate axis.
fn axis_name((motion, letter): &Motion, at: usize) -> String {
    let word = match motion {
        AxisMotion::Shift(_) => "shift",
        AxisMotion::Turn(_) => "turn",
    };
    match letter {
        Some(letter) => format!("{word}_{}", LETTERS[*letter]),
        None => format!("{word}_{}", at + 1),
    }
}
