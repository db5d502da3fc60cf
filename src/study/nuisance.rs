//! Parameters that differ between experiments: values of their own, offsets of single channels.
//!
//! Expressions refer to the running experiment by a sample of an input behind the study's last one
//! (see `RecordInputs`); every experiment's value is a parameter like any other.

use super::checker::{Allowed, Checker, Entity, Scope};
use super::fields::{find, flatten, value_span};
use super::model::Parameter;
use super::units::read_unit;
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::expression::{Binary, Node, Unary};
use crate::syntax::Value;

const SCOPE: Scope = Scope::Study(Allowed::Number);

impl<'a> Checker<'a> {
    /// Positions among the declared experiments, with names, of those that are fitted.
    fn estimation_experiments(&self) -> Vec<(usize, String)> {
        let declared = &self.declared.experiments;
        let fitted = |role: Option<&crate::syntax::Name>| role.is_none_or(|role| role.text == "estimation");
        let numbered = declared.iter().enumerate().filter(|(_, experiment)| fitted(experiment.role));
        numbered.map(|(index, experiment)| (index, experiment.name.text.clone())).collect()
    }

    /// 1 in experiment `index`, else 0.
    fn in_experiment(&mut self, index: usize) -> Node {
        let behind_the_last = self.declared.inputs.len() as u32;
        let time = self.graph.variable(self.time);
        let running = self.graph.sample(behind_the_last, 0, time);
        let own = self.graph.constant(index as f64);
        let difference = self.graph.subtract(running, own);
        let distance = self.graph.unary(Unary::Abs, difference);
        let half = self.graph.constant(0.5);
        self.graph.binary(Binary::Less, distance, half)
    }

    /// One parameter per fitted experiment; all other experiments and manoeuvres take their mean.
    pub fn split_by_experiment(&mut self, parameter: Parameter) {
        let experiments = self.estimation_experiments();
        let target = parameter.name.clone();
        let mut nodes = Vec::new();
        for (index, experiment) in &experiments {
            let name = format!("{target} in {experiment}");
            let symbol = self.graph.symbol(&name);
            nodes.push((*index, self.graph.variable(symbol)));
            self.parameters.push(Parameter { name, symbol, ..parameter.clone() });
            self.parameter_met.push(true);
        }
        if nodes.is_empty() {
            let diagnostic = Diagnostic::error(Code::NO_ESTIMATION_RECORD, "no experiment is fitted")
                .label(parameter.span, "a value for each experiment")
                .help("declare an experiment with the role `estimation`");
            self.report(diagnostic, SCOPE);
            self.parameters.push(parameter);
            self.parameter_met.push(true);
            return;
        }
        let zero = self.graph.constant(0.0);
        let sum = nodes.iter().fold(zero, |sum, (_, node)| self.graph.add(sum, *node));
        let count = self.graph.constant(nodes.len() as f64);
        let mean = self.graph.divide(sum, count);
        let chosen = nodes.into_iter().rev().fold(mean, |rest, (index, node)| {
            let here = self.in_experiment(index);
            self.graph.select(here, node, rest)
        });
        self.per_experiment.insert(target, chosen);
    }

    /// `offsets = { z_body = 5 mm }`: an unknown offset within +- 5 mm.
    pub fn read_offsets(&mut self) {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        for (index, experiment) in declared.experiments.iter().enumerate() {
            let Some(field) = find(experiment.fields, "offsets") else { continue };
            let Value::Block { word: None, fields, .. } = &field.value else {
                let _: Option<()> = self.wrong_value(field, "a list like `{ z_body = 5 mm }`");
                continue;
            };
            if experiment.role.is_some_and(|role| role.text != "estimation") {
                let diagnostic =
                    Diagnostic::error(Code::WRONG_VALUE, "only fitted experiments can have unknown offsets")
                        .label(value_span(field), "this one is held out")
                        .help("`filter { remove_mean }` takes constant offsets out of all comparisons");
                self.report(diagnostic, SCOPE);
                continue;
            }
            let mut findings = Vec::new();
            for offset in flatten(fields, &mut findings) {
                self.read_offset(index, &experiment.name.text, &offset);
            }
            findings.into_iter().for_each(|finding| self.report(finding, SCOPE));
        }
    }

    fn read_offset(&mut self, experiment: usize, owner: &str, offset: &super::fields::FlatField<'a>) -> Option<()> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let Some(Entity::Measure(measure)) = self.entities.get(offset.path.as_str()).copied() else {
            let names = declared.measures.iter().map(|measure| measure.name.text.as_str());
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no measure `{}`", offset.path))
                .label(offset.span, "not declared")
                .suggest(similar_name(&offset.path, names));
            return self.fail(diagnostic, SCOPE);
        };
        let expression = offset.expression?;
        let value = self.evaluate(expression, SCOPE)?;
        let written = super::identify::written_unit(expression).and_then(|unit| read_unit(unit).ok());
        let unit = written.unwrap_or_else(|| crate::quantities::Unit::coherent(value.dimension));
        if let Some(measured) = declared.measures[measure].unit.and_then(|unit| read_unit(unit).ok()) {
            self.expect(value, expression.span, measured.dimension, (offset.span, "the measure has"), SCOPE)?;
        }
        let limit = self.graph.constant_value(value.node)? - unit.offset;
        if !(limit > 0.0 && limit.is_finite()) {
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "the largest offset must be positive")
                .label(expression.span, "not above zero");
            return self.fail(diagnostic, SCOPE);
        }
        let name = format!("offset of {} in {owner}", offset.path);
        let symbol = self.graph.symbol(&name);
        let node = self.graph.variable(symbol);
        let unit = crate::quantities::Unit { offset: 0.0, ..unit };
        let (lower, upper, span) = (-limit, limit, offset.span);
        self.parameters.push(Parameter { name, symbol, unit, lower, upper, start: 0.0, prior: None, span });
        self.parameter_met.push(true);
        self.offsets.push((measure, experiment, node));
        Some(())
    }

    /// A measure's value with the offsets of single experiments.
    pub fn with_offsets(&mut self, measure: usize, value: Node) -> Node {
        let own: Vec<(usize, Node)> =
            self.offsets.iter().filter(|(of, ..)| *of == measure).map(|(_, at, node)| (*at, *node)).collect();
        own.into_iter().fold(value, |sum, (experiment, offset)| {
            let here = self.in_experiment(experiment);
            let zero = self.graph.constant(0.0);
            let added = self.graph.select(here, offset, zero);
            self.graph.add(sum, added)
        })
    }
}
