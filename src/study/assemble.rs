//! The stages of the check in order, and the study they make.

use super::channels::text_of;
use super::checker::{Allowed, Checker, Scope, Site};
use super::declarations::Declarations;
use super::model::{Force, ForcePlace, Signal, State, Study};
use super::trial::CheckedState;
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Graph, Node, Operation, Symbol};
use crate::syntax::ElementRole;

const SCOPE: Scope = Scope::Study(Allowed::Number);

impl<'a> Checker<'a> {
    /// Runs all stages. `None` without a `study` line; findings are in [`Checker::diagnostics`].
    pub fn study(&mut self) -> Option<Study> {
        let declared: &'a Declarations<'a> = self.declared;
        self.read_parameters();
        self.read_inputs();
        self.read_tables();
        self.check_ports();
        self.read_topology();
        // Before anything that uses the arguments, so that a wrong one is reported where it is written.
        self.check_arguments();
        self.read_bodies();
        self.place_elements();
        let gravity = self.finished_gravity();
        self.read_couplings();
        let forces = self.finished_forces();
        let signals = self.finished_signals();
        let measures = self.finished_measures();
        self.check_all_fields();
        self.states = self.finished_states();
        let events = self.finished_events(&forces);
        let experiments = self.finished_experiments();
        let manoeuvres = self.finished_manoeuvres();
        let criteria = self.finished_criteria();
        let constraints = self.finished_constraints();
        let (filter, remove_mean) = self.finished_filter();
        let solver = self.finished_solver();
        let groups = self.finished_groups();
        let joints = self.finished_joints();
        let places = self.finished_places(&forces, &measures);
        let effects = self.effect_catalogue();
        self.check_declarations();
        let couplings: Vec<_> = std::mem::take(&mut self.couplings).into_iter().flatten().collect();
        let mut roots = self.roots(&gravity, &joints, &forces, &measures, &experiments);
        roots.extend(couplings.iter().map(|coupling| coupling.difference));
        roots.extend(events.iter().flat_map(super::model::Event::nodes));
        let kept = self.check_influence(&roots);
        self.check_unused(&roots);
        let (name, title) = self.name_of_study()?;
        self.constants.sort_by_key(|constant| (constant.span.file, constant.span.start));
        let reactions = std::mem::take(&mut self.reactions)
            .into_iter()
            .filter_map(|reaction| {
                Some(super::model::ReactionQuantity { joint: self.joint_position(reaction.joint)?, ..reaction })
            })
            .collect();
        let parameters = kept.into_iter().map(|index| self.parameters[index].clone()).collect();
        Some(Study {
            name,
            title,
            variant: declared.variant.clone(),
            variants: declared.variants.iter().map(|name| name.text.clone()).collect(),
            graph: std::mem::replace(&mut self.graph, Graph::new()),
            time: self.time,
            gravity,
            parameters,
            constraints,
            inputs: std::mem::take(&mut self.inputs),
            bodies: std::mem::take(&mut self.bodies),
            joints,
            couplings,
            forces,
            signals,
            states: std::mem::take(&mut self.states),
            events,
            measures,
            point_quantities: std::mem::take(&mut self.point_quantities),
            reactions,
            groups,
            experiments,
            manoeuvres,
            criteria,
            filter,
            remove_mean,
            solver,
            constants: std::mem::take(&mut self.constants),
            effects,
            places,
        })
    }

    fn name_of_study(&mut self) -> Option<(String, String)> {
        match self.declared.name {
            Some((name, title)) => Some((name.text.clone(), text_of(title))),
            None => {
                let diagnostic = Diagnostic::error(Code::NO_STUDY, "the text declares no study")
                    .help("begin with `study NAME \"what it is about\"`");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    /// Force elements, actuators, then the loads that effects add to joints.
    fn finished_forces(&mut self) -> Vec<Force> {
        let declared: &'a Declarations<'a> = self.declared;
        let mut forces = Vec::new();
        for (index, element) in declared.forces.iter().enumerate() {
            let load = self.site_value(Site::Force(index), element.name.span);
            let placed = self.placed_forces.get(index).copied().flatten();
            if let (Some(load), Some(placed)) = (load, placed)
                && let Some(place) = self.finished_place(placed.place)
            {
                forces.push(Force {
                    name: element.name.text.clone(),
                    law: element.law.text.clone(),
                    is_actuator: element.role == ElementRole::Actuator,
                    place,
                    load: load.node,
                    coordinate: placed.coordinate,
                    rate: placed.rate,
                    span: element.name.span,
                });
            }
        }
        for (index, element) in declared.effects.iter().enumerate() {
            let Some(instance) = self.effect_instances.get(index).copied().flatten() else { continue };
            if self.instances[instance].site != Site::JointEffect(index) {
                continue;
            }
            let load = self.site_value(Site::JointEffect(index), element.name.span);
            if let (Some(load), Some((place, coordinate, rate))) = (load, self.joint_of_effect(index)) {
                forces.push(Force {
                    name: element.name.text.clone(),
                    law: element.law.text.clone(),
                    is_actuator: false,
                    place,
                    load: load.node,
                    coordinate,
                    rate,
                    span: element.name.span,
                });
            }
        }
        forces
    }

    fn finished_place(&self, place: ForcePlace) -> Option<ForcePlace> {
        match place {
            ForcePlace::Joint { joint, axis } => {
                self.joint_position(joint).map(|joint| ForcePlace::Joint { joint, axis })
            }
            between => Some(between),
        }
    }

    fn joint_of_effect(&self, effect: usize) -> Option<(ForcePlace, Symbol, Symbol)> {
        let crate::syntax::ElementPlace::On(name) = self.declared.effects[effect].place else { return None };
        let &(joint, axis) = self.axis_index.get(&name.text)?;
        let symbols = self.axis_entry(joint, axis)?.symbols;
        let place = ForcePlace::Joint { joint: self.joint_position(joint)?, axis };
        Some((place, symbols.position, symbols.velocity))
    }

    fn finished_signals(&mut self) -> Vec<Signal> {
        let declared: &'a Declarations<'a> = self.declared;
        let mut signals = Vec::new();
        for (index, signal) in declared.signals.iter().enumerate() {
            if let Some(value) = self.site_value(Site::Signal(index), signal.name.span) {
                let (name, span) = (signal.name.text.clone(), signal.name.span);
                signals.push(Signal { name, value: value.node, dimension: value.dimension, span });
            }
        }
        signals
    }

    /// Every constant, field and binding is checked, whether or not a value depends on it.
    fn check_all_fields(&mut self) {
        let declared: &'a Declarations<'a> = self.declared;
        self.check_arguments();
        for constant in &declared.constants {
            self.path(constant.name, Scope::Study(Allowed::Constant));
        }
        for index in 0..self.instances.len() {
            let instance = &self.instances[index];
            let (span, bindings) = (instance.span, instance.bindings);
            let fields: Vec<&'a str> = instance.declared.iter().map(|field| field.name.text.as_str()).collect();
            for field in fields {
                if self.instances[index].place_port(field).is_none() {
                    self.own_field(index, field, span);
                }
            }
            for (name, _) in bindings {
                self.local(index, name);
            }
        }
    }

    fn finished_states(&mut self) -> Vec<State> {
        let mut states = Vec::new();
        for index in 0..self.instances.len() {
            let declarations = self.instances[index].states;
            for (at, checked) in self.check_states(index, declarations).into_iter().enumerate() {
                let Some(CheckedState { symbol, initial, derivative, nominal }) = checked else { continue };
                let name = self.instances[index].state_name(at);
                states.push(State {
                    symbol: self.graph.symbol(&name),
                    name,
                    derivative: derivative.node,
                    initial: initial.node,
                    nominal,
                    dimension: symbol.dimension,
                    span: declarations[at].name.span,
                });
            }
        }
        for sensor in std::mem::take(&mut self.sensor_states) {
            states.push(State {
                name: sensor.name,
                symbol: sensor.symbol,
                derivative: sensor.derivative,
                initial: sensor.initial,
                nominal: None,
                dimension: sensor.dimension,
                span: sensor.span,
            });
        }
        states
    }

    /// Nodes that decide what is simulated and measured.
    fn roots(
        &self,
        gravity: &[Node; 3],
        joints: &[super::model::Joint],
        forces: &[Force],
        measures: &[super::model::Measure],
        experiments: &[super::model::Experiment],
    ) -> Vec<Node> {
        let mut roots: Vec<Node> = gravity.to_vec();
        for (index, body) in self.bodies.iter().enumerate() {
            roots.push(body.mass);
            let modes = body.elastic.iter().flat_map(|elastic| &elastic.modes);
            roots.extend(modes.flat_map(|mode| [mode.frequency, mode.damping]));
            if self.topology.turns(index) {
                roots.extend(body.inertia);
                roots.extend(body.centre_of_gravity);
                roots.extend(body.points.iter().flat_map(|point| point.position));
            }
        }
        for force in forces {
            roots.push(force.load);
            if let ForcePlace::Between { first, second, free_length, .. } = force.place {
                roots.extend(free_length);
                roots.extend(first.position.into_iter().chain(second.position));
            }
        }
        for joint in joints {
            let ends = [&joint.parent, &joint.child];
            if joint.closes_loop || joint.orientation.is_some() || joint.rotation.is_some() {
                roots.extend(ends.into_iter().flat_map(|end| end.position));
            }
            roots.extend(joint.orientation.iter().flatten().flatten());
            roots.extend(joint.length);
            roots.extend(joint.axes.iter().filter_map(|axis| axis.prescribed));
        }
        roots.extend(self.states.iter().flat_map(|state| [state.derivative, state.initial]));
        roots.extend(measures.iter().flat_map(|measure| [Some(measure.value), measure.delay]).flatten());
        roots.extend(self.point_quantities.iter().flat_map(|quantity| quantity.point.position));
        roots.extend(
            experiments.iter().flat_map(|experiment| experiment.start.overrides.iter().map(|(_, value)| *value)),
        );
        roots
    }

    /// Inputs that nothing samples are worth a warning: a name may have been forgotten.
    fn check_unused(&mut self, roots: &[Node]) {
        let mut sampled = vec![false; self.inputs.len()];
        for node in self.graph.reachable(roots) {
            if let Operation::Sample { input, .. } = self.graph.operation(node)
                && let Some(flag) = sampled.get_mut(input as usize)
            {
                *flag = true;
            }
        }
        let unused: Vec<(String, crate::diagnostics::Span)> = self
            .inputs
            .iter()
            .zip(sampled)
            .filter(|(_, sampled)| !sampled)
            .map(|(input, _)| (input.name.clone(), input.span))
            .collect();
        for (name, span) in unused {
            let diagnostic = Diagnostic::warning(Code::UNUSED_DECLARATION, format!("input `{name}` drives nothing"))
                .label(span, "nothing depends on it");
            self.report(diagnostic, SCOPE);
        }
        if self.declared.experiments.is_empty() && self.declared.manoeuvres.is_empty() {
            let diagnostic = Diagnostic::warning(Code::UNUSED_DECLARATION, "the study has no experiment").help(
                "add `experiment NAME { data = \"file.csv\", start = equilibrium }` to compare it with measurements",
            );
            self.report(diagnostic, SCOPE);
        }
    }
}
