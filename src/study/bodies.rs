//! Masses, inertias and points of bodies.

use super::checker::{Allowed, Checker, Key, Scope};
use super::declarations::Declarations;
use super::evaluate::{Typed, literal};
use super::fields::{find, value_span};
use super::identify::written_unit;
use super::model::{Attachment, AxisMotion, Body, Point};
use super::topology::End;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Node, Operation, vector};
use crate::quantities::Dimension;
use crate::syntax::{Expression, Field, Value};

const SCOPE: Scope = Scope::Study(Allowed::Constant);
const AXES: [&str; 3] = ["x", "y", "z"];
const TENSOR: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

impl<'a> Checker<'a> {
    /// Reads all bodies and the points of ground; masses may refer to each other, points may not.
    pub fn read_bodies(&mut self) {
        let declared: &'a Declarations<'a> = self.declared;
        if let Some(ground) = &declared.ground {
            self.known_fields("`ground`", ground.fields, &[]);
            self.ground_points = self.points("ground", ground.points);
        }
        for (index, body) in declared.bodies.iter().enumerate() {
            let name = &body.name.text;
            let known =
                ["mass", "centre_of_gravity", "inertia", "modes", "frequency_scale", "damping_ratio", "mode_count"];
            self.known_fields(&format!("body `{name}`"), body.fields, &known);
            let zero = self.graph.constant(0.0);
            let centre_of_gravity = match find(body.fields, "centre_of_gravity") {
                Some(field) => self.vector(&format!("{name}.centre_of_gravity"), field).unwrap_or([zero; 3]),
                None => AXES.map(|axis| {
                    // Not written it is zero, but may be identified all the same.
                    let freed = self.parameter(&format!("{name}.centre_of_gravity.{axis}"));
                    freed.filter(|value| value.dimension == Dimension::LENGTH).map_or(zero, |value| value.node)
                }),
            };
            let points = self.points(name, body.points);
            let span = body.name.span;
            let inertia = [zero; 6];
            let elastic = self.elastic(index, &points);
            self.bodies.push(Body {
                name: name.clone(),
                mass: zero,
                centre_of_gravity,
                inertia,
                points,
                elastic,
                span,
            });
        }
        for index in 0..declared.bodies.len() {
            // A mass that could not be found is not zero.
            self.bodies[index].mass = match self.body_mass(index) {
                Some(mass) => mass.node,
                None => self.graph.constant(f64::NAN),
            };
            if let Some(inertia) = self.body_inertia(index) {
                if let Some(field) = find(declared.bodies[index].fields, "inertia") {
                    self.check_inertia(&inertia, &declared.bodies[index].name.text, value_span(field));
                }
                self.bodies[index].inertia = inertia;
            }
        }
        self.check_moving_masses();
    }

    /// The mass of a body; it must be stated.
    pub fn body_mass(&mut self, index: usize) -> Option<Typed> {
        let declared: &'a Declarations<'a> = self.declared;
        let body = &declared.bodies[index];
        self.once(Key::Mass(index), body.name.span, |checker| {
            let Some(field) = find(body.fields, "mass") else {
                let diagnostic =
                    Diagnostic::error(Code::MISSING_FIELD, format!("body `{}` has no mass", body.name.text))
                        .label(body.name.span, "`mass` is missing")
                        .help("add `mass = .. kg`");
                return checker.fail(diagnostic, SCOPE);
            };
            let expression = checker.field_expression(field)?;
            let value = checker.field_value(&format!("{}.mass", body.name.text), expression, Allowed::Constant)?;
            let value = checker.expect(value, expression.span, Dimension::MASS, (field.key.span, "`mass`"), SCOPE)?;
            checker.not_negative(value, expression.span, "a mass")?;
            checker.stays_positive(value, "mass", &body.name.text);
            Some(value)
        })
    }

    /// An identified mass must not reach zero: nothing would be left to accelerate.
    fn stays_positive(&mut self, value: Typed, what: &str, body: &str) {
        let Operation::Symbol(symbol) = self.graph.operation(value.node) else { return };
        let Some(parameter) = self.parameters.iter().find(|parameter| parameter.symbol == symbol) else { return };
        if parameter.lower > 0.0 {
            return;
        }
        let message = format!("the {what} of `{body}` can become {}", parameter.unit.format(parameter.lower, 3));
        let diagnostic = Diagnostic::warning(Code::REACHES_ZERO, message)
            .label(parameter.span, "its lower bound is not above zero")
            .help("raise the lower bound to the smallest value that makes sense");
        self.report(diagnostic, SCOPE);
    }

    /// No distribution of mass has these moments: each principal one is at most the sum of the other two.
    fn check_inertia(&mut self, inertia: &[Node; 6], body: &str, span: Span) {
        let values = inertia.map(|node| self.graph.constant_value(node));
        let [Some(xx), Some(yy), Some(zz), Some(xy), Some(xz), Some(yz)] = values else { return };
        // With half the trace less the tensor, all principal minors must not be negative.
        let half = 0.5 * (xx + yy + zz);
        let (a, b, c) = (half - xx, half - yy, half - zz);
        let is_possible = |sign: f64| {
            let minors = [a, b, c, a * b - xy * xy, a * c - xz * xz, b * c - yz * yz];
            let products = 2.0 * sign * xy * xz * yz;
            let determinant = a * b * c + products - a * yz * yz - b * xz * xz - c * xy * xy;
            let small = -1e-6 * half.abs();
            minors[..3].iter().all(|minor| *minor >= small)
                && minors[3..].iter().all(|minor| *minor >= small * half)
                && determinant >= small * half * half
        };
        // Products of inertia are written with either sign.
        if is_possible(1.0) || is_possible(-1.0) {
            return;
        }
        let diagnostic =
            Diagnostic::warning(Code::IMPOSSIBLE_INERTIA, format!("no body has the moments of inertia of `{body}`"))
                .label(span, "one of them is larger than the sum of the others")
                .help("check units and order `(Ixx, Iyy, Izz, Ixy, Ixz, Iyz)`; in a plane, one number about the joint's axis suffices");
        self.report(diagnostic, SCOPE);
    }

    fn not_negative(&mut self, value: Typed, span: Span, what: &str) -> Option<()> {
        match self.graph.constant_value(value.node) {
            Some(number) if number < 0.0 || !number.is_finite() => {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("{what} cannot be negative"))
                    .label(span, "below zero");
                self.fail(diagnostic, SCOPE)
            }
            _ => Some(()),
        }
    }

    /// Inertia as xx, yy, zz, xy, xz, yz; one number counts for all three axes. Needed where a joint turns the body.
    fn body_inertia(&mut self, index: usize) -> Option<[Node; 6]> {
        let declared: &'a Declarations<'a> = self.declared;
        let body = &declared.bodies[index];
        let name = &body.name.text;
        let zero = self.graph.constant(0.0);
        let Some(field) = find(body.fields, "inertia") else {
            if self.topology.turns(index) {
                let diagnostic =
                    Diagnostic::error(Code::MISSING_INERTIA, format!("body `{name}` can turn but has no inertia"))
                        .label(body.name.span, "`inertia` is missing")
                        .help("add `inertia = .. kg*m^2` about its centre of gravity; `0 kg*m^2` for a point mass");
                return self.fail(diagnostic, SCOPE);
            }
            return None;
        };
        let path = format!("{name}.inertia");
        let values = match &field.value {
            Value::Expression(expression) => {
                let value = self.component(&path, expression, None, Dimension::INERTIA, field)?;
                self.not_negative(value, expression.span, "a moment of inertia")?;
                return Some([value.node, value.node, value.node, zero, zero, zero]);
            }
            Value::Tuple(components, _) if components.len() == 3 || components.len() == 6 => {
                self.tuple(&path, components, &TENSOR, Dimension::INERTIA, field)?
            }
            _ => return self.wrong_value(field, "one number, `(Ixx, Iyy, Izz)` or `(Ixx, Iyy, Izz, Ixy, Ixz, Iyz)`"),
        };
        let mut inertia = [zero; 6];
        inertia.iter_mut().zip(values).for_each(|(slot, value)| *slot = value.node);
        Some(inertia)
    }

    fn points(&mut self, owner: &str, fields: &'a [Field]) -> Vec<Point> {
        let zero = self.graph.constant(0.0);
        let mut points: Vec<Point> = Vec::new();
        for field in fields {
            let name = field.key.text.clone();
            let reserved = ["position", "velocity", "acceleration", "mass", "centre_of_gravity"];
            if points.iter().any(|point| point.name == name) || reserved.contains(&name.as_str()) {
                let message = format!("the point name `{name}` is taken");
                let diagnostic =
                    Diagnostic::error(Code::DUPLICATE_NAME, message).label(field.key.span, "choose another name");
                self.report(diagnostic, SCOPE);
            }
            let position = self.vector(&format!("{owner}.{name}"), field).unwrap_or([zero; 3]);
            points.push(Point { name, position });
        }
        points
    }

    fn vector(&mut self, path: &str, field: &'a Field) -> Option<[Node; 3]> {
        let Value::Tuple(components, _) = &field.value else {
            return self.wrong_value(field, "three lengths `(x, y, z)`");
        };
        if components.len() != 3 {
            return self.wrong_value(field, "three lengths `(x, y, z)`");
        }
        let values = self.tuple(path, components, &AXES, Dimension::LENGTH, field)?;
        match values.as_slice() {
            [x, y, z] => Some([x.node, y.node, z.node]),
            _ => None,
        }
    }

    /// Components in brackets; a bare number takes the unit of the next one that has a unit, else of the one before.
    pub fn tuple(
        &mut self,
        path: &str,
        components: &'a [Expression],
        names: &[&str],
        wanted: Dimension,
        field: &'a Field,
    ) -> Option<Vec<Typed>> {
        let unit_near = |index: usize| {
            let after = components.iter().skip(index).find_map(written_unit);
            after.or_else(|| components.iter().take(index).rev().find_map(written_unit))
        };
        let values: Vec<Option<Typed>> = components
            .iter()
            .zip(names)
            .enumerate()
            .map(|(index, (component, name))| {
                self.component(&format!("{path}.{name}"), component, unit_near(index), wanted, field)
            })
            .collect();
        values.into_iter().collect()
    }

    fn component(
        &mut self,
        path: &str,
        expression: &'a Expression,
        hint: Option<&'a crate::syntax::Name>,
        wanted: Dimension,
        field: &'a Field,
    ) -> Option<Typed> {
        let is_bare = matches!(literal(expression), Some((_, None)));
        let value = if is_bare && hint.is_some() && !self.parameter_index.contains_key(path) {
            let value = self.number_with(expression, hint)?;
            // A zero says that something is not there; freeing it would change the structure.
            if !self.graph.is_zero(value.node) {
                self.note_constant(path, expression, hint);
            }
            value
        } else {
            self.field_value(path, expression, Allowed::Constant)?
        };
        let because = format!("`{}`", field.key.text);
        self.expect(value, expression.span, wanted, (field.key.span, &because), SCOPE)
    }

    /// What a joint moves must have inertia against that motion.
    fn check_moving_masses(&mut self) {
        let mut moved_by: Vec<Vec<usize>> = vec![Vec::new(); self.topology.joints.len()];
        for body in 0..self.bodies.len() {
            self.topology.chain(Some(body)).into_iter().for_each(|joint| moved_by[joint].push(body));
        }
        for (joint, moved) in moved_by.iter().enumerate() {
            let Some(read) = self.topology.joint(joint).filter(|_| !self.topology.closes_loop[joint]) else { continue };
            let (child, freedom) = (read.child, &read.freedom);
            // A part without connection to ground is reported elsewhere.
            if moved.is_empty() {
                continue;
            }
            let is_weightless = |body: &usize| self.graph.is_zero(self.bodies[*body].mass);
            let has_no_inertia = |body: &usize| self.bodies[*body].inertia.iter().all(|part| self.graph.is_zero(*part));
            let moves_freely = |at: usize| !self.topology.closes_loop[joint] && !self.is_prescribed(joint, at);
            let mut free = freedom.axes.iter().enumerate().filter(|(at, _)| moves_freely(*at)).map(|(_, axis)| axis);
            let shifts = free.clone().any(|axis| matches!(axis.motion, AxisMotion::Shift(_)));
            let turns = freedom.rotation.is_some() || free.any(|axis| matches!(axis.motion, AxisMotion::Turn(_)));
            let without = (shifts && moved.iter().all(is_weightless))
                || (turns && moved.iter().all(|body| is_weightless(body) && has_no_inertia(body)));
            let body = child.body.map(|index| &self.declared.bodies[index]);
            if let Some(body) = body.filter(|body| without && find(body.fields, "mass").is_some()) {
                let name = &self.declared.joints[joint].name;
                let message = format!("joint `{}` moves nothing that has inertia", name.text);
                let span = find(body.fields, "mass").map_or(body.name.span, value_span);
                let diagnostic = Diagnostic::error(Code::NO_INERTIA, message)
                    .label(span, "the mass is zero")
                    .secondary(name.span, "moves this body")
                    .help("give the body a mass, or fix it to its neighbour");
                self.report(diagnostic, SCOPE);
            }
        }
    }

    /// Position of a point (`None`: the origin) in body axes.
    pub fn point_of(&mut self, body: usize, point: Option<&str>) -> Option<[Node; 3]> {
        let zero = self.graph.constant(0.0);
        match point {
            None => Some([zero; 3]),
            Some("centre_of_gravity") => self.bodies.get(body).map(|body| body.centre_of_gravity),
            Some(name) => {
                let points = &self.bodies.get(body)?.points;
                points.iter().find(|point| point.name == name).map(|point| point.position)
            }
        }
    }

    pub fn attachment(&mut self, end: End<'a>) -> Attachment {
        let zero = self.graph.constant(0.0);
        let position = match (end.body, end.point) {
            (Some(body), point) => self.point_of(body, point),
            (None, Some(name)) => {
                self.ground_points.iter().find(|point| point.name == name).map(|point| point.position)
            }
            (None, None) => None,
        };
        let frame = end.body.and_then(|body| self.frame_of(body, end.point, end.span));
        Attachment { body: end.body, position: position.unwrap_or([zero; 3]), frame }
    }

    /// Position of an attachment in ground axes in the reference configuration.
    pub fn reference_position(&mut self, attachment: Attachment) -> [Node; 3] {
        let mut position = attachment.position;
        let mut body = attachment.body;
        for joint in self.topology.chain(attachment.body) {
            let Some(read) = self.topology.joint(joint) else { continue };
            let (far, near) = read.seen_from(body);
            let is_parent = read.parent.body == body;
            body = near.body;
            let (near, far) = (self.attachment(near), self.attachment(far));
            let orientation = self.joint_orientation(joint);
            let graph = &mut self.graph;
            let from_joint = vector::subtract(graph, position, far.position);
            let turned = match orientation {
                None => from_joint,
                Some(matrix) if is_parent => vector::apply_transposed(graph, matrix, from_joint),
                Some(matrix) => vector::apply(graph, matrix, from_joint),
            };
            position = vector::add(graph, turned, near.position);
        }
        position
    }
}
