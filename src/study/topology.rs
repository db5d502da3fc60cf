//! Bodies and joints: a tree that starts at ground.

use super::checker::{Allowed, Checker, Scope};
use super::model::{JointKind, JointSymbols, Motion};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::quantities::Dimension;
use crate::syntax::{Direction, DirectionKind, Name};

const SCOPE: Scope = Scope::Study(Allowed::Number);

/// An attachment as written: body index (`None`: ground) and point name.
#[derive(Clone, Copy, Debug)]
pub(super) struct End<'a> {
    pub body: Option<usize>,
    pub point: Option<&'a str>,
}

/// Per declared joint its kind and ends (`None` after an error), per body the joint that carries it, and the joints
/// ordered so that parents come before children.
#[derive(Default)]
pub(super) struct Topology<'a> {
    pub joints: Vec<Option<(JointKind, End<'a>, End<'a>)>>,
    pub carrier: Vec<Option<usize>>,
    pub order: Vec<usize>,
}

impl Topology<'_> {
    /// Joints from a body down to ground. Ends early where the tree is broken.
    pub fn chain(&self, body: Option<usize>) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut current = body;
        while let Some(joint) = current.and_then(|body| self.carrier.get(body).copied().flatten()) {
            if chain.contains(&joint) {
                break;
            }
            chain.push(joint);
            current = self.joints.get(joint).and_then(Option::as_ref).and_then(|(_, parent, _)| parent.body);
        }
        chain
    }

    pub fn kind(&self, joint: usize) -> Option<JointKind> {
        self.joints.get(joint)?.as_ref().map(|(kind, ..)| *kind)
    }

    /// Whether a revolute joint turns this body.
    pub fn turns(&self, body: usize) -> bool {
        self.chain(Some(body)).into_iter().any(|joint| matches!(self.kind(joint), Some(JointKind::Revolute { .. })))
    }

    /// The axis along which two bodies can only shift against each other, if there is one: no joint turns them, and
    /// the joints between them share one direction.
    pub fn common_axis(&self, first: Option<usize>, second: Option<usize>) -> Option<[f64; 3]> {
        let (a, b) = (self.chain(first), self.chain(second));
        let turns = |joint: &usize| matches!(self.kind(*joint), Some(JointKind::Revolute { .. }) | None);
        if a.iter().chain(&b).any(turns) {
            return None;
        }
        let mut axis: Option<[f64; 3]> = None;
        let own_of_second = b.iter().filter(|joint| !a.contains(joint));
        for joint in own_of_second.chain(a.iter().filter(|joint| !b.contains(joint))) {
            if let Some(JointKind::Prismatic { axis: own }) = self.kind(*joint) {
                match axis {
                    None => axis = Some(own),
                    Some(known) if is_parallel(known, own) => {}
                    Some(_) => return None,
                }
            }
        }
        axis
    }
}

fn is_parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    (cosine.abs() - 1.0).abs() < 1e-12
}

impl<'a> Checker<'a> {
    /// Reads all joints and checks that they form a tree on ground.
    pub fn read_topology(&mut self) {
        for joint in &self.declared.joints {
            let owner = format!("joint `{}`", joint.name.text);
            self.known_fields(&owner, joint.fields, &[]);
            let kind = self.joint_kind(joint.kind, joint.axis);
            let (parent, child) = (self.end(joint.parent), self.end(joint.child));
            self.topology.joints.push(match (kind, parent, child) {
                (Some(kind), Some(parent), Some(child)) => Some((kind, parent, child)),
                _ => None,
            });
            let motion = match kind {
                Some(JointKind::Prismatic { .. }) => Some(Motion::Translational),
                Some(JointKind::Revolute { .. }) => Some(Motion::Rotational),
                Some(JointKind::Fixed) | None => None,
            };
            let symbols = motion.map(|motion| (self.joint_symbols_of(&joint.name.text), motion));
            self.joint_symbols.push(symbols);
        }
        self.find_carriers();
        self.check_connected();
        self.order_joints();
    }

    fn joint_symbols_of(&mut self, name: &str) -> JointSymbols {
        let mut symbol = |quantity: &str| self.graph.symbol(&format!("{name}.{quantity}"));
        let symbols = JointSymbols {
            position: symbol("position"),
            velocity: symbol("velocity"),
            acceleration: symbol("acceleration"),
            inertia: symbol("inertia"),
        };
        self.accelerations.insert(symbols.acceleration);
        symbols
    }

    fn joint_kind(&mut self, kind: &'a Name, axis: Option<&'a Direction>) -> Option<JointKind> {
        const KINDS: [&str; 3] = ["prismatic", "revolute", "fixed"];
        if !KINDS.contains(&kind.text.as_str()) {
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no joint kind `{}`", kind.text))
                .label(kind.span, "not known")
                .suggest(similar_name(&kind.text, KINDS))
                .note(format!("kinds: {}", KINDS.join(", ")));
            return self.fail(diagnostic, SCOPE);
        }
        match (kind.text.as_str(), axis) {
            ("fixed", None) => Some(JointKind::Fixed),
            ("fixed", Some(axis)) => {
                let diagnostic =
                    Diagnostic::error(Code::AXIS, "a fixed joint has no axis").label(axis.span, "remove it");
                self.fail(diagnostic, SCOPE)
            }
            (_, None) => {
                let diagnostic = Diagnostic::error(Code::AXIS, format!("a {} joint needs an axis", kind.text))
                    .label(kind.span, "no axis given")
                    .help(format!("write e.g. `{}(z)`", kind.text));
                self.fail(diagnostic, SCOPE)
            }
            (name, Some(axis)) => {
                let axis = self.direction(axis)?;
                Some(if name == "prismatic" { JointKind::Prismatic { axis } } else { JointKind::Revolute { axis } })
            }
        }
    }

    /// A direction as unit vector.
    pub fn direction(&mut self, direction: &'a Direction) -> Option<[f64; 3]> {
        let vector = match &direction.kind {
            DirectionKind::Axis { axis, negative } => {
                let mut vector = [0.0; 3];
                *vector.get_mut(*axis)? = if *negative { -1.0 } else { 1.0 };
                return Some(vector);
            }
            DirectionKind::Vector(vector) => vector,
        };
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

    /// `ground`, `BODY`, `BODY.POINT`, `ground.POINT`.
    pub fn end(&mut self, name: &'a Name) -> Option<End<'a>> {
        let (first, point) = self.split_path(&name.text);
        let bodies = &self.declared.bodies;
        let body = bodies.iter().position(|body| body.name.text == first);
        if first != "ground" && body.is_none() {
            let names = bodies.iter().map(|body| body.name.text.as_str()).chain(["ground"]);
            let mut diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no body `{first}`"))
                .label(name.span, "not declared as a body")
                .suggest(similar_name(first, names));
            if self.entities.contains_key(first) {
                diagnostic = diagnostic.help("elements stand on a joint (`on JOINT`) or between bodies (`A -> B`)");
            }
            return self.fail_unknown(first, diagnostic, SCOPE);
        }
        let declared = match body {
            Some(index) => Some(&bodies[index]),
            None => self.declared.ground.as_ref(),
        };
        if let Some(point) = point {
            let points = declared.map(|body| body.points).unwrap_or_default();
            let mut names: Vec<&str> = points.iter().map(|point| point.key.text.as_str()).collect();
            if body.is_some() {
                names.push("centre_of_gravity");
            }
            if !names.contains(&point) {
                let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("`{first}` has no point `{point}`"))
                    .label(name.span, "not declared")
                    .suggest(similar_name(point, names.iter().copied()))
                    .help(format!("declare it: `body {first} {{ point {point} = (0 m, 0 m, 0.1 m) }}`"));
                return self.fail(diagnostic, SCOPE);
            }
        }
        Some(End { body, point })
    }

    fn find_carriers(&mut self) {
        self.topology.carrier = vec![None; self.declared.bodies.len()];
        for index in 0..self.topology.joints.len() {
            let Some((_, parent, child)) = self.topology.joints[index] else { continue };
            let joint = &self.declared.joints[index];
            if parent.body == child.body {
                let diagnostic =
                    Diagnostic::error(Code::SAME_BODY, format!("joint `{}` joins a body to itself", joint.name.text))
                        .label(joint.parent.span.to(joint.child.span), "the same body twice");
                self.report(diagnostic, SCOPE);
                self.topology.joints[index] = None;
                continue;
            }
            let Some(body) = child.body else {
                let diagnostic = Diagnostic::error(Code::UNCONNECTED_BODY, "ground cannot be carried by a joint")
                    .label(joint.child.span, "stands on the side of the child")
                    .help(format!("turn the arrow: `ground -> {}`", joint.parent.text));
                self.report(diagnostic, SCOPE);
                self.topology.joints[index] = None;
                continue;
            };
            match self.topology.carrier[body] {
                None => self.topology.carrier[body] = Some(index),
                Some(first) => self.report_loop(body, first, index),
            }
        }
    }

    fn report_loop(&mut self, body: usize, first: usize, second: usize) {
        let (body, joints) = (&self.declared.bodies[body].name.text, &self.declared.joints);
        let (first, second) = (&joints[first], &joints[second]);
        let message = format!("`{body}` is carried by two joints, `{}` and `{}`", first.name.text, second.name.text);
        let diagnostic = Diagnostic::error(Code::CLOSED_LOOP, message)
            .label(second.child.span, "the second joint closes a loop")
            .secondary(first.child.span, "the first joint")
            .help("loops are not supported yet; the arrow of a joint leads away from ground")
            .note("each body hangs on exactly one joint, `PARENT -> CHILD`, so that the joints form a tree on ground");
        self.report(diagnostic, SCOPE);
    }

    /// Every body leads to ground; a part that does not is reported once.
    fn check_connected(&mut self) {
        let count = self.declared.bodies.len();
        let mut reported = vec![false; count];
        for body in 0..count {
            let (root, is_circle) = self.root_of(body);
            let Some(root) = root else { continue };
            if is_circle {
                let members = self.circle_of(root);
                if !members.iter().any(|member| reported[*member]) {
                    self.report_circle(&members);
                }
                members.into_iter().for_each(|member| reported[member] = true);
            } else if !std::mem::replace(&mut reported[root], true) && !self.is_child_of_broken_joint(root) {
                self.report_unconnected(root);
            }
        }
    }

    /// `None` if the body leads to ground; else the body where the chain ends (or a member of the circle it runs in).
    fn root_of(&self, body: usize) -> (Option<usize>, bool) {
        let mut seen = vec![body];
        let mut current = body;
        loop {
            let Some(joint) = self.topology.carrier[current] else { return (Some(current), false) };
            let Some((_, parent, _)) = &self.topology.joints[joint] else { return (None, false) };
            let Some(next) = parent.body else { return (None, false) };
            if seen.contains(&next) {
                return (Some(next), true);
            }
            seen.push(next);
            current = next;
        }
    }

    fn circle_of(&self, body: usize) -> Vec<usize> {
        let mut members = vec![body];
        let mut current = body;
        while let Some((_, parent, _)) = self.topology.carrier[current].and_then(|joint| self.topology.joints[joint])
            && let Some(next) = parent.body
            && !members.contains(&next)
        {
            members.push(next);
            current = next;
        }
        members
    }

    fn report_circle(&mut self, members: &[usize]) {
        let joints: Vec<usize> = members.iter().filter_map(|body| self.topology.carrier[*body]).collect();
        let names: Vec<String> =
            joints.iter().map(|joint| format!("`{}`", self.declared.joints[*joint].name.text)).collect();
        let message = format!("the joints {} form a loop that never reaches ground", names.join(", "));
        let mut diagnostic = Diagnostic::error(Code::CLOSED_LOOP, message);
        for joint in joints {
            diagnostic = diagnostic.label(self.declared.joints[joint].name.span, "part of the loop");
        }
        self.report(diagnostic.help("loops are not supported yet; let one of the joints start at `ground`"), SCOPE);
    }

    fn is_child_of_broken_joint(&self, body: usize) -> bool {
        let name = &self.declared.bodies[body].name.text;
        let broken = self.declared.joints.iter().zip(&self.topology.joints).filter(|(_, read)| read.is_none());
        broken.into_iter().any(|(joint, _)| self.split_path(&joint.child.text).0 == name)
    }

    fn report_unconnected(&mut self, root: usize) {
        let name = &self.declared.bodies[root].name;
        let others: Vec<String> = (0..self.declared.bodies.len())
            .filter(|body| *body != root && self.root_of(*body).0 == Some(root))
            .map(|body| format!("`{}`", self.declared.bodies[body].name.text))
            .collect();
        let mut diagnostic =
            Diagnostic::error(Code::UNCONNECTED_BODY, format!("body `{}` is not connected to ground", name.text))
                .label(name.span, "no joint carries it")
                .help(format!("add a joint, e.g. `joint {}_guide: prismatic(z) ground -> {}`", name.text, name.text));
        if !others.is_empty() {
            diagnostic = diagnostic.note(format!("with it: {}", others.join(", ")));
        }
        self.report(diagnostic, SCOPE);
    }

    /// Parents before children, else in order of declaration.
    fn order_joints(&mut self) {
        let depth = |joint: &usize| {
            let parent = self.topology.joints[*joint].as_ref().and_then(|(_, parent, _)| parent.body);
            self.topology.chain(parent).len()
        };
        let mut order: Vec<usize> = (0..self.declared.joints.len()).collect();
        let is_ordered = order.iter().all(|joint| {
            let parent = self.topology.joints[*joint].as_ref().and_then(|(_, parent, _)| parent.body);
            self.topology.chain(parent).iter().all(|ancestor| ancestor < joint)
        });
        if !is_ordered {
            order.sort_by_key(depth);
        }
        self.topology.order = order;
    }
}
