//! Events of laws: conditions as functions whose zeros are located, periods, and what is changed.

use super::checker::{Checker, Scope, Site};
use super::model::{ChangeTarget, Event, EventTrigger, Force};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::expression::{Binary, Graph, Node, Operation};
use crate::quantities::Dimension;
use crate::syntax::{EventDeclaration, Name, Trigger};

pub(super) type SoundEvent<'a> = (&'a EventDeclaration, EventTrigger, Vec<(Target, Node)>);

/// What the name on the left of `:=` means inside a law.
#[derive(Clone, Copy)]
pub(super) enum Target {
    State(usize),
    Rate,
}

impl<'a> Checker<'a> {
    /// The events of all laws in use.
    pub fn finished_events(&mut self, forces: &[Force]) -> Vec<Event> {
        let mut events = Vec::new();
        for index in 0..self.instances.len() {
            let owner = self.instances[index].owner.to_owned();
            for (declaration, trigger, changes) in self.check_events(index) {
                let mut changed = Vec::new();
                for (target, value) in changes {
                    let target = match target {
                        Target::State(at) => {
                            let name = self.instances[index].state_name(at);
                            Some(ChangeTarget::State(self.graph.symbol(&name)))
                        }
                        Target::Rate => forces.iter().position(|force| force.name == owner).map(ChangeTarget::Rate),
                    };
                    changed.extend(target.map(|target| (target, value)));
                }
                let changes = changed;
                events.push(Event { owner: owner.clone(), trigger, changes, span: declaration.span });
            }
        }
        events
    }

    /// The sound events of an instance; faults are reported.
    pub fn check_events(&mut self, index: usize) -> Vec<SoundEvent<'a>> {
        let declarations: &'a [EventDeclaration] = self.instances[index].events;
        let mut sound = Vec::new();
        for declaration in declarations {
            let trigger = match declaration.trigger {
                Trigger::When => self.condition_of_event(index, declaration),
                Trigger::Every => self.period_of_event(index, declaration),
            };
            let changes: Vec<Option<(Target, Node)>> =
                declaration.changes.iter().map(|(name, value)| self.change_of_event(index, name, value)).collect();
            if let (Some(trigger), Some(changes)) = (trigger, changes.into_iter().collect()) {
                sound.push((declaration, trigger, changes));
            }
        }
        sound
    }

    fn condition_of_event(&mut self, index: usize, event: &'a EventDeclaration) -> Option<EventTrigger> {
        let scope = Scope::Instance(index);
        let value = self.evaluate(&event.expression, scope)?;
        self.condition(value, event.expression.span, scope)?;
        if let Some(function) = switching(&mut self.graph, value.node) {
            return Some(EventTrigger::Rises(function));
        }
        let diagnostic = Diagnostic::error(Code::EVENT_CONDITION, "it cannot be told when this becomes true")
            .label(event.expression.span, "not made of comparisons that can change")
            .help("write comparisons joined by `and` and `or`: `when x < 0 mm and v < 0 m/s { .. }`");
        self.fail(diagnostic, scope)
    }

    fn period_of_event(&mut self, index: usize, event: &'a EventDeclaration) -> Option<EventTrigger> {
        let scope = Scope::Instance(index);
        let (value, span) = (self.evaluate(&event.expression, scope)?, event.expression.span);
        let value = self.expect(value, span, Dimension::TIME, (span, "a period has"), scope)?;
        let is_trial = matches!(self.instances[index].site, Site::Trial(_));
        match self.graph.constant_value(value.node) {
            Some(period) if period > 0.0 && period.is_finite() => Some(EventTrigger::Every(period)),
            // Imagined ports have no value.
            None if is_trial => Some(EventTrigger::Every(1.0)),
            known => {
                let label = match known {
                    Some(period) => format!("this is {period} s"),
                    None => "not known before the simulation".to_owned(),
                };
                let diagnostic = Diagnostic::error(Code::EVENT_PERIOD, "the period must be a fixed positive time")
                    .label(span, label)
                    .help("write a number, `every 1 ms { .. }`, or bind the parameter to a number");
                self.fail(diagnostic, scope)
            }
        }
    }

    fn change_of_event(
        &mut self,
        index: usize,
        name: &'a Name,
        value: &'a crate::syntax::Expression,
    ) -> Option<(Target, Node)> {
        let scope = Scope::Instance(index);
        let new = self.evaluate(value, scope);
        let instance = &self.instances[index];
        let state = instance.states.iter().position(|state| state.name.text == name.text);
        let rate = instance.place_port("v").filter(|_| name.text == "v" && !matches!(instance.site, Site::Signal(_)));
        let (target, dimension) = match (state, rate) {
            (Some(at), _) => (Target::State(at), self.state(index, at, name.span)?.dimension),
            (None, Some(rate)) => (Target::Rate, rate.dimension),
            (None, None) => {
                let states: Vec<&str> = instance.states.iter().map(|state| state.name.text.as_str()).collect();
                let message = format!("an event cannot change `{}`", name.text);
                let mut diagnostic = Diagnostic::error(Code::EVENT_TARGET, message)
                    .label(name.span, "neither a state of this law nor the rate `v` of its place")
                    .suggest(similar_name(&name.text, states.iter().copied()));
                if !states.is_empty() {
                    diagnostic = diagnostic.note(format!("states of this law: {}", states.join(", ")));
                }
                return self.fail(diagnostic, scope);
            }
        };
        let because = format!("`{}` has", name.text);
        let new = self.expect(new?, value.span, dimension, (name.span, &because), scope)?;
        Some((target, new.node))
    }
}

/// A function that is positive where the condition holds and negative where it does not; none where the condition is
/// not made of comparisons, or does not change.
fn switching(graph: &mut Graph, condition: Node) -> Option<Node> {
    match graph.operation(condition) {
        Operation::Binary(Binary::Less, a, b) => Some(graph.subtract(b, a)),
        Operation::Binary(function @ (Binary::Minimum | Binary::Maximum), a, b) => {
            let (a, b) = (switching(graph, a)?, switching(graph, b)?);
            Some(graph.binary(function, a, b))
        }
        // `a <= b` is `1 - (b < a)`.
        Operation::Binary(Binary::Subtract, one, comparison) if graph.constant_value(one) == Some(1.0) => {
            let opposite = switching(graph, comparison)?;
            Some(graph.negate(opposite))
        }
        _ => None,
    }
}
