//! What names mean within a model or a family.

use crate::syntax::{Expression, Name};
use std::collections::{BTreeMap, BTreeSet};

/// The default is the scope of the study itself, where names stand for themselves.
#[derive(Clone, Default)]
pub(super) struct Scope {
    /// `front.`
    pub prefix: String,
    /// The model being written out.
    pub model: Option<Name>,
    /// Loop variables with their present values, the outermost first.
    pub variables: Vec<(String, i64)>,
    /// Names that the model declares, without indices.
    pub locals: BTreeSet<String>,
    /// Flat path that each port stands for.
    pub ports: BTreeMap<String, Name>,
    pub parameters: BTreeMap<String, Argument>,
}

#[derive(Clone)]
pub(super) enum Argument {
    /// A number; the flat study declares it as the constant of this name.
    Number { constant: String, value: Expression },
    /// Anything else, in terms of the flat study.
    Expression(Expression),
    /// Not given; reported already.
    Missing,
}

impl Scope {
    pub fn variable(&self, name: &str) -> Option<i64> {
        self.variables.iter().rev().find(|(variable, _)| variable == name).map(|(_, value)| *value)
    }

    /// All names that can be written here, for suggestions.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.locals.iter().map(String::as_str).collect();
        names.extend(self.ports.keys().map(String::as_str));
        names.extend(self.parameters.keys().map(String::as_str));
        names.extend(self.variables.iter().map(|(name, _)| name.as_str()));
        names
    }
}

/// A path cut at its dots: (name, text of the index).
pub(super) fn segments(path: &str) -> Vec<(&str, Option<&str>)> {
    let mut segments = Vec::new();
    let mut rest = path;
    while !rest.is_empty() {
        let end = rest.find(['.', '[']).unwrap_or(rest.len());
        let (name, behind) = rest.split_at(end);
        let (index, behind) = match behind.strip_prefix('[').and_then(|inside| inside.split_once(']')) {
            Some((index, behind)) => (Some(index), behind),
            None => (None, behind),
        };
        segments.push((name, index));
        rest = behind.strip_prefix('.').unwrap_or(if behind.len() < rest.len() { behind } else { "" });
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::segments;

    #[test]
    fn paths_are_cut_at_their_dots() {
        assert_eq!(segments("a.b"), [("a", None), ("b", None)]);
        assert_eq!(segments("w[i+1.5].x"), [("w", Some("i+1.5")), ("x", None)]);
        assert_eq!(segments("w[1,2]"), [("w", Some("1,2"))]);
    }
}
