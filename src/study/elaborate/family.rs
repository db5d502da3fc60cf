//! Index families: `for i in 1 .. 4 { .. }`.

use super::number::{NoNumber, whole};
use super::scope::Scope;
use super::{Elaborator, variants};
use crate::diagnostics::{Code, Diagnostic};
use crate::study::names::RESERVED;
use crate::syntax::{Expression, Item, ItemKind, Name};

/// Larger families are refused.
const MOST_MEMBERS: i64 = 2_000;

impl Elaborator<'_, '_> {
    /// `None`: the family could not be written out; reported.
    pub fn expand_family(
        &mut self,
        variable: Name,
        low: Expression,
        high: Expression,
        items: &[Item],
        scope: &Scope,
    ) -> Option<()> {
        let (first, last) = (self.limit(&low, scope), self.limit(&high, scope));
        let (first, last) = (first?, last?);
        let name = variable.text.clone();
        let is_taken = scope.names().contains(&name.as_str()) || RESERVED.contains(&name.as_str());
        if is_taken || self.constants.contains_key(&name) {
            let message = format!("the variable `{name}` hides something of the same name");
            let diagnostic =
                Diagnostic::error(Code::DUPLICATE_NAME, message).label(variable.span, "choose another name");
            self.report(diagnostic);
            return None;
        }
        let count = last - first + 1;
        let span = low.span.to(high.span);
        if count < 1 {
            let diagnostic = Diagnostic::error(Code::FAMILY_RANGE, "the family has no members")
                .label(span, format!("from {first} to {last}"))
                .help("the range runs from the smaller to the larger number, both included");
            self.report(diagnostic);
            return None;
        }
        if count > MOST_MEMBERS {
            let diagnostic = Diagnostic::error(Code::FAMILY_RANGE, format!("the family has {count} members"))
                .label(span, format!("more than {MOST_MEMBERS}"))
                .help("use an elastic body instead of a chain of rigid ones");
            self.report(diagnostic);
            return None;
        }
        if let Some(item) = items.iter().find(|item| !is_indexed(item, &name)) {
            self.report_shared_name(item, &name);
            return None;
        }
        let mut inner = scope.clone();
        for value in first..=last {
            inner.variables.push((name.clone(), value));
            items.iter().for_each(|item| self.expand(item.clone(), &inner));
            inner.variables.pop();
        }
        Some(())
    }

    fn report_shared_name(&mut self, item: &Item, variable: &str) {
        if let ItemKind::Family { items, .. } = &item.kind {
            items
                .iter()
                .filter(|item| !is_indexed(item, variable))
                .for_each(|item| self.report_shared_name(item, variable));
        }
        let Some(name) = variants::declared_name(&item.kind) else { return };
        let message = format!("every member of the family would be called `{}`", name.text);
        let diagnostic = Diagnostic::error(Code::FAMILY_NAME, message)
            .label(name.span, format!("the variable `{variable}` is not part of the name"))
            .help(format!("write `{}[{variable}]`", name.text));
        self.report(diagnostic);
    }

    fn limit(&mut self, expression: &Expression, scope: &Scope) -> Option<i64> {
        let cause = match self.number(expression, scope, 0).and_then(whole) {
            Ok(value) => return Some(value),
            Err(cause) => cause,
        };
        let label = match cause {
            NoNumber::Name(name) => format!("`{name}` is neither a constant nor a variable"),
            NoNumber::HasUnit(unit) => format!("has the unit `{unit}`"),
            NoNumber::NotWhole(value) => format!("this is {value}"),
            NoNumber::Unsuitable => "not known before the simulation".to_owned(),
        };
        let diagnostic = Diagnostic::error(Code::FAMILY_RANGE, "a family runs over whole numbers")
            .label(expression.span, label)
            .help("write numbers, constants, arguments of the model, or variables of outer families");
        self.report(diagnostic);
        None
    }
}

/// Whether the names that the item declares differ from member to member.
fn is_indexed(item: &Item, variable: &str) -> bool {
    if let ItemKind::Family { items, .. } = &item.kind {
        return items.iter().all(|item| is_indexed(item, variable));
    }
    let Some(name) = variants::declared_name(&item.kind) else { return true };
    let is_word = |sign: char| sign.is_alphanumeric() || sign == '_';
    name.text.split_once('[').is_some_and(|(_, index)| index.split(|sign| !is_word(sign)).any(|word| word == variable))
}
