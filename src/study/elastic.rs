//! Elastic bodies: their modes from a file, scaled by the study.

use super::checker::{Allowed, Checker, Scope};
use super::fields::find;
use super::model::{JointSymbols, Point};
use super::modes::{self, ModeFile};
use crate::diagnostics::{Code, Diagnostic, Span, similar_name};
use crate::expression::Node;
use crate::quantities::Dimension;
use crate::syntax::{Field, Name, Value};

const SCOPE: Scope = Scope::Study(Allowed::Constant);

/// Small elastic deformation of a body as a sum of modes, against body axes that move with the undeformed body.
#[derive(Clone, Debug)]
pub struct Elastic {
    pub modes: Vec<Mode>,
    /// Frames at which the mode shapes are known; the first is the undeformed body itself.
    pub frames: Vec<ElasticFrame>,
    /// Of the field that names the file.
    pub span: Span,
}

/// A mode of modal mass 1 kg, so that its coordinate is a length.
#[derive(Clone, Debug)]
pub struct Mode {
    /// `beam.mode_1`
    pub name: String,
    pub symbols: JointSymbols,
    /// Natural frequency, Hz.
    pub frequency: Node,
    /// Damping ratio.
    pub damping: Node,
    /// Integral of the shape over the mass, kg.
    pub participation: [f64; 3],
    /// Integral of position times shape (cross product, about the body's origin) over the mass, kg m.
    pub moment: [f64; 3],
}

/// The shapes of all modes at a point of the body.
#[derive(Clone, Debug)]
pub struct ElasticFrame {
    pub name: String,
    pub shapes: Vec<ModeShape>,
}

/// What a mode does to a frame per metre of its coordinate, in body axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModeShape {
    pub shift: [f64; 3],
    /// rad/m
    pub turn: [f64; 3],
}

impl<'a> Checker<'a> {
    /// The modes of a body, where it names a file of them.
    pub fn elastic(&mut self, body: usize, points: &[Point]) -> Option<Elastic> {
        let declared = &self.declared.bodies[body];
        let name = &declared.name.text;
        let Some(field) = find(declared.fields, "modes") else {
            for key in ["frequency_scale", "damping_ratio", "mode_count"] {
                if let Some(field) = find(declared.fields, key) {
                    let diagnostic = Diagnostic::error(Code::MISSING_FIELD, format!("body `{name}` has no modes"))
                        .label(field.key.span, "belongs to an elastic body")
                        .help("name the file of its modes: `modes = \"beam_modes.csv\"`");
                    self.report(diagnostic, SCOPE);
                }
            }
            return None;
        };
        let (file, path) = self.mode_file(field)?;
        let count = self.mode_count(declared.fields, &file)?;
        let scale = self.ratio(name, declared.fields, "frequency_scale").ok()?;
        let damping = self.ratio(name, declared.fields, "damping_ratio").ok()?;
        if damping.is_none() && file.modes.iter().any(|mode| mode.damping.is_none()) {
            let diagnostic = Diagnostic::error(Code::MODE_FILE, format!("the modes of `{name}` have no damping"))
                .label(path.span, "no column `damping`")
                .help("add the column, or `damping_ratio = 1 %` to the body, which then holds for all modes");
            return self.fail(diagnostic, SCOPE);
        }
        let modes = file.modes.iter().take(count).enumerate().map(|(at, mode)| {
            let name = format!("{name}.mode_{}", at + 1);
            let mut symbol = |quantity: &str| self.graph.symbol(&format!("{name}.{quantity}"));
            let symbols = JointSymbols {
                position: symbol("position"),
                velocity: symbol("velocity"),
                acceleration: symbol("acceleration"),
                inertia: symbol("inertia"),
            };
            self.accelerations.insert(symbols.acceleration);
            let frequency = self.graph.constant(mode.frequency);
            let frequency = scale.map_or(frequency, |scale| self.graph.multiply(scale, frequency));
            let damping = damping.unwrap_or_else(|| self.graph.constant(mode.damping.unwrap_or_default()));
            Mode { name, symbols, frequency, damping, participation: mode.participation, moment: mode.moment }
        });
        let modes: Vec<Mode> = modes.collect();
        let mut frames = vec![ElasticFrame { name: name.clone(), shapes: vec![ModeShape::default(); count] }];
        for (point, shapes) in &file.frames {
            self.check_frame(body, points, point, path);
            frames.push(ElasticFrame { name: point.clone(), shapes: shapes.iter().take(count).copied().collect() });
        }
        Some(Elastic { modes, frames, span: path.span })
    }

    fn mode_file(&mut self, field: &'a Field) -> Option<(ModeFile, &'a Name)> {
        let Value::Text(path) = &field.value else {
            return self.wrong_value(field, "the path of a file in quotes");
        };
        let cause = match self.loaded.table_text(field.key.span.file, &path.text) {
            Some(Ok(text)) => match modes::read(path, text) {
                Ok(file) => return Some((file, path)),
                Err(diagnostic) => return self.fail(diagnostic, SCOPE),
            },
            Some(Err(cause)) => cause.clone(),
            None => "it has not been read".to_owned(),
        };
        let diagnostic = Diagnostic::error(Code::CANNOT_READ_FILE, format!("cannot read `{}`: {cause}", path.text))
            .label(path.span, "needed here")
            .help("the path is relative to the file that contains the body");
        self.fail(diagnostic, SCOPE)
    }

    /// How many of the modes count: `mode_count = 4`, else all.
    fn mode_count(&mut self, fields: &'a [Field], file: &ModeFile) -> Option<usize> {
        let Some(field) = find(fields, "mode_count") else { return Some(file.modes.len()) };
        let expression = self.field_expression(field)?;
        let count = self.fixed_number(expression, None, Dimension::ONE, (field.key.span, "a number has"))?;
        if count.fract() == 0.0 && (0.0..=file.modes.len() as f64).contains(&count) {
            return Some(count as usize);
        }
        let diagnostic = Diagnostic::error(Code::MODE_FILE, "the file does not hold so many modes")
            .label(expression.span, format!("there is 1 .. {}", file.modes.len()))
            .help(format!("write a whole number from 0 to {}, or leave `mode_count` out to use all", file.modes.len()));
        self.fail(diagnostic, SCOPE)
    }

    /// A dimensionless positive field that may be identified. `Ok(None)`: not given.
    fn ratio(&mut self, body: &str, fields: &'a [Field], key: &'static str) -> Result<Option<Node>, ()> {
        let Some(field) = find(fields, key) else { return Ok(None) };
        let expression = self.field_expression(field).ok_or(())?;
        let value = self.field_value(&format!("{body}.{key}"), expression, Allowed::Constant).ok_or(())?;
        let because = (field.key.span, key);
        let value = self.expect(value, expression.span, Dimension::ONE, because, SCOPE).ok_or(())?;
        match self.graph.constant_value(value.node) {
            Some(number) if number < 0.0 || (number == 0.0 && key == "frequency_scale") => {
                let diagnostic = Diagnostic::error(Code::WRONG_VALUE, format!("`{key}` must be positive"))
                    .label(expression.span, "not above zero");
                self.fail::<()>(diagnostic, SCOPE).ok_or(())?;
                Err(())
            }
            _ => Ok(Some(value.node)),
        }
    }

    /// A frame of the file that the body does not declare is of no use, and perhaps misspelt.
    fn check_frame(&mut self, body: usize, points: &[Point], frame: &str, path: &'a Name) {
        if frame == "centre_of_gravity" || points.iter().any(|point| point.name == frame) {
            return;
        }
        let name = &self.declared.bodies[body].name.text;
        let known = points.iter().map(|point| point.name.as_str());
        let message = format!("the modes know a frame `{frame}` that body `{name}` does not declare");
        let diagnostic = Diagnostic::warning(Code::MODE_FRAME, message)
            .label(path.span, "in this file")
            .suggest(similar_name(frame, known))
            .help(format!("declare `point {frame} = (..)` in `{name}`, or leave its columns out"));
        self.report(diagnostic, SCOPE);
    }

    /// The elastic frame of a point (`None`: the body itself); an error where the modes do not know it.
    pub fn frame_of(&mut self, body: usize, point: Option<&str>, at: Span) -> Option<usize> {
        let elastic = self.bodies.get(body)?.elastic.as_ref()?;
        let Some(point) = point else { return Some(0) };
        if let Some(frame) = elastic.frames.iter().skip(1).position(|frame| frame.name == point) {
            return Some(frame + 1);
        }
        let known: Vec<String> = elastic.frames.iter().skip(1).map(|frame| frame.name.clone()).collect();
        let (span, name) = (elastic.span, self.bodies[body].name.clone());
        let diagnostic =
            Diagnostic::error(Code::MODE_FRAME, format!("the modes of `{name}` do not say how `{point}` moves"))
                .label(at, "stands on an elastic body")
                .secondary(span, "no columns for it")
                .suggest(similar_name(point, known.iter().map(String::as_str)))
                .help(format!(
                    "add columns `{point}.shift_x` .. `{point}.shift_z`, `{point}.turn_x [rad/m]` .. to the file"
                ));
        self.fail(diagnostic, SCOPE)
    }
}
