//! Tables: characteristic curves as functions of one argument, lowered to expressions.
//!
//! *In*: declarations with points in the text or in a file. *Out*: choices between polynomials over a balanced tree, so
//! that derivatives follow. *Must not happen here*: reading of files (they are loaded with the study).

mod curve;
mod file;
mod series;

use super::checker::{Allowed, Checker, Scope};
use super::evaluate::Typed;
use super::fields::find;
use super::functions::FUNCTIONS;
use super::identify::written_unit;
use super::kinds::{Form, Kinds};
use super::model::Motion;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Binary, Node};
use crate::quantities::Dimension;
use crate::syntax::{Expression, Name, TableDeclaration, Value};
use curve::Shape;

const SCOPE: Scope = Scope::Study(Allowed::Number);

/// More points are refused: every one is part of the equations.
const MOST_POINTS: usize = 5_000;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Beyond {
    Constant,
    Linear,
    Error,
}

/// Points in SI units, with the dimensions of arguments and values.
type Points = (Vec<(f64, f64)>, [Dimension; 2]);

/// A table that can be evaluated. All numbers SI.
pub(super) struct Table {
    argument: Dimension,
    value: Dimension,
    shape: TableShape,
}

enum TableShape {
    /// Arguments grow.
    Pieces {
        arguments: Vec<f64>,
        pieces: Vec<[f64; 4]>,
        beyond: Beyond,
    },
    Sum(Vec<series::Component>),
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
        let [argument] = table.arguments.as_slice() else {
            let message = format!("{owner} has {} arguments", table.arguments.len());
            let diagnostic = Diagnostic::error(Code::TABLE_FORM, message)
                .label(table.name.span, "a table is a function of one argument")
                .help("for a surface, write a law that interpolates between several tables");
            return self.fail(diagnostic, SCOPE);
        };
        let shape = self.word(table, "interpolation", &["linear", "monotone", "cubic"]);
        let beyond = self.word(table, "extrapolation", &["constant", "linear", "error"]);
        let ((points, dimensions), span) = self.table_points(table)?;
        let kind = argument.kind.as_ref();
        let Some(kind) = kind else {
            let diagnostic = Diagnostic::error(Code::INVALID_DECLARATION, "the argument of the table has no type")
                .label(argument.span, "no type")
                .help(format!("write e.g. `{}: rate`", argument.name.text));
            return self.fail(diagnostic, SCOPE);
        };
        let (first, second) = (self.form(kind)?, self.form(&table.result)?);
        let fits = [Motion::Translational, Motion::Rotational]
            .into_iter()
            .any(|motion| fits(first, second, dimensions, Kinds::of(motion)));
        if !fits {
            let message = format!("the points of {owner} do not have the declared types");
            let diagnostic = Diagnostic::error(Code::DIMENSION_MISMATCH, message)
                .label(span, format!("from {} to {}", dimensions[0], dimensions[1]))
                .secondary(kind.span.to(table.result.span), "declared here");
            return self.fail(diagnostic, SCOPE);
        }
        self.check_points(&points, span)?;
        let (shape, beyond) = (shape?, beyond?);
        let shape = match shape {
            "linear" => Shape::Linear,
            "monotone" => Shape::Monotone,
            _ => Shape::Cubic,
        };
        let pieces = curve::pieces(&points, shape);
        let beyond = match beyond {
            "constant" => Beyond::Constant,
            "linear" => Beyond::Linear,
            _ => Beyond::Error,
        };
        let arguments = points.iter().map(|point| point.0).collect();
        let shape = TableShape::Pieces { arguments, pieces, beyond };
        Some(Table { argument: dimensions[0], value: dimensions[1], shape })
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
            (Some((points, span)), None) => Some((self.written_points(points, *span)?, *span)),
            (None, Some(field)) => {
                let Value::Text(path) = &field.value else {
                    return self.wrong_value(field, "the path of a file in quotes");
                };
                let cause = match self.loaded.table_text(field.key.span.file, &path.text) {
                    Some(Ok(text)) => match file::read(path, text) {
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

    fn written_points(&mut self, points: &'a [Vec<Expression>], span: Span) -> Option<Points> {
        if let Some(point) = points.iter().find(|point| point.len() != 2) {
            let at = point.first().map_or(span, |first| first.span);
            let diagnostic = Diagnostic::error(Code::TABLE_POINTS, "a point is an argument and a value")
                .label(at, format!("this one has {} numbers", point.len()))
                .help("write `(0.5 m/s, 1.2 kN)`");
            return self.fail(diagnostic, SCOPE);
        }
        let column = |at: usize| points.iter().filter_map(move |point| point.get(at));
        let units: [Option<&'a Name>; 2] = [0, 1].map(|at| column(at).find_map(written_unit));
        let mut dimensions: [Option<(Dimension, Span)>; 2] = [None; 2];
        let mut read = Vec::new();
        for point in points {
            let mut numbers = [0.0; 2];
            for (at, expression) in point.iter().enumerate().take(2) {
                let value = self.number_with(expression, units[at])?;
                let (wanted, first) = *dimensions[at].get_or_insert((value.dimension, expression.span));
                let value = self.expect(value, expression.span, wanted, (first, "the first point has"), SCOPE)?;
                numbers[at] = self.graph.constant_value(value.node)?;
            }
            read.push((numbers[0], numbers[1]));
        }
        let dimensions = dimensions.map(|dimension| dimension.map_or(Dimension::ONE, |(dimension, _)| dimension));
        Some((read, dimensions))
    }

    fn check_points(&mut self, points: &[(f64, f64)], span: Span) -> Option<()> {
        let message = if points.len() < 2 {
            "a table has at least two points".to_owned()
        } else if points.len() > MOST_POINTS {
            format!("the table has {} points; at most {MOST_POINTS} can be treated", points.len())
        } else if let Some(at) = points.windows(2).position(|pair| pair[1].0 <= pair[0].0) {
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
        let ([expression], [value]) = (arguments, values) else {
            let message = format!("table `{}` takes 1 argument, found {}", name.text, arguments.len());
            return self.fail(Diagnostic::error(Code::WRONG_ARGUMENTS, message).label(span, ""), scope);
        };
        let table = self.tables.get(name.text.as_str())?.as_ref()?;
        let (wanted, dimension) = (table.argument, table.value);
        let declared = self.declared.tables.iter().find(|table| table.name.text == name.text)?.name.span;
        let argument = self.expect((*value)?, expression.span, wanted, (declared, "the table takes"), scope)?;
        let node = self.lowered(&name.text, argument.node)?;
        Some(Typed::new(node, dimension))
    }

    fn lowered(&mut self, name: &str, x: Node) -> Option<Node> {
        let table = self.tables.get(name)?.as_ref()?;
        let graph = &mut self.graph;
        let (arguments, pieces, beyond) = match &table.shape {
            TableShape::Pieces { arguments, pieces, beyond } => (arguments, pieces, *beyond),
            TableShape::Sum(components) => return Some(series::sum(graph, components, x)),
        };
        let (first, last) = (*arguments.first()?, *arguments.last()?);
        let (low, high) = (graph.constant(first), graph.constant(last));
        if beyond == Beyond::Constant {
            let above = graph.binary(Binary::Maximum, x, low);
            let x = graph.binary(Binary::Minimum, above, high);
            return Some(tree(graph, arguments, pieces, x));
        }
        let inside = tree(graph, arguments, pieces, x);
        let end = pieces.last().copied().unwrap_or_default();
        let (width, [a, b, c, d]) = (last - arguments[pieces.len() - 1], end);
        let at_end = [a + width * (b + width * (c + width * d)), b + width * (2.0 * c + 3.0 * d * width)];
        let at_begin = pieces.first().map(|piece| [piece[0], piece[1]])?;
        let (below, above) = if beyond == Beyond::Linear {
            let below = polynomial(graph, x, first, [at_begin[0], at_begin[1], 0.0, 0.0]);
            (below, polynomial(graph, x, last, [at_end[0], at_end[1], 0.0, 0.0]))
        } else {
            let undefined = graph.constant(f64::NAN);
            (undefined, undefined)
        };
        let is_below = graph.binary(Binary::Less, x, low);
        let is_above = graph.binary(Binary::Less, high, x);
        let upper = graph.select(is_above, above, inside);
        Some(graph.select(is_below, below, upper))
    }
}

/// Halves the pieces until one is left.
fn tree(graph: &mut crate::expression::Graph, arguments: &[f64], pieces: &[[f64; 4]], x: Node) -> Node {
    if let [piece] = pieces {
        return polynomial(graph, x, arguments[0], *piece);
    }
    let half = pieces.len() / 2;
    let left = tree(graph, &arguments[..=half], &pieces[..half], x);
    let right = tree(graph, &arguments[half..], &pieces[half..], x);
    let middle = graph.constant(arguments[half]);
    let is_left = graph.binary(Binary::Less, x, middle);
    graph.select(is_left, left, right)
}

fn polynomial(graph: &mut crate::expression::Graph, x: Node, from: f64, coefficients: [f64; 4]) -> Node {
    let from = graph.constant(from);
    let distance = graph.subtract(x, from);
    let mut value: Option<Node> = None;
    for coefficient in coefficients.into_iter().rev() {
        let own = graph.constant(coefficient);
        value = match value {
            None if coefficient == 0.0 => None,
            None => Some(own),
            Some(value) => {
                let product = graph.multiply(value, distance);
                Some(graph.add(product, own))
            }
        };
    }
    value.unwrap_or_else(|| graph.constant(0.0))
}

/// Whether the dimensions of the points are those of the types at a place of these kinds.
fn fits(argument: Form, value: Form, dimensions: [Dimension; 2], mut kinds: Kinds) -> bool {
    for (form, dimension) in [(argument, dimensions[0]), (value, dimensions[1])] {
        if form.is_open(&kinds) && !form.infer(dimension, &mut kinds) {
            return false;
        }
        if form.dimension(&kinds) != Some(dimension) {
            return false;
        }
    }
    true
}
