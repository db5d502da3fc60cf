//! Arguments and ports of parts, after models are written out.

use super::checker::{Allowed, Checker, Entity, Key, Scope};
use super::declarations::Declarations;
use super::kinds::Kinds;
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::syntax::Name;

const SCOPE: Scope = Scope::Study(Allowed::Acceleration);

impl<'a> Checker<'a> {
    /// Every port is bound to something of its kind.
    pub fn check_ports(&mut self) {
        let declared: &'a Declarations<'a> = self.declared;
        for check in declared.ports {
            let (first, rest) = self.split_path(&check.place.text);
            let entity = self.entities.get(first).copied();
            let is_body = first == "ground" || matches!(entity, Some(Entity::Body(_)));
            let fits = match (check.kind.text.as_str(), entity, rest) {
                ("point", ..) if is_body => self.end(&check.place).is_some() || self.end_is_reported(&check.place),
                ("body", _, None) => is_body,
                ("joint", Some(Entity::Joint(_)), None) | ("force", Some(Entity::Force(_)), None) => true,
                ("signal", Some(Entity::Signal(_) | Entity::Input(_)), None) => true,
                // Reported where the model is written out.
                (kind, ..) => !["point", "body", "joint", "force", "signal"].contains(&kind),
            };
            if fits {
                continue;
            }
            if first.is_empty() {
                continue;
            }
            if entity.is_none() && !is_body {
                let names = self.all_names();
                let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no `{first}`"))
                    .label(check.place.span, format!("a {} is needed here", check.kind.text))
                    .secondary(check.port.span, "the port")
                    .suggest(similar_name(first, names.iter().copied()));
                self.fail_unknown::<()>(first, diagnostic, SCOPE);
                continue;
            }
            let message = format!("`{}` is no {}", check.place.text, check.kind.text);
            let diagnostic = Diagnostic::error(Code::PORTS, message)
                .label(check.place.span, format!("bound to a port of part `{}`", check.part))
                .secondary(check.kind.span, format!("a {} is needed", check.kind.text));
            self.report(diagnostic, SCOPE);
            self.ignore_unknown(first);
        }
    }

    /// [`Checker::end`] has said what is wrong with the place.
    fn end_is_reported(&self, place: &Name) -> bool {
        self.diagnostics.iter().any(|diagnostic| diagnostic.span() == Some(place.span))
    }

    /// Every argument has the type that the model declares.
    pub fn check_arguments(&mut self) {
        let declared: &'a Declarations<'a> = self.declared;
        for check in declared.arguments {
            let Some(kind) = &check.kind else {
                let message = format!("parameter `{}` of the model has no type", check.declared.text);
                let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, message)
                    .label(check.declared.span, "no type")
                    .help(format!("write e.g. `param {}: stiffness`", check.declared.text));
                self.report(diagnostic, SCOPE);
                continue;
            };
            let Some(form) = self.form(kind) else { continue };
            let Some(dimension) = form.dimension(&Kinds::default()) else {
                let message = format!("the type of `{}` depends on a place", check.declared.text);
                let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, message)
                    .label(kind.span, "`coordinate`, `rate`, `load` and `value` belong to laws")
                    .help("a model has types of its own, e.g. `length`, `force`, `stiffness`, `torque`");
                self.report(diagnostic, SCOPE);
                continue;
            };
            let Some(value) = self.evaluate(&check.value, SCOPE) else { continue };
            let because = format!("`{}` of part `{}`", check.declared.text, check.part);
            let fits = self.expect(value, check.value.span, dimension, (check.declared.span, &because), SCOPE);
            let fits = fits.and_then(|value| self.check_writing(kind, value, check.value.span, check.declared.span));
            let constant = format!("{}.{}", check.part, check.declared.text);
            if let (None, Some(Entity::Constant(index))) = (fits, self.entities.get(constant.as_str())) {
                self.invalidate(Key::Constant(*index));
            }
        }
    }
}
