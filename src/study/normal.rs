//! What presses the sides of a joint on each other.

use super::checker::{Allowed, Checker, Entity, Scope};
use super::evaluate::Typed;
use super::model::{AxisMotion, ReactionQuantity};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Node, Unary};
use crate::linear::perpendicular;
use crate::quantities::Dimension;
use crate::syntax::{ElementPlace, Name};

impl<'a> Checker<'a> {
    /// What presses the sides of a joint on each other, for effects that rub there: the size of the force that it
    /// transmits, of a joint that shifts without its direction. `None` where the joint has not exactly one axis, or its
    /// direction turns.
    pub fn normal_force(&mut self, effect: usize, name: &'a Name) -> Option<Typed> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let ElementPlace::On(place) = declared.effects[effect].place else { return None };
        let Some(Entity::JointAxis(joint, _)) = self.place_entity(&place.text) else { return None };
        let across = self.directions_across(joint);
        let Some(across) = across else {
            let message = format!("the normal force at `{}` is not known", place.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(place.span, "needs a joint with one axis; one that shifts must not be carried by what turns")
                .secondary(name.span, "used here")
                .help("write the friction as a law of `NAME.reaction.force.x`");
            return self.fail(diagnostic, Scope::Study(Allowed::Constant));
        };
        let own = &declared.joints[joint].name;
        // A vanishing force keeps a derivative.
        let mut sum = self.graph.constant(f64::MIN_POSITIVE.sqrt());
        let components: Vec<Node> =
            (0..3).map(|axis| self.reaction_component(joint, &own.text, axis, own.span)).collect();
        for direction in across {
            let mut along = self.graph.constant(0.0);
            for (component, factor) in components.iter().zip(direction) {
                let factor = self.graph.constant(factor);
                let share = self.graph.multiply(factor, *component);
                along = self.graph.add(along, share);
            }
            let square = self.graph.multiply(along, along);
            sum = self.graph.add(sum, square);
        }
        Some(Typed::new(self.graph.unary(Unary::Sqrt, sum), Dimension::FORCE))
    }

    fn directions_across(&self, joint: usize) -> Option<Vec<[f64; 3]>> {
        let read = self.topology.joint(joint)?;
        let [axis] = read.freedom.axes.as_slice() else { return None };
        let AxisMotion::Shift(axis) = axis.motion else {
            return Some(vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        };
        let is_turned = read.freedom.is_turned || read.parent.body.is_some_and(|body| self.topology.turns(body));
        if read.freedom.rotation.is_some() || is_turned {
            return None;
        }
        Some(perpendicular(axis).to_vec())
    }

    fn reaction_component(&mut self, joint: usize, owner: &str, axis: usize, span: Span) -> Node {
        let symbol = self.graph.symbol(&format!("{owner}.reaction.force.{}", ["x", "y", "z"][axis]));
        let is_new = self.reactions.iter().all(|reaction| reaction.symbol != symbol);
        if is_new {
            self.reactions.push(ReactionQuantity { symbol, joint, is_moment: false, axis, span });
        }
        self.graph.variable(symbol)
    }
}
