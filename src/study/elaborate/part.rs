//! Uses of models: `part front: bogie at chassis.front { stiffness = c }`.

use super::scope::{Argument, Scope};
use super::{ArgumentCheck, Elaborator, PortCheck, same_place, variants};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::study::evaluate::literal;
use crate::study::names::RESERVED;
use crate::syntax::{Declared, Expression, Field, Item, ItemKind, ModelDeclaration, Name, Value};
use std::collections::BTreeSet;

/// Models may contain parts this deep.
const DEEPEST: usize = 16;

impl<'t> Elaborator<'t, '_> {
    pub fn expand_part(
        &mut self,
        mut name: Name,
        model: &Name,
        mut places: Vec<Name>,
        mut fields: Vec<Field>,
        scope: &Scope,
    ) {
        self.declared_name(&mut name, scope);
        let Some(&declaration) = self.models.get(model.text.as_str()) else {
            self.flat.broken.insert(name.text);
            return self.unknown_model(model);
        };
        if self.stack.contains(&model.text.as_str()) || self.stack.len() >= DEEPEST {
            self.flat.broken.insert(name.text);
            return self.report_recursion(model, declaration);
        }
        for place in &mut places {
            self.reference(place, scope);
        }
        self.fields(&mut fields, &name.text, scope);
        self.flat.parts.push(name.clone());
        let mut inner = Scope {
            prefix: format!("{}.", name.text),
            model: Some(declaration.name.clone()),
            locals: locals(&declaration.items),
            ..Scope::default()
        };
        self.check_model_names(declaration, &inner.locals);
        self.bind_ports(&name, model, declaration, &places, &mut inner);
        self.bind_parameters(&name, model, declaration, fields, &mut inner);
        self.stack.push(&declaration.name.text);
        for item in &declaration.items {
            self.expand(item.clone(), &inner);
        }
        self.stack.pop();
    }

    fn unknown_model(&mut self, model: &Name) {
        let names: Vec<&str> = self.models.keys().copied().collect();
        let mut diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no model `{}`", model.text))
            .label(model.span, "not declared")
            .suggest(similar_name(&model.text, names.iter().copied()));
        if names.is_empty() {
            diagnostic = diagnostic.help(format!("declare it: `model {}(frame: point) {{ .. }}`", model.text));
        } else {
            diagnostic = diagnostic.note(format!("models: {}", names.join(", ")));
        }
        self.report(diagnostic);
    }

    fn report_recursion(&mut self, model: &Name, declaration: &ModelDeclaration) {
        let message = if self.stack.contains(&model.text.as_str()) {
            format!("model `{}` contains itself", model.text)
        } else {
            format!("models are nested more than {DEEPEST} deep")
        };
        let chain: Vec<String> = self.stack.iter().map(|name| format!("`{name}`")).collect();
        let diagnostic = Diagnostic::error(Code::RECURSIVE_MODEL, message)
            .label(model.span, "used here")
            .secondary(declaration.name.span, "declared here")
            .note(format!("{} contains `{}`", chain.join(" contains "), model.text))
            .help("repeat a structure with `for i in 1 .. n { .. }`");
        self.report(diagnostic);
    }

    /// Ports and parameters have names of their own.
    fn check_model_names(&mut self, model: &ModelDeclaration, locals: &BTreeSet<String>) {
        let mut seen: Vec<&Name> = Vec::new();
        for name in model.ports.iter().map(|port| &port.name).chain(model.parameters.iter().map(|item| &item.name)) {
            let twice = seen.iter().any(|other| other.text == name.text) || locals.contains(&name.text);
            if twice || RESERVED.contains(&name.text.as_str()) {
                let message = format!("`{}` has another meaning in model `{}`", name.text, model.name.text);
                let diagnostic =
                    Diagnostic::error(Code::DUPLICATE_NAME, message).label(name.span, "choose another name");
                self.report(diagnostic);
            }
            seen.push(name);
        }
    }

    fn bind_ports(
        &mut self,
        part: &Name,
        model: &Name,
        declaration: &ModelDeclaration,
        places: &[Name],
        inner: &mut Scope,
    ) {
        let ports = &declaration.ports;
        if ports.len() != places.len() {
            let wanted: Vec<String> =
                ports.iter().map(|port| format!("{}: {}", port.name.text, port.kind.text)).collect();
            let message = format!("model `{}` has {}, found {}", model.text, counted(ports.len()), places.len());
            let help = if ports.is_empty() {
                "remove `at ..`".to_owned()
            } else {
                let names: Vec<&str> = ports.iter().map(|port| port.name.text.as_str()).collect();
                format!("write `part {}: {} at {}`", part.text, model.text, names.join(", ").to_uppercase())
            };
            let diagnostic = Diagnostic::error(Code::PORTS, message)
                .label(model.span, if ports.is_empty() { "no ports".to_owned() } else { wanted.join(", ") })
                .secondary(declaration.name.span, "declared here")
                .help(help);
            self.report(diagnostic);
        }
        for (at, port) in ports.iter().enumerate() {
            let known = ["body", "point", "joint", "force", "signal"];
            if !known.contains(&port.kind.text.as_str()) {
                let diagnostic = Diagnostic::error(Code::PORTS, format!("`{}` is no kind of port", port.kind.text))
                    .label(port.kind.span, "not known")
                    .suggest(similar_name(&port.kind.text, known))
                    .note(format!("kinds: {}; numbers are handed in by `param`", known.join(", ")));
                self.report(diagnostic);
            }
            match places.get(at) {
                Some(place) => {
                    inner.ports.insert(port.name.text.clone(), place.clone());
                    self.flat.ports.push(PortCheck {
                        part: part.text.clone(),
                        place: place.clone(),
                        port: port.name.clone(),
                        kind: port.kind.clone(),
                    });
                }
                // Reported above.
                None => {
                    inner.ports.insert(port.name.text.clone(), same_place(part.span, String::new()));
                }
            }
        }
    }

    fn bind_parameters(
        &mut self,
        part: &Name,
        model: &Name,
        declaration: &ModelDeclaration,
        fields: Vec<Field>,
        inner: &mut Scope,
    ) {
        let mut given: Vec<(Name, Option<Expression>)> = Vec::new();
        collect_fields("", fields, &mut given);
        let names: Vec<&str> = declaration.parameters.iter().map(|item| item.name.text.as_str()).collect();
        for (key, _) in &given {
            if !names.contains(&key.text.as_str()) {
                let mut diagnostic =
                    Diagnostic::error(Code::UNKNOWN_FIELD, format!("model `{}` has no `{}`", model.text, key.text))
                        .label(key.span, "not a parameter of the model")
                        .suggest(similar_name(&key.text, names.iter().copied()));
                if !names.is_empty() {
                    diagnostic = diagnostic.note(format!("parameters: {}", names.join(", ")));
                }
                self.report(diagnostic);
            }
        }
        for (at, (key, _)) in given.iter().enumerate() {
            if given[..at].iter().any(|(other, _)| other.text == key.text) {
                let message = format!("`{}` is given twice", key.text);
                self.report(Diagnostic::error(Code::DUPLICATE_NAME, message).label(key.span, "given again"));
            }
        }
        for parameter in &declaration.parameters {
            let own = given.iter().find(|(key, _)| key.text == parameter.name.text);
            let argument = self.argument(part, model, parameter, own, inner);
            inner.parameters.insert(parameter.name.text.clone(), argument);
        }
    }

    fn argument(
        &mut self,
        part: &Name,
        model: &Name,
        parameter: &Declared,
        own: Option<&(Name, Option<Expression>)>,
        inner: &Scope,
    ) -> Argument {
        let name = &parameter.name;
        let (key, value) = match (own, &parameter.default) {
            (Some((key, Some(value))), _) => (key.clone(), value.clone()),
            (Some((key, None)), _) => {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("`{}` is a quantity", key.text))
                    .label(key.span, "needs a number or an expression")
                    .secondary(name.span, "declared here");
                self.report(diagnostic);
                return Argument::Missing;
            }
            // A default may mention parameters before it.
            (None, Some(default)) => {
                let mut value = default.clone();
                self.expression(&mut value, None, inner);
                (name.clone(), value)
            }
            (None, None) => {
                let message = format!("part `{}` needs `{}`", part.text, name.text);
                let diagnostic = Diagnostic::error(Code::MISSING_FIELD, message)
                    .label(part.span, format!("`{}` is missing", name.text))
                    .secondary(name.span, format!("declared by model `{}`", model.text))
                    .help(format!("add `{} = ..` within the braces of the part", name.text));
                self.report(diagnostic);
                return Argument::Missing;
            }
        };
        self.flat.arguments.push(ArgumentCheck {
            part: part.text.clone(),
            declared: name.clone(),
            kind: parameter.kind.clone(),
            value: value.clone(),
        });
        if literal(&value).is_none() {
            return Argument::Expression(value);
        }
        let constant = format!("{}.{}", part.text, name.text);
        let kind = ItemKind::Constant { name: same_place(key.span, constant.clone()), value: value.clone() };
        let item = Item { documentation: parameter.documentation.clone(), kind, span: value.span };
        self.flat.items.push(super::FlatItem { item, by_variant: self.by_variant });
        Argument::Number { constant, value }
    }
}

/// The fields with the full names of groups: `compression = { slope = .. }` is `compression.slope`.
fn collect_fields(prefix: &str, fields: Vec<Field>, into: &mut Vec<(Name, Option<Expression>)>) {
    for field in fields {
        let name = format!("{prefix}{}", field.key.text);
        match field.value {
            Value::Block { word: None, fields, .. } => collect_fields(&format!("{name}."), fields, into),
            Value::Expression(value) => into.push((same_place(field.key.span, name), Some(value))),
            _ => into.push((same_place(field.key.span, name), None)),
        }
    }
}

/// What the items declare, without indices.
pub(super) fn locals(items: &[Item]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for item in items {
        if let ItemKind::Family { items, .. } = &item.kind {
            names.extend(locals(items));
        }
        if let Some(name) = variants::declared_name(&item.kind) {
            names.insert(name.text.split('[').next().unwrap_or_default().to_owned());
        }
    }
    names
}

fn counted(ports: usize) -> String {
    if ports == 1 { "1 port".to_owned() } else { format!("{ports} ports") }
}
