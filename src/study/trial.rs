//! Laws and effects of the study are checked by themselves, used or not: on an imagined place whose quantities have
//! dimensions of their own.

use super::checker::{Allowed, Checker, Scope, Site};
use super::evaluate::Typed;
use super::instance::{Instance, Progress};
use super::kinds::{Form, Kinds, load_dimension, rate_dimension};
use super::model::Motion;
use crate::diagnostics::{Code, Diagnostic};
use crate::quantities::Dimension;
use crate::syntax::{Declared, EffectAction, EffectDeclaration, Expression, LawDeclaration, Name, StateDeclaration};

/// A state of an instance, its expressions of the right dimensions.
pub(super) struct CheckedState {
    pub symbol: Typed,
    pub initial: Typed,
    pub derivative: Typed,
    /// Typical size (SI), where it is stated.
    pub nominal: Option<f64>,
}

/// A dimension that no other quantity has: a law for any `value` must not depend on what it is.
const ANY_VALUE: Dimension = Dimension::new(3, -5, 7, 2, -3);

impl<'a> Checker<'a> {
    /// Tries out the laws and effects that the study itself declares.
    pub fn check_declarations(&mut self) {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let mut laws: Vec<&'a LawDeclaration> =
            declared.laws.values().filter(|law| !law.is_prelude && !law.is_table).map(|law| law.declaration).collect();
        laws.sort_by_key(|law| (law.name.span.file, law.name.span.start));
        for law in laws {
            self.try_law(law);
        }
        for effect in declared.effect_declarations.iter().filter(|effect| !effect.is_prelude) {
            self.try_effect(effect.declaration);
        }
    }

    fn try_law(&mut self, law: &'a LawDeclaration) {
        let index = self.imagine(&law.name, &law.bindings, &law.states);
        if !self.imagine_names(index, law.ports.iter().chain(&law.parameters)) {
            return;
        }
        self.check_inside(index, &law.bindings, &law.states);
        self.instances[index].events = &law.events;
        self.check_events(index);
        let value = self.evaluate(&law.value, Scope::Instance(index));
        let form = self.form(&law.result);
        if let (Some(value), Some(form)) = (value, form)
            && let Some(wanted) = form.dimension(&self.instances[index].kinds)
        {
            self.expect(value, law.value.span, wanted, (law.result.span, "the law gives"), Scope::Instance(index));
        }
    }

    fn try_effect(&mut self, effect: &'a EffectDeclaration) {
        let index = self.imagine(&effect.name, &effect.bindings, &effect.states);
        if !self.imagine_names(index, effect.amplitudes.iter().chain(&effect.shapes)) {
            return;
        }
        let main = effect.places.first().map_or("load", |place| match place.text.as_str() {
            "input" => "u",
            "measure" => "y",
            "signal" => "value",
            _ => "load",
        });
        self.imagine_ports(index, effect);
        self.check_inside(index, &effect.bindings, &effect.states);
        for action in &effect.actions {
            let (port, expression) = match action {
                EffectAction::Adds(expression) => (main, expression),
                EffectAction::Replaces(port, expression) => (port.text.as_str(), expression),
            };
            let value = self.evaluate(expression, Scope::Instance(index));
            let wanted = self.instances[index].place_port(port);
            if let (Some(value), Some(wanted)) = (value, wanted) {
                let because = (effect.name.span, "the place has");
                self.expect(value, expression.span, wanted.dimension, because, Scope::Instance(index));
            }
        }
    }

    fn imagine(&mut self, name: &'a Name, bindings: &'a [(Name, Expression)], states: &'a [StateDeclaration]) -> usize {
        let index = self.instances.len();
        self.instances.push(Instance {
            owner: &name.text,
            sort: "the declaration of",
            span: name.span,
            site: Site::Trial(index),
            step: 0,
            is_effect: false,
            declared: Vec::new(),
            bindings,
            states,
            events: &[],
            fields: Vec::new(),
            kinds: Kinds { value: Some(ANY_VALUE), ..Kinds::of(Motion::Translational) },
            progress: Progress::Known,
            place_ports: Vec::new(),
        });
        index
    }

    /// Every declared name becomes a quantity of its declared dimension. False if a type cannot be read.
    fn imagine_names(&mut self, index: usize, declared: impl Iterator<Item = &'a Declared>) -> bool {
        let mut readable = true;
        let mut seen: Vec<&'a Name> = Vec::new();
        for declared in declared {
            if let Some(first) = seen.iter().find(|name| name.text == declared.name.text) {
                let diagnostic =
                    Diagnostic::error(Code::DUPLICATE_NAME, format!("`{}` is declared twice", declared.name.text))
                        .label(declared.name.span, "second declaration")
                        .secondary(first.span, "first declaration");
                self.report(diagnostic, Scope::Study(Allowed::Number));
            }
            seen.push(&declared.name);
            let dimension = match &declared.kind {
                Some(kind) => match Form::read(kind) {
                    Ok(form) => form.dimension(&self.instances[index].kinds).unwrap_or_default(),
                    Err(diagnostic) => {
                        self.report(diagnostic, Scope::Study(Allowed::Number));
                        readable = false;
                        continue;
                    }
                },
                None => Dimension::ONE,
            };
            self.imagine_port(index, &declared.name.text, dimension);
            if let Some(default) = &declared.default
                && let Some(value) = self.evaluate(default, Scope::Instance(index))
            {
                let because = (declared.name.span, "declared as");
                self.expect(value, default.span, dimension, because, Scope::Instance(index));
            }
        }
        readable
    }

    fn imagine_ports(&mut self, index: usize, effect: &'a EffectDeclaration) {
        let length = Dimension::LENGTH;
        let (rate, load) = (rate_dimension(Motion::Translational), load_dimension(Motion::Translational));
        for place in &effect.places {
            let ports: &[(&'a str, Dimension)] = match place.text.as_str() {
                "joint" => &[("x", length), ("v", rate), ("inertia", Dimension::MASS), ("normal", Dimension::FORCE)],
                "force" => &[("x", length), ("v", rate), ("load", load)],
                "actuator" => &[("x", length), ("v", rate), ("load", load), ("command", ANY_VALUE)],
                "input" => &[("u", ANY_VALUE), ("value", ANY_VALUE)],
                "measure" => &[("y", ANY_VALUE), ("value", ANY_VALUE)],
                _ => &[("value", ANY_VALUE)],
            };
            for (port, dimension) in ports {
                if self.instances[index].place_port(port).is_none() {
                    self.imagine_port(index, port, *dimension);
                }
            }
        }
    }

    /// Samples of an imagined input, so that delays and derivatives can be tried too.
    fn imagine_port(&mut self, index: usize, name: &'a str, dimension: Dimension) {
        let time = self.graph.variable(self.time);
        let node = self.graph.sample(u32::MAX - self.instances[index].place_ports.len() as u32, 0, time);
        self.instances[index].place_ports.push((name, Typed::new(node, dimension)));
    }

    fn check_inside(&mut self, index: usize, bindings: &'a [(Name, Expression)], states: &'a [StateDeclaration]) {
        for (name, _) in bindings {
            self.local(index, name);
        }
        self.check_states(index, states);
    }

    /// Derivatives, start values and nominal sizes of all states of an instance have the right dimension; what they
    /// are.
    pub fn check_states(&mut self, index: usize, states: &'a [StateDeclaration]) -> Vec<Option<CheckedState>> {
        let scope = Scope::Instance(index);
        let check = |checker: &mut Self, at: usize, state: &'a StateDeclaration| {
            let symbol = checker.state(index, at, state.name.span);
            let initial = checker.evaluate(&state.initial, scope);
            let derivative = state.derivative.as_ref().map(|written| (checker.evaluate(written, scope), written.span));
            let symbol = symbol?;
            let nominal = state.nominal.as_ref().and_then(|written| checker.nominal(index, written, state, symbol));
            let because = format!("state `{}` has", state.name.text);
            let initial =
                checker.expect(initial?, state.initial.span, symbol.dimension, (state.name.span, &because), scope);
            let rate = symbol.dimension / Dimension::TIME;
            let because = format!("the derivative of `{}` has", state.name.text);
            let derivative = match derivative {
                Some((value, span)) => checker.expect(value?, span, rate, (state.name.span, &because), scope),
                None => Some(Typed::new(checker.graph.constant(0.0), rate)),
            };
            Some(CheckedState { symbol, initial: initial?, derivative: derivative?, nominal })
        };
        states.iter().enumerate().map(|(at, state)| check(self, at, state)).collect()
    }

    fn nominal(
        &mut self,
        index: usize,
        written: &'a Expression,
        state: &'a StateDeclaration,
        symbol: Typed,
    ) -> Option<f64> {
        let scope = Scope::Instance(index);
        let value = self.evaluate(written, scope)?;
        let because = format!("state `{}` has", state.name.text);
        let value = self.expect(value, written.span, symbol.dimension, (state.name.span, &because), scope)?;
        let is_trial = matches!(self.instances[index].site, Site::Trial(_));
        match self.graph.constant_value(value.node) {
            Some(size) if size > 0.0 && size.is_finite() => Some(size),
            // Imagined ports have no value.
            None if is_trial => None,
            _ => {
                let message = format!("the nominal size of `{}` must be a fixed positive number", state.name.text);
                let diagnostic = Diagnostic::error(Code::NOMINAL_SIZE, message)
                    .label(written.span, "not known before the simulation, or not positive")
                    .help("write the usual size as a number, with its unit where it has one: `nominal 1e-12`");
                self.fail(diagnostic, scope)
            }
        }
    }
}
