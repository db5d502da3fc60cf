//! Names and dotted paths in expressions of the study.

use super::checker::{Allowed, Checker, Entity, Key, Scope, Site};
use super::evaluate::Typed;
use super::kinds::{coordinate_dimension, rate_dimension};
use super::model::{Attachment, Motion, PointMotion, PointQuantity, ReactionQuantity};
use crate::diagnostics::{Code, Diagnostic, similar_name, similar_word};
use crate::expression::Symbol;
use crate::quantities::{Dimension, Unit};
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
            "wavenumber" if self.wavenumber.is_some() => return self.wavenumber,
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
            (Entity::Coupling(index), Some(quantity)) => self.coupling_quantity(index, quantity, name, allowed),
            (Entity::Coupling(index), None) => {
                let word = self.coupling_word(index)?;
                self.not_a_value(name, "a coupling", word)
            }
            (Entity::Joint(_) | Entity::JointAxis(..), _) => self.not_a_value(name, "a joint", "position"),
            (Entity::Force(_), None) => self.not_a_value(name, "a force element", "force"),
            (Entity::Effect(_), None) => self.not_a_value(name, "an effect", "force"),
            (Entity::Gravity(axis), _) => self.site_value(Site::Gravity(axis), name.span),
            (Entity::Body(_), None) => self.not_a_value(name, "a body", "position.z"),
        }
    }

    fn constant(&mut self, index: usize, name: &'a Name) -> Option<Typed> {
        let constant = &self.declared.constants[index];
        self.once(Key::Constant(index), name.span, |checker| {
            // Constants are the same everywhere, also where a spectrum mentions them.
            let hidden = checker.wavenumber.take();
            let value = checker.field_value(&constant.name.text, constant.value, Allowed::Constant);
            checker.wavenumber = hidden;
            value
        })
    }

    fn only_a_number(&mut self, name: &'a Name) -> Option<Typed> {
        let diagnostic = Diagnostic::error(Code::NOT_CONSTANT, "only a number can stand here")
            .label(name.span, "this is a name")
            .help("write the number with its unit");
        self.fail(diagnostic, Scope::Study(Allowed::Number))
    }

    pub fn check_varies(&mut self, name: &'a Name, allowed: Allowed) -> Option<()> {
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

    /// `JOINT.position` of a joint with one axis, else `JOINT.turn_z.position`; `JOINT.quaternion.w`,
    /// `JOINT.angular_velocity.x` of a free rotation; `JOINT.reaction.force.x`.
    fn joint_quantity(&mut self, index: usize, quantity: &str, name: &'a Name, allowed: Allowed) -> Option<Typed> {
        self.check_varies(name, allowed)?;
        let freedom = self.topology.joint(index)?.freedom.clone();
        if let Some(component) = quantity.strip_prefix("reaction.") {
            return self.reaction_quantity(index, component, name);
        }
        let owner = &self.declared.joints[index].name.text;
        let (axis_name, last) = match quantity.rsplit_once('.') {
            Some((axis, last)) => (format!("{owner}.{axis}"), last),
            None => (owner.clone(), quantity),
        };
        if let Some(axis) = freedom.axes.iter().find(|axis| axis.name == axis_name) {
            let (symbols, motion) = (axis.symbols, axis.motion.motion());
            let found = match last {
                "position" => Some((symbols.position, coordinate_dimension(motion))),
                "velocity" => Some((symbols.velocity, rate_dimension(motion))),
                "acceleration" => Some((symbols.acceleration, rate_dimension(motion) / Dimension::TIME)),
                _ => None,
            };
            if let Some((symbol, dimension)) = found {
                let value = Typed::new(self.graph.variable(symbol), dimension);
                return self.check_accelerations(value, name, allowed);
            }
        }
        let rate = Dimension::ONE / Dimension::TIME;
        let mut known: Vec<(String, Symbol, Dimension)> = Vec::new();
        let mut add = |checker: &Self, symbols: &[Symbol], dimension: Dimension| {
            known.extend(
                symbols.iter().map(|&symbol| (checker.graph.symbol_name(symbol).to_owned(), symbol, dimension)),
            );
        };
        for axis in &freedom.axes {
            let dimension = rate_dimension(axis.motion.motion());
            add(self, &[axis.symbols.position], dimension * Dimension::TIME);
            add(self, &[axis.symbols.velocity], dimension);
            add(self, &[axis.symbols.acceleration], dimension / Dimension::TIME);
        }
        if let Some(rotation) = &freedom.rotation {
            add(self, &rotation.quaternion, Dimension::ONE);
            add(self, &rotation.velocity, rate);
            add(self, &rotation.acceleration, rate / Dimension::TIME);
        }
        if let Some((_, symbol, dimension)) = known.iter().find(|(path, ..)| *path == name.text) {
            let value = Typed::new(self.graph.variable(*symbol), *dimension);
            return self.check_accelerations(value, name, allowed);
        }
        let prefix = format!("{owner}.");
        let mut words: Vec<&str> = known.iter().filter_map(|(path, ..)| path.strip_prefix(&prefix)).collect();
        words.extend(["reaction.force.x", "reaction.moment.x"]);
        self.no_quantity(name, quantity, &words)
    }

    /// `force.x`, `moment.z`: what the joint transmits to its child, ground axes.
    fn reaction_quantity(&mut self, joint: usize, component: &str, name: &'a Name) -> Option<Typed> {
        let (is_moment, axis) = match component.split_once('.') {
            Some(("force", axis)) => (false, axis),
            Some(("moment", axis)) => (true, axis),
            _ => (false, ""),
        };
        let Some(axis) = ["x", "y", "z"].iter().position(|letter| *letter == axis) else {
            return self.no_quantity(name, component, &["reaction.force.x", "reaction.moment.x"]);
        };
        let dimension = if is_moment { Dimension::TORQUE } else { Dimension::FORCE };
        let symbol = self.graph.symbol(&name.text);
        let is_new = self.reactions.iter().all(|reaction| reaction.symbol != symbol);
        if is_new {
            self.reactions.push(ReactionQuantity { symbol, joint, is_moment, axis, span: name.span });
        }
        Some(Typed::new(self.graph.variable(symbol), dimension))
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
        if let Some(value) = self.mode_quantity(index, name, allowed) {
            return value;
        }
        let is_elastic = self.bodies.get(index).is_some_and(|body| body.elastic.is_some());
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
            "angular_velocity" if point.is_none() || is_elastic => PointMotion::AngularVelocity,
            "angular_acceleration" if point.is_none() || is_elastic => PointMotion::AngularAcceleration,
            "axis_x" if point.is_none() || is_elastic => PointMotion::Axis(0),
            "axis_y" if point.is_none() || is_elastic => PointMotion::Axis(1),
            "axis_z" if point.is_none() || is_elastic => PointMotion::Axis(2),
            _ => return self.unknown_body_quantity(index, name),
        };
        let Some(axis) = ["x", "y", "z"].iter().position(|letter| *letter == axis) else {
            return self.unknown_body_quantity(index, name);
        };
        self.check_varies(name, allowed)?;
        let Some(position) = self.point_of(index, point) else { return self.unknown_body_quantity(index, name) };
        let frame = if is_elastic { Some(self.frame_of(index, point, name.span)?) } else { None };
        let value = self.point_quantity(&name.text, Attachment { body: Some(index), position, frame }, motion, axis);
        self.check_accelerations(value, name, allowed)
    }

    /// `BODY.mode_1.position` of an elastic body; the outer `None`: it is no mode.
    fn mode_quantity(&mut self, index: usize, name: &'a Name, allowed: Allowed) -> Option<Option<Typed>> {
        let modes = &self.bodies.get(index)?.elastic.as_ref()?.modes;
        let (owner, quantity) = name.text.rsplit_once('.')?;
        let symbols = modes.iter().find(|mode| mode.name == owner)?.symbols;
        let (symbol, dimension) = match quantity {
            "position" => (symbols.position, Dimension::LENGTH),
            "velocity" => (symbols.velocity, Dimension::VELOCITY),
            "acceleration" => (symbols.acceleration, Dimension::ACCELERATION),
            _ => return None,
        };
        let value = Typed::new(self.graph.variable(symbol), dimension);
        Some(self.check_varies(name, allowed).and_then(|()| self.check_accelerations(value, name, allowed)))
    }

    fn point_quantity(&mut self, text: &str, point: Attachment, motion: PointMotion, axis: usize) -> Typed {
        let symbol = self.graph.symbol(text);
        let dimension = match motion {
            PointMotion::Position => Dimension::LENGTH,
            PointMotion::Velocity => Dimension::VELOCITY,
            PointMotion::Acceleration => Dimension::ACCELERATION,
            PointMotion::AngularVelocity => Dimension::ONE / Dimension::TIME,
            PointMotion::AngularAcceleration => Dimension::ONE / Dimension::TIME / Dimension::TIME,
            PointMotion::Axis(_) => Dimension::ONE,
        };
        if !self.point_quantities.iter().any(|quantity| quantity.symbol == symbol) {
            self.point_quantities.push(PointQuantity { symbol, point, motion, axis });
            if motion.is_acceleration() {
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
        let mut known = Vec::new();
        for word in ["angular_velocity", "angular_acceleration", "axis_x", "axis_y", "axis_z"] {
            known.push(format!("{body_name}.{word}"));
        }
        for place in std::iter::once(body_name.clone()).chain(points.iter().map(|point| format!("{body_name}.{point}")))
        {
            known.extend(["position", "velocity", "acceleration"].map(|word| format!("{place}.{word}")));
        }
        let components = known.iter().flat_map(|path| ["x", "y", "z"].map(|axis| format!("{path}.{axis}")));
        let components: Vec<String> = components.collect();
        let (path, axis) = name.text.rsplit_once('.').unwrap_or((&name.text, ""));
        // A component is missing, or something before a component that is right is misspelt.
        let meant = match axis {
            _ if known.contains(&name.text) => Some(format!("{}.x", name.text)),
            "x" | "y" | "z" => {
                similar_name(path, known.iter().map(String::as_str)).map(|known| format!("{known}.{axis}"))
            }
            _ => similar_name(&name.text, components.iter().map(String::as_str)).map(str::to_owned),
        };
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("`{}` is no quantity of a body", name.text))
            .label(name.span, "not known")
            .suggest(meant.as_deref())
            .help(format!(
                "write `{body_name}.position.z` or `{body_name}.POINT.position.z`, also with `velocity`, `acceleration` and x, y, z; \
                 of the body `angular_velocity.z`, `angular_acceleration.z`, `axis_x.z`"
            ))
            .note(format!("points of `{body_name}`: {}", points.join(", ")));
        self.fail(diagnostic, Scope::Study(Allowed::Motion))
    }

    pub fn no_quantity(&mut self, name: &'a Name, quantity: &str, known: &[&str]) -> Option<Typed> {
        let (owner, written) = self.split_path(&name.text);
        let written = written.unwrap_or(quantity);
        let last = written.rsplit('.').next().unwrap_or(written);
        let similar = similar_word(written, known).or_else(|| known.iter().find(|word| **word == last).copied());
        let mut diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("`{owner}` has no `{written}`"))
            .label(name.span, "not known")
            .suggest(similar);
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
        if first.chars().count() > 1 && Unit::parse(first).is_ok() {
            let diagnostic = Diagnostic::error(Code::UNIT_AS_NAME, format!("`{first}` is a unit, not a value"))
                .label(name.span, "a unit follows its number")
                .help(format!("write `1 {first}`; behind a name, `c * 1 {first}`"));
            return self.fail_unknown(first, diagnostic, scope);
        }
        let diagnostic = Diagnostic::error(Code::NOT_IDENTIFIED, format!("`{first}` has no value"))
            .label(name.span, "neither declared nor identified")
            .help(format!(
                "add `{first} in LOWER .. UPPER from START` to `identify`, or `constant {first} = ..`; a signal that comes with \
                 the data is an `input`"
            ));
        self.fail_unknown(first, diagnostic, scope)
    }

    /// The motion of a joint or of a force's place.
    pub fn entity_motion(&self, entity: Entity) -> Option<Motion> {
        match entity {
            Entity::JointAxis(joint, axis) => self.axis_entry(joint, axis).map(|axis| axis.motion.motion()),
            Entity::Force(index) => {
                let load = self.instances[self.force_instances.get(index).copied().flatten()?].kinds.load;
                Some(if load == Some(Dimension::TORQUE) { Motion::Rotational } else { Motion::Translational })
            }
            _ => None,
        }
    }
}
