//! Inputs, measures, groups of measures.

use super::checker::{Allowed, Checker, Entity, Scope, SensorState, Site};
use super::evaluate::Typed;
use super::fields::find;
use super::model::{Group, Input, Interpolation, Measure};
use super::units::read_unit;
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::quantities::{Dimension, Unit};
use crate::syntax::Name;

const SCOPE: Scope = Scope::Study(Allowed::Number);

impl<'a> Checker<'a> {
    /// Inputs with their units; must come before anything that samples them.
    pub fn read_inputs(&mut self) {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        for input in &declared.inputs {
            let name = &input.name.text;
            self.known_fields(&format!("input `{name}`"), input.fields, &["interpolation"]);
            let unit = self.unit_or(input.unit, Dimension::ONE);
            let word = find(input.fields, "interpolation")
                .and_then(|field| self.field_word(field, &["hold", "linear", "cubic"]));
            let interpolation = match word {
                Some("hold") => Interpolation::Hold,
                Some("linear") => Interpolation::Linear,
                _ => Interpolation::Cubic,
            };
            let title = text_of(input.title);
            self.inputs.push(Input { name: name.clone(), title, unit, interpolation, span: input.name.span });
        }
    }

    fn unit_or(&mut self, unit: Option<&'a Name>, dimension: Dimension) -> Unit {
        let read = unit.map(read_unit);
        match read {
            Some(Ok(unit)) => unit,
            Some(Err(diagnostic)) => {
                self.report(diagnostic, SCOPE);
                Unit::coherent(dimension)
            }
            None => Unit::coherent(dimension),
        }
    }

    /// The recorded value at the present time.
    pub fn input_value(&mut self, index: usize) -> Typed {
        let time = self.graph.variable(self.time);
        let dimension = self.inputs.get(index).map_or(Dimension::ONE, |input| input.unit.dimension);
        Typed::new(self.graph.sample(index as u32, 0, time), dimension)
    }

    /// The name of an input whose samples are held.
    pub fn held_input_name(&self, index: usize) -> Option<String> {
        let input = self.inputs.get(index)?;
        (input.interpolation == Interpolation::Hold).then(|| input.name.clone())
    }

    /// What a measure's sensor gives, before effects: first its lag, then gain and offset.
    pub fn measure_value(&mut self, index: usize) -> Option<Typed> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let measure = &declared.measures[index];
        let name = &measure.name.text;
        let mut value = self.evaluate(measure.value, Scope::Study(Allowed::Acceleration))?;
        if let Some(written) = measure.unit {
            let unit = match read_unit(written) {
                Ok(unit) => unit,
                Err(diagnostic) => return self.fail(diagnostic, SCOPE),
            };
            let because = (written.span, "the measure is in");
            value = self.expect(value, measure.value.span, unit.dimension, because, SCOPE)?;
        }
        if let Some(lag) = self.sensor_field(index, "lag", Dimension::TIME)? {
            let state = format!("{name}.sensor");
            let symbol = self.graph.symbol(&state);
            let node = self.graph.variable(symbol);
            let difference = self.graph.subtract(value.node, node);
            let derivative = self.graph.divide(difference, lag.node);
            let (initial, dimension, span) = (value.node, value.dimension, measure.name.span);
            self.sensor_states.push(SensorState { name: state, symbol, derivative, initial, dimension, span });
            value.node = node;
        }
        if let Some(gain) = self.sensor_field(index, "gain", Dimension::ONE)? {
            value.node = self.graph.multiply(gain.node, value.node);
        }
        if let Some(offset) = self.sensor_field(index, "offset", value.dimension)? {
            value.node = self.graph.add(value.node, offset.node);
        }
        Some(value)
    }

    /// `Some(None)`: not given; `None`: wrong.
    fn sensor_field(&mut self, index: usize, key: &str, wanted: Dimension) -> Option<Option<Typed>> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let measure = &declared.measures[index];
        let Some(field) = find(measure.fields, key) else { return Some(None) };
        let expression = self.field_expression(field)?;
        let path = format!("{}.{key}", measure.name.text);
        let value = self.field_value(&path, expression, Allowed::Constant)?;
        let because = format!("`{key}`");
        let value = self.expect(value, expression.span, wanted, (field.key.span, &because), SCOPE)?;
        if key == "delay" && self.graph.constant_value(value.node).is_some_and(|delay| delay < 0.0) {
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "a delay must not be negative")
                .label(expression.span, "below zero")
                .help("a sensor does not know the future; delay the other channels instead");
            return self.fail(diagnostic, SCOPE);
        }
        if key == "lag" && self.graph.constant_value(value.node).is_some_and(|lag| lag <= 0.0) {
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "a lag must be positive")
                .label(expression.span, "not above zero")
                .help("leave the field out for a sensor without lag");
            return self.fail(diagnostic, SCOPE);
        }
        Some(Some(value))
    }

    /// All measures; faulty ones are reported and replaced by zero so that indices stay.
    pub fn finished_measures(&mut self) -> Vec<Measure> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let mut measures = Vec::new();
        for (index, measure) in declared.measures.iter().enumerate() {
            let name = measure.name.text.clone();
            let known = ["noise", "weight", "lag", "delay", "gain", "offset", "quantisation"];
            self.known_fields(&format!("measure `{name}`"), measure.fields, &known);
            let zero = self.graph.constant(0.0);
            let value = self.site_value(Site::Measure(index), measure.name.span);
            let mut value = value.unwrap_or(Typed::new(zero, Dimension::ONE));
            value.node = self.with_offsets(index, value.node);
            let unit = match measure.unit.map(read_unit) {
                Some(Ok(unit)) => unit,
                _ => Unit::coherent(value.dimension),
            };
            let delay = self.sensor_field(index, "delay", Dimension::TIME).flatten().map(|delay| delay.node);
            let quantisation = self.measure_difference(index, "quantisation", &unit);
            // Rounding to steps q is noise of the variance q^2 / 12 (Widrow-1961).
            let noise = self.measure_difference(index, "noise", &unit);
            let noise = noise.map(|noise| noise.hypot(quantisation.unwrap_or(0.0) / 12f64.sqrt()));
            let weight = self.measure_number(index, "weight", Dimension::ONE).unwrap_or(1.0);
            let (title, span) = (text_of(measure.title), measure.name.span);
            let value = value.node;
            measures.push(Measure { name, title, unit, value, noise, weight, delay, quantisation, span });
        }
        measures
    }

    /// Noise and rounding are differences: the offset of a unit does not count.
    fn measure_difference(&mut self, index: usize, key: &str, unit: &Unit) -> Option<f64> {
        let noise = self.measure_number(index, key, unit.dimension)?;
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let field = find(declared.measures[index].fields, key)?;
        let written = self.field_expression(field).and_then(super::identify::written_unit);
        let offset = written.and_then(|unit| read_unit(unit).ok()).map_or(0.0, |unit| unit.offset);
        Some(noise - offset)
    }

    fn measure_number(&mut self, index: usize, key: &str, wanted: Dimension) -> Option<f64> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let field = find(declared.measures[index].fields, key)?;
        let expression = self.field_expression(field)?;
        let because = format!("`{key}`");
        let value = self.fixed_number(expression, None, wanted, (field.key.span, &because))?;
        if value <= 0.0 || !value.is_finite() {
            let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("`{key}` must be positive"))
                .label(expression.span, "not above zero");
            return self.fail(diagnostic, SCOPE);
        }
        Some(value)
    }

    /// The tree of groups under `total`; measures in no group stand directly below it.
    pub fn finished_groups(&mut self) -> Group {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let mut owner: Vec<Option<&'a Name>> = vec![None; declared.measures.len()];
        let mut parent: Vec<Option<usize>> = vec![None; declared.groups.len()];
        for (index, (_, members)) in declared.groups.iter().enumerate() {
            for member in *members {
                self.add_member(index, member, &mut owner, &mut parent);
            }
        }
        for index in 0..declared.groups.len() {
            self.check_group_circle(index, &parent);
        }
        let mut root = Group { name: "total".to_owned(), groups: Vec::new(), channels: Vec::new() };
        let tops: Vec<usize> = (0..declared.groups.len()).filter(|index| parent[*index].is_none()).collect();
        root.groups = tops.into_iter().map(|index| self.subtree(index, 0)).collect();
        root.channels = (0..owner.len()).filter(|measure| owner[*measure].is_none()).collect();
        root
    }

    fn add_member(
        &mut self,
        group: usize,
        member: &'a Name,
        owner: &mut [Option<&'a Name>],
        parent: &mut [Option<usize>],
    ) {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let twice = |first: &Name| {
            Diagnostic::error(Code::DUPLICATE_NAME, format!("`{}` stands in two groups", member.text))
                .label(member.span, "here")
                .secondary(first.span, "and here")
                .help("partial costs add up along the tree, so each channel belongs to one group")
        };
        if let Some(Entity::Measure(measure)) = self.entities.get(member.text.as_str()).copied() {
            if let Some(first) = owner[measure].replace(member) {
                self.report(twice(first), SCOPE);
            }
        } else if let Some(inner) = declared.groups.iter().position(|(name, _)| name.text == member.text) {
            if let Some(first) = parent[inner].replace(group) {
                self.report(twice(declared.groups[first].0), SCOPE);
            }
        } else {
            let measures = declared.measures.iter().map(|measure| measure.name.text.as_str());
            let names = measures.chain(declared.groups.iter().map(|(name, _)| name.text.as_str()));
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no measure `{}`", member.text))
                .label(member.span, "neither a measure nor a group")
                .suggest(similar_name(&member.text, names));
            self.report(diagnostic, SCOPE);
        }
    }

    fn check_group_circle(&mut self, index: usize, parent: &[Option<usize>]) {
        let mut current = parent[index];
        for _ in 0..parent.len() {
            match current {
                Some(group) if group == index => {
                    let name = self.declared.groups[index].0;
                    let message = format!("group `{}` contains itself", name.text);
                    self.report(
                        Diagnostic::error(Code::CYCLIC_DEFINITION, message).label(name.span, "a circle"),
                        SCOPE,
                    );
                    return;
                }
                Some(group) => current = parent[group],
                None => return,
            }
        }
    }

    fn subtree(&self, index: usize, depth: usize) -> Group {
        let (name, members) = self.declared.groups[index];
        let mut group = Group { name: name.text.clone(), groups: Vec::new(), channels: Vec::new() };
        for member in members {
            if let Some(Entity::Measure(measure)) = self.entities.get(member.text.as_str()) {
                group.channels.push(*measure);
            } else if let Some(inner) = self.declared.groups.iter().position(|(name, _)| name.text == member.text)
                && depth < self.declared.groups.len()
            {
                group.groups.push(self.subtree(inner, depth + 1));
            }
        }
        group
    }
}

pub(super) fn text_of(title: Option<&Name>) -> String {
    title.map(|title| title.text.clone()).unwrap_or_default()
}
