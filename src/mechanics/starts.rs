//! How every experiment starts.

use super::system::{StartEquation, Variable, VariableKind};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Graph, Node, Symbol};
use crate::study::StartBase;
use std::collections::HashMap;

/// Start of every state of one experiment or manoeuvre (what it is, its base, its place), free of other states.
///
/// `initial` holds the law states' declared start values with kinematic symbols already replaced.
pub(super) fn starts(
    graph: &mut Graph,
    states: &[Variable],
    (owner, base, span): (&str, StartBase, Span),
    initial: &HashMap<Symbol, Node>,
    overrides: &[(Symbol, Node)],
) -> Result<Vec<StartEquation>, Vec<Diagnostic>> {
    let zero = graph.constant(0.0);
    let given: Vec<Option<Node>> = states
        .iter()
        .map(|state| {
            let stated = overrides.iter().rev().find(|(symbol, _)| *symbol == state.symbol).map(|&(_, node)| node);
            stated.or(match (base, state.kind) {
                (StartBase::Equilibrium, _) => None,
                (StartBase::Rest, VariableKind::Law) => Some(initial.get(&state.symbol).copied().unwrap_or(zero)),
                (StartBase::Rest, _) => Some(graph.constant(state.reference)),
            })
        })
        .collect();
    let resolved = resolve(graph, states, given);
    let mut errors = Vec::new();
    for (state, value) in states.iter().zip(&resolved) {
        let Some(value) = value else { continue };
        let unknown = graph.symbols_of(&[*value]);
        if let Some(other) = states.iter().find(|other| unknown.contains(&other.symbol)) {
            let message = format!(
                "the start value of `{}` in {owner} depends on `{}`, which is not known at the start",
                state.name, other.name
            );
            errors.push(
                Diagnostic::error(Code::UNKNOWN_START, message)
                    .label(span, "started here")
                    .help(format!("give `{}` a start value by parameters and numbers only", state.name)),
            );
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    Ok(resolved.into_iter().map(|value| value.map_or(StartEquation::Equilibrium, StartEquation::Value)).collect())
}

/// Replaces states in start values by their own start values, as often as that changes anything: at most once per
/// state unless the values go in a circle.
fn resolve(graph: &mut Graph, states: &[Variable], mut given: Vec<Option<Node>>) -> Vec<Option<Node>> {
    for _ in 0..=states.len() {
        let known: HashMap<Symbol, Node> =
            states.iter().zip(&given).filter_map(|(state, value)| Some((state.symbol, (*value)?))).collect();
        let roots: Vec<Node> = given.iter().flatten().copied().collect();
        let new = graph.substitute(&roots, &known);
        if new == roots {
            break;
        }
        let mut new = new.into_iter();
        given = given.into_iter().map(|value| value.and_then(|_| new.next())).collect();
    }
    given
}
