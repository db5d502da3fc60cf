//! Forces, actuators, signals and effects at their places.

use super::checker::{Allowed, Checker, Entity, Scope, Site};
use super::declarations::{Declarations, Element, SignalKind};
use super::evaluate::Typed;
use super::fields::find;
use super::instance::{Instance, Progress};
use super::joints::AxisEntry;
use super::kinds::{Kinds, coordinate_dimension, load_dimension, rate_dimension};
use super::model::{ForceDirection, ForcePlace, Motion, PlaceKind};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::expression::{Node, Symbol, Unary};
use crate::quantities::{Dimension, Unit, named_type};
use crate::syntax::{
    Declared, Direction, DirectionKind, EffectAction, ElementPlace, Field, LawDeclaration, Name, PlaceAxis,
};

const SCOPE: Scope = Scope::Study(Allowed::Constant);

/// Where a force stands, by declared joint index, with the symbols of its elongation.
#[derive(Clone, Copy)]
pub(super) struct PlacedForce {
    pub place: ForcePlace,
    pub motion: Motion,
    pub coordinate: Symbol,
    pub rate: Symbol,
}

impl<'a> Checker<'a> {
    /// Finds the places of effects, then makes an instance of every law and effect in use.
    pub fn place_elements(&mut self) {
        let declared: &'a Declarations<'a> = self.declared;
        let sites: Vec<Option<(Site, Entity)>> =
            (0..declared.effects.len()).map(|index| self.effect_site(index)).collect();
        for (index, element) in declared.forces.iter().enumerate() {
            let placed = self.force_place(element);
            self.placed_forces.push(placed);
            let instance = self.force_instance(index, element, placed);
            self.force_instances.push(instance);
        }
        for (index, signal) in declared.signals.iter().enumerate() {
            let instance = match &signal.kind {
                SignalKind::Law { law, fields } => self.signal_instance(index, signal.name, law, fields),
                SignalKind::Formula(_) => None,
            };
            self.signal_instances.push(instance);
        }
        for (index, site) in sites.into_iter().enumerate() {
            let instance = site.and_then(|(site, entity)| self.effect_instance(index, site, entity));
            self.effect_instances.push(instance);
        }
    }

    fn find_law(&mut self, law: &'a Name) -> Option<&'a LawDeclaration> {
        let declared: &'a Declarations<'a> = self.declared;
        if let Some(found) = declared.laws.get(law.text.as_str()) {
            return Some(found.declaration);
        }
        let mut names: Vec<&str> = declared.laws.keys().copied().collect();
        names.sort_unstable();
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no law `{}`", law.text))
            .label(law.span, "not declared")
            .suggest(similar_name(&law.text, names.iter().copied()))
            .note(format!("laws: {}", names.join(", ")));
        self.fail(diagnostic, SCOPE)
    }

    fn force_place(&mut self, element: &Element<'a>) -> Option<PlacedForce> {
        match element.place {
            ElementPlace::On(name) => self.place_on_joint(element, name),
            ElementPlace::Between { first, second, axis } => {
                let (a, b) = (self.end(first), self.end(second));
                let (a, b) = (a?, b?);
                if a.body == b.body {
                    let message = format!("`{}` acts between two points of one body", element.name.text);
                    let diagnostic = Diagnostic::error(Code::SAME_BODY, message)
                        .label(first.span.to(second.span), "the same body twice");
                    return self.fail(diagnostic, SCOPE);
                }
                let along = match axis {
                    Some((how, direction)) => Some(self.force_direction(*how, direction)?),
                    None => self.topology.common_axis(a.body, b.body).map(|axis| ForceDirection {
                        axis,
                        body: None,
                        motion: Motion::Translational,
                    }),
                };
                let free_length = find(element.fields, "free_length");
                let (first, second) = (self.attachment(a), self.attachment(b));
                let free_length = match (along, free_length) {
                    (Some(_), Some(field)) => {
                        let message = format!("`{}` has no free length", element.name.text);
                        let diagnostic = Diagnostic::error(Code::UNKNOWN_FIELD, message)
                            .label(field.key.span, "it acts along a fixed axis")
                            .help("its elongation counts from the reference configuration; use `external_load` for a preload");
                        return self.fail(diagnostic, SCOPE);
                    }
                    (Some(_), None) => None,
                    (None, field) => Some(self.free_length(element, first, second, field)?),
                };
                let coordinate = self.graph.symbol(&format!("{}.elongation", element.name.text));
                let rate = self.graph.symbol(&format!("{}.rate", element.name.text));
                let motion = along.map_or(Motion::Translational, |along| along.motion);
                let place = ForcePlace::Between { first, second, along, free_length };
                Some(PlacedForce { place, motion, coordinate, rate })
            }
            ElementPlace::Nowhere => {
                let message = format!("`{}` has no place", element.name.text);
                let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                    .label(element.law.span, "acts nowhere")
                    .help("write `on JOINT` or `A -> B` behind the law");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    fn place_on_joint(&mut self, element: &Element<'a>, name: &'a Name) -> Option<PlacedForce> {
        let (joint, axis) = match self.place_entity(&name.text) {
            Some(Entity::JointAxis(joint, axis)) => (joint, axis),
            Some(Entity::Joint(joint)) => return self.no_single_axis(element, name, joint),
            entity => return self.no_joint(name, entity),
        };
        let entry = self.axis_entry(joint, axis)?;
        let (symbols, motion) = (entry.symbols, entry.motion.motion());
        if let Some(field) = find(element.fields, "free_length") {
            let diagnostic = Diagnostic::error(Code::UNKNOWN_FIELD, "elements on a joint have no free length")
                .label(field.key.span, "the joint's coordinate counts from the reference configuration");
            self.report(diagnostic, SCOPE);
        }
        let (coordinate, rate) = (symbols.position, symbols.velocity);
        Some(PlacedForce { place: ForcePlace::Joint { joint, axis }, motion, coordinate, rate })
    }

    /// `along z`, `along bogie.y`, `about z`.
    fn force_direction(&mut self, how: PlaceAxis, direction: &'a Direction) -> Option<ForceDirection> {
        let motion = match how {
            PlaceAxis::Along => Motion::Translational,
            PlaceAxis::About => Motion::Rotational,
        };
        let DirectionKind::OfBody { path, negative } = &direction.kind else {
            return Some(ForceDirection { axis: self.direction(direction)?, body: None, motion });
        };
        let axis = path.text.rsplit_once('.').and_then(|(body, letter)| {
            let index = ["x", "y", "z"].iter().position(|axis| *axis == letter)?;
            // A port may stand for a point of the body, or for ground.
            let (body, _) = self.split_path(body);
            if body == "ground" {
                return Some((None, index));
            }
            let body = self.declared.bodies.iter().position(|declared| declared.name.text == body)?;
            Some((Some(body), index))
        });
        let Some((body, index)) = axis else {
            let bodies = self.declared.bodies.iter().map(|body| body.name.text.as_str());
            let first = path.text.split('.').next().unwrap_or_default();
            let diagnostic = Diagnostic::error(Code::AXIS, format!("`{}` is no axis of a body", path.text))
                .label(path.span, "not known")
                .suggest(similar_name(first, bodies))
                .help("write `x`, `y`, `z`, three numbers, or an axis that turns with a body: `along bogie.y`");
            return self.fail(diagnostic, SCOPE);
        };
        let mut vector = [0.0; 3];
        vector[index] = if *negative { -1.0 } else { 1.0 };
        Some(ForceDirection { axis: vector, body, motion })
    }

    /// What a name means as place of an element: the axis of a joint comes before the joint.
    pub fn place_entity(&self, name: &str) -> Option<Entity> {
        if let Some(&(joint, axis)) = self.axis_index.get(name) {
            return Some(Entity::JointAxis(joint, axis));
        }
        self.gravity_component(name).or_else(|| self.entities.get(name).copied())
    }

    pub fn axis_entry(&self, joint: usize, axis: usize) -> Option<&AxisEntry> {
        self.topology.joint(joint)?.freedom.axes.get(axis)
    }

    fn no_single_axis<T>(&mut self, element: &Element<'a>, name: &'a Name, joint: usize) -> Option<T> {
        let freedom = &self.topology.joint(joint)?.freedom;
        let axes: Vec<String> = freedom.axes.iter().map(|axis| format!("`{}`", axis.name)).collect();
        let diagnostic = if axes.is_empty() {
            let message = format!("`{}` stands on a joint that has no axis", element.name.text);
            let what = if freedom.rotation.is_some() { "it turns freely" } else { "a fixed joint" };
            Diagnostic::error(Code::WRONG_PLACE, message)
                .label(name.span, what)
                .help("between two bodies write `A -> B along z` or `A -> B about z`")
        } else {
            Diagnostic::error(Code::WRONG_PLACE, format!("joint `{}` has several axes", name.text))
                .label(name.span, "which one?")
                .help(format!("write one of {}", axes.join(", ")))
        };
        self.fail(diagnostic, SCOPE)
    }

    /// The name leads into a joint whose own declaration is wrong, which has been said already.
    pub(super) fn is_of_wrong_joint(&self, name: &str) -> bool {
        let joints = self.declared.joints.iter().zip(&self.topology.joints);
        let mut wrong = joints.filter(|(_, read)| read.is_none()).map(|(joint, _)| joint.name.text.as_str());
        wrong.any(|joint| name.strip_prefix(joint).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
    }

    fn no_joint<T>(&mut self, name: &'a Name, entity: Option<Entity>) -> Option<T> {
        if self.is_of_wrong_joint(&name.text) {
            return None;
        }
        let mut axes: Vec<&str> = self.axis_index.keys().map(String::as_str).collect();
        axes.sort_unstable();
        let similar = similar_name(&name.text, axes);
        let (code, message) = match entity {
            Some(_) => (Code::WRONG_PLACE, format!("`{}` is not a joint", name.text)),
            None => (Code::UNKNOWN_NAME, format!("there is no joint `{}`", name.text)),
        };
        let mut diagnostic =
            Diagnostic::error(code, message).label(name.span, "a joint is needed here").suggest(similar);
        if matches!(entity, Some(Entity::Body(_))) {
            diagnostic = diagnostic.help("between bodies write `A -> B`");
        }
        if matches!(entity, Some(Entity::Coupling(_))) {
            diagnostic = diagnostic.help(on_coupling(&name.text));
        }
        if entity.is_none() { self.fail_unknown(&name.text, diagnostic, SCOPE) } else { self.fail(diagnostic, SCOPE) }
    }

    /// The stated length, or the distance of the points in the reference configuration.
    fn free_length(
        &mut self,
        element: &Element<'a>,
        first: super::model::Attachment,
        second: super::model::Attachment,
        field: Option<&'a Field>,
    ) -> Option<Node> {
        if let Some(field) = field {
            let expression = self.field_expression(field)?;
            let path = format!("{}.free_length", element.name.text);
            let value = self.field_value(&path, expression, Allowed::Constant)?;
            let because = (field.key.span, "`free_length`");
            return Some(self.expect(value, expression.span, Dimension::LENGTH, because, SCOPE)?.node);
        }
        let (a, b) = (self.reference_position(first), self.reference_position(second));
        let mut sum = self.graph.constant(0.0);
        for axis in 0..3 {
            let difference = self.graph.subtract(b[axis], a[axis]);
            let square = self.graph.multiply(difference, difference);
            sum = self.graph.add(sum, square);
        }
        if self.graph.is_zero(sum) {
            // How a body moves whose joint could not be read is not known.
            if [first.body, second.body].into_iter().flatten().any(|body| self.is_at_broken_joint(body)) {
                return None;
            }
            let message = format!("`{}` joins two points that coincide", element.name.text);
            let diagnostic = Diagnostic::error(Code::COINCIDENT_POINTS, message)
                .label(element.name.span, "its direction is not defined")
                .help("give it a direction (`along z`), a `free_length`, or points that lie apart");
            return self.fail(diagnostic, SCOPE);
        }
        Some(self.graph.unary(Unary::Sqrt, sum))
    }

    fn force_instance(&mut self, index: usize, element: &Element<'a>, placed: Option<PlacedForce>) -> Option<usize> {
        let law = self.find_law(element.law);
        let (law, placed) = (law?, placed?);
        let site = Site::Force(index);
        let (x, v) = (self.graph.variable(placed.coordinate), self.graph.variable(placed.rate));
        let mut place_ports: Vec<(&'a str, Typed)> = vec![
            ("x", Typed::new(x, coordinate_dimension(placed.motion))),
            ("v", Typed::new(v, rate_dimension(placed.motion))),
        ];
        if let ForcePlace::Joint { joint, axis } = placed.place {
            place_ports.push(("inertia", self.joint_inertia(joint, axis)?));
        } else if let Some(port) = law.ports.iter().find(|port| port.name.text == "inertia") {
            let message = format!("law `{}` needs the inertia that a joint moves", law.name.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(element.law.span, "stands between bodies")
                .secondary(port.name.span, "declared here")
                .help("let it stand `on JOINT`");
            return self.fail(diagnostic, SCOPE);
        }
        let is_actuator = element.role == crate::syntax::ElementRole::Actuator;
        if let ForcePlace::Joint { joint, axis } = placed.place
            && is_actuator
            && self.is_prescribed(joint, axis)
        {
            let driven = &self.declared.joints[joint].name;
            let message = format!("actuator `{}` cannot move joint `{}`", element.name.text, driven.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(element.name.span, "drives what moves as prescribed")
                .secondary(driven.span, "has a `motion`")
                .help(
                    "leave out the `motion`, or the actuator; what a prescribed motion takes is the joint's `reaction`",
                );
            return self.fail(diagnostic, SCOPE);
        }
        let sort = if is_actuator { "actuator" } else { "force" };
        let kinds = Kinds::of(placed.motion);
        let instance = self.law_instance(law, element.name, sort, site, kinds, place_ports);
        Some(self.add_instance(instance, element.fields, &["free_length"], element.law))
    }

    fn joint_inertia(&mut self, joint: usize, axis: usize) -> Option<Typed> {
        let entry = self.axis_entry(joint, axis)?;
        let (inertia, motion) = (entry.symbols.inertia, entry.motion.motion());
        let node = self.graph.variable(inertia);
        let acceleration = rate_dimension(motion) / Dimension::TIME;
        Some(Typed::new(node, load_dimension(motion) / acceleration))
    }

    fn signal_instance(&mut self, index: usize, name: &'a Name, law: &'a Name, fields: &'a [Field]) -> Option<usize> {
        let declaration = self.find_law(law)?;
        let instance =
            self.law_instance(declaration, name, "signal", Site::Signal(index), Kinds::default(), Vec::new());
        Some(self.add_instance(instance, fields, &[], law))
    }

    fn law_instance(
        &mut self,
        law: &'a LawDeclaration,
        name: &'a Name,
        sort: &'static str,
        site: Site,
        kinds: Kinds,
        place_ports: Vec<(&'a str, Typed)>,
    ) -> Instance<'a> {
        let declared: Vec<&'a Declared> = law.ports.iter().chain(&law.parameters).collect();
        Instance {
            owner: &name.text,
            sort,
            span: name.span,
            site,
            step: self.site_effects.get(&site).map_or(0, Vec::len),
            is_effect: false,
            declared,
            bindings: &law.bindings,
            states: &law.states,
            events: &law.events,
            fields: Vec::new(),
            kinds,
            progress: Progress::Open,
            place_ports,
        }
    }

    /// Where an effect acts; registers it in the chain of that site.
    fn effect_site(&mut self, index: usize) -> Option<(Site, Entity)> {
        let declared: &'a Declarations<'a> = self.declared;
        let element = &declared.effects[index];
        let ElementPlace::On(name) = element.place else {
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, "an effect stands on an element")
                .label(element.law.span, "no element named")
                .help("write `on NAME` with the name of a joint, force, actuator, input, measure or signal");
            return self.fail(diagnostic, SCOPE);
        };
        let Some(entity) = self.place_entity(&name.text) else {
            let names = self.all_names();
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no `{}`", name.text))
                .label(name.span, "not declared")
                .suggest(similar_name(&name.text, names.iter().copied()));
            return self.fail_unknown(&name.text, diagnostic, SCOPE);
        };
        let site = match entity {
            Entity::JointAxis(..) => Site::JointEffect(index),
            Entity::Force(force) => Site::Force(force),
            Entity::Input(input) => Site::Input(input),
            Entity::Measure(measure) => Site::Measure(measure),
            Entity::Signal(signal) => Site::Signal(signal),
            Entity::Gravity(axis) => Site::Gravity(axis),
            Entity::Joint(_) | Entity::Coupling(_) | Entity::Constant(_) | Entity::Body(_) | Entity::Effect(_) => {
                let message = format!("an effect cannot act on `{}`", name.text);
                let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                    .label(name.span, "not a place for effects")
                    .help(match entity {
                        Entity::Coupling(_) => on_coupling(&name.text),
                        _ => {
                            "effects act on moving joints, forces, actuators, inputs, measures, signals and `gravity.x`"
                                .to_owned()
                        }
                    });
                return self.fail(diagnostic, SCOPE);
            }
        };
        // What an effect adds to a joint is the site's own load and acts once; only other sites have a chain.
        if self.effect_of(index).is_some() && !matches!(site, Site::JointEffect(_)) {
            self.site_effects.entry(site).or_default().push(index);
        }
        Some((site, entity))
    }

    fn effect_instance(&mut self, index: usize, site: Site, entity: Entity) -> Option<usize> {
        let declared: &'a Declarations<'a> = self.declared;
        let element = &declared.effects[index];
        let Some(effect) = self.effect_of(index) else {
            let names = declared.effect_declarations.iter().map(|effect| effect.declaration.name.text.as_str());
            let diagnostic =
                Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no effect `{}`", element.law.text))
                    .label(element.law.span, "not declared")
                    .suggest(similar_name(&element.law.text, names));
            return self.fail(diagnostic, SCOPE);
        };
        let motion = self.entity_motion(entity);
        let mut kinds = motion.map(Kinds::of).unwrap_or_default();
        if let Some(dimension) = self.declared_value(entity) {
            kinds = Kinds::of_value(dimension);
        }
        self.check_effect_place(index, entity, motion)?;
        let mut place_ports: Vec<(&'a str, Typed)> = Vec::new();
        if let (Site::JointEffect(_), Entity::JointAxis(joint, axis)) = (site, entity) {
            let entry = self.axis_entry(joint, axis)?;
            let (symbols, motion) = (entry.symbols, entry.motion.motion());
            let (x, v) = (self.graph.variable(symbols.position), self.graph.variable(symbols.velocity));
            place_ports.push(("x", Typed::new(x, coordinate_dimension(motion))));
            place_ports.push(("v", Typed::new(v, rate_dimension(motion))));
            place_ports.push(("inertia", self.joint_inertia(joint, axis)?));
        }
        let step = self.site_effects.get(&site).and_then(|chain| chain.iter().position(|other| *other == index));
        let instance = Instance {
            owner: &element.name.text,
            sort: "effect",
            span: element.name.span,
            site,
            step: if matches!(site, Site::JointEffect(_)) { 0 } else { step.unwrap_or(0) },
            is_effect: true,
            declared: effect.amplitudes.iter().chain(&effect.shapes).collect(),
            bindings: &effect.bindings,
            states: &effect.states,
            events: &[],
            fields: Vec::new(),
            kinds,
            progress: Progress::Open,
            place_ports,
        };
        Some(self.add_instance(instance, element.fields, &[], element.law))
    }

    /// Dimension of an input or measure by its unit.
    fn declared_value(&self, entity: Entity) -> Option<Dimension> {
        let unit = match entity {
            Entity::Input(index) => match self.declared.inputs[index].unit {
                Some(unit) => unit,
                None => return Some(Dimension::ONE),
            },
            Entity::Measure(index) => self.declared.measures[index].unit?,
            Entity::Gravity(_) => return Some(Dimension::ACCELERATION),
            _ => return None,
        };
        Unit::parse(&unit.text).ok().map(|unit| unit.dimension)
    }

    /// The effect's declaration admits this kind of place.
    fn check_effect_place(&mut self, index: usize, entity: Entity, motion: Option<Motion>) -> Option<()> {
        let declared: &'a Declarations<'a> = self.declared;
        let element = &declared.effects[index];
        let effect = self.effect_of(index)?;
        let kind = self.place_kind(entity)?;
        let word = super::effects::kind_word(kind);
        let places: Vec<&str> = effect.places.iter().map(|place| place.text.as_str()).collect();
        let restriction = effect.restriction.as_ref();
        let span = match element.place {
            ElementPlace::On(name) => name.span,
            _ => element.name.span,
        };
        if !places.contains(&word) {
            let message = format!("effect `{}` cannot act on a {word}", effect.name.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(span, format!("a {word}"))
                .secondary(effect.name.span, format!("declared at any {}", places.join(", ")));
            return self.fail(diagnostic, SCOPE);
        }
        let wanted = match restriction.map(|name| name.text.as_str()) {
            Some("translational") => Some(Motion::Translational),
            Some("rotational") => Some(Motion::Rotational),
            _ => None,
        };
        if let (Some(wanted), Some(restriction)) = (wanted, restriction)
            && Some(wanted) != motion
        {
            let message = format!("effect `{}` acts on {} places only", effect.name.text, restriction.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(span, "not one of them")
                .secondary(restriction.span, "declared here");
            return self.fail(diagnostic, SCOPE);
        }
        let dimension = self.declared_value(entity).or(motion.map(load_dimension));
        if let (Some(restriction), Some(dimension)) = (restriction, dimension)
            && let Some(wanted) = named_type(&restriction.text)
            && wanted.dimension != dimension
        {
            let message = format!("effect `{}` acts on values of type {} only", effect.name.text, restriction.text);
            let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                .label(span, format!("this has {dimension}"))
                .secondary(restriction.span, "declared here");
            return self.fail(diagnostic, SCOPE);
        }
        self.check_replaced_ports(index, entity, span)
    }

    /// What the effect replaces is there: not every actuator has a `command`.
    fn check_replaced_ports(&mut self, index: usize, entity: Entity, span: Span) -> Option<()> {
        let effect = self.effect_of(index)?;
        let site = match entity {
            Entity::Force(force) => Site::Force(force),
            Entity::Signal(signal) => Site::Signal(signal),
            _ => return Some(()),
        };
        for action in &effect.actions {
            if let EffectAction::Replaces(port, _) = action
                && self.site_port(site, &port.text).is_none()
            {
                let name = self.site_name(site);
                let message =
                    format!("effect `{}` replaces `{}`, which `{name}` does not have", effect.name.text, port.text);
                let diagnostic = Diagnostic::error(Code::WRONG_PLACE, message)
                    .label(span, format!("there is {}", self.site_ports(site).join(", ")))
                    .secondary(port.span, "replaced here");
                return self.fail(diagnostic, SCOPE);
            }
        }
        Some(())
    }

    pub fn place_kind(&self, entity: Entity) -> Option<PlaceKind> {
        Some(match entity {
            Entity::JointAxis(..) => PlaceKind::Joint,
            Entity::Force(index) => match self.declared.forces[index].role {
                crate::syntax::ElementRole::Actuator => PlaceKind::Actuator,
                _ => PlaceKind::Force,
            },
            Entity::Input(_) => PlaceKind::Input,
            Entity::Measure(_) => PlaceKind::Measure,
            Entity::Signal(_) => PlaceKind::Signal,
            Entity::Gravity(_) => PlaceKind::Gravity,
            Entity::Joint(_) | Entity::Coupling(_) | Entity::Constant(_) | Entity::Body(_) | Entity::Effect(_) => {
                return None;
            }
        })
    }
}

/// What to write instead of an element on a coupling.
fn on_coupling(name: &str) -> String {
    format!(
        "friction acts on one of the coupled joints, `on motor`, if need be with what the coupling transmits: `{{ transmitted = \
         {name}.torque }}`; play and elasticity need a body between: `joint play: revolute(z) gear -> wheel`, the coupling to the joint \
         of `gear`, and `force teeth: backlash on play {{ .. }}`"
    )
}
