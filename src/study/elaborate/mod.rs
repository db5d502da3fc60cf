//! Models, their uses and index families written out: tree in, flat items out, spans kept.
//!
//! *In*: the trees of a study and the name of a variant. *Out*: the items that hold for it, each with its full name
//! (`front.spring`, `wheel[3]`), and what is left to check about the arguments and ports of parts. *Must not happen
//! here*: dimensions, meaning of expressions.

mod family;
mod number;
mod part;
mod rewrite;
mod scope;
mod table;
mod variants;

use super::load::Loaded;
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::syntax::{Change, Expression, Item, ItemKind, LawDeclaration, ModelDeclaration, Name, TypeExpression};
use scope::Scope;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use table::table_law;

/// More declarations than this are refused.
const MOST_ITEMS: usize = 10_000;

/// Bytes of text written out, with something for every declaration: models and families may multiply each other.
const MOST_TEXT: usize = 8 << 20;
const TEXT_OF_A_DECLARATION: usize = 40;

/// Items in order of declaration, without models, parts and families.
pub(super) struct Flat {
    pub items: Vec<FlatItem>,
    pub parts: Vec<Name>,
    /// The laws that tables stand for.
    pub table_laws: Vec<LawDeclaration>,
    pub arguments: Vec<ArgumentCheck>,
    pub ports: Vec<PortCheck>,
    /// Names (without indices) of what could not be written out; reported already.
    pub broken: BTreeSet<String>,
    /// The rest was not written out; reported.
    pub is_too_large: bool,
    /// Declared variants in order, `base` not included.
    pub variants: Vec<Name>,
    /// The one that is applied.
    pub variant: String,
}

pub(super) struct FlatItem {
    pub item: Item,
    /// Written by the variant (or one of its bases), not by the base study.
    pub by_variant: bool,
}

/// The argument of a part has the declared type.
pub(super) struct ArgumentCheck {
    pub part: String,
    /// Where the parameter is declared.
    pub declared: Name,
    pub kind: Option<TypeExpression>,
    pub value: Expression,
}

/// What a port of a part is bound to is of the declared kind.
pub(super) struct PortCheck {
    pub part: String,
    pub place: Name,
    pub port: Name,
    pub kind: Name,
}

/// Writes out the study with `variant` (`None` or `base`: no changes).
pub(super) fn elaborate(loaded: &Loaded, variant: Option<&str>, diagnostics: &mut Vec<Diagnostic>) -> Flat {
    let mut elaborator = Elaborator::new(diagnostics);
    let mut items: Vec<&Item> = Vec::new();
    let mut variants: Vec<variants::Variant<'_>> = Vec::new();
    for (tree, is_prelude) in loaded.trees() {
        for item in &tree.items {
            match &item.kind {
                // Laws and effects of files are no part of what a variant changes.
                ItemKind::Law(_) | ItemKind::Effect(_) | ItemKind::Use { .. } => {}
                ItemKind::Table(table) => elaborator.flat.table_laws.push(table_law(table)),
                ItemKind::Variant { name, base, changes } => {
                    variants.push(variants::Variant { name, base, changes });
                }
                ItemKind::Model(model) => elaborator.add_model(model),
                _ if is_prelude => {}
                _ => items.push(item),
            }
        }
    }
    variants::check(&variants, elaborator.diagnostics);
    let changes = match variant.filter(|name| *name != "base") {
        Some(name) => variants::changes(&variants, name, elaborator.diagnostics),
        None => Vec::new(),
    };
    elaborator.study_names(&items, &changes);
    for item in items {
        elaborator.expand(item.clone(), &Scope::default());
    }
    elaborator.by_variant = true;
    for change in changes {
        elaborator.apply(change);
    }
    elaborator.check_dotted_names();
    let mut flat = elaborator.flat;
    flat.variants = variants.iter().map(|variant| variant.name.clone()).collect();
    variant.unwrap_or("base").clone_into(&mut flat.variant);
    flat
}

struct Elaborator<'t, 'd> {
    flat: Flat,
    diagnostics: &'d mut Vec<Diagnostic>,
    reported: HashSet<(&'static str, Option<Span>)>,
    models: BTreeMap<&'t str, &'t ModelDeclaration>,
    /// Constants of the study, as written.
    constants: BTreeMap<String, Expression>,
    /// What the study identifies, as written.
    targets: BTreeSet<String>,
    /// Models being written out, the outermost first.
    stack: Vec<&'t str>,
    by_variant: bool,
    /// What has been written out so far, in bytes of the text it comes from.
    written: usize,
    /// Values of constants in indices found so far.
    numbers: RefCell<BTreeMap<String, Option<f64>>>,
}

impl<'t, 'd> Elaborator<'t, 'd> {
    fn new(diagnostics: &'d mut Vec<Diagnostic>) -> Elaborator<'t, 'd> {
        let flat = Flat {
            items: Vec::new(),
            parts: Vec::new(),
            table_laws: Vec::new(),
            arguments: Vec::new(),
            ports: Vec::new(),
            broken: BTreeSet::new(),
            is_too_large: false,
            variants: Vec::new(),
            variant: String::new(),
        };
        Elaborator {
            flat,
            diagnostics,
            reported: HashSet::new(),
            models: BTreeMap::new(),
            constants: BTreeMap::new(),
            targets: BTreeSet::new(),
            stack: Vec::new(),
            by_variant: false,
            written: 0,
            numbers: RefCell::default(),
        }
    }

    /// A mistake within a model is told once, however often the model is used.
    fn report(&mut self, diagnostic: Diagnostic) {
        if self.reported.insert((diagnostic.code.text, diagnostic.span())) {
            self.diagnostics.push(diagnostic);
        }
    }

    fn add_model(&mut self, model: &'t ModelDeclaration) {
        if let Some(earlier) = self.models.insert(&model.name.text, model) {
            let diagnostic =
                Diagnostic::error(Code::DUPLICATE_NAME, format!("model `{}` is declared twice", model.name.text))
                    .label(model.name.span, "second declaration")
                    .secondary(earlier.name.span, "first declaration")
                    .help("rename or remove one of them");
            self.report(diagnostic);
        }
    }

    /// Constants that indices may mention, and paths that are identified.
    fn study_names(&mut self, items: &[&Item], changes: &[&Change]) {
        let changed = changes.iter().filter_map(|change| match change {
            Change::Add(item) | Change::Replace(item) => Some(item.as_ref()),
            Change::Remove(_) => None,
        });
        for item in items.iter().copied().chain(changed) {
            match &item.kind {
                ItemKind::Constant { name, value } => {
                    self.constants.insert(name.text.clone(), value.clone());
                }
                ItemKind::Identify { lines, .. } => {
                    self.targets.extend(lines.iter().map(|line| line.target.text.clone()));
                }
                _ => {}
            }
        }
    }

    /// Writes out one declaration; what it becomes is appended to the flat items.
    fn expand(&mut self, mut item: Item, scope: &Scope) {
        if self.flat.is_too_large {
            return;
        }
        self.written += item.span.end.saturating_sub(item.span.start) as usize + TEXT_OF_A_DECLARATION;
        if self.flat.items.len() >= MOST_ITEMS || self.written >= MOST_TEXT {
            return self.report_size(item.span);
        }
        match item.kind {
            ItemKind::Part { name, model, places, fields } => {
                self.expand_part(name, &model, places, fields, scope);
            }
            ItemKind::Family { variable, low, high, items } => {
                if self.expand_family(variable, low, high, &items, scope).is_none() {
                    let names = part::locals(&items);
                    self.flat.broken.extend(names.into_iter().map(|name| format!("{}{name}", scope.prefix)));
                }
            }
            _ => {
                if self.may_stand(&item, scope) {
                    self.rewrite_item(&mut item, scope);
                    self.flat.items.push(FlatItem { item, by_variant: self.by_variant });
                }
            }
        }
    }

    fn report_size(&mut self, span: Span) {
        if std::mem::replace(&mut self.flat.is_too_large, true) {
            return;
        }
        let message = format!(
            "written out, the study has more than {MOST_ITEMS} declarations or more than {} MB",
            MOST_TEXT >> 20
        );
        let diagnostic = Diagnostic::error(Code::TOO_LARGE, message)
            .label(span, "the limit is reached here")
            .help("make the families smaller, or use elastic bodies instead of chains of rigid ones");
        self.report(diagnostic);
    }

    /// Only what can be repeated may stand in a model or a family.
    fn may_stand(&mut self, item: &Item, scope: &Scope) -> bool {
        if scope.model.is_none() && scope.variables.is_empty() {
            return true;
        }
        let what = match &item.kind {
            ItemKind::Study { .. } => "`study`",
            ItemKind::Use { .. } => "`use`",
            ItemKind::Gravity { .. } => "`gravity`",
            ItemKind::Input { .. } if scope.model.is_some() => "an input",
            ItemKind::Experiment { .. } if scope.model.is_some() => "an experiment",
            ItemKind::Manoeuvre { .. } if scope.model.is_some() => "a manoeuvre",
            ItemKind::Filter { .. } => "the filter",
            ItemKind::Solver { .. } => "`solver`",
            ItemKind::Variant { .. } => "a variant",
            ItemKind::Law(_) => "a law",
            ItemKind::Table(_) => "a table",
            ItemKind::Effect(_) => "an effect's declaration",
            ItemKind::Model(_) => "a model's declaration",
            _ => return true,
        };
        let place = if scope.model.is_some() { "a model" } else { "a family" };
        let diagnostic = Diagnostic::error(Code::NOT_REPEATABLE, format!("{what} cannot stand in {place}"))
            .label(item.span, "belongs outside")
            .help("write it beside the model or family; a part is handed what it needs by its ports and fields");
        self.report(diagnostic);
        false
    }

    /// One change of a variant.
    fn apply(&mut self, change: &'t Change) {
        match change {
            Change::Add(item) => self.expand(item.as_ref().clone(), &Scope::default()),
            Change::Remove(target) => {
                if !self.remove(&target.text) {
                    self.nothing_to_change(target, "remove");
                }
            }
            Change::Replace(item) => self.replace(item),
        }
    }

    fn replace(&mut self, item: &'t Item) {
        if let ItemKind::Family { variable, .. } = &item.kind {
            let diagnostic = Diagnostic::error(Code::NOT_REPEATABLE, "a whole family cannot be replaced at once")
                .label(variable.span, "a family has no name of its own")
                .help("`remove NAME` takes out all members `NAME[..]`; then `add for ..` the new ones");
            return self.report(diagnostic);
        }
        if let ItemKind::Part { name, .. } = &item.kind {
            if self.remove(&name.text) {
                self.expand(item.clone(), &Scope::default());
            } else {
                self.nothing_to_change(name, "replace");
            }
            return;
        }
        let at = match variants::declared_name(&item.kind) {
            Some(name) => match self.position(&name.text) {
                Some(at) => at,
                None => return self.nothing_to_change(name, "replace"),
            },
            None => match self.singleton(item) {
                Some(at) => at,
                None => {
                    let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, "there is nothing to replace")
                        .label(item.span, "the base has no such declaration")
                        .help("write `add` instead of `replace`");
                    return self.report(diagnostic);
                }
            },
        };
        let mut item = item.clone();
        self.rewrite_item(&mut item, &Scope::default());
        self.flat.items[at] = FlatItem { item, by_variant: true };
    }

    fn position(&self, name: &str) -> Option<usize> {
        let is_it = |item: &FlatItem| variants::declared_name(&item.item.kind).is_some_and(|own| own.text == name);
        self.flat.items.iter().position(is_it)
    }

    /// The declaration without a name of the same sort, e.g. `gravity`.
    fn singleton(&self, item: &Item) -> Option<usize> {
        let same = |other: &FlatItem| std::mem::discriminant(&other.item.kind) == std::mem::discriminant(&item.kind);
        self.flat.items.iter().position(same).filter(|_| !matches!(item.kind, ItemKind::Identify { .. }))
    }

    /// Takes out a declaration, all of a part, or all members of a family.
    fn remove(&mut self, target: &str) -> bool {
        if let Some(at) = self.position(target) {
            self.flat.items.remove(at);
            return true;
        }
        let sign = if self.flat.parts.iter().any(|part| part.text == target) { '.' } else { '[' };
        let beginning = format!("{target}{sign}");
        let belongs = |name: &str| name == target || name.starts_with(&beginning);
        let count = self.flat.items.len() + self.flat.parts.len();
        self.flat
            .items
            .retain(|item| !variants::declared_name(&item.item.kind).is_some_and(|name| belongs(&name.text)));
        self.flat.parts.retain(|part| !belongs(&part.text));
        self.flat.arguments.retain(|argument| !belongs(&argument.part));
        self.flat.ports.retain(|port| !belongs(&port.part));
        self.flat.items.len() + self.flat.parts.len() < count
    }

    fn nothing_to_change(&mut self, target: &Name, verb: &str) {
        let names = self.flat.items.iter().filter_map(|item| variants::declared_name(&item.item.kind));
        let names = names.chain(&self.flat.parts).map(|name| name.text.as_str());
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, format!("there is no `{}` to {verb}", target.text))
            .label(target.span, "not in the variant's base")
            .suggest(similar_name(&target.text, names));
        self.report(diagnostic);
    }

    /// A written name has a dot only where it adds to a part.
    fn check_dotted_names(&mut self) {
        let parts: BTreeSet<&str> = self.flat.parts.iter().map(|part| part.text.as_str()).collect();
        let mut wrong: Vec<(Name, String)> = Vec::new();
        // Numbers given to a part; their group may have a name, too.
        let arguments: BTreeSet<String> = self
            .flat
            .arguments
            .iter()
            .map(|argument| format!("{}.{}", argument.part, argument.declared.text))
            .collect();
        let names = self.flat.items.iter().filter_map(|item| variants::declared_name(&item.item.kind));
        for name in names.chain(&self.flat.parts) {
            if let Some((owner, _)) = name.text.rsplit_once('.')
                && !parts.contains(owner)
                && !arguments.contains(&name.text)
            {
                wrong.push((name.clone(), owner.to_owned()));
            }
        }
        for (name, owner) in wrong {
            let parts: Vec<&str> = self.flat.parts.iter().map(|part| part.text.as_str()).collect();
            let diagnostic = Diagnostic::error(Code::DOTTED_NAME, format!("there is no part `{owner}`"))
                .label(name.span, "a declared name contains a dot only where it adds to a part")
                .suggest(similar_name(&owner, parts))
                .help(format!("write `{}`", name.text.replace('.', "_")));
            self.report(diagnostic);
        }
    }
}

/// The place of a name within an item that was copied.
fn same_place(span: Span, text: String) -> Name {
    Name { text, span }
}
