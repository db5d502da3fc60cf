//! The study's constraints between parameters.

use crate::expression::{Graph, Node, Symbol};
use crate::fit::Constraints;
use crate::study::Study;

/// The study's constraints as functions of the parameters.
pub(super) struct StudyConstraints {
    graph: Graph,
    symbols: Vec<Symbol>,
    values: Vec<Node>,
    /// Per constraint, by each parameter.
    gradients: Vec<Vec<Node>>,
}

impl StudyConstraints {
    pub fn new(study: &Study) -> Self {
        let written: Vec<Node> = study.constraints.iter().map(|constraint| constraint.value).collect();
        let (mut graph, values) = study.graph.extract(&written);
        let symbols: Vec<Symbol> = study.parameters.iter().map(|parameter| parameter.symbol).collect();
        let by_parameter: Vec<Vec<Node>> = symbols.iter().map(|&symbol| graph.differentiate(&values, symbol)).collect();
        let gradients =
            (0..values.len()).map(|k| by_parameter.iter().map(|derivatives| derivatives[k]).collect()).collect();
        Self { graph, symbols, values, gradients }
    }
}

impl Constraints for StudyConstraints {
    fn evaluate(&self, theta: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let value_of = |symbol: Symbol| {
            self.symbols.iter().position(|other| *other == symbol).map_or(f64::NAN, |index| theta[index])
        };
        let at = |nodes: &[Node]| self.graph.evaluate(nodes, value_of, |_, _, _| f64::NAN);
        (at(&self.values), self.gradients.iter().map(|gradient| at(gradient)).collect())
    }
}

/// Share of its change over the bounds within which a constraint counts as active.
const ACTIVE: f64 = 1e-5;

/// Texts of the study's constraints that hold with equality at `theta`.
pub fn active_constraints<'a>(study: &'a Study, theta: &[f64]) -> Vec<&'a str> {
    let (values, gradients) = StudyConstraints::new(study).evaluate(theta);
    let change = |gradient: &[f64]| {
        gradient.iter().zip(&study.parameters).map(|(slope, p)| (slope * p.scale()).powi(2)).sum::<f64>().sqrt()
    };
    let active = |k: usize| values[k] >= -ACTIVE * change(&gradients[k]);
    study.constraints.iter().enumerate().filter(|(k, _)| active(*k)).map(|(_, c)| c.text.as_str()).collect()
}
