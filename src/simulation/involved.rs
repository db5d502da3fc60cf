//! Which elements of the study stand behind an equation.

use super::run::Compiled;
use crate::expression::Symbol;
use crate::study::{ForcePlace, Study};

/// At most so many elements are listed by name.
const NAMED: usize = 6;

/// `name` of equation `i` with what acts in it: for the rate of a joint's velocity the forces between the bodies that
/// the joint carries and all others.
pub(super) fn with_elements(compiled: &Compiled, i: usize, name: String) -> String {
    let Some(variable) = compiled.model.variables().get(i).filter(|_| i < compiled.model.state_count()) else {
        return name;
    };
    let Some(joint) = joint_of_velocity(&compiled.study, variable.symbol) else { return name };
    let acting = elements_on(&compiled.study, joint);
    let listed = match acting.len() {
        0 => "on which no force element acts".to_owned(),
        1..=NAMED => format!("on which act {}", acting.join(", ")),
        count => format!("on which act {} and {} others", acting[..NAMED].join(", "), count - NAMED),
    };
    format!("{name} ({listed})")
}

fn joint_of_velocity(study: &Study, symbol: Symbol) -> Option<usize> {
    study.joints.iter().position(|joint| {
        let rotation = joint.rotation.iter().flat_map(|rotation| rotation.velocity);
        joint.axes.iter().map(|axis| axis.symbols.velocity).chain(rotation).any(|velocity| velocity == symbol)
    })
}

/// Force elements through the joint, or between a body that it carries and one that it does not; gravity.
fn elements_on(study: &Study, joint: usize) -> Vec<String> {
    let carried = carried_by(study, joint);
    let is_carried = |body: Option<usize>| body.is_some_and(|body| carried[body]);
    let acts = |place: &ForcePlace| match place {
        ForcePlace::Joint { joint: own, .. } => *own == joint,
        ForcePlace::Between { first, second, .. } => is_carried(first.body) != is_carried(second.body),
    };
    let forces = study.forces.iter().filter(|force| acts(&force.place)).map(|force| force.name.clone());
    let has_gravity = study.gravity.iter().any(|&component| !study.graph.is_zero(component));
    forces.chain(has_gravity.then(|| "gravity".to_owned())).collect()
}

/// Per body whether the joint carries it, directly or through other joints.
fn carried_by(study: &Study, joint: usize) -> Vec<bool> {
    let mut carried = vec![false; study.bodies.len()];
    let mut waiting: Vec<usize> = study.joints[joint].child.body.into_iter().collect();
    while let Some(body) = waiting.pop() {
        if !std::mem::replace(&mut carried[body], true) {
            let further = study.joints.iter().filter(|j| !j.closes_loop && j.parent.body == Some(body));
            waiting.extend(further.filter_map(|j| j.child.body));
        }
    }
    carried
}
