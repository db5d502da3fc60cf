//! Experiments, filter, solver, gravity.

use super::checker::{Allowed, Checker, Entity, Scope};
use super::declarations::Experiment as Declared;
use super::fields::{find, value_span};
use super::identify::written_unit;
use super::model::{ErrorDefinition, Experiment, Filter, Loss, Method, Role, Solver, Start, StartBase};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::expression::{Node, Symbol};
use crate::quantities::Dimension;
use crate::syntax::{Expression, ExpressionKind, Field, Name, Value};
use std::path::PathBuf;

const SCOPE: Scope = Scope::Study(Allowed::Number);

impl<'a> Checker<'a> {
    pub fn finished_experiments(&mut self) -> Vec<Experiment> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let experiments: Vec<Experiment> =
            declared.experiments.iter().filter_map(|experiment| self.experiment(experiment)).collect();
        self.check_shared_data(&experiments);
        experiments
    }

    /// What was fitted says nothing about other motions.
    fn check_shared_data(&mut self, experiments: &[Experiment]) {
        for (at, second) in experiments.iter().enumerate() {
            let overlaps = |first: &&Experiment| match (first.window, second.window) {
                (Some(a), Some(b)) => a.0 < b.1 && b.0 < a.1,
                _ => true,
            };
            let same = |first: &&Experiment| first.data == second.data && first.role != second.role;
            let Some(first) = experiments[..at].iter().filter(same).find(overlaps) else { continue };
            let message = format!("`{}` and `{}` have different roles but the same data", first.name, second.name);
            let diagnostic = Diagnostic::warning(Code::SAME_DATA, message)
                .label(second.data_span, "the same samples")
                .secondary(first.data_span, "used here")
                .help("hold data out that the fit has not seen: another record, or `window`s that do not overlap");
            self.report(diagnostic, SCOPE);
        }
    }

    fn experiment(&mut self, experiment: &Declared<'a>) -> Option<Experiment> {
        let fields = experiment.fields;
        let name = experiment.name;
        let owner = format!("experiment `{}`", name.text);
        self.known_fields(
            &owner,
            fields,
            &["data", "window", "start", "measures", "columns", "time", "inputs", "offsets"],
        );
        let role = self.role(experiment.role);
        let data = match find(fields, "data") {
            Some(field) => self.field_text(field),
            None => self.missing(name, "data", "data = \"data/sweep.csv\""),
        };
        let time = find(fields, "time").map(|field| self.field_text(field));
        let columns = self.columns(find(fields, "columns"));
        let constant_inputs = self.constant_inputs(find(fields, "inputs"));
        let measures = self.compared(find(fields, "measures"));
        let window = match find(fields, "window") {
            Some(field) => self.window(field).map(Some),
            None => Some(None),
        };
        let start = match find(fields, "start") {
            Some(field) => self.start(field),
            None => {
                let message = format!("experiment `{}` does not say how it starts", name.text);
                let diagnostic = Diagnostic::error(Code::MISSING_START, message)
                    .label(name.span, "`start` is missing")
                    .help("add `start = equilibrium`, `start = rest`, or `start = rest { slide.velocity = 6 mm/s }`");
                self.fail(diagnostic, SCOPE)
            }
        };
        let data = data?;
        Some(Experiment {
            name: name.text.clone(),
            role: role?,
            data: PathBuf::from(&data.text),
            time_column: match time {
                Some(text) => text?.text.clone(),
                None => "t".to_owned(),
            },
            columns: columns?,
            constant_inputs: constant_inputs?,
            measures: measures?,
            window: window?,
            start: start?,
            span: name.span,
            data_span: data.span,
        })
    }

    fn missing<T>(&mut self, owner: &'a Name, key: &str, example: &str) -> Option<T> {
        let diagnostic = Diagnostic::error(Code::MISSING_FIELD, format!("`{}` needs `{key}`", owner.text))
            .label(owner.span, format!("`{key}` is missing"))
            .help(format!("add `{example}`"));
        self.fail(diagnostic, SCOPE)
    }

    fn role(&mut self, role: Option<&'a Name>) -> Option<Role> {
        let Some(role) = role else { return Some(Role::Estimation) };
        match role.text.as_str() {
            "estimation" => Some(Role::Estimation),
            "validation" => Some(Role::Validation),
            "test" => Some(Role::Test),
            other => {
                const ROLES: [&str; 3] = ["estimation", "validation", "test"];
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("there is no role `{other}`"))
                    .label(role.span, "not known")
                    .suggest(similar_name(other, ROLES))
                    .note(format!("roles: {}", ROLES.join(", ")));
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    /// `columns = { a_axle = "acc 3 [g0]" }`
    fn columns(&mut self, field: Option<&'a Field>) -> Option<Vec<(String, String)>> {
        let Some(field) = field else { return Some(Vec::new()) };
        let Value::Block { word: None, fields, .. } = &field.value else {
            return self.wrong_value(field, "a list like `{ a_axle = \"acc 3\" }`");
        };
        let mut columns = Vec::new();
        for column in fields {
            let key = &column.key;
            let entity = self.entities.get(key.text.as_str());
            if !matches!(entity, Some(Entity::Input(_) | Entity::Measure(_))) {
                let declared = self.declared;
                let inputs = declared.inputs.iter().map(|input| input.name.text.as_str());
                let names = inputs.chain(declared.measures.iter().map(|measure| measure.name.text.as_str()));
                let message = format!("there is no input or measure `{}`", key.text);
                let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
                    .label(key.span, "not declared")
                    .suggest(similar_name(&key.text, names));
                self.report(diagnostic, SCOPE);
                continue;
            }
            columns.push((key.text.clone(), self.field_text(column)?.text.clone()));
        }
        Some(columns)
    }

    /// `inputs = { pulse = 0 V }`
    fn constant_inputs(&mut self, field: Option<&'a Field>) -> Option<Vec<(usize, f64)>> {
        let Some(field) = field else { return Some(Vec::new()) };
        let Value::Block { word: None, fields, .. } = &field.value else {
            return self.wrong_value(field, "a list like `{ pulse = 0 V }`");
        };
        self.check_repeated(fields);
        let mut constants = Vec::new();
        for stated in fields {
            let key = &stated.key;
            let Some(Entity::Input(index)) = self.entities.get(key.text.as_str()).copied() else {
                let names = self.declared.inputs.iter().map(|input| input.name.text.as_str());
                let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no input `{}`", key.text))
                    .label(key.span, "not declared")
                    .suggest(similar_name(&key.text, names));
                self.report(diagnostic, SCOPE);
                continue;
            };
            let wanted = self.inputs.get(index)?.unit.dimension;
            let expression = self.field_expression(stated)?;
            constants.push((index, self.fixed_number(expression, None, wanted, (key.span, "the input has"))?));
        }
        Some(constants)
    }

    fn compared(&mut self, field: Option<&'a Field>) -> Option<Vec<usize>> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let Some(field) = field else { return Some((0..declared.measures.len()).collect()) };
        let names: Vec<&'a Name> = match &field.value {
            Value::List(names, _) => names.iter().collect(),
            Value::Expression(Expression { kind: ExpressionKind::Path(name), .. }) => vec![name],
            _ => return self.wrong_value(field, "a list of measures `{ a, b }`"),
        };
        let mut measures = Vec::new();
        for name in names {
            match self.entities.get(name.text.as_str()) {
                Some(Entity::Measure(index)) if measures.contains(index) => {
                    let diagnostic =
                        Diagnostic::error(Code::DUPLICATE_NAME, format!("`{}` is listed twice", name.text))
                            .label(name.span, "again");
                    self.report(diagnostic, SCOPE);
                }
                Some(Entity::Measure(index)) => measures.push(*index),
                _ => {
                    let known = declared.measures.iter().map(|measure| measure.name.text.as_str());
                    let diagnostic =
                        Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no measure `{}`", name.text))
                            .label(name.span, "not declared")
                            .suggest(similar_name(&name.text, known));
                    self.report(diagnostic, SCOPE);
                }
            }
        }
        measures.sort_unstable();
        Some(measures)
    }

    fn window(&mut self, field: &'a Field) -> Option<(f64, f64)> {
        let Value::Range(lower, upper) = &field.value else {
            return self.wrong_value(field, "a range of time `1 s .. 10 s`");
        };
        let what = (field.key.span, "`window`");
        let begin = self.fixed_number(lower, written_unit(upper), Dimension::TIME, what);
        let end = self.fixed_number(upper, None, Dimension::TIME, what);
        let (begin, end) = (begin?, end?);
        if begin >= end {
            let diagnostic = Diagnostic::error(Code::BOUNDS, "the window ends before it begins")
                .label(value_span(field), "empty window");
            return self.fail(diagnostic, SCOPE);
        }
        Some((begin, end))
    }

    pub(super) fn start(&mut self, field: &'a Field) -> Option<Start> {
        let word = self.field_word(field, &["equilibrium", "rest"])?;
        let base = if word == "rest" { StartBase::Rest } else { StartBase::Equilibrium };
        let mut overrides = Vec::new();
        if let Value::Block { fields, .. } = &field.value {
            for field in super::fields::flatten(fields, &mut self.diagnostics) {
                if let Some(value) = self.start_value(&field) {
                    overrides.push(value);
                }
            }
        }
        Some(Start { base, overrides })
    }

    /// `slide.velocity = v0`, `strut.z = 0 mm`
    fn start_value(&mut self, field: &super::fields::FlatField<'a>) -> Option<(Symbol, Node)> {
        let joints = self.declared.joints.iter().zip(&self.topology.closes_loop);
        let closing = joints.filter(|(_, closes)| **closes).map(|(joint, _)| joint.name.text.as_str());
        let is_within = |name: &str| field.path.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
        if let Some(name) = closing.into_iter().find(|name| is_within(name)) {
            let message = format!("`{}` has no start value of its own", field.path);
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
                .label(field.span, format!("`{name}` closes a loop: its coordinates follow from the other joints"))
                .help("give the start of another joint of the loop, or declare this one before them");
            return self.fail(diagnostic, SCOPE);
        }
        let Some((symbol, dimension)) = self.start_target(&field.path) else {
            if self.is_of_wrong_joint(&field.path) || self.is_broken(&field.path) {
                return None;
            }
            let message = format!("`{}` has no start value", field.path);
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, message)
                .label(field.span, "not a position, velocity or state")
                .suggest(similar_name(&field.path, self.start_names().iter().map(String::as_str)))
                .help("name the position or velocity of a joint (`slide.velocity`) or a law's state (`strut.z`)");
            return self.fail(diagnostic, SCOPE);
        };
        let Some(expression) = field.expression else {
            let message = format!("`{}` must be a number or an expression", field.path);
            return self.fail(Diagnostic::error(Code::WRONG_VALUE, message).label(field.span, ""), SCOPE);
        };
        let value = self.evaluate(expression, Scope::Study(Allowed::Constant))?;
        let value = self.expect(value, expression.span, dimension, (field.span, "the start value has"), SCOPE)?;
        Some((symbol, value.node))
    }

    fn start_target(&mut self, path: &str) -> Option<(Symbol, Dimension)> {
        let (owner, quantity) = path.rsplit_once('.')?;
        if let Some(&(joint, axis)) = self.axis_index.get(owner) {
            let entry = self.axis_entry(joint, axis)?;
            let (symbols, motion) = (entry.symbols, entry.motion.motion());
            return match quantity {
                "position" => Some((symbols.position, super::kinds::coordinate_dimension(motion))),
                "velocity" => Some((symbols.velocity, super::kinds::rate_dimension(motion))),
                _ => None,
            };
        }
        for rotation in self.topology.joints.iter().flatten().filter_map(|read| read.freedom.rotation.as_ref()) {
            if let Some(symbol) = rotation.quaternion.iter().find(|symbol| self.graph.symbol_name(**symbol) == path) {
                return Some((*symbol, Dimension::ONE));
            }
            if let Some(symbol) = rotation.velocity.iter().find(|symbol| self.graph.symbol_name(**symbol) == path) {
                return Some((*symbol, Dimension::ONE / Dimension::TIME));
            }
        }
        let mut modes = self.bodies.iter().filter_map(|body| body.elastic.as_ref()).flat_map(|elastic| &elastic.modes);
        if let Some(mode) = modes.find(|mode| mode.name == owner) {
            return match quantity {
                "position" => Some((mode.symbols.position, Dimension::LENGTH)),
                "velocity" => Some((mode.symbols.velocity, Dimension::VELOCITY)),
                _ => None,
            };
        }
        let state = self.states.iter().find(|state| state.name == path)?;
        Some((state.symbol, state.dimension))
    }

    /// Everything that may have a start value.
    fn start_names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.states.iter().map(|state| state.name.clone()).collect();
        let elastic = self.bodies.iter().filter_map(|body| body.elastic.as_ref()).flat_map(|elastic| &elastic.modes);
        let axes = self.axis_index.keys().map(String::as_str).chain(elastic.map(|mode| mode.name.as_str()));
        names.extend(axes.flat_map(|axis| ["position", "velocity"].map(|word| format!("{axis}.{word}"))));
        for rotation in self.topology.joints.iter().flatten().filter_map(|read| read.freedom.rotation.as_ref()) {
            let symbols = rotation.quaternion.iter().chain(&rotation.velocity);
            names.extend(symbols.map(|symbol| self.graph.symbol_name(*symbol).to_owned()));
        }
        names.sort_unstable();
        names
    }

    pub fn finished_filter(&mut self) -> (Option<Filter>, bool) {
        let Some((lowpass, remove_mean, span)) = self.declared.filter else { return (None, false) };
        let Some(lowpass) = lowpass else { return (None, remove_mean) };
        let pass = self.edge(&lowpass.pass, written_unit(&lowpass.stop));
        let stop = self.edge(&lowpass.stop, None);
        let pass_drop = self.decibel(&lowpass.pass_drop);
        let stop_attenuation = self.decibel(&lowpass.stop_attenuation);
        let (Some(pass), Some(stop), Some(pass_drop), Some(stop_attenuation)) =
            (pass, stop, pass_drop, stop_attenuation)
        else {
            return (None, remove_mean);
        };
        if pass >= stop {
            let diagnostic =
                Diagnostic::error(Code::FILTER_DESIGN, "a low-pass filter passes below the frequency it stops")
                    .label(lowpass.pass.span, "pass edge")
                    .label(lowpass.stop.span, "stop edge, not above the pass edge");
            self.report(diagnostic, SCOPE);
        }
        if pass_drop >= stop_attenuation {
            let message = "the drop in the pass band must be smaller than the attenuation in the stop band";
            let diagnostic = Diagnostic::error(Code::FILTER_DESIGN, message)
                .label(lowpass.pass_drop.span, "largest drop in the pass band")
                .label(lowpass.stop_attenuation.span, "smallest attenuation in the stop band");
            self.report(diagnostic, SCOPE);
        }
        let single_pass_specification = lowpass.single_pass;
        (Some(Filter { pass, pass_drop, stop, stop_attenuation, single_pass_specification, span }), remove_mean)
    }

    fn edge(&mut self, expression: &'a Expression, hint: Option<&'a Name>) -> Option<f64> {
        let edge = self.fixed_number(expression, hint, Dimension::FREQUENCY, (expression.span, "an edge has"))?;
        self.positive(edge, expression, "an edge of the filter")
    }

    fn positive(&mut self, value: f64, expression: &'a Expression, what: &str) -> Option<f64> {
        if value > 0.0 && value.is_finite() {
            return Some(value);
        }
        let diagnostic = Diagnostic::error(Code::FILTER_DESIGN, format!("{what} must be positive"))
            .label(expression.span, "not above zero");
        self.fail(diagnostic, SCOPE)
    }

    /// A ratio in dB; the only place where the unit stands.
    fn decibel(&mut self, expression: &'a Expression) -> Option<f64> {
        match super::evaluate::literal(expression) {
            Some((value, Some(unit))) if unit.text == "dB" => self.positive(value, expression, "an attenuation"),
            _ => {
                let diagnostic = Diagnostic::error(Code::FILTER_DESIGN, "an attenuation is given in dB")
                    .label(expression.span, "not in dB")
                    .help("write e.g. `2 dB`");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    pub fn finished_solver(&mut self) -> Solver {
        let mut solver = Solver {
            relative_tolerance: 1e-6,
            method: Method::Automatic,
            loss: Loss::Squares,
            error: ErrorDefinition::Output,
            coloured_noise: false,
        };
        let Some(fields) = self.declared.solver else { return solver };
        self.known_fields("`solver`", fields, &["tolerance", "method", "loss", "error", "noise"]);
        if let Some(field) = find(fields, "tolerance")
            && let Some(expression) = self.field_expression(field)
            && let Some(value) = self.fixed_number(expression, None, Dimension::ONE, (field.key.span, "`tolerance`"))
        {
            if (1e-13..=1e-1).contains(&value) {
                solver.relative_tolerance = value;
            } else {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, "the tolerance must lie between 1e-13 and 0.1")
                    .label(expression.span, "out of range")
                    .help("1e-6 is a good start");
                self.report(diagnostic, SCOPE);
            }
        }
        let word =
            find(fields, "method").and_then(|field| self.field_word(field, &["automatic", "bdf", "runge_kutta"]));
        let loss = find(fields, "loss").and_then(|field| self.field_word(field, &["squares", "huber", "student"]));
        let error = find(fields, "error").and_then(|field| self.field_word(field, &ErrorDefinition::NAMES));
        solver.error = error.and_then(ErrorDefinition::from_name).unwrap_or_default();
        let noise = find(fields, "noise").and_then(|field| self.field_word(field, &["white", "coloured"]));
        solver.coloured_noise = noise == Some("coloured");
        solver.loss = match loss {
            Some("huber") => Loss::Huber,
            Some("student") => Loss::Student,
            _ => Loss::Squares,
        };
        solver.method = match word {
            Some("bdf") => Method::Bdf,
            Some("runge_kutta") => Method::RungeKutta,
            _ => Method::Automatic,
        };
        solver
    }
}
