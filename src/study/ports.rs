//! Values of places and how effects change them.
//!
//! A site (input, force, signal, measure) has a chain of effects in order of declaration. Each port of the site has a
//! value before the first effect and one after each; an effect sees what the effects before it left.

use super::checker::{Allowed, Checker, Key, Scope, Site};
use super::declarations::SignalKind;
use super::evaluate::Typed;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::quantities::Dimension;
use crate::syntax::{EffectAction, EffectDeclaration};

/// The port that carries the value of a site, and the names it also answers to.
pub(super) fn principal(site: Site) -> (&'static str, &'static [&'static str]) {
    match site {
        Site::Input(_) => ("u", &["value"]),
        Site::Force(_) | Site::JointEffect(_) => ("load", &[]),
        Site::Signal(_) | Site::Gravity(_) => ("value", &[]),
        // An imagined place has ports only.
        Site::Trial(_) => ("", &[]),
        Site::Measure(_) => ("y", &["value"]),
    }
}

impl<'a> Checker<'a> {
    /// The law of a site, where it has one.
    pub fn site_law(&self, site: Site) -> Option<usize> {
        match site {
            Site::Force(index) => self.force_instances.get(index).copied().flatten(),
            Site::Signal(index) => self.signal_instances.get(index).copied().flatten(),
            Site::JointEffect(index) => self.effect_instances.get(index).copied().flatten(),
            Site::Trial(index) => Some(index),
            Site::Input(_) | Site::Measure(_) | Site::Gravity(_) => None,
        }
    }

    /// The port of the site that `name` means, if any.
    pub fn site_port(&self, site: Site, name: &'a str) -> Option<&'a str> {
        let (main, aliases) = principal(site);
        if name == main && !matches!(site, Site::JointEffect(_)) || aliases.contains(&name) {
            return Some(main);
        }
        let instance = &self.instances[self.site_law(site)?];
        if instance.place_port(name).is_some() {
            return Some(name);
        }
        let has_field = !instance.is_effect && instance.declared.iter().any(|declared| declared.name.text == name);
        has_field.then_some(name)
    }

    /// Names of all ports of a site.
    pub fn site_ports(&self, site: Site) -> Vec<String> {
        let mut ports = Vec::new();
        if !matches!(site, Site::JointEffect(_)) {
            ports.push(principal(site).0.to_owned());
        }
        if let Some(instance) = self.site_law(site).map(|index| &self.instances[index]) {
            ports.extend(instance.place_ports.iter().map(|(name, _)| (*name).to_owned()));
            if !instance.is_effect {
                let bound =
                    instance.declared.iter().filter(|declared| instance.place_port(&declared.name.text).is_none());
                ports.extend(bound.map(|declared| declared.name.text.clone()));
            }
        }
        ports
    }

    /// The value of a site after all its effects.
    pub fn site_value(&mut self, site: Site, at: Span) -> Option<Typed> {
        let steps = self.site_effects.get(&site).map_or(0, Vec::len);
        self.port(site, principal(site).0, steps, at)
    }

    /// The value of a port after the first `step` effects of its site.
    pub fn port(&mut self, site: Site, port: &'a str, step: usize, at: Span) -> Option<Typed> {
        self.once(Key::Port(site, port, step), at, |checker| {
            let Some(before) = step.checked_sub(1) else { return checker.base_port(site, port, at) };
            let effect = checker.site_effects.get(&site)?.get(before).copied()?;
            let value = checker.port(site, port, before, at)?;
            checker.change(effect, site, port, value)
        })
    }

    /// What an effect makes of a port's value.
    fn change(&mut self, effect: usize, site: Site, port: &'a str, before: Typed) -> Option<Typed> {
        let Some(index) = self.effect_instances.get(effect).copied().flatten() else { return Some(before) };
        let declaration = self.effect_of(effect)?;
        let scope = Scope::Instance(index);
        let mut value = before;
        for action in &declaration.actions {
            match action {
                EffectAction::Adds(expression) if port == principal(site).0 => {
                    let added = self.evaluate(expression, scope)?;
                    let because = (declaration.name.span, "the place has");
                    let added = self.expect(added, expression.span, before.dimension, because, scope)?;
                    value = Typed::new(self.graph.add(value.node, added.node), value.dimension);
                }
                EffectAction::Replaces(name, expression) if self.site_port(site, &name.text) == Some(port) => {
                    let new = self.evaluate(expression, scope)?;
                    value = self.expect(new, expression.span, before.dimension, (name.span, &name.text), scope)?;
                }
                EffectAction::Adds(_) | EffectAction::Replaces(..) => {}
            }
        }
        Some(value)
    }

    fn base_port(&mut self, site: Site, port: &'a str, at: Span) -> Option<Typed> {
        if port == principal(site).0 {
            return match site {
                Site::Input(index) => Some(self.input_value(index)),
                Site::Measure(index) => self.measure_value(index),
                Site::Force(index) => self.force_load(index),
                Site::Signal(index) => self.signal_value(index),
                Site::JointEffect(index) => self.joint_effect_load(index),
                Site::Gravity(axis) => self.gravity_before_effects(axis),
                Site::Trial(_) => None,
            };
        }
        let index = self.site_law(site)?;
        match self.instances[index].place_port(port) {
            Some(value) => Some(value),
            None => self.own_field(index, port, at),
        }
    }

    /// The load of a force's law, before effects.
    fn force_load(&mut self, force: usize) -> Option<Typed> {
        let index = self.force_instances.get(force).copied().flatten()?;
        let wanted = self.instances[index].kinds.load;
        self.law_value(index, self.declared.forces[force].law, wanted)
    }

    fn signal_value(&mut self, signal: usize) -> Option<Typed> {
        match &self.declared.signals[signal].kind {
            SignalKind::Formula(expression) => self.evaluate(expression, Scope::Study(Allowed::Motion)),
            SignalKind::Law { law, .. } => {
                let index = self.signal_instances.get(signal).copied().flatten()?;
                self.law_value(index, law, None)
            }
        }
    }

    /// The value of an instance's law; `wanted` is what the place needs.
    fn law_value(&mut self, index: usize, law: &'a crate::syntax::Name, wanted: Option<Dimension>) -> Option<Typed> {
        let declaration = self.declared.laws.get(law.text.as_str())?.declaration;
        let form = self.form(&declaration.result)?;
        self.infer_kinds(index);
        let scope = Scope::Instance(index);
        let result = form.dimension(&self.instances[index].kinds);
        let value = self.evaluate(&declaration.value, scope);
        if let (Some(result), Some(wanted)) = (result, wanted)
            && result != wanted
        {
            let message = format!("law `{}` gives {result}, this place needs {wanted}", law.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(law.span, format!("needs {wanted}"))
                .secondary(declaration.result.span, format!("this is {result}"))
                .help("laws declared with `load`, `coordinate` and `rate` serve translation and rotation");
            return self.fail(diagnostic, Scope::Study(Allowed::Motion));
        }
        let value = value?;
        match result {
            Some(result) => {
                let because = (declaration.result.span, "the law gives");
                self.expect(value, declaration.value.span, result, because, scope)
            }
            None => Some(value),
        }
    }

    /// The sum of what an effect adds to a joint.
    fn joint_effect_load(&mut self, effect: usize) -> Option<Typed> {
        let index = self.effect_instances.get(effect).copied().flatten()?;
        let declaration = self.effect_of(effect)?;
        let wanted = self.instances[index].kinds.load?;
        let mut sum = Typed::new(self.graph.constant(0.0), wanted);
        for action in &declaration.actions {
            if let EffectAction::Adds(expression) = action {
                let scope = Scope::Instance(index);
                let added = self.evaluate(expression, scope)?;
                let because = (declaration.name.span, "the place has");
                let added = self.expect(added, expression.span, wanted, because, scope)?;
                sum.node = self.graph.add(sum.node, added.node);
            }
        }
        Some(sum)
    }

    /// The declaration that a use of an effect refers to.
    pub fn effect_of(&self, use_index: usize) -> Option<&'a EffectDeclaration> {
        let name = &self.declared.effects.get(use_index)?.law.text;
        let found = self.declared.effect_declarations.iter().find(|effect| effect.declaration.name.text == *name);
        found.map(|effect| effect.declaration)
    }
}
