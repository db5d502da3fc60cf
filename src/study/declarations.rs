//! The declarations that hold for one variant, sorted by what they declare.

use super::elaborate::{ArgumentCheck, Flat, FlatItem, PortCheck};
use super::load::Loaded;
use super::names::{Namespace, declare};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::syntax::{
    EffectDeclaration, ElementPlace, ElementRole, Expression, Field, IdentifyLine, Item, ItemKind, LawDeclaration,
    Lowpass, Name, TableDeclaration,
};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What the chosen variant declares; borrows the trees.
#[derive(Default)]
pub(super) struct Declarations<'a> {
    pub name: Option<(&'a Name, Option<&'a Name>)>,
    pub gravity: Option<(&'a Expression, &'a crate::syntax::Direction)>,
    pub constants: Vec<Constant<'a>>,
    pub inputs: Vec<Input<'a>>,
    pub bodies: Vec<Body<'a>>,
    /// `body ground { point anchor = (..) }`: points fixed in space.
    pub ground: Option<Body<'a>>,
    pub joints: Vec<Joint<'a>>,
    pub couplings: Vec<Coupling<'a>>,
    pub forces: Vec<Element<'a>>,
    pub signals: Vec<Signal<'a>>,
    pub effects: Vec<Element<'a>>,
    pub measures: Vec<Measure<'a>>,
    pub groups: Vec<(&'a Name, &'a [Name])>,
    pub experiments: Vec<Experiment<'a>>,
    pub manoeuvres: Vec<Manoeuvre<'a>>,
    pub criteria: Vec<Criterion<'a>>,
    pub identify: Vec<Identified<'a>>,
    pub constraints: Vec<&'a Expression>,
    pub filter: Option<(Option<&'a Lowpass>, bool, Span)>,
    pub solver: Option<&'a [Field]>,
    pub laws: HashMap<&'a str, Law<'a>>,
    pub tables: Vec<&'a TableDeclaration>,
    /// In order of declaration, the prelude first.
    pub effect_declarations: Vec<Effect<'a>>,
    /// Declared names in order, `base` not included.
    pub variants: Vec<&'a Name>,
    pub variant: String,
    pub arguments: &'a [ArgumentCheck],
    pub ports: &'a [PortCheck],
    /// Names of what could not be written out; what is missing there is no finding of its own.
    pub broken: Option<&'a BTreeSet<String>>,
}

pub(super) struct Constant<'a> {
    pub name: &'a Name,
    pub value: &'a Expression,
}

pub(super) struct Input<'a> {
    pub name: &'a Name,
    pub unit: Option<&'a Name>,
    pub title: Option<&'a Name>,
    pub fields: &'a [Field],
}

pub(super) struct Body<'a> {
    pub name: &'a Name,
    pub fields: &'a [Field],
    pub points: &'a [Field],
}

pub(super) struct Joint<'a> {
    pub name: &'a Name,
    pub kind: &'a Name,
    pub axes: &'a [crate::syntax::JointAxis],
    pub parent: &'a Name,
    pub child: &'a Name,
    pub fields: &'a [Field],
}

pub(super) struct Coupling<'a> {
    pub name: &'a Name,
    pub left: &'a Expression,
    pub right: &'a Expression,
}

pub(super) struct Element<'a> {
    pub role: ElementRole,
    pub name: &'a Name,
    pub law: &'a Name,
    pub place: &'a ElementPlace,
    pub fields: &'a [Field],
}

/// A signal by a law or by a formula.
pub(super) struct Signal<'a> {
    pub name: &'a Name,
    pub kind: SignalKind<'a>,
}

pub(super) enum SignalKind<'a> {
    Law { law: &'a Name, fields: &'a [Field] },
    Formula(&'a Expression),
}

pub(super) struct Measure<'a> {
    pub name: &'a Name,
    pub unit: Option<&'a Name>,
    pub title: Option<&'a Name>,
    pub value: &'a Expression,
    pub fields: &'a [Field],
}

pub(super) struct Experiment<'a> {
    pub name: &'a Name,
    pub role: Option<&'a Name>,
    pub fields: &'a [Field],
}

pub(super) struct Manoeuvre<'a> {
    pub name: &'a Name,
    pub title: Option<&'a Name>,
    pub durations: &'a [Expression],
    pub fields: &'a [Field],
}

pub(super) struct Criterion<'a> {
    pub name: &'a Name,
    pub unit: Option<&'a Name>,
    pub title: Option<&'a Name>,
    pub value: &'a Expression,
    pub manoeuvre: &'a Name,
    pub fields: &'a [Field],
}

#[derive(Clone, Copy)]
pub(super) struct Identified<'a> {
    pub line: &'a IdentifyLine,
    /// Written by the variant (or one of its bases), not by the base study.
    pub by_variant: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Law<'a> {
    pub declaration: &'a LawDeclaration,
    pub is_prelude: bool,
    /// Stands for a table, which is checked by itself.
    pub is_table: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Effect<'a> {
    pub declaration: &'a EffectDeclaration,
    pub documentation: &'a str,
    pub is_prelude: bool,
}

/// Sorts the laws and effects of all files and the items of the study.
pub(super) fn collect<'a>(loaded: &'a Loaded, flat: &'a Flat, diagnostics: &mut Vec<Diagnostic>) -> Declarations<'a> {
    let mut result = Declarations {
        variant: flat.variant.clone(),
        variants: flat.variants.iter().collect(),
        arguments: &flat.arguments,
        ports: &flat.ports,
        broken: Some(&flat.broken),
        ..Declarations::default()
    };
    for (tree, is_prelude) in loaded.trees() {
        for item in &tree.items {
            match &item.kind {
                ItemKind::Law(declaration) => add_law(&mut result, declaration, is_prelude, false, diagnostics),
                ItemKind::Table(declaration) => result.tables.push(declaration),
                ItemKind::Effect(declaration) => {
                    add_effect(&mut result, declaration, &item.documentation, is_prelude, diagnostics);
                }
                _ => {}
            }
        }
    }
    for law in &flat.table_laws {
        add_law(&mut result, law, false, true, diagnostics);
    }
    for FlatItem { item, by_variant } in &flat.items {
        sort(&mut result, item, *by_variant, diagnostics);
    }
    check_duplicates(&result, &flat.parts, diagnostics);
    result
}

fn add_law<'a>(
    result: &mut Declarations<'a>,
    declaration: &'a LawDeclaration,
    is_prelude: bool,
    is_table: bool,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let law = Law { declaration, is_prelude, is_table };
    if let Some(earlier) = result.laws.insert(&declaration.name.text, law) {
        diagnostics.push(second_declaration("law", &declaration.name, &earlier.declaration.name, earlier.is_prelude));
    }
}

fn add_effect<'a>(
    result: &mut Declarations<'a>,
    declaration: &'a EffectDeclaration,
    documentation: &'a str,
    is_prelude: bool,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let effect = Effect { declaration, documentation, is_prelude };
    let same = |other: &&mut Effect<'a>| other.declaration.name.text == declaration.name.text;
    match result.effect_declarations.iter_mut().find(same) {
        Some(earlier) => {
            let (name, was_prelude) = (&earlier.declaration.name, earlier.is_prelude);
            diagnostics.push(second_declaration("effect", &declaration.name, name, was_prelude));
            *earlier = effect;
        }
        None => result.effect_declarations.push(effect),
    }
}

fn second_declaration(sort: &str, name: &Name, earlier: &Name, was_prelude: bool) -> Diagnostic {
    if was_prelude {
        Diagnostic::remark(Code::OVERRIDES_PRELUDE, format!("{sort} `{}` replaces the one of the prelude", name.text))
            .label(name.span, "this one is used")
            .secondary(earlier.span, "the prelude's")
    } else {
        Diagnostic::error(Code::DUPLICATE_NAME, format!("{sort} `{}` is declared twice", name.text))
            .label(name.span, "second declaration")
            .secondary(earlier.span, "first declaration")
            .help("rename or remove one of them")
    }
}

fn sort<'a>(result: &mut Declarations<'a>, item: &'a Item, by_variant: bool, diagnostics: &mut Vec<Diagnostic>) {
    match &item.kind {
        ItemKind::Study { name, title } => {
            once(&mut result.name, (name, title.as_ref()), "study", name.span, diagnostics);
        }
        ItemKind::Gravity { value, direction } => {
            once(&mut result.gravity, (value, direction), "gravity", item.span, diagnostics);
        }
        ItemKind::Constant { name, value } => result.constants.push(Constant { name, value }),
        ItemKind::Input { name, unit, title, fields } => {
            result.inputs.push(Input { name, unit: unit.as_ref(), title: title.as_ref(), fields });
        }
        ItemKind::Body { name, fields, points } if name.text == "ground" => {
            once(&mut result.ground, Body { name, fields, points }, "body ground", name.span, diagnostics);
        }
        ItemKind::Body { name, fields, points } => result.bodies.push(Body { name, fields, points }),
        ItemKind::Joint { name, kind, axes, parent, child, fields } => {
            result.joints.push(Joint { name, kind, axes, parent, child, fields });
        }
        ItemKind::Coupling { name, left, right } => result.couplings.push(Coupling { name, left, right }),
        ItemKind::Element { role, name, law, place, fields } => {
            let element = Element { role: *role, name, law, place, fields };
            match role {
                ElementRole::Force | ElementRole::Actuator => result.forces.push(element),
                ElementRole::Effect => result.effects.push(element),
                ElementRole::Signal => result.signals.push(Signal { name, kind: SignalKind::Law { law, fields } }),
            }
        }
        ItemKind::Formula { name, value } => {
            result.signals.push(Signal { name, kind: SignalKind::Formula(value) });
        }
        ItemKind::Measure { name, unit, title, value, fields } => {
            result.measures.push(Measure { name, unit: unit.as_ref(), title: title.as_ref(), value, fields });
        }
        ItemKind::Group { name, members } => result.groups.push((name, members)),
        ItemKind::Experiment { name, role, fields } => {
            result.experiments.push(Experiment { name, role: role.as_ref(), fields });
        }
        ItemKind::Manoeuvre { name, title, durations, fields } => {
            result.manoeuvres.push(Manoeuvre { name, title: title.as_ref(), durations, fields });
        }
        ItemKind::Criterion { name, unit, title, value, manoeuvre, fields } => {
            let (unit, title) = (unit.as_ref(), title.as_ref());
            result.criteria.push(Criterion { name, unit, title, value, manoeuvre, fields });
        }
        ItemKind::Identify { lines, constraints } => {
            add_identified(result, lines, by_variant, diagnostics);
            result.constraints.extend(constraints);
        }
        ItemKind::Filter { lowpass, remove_mean } => {
            let filter = (lowpass.as_ref(), *remove_mean, item.span);
            once(&mut result.filter, filter, "filter", item.span, diagnostics);
        }
        ItemKind::Solver { fields } => once(&mut result.solver, fields.as_slice(), "solver", item.span, diagnostics),
        ItemKind::Law(declaration) => add_law(result, declaration, false, false, diagnostics),
        ItemKind::Effect(declaration) => add_effect(result, declaration, &item.documentation, false, diagnostics),
        // Written out before, or not admitted by the grammar inside a variant.
        ItemKind::Variant { .. }
        | ItemKind::Use { .. }
        | ItemKind::Model(_)
        | ItemKind::Part { .. }
        | ItemKind::Table(_)
        | ItemKind::Family { .. } => {}
    }
}

fn once<T>(slot: &mut Option<T>, value: T, what: &str, span: Span, diagnostics: &mut Vec<Diagnostic>) {
    if slot.is_some() {
        diagnostics.push(
            Diagnostic::error(Code::DUPLICATE_NAME, format!("`{what}` is declared twice"))
                .label(span, "second declaration")
                .help("a study has one; in a variant write `replace`"),
        );
    } else {
        *slot = Some(value);
    }
}

/// A later line for the same target replaces the earlier one if a variant wrote it.
fn add_identified<'a>(
    result: &mut Declarations<'a>,
    lines: &'a [IdentifyLine],
    by_variant: bool,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for line in lines {
        let new = Identified { line, by_variant };
        match result.identify.iter_mut().find(|earlier| earlier.line.target.text == line.target.text) {
            Some(earlier) if by_variant => *earlier = new,
            Some(earlier) => diagnostics.push(
                Diagnostic::error(Code::DUPLICATE_NAME, format!("`{}` is identified twice", line.target.text))
                    .label(line.target.span, "second line")
                    .secondary(earlier.line.target.span, "first line"),
            ),
            None => result.identify.push(new),
        }
    }
}

/// Everything that an expression can name shares one namespace; groups, experiments with manoeuvres, and
/// criteria have their own.
fn check_duplicates(result: &Declarations<'_>, parts: &[Name], diagnostics: &mut Vec<Diagnostic>) {
    let mut values: Namespace<'_> = BTreeMap::new();
    let constants = result.constants.iter().map(|constant| ("constant", constant.name));
    let inputs = result.inputs.iter().map(|input| ("input", input.name));
    let bodies = result.bodies.iter().map(|body| ("body", body.name));
    let joints = result.joints.iter().map(|joint| ("joint", joint.name));
    let couplings = result.couplings.iter().map(|coupling| ("coupling", coupling.name));
    let forces = result.forces.iter().map(|force| ("force", force.name));
    let signals = result.signals.iter().map(|signal| ("signal", signal.name));
    let effects = result.effects.iter().map(|effect| ("effect", effect.name));
    let measures = result.measures.iter().map(|measure| ("measure", measure.name));
    let all = constants
        .chain(inputs)
        .chain(bodies)
        .chain(joints)
        .chain(couplings)
        .chain(forces)
        .chain(signals)
        .chain(effects);
    let parts = parts.iter().map(|name| ("part", name));
    for (sort, name) in all.chain(measures).chain(parts) {
        declare(&mut values, sort, name, diagnostics);
    }
    let mut groups: Namespace<'_> = BTreeMap::new();
    for (name, _) in &result.groups {
        declare(&mut groups, "group", name, diagnostics);
    }
    let mut experiments: Namespace<'_> = BTreeMap::new();
    for experiment in &result.experiments {
        declare(&mut experiments, "experiment", experiment.name, diagnostics);
    }
    for manoeuvre in &result.manoeuvres {
        declare(&mut experiments, "manoeuvre", manoeuvre.name, diagnostics);
    }
    let mut criteria: Namespace<'_> = BTreeMap::new();
    for criterion in &result.criteria {
        declare(&mut criteria, "criterion", criterion.name, diagnostics);
    }
}
