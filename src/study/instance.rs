//! A law or effect at the place where it is used: its fields, its inner names, its states.

use super::checker::{Allowed, Checker, Key, Scope, Site};
use super::evaluate::{Typed, literal};
use super::fields::{FlatField, flatten};
use super::kinds::{Form, Kinds};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::expression::Node;
use crate::quantities::{AngleContent, Dimension, Unit};
use crate::syntax::{Declared, EventDeclaration, Expression, Field, Name, StateDeclaration};

pub(super) struct Instance<'a> {
    /// Name of the element.
    pub owner: &'a str,
    /// `force`, `effect`, for messages.
    pub sort: &'static str,
    pub span: Span,
    pub site: Site,
    /// How many effects of the site act before this instance reads its ports.
    pub step: usize,
    pub is_effect: bool,
    /// Ports and parameters of a law, amplitudes and shapes of an effect.
    pub declared: Vec<&'a Declared>,
    pub bindings: &'a [(Name, Expression)],
    pub states: &'a [StateDeclaration],
    pub events: &'a [EventDeclaration],
    pub fields: Vec<FlatField<'a>>,
    pub kinds: Kinds,
    pub progress: Progress,
    /// `x`, `v`, `inertia` where the place provides them.
    pub place_ports: Vec<(&'a str, Typed)>,
}

/// How far the kinds of an instance are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    Open,
    Inferring,
    Known,
}

impl Instance<'_> {
    pub fn state_name(&self, index: usize) -> String {
        format!("{}.{}", self.owner, self.states[index].name.text)
    }

    pub fn place_port(&self, name: &str) -> Option<Typed> {
        self.place_ports.iter().find(|(port, _)| *port == name).map(|(_, value)| *value)
    }
}

/// Words that paths to an element use for themselves.
const OCCUPIED: [&str; 6] = ["force", "torque", "elongation", "rate", "value", "sensor"];

impl<'a> Checker<'a> {
    /// Registers an instance after a look at its fields; `reserved` ones belong to the place, not to the law.
    pub fn add_instance(
        &mut self,
        mut instance: Instance<'a>,
        fields: &'a [Field],
        reserved: &[&str],
        law: &'a Name,
    ) -> usize {
        let mut diagnostics = Vec::new();
        instance.fields = flatten(fields, &mut diagnostics);
        instance.fields.retain(|field| !reserved.contains(&field.path.as_str()));
        let index = self.instances.len();
        self.instances.push(instance);
        for diagnostic in diagnostics {
            self.report(diagnostic, Scope::Study(Allowed::Constant));
        }
        self.check_fields(index, law);
        index
    }

    /// Every field is known and every port and parameter without default is bound.
    fn check_fields(&mut self, index: usize, law: &'a Name) {
        let instance = &self.instances[index];
        let sort = if instance.is_effect { "effect" } else { "law" };
        let mut findings = Vec::new();
        let names: Vec<&'a str> = instance.declared.iter().map(|declared| declared.name.text.as_str()).collect();
        let free: Vec<&'a str> = names.iter().copied().filter(|name| instance.place_port(name).is_none()).collect();
        for field in &instance.fields {
            if instance.place_port(&field.path).is_some() {
                let message = format!("`{}` is given by the place of `{}`", field.path, instance.owner);
                findings.push(Diagnostic::error(Code::UNKNOWN_FIELD, message).label(field.span, "remove it"));
            } else if !names.contains(&field.path.as_str()) {
                let listed = if free.is_empty() { "none".to_owned() } else { free.join(", ") };
                findings.push(
                    Diagnostic::error(Code::UNKNOWN_FIELD, format!("{sort} `{}` has no `{}`", law.text, field.path))
                        .label(field.span, "not known here")
                        .suggest(similar_name(&field.path, free.iter().copied()))
                        .note(format!("fields of `{}`: {listed}", law.text)),
                );
            } else if field.expression.is_none() {
                let message = format!("`{}` must be a number or an expression", field.path);
                findings.push(Diagnostic::error(Code::WRONG_VALUE, message).label(field.span, ""));
            }
        }
        let is_missing = |declared: &&&'a Declared| {
            let name = declared.name.text.as_str();
            declared.default.is_none()
                && instance.place_port(name).is_none()
                && !instance.fields.iter().any(|field| field.path == name)
        };
        for declared in instance.declared.iter().filter(is_missing) {
            let name = &declared.name.text;
            findings.push(
                Diagnostic::error(Code::MISSING_FIELD, format!("`{}` needs `{name}`", instance.owner))
                    .label(law.span, format!("{sort} `{}` is given no `{name}`", law.text))
                    .secondary(declared.name.span, "declared here")
                    .help(format!("add `{name} = ..` between the braces")),
            );
        }
        for state in instance.states.iter().filter(|state| OCCUPIED.contains(&state.name.text.as_str())) {
            let message = format!("a state cannot be called `{}`", state.name.text);
            findings.push(
                Diagnostic::error(Code::INVALID_DECLARATION, message)
                    .label(state.name.span, "means something else after an element's name"),
            );
        }
        for finding in findings {
            self.report(finding, Scope::Study(Allowed::Constant));
        }
    }

    /// What `name` means inside a law or effect.
    pub fn local(&mut self, index: usize, name: &'a Name) -> Option<Typed> {
        let text = name.text.as_str();
        let instance = &self.instances[index];
        let (site, step, is_effect) = (instance.site, instance.step, instance.is_effect);
        let is_declared = instance.declared.iter().any(|declared| declared.name.text == text);
        if !is_effect && (is_declared || instance.place_port(text).is_some()) {
            return self.port(site, text, step, name.span);
        }
        if is_declared {
            return self.own_field(index, text, name.span);
        }
        if let Some(at) = instance.bindings.iter().position(|(binding, _)| binding.text == text) {
            let expression = &instance.bindings[at].1;
            let find = |checker: &mut Checker<'a>| checker.evaluate(expression, Scope::Instance(index));
            return self.once(Key::Binding(index, at), name.span, find);
        }
        if let Some(at) = instance.states.iter().position(|state| state.name.text == text) {
            return self.state(index, at, name.span);
        }
        if is_effect && let Some(port) = self.site_port(site, text) {
            return self.port(site, port, step, name.span);
        }
        match text {
            "t" => {
                let node = self.graph.variable(self.time);
                Some(Typed::new(node, Dimension::TIME))
            }
            "normal" if let Site::JointEffect(effect) = site => self.normal_force(effect, name),
            "pi" => Some(Typed::new(self.graph.constant(std::f64::consts::PI), Dimension::ONE)),
            _ => self.unknown_local(index, name),
        }
    }

    fn unknown_local(&mut self, index: usize, name: &'a Name) -> Option<Typed> {
        let instance = &self.instances[index];
        let mut known: Vec<String> = instance.declared.iter().map(|declared| declared.name.text.clone()).collect();
        known.extend(instance.bindings.iter().map(|(binding, _)| binding.text.clone()));
        known.extend(instance.states.iter().map(|state| state.name.text.clone()));
        if instance.is_effect {
            known.extend(self.site_ports(instance.site));
        }
        known.extend(["t".to_owned(), "pi".to_owned()]);
        let message = format!("there is no `{}` in this declaration", name.text);
        let mut diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
            .label(name.span, "not declared here")
            .note(format!("known here: {}", known.join(", ")));
        if Unit::parse(&name.text).is_ok() {
            let unit = &name.text;
            diagnostic =
                diagnostic.help(format!("`{unit}` as a unit stands right behind its number: `2 {unit}`, `2 1/{unit}`"));
        } else {
            diagnostic = diagnostic.suggest(similar_name(&name.text, known.iter().map(String::as_str)));
        }
        self.fail(diagnostic, Scope::Instance(index))
    }

    /// A field or its default, checked against its declared type.
    pub fn own_field(&mut self, index: usize, name: &'a str, at: Span) -> Option<Typed> {
        self.once(Key::Field(index, name), at, |checker| {
            let declared = checker.declaration(index, name)?;
            let value = checker.raw_field(index, name, at)?;
            let Some(kind) = &declared.kind else { return Some(value) };
            let form = checker.form(kind)?;
            checker.infer_kinds(index);
            let written = declared.name.span.to(kind.span);
            let span = checker.field_span(index, name).unwrap_or(written);
            checker.check_writing(kind, value, span, written)?;
            let wanted = form.dimension(&checker.instances[index].kinds);
            let Some(wanted) = wanted else { return checker.fail_inference(index, declared) };
            let because = format!("`{name}`");
            checker.expect(value, span, wanted, (written, &because), Scope::Study(Allowed::Constant))
        })
    }

    fn raw_field(&mut self, index: usize, name: &'a str, at: Span) -> Option<Typed> {
        self.once(Key::Raw(index, name), at, |checker| {
            let instance = &checker.instances[index];
            match instance.fields.iter().find(|field| field.path == name) {
                Some(field) => {
                    let (expression, owner) = (field.expression?, instance.owner);
                    checker.field_value(&format!("{owner}.{name}"), expression, Allowed::Motion)
                }
                None => {
                    let default = checker.declaration(index, name)?.default.as_ref()?;
                    checker.evaluate(default, Scope::Instance(index))
                }
            }
        })
    }

    fn declaration(&self, index: usize, name: &str) -> Option<&'a Declared> {
        self.instances[index].declared.iter().copied().find(|declared| declared.name.text == name)
    }

    fn field_span(&self, index: usize, name: &str) -> Option<Span> {
        let field = self.instances[index].fields.iter().find(|field| field.path == name)?;
        field.expression.map(|expression| expression.span)
    }

    /// Hz is no rad/s: a declared `frequency` or `angular_velocity` insists.
    pub fn check_writing(
        &mut self,
        kind: &crate::syntax::TypeExpression,
        value: Typed,
        span: Span,
        declared: Span,
    ) -> Option<()> {
        let [(name, 1)] = kind.factors.as_slice() else { return Some(()) };
        let (wrong, help) = match name.text.as_str() {
            "frequency" => (AngleContent::Angle, "give it in Hz; 1 Hz = 6.283 rad/s"),
            "angular_velocity" => (AngleContent::Cycles, "give it in rad/s or rpm; 1 Hz = 6.283 rad/s"),
            _ => return Some(()),
        };
        if value.writing != wrong {
            return Some(());
        }
        let (found, wanted) = if wrong == AngleContent::Angle {
            ("an angular velocity", "a frequency")
        } else {
            ("a frequency", "an angular velocity")
        };
        let diagnostic = Diagnostic::error(Code::FREQUENCY_UNIT, format!("{wanted} expected, found {found}"))
            .label(span, format!("this is {found}"))
            .secondary(declared, format!("declared as {wanted}"))
            .help(help);
        self.fail(diagnostic, Scope::Study(Allowed::Constant))
    }

    pub fn form(&mut self, kind: &'a crate::syntax::TypeExpression) -> Option<Form> {
        match Form::read(kind) {
            Ok(form) => Some(form),
            Err(diagnostic) => self.fail(diagnostic, Scope::Study(Allowed::Constant)),
        }
    }

    fn fail_inference(&mut self, index: usize, declared: &'a Declared) -> Option<Typed> {
        let owner = self.instances[index].owner;
        let message = format!("the dimension of `{}` of `{owner}` is not known", declared.name.text);
        let diagnostic = Diagnostic::error(Code::DIMENSION_MISMATCH, message)
            .label(self.instances[index].span, "the fields given here do not tell it")
            .secondary(declared.span, "declared here");
        self.fail(diagnostic, Scope::Study(Allowed::Constant))
    }

    /// Learns what `coordinate`, `load` and `value` stand for from the fields, plain numbers first.
    pub fn infer_kinds(&mut self, index: usize) {
        if self.instances[index].progress != Progress::Open {
            return;
        }
        self.instances[index].progress = Progress::Inferring;
        self.infer_value(index);
        let mut candidates: Vec<(&'a str, Form, bool)> = Vec::new();
        for declared in self.instances[index].declared.clone() {
            let name = declared.name.text.as_str();
            let Some(kind) = &declared.kind else { continue };
            let Ok(form) = Form::read(kind) else { continue };
            let instance = &self.instances[index];
            if form.is_open(&instance.kinds) && instance.place_port(name).is_none() {
                let field = instance.fields.iter().find(|field| field.path == name);
                let plain = field.and_then(|field| field.expression).is_some_and(|value| literal(value).is_some());
                candidates.push((name, form, plain));
            }
        }
        candidates.sort_by_key(|(_, _, plain)| !plain);
        // Each round may make a further type solvable.
        for _ in 0..3 {
            for (name, form, _) in &candidates {
                let mut kinds = self.instances[index].kinds;
                let needed = form.is_open(&kinds) && !self.is_busy(Key::Raw(index, name));
                if needed && let Some(value) = self.raw_field(index, name, self.instances[index].span) {
                    form.infer(value.dimension, &mut kinds);
                    self.instances[index].kinds = kinds;
                }
            }
        }
        self.instances[index].progress = Progress::Known;
    }

    /// `value` at an effect: the dimension of the quantity it acts on; at an actuator that of its command.
    fn infer_value(&mut self, index: usize) {
        let instance = &self.instances[index];
        let (site, span) = (instance.site, instance.span);
        if !instance.is_effect || instance.kinds.value.is_some() {
            return;
        }
        let port = match site {
            Site::Input(_) | Site::Measure(_) | Site::Signal(_) | Site::Gravity(_) => super::ports::principal(site).0,
            Site::Force(_) => "command",
            Site::JointEffect(_) | Site::Trial(_) => return,
        };
        if self.site_port(site, port).is_some()
            && let Some(value) = self.port(site, port, 0, span)
        {
            self.instances[index].kinds.value = Some(value.dimension);
        }
    }

    /// A state as a symbol with its dimension.
    pub fn state(&mut self, index: usize, at: usize, span: Span) -> Option<Typed> {
        self.once(Key::State(index, at), span, |checker| {
            let declaration = &checker.instances[index].states[at];
            let name = checker.instances[index].state_name(at);
            let dimension = match &declaration.kind {
                Some(kind) => {
                    let form = checker.form(kind)?;
                    checker.infer_kinds(index);
                    form.dimension(&checker.instances[index].kinds)?
                }
                None => checker.evaluate(&declaration.initial, Scope::Instance(index))?.dimension,
            };
            let node: Node = checker.graph.named(&name);
            Some(Typed::new(node, dimension))
        })
    }

    /// The value of a field; a plain number may be an identified parameter or become a constant that can be freed.
    pub fn field_value(&mut self, path: &str, expression: &'a Expression, allowed: Allowed) -> Option<Typed> {
        if let Some(parameter) = self.parameter(path) {
            if literal(expression).is_none() {
                let message = format!("`{path}` is not a fixed number and cannot be identified");
                let target = self.parameter_index.get(path).map(|index| self.parameters[*index].span);
                let diagnostic = Diagnostic::error(Code::IDENTIFY_TARGET, message)
                    .label(target.unwrap_or(expression.span), "identified here")
                    .secondary(expression.span, "given by an expression")
                    .help("identify a name that the expression contains");
                return self.fail(diagnostic, Scope::Study(Allowed::Constant));
            }
            return Some(parameter);
        }
        let value = self.evaluate(expression, Scope::Study(allowed))?;
        self.note_constant(path, expression, None);
        Some(value)
    }
}
