//! What is known while a study is checked: declared things by name, values found so far, findings.

use super::declarations::Declarations;
use super::elements::PlacedForce;
use super::evaluate::Typed;
use super::instance::Instance;
use super::load::Loaded;
use super::model::{Body, Constant, Coupling, Input, Parameter, Point, PointQuantity, ReactionQuantity, State};
use super::tables::Table;
use super::topology::Topology;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Graph, Node, Symbol};
use crate::syntax::Name;
use std::collections::{HashMap, HashSet};

/// Findings with suggestions of similar names.
const MOST_SUGGESTIONS: usize = 200;

/// Definitions and parts of expressions nested deeper are refused.
pub(super) const DEEPEST_EVALUATION: usize = 500;

/// Where an expression stands; decides what its names mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    Study(Allowed),
    /// Inside the law or effect of this instance.
    Instance(usize),
}

/// What an expression of the study may mention.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Allowed {
    /// Numbers as written.
    Number,
    /// Numbers, constants and parameters.
    Constant,
    /// The same, time, inputs, positions, velocities, loads and states.
    Motion,
    /// The same and accelerations.
    Acceleration,
}

/// What a name of the study declares: an index into the list of [`Declarations`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Entity {
    Constant(usize),
    Input(usize),
    Body(usize),
    Joint(usize),
    /// Joint and axis: a place for elements.
    JointAxis(usize, usize),
    Coupling(usize),
    Force(usize),
    Signal(usize),
    Effect(usize),
    Measure(usize),
    /// A component of gravity across its declared direction, by ground axis: a place for effects.
    Gravity(usize),
}

/// Something with a value that effects can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Site {
    Input(usize),
    /// Component of gravity by ground axis.
    Gravity(usize),
    Force(usize),
    Signal(usize),
    Measure(usize),
    /// The load that an effect on a joint adds: index of the effect's use.
    JointEffect(usize),
    /// The declaration of a law or effect by itself, tried out on an imagined place: index of the instance.
    Trial(usize),
}

/// A value that is found at most once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Key<'a> {
    Constant(usize),
    Mass(usize),
    /// A field (or default) of an instance, before its type is checked.
    Raw(usize, &'a str),
    /// The same, checked.
    Field(usize, &'a str),
    Binding(usize, usize),
    State(usize, usize),
    /// The value of a port of a site after its first n effects.
    Port(Site, &'a str, usize),
}

#[derive(Clone, Copy)]
enum Slot {
    Busy,
    Done(Option<Typed>),
}

/// A state whose derivative is a node already.
pub(super) struct SensorState {
    pub name: String,
    pub symbol: Symbol,
    pub derivative: crate::expression::Node,
    pub initial: crate::expression::Node,
    pub dimension: crate::quantities::Dimension,
    pub span: Span,
}

pub(super) struct Checker<'a> {
    pub loaded: &'a Loaded,
    pub declared: &'a Declarations<'a>,
    /// `None`: wrong, as reported.
    pub tables: HashMap<&'a str, Option<Table>>,
    /// What `wavenumber` means in the formula of a spectrum.
    pub wavenumber: Option<super::evaluate::Typed>,
    pub graph: Graph,
    pub time: Symbol,
    pub diagnostics: Vec<Diagnostic>,
    pub entities: HashMap<&'a str, Entity>,
    pub parameters: Vec<Parameter>,
    /// By target as written.
    pub parameter_index: HashMap<String, usize>,
    /// Per parameter: its target was met (paths) or the name was used.
    pub parameter_met: Vec<bool>,
    /// Targets that have a value of their own in each experiment, and what they stand for.
    pub per_experiment: HashMap<String, crate::expression::Node>,
    /// Per measure: offsets of single experiments (index of the experiment, parameter).
    pub offsets: Vec<(usize, usize, crate::expression::Node)>,
    pub constants: Vec<Constant>,
    pub topology: Topology<'a>,
    pub bodies: Vec<Body>,
    /// Points of ground.
    pub ground_points: Vec<Point>,
    /// Joint and axis by the axis' name.
    pub axis_index: HashMap<String, (usize, usize)>,
    /// Orientations of joints found so far.
    pub orientations: HashMap<usize, Option<[[Node; 3]; 3]>>,
    pub reactions: Vec<ReactionQuantity>,
    /// Per declared coupling; `None`: wrong, as reported.
    pub couplings: Vec<Option<Coupling>>,
    /// Components of gravity as declared; `None` without.
    pub gravity: Option<[Typed; 3]>,
    pub instances: Vec<Instance<'a>>,
    pub placed_forces: Vec<Option<PlacedForce>>,
    pub force_instances: Vec<Option<usize>>,
    pub signal_instances: Vec<Option<usize>>,
    pub effect_instances: Vec<Option<usize>>,
    /// Uses of effects per site, in order of declaration.
    pub site_effects: HashMap<Site, Vec<usize>>,
    pub sensor_states: Vec<SensorState>,
    pub inputs: Vec<Input>,
    /// Finished states; empty until all values are known.
    pub states: Vec<State>,
    pub point_quantities: Vec<PointQuantity>,
    pub accelerations: HashSet<Symbol>,
    reported: HashSet<(&'static str, Span)>,
    unknown: HashSet<String>,
    memo: HashMap<Key<'a>, Slot>,
    stack: Vec<Key<'a>>,
    /// Expressions being evaluated, one within the other.
    pub depth: usize,
}

impl<'a> Checker<'a> {
    pub fn new(loaded: &'a Loaded, declared: &'a Declarations<'a>, diagnostics: Vec<Diagnostic>) -> Checker<'a> {
        let mut graph = Graph::new();
        let time = graph.symbol("t");
        Checker {
            loaded,
            declared,
            tables: HashMap::new(),
            wavenumber: None,
            graph,
            time,
            diagnostics,
            entities: entities(declared),
            parameters: Vec::new(),
            parameter_index: HashMap::new(),
            parameter_met: Vec::new(),
            per_experiment: HashMap::new(),
            offsets: Vec::new(),
            constants: Vec::new(),
            topology: Topology::default(),
            bodies: Vec::new(),
            ground_points: Vec::new(),
            axis_index: HashMap::new(),
            orientations: HashMap::new(),
            reactions: Vec::new(),
            couplings: Vec::new(),
            gravity: None,
            instances: Vec::new(),
            placed_forces: Vec::new(),
            force_instances: Vec::new(),
            signal_instances: Vec::new(),
            effect_instances: Vec::new(),
            site_effects: HashMap::new(),
            sensor_states: Vec::new(),
            inputs: Vec::new(),
            states: Vec::new(),
            point_quantities: Vec::new(),
            accelerations: HashSet::new(),
            reported: HashSet::new(),
            unknown: HashSet::new(),
            memo: HashMap::new(),
            stack: Vec::new(),
            depth: 0,
        }
    }

    /// Reports a finding once per code and place; inside a law or effect the element that uses it is named.
    pub fn report(&mut self, diagnostic: Diagnostic, scope: Scope) {
        let key = (diagnostic.code.text, diagnostic.span().unwrap_or_default());
        if !self.reported.insert(key) {
            return;
        }
        let diagnostic = match scope {
            Scope::Instance(index) => match self.instances.get(index) {
                Some(instance) => {
                    diagnostic.secondary(instance.span, format!("used by {} `{}`", instance.sort, instance.owner))
                }
                None => diagnostic,
            },
            Scope::Study(_) => diagnostic,
        };
        self.diagnostics.push(diagnostic);
    }

    /// [`Checker::report`] as the end of an evaluation.
    pub fn fail<T>(&mut self, diagnostic: Diagnostic, scope: Scope) -> Option<T> {
        self.report(diagnostic, scope);
        None
    }

    /// Like [`Checker::report`], but an unknown name is reported at its first place only.
    pub fn fail_unknown<T>(&mut self, name: &str, diagnostic: Diagnostic, scope: Scope) -> Option<T> {
        if !self.is_broken(name) && self.unknown.insert(name.to_owned()) {
            self.report(diagnostic, scope);
        }
        None
    }

    /// Findings about this name would be consequences of others.
    pub fn ignore_unknown(&mut self, name: &str) {
        self.unknown.insert(name.to_owned());
    }

    /// Whether the name could not be written out, so that it is missing for a reason reported already.
    pub fn is_broken(&self, name: &str) -> bool {
        let mut owners = name.match_indices(['.', '[']).map(|(at, _)| &name[..at]).chain([name]);
        name.is_empty() || self.declared.broken.is_some_and(|broken| owners.any(|owner| broken.contains(owner)))
    }

    /// A value that is wrong, as reported: what depends on it is not found either.
    pub fn invalidate(&mut self, key: Key<'a>) {
        self.memo.insert(key, Slot::Done(None));
    }

    /// The value of `key`, found by `find` on first use. `at` is where it is asked for, to report cycles.
    pub fn once(
        &mut self,
        key: Key<'a>,
        at: Span,
        find: impl FnOnce(&mut Checker<'a>) -> Option<Typed>,
    ) -> Option<Typed> {
        match self.memo.get(&key) {
            Some(Slot::Done(value)) => *value,
            Some(Slot::Busy) => self.report_cycle(key, at),
            None => {
                self.memo.insert(key, Slot::Busy);
                self.stack.push(key);
                let value = find(self);
                self.stack.pop();
                self.memo.insert(key, Slot::Done(value));
                value
            }
        }
    }

    /// Whether a value is being found right now, so that asking for it would be a cycle.
    pub fn is_busy(&self, key: Key<'a>) -> bool {
        matches!(self.memo.get(&key), Some(Slot::Busy))
    }

    fn report_cycle(&mut self, key: Key<'a>, at: Span) -> Option<Typed> {
        let begin = self.stack.iter().position(|other| *other == key).unwrap_or(0);
        let keys: Vec<Key<'a>> = self.stack[begin..].to_vec();
        let mut names: Vec<String> = Vec::new();
        for key in keys {
            let name = self.key_name(key);
            if names.last() != Some(&name) {
                names.push(name);
            }
        }
        if names.len() > 1 && names.first() == names.last() {
            names.pop();
        }
        let first = names.first().cloned().unwrap_or_default();
        let chain: Vec<String> = names.iter().chain([&first]).map(|name| format!("`{name}`")).collect();
        let diagnostic = Diagnostic::error(Code::CYCLIC_DEFINITION, format!("`{first}` is defined by itself"))
            .label(at, "closes the circle")
            .note(chain.join(" needs "))
            .help("break the circle, e.g. by a law with a state (`pt1`)");
        self.fail(diagnostic, Scope::Study(Allowed::Constant))
    }

    fn key_name(&self, key: Key<'a>) -> String {
        match key {
            Key::Constant(index) => self.declared.constants[index].name.text.clone(),
            Key::Mass(index) => format!("{}.mass", self.declared.bodies[index].name.text),
            Key::Raw(instance, name) | Key::Field(instance, name) => {
                format!("{}.{name}", self.instances[instance].owner)
            }
            Key::Binding(instance, index) => {
                format!("{}.{}", self.instances[instance].owner, self.instances[instance].bindings[index].0.text)
            }
            Key::State(instance, index) => self.instances[instance].state_name(index),
            Key::Port(site, port, _) => {
                let owner = self.site_name(site);
                match site {
                    Site::Input(_) | Site::Measure(_) => owner.to_owned(),
                    Site::Signal(_) | Site::Gravity(_) if port == "value" => owner.to_owned(),
                    _ => format!("{owner}.{port}"),
                }
            }
        }
    }

    pub fn site_name(&self, site: Site) -> &'a str {
        let declared = self.declared;
        match site {
            Site::Input(index) => &declared.inputs[index].name.text,
            Site::Force(index) => &declared.forces[index].name.text,
            Site::Signal(index) => &declared.signals[index].name.text,
            Site::Measure(index) => &declared.measures[index].name.text,
            Site::JointEffect(index) => &declared.effects[index].name.text,
            Site::Gravity(axis) => Self::gravity_name(axis),
            Site::Trial(index) => self.instances[index].owner,
        }
    }

    /// The declared thing that a path begins with, and the quantity behind it. Names of parts contain dots, so that the
    /// longest beginning that is declared counts; of unknown paths the first word.
    pub fn split_path<'p>(&self, path: &'p str) -> (&'p str, Option<&'p str>) {
        if self.is_name(path) {
            return (path, None);
        }
        let mut split = path.split_once('.');
        for (at, _) in path.rmatch_indices('.') {
            if self.is_name(&path[..at]) {
                split = Some((&path[..at], &path[at + 1..]));
                break;
            }
        }
        split.map_or((path, None), |(name, rest)| (name, Some(rest)))
    }

    fn is_name(&self, path: &str) -> bool {
        path == "ground" || self.entities.contains_key(path)
    }

    pub fn is_parameter(&self, symbol: Symbol) -> bool {
        self.parameters.iter().any(|parameter| parameter.symbol == symbol)
    }

    /// The identified parameter of this name or path; notes that it was met.
    pub fn parameter(&mut self, target: &str) -> Option<Typed> {
        let index = *self.parameter_index.get(target)?;
        self.parameter_met[index] = true;
        let (symbol, unit) = (self.parameters[index].symbol, &self.parameters[index].unit);
        let (dimension, writing) = (unit.dimension, unit.angle_content());
        let node = match self.per_experiment.get(target) {
            Some(node) => *node,
            None => self.graph.variable(symbol),
        };
        Some(Typed { writing, ..Typed::new(node, dimension) })
    }

    /// All names an expression of the study can start with, in order of declaration.
    pub fn all_names(&self) -> Vec<&'a str> {
        let declared = self.declared;
        // Among so many findings nobody looks for a misspelt word.
        if self.diagnostics.len() > MOST_SUGGESTIONS {
            return Vec::new();
        }
        let mut names: Vec<&'a str> = Vec::new();
        names.extend(declared.constants.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.inputs.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.bodies.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.joints.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.couplings.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.forces.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.signals.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.effects.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.measures.iter().map(|item| item.name.text.as_str()));
        names.extend(declared.identify.iter().map(|item| item.line.target.text.as_str()));
        names
    }
}

fn entities<'a>(declared: &Declarations<'a>) -> HashMap<&'a str, Entity> {
    let mut entities: HashMap<&'a str, Entity> = HashMap::new();
    // Of two declarations of one name the first stands; the second is reported already.
    let mut add = |name: &'a Name, entity: Entity| {
        entities.entry(&name.text).or_insert(entity);
    };
    declared.constants.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Constant(index)));
    declared.inputs.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Input(index)));
    declared.bodies.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Body(index)));
    declared.joints.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Joint(index)));
    declared.couplings.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Coupling(index)));
    declared.forces.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Force(index)));
    declared.signals.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Signal(index)));
    declared.effects.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Effect(index)));
    declared.measures.iter().enumerate().for_each(|(index, item)| add(item.name, Entity::Measure(index)));
    entities
}
