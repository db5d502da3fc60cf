//! The texts of a study: the prelude, its file, the files it uses.

use crate::diagnostics::{Code, Diagnostic, Sources, Span};
use crate::syntax::{Change, Item, ItemKind, ModelDeclaration, Tree, Value, parse};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

/// Laws, models and effects that ship with the tool: (name, text).
const PRELUDE: [(&str, &str); 5] = [
    ("prelude/laws.ident", include_str!("../../grammar/prelude/laws.ident")),
    ("prelude/actuators.ident", include_str!("../../grammar/prelude/actuators.ident")),
    ("prelude/sensors.ident", include_str!("../../grammar/prelude/sensors.ident")),
    ("prelude/models.ident", include_str!("../../grammar/prelude/models.ident")),
    ("prelude/effects.ident", include_str!("../../grammar/prelude/effects.ident")),
];

/// Parsed texts. Cheap to extend by [`Loaded::with_text`].
#[derive(Clone, Debug)]
pub struct Loaded {
    /// What the spans of trees and diagnostics point into; the prelude comes first.
    pub sources: Sources,
    /// Findings of reading and parsing.
    pub diagnostics: Vec<Diagnostic>,
    /// Folder that relative data paths of the study refer to.
    pub directory: PathBuf,
    /// One per source.
    trees: Vec<Arc<Tree>>,
    /// Texts of the files that tables and elastic bodies name, or why they cannot be read; by index of the study file
    /// and path as written.
    table_texts: BTreeMap<(u32, String), Result<Arc<str>, String>>,
}

/// Larger files of tables are refused.
const LARGEST_TABLE: u64 = 128 << 20;

static PRELUDE_LOADED: LazyLock<Loaded> = LazyLock::new(|| {
    let mut loaded = Loaded {
        sources: Sources::new(),
        diagnostics: Vec::new(),
        directory: PathBuf::new(),
        trees: Vec::new(),
        table_texts: BTreeMap::new(),
    };
    for (name, text) in PRELUDE {
        loaded.append(name, text);
    }
    loaded
});

/// Reads and parses the study at `path` and the files it uses. Unreadable files and syntax errors are among
/// [`Loaded::diagnostics`].
pub fn load(path: &Path) -> Loaded {
    let mut loaded = PRELUDE_LOADED.clone();
    loaded.directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
    loaded.append_file(path, None, &mut Vec::new());
    loaded
}

/// A study given as text; `use` reads files relative to the working directory.
pub fn load_text(name: &str, text: &str) -> Loaded {
    let mut loaded = PRELUDE_LOADED.clone();
    let file = loaded.append(name, text);
    loaded.append_used(file, Path::new(""), &mut Vec::new());
    loaded
}

impl Loaded {
    /// The same study with the declarations of one more text.
    pub fn with_text(&self, text: &str) -> Loaded {
        let mut extended = self.clone();
        extended.append("extension", text);
        extended
    }

    /// Trees in order, and whether each belongs to the prelude.
    pub fn trees(&self) -> impl Iterator<Item = (&Tree, bool)> {
        self.trees.iter().enumerate().map(|(index, tree)| (tree.as_ref(), index < PRELUDE.len()))
    }

    /// Index of the study's own (first) file among [`Loaded::sources`].
    pub fn study_file(&self) -> u32 {
        PRELUDE.len() as u32
    }

    /// The text of a file that a table or elastic body of study file `file` names.
    pub(super) fn table_text(&self, file: u32, path: &str) -> Option<&Result<Arc<str>, String>> {
        self.table_texts.get(&(file, path.to_owned()))
    }

    fn append(&mut self, name: &str, text: &str) -> u32 {
        let file = self.sources.add(name, text);
        let (tree, diagnostics) = parse(file, text);
        self.trees.push(Arc::new(tree));
        self.diagnostics.extend(diagnostics);
        file
    }

    /// `seen` holds the canonical paths read so far, so that files may use each other.
    fn append_file(&mut self, path: &Path, used_at: Option<Span>, seen: &mut Vec<PathBuf>) {
        let canonical = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        if seen.contains(&canonical) {
            return;
        }
        seen.push(canonical);
        match std::fs::read_to_string(path) {
            Ok(text) => {
                let file = self.append(&path.display().to_string(), &text);
                self.append_used(file, path.parent().unwrap_or(Path::new("")), seen);
            }
            Err(cause) => {
                let message = format!("cannot read `{}`: {cause}", path.display());
                let diagnostic = Diagnostic::error(Code::CANNOT_READ_FILE, message);
                self.diagnostics.push(match used_at {
                    Some(span) => diagnostic
                        .label(span, "used here")
                        .help("the path is relative to the file that contains the `use` line"),
                    None => diagnostic,
                });
            }
        }
    }

    fn append_used(&mut self, file: u32, directory: &Path, seen: &mut Vec<PathBuf>) {
        let Some(tree) = self.trees.get(file as usize).cloned() else { return };
        for item in &tree.items {
            match &item.kind {
                ItemKind::Use { path } => self.append_file(&directory.join(&path.text), Some(path.span), seen),
                _ => self.read_files_of(file, directory, item),
            }
        }
    }

    /// Reads the files that tables and elastic bodies name, also those of models, families and variants.
    fn read_files_of(&mut self, file: u32, directory: &Path, item: &Item) {
        let (fields, key) = match &item.kind {
            ItemKind::Table(table) => (&table.fields, "file"),
            ItemKind::Body { fields, .. } => (fields, "modes"),
            ItemKind::Model(ModelDeclaration { items, .. }) | ItemKind::Family { items, .. } => {
                return items.iter().for_each(|item| self.read_files_of(file, directory, item));
            }
            ItemKind::Variant { changes, .. } => {
                for change in changes {
                    if let Change::Add(item) | Change::Replace(item) = change {
                        self.read_files_of(file, directory, item);
                    }
                }
                return;
            }
            _ => return,
        };
        for field in fields.iter().filter(|field| field.key.text == key) {
            if let Value::Text(path) = &field.value {
                let text = read_table(&directory.join(&path.text));
                self.table_texts.insert((file, path.text.clone()), text);
            }
        }
    }
}

fn read_table(path: &Path) -> Result<Arc<str>, String> {
    let size = std::fs::metadata(path).map_err(|cause| cause.to_string())?.len();
    if size > LARGEST_TABLE {
        return Err(format!("the file is larger than {} MB", LARGEST_TABLE >> 20));
    }
    std::fs::read_to_string(path).map(Arc::from).map_err(|cause| cause.to_string())
}
