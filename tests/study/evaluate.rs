//! A second, naive evaluation of expressions.

use ident::diagnostics::render;
use ident::expression::{Node, Operation};
use ident::study::{Study, check, load_text};
use std::collections::HashMap;

/// The study of a text that must be sound.
pub fn study(text: &str) -> Study {
    variant(text, None)
}

pub fn variant(text: &str, name: Option<&str>) -> Study {
    let loaded = load_text("study", text);
    match check(&loaded, name) {
        Ok(checked) => checked.study,
        Err(findings) => panic!("{}\n{text}", render(&findings, &loaded.sources, false)),
    }
}

/// Value of a node; symbols by name, input `i` at time `t` is `sin((i + 1) t)`.
pub fn value(study: &Study, node: Node, values: &[(&str, f64)]) -> f64 {
    let mut known: HashMap<Node, f64> = HashMap::new();
    for node in study.graph.reachable(&[node]) {
        let value = match study.graph.operation(node) {
            Operation::Constant(bits) => f64::from_bits(bits),
            Operation::Symbol(symbol) => {
                let name = study.graph.symbol_name(symbol);
                let found = values.iter().find(|(other, _)| *other == name);
                found.unwrap_or_else(|| panic!("no value for `{name}`")).1
            }
            Operation::Unary(function, a) => function.evaluate(known[&a]),
            Operation::Binary(function, a, b) => function.evaluate(known[&a], known[&b]),
            Operation::Select { condition, then, otherwise } => {
                if known[&condition] != 0.0 {
                    known[&then]
                } else {
                    known[&otherwise]
                }
            }
            Operation::Sample { input, order, time } if study.graph.curve(input).is_some() => {
                study.graph.curve(input).expect("a curve").evaluate(known[&time], order)
            }
            Operation::Sample { input, order, time } => {
                let omega = f64::from(input) + 1.0;
                let phase = omega * known[&time] + f64::from(order) * std::f64::consts::FRAC_PI_2;
                omega.powi(i32::from(order)) * phase.sin()
            }
        };
        known.insert(node, value);
    }
    known[&node]
}

pub fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e-9), "{found} instead of {expected}");
}
