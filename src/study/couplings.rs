//! Couplings: equations between positions, or between rates.

use super::checker::{Allowed, Checker, Entity, Scope};
use super::declarations;
use super::evaluate::Typed;
use super::model::{Coupling, CouplingLevel, PointMotion};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{Node, Symbol};
use crate::quantities::Dimension;
use crate::syntax::{Expression, ExpressionKind, Name};
use std::collections::HashSet;

const SCOPE: Scope = Scope::Study(Allowed::Motion);

/// What holds an equation between quantities of a dimension: power over its rate.
pub(super) fn load_dimension(of: Dimension) -> Dimension {
    Dimension::TORQUE / of
}

fn load_word(of: Dimension) -> &'static str {
    match load_dimension(of) {
        Dimension::FORCE => "force",
        Dimension::TORQUE => "torque",
        _ => "load",
    }
}

/// Axes of joints whose positions or rates couplings mention.
pub(super) fn mentioned<'a>(couplings: &[declarations::Coupling<'a>]) -> HashSet<&'a str> {
    let mut names = Vec::new();
    for coupling in couplings {
        [coupling.left, coupling.right].into_iter().for_each(|side| collect(side, &mut names));
    }
    let of_axis = |name: &&'a Name| name.text.strip_suffix(".position").or(name.text.strip_suffix(".velocity"));
    names.iter().filter_map(of_axis).collect()
}

/// All names in an expression.
fn collect<'a>(expression: &'a Expression, names: &mut Vec<&'a Name>) {
    match &expression.kind {
        ExpressionKind::Path(name) => names.push(name),
        ExpressionKind::Negate(inner) => collect(inner, names),
        ExpressionKind::Binary { left, right, .. } => [left, right].into_iter().for_each(|side| collect(side, names)),
        ExpressionKind::Call { arguments, .. } => arguments.iter().for_each(|argument| collect(argument, names)),
        ExpressionKind::If { condition, then, otherwise } => {
            [condition, then, otherwise].into_iter().for_each(|part| collect(part, names));
        }
        ExpressionKind::Number { .. } | ExpressionKind::Invalid => {}
    }
}

/// What the two sides of a coupling relate.
#[derive(Default)]
struct Related {
    /// Positions of joints, modes and points, elongations.
    positions: HashSet<Symbol>,
    /// Their rates, and angular velocities.
    rates: HashSet<Symbol>,
    /// What else the positions of bodies decide: axes of bodies, quaternions.
    directions: HashSet<Symbol>,
}

impl<'a> Checker<'a> {
    /// Reads all couplings, once the places of all elements are known.
    pub fn read_couplings(&mut self) {
        let declared: &'a declarations::Declarations<'a> = self.declared;
        for index in 0..declared.couplings.len() {
            let read = self.read_coupling(index);
            self.couplings.push(read);
        }
    }

    fn read_coupling(&mut self, index: usize) -> Option<Coupling> {
        let declarations::Coupling { name, left, right } = self.declared.couplings[index];
        for side in [left, right] {
            self.refuse_loads(name, side)?;
        }
        let (a, b) = (self.evaluate(left, SCOPE), self.evaluate(right, SCOPE));
        let (a, b) = (a?, b?);
        let message = || format!("{} cannot be equal to {}", a.dimension, b.dimension);
        self.same_dimension((a, left.span), (b, right.span), message, SCOPE)?;
        let related = self.related();
        let level = self.level([a.node, b.node], &related);
        let mut is_moving = false;
        for (side, value) in [(left, a), (right, b)] {
            for symbol in self.graph.symbols_of(&[value.node]) {
                let (is_position, is_rate) = (related.positions.contains(&symbol), related.rates.contains(&symbol));
                is_moving |= is_rate || (is_position && level == CouplingLevel::Positions);
                let is_known = is_position || symbol == self.time || self.is_parameter(symbol);
                let of_rates = is_rate || related.directions.contains(&symbol);
                if !(is_known || (of_rates && level == CouplingLevel::Rates)) {
                    return self.not_related(name, side, symbol);
                }
            }
        }
        if !is_moving {
            let diagnostic =
                Diagnostic::error(Code::COUPLING, format!("coupling `{}` relates no positions", name.text))
                    .label(left.span.to(right.span), "nothing here moves")
                    .help("name positions of joints: `coupling gears: motor.position = 4.5 * wheel.position`");
            return self.fail(diagnostic, SCOPE);
        }
        for (side, value) in [(left, a), (right, b)] {
            self.refuse_products(name, side, value.node, &related)?;
        }
        let difference = self.graph.subtract(a.node, b.node);
        let dimension = integral(a.dimension, level);
        let load = self.graph.symbol(&format!("{}.{}", name.text, load_word(dimension)));
        Some(Coupling { name: name.text.clone(), difference, level, dimension, load, span: name.span })
    }

    /// Everything that couplings may relate.
    fn related(&self) -> Related {
        let mut related = Related::default();
        for read in self.topology.joints.iter().flatten() {
            for axis in &read.freedom.axes {
                related.positions.insert(axis.symbols.position);
                related.rates.insert(axis.symbols.velocity);
            }
            if let Some(symbols) = read.freedom.rotation {
                related.directions.extend(symbols.quaternion);
                related.rates.extend(symbols.velocity);
            }
        }
        let elastic = self.bodies.iter().filter_map(|body| body.elastic.as_ref());
        for mode in elastic.flat_map(|elastic| &elastic.modes) {
            related.positions.insert(mode.symbols.position);
            related.rates.insert(mode.symbols.velocity);
        }
        for quantity in &self.point_quantities {
            match quantity.motion {
                PointMotion::Position => related.positions.insert(quantity.symbol),
                PointMotion::Velocity | PointMotion::AngularVelocity => related.rates.insert(quantity.symbol),
                PointMotion::Axis(_) => related.directions.insert(quantity.symbol),
                PointMotion::Acceleration | PointMotion::AngularAcceleration => false,
            };
        }
        for placed in self.placed_forces.iter().flatten() {
            related.positions.insert(placed.coordinate);
            related.rates.insert(placed.rate);
        }
        related
    }

    fn level(&self, sides: [Node; 2], related: &Related) -> CouplingLevel {
        let is_rate = |symbol: &Symbol| related.rates.contains(symbol);
        if self.graph.symbols_of(&sides).iter().any(is_rate) { CouplingLevel::Rates } else { CouplingLevel::Positions }
    }

    fn refuse_loads(&mut self, name: &Name, side: &'a Expression) -> Option<()> {
        let mut names = Vec::new();
        collect(side, &mut names);
        let is_load = |own: &&Name| {
            let (first, rest) = self.split_path(&own.text);
            let is_element = matches!(self.entities.get(first), Some(Entity::Force(_) | Entity::Effect(_)));
            is_element && matches!(rest, Some("force" | "torque" | "load"))
        };
        let Some(&load) = names.iter().find(|own| is_load(own)) else { return Some(()) };
        let message = format!("coupling `{}` depends on the load `{}`", name.text, load.text);
        let diagnostic = Diagnostic::error(Code::COUPLING, message)
            .label(load.span, "a coupling relates positions, or rates")
            .help("what depends on loads is a force element between bodies or on a joint, with its law");
        self.fail(diagnostic, SCOPE)
    }

    fn not_related<T>(&mut self, name: &Name, side: &Expression, symbol: Symbol) -> Option<T> {
        let foreign = self.graph.symbol_name(symbol).to_owned();
        let is_direction = self.related().directions.contains(&symbol);
        let diagnostic = Diagnostic::error(Code::COUPLING, format!("coupling `{}` depends on `{foreign}`", name.text))
            .label(side.span, "a coupling relates positions, or rates")
            .help(if is_direction {
                "hold directions by a joint or by positions of points; beside rates they may stand as factors"
            } else {
                "what depends on loads and states is a force element between bodies or on a joint, with its law"
            });
        self.fail(diagnostic, SCOPE)
    }

    /// Rates stand for themselves, with factors that depend on positions at most: so does the load that holds them.
    fn refuse_products(&mut self, name: &Name, side: &Expression, value: Node, related: &Related) -> Option<()> {
        for rate in self.graph.symbols_of(&[value]).into_iter().filter(|symbol| related.rates.contains(symbol)) {
            let slope = self.graph.differentiate(&[value], rate);
            if self.graph.symbols_of(&slope).iter().any(|symbol| related.rates.contains(symbol)) {
                let rate = self.graph.symbol_name(rate).to_owned();
                let message = format!("coupling `{}` is not linear in `{rate}`", name.text);
                let diagnostic = Diagnostic::error(Code::COUPLING, message)
                    .label(side.span, "rates stand alone, with factors that depend on positions at most")
                    .help(
                        "relate rates linearly, `disc.velocity.x = radius * spin.velocity`; else use a force element",
                    );
                return self.fail(diagnostic, SCOPE);
            }
        }
        Some(())
    }

    /// `gears.torque`
    pub fn coupling_quantity(
        &mut self,
        index: usize,
        quantity: &str,
        name: &'a Name,
        allowed: Allowed,
    ) -> Option<Typed> {
        self.check_varies(name, allowed)?;
        let dimension = self.coupled_dimension(index)?;
        let word = load_word(dimension);
        if quantity != word {
            return self.no_quantity(name, quantity, &[word]);
        }
        let node = {
            let symbol = self.graph.symbol(&name.text);
            self.graph.variable(symbol)
        };
        Some(Typed::new(node, load_dimension(dimension)))
    }

    /// What its load is called.
    pub fn coupling_word(&mut self, index: usize) -> Option<&'static str> {
        self.coupled_dimension(index).map(load_word)
    }

    /// Laws may name the load of a coupling before all couplings are read.
    fn coupled_dimension(&mut self, index: usize) -> Option<Dimension> {
        if let Some(read) = self.couplings.get(index) {
            return read.as_ref().map(|coupling| coupling.dimension);
        }
        let declarations::Coupling { left, right, .. } = self.declared.couplings[index];
        let (a, b) = (self.evaluate(left, SCOPE)?, self.evaluate(right, SCOPE)?);
        let level = self.level([a.node, b.node], &self.related());
        Some(integral(a.dimension, level))
    }
}

/// Of rates the dimension of what they are rates of.
fn integral(dimension: Dimension, level: CouplingLevel) -> Dimension {
    match level {
        CouplingLevel::Positions => dimension,
        CouplingLevel::Rates => dimension * Dimension::TIME,
    }
}
