//! Everything an effect can attach to, with nodes for its typical magnitudes.

use super::checker::{Checker, Entity, Site};
use super::kinds::load_dimension;
use super::model::{AxisMotion, Force, ForcePlace, JointSymbols, Measure, Place, PlaceKind, PlaceQuantity};
use crate::expression::Node;
use crate::quantities::Dimension;

impl<'a> Checker<'a> {
    /// Joints, forces, actuators, inputs, measures, signals; loads of effects are no places.
    pub fn finished_places(&mut self, forces: &[Force], measures: &[Measure]) -> Vec<Place> {
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let mut places = Vec::new();
        for joint in 0..declared.joints.len() {
            let axes = self.topology.joint(joint).map_or(0, |read| read.freedom.axes.len());
            for axis in 0..axes {
                places.extend(self.joint_place(joint, axis, forces));
            }
        }
        for force in 0..declared.forces.len() {
            places.extend(self.force_place_entry(force));
        }
        for input in 0..declared.inputs.len() {
            let span = declared.inputs[input].name.span;
            let value = self.site_value(Site::Input(input), span);
            places.extend(value.map(|value| {
                value_place(PlaceKind::Input, &declared.inputs[input].name.text, value.dimension, value.node)
            }));
        }
        for measure in measures {
            places.push(value_place(PlaceKind::Measure, &measure.name, measure.unit.dimension, measure.value));
        }
        for (index, signal) in declared.signals.iter().enumerate() {
            let value = self.site_value(Site::Signal(index), signal.name.span);
            places.extend(
                value.map(|value| value_place(PlaceKind::Signal, &signal.name.text, value.dimension, value.node)),
            );
        }
        places.extend(self.gravity_places());
        places
    }

    /// Motion that is prescribed or follows from a closed loop leaves no room for a load of its own.
    fn joint_place(&mut self, joint: usize, axis: usize, forces: &[Force]) -> Option<Place> {
        if self.topology.closes_loop[joint] || self.is_prescribed(joint, axis) {
            return None;
        }
        let entry = self.axis_entry(joint, axis)?.clone();
        let (symbols, motion, name) = (entry.symbols, entry.motion.motion(), entry.name);
        let position = self.graph.variable(symbols.position);
        let velocity = self.graph.variable(symbols.velocity);
        let mut probes = vec![(PlaceQuantity::Coordinate, position), (PlaceQuantity::Rate, velocity)];
        let load = self.joint_load(joint, axis, forces);
        probes.push((PlaceQuantity::Load, self.load_magnitude(symbols, load)));
        let dimension = load_dimension(motion);
        Some(Place { kind: PlaceKind::Joint, name, motion: Some(motion), dimension, ports: Vec::new(), probes })
    }

    /// Size of what acts on a joint: its elements' loads and the load that accelerates what it moves, as root of the
    /// sum of squares. A free joint without any element has the second only.
    fn load_magnitude(&mut self, symbols: JointSymbols, load: Option<Node>) -> Node {
        let inertia = self.graph.variable(symbols.inertia);
        let acceleration = self.graph.variable(symbols.acceleration);
        let inertial = self.graph.multiply(inertia, acceleration);
        let inertial_square = self.graph.multiply(inertial, inertial);
        let load = load.unwrap_or_else(|| self.graph.constant(0.0));
        let load_square = self.graph.multiply(load, load);
        let sum = self.graph.add(inertial_square, load_square);
        self.graph.unary(crate::expression::Unary::Sqrt, sum)
    }

    /// Sum of the loads in the joint's direction; `None` where no element can be projected on it.
    fn joint_load(&mut self, joint: usize, axis: usize, forces: &[Force]) -> Option<Node> {
        let read = self.topology.joint(joint)?;
        let (child, motion) = (read.child, read.freedom.axes.get(axis)?.motion);
        let mut sum: Option<Node> = None;
        for force in forces {
            let sign = match force.place {
                ForcePlace::Joint { joint: index, axis: at } => {
                    f64::from(u8::from(self.joint_position(joint) == Some(index) && at == axis))
                }
                ForcePlace::Between { first, second, along, .. } => {
                    let side =
                        f64::from(u8::from(second.body == child.body)) - f64::from(u8::from(first.body == child.body));
                    match (motion, along) {
                        (_, Some(along)) if along.motion == motion.motion() => {
                            side * dot(motion.direction(), along.axis)
                        }
                        (AxisMotion::Shift(_), None) => side,
                        _ => 0.0,
                    }
                }
            };
            if sign != 0.0 {
                let factor = self.graph.constant(sign);
                let share = self.graph.multiply(factor, force.load);
                sum = Some(match sum {
                    Some(sum) => self.graph.add(sum, share),
                    None => share,
                });
            }
        }
        sum
    }

    /// Index of a declared joint among the finished ones.
    pub fn joint_position(&self, joint: usize) -> Option<usize> {
        let present = self.topology.order.iter().filter(|index| self.topology.joint(**index).is_some());
        present.copied().position(|index| index == joint)
    }

    fn force_place_entry(&mut self, force: usize) -> Option<Place> {
        let placed = self.placed_forces.get(force).copied().flatten()?;
        let declared: &'a super::declarations::Declarations<'a> = self.declared;
        let element = &declared.forces[force];
        let kind = self.place_kind(Entity::Force(force))?;
        let load = self.site_value(Site::Force(force), element.name.span)?;
        let (x, v) = (self.graph.variable(placed.coordinate), self.graph.variable(placed.rate));
        let mut probes =
            vec![(PlaceQuantity::Coordinate, x), (PlaceQuantity::Rate, v), (PlaceQuantity::Load, load.node)];
        if kind == PlaceKind::Actuator && self.site_port(Site::Force(force), "command").is_some() {
            let steps = self.site_effects.get(&Site::Force(force)).map_or(0, Vec::len);
            let command = self.port(Site::Force(force), "command", steps, element.name.span);
            probes.extend(command.map(|command| (PlaceQuantity::Value, command.node)));
        }
        let name = element.name.text.clone();
        let mut ports = self.site_ports(Site::Force(force));
        ports.retain(|port| port != "inertia");
        Some(Place { kind, name, motion: Some(placed.motion), dimension: load.dimension, ports, probes })
    }
}

fn value_place(kind: PlaceKind, name: &str, dimension: Dimension, value: Node) -> Place {
    let ports: &[&str] = match kind {
        PlaceKind::Input => &["u", "value"],
        PlaceKind::Measure => &["y", "value"],
        _ => &["value"],
    };
    let ports = ports.iter().map(|port| (*port).to_owned()).collect();
    Place { kind, name: name.to_owned(), motion: None, dimension, ports, probes: vec![(PlaceQuantity::Value, value)] }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
