//! The equations of motion as LaTeX (`ident compile --emit latex`), for small models.

use super::system::System;
use crate::expression::{LatexPrinter, Node, latex_name};
use crate::study::Study;
use std::fmt::Write;

/// Rates of the states, constraints and measures as an `align*` environment (package amsmath).
///
/// Coordinates are `q`, their rates `\\dot q`, both with the joint's name as index; common subexpressions are `e_1`,
/// `e_2`, ...
pub fn emit_latex(study: &Study, system: &System) -> String {
    let inputs: Vec<String> = study.inputs.iter().map(|input| input.name.clone()).collect();
    let mut roots: Vec<Node> = system.rates.iter().chain(&system.constraints).copied().collect();
    roots.extend(system.outputs.iter().map(|output| output.value));
    let printer = LatexPrinter::new(&system.graph, &inputs, &roots, symbol);
    let mut lines: Vec<String> = Vec::new();
    for (state, &rate) in system.states.iter().zip(&system.rates) {
        let (left, right) = (rate_of(&state.name), printer.text(rate));
        // That a coordinate's rate is its velocity goes without saying.
        if left != right {
            lines.push(format!("{left} &= {right}"));
        }
    }
    for &constraint in &system.constraints {
        lines.push(format!("0 &= {}", printer.text(constraint)));
    }
    for output in &system.outputs {
        lines.push(format!("{} &= {}", latex_name(&output.name), printer.text(output.value)));
    }
    lines.extend(printer.definitions().into_iter().map(|(name, formula)| format!("{name} &= {formula}")));
    let mut text = format!("% {}\\begin{{align*}}\n", super::emit::head("latex", study));
    let _ = writeln!(text, "  {}", lines.join(" \\\\\n  "));
    text + "\\end{align*}\n"
}

/// Coordinates and rates as a mechanic writes them, all else by name.
fn symbol(name: &str) -> String {
    let index = |joint: &str| format!(r"_{{\mathrm{{{}}}}}", joint.replace('_', r"\_"));
    match name.rsplit_once('.') {
        Some((joint, "position")) => format!("q{}", index(joint)),
        Some((joint, "velocity")) => format!(r"\dot q{}", index(joint)),
        _ => latex_name(name),
    }
}

fn rate_of(name: &str) -> String {
    match name.rsplit_once('.') {
        Some((joint, "position")) => symbol(&format!("{joint}.velocity")),
        Some((joint, "velocity")) => symbol(&format!("{joint}.position")).replacen('q', r"\ddot q", 1),
        _ => format!(r"\dot{{{}}}", symbol(name)),
    }
}
