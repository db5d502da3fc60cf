//! Tables: characteristic curves as functions of one argument, and surfaces over two, lowered to expressions.
//!
//! *In*: declarations with points in the text or in a file. *Out*: curves as data of the graph; of surfaces choices
//! between polynomials over a balanced tree, so that derivatives follow. *Must not happen here*: reading of files (they
//! are loaded with the study).

mod curve;
mod file;
mod polynomials;
mod series;
mod surface;

use super::checker::{Allowed, Checker, Scope};
use super::evaluate::Typed;
use super::fields::find;
use super::functions::FUNCTIONS;
use super::identify::written_unit;
use super::kinds::{Form, Kinds};
use super::model::Motion;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Beyond, Curve, Node};
use crate::quantities::Dimension;
use crate::syntax::{Expression, Name, TableDeclaration, Value};
use curve::Shape;
use surface::Surface;

const SCOPE: Scope = Scope::Study(Allowed::Number);

/// More points are refused: a mistaken file.
const MOST_POINTS: usize = 5_000_000;
/// Points of surfaces take several terms of the equations each.
const MOST_POINTS_OF_SURFACES: usize = 1_600;

/// Points in SI units, arguments first, with the dimensions of arguments and values.
type Points = (Vec<Vec<f64>>, Vec<Dimension>);

/// A table that can be evaluated. All numbers SI.
pub(super) struct Table {
    arguments: Vec<Dimension>,
    value: Dimension,
    shape: TableShape,
}

enum TableShape {
    /// A curve of the graph, by its channel.
    Curve(u32),
    Sum(Vec<series::Component>),
    Surface(Surface),
}

impl<'a> Checker<'a> {
    /// Reads all tables; must come before any expression is evaluated.
    pub fn read_tables(&mut self) {
        for declaration in &self.declared.tables {
            let name = &declaration.name;
            if FUNCTIONS.iter().any(|(function, ..)| *function == name.text) {
                let message = format!("`{}` is a function already", name.text);
                self.report(Diagnostic::error(Code::DUPLICATE_NAME, message).label(name.span, "another name"), SCOPE);
            }
            let table = self.read_table(declaration);
            self.tables.insert(&name.text, table);
        }
    }

    fn read_table(&mut self, table: &'a TableDeclaration) -> Option<Table> {
        let owner = format!("table `{}`", table.name.text);
        if table.harmonics.is_some() || find(&table.fields, "spectrum").is_some() {
            return self.read_series(table);
        }
        self.known_fields(&owner, &table.fields, &["file", "interpolation", "extrapolation", "points"]);
        let count = table.arguments.len();
        if !(1..=2).contains(&count) {
            let message = format!("{owner} has {count} arguments");
            let diagnostic = Diagnostic::error(Code::TABLE_FORM, message)
                .label(table.name.span, "a table is a function of one or two arguments")
                .help("for more, write a law that combines several tables");
            return self.fail(diagnostic, SCOPE);
        }
        let shape = self.word(
            table,
            "interpolation",
            if count == 1 { &["linear", "monotone", "cubic"] } else { &["linear", "cubic"] },
        );
        let beyond = self.word(table, "extrapolation", &["constant", "linear", "error"]);
        let ((points, dimensions), span) = self.table_points(table)?;
        self.check_types(table, &dimensions, span)?;
        self.check_points(&points, count, span)?;
        let (shape, beyond) = (shape?, beyond?);
        let shape = match shape {
            "linear" => Shape::Linear,
            "monotone" => Shape::Monotone,
            _ => Shape::Cubic,
        };
        let beyond = match beyond {
            "constant" => Beyond::Constant,
            "linear" => Beyond::Linear,
            _ => Beyond::Undefined,
        };
        let shape = if count == 1 {
            let points: Vec<(f64, f64)> = points.iter().map(|point| (point[0], point[1])).collect();
            let pieces = curve::pieces(&points, shape);
            let knots = points.iter().map(|point| point.0).collect();
            TableShape::Curve(self.graph.add_curve(Curve::new(&table.name.text, knots, pieces, beyond)))
        } else {
            match Surface::new(&points, shape, beyond) {
                Ok(surface) => TableShape::Surface(surface),
                Err(message) => {
                    let diagnostic = Diagnostic::error(Code::TABLE_POINTS, message)
                        .label(span, "these points")
                        .help("give the value of every pair of the two arguments' values once: a full grid");
                    return self.fail(diagnostic, SCOPE);
                }
            }
        };
        let (value, arguments) = dimensions.split_last()?;
        Some(Table { arguments: arguments.to_vec(), value: *value, shape })
    }

    /// Arguments and value have types, and the points have them.
    fn check_types(&mut self, table: &'a TableDeclaration, dimensions: &[Dimension], span: Span) -> Option<()> {
        let mut forms = Vec::new();
        for argument in &table.arguments {
            let Some(kind) = &argument.kind else {
                let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, "the argument of the table has no type")
                    .label(argument.span, "no type")
                    .help(format!("write e.g. `{}: rate`", argument.name.text));
                return self.fail(diagnostic, SCOPE);
            };
            forms.push(self.form(kind)?);
        }
        forms.push(self.form(&table.result)?);
        let fits = [Motion::Translational, Motion::Rotational]
            .into_iter()
            .any(|motion| fits(&forms, dimensions, Kinds::of(motion)));
        if fits {
            return Some(());
        }
        let declared = table.arguments.first().map_or(table.result.span, |first| first.span.to(table.result.span));
        let (value, arguments) = dimensions.split_last()?;
        let arguments: Vec<String> = arguments.iter().map(Dimension::to_string).collect();
        let message = format!("the points of table `{}` do not have the declared types", table.name.text);
        let diagnostic = Diagnostic::error(Code::DIMENSION_MISMATCH, message)
            .label(span, format!("from {} to {value}", arguments.join(" and ")))
            .secondary(declared, "declared here")
            .help("the first point that has units gives them to all: `points = ((-10 mm, 40 N), (0, 0), (10, -40))`");
        self.fail(diagnostic, SCOPE)
    }

    /// A field with one of these words; it must be given.
    fn word(&mut self, table: &'a TableDeclaration, key: &str, words: &[&'static str]) -> Option<&'static str> {
        if let Some(field) = find(&table.fields, key) {
            let word = self.field_word(field, words)?;
            return words.iter().copied().find(|known| *known == word);
        }
        let diagnostic = Diagnostic::error(Code::MISSING_FIELD, format!("table `{}` needs `{key}`", table.name.text))
            .label(table.name.span, format!("`{key}` is missing"))
            .help(format!("add `{key} = {}`", words.join(" | ")));
        self.fail(diagnostic, SCOPE)
    }

    /// Points with the dimensions of argument and value, and where they stand.
    fn table_points(&mut self, table: &'a TableDeclaration) -> Option<(Points, Span)> {
        let file = find(&table.fields, "file");
        match (&table.points, file) {
            (Some((points, span)), None) => {
                Some((self.written_points(points, table.arguments.len() + 1, *span)?, *span))
            }
            (None, Some(field)) => {
                let Value::Text(path) = &field.value else {
                    return self.wrong_value(field, "the path of a file in quotes");
                };
                let cause = match self.loaded.table_text(field.key.span.file, &path.text) {
                    Some(Ok(text)) => match file::read(path, text, table.arguments.len() + 1) {
                        Ok(points) => return Some((points, field.span)),
                        Err(diagnostic) => return self.fail(diagnostic, SCOPE),
                    },
                    Some(Err(cause)) => cause.clone(),
                    None => "it has not been read".to_owned(),
                };
                let diagnostic =
                    Diagnostic::error(Code::CANNOT_READ_FILE, format!("cannot read `{}`: {cause}", path.text))
                        .label(path.span, "needed here")
                        .help("the path is relative to the file that contains the table");
                self.fail(diagnostic, SCOPE)
            }
            (Some((_, span)), Some(field)) => {
                let diagnostic = Diagnostic::error(Code::TABLE_FORM, "the table has points here and in a file")
                    .label(field.span, "the file")
                    .secondary(*span, "the points")
                    .help("remove one of them");
                self.fail(diagnostic, SCOPE)
            }
            (None, None) => {
                let place = find(&table.fields, "points").map_or(table.name.span, |field| field.span);
                let diagnostic =
                    Diagnostic::error(Code::TABLE_POINTS, format!("table `{}` has no points", table.name.text))
                        .label(place, "nothing to interpolate")
                        .help("add `points = ((0 m, 0 N), (1 m, 2 N))` or `file = \"curve.csv\"`");
                self.fail(diagnostic, SCOPE)
            }
        }
    }

    fn written_points(&mut self, points: &'a [Vec<Expression>], count: usize, span: Span) -> Option<Points> {
        if let Some(point) = points.iter().find(|point| point.len() != count) {
            let at = point.first().map_or(span, |first| first.span);
            let (message, example) = match count {
                2 => ("a point is an argument and a value", "(0.5 m/s, 1.2 kN)"),
                _ => ("a point is two arguments and a value", "(20 mm, 0.5 m/s, 1.2 kN)"),
            };
            let diagnostic = Diagnostic::error(Code::TABLE_POINTS, message)
                .label(at, format!("this one has {} numbers", point.len()))
                .help(format!("write `{example}`"));
            return self.fail(diagnostic, SCOPE);
        }
        let column = |at: usize| points.iter().filter_map(move |point| point.get(at));
        let units: Vec<Option<&'a Name>> = (0..count).map(|at| column(at).find_map(written_unit)).collect();
        let mut dimensions: Vec<Option<(Dimension, Span)>> = vec![None; count];
        let mut read = Vec::new();
        for point in points {
            let mut numbers = Vec::new();
            for (at, expression) in point.iter().enumerate() {
                let value = self.number_with(expression, units[at])?;
                let (wanted, first) = *dimensions[at].get_or_insert((value.dimension, expression.span));
                let value = self.expect(value, expression.span, wanted, (first, "the first point has"), SCOPE)?;
                numbers.push(self.graph.constant_value(value.node)?);
            }
            read.push(numbers);
        }
        let dimensions = dimensions.into_iter().map(|dimension| dimension.map_or(Dimension::ONE, |(own, _)| own));
        Some((read, dimensions.collect()))
    }

    fn check_points(&mut self, points: &[Vec<f64>], arguments: usize, span: Span) -> Option<()> {
        let most = if arguments == 1 { MOST_POINTS } else { MOST_POINTS_OF_SURFACES };
        let falls = |pair: &[Vec<f64>]| arguments == 1 && pair[1][0] <= pair[0][0];
        let message = if points.len() < 2 {
            "a table has at least two points".to_owned()
        } else if points.len() > most {
            format!("the table has {} points; at most {most} can be treated", points.len())
        } else if let Some(at) = points.windows(2).position(falls) {
            format!("the arguments do not grow from point {} to point {}", at + 1, at + 2)
        } else {
            return Some(());
        };
        let diagnostic = Diagnostic::error(Code::TABLE_POINTS, message)
            .label(span, "these points")
            .help("sort the points by their argument; a jump is two points close to each other");
        self.fail(diagnostic, SCOPE)
    }

    pub fn is_table(&self, name: &str) -> bool {
        self.tables.contains_key(name)
    }

    /// The value of `table(argument)`.
    pub fn call_table(
        &mut self,
        name: &Name,
        arguments: &[Expression],
        values: &[Option<Typed>],
        span: Span,
        scope: Scope,
    ) -> Option<Typed> {
        let table = self.tables.get(name.text.as_str())?.as_ref()?;
        let (wanted, dimension) = (table.arguments.clone(), table.value);
        if arguments.len() != wanted.len() {
            let plural = if wanted.len() == 1 { "" } else { "s" };
            let message =
                format!("table `{}` takes {} argument{plural}, found {}", name.text, wanted.len(), arguments.len());
            return self.fail(Diagnostic::error(Code::WRONG_ARGUMENTS, message).label(span, ""), scope);
        }
        let declared = self.declared.tables.iter().find(|table| table.name.text == name.text)?.name.span;
        let mut nodes = Vec::new();
        for ((expression, value), wanted) in arguments.iter().zip(values).zip(wanted) {
            let value = self.expect((*value)?, expression.span, wanted, (declared, "the table takes"), scope)?;
            nodes.push(value.node);
        }
        let node = self.lowered(&name.text, &nodes)?;
        Some(Typed::new(node, dimension))
    }

    fn lowered(&mut self, name: &str, arguments: &[Node]) -> Option<Node> {
        let table = self.tables.get(name)?.as_ref()?;
        let graph = &mut self.graph;
        match (&table.shape, arguments) {
            (TableShape::Curve(channel), &[x]) => Some(graph.sample(*channel, 0, x)),
            (TableShape::Sum(components), &[x]) => Some(series::sum(graph, components, x)),
            (TableShape::Surface(surface), &[x, y]) => surface.at(graph, [x, y]),
            _ => None,
        }
    }
}

/// Whether the dimensions of the points are those of the types at a place of these kinds.
fn fits(forms: &[Form], dimensions: &[Dimension], mut kinds: Kinds) -> bool {
    for (form, &dimension) in forms.iter().zip(dimensions) {
        if form.is_open(&kinds) && !form.infer(dimension, &mut kinds) {
            return false;
        }
        if form.dimension(&kinds) != Some(dimension) {
            return false;
        }
    }
    true
}
