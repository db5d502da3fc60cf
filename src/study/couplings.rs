//! Couplings: equations between positions.

use super::checker::{Allowed, Checker, Scope};
use super::declarations;
use super::evaluate::Typed;
use super::model::{Coupling, PointMotion};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{Node, Symbol};
use crate::quantities::Dimension;
use crate::syntax::{Expression, ExpressionKind, Name};
use std::collections::HashSet;

const SCOPE: Scope = Scope::Study(Allowed::Motion);

/// What holds an equation between quantities of a dimension: power over its rate.
pub(super) fn load_dimension(of: Dimension) -> Dimension {
    Dimension::TORQUE / of
}

fn is_rate(name: &str) -> bool {
    name.contains("velocity") || name.ends_with(".rate")
}

fn load_word(of: Dimension) -> &'static str {
    match load_dimension(of) {
        Dimension::FORCE => "force",
        Dimension::TORQUE => "torque",
        _ => "load",
    }
}

/// Axes of joints whose positions couplings mention.
pub(super) fn mentioned<'a>(couplings: &[declarations::Coupling<'a>]) -> HashSet<&'a str> {
    let mut names = HashSet::new();
    for coupling in couplings {
        for side in [coupling.left, coupling.right] {
            collect(side, &mut names);
        }
    }
    names
}

fn collect<'a>(expression: &'a Expression, names: &mut HashSet<&'a str>) {
    match &expression.kind {
        ExpressionKind::Path(name) => names.extend(name.text.strip_suffix(".position")),
        ExpressionKind::Negate(inner) => collect(inner, names),
        ExpressionKind::Binary { left, right, .. } => [left, right].into_iter().for_each(|side| collect(side, names)),
        ExpressionKind::Call { arguments, .. } => arguments.iter().for_each(|argument| collect(argument, names)),
        ExpressionKind::If { condition, then, otherwise } => {
            [condition, then, otherwise].into_iter().for_each(|part| collect(part, names));
        }
        ExpressionKind::Number { .. } | ExpressionKind::Invalid => {}
    }
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
        let (a, b) = (self.evaluate(left, SCOPE), self.evaluate(right, SCOPE));
        let (a, b) = (a?, b?);
        let message = || format!("{} cannot be equal to {}", a.dimension, b.dimension);
        self.same_dimension((a, left.span), (b, right.span), message, SCOPE)?;
        let positions = self.positions();
        let mut is_moving = false;
        for (side, value) in [(left, a), (right, b)] {
            for symbol in self.graph.symbols_of(&[value.node]) {
                is_moving |= positions.contains(&symbol);
                if !positions.contains(&symbol) && symbol != self.time && !self.is_parameter(symbol) {
                    let rolls = !self.is_integrable([a.node, b.node], &positions);
                    return self.not_a_position(name, symbol, side.span, rolls);
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
        let difference = self.graph.subtract(a.node, b.node);
        let load = self.graph.symbol(&format!("{}.{}", name.text, load_word(a.dimension)));
        Some(Coupling { name: name.text.clone(), difference, dimension: a.dimension, load, span: name.span })
    }

    /// Everything that counts as a position.
    fn positions(&self) -> HashSet<Symbol> {
        let joints = self.topology.joints.iter().flatten();
        let axes = joints.flat_map(|read| read.freedom.axes.iter().map(|axis| axis.symbols.position));
        let elastic = self.bodies.iter().filter_map(|body| body.elastic.as_ref());
        let modes = elastic.flat_map(|elastic| elastic.modes.iter().map(|mode| mode.symbols.position));
        let points = self.point_quantities.iter().filter(|quantity| matches!(quantity.motion, PointMotion::Position));
        let elongations = self.placed_forces.iter().flatten().map(|placed| placed.coordinate);
        axes.chain(modes).chain(points.map(|quantity| quantity.symbol)).chain(elongations).collect()
    }

    /// Whether an equation between rates is that of positions, derived: no rate is multiplied by anything that moves.
    fn is_integrable(&mut self, sides: [Node; 2], positions: &HashSet<Symbol>) -> bool {
        let symbols = self.graph.symbols_of(&sides);
        let rates: Vec<Symbol> =
            symbols.iter().copied().filter(|symbol| is_rate(self.graph.symbol_name(*symbol))).collect();
        rates.iter().all(|&rate| {
            let is_of_joint = !self.graph.symbol_name(rate).contains("angular_velocity");
            let slopes = self.graph.differentiate(&sides, rate);
            let in_slopes = self.graph.symbols_of(&slopes);
            is_of_joint && in_slopes.iter().all(|symbol| !positions.contains(symbol) && !rates.contains(symbol))
        })
    }

    fn not_a_position<T>(&mut self, name: &Name, symbol: Symbol, side: Span, rolls: bool) -> Option<T> {
        let foreign = self.graph.symbol_name(symbol).to_owned();
        let mut diagnostic =
            Diagnostic::error(Code::COUPLING, format!("coupling `{}` depends on `{foreign}`", name.text))
                .label(side, "a coupling relates positions only");
        if is_rate(&foreign) && rolls {
            diagnostic = diagnostic
                .note("no relation of the positions has this one as its rate: what rolls in a plane reaches every position")
                .help(
                    "let a force hold the rates together, as friction does: `signal slip = ..` of the difference, `force grip: \
                     external_load on .. { value = -grip_damping * slip }`; that is creep, which a large `grip_damping` makes small",
                );
        } else if is_rate(&foreign) {
            diagnostic = diagnostic.help(
                "write `.position` for every `.velocity`, and a constant rate as `rate * t`; the relation of the rates follows from \
                 that of the positions",
            );
        } else {
            diagnostic = diagnostic
                .help("what depends on loads and states is a force element between bodies or on a joint, with its law");
        }
        self.fail(diagnostic, SCOPE)
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
        match self.couplings.get(index) {
            Some(read) => read.as_ref().map(|coupling| coupling.dimension),
            None => self.evaluate(self.declared.couplings[index].left, SCOPE).map(|side| side.dimension),
        }
    }
}
