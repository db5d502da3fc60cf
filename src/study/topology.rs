//! Bodies and joints: which joints carry the bodies, which close loops.

use super::checker::{Allowed, Checker, Scope};
use super::fields::find;
use super::joints::JointFreedom;
use super::model::{AxisMotion, JointKind};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::syntax::{ElementPlace, Name};
use std::collections::VecDeque;

const SCOPE: Scope = Scope::Study(Allowed::Number);

/// An attachment as written: body index (`None`: ground) and point name.
#[derive(Clone, Copy, Debug)]
pub(super) struct End<'a> {
    pub body: Option<usize>,
    pub point: Option<&'a str>,
    pub span: Span,
}

/// A joint as far as it could be read.
#[derive(Clone, Debug)]
pub(super) struct ReadJoint<'a> {
    pub freedom: JointFreedom,
    pub parent: End<'a>,
    pub child: End<'a>,
}

impl<'a> ReadJoint<'a> {
    /// Near and far end seen from `body`.
    pub fn seen_from(&self, body: Option<usize>) -> (End<'a>, End<'a>) {
        if self.parent.body == body { (self.parent, self.child) } else { (self.child, self.parent) }
    }
}

/// Per declared joint what was read (`None` after an error), per body the joint that carries it, and the joints
/// ordered so that inner ones come before outer ones.
#[derive(Default)]
pub(super) struct Topology<'a> {
    pub joints: Vec<Option<ReadJoint<'a>>>,
    /// Per declared joint: it is not part of the spanning tree.
    pub closes_loop: Vec<bool>,
    pub carrier: Vec<Option<usize>>,
    pub order: Vec<usize>,
    /// Per body: it has modes.
    pub is_elastic: Vec<bool>,
}

impl<'a> Topology<'a> {
    pub fn joint(&self, joint: usize) -> Option<&ReadJoint<'a>> {
        self.joints.get(joint)?.as_ref()
    }

    /// Joints from a body down to ground. Ends early where the tree is broken.
    pub fn chain(&self, body: Option<usize>) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut current = body;
        while let Some(joint) = current.and_then(|body| self.carrier.get(body).copied().flatten()) {
            if chain.contains(&joint) {
                break;
            }
            chain.push(joint);
            current = self.joint(joint).and_then(|read| read.seen_from(current).1.body);
        }
        chain
    }

    /// Whether a joint or an elastic body turns this body.
    pub fn turns(&self, body: usize) -> bool {
        let is_elastic = |body: usize| self.is_elastic.get(body).copied().unwrap_or(false);
        let turns = |joint: usize| {
            self.joint(joint).is_none_or(|read| {
                let carriers = [read.parent.body, read.child.body];
                read.freedom.turns() || carriers.into_iter().flatten().any(is_elastic)
            })
        };
        is_elastic(body) || self.chain(Some(body)).into_iter().any(turns)
    }

    /// The axis along which two bodies can only shift against each other, if there is one: no joint turns them, and
    /// the joints between them share one direction.
    pub fn common_axis(&self, first: Option<usize>, second: Option<usize>) -> Option<[f64; 3]> {
        let (a, b) = (self.chain(first), self.chain(second));
        let turns =
            |joint: &usize| self.joint(*joint).is_none_or(|read| read.freedom.turns() || read.freedom.is_turned);
        if a.iter().chain(&b).any(turns) {
            return None;
        }
        let mut axis: Option<[f64; 3]> = None;
        let own_of_second = b.iter().filter(|joint| !a.contains(joint));
        for joint in own_of_second.chain(a.iter().filter(|joint| !b.contains(joint))) {
            for entry in self.joint(*joint).into_iter().flat_map(|read| &read.freedom.axes) {
                let AxisMotion::Shift(own) = entry.motion else { return None };
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

pub(super) fn is_parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    (cosine.abs() - 1.0).abs() < 1e-12
}

impl<'a> Checker<'a> {
    /// Reads all joints, chooses the spanning tree and checks that it reaches every body.
    pub fn read_topology(&mut self) {
        self.topology.is_elastic =
            self.declared.bodies.iter().map(|body| find(body.fields, "modes").is_some()).collect();
        for index in 0..self.declared.joints.len() {
            let declared = &self.declared.joints[index];
            let owner = format!("joint `{}`", declared.name.text);
            let known: &[&'static str] =
                if declared.kind.text == "distance" { &["length"] } else { &["orientation", "motion"] };
            self.known_fields(&owner, declared.fields, known);
            let freedom = self.joint_freedom(index);
            let (parent, child) = (self.end(declared.parent), self.end(declared.child));
            let read = match (freedom, parent, child) {
                (Some(freedom), Some(parent), Some(child)) => self.two_bodies(index, freedom, parent, child),
                _ => None,
            };
            if let Some(read) = &read {
                for (at, axis) in read.freedom.axes.iter().enumerate() {
                    self.axis_index.insert(axis.name.clone(), (index, at));
                    self.accelerations.insert(axis.symbols.acceleration);
                }
                for symbols in read.freedom.rotation.iter() {
                    self.accelerations.extend(symbols.acceleration);
                }
            }
            self.topology.joints.push(read);
        }
        self.choose_tree();
        self.check_connected();
    }

    fn two_bodies(
        &mut self,
        index: usize,
        freedom: JointFreedom,
        parent: End<'a>,
        child: End<'a>,
    ) -> Option<ReadJoint<'a>> {
        if parent.body != child.body {
            return Some(ReadJoint { freedom, parent, child });
        }
        let joint = &self.declared.joints[index];
        let diagnostic =
            Diagnostic::error(Code::SAME_BODY, format!("joint `{}` joins a body to itself", joint.name.text))
                .label(joint.parent.span.to(joint.child.span), "the same body twice");
        self.fail(diagnostic, SCOPE)
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
        Some(End { body, point, span: name.span })
    }

    /// Joints with prescribed motion come first, then those that have no form as constraints, then those that carry
    /// elements or are coupled to others, then free ones, then those with the least freedom, so that loops are closed
    /// where the fewest constraints arise; among equals the ones declared first.
    fn choose_tree(&mut self) {
        let ground = self.declared.bodies.len();
        let node = |end: End| end.body.unwrap_or(ground);
        let on_places: Vec<&str> = (self.declared.forces.iter().chain(&self.declared.effects))
            .filter_map(|element| match element.place {
                ElementPlace::On(name) => Some(name.text.as_str()),
                _ => None,
            })
            .collect();
        let coupled = super::couplings::mentioned(&self.declared.couplings);
        let carries_elements = |read: &ReadJoint| {
            let is_named = |name: &str| on_places.contains(&name) || coupled.contains(name);
            read.freedom.axes.iter().any(|axis| is_named(&axis.name))
        };
        let mut candidates: Vec<usize> = (0..self.topology.joints.len())
            .filter(|joint| self.topology.joint(*joint).is_some_and(|read| read.freedom.kind != JointKind::Distance))
            .collect();
        candidates.sort_by_key(|joint| {
            self.topology.joint(*joint).map(|read| {
                let is_driven = find(self.declared.joints[*joint].fields, "motion").is_some();
                // A free joint holds nothing: it is there to give its body coordinates.
                let is_free = read.freedom.kind == JointKind::Free;
                let order = (!is_free, read.freedom.degrees_of_freedom());
                (!is_driven, !read.freedom.shifts_between_turns(), !carries_elements(read), order)
            })
        });
        let mut closes_loop: Vec<bool> = self.topology.joints.iter().map(Option::is_some).collect();
        let mut group: Vec<usize> = (0..=ground).collect();
        let mut joints_at: Vec<Vec<usize>> = vec![Vec::new(); ground + 1];
        for joint in candidates {
            let Some(read) = self.topology.joint(joint) else { continue };
            let (kept, merged) = (group[node(read.parent)], group[node(read.child)]);
            if kept == merged {
                continue;
            }
            closes_loop[joint] = false;
            group.iter_mut().filter(|member| **member == merged).for_each(|member| *member = kept);
            joints_at[node(read.parent)].push(joint);
            joints_at[node(read.child)].push(joint);
        }
        self.topology.closes_loop = closes_loop;
        self.walk_tree(ground, joints_at);
    }

    fn walk_tree(&mut self, ground: usize, mut joints_at: Vec<Vec<usize>>) {
        let mut carrier: Vec<Option<usize>> = vec![None; ground];
        let mut depth = vec![0_usize; self.topology.joints.len()];
        let mut queue = VecDeque::from([(ground, 0)]);
        while let Some((from, level)) = queue.pop_front() {
            joints_at[from].sort_unstable();
            let body = (from < ground).then_some(from);
            for &joint in &joints_at[from] {
                let Some(read) = self.topology.joint(joint) else { continue };
                let Some(to) = read.seen_from(body).1.body else { continue };
                if body.is_some_and(|body| carrier[body] == Some(joint)) || carrier[to].is_some() {
                    continue;
                }
                carrier[to] = Some(joint);
                depth[joint] = level + 1;
                queue.push_back((to, level + 1));
            }
        }
        self.topology.carrier = carrier;
        let mut order: Vec<usize> = (0..self.topology.joints.len()).collect();
        let inner_first = |joint: &usize| {
            let read = self.topology.joint(*joint);
            let inner = read.and_then(|read| match depth[*joint] {
                0 => None,
                _ => [read.parent.body, read.child.body]
                    .into_iter()
                    .map(|body| self.topology.chain(body))
                    .min_by_key(Vec::len),
            });
            inner.is_none_or(|chain| chain.iter().all(|ancestor| ancestor < joint))
        };
        if !order.iter().all(inner_first) {
            order.sort_by_key(|joint| depth[*joint]);
        }
        self.topology.order = order;
    }

    /// Every body leads to ground; parts that do not are reported once, with what hangs on them.
    fn check_connected(&mut self) {
        let count = self.declared.bodies.len();
        let mut part: Vec<usize> = (0..count).collect();
        for read in self.topology.joints.iter().flatten() {
            if let (Some(a), Some(b)) = (read.parent.body, read.child.body)
                && read.freedom.kind != JointKind::Distance
            {
                let (kept, merged) = (part[a].min(part[b]), part[a].max(part[b]));
                part.iter_mut().filter(|member| **member == merged).for_each(|member| *member = kept);
            }
        }
        let is_loose: Vec<bool> =
            (0..count).map(|body| self.topology.carrier[body].is_none() && !self.is_at_broken_joint(body)).collect();
        let roots: Vec<usize> = (0..count).filter(|&body| part[body] == body).collect();
        for root in roots {
            let members: Vec<usize> = (0..count).filter(|&body| part[body] == root).collect();
            if members.iter().all(|&body| is_loose[body]) {
                self.report_unconnected(&members);
            }
        }
    }

    /// Whether a joint of this body could not be read.
    pub fn is_at_broken_joint(&self, body: usize) -> bool {
        let name = &self.declared.bodies[body].name.text;
        let broken = self.declared.joints.iter().zip(&self.topology.joints).filter(|(_, read)| read.is_none());
        let stands_at = |end: &Name| {
            let (body, _) = self.split_path(&end.text);
            // A misspelt body is reported at the joint.
            let is_meant = || !self.entities.contains_key(body) && similar_name(body, [name.as_str()]).is_some();
            body == name || is_meant()
        };
        broken.into_iter().any(|(joint, _)| stands_at(joint.parent) || stands_at(joint.child))
    }

    fn report_unconnected(&mut self, members: &[usize]) {
        let is_child = |body: &usize| self.topology.joints.iter().flatten().any(|read| read.child.body == Some(*body));
        let root = members.iter().copied().find(|body| !is_child(body)).or(members.first().copied());
        let Some(root) = root else { return };
        let name = &self.declared.bodies[root].name;
        let others: Vec<String> = members
            .iter()
            .filter(|body| **body != root)
            .map(|body| format!("`{}`", self.declared.bodies[*body].name.text))
            .collect();
        let mut diagnostic =
            Diagnostic::error(Code::UNCONNECTED_BODY, format!("body `{}` is not connected to ground", name.text))
                .label(name.span, "no chain of joints leads from ground to here")
                .help(format!(
                    "add a joint, e.g. `joint {}_guide: prismatic(z) ground -> {}`, or `free`",
                    name.text, name.text
                ));
        if !others.is_empty() {
            diagnostic = diagnostic.note(format!("with it: {}", others.join(", ")));
        }
        self.report(diagnostic, SCOPE);
    }
}
