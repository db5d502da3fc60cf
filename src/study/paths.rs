//! Names and dotted paths in expressions of the study.

use super::checker::{Allowed, Checker, Entity, Key, Scope, Site};
use super::evaluate::Typed;
use super::kinds::{coordinate_dimension, rate_dimension};
use super::model::{Attachment, Motion, PointMotion, PointQuantity};
use crate::diagnostics::{Code, Diagnostic, similar_name};
use crate::quantities::Dimension;
use crate::syntax::Name;

impl<'a> Checker<'a> {
    /// The value that a name or path stands for.
    pub fn path(&mut self, name: &'a Name, scope: Scope) -> Option<Typed> {
        match scope {
            Scope::Instance(index) => self.local(index, name),
            Scope::Study(allowed) => self.study_path(name, allowed),
        }
    }

    fn study_path(&mut self, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        match name.text.as_str() {
            "pi" => return Some(Typed::new(self.graph.constant(std::f64::consts::PI), Dimension::ONE)),
            _ if allowed == Allowed::Number => return self.only_a_number(name),
            "t" => {
                self.check_varies(name, allowed)?;
                let node = self.graph.variable(self.time);
                return Some(Typed::new(node, Dimension::TIME));
            }
            _ => {}
        }
        if let Some(parameter) = self.parameter(&name.text) {
            return Some(parameter);
        }
        let (first, rest) = self.split_path(&name.text);
        let Some(&entity) = self.entities.get(first) else { return self.unknown_path(name, first, rest.is_some()) };
        match (entity, rest) {
            (Entity::Constant(index), None) => self.constant(index, name),
            (Entity::Input(index), None) => {
                self.check_varies(name, allowed)?;
                self.site_value(Site::Input(index), name.span)
            }
            (Entity::Signal(index), None | Some("value")) => {
                self.check_varies(name, allowed)?;
                self.site_value(Site::Signal(index), name.span)
            }
            (Entity::Measure(index), None) => {
                self.check_varies(name, allowed)?;
                let value = self.site_value(Site::Measure(index), name.span)?;
                self.check_accelerations(value, name, allowed)
            }
            (Entity::Joint(index), Some(quantity)) => self.joint_quantity(index, quantity, name, allowed),
            (Entity::Force(index), Some(quantity)) => self.force_quantity(index, quantity, name, allowed),
            (Entity::Signal(index), Some(state)) => {
                self.check_varies(name, allowed)?;
                let instance = self.signal_instances.get(index).copied().flatten();
                self.state_quantity(instance, state, name, &["value"])
            }
            (Entity::Effect(index), Some(quantity)) => self.effect_quantity(index, quantity, name, allowed),
            (Entity::Body(index), Some(quantity)) => self.body_quantity(index, quantity, name, allowed),
            (Entity::Constant(_) | Entity::Input(_) | Entity::Measure(_), Some(rest)) => {
                self.no_quantity(name, rest, &[])
            }
            (Entity::Joint(_), None) => self.not_a_value(name, "a joint", "position"),
            (Entity::Force(_), None) => self.not_a_value(name, "a force element", "force"),
            (Entity::Effect(_), None) => self.not_a_value(name, "an effect", "force"),
            (Entity::Body(_), None) => self.not_a_value(name, "a body", "position.z"),
        }
    }

    fn constant(&mut self, index: usize, name: &'a Name) -> Option<Typed> {
        let constant = &self.declared.constants[index];
        self.once(Key::Constant(index), name.span, |checker| {
            checker.field_value(&constant.name.text, constant.value, Allowed::Constant)
        })
    }

    fn only_a_number(&mut self, name: &'a Name) -> Option<Typed> {
        let diagnostic = Diagnostic::error(Code::NOT_CONSTANT, "only a number can stand here")
            .label(name.span, "this is a name")
            .help("write the number with its unit");
        self.fail(diagnostic, Scope::Study(Allowed::Number))
    }

    fn check_varies(&mut self, name: &'a Name, allowed: Allowed) -> Option<()> {
        if allowed != Allowed::Constant {
            return Some(());
        }
        let diagnostic = Diagnostic::error(Code::NOT_CONSTANT, format!("`{}` varies in time", name.text))
            .label(name.span, "a constant is needed here")
            .help("only numbers, constants and identified parameters may stand here");
        self.fail(diagnostic, Scope::Study(allowed))
    }

    fn check_accelerations(&mut self, value: Typed, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        if allowed == Allowed::Acceleration {
            return Some(value);
        }
        let symbols = self.graph.symbols_of(&[value.node]);
        if !symbols.iter().any(|symbol| self.accelerations.contains(symbol)) {
            return Some(value);
        }
        let diagnostic = Diagnostic::error(Code::ACCELERATION_IN_LOAD, "accelerations may stand in measures only")
            .label(name.span, format!("`{}` contains an acceleration", name.text))
            .help(
                "accelerations follow from the loads; a sensor `lag` makes the measured value usable in a controller",
            );
        self.fail(diagnostic, Scope::Study(allowed))
    }

    fn joint_quantity(&mut self, index: usize, quantity: &str, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        self.check_varies(name, allowed)?;
        let Some((symbols, motion)) = self.joint_symbols.get(index).copied().flatten() else {
            return self.no_quantity(name, quantity, &[]);
        };
        let (symbol, dimension) = match quantity {
            "position" => (symbols.position, coordinate_dimension(motion)),
            "velocity" => (symbols.velocity, rate_dimension(motion)),
            "acceleration" => (symbols.acceleration, rate_dimension(motion) / Dimension::TIME),
            _ => return self.no_quantity(name, quantity, &["position", "velocity", "acceleration"]),
        };
        let value = Typed::new(self.graph.variable(symbol), dimension);
        self.check_accelerations(value, name, allowed)
    }

    fn force_quantity(&mut self, index: usize, quantity: &'a str, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        let instance = self.force_instances.get(index).copied().flatten()?;
        let word = self.load_word(self.instances[instance].kinds.load);
        match quantity {
            "elongation" | "rate" => {
                self.check_varies(name, allowed)?;
                self.instances[instance].place_port(if quantity == "rate" { "v" } else { "x" })
            }
            _ if quantity == word => {
                self.check_varies(name, allowed)?;
                let value = self.site_value(Site::Force(index), name.span)?;
                self.check_accelerations(value, name, allowed)
            }
            _ if self.instances[instance].declared.iter().any(|declared| declared.name.text == quantity) => {
                let value = self.own_field(instance, quantity, name.span)?;
                let is_constant = self.graph.symbols_of(&[value.node]).iter().all(|symbol| self.is_parameter(*symbol));
                if !is_constant {
                    self.check_varies(name, allowed)?;
                }
                Some(value)
            }
            _ => {
                self.check_varies(name, allowed)?;
                self.state_quantity(Some(instance), quantity, name, &[word, "elongation", "rate"])
            }
        }
    }

    fn effect_quantity(&mut self, index: usize, quantity: &'a str, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        self.check_varies(name, allowed)?;
        let instance = self.effect_instances.get(index).copied().flatten();
        let is_load = instance.is_some_and(|instance| self.instances[instance].site == Site::JointEffect(index));
        let word = self.load_word(instance.and_then(|instance| self.instances[instance].kinds.load));
        if is_load && quantity == word {
            return self.site_value(Site::JointEffect(index), name.span);
        }
        self.state_quantity(instance, quantity, name, if is_load { &["force"] } else { &[] })
    }

    fn load_word(&self, load: Option<Dimension>) -> &'static str {
        if load == Some(Dimension::TORQUE) { "torque" } else { "force" }
    }

    fn state_quantity(
        &mut self,
        instance: Option<usize>,
        quantity: &str,
        name: &'a Name,
        others: &[&str],
    ) -> Option<Typed> {
        let states = instance.map(|index| self.instances[index].states).unwrap_or_default();
        match states.iter().position(|state| state.name.text == quantity) {
            Some(at) => self.state(instance?, at, name.span),
            None => {
                let mut known: Vec<&str> = others.to_vec();
                known.extend(states.iter().map(|state| state.name.text.as_str()));
                self.no_quantity(name, quantity, &known)
            }
        }
    }

    /// `BODY[.POINT].(position|velocity|acceleration).(x|y|z)`, `BODY.mass`
    fn body_quantity(&mut self, index: usize, path: &str, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        if path == "mass" {
            return self.body_mass(index);
        }
        let parts: Vec<&str> = path.split('.').collect();
        let (point, motion, axis) = match parts.as_slice() {
            [motion, axis] => (None, *motion, *axis),
            [point, motion, axis] => (Some(*point), *motion, *axis),
            _ => return self.unknown_body_quantity(index, name),
        };
        let motion = match motion {
            "position" => PointMotion::Position,
            "velocity" => PointMotion::Velocity,
            "acceleration" => PointMotion::Acceleration,
            _ => return self.unknown_body_quantity(index, name),
        };
        let Some(axis) = ["x", "y", "z"].iter().position(|letter| *letter == axis) else {
            return self.unknown_body_quantity(index, name);
        };
        self.check_varies(name, allowed)?;
        let Some(position) = self.point_of(index, point) else { return self.unknown_body_quantity(index, name) };
        let value = self.point_quantity(&name.text, Attachment { body: Some(index), position }, motion, axis);
        self.check_accelerations(value, name, allowed)
    }

    fn point_quantity(&mut self, text: &str, point: Attachment, motion: PointMotion, axis: usize) -> Typed {
        let symbol = self.graph.symbol(text);
        let dimension = match motion {
            PointMotion::Position => Dimension::LENGTH,
            PointMotion::Velocity => Dimension::VELOCITY,
            PointMotion::Acceleration => Dimension::ACCELERATION,
        };
        if !self.point_quantities.iter().any(|quantity| quantity.symbol == symbol) {
            self.point_quantities.push(PointQuantity { symbol, point, motion, axis });
            if motion == PointMotion::Acceleration {
                self.accelerations.insert(symbol);
            }
        }
        Typed::new(self.graph.variable(symbol), dimension)
    }

    fn unknown_body_quantity(&mut self, index: usize, name: &'a Name) -> Option<Typed> {
        let body = &self.declared.bodies[index];
        let mut points: Vec<&str> = body.points.iter().map(|point| point.key.text.as_str()).collect();
        points.push("centre_of_gravity");
        let body_name = &body.name.text;
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("`{}` is no quantity of a body", name.text))
            .label(name.span, "not known")
            .help(format!(
                "write `{body_name}.position.z` or `{body_name}.POINT.position.z`, also with `velocity`, `acceleration` and x, y, z"
            ))
            .note(format!("points of `{body_name}`: {}", points.join(", ")));
        self.fail(diagnostic, Scope::Study(Allowed::Motion))
    }

    fn no_quantity(&mut self, name: &'a Name, quantity: &str, known: &[&str]) -> Option<Typed> {
        let (owner, _) = self.split_path(&name.text);
        let mut diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("`{owner}` has no `{quantity}`"))
            .label(name.span, "not known");
        diagnostic = diagnostic.suggest(similar_name(quantity, known.iter().copied()));
        if !known.is_empty() {
            let listed: Vec<String> = known.iter().map(|word| format!("`{owner}.{word}`")).collect();
            diagnostic = diagnostic.note(format!("there is {}", listed.join(", ")));
        }
        self.fail(diagnostic, Scope::Study(Allowed::Motion))
    }

    fn not_a_value(&mut self, name: &'a Name, what: &str, example: &str) -> Option<Typed> {
        let diagnostic = Diagnostic::error(Code::NOT_A_VALUE, format!("`{}` is {what}, not a value", name.text))
            .label(name.span, "a quantity is needed here")
            .help(format!("name one of its quantities, e.g. `{}.{example}`", name.text));
        self.fail(diagnostic, Scope::Study(Allowed::Motion))
    }

    fn unknown_path(&mut self, name: &'a Name, first: &str, is_dotted: bool) -> Option<Typed> {
        let names = self.all_names();
        let similar = similar_name(first, names.iter().copied());
        let scope = Scope::Study(Allowed::Motion);
        if is_dotted || similar.is_some() {
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no `{first}`"))
                .label(name.span, "not declared")
                .suggest(similar);
            return self.fail_unknown(first, diagnostic, scope);
        }
        let diagnostic = Diagnostic::error(Code::NOT_IDENTIFIED, format!("`{first}` has no value"))
            .label(name.span, "neither declared nor identified")
            .help(format!("add `{first} in LOWER .. UPPER from START` to `identify`, or `constant {first} = ..`"));
        self.fail_unknown(first, diagnostic, scope)
    }

    /// The motion of a joint or of a force's place.
    pub fn entity_motion(&self, entity: Entity) -> Option<Motion> {
        match entity {
            Entity::Joint(index) => self.joint_symbols.get(index)?.map(|(_, motion)| motion),
            Entity::Force(index) => {
                let load = self.instances[self.force_instances.get(index).copied().flatten()?].kinds.load;
                Some(if load == Some(Dimension::TORQUE) { Motion::Rotational } else { Motion::Translational })
            }
            _ => None,
        }
    }
}
