//! Builds studies by hand, without any text.

use ident::diagnostics::Span;
use ident::expression::{Graph, Node, Symbol};
use ident::quantities::{Dimension, Unit};
use ident::study::*;

pub struct Builder {
    pub study: Study,
}

pub const GROUND: Option<usize> = None;

fn unit() -> Unit {
    Unit { symbol: String::new(), dimension: Dimension::default(), factor: 1.0, offset: 0.0 }
}

/// A direction fixed in space.
pub fn along(axis: [f64; 3]) -> Option<ForceDirection> {
    Some(ForceDirection { axis, body: None, motion: Motion::Translational })
}

impl Builder {
    pub fn new() -> Self {
        let mut graph = Graph::new();
        let time = graph.symbol("t");
        let zero = graph.constant(0.0);
        let study = Study {
            name: "study".into(),
            title: String::new(),
            variant: "base".into(),
            variants: vec![],
            graph,
            time,
            gravity: [zero; 3],
            parameters: vec![],
            constraints: vec![],
            inputs: vec![],
            bodies: vec![],
            joints: vec![],
            couplings: vec![],
            forces: vec![],
            signals: vec![],
            states: vec![],
            events: vec![],
            measures: vec![],
            point_quantities: vec![],
            reactions: vec![],
            groups: Group { name: "total".into(), groups: vec![], channels: vec![] },
            experiments: vec![],
            manoeuvres: vec![],
            criteria: vec![],
            filter: None,
            remove_mean: false,
            solver: Solver {
                relative_tolerance: 1e-6,
                method: Method::Automatic,
                loss: Loss::Squares,
                error: ErrorDefinition::Output,
                coloured_noise: false,
            },
            constants: vec![],
            effects: vec![],
            places: vec![],
        };
        Self { study }
    }

    pub fn number(&mut self, value: f64) -> Node {
        self.study.graph.constant(value)
    }

    pub fn vector(&mut self, value: [f64; 3]) -> [Node; 3] {
        value.map(|x| self.number(x))
    }

    pub fn gravity(&mut self, value: [f64; 3]) {
        self.study.gravity = self.vector(value);
    }

    pub fn parameter(&mut self, name: &str, start: f64) -> Node {
        let symbol = self.study.graph.symbol(name);
        self.study.parameters.push(Parameter {
            name: name.into(),
            symbol,
            unit: unit(),
            lower: 0.0,
            upper: 10.0 * start,
            start,
            prior: None,
            span: Span::default(),
        });
        self.study.graph.variable(symbol)
    }

    pub fn input(&mut self, name: &str) -> u32 {
        self.study.inputs.push(Input {
            name: name.into(),
            title: String::new(),
            unit: unit(),
            interpolation: Interpolation::Linear,
            span: Span::default(),
        });
        self.study.inputs.len() as u32 - 1
    }

    /// Inertia about the centre of gravity: xx, yy, zz, xy, xz, yz.
    pub fn body(&mut self, name: &str, mass: f64, centre: [f64; 3], inertia: [f64; 6]) -> usize {
        let mass = self.number(mass);
        let centre_of_gravity = self.vector(centre);
        let inertia = inertia.map(|x| self.number(x));
        self.study.bodies.push(Body {
            name: name.into(),
            mass,
            centre_of_gravity,
            inertia,
            points: vec![],
            elastic: None,
            span: Span::default(),
        });
        self.study.bodies.len() - 1
    }

    pub fn attach(&mut self, body: Option<usize>, position: [f64; 3]) -> Attachment {
        Attachment { body, position: self.vector(position), frame: None }
    }

    pub fn joint(&mut self, name: &str, motion: Option<AxisMotion>, parent: Attachment, child: Attachment) -> usize {
        let mut symbol = |what: &str| self.study.graph.symbol(&format!("{name}.{what}"));
        let symbols = JointSymbols {
            position: symbol("position"),
            velocity: symbol("velocity"),
            acceleration: symbol("acceleration"),
            inertia: symbol("inertia"),
        };
        let axes = motion
            .map(|motion| JointAxis { name: name.into(), motion, symbols, prescribed: None })
            .into_iter()
            .collect();
        let kind = match motion {
            None => JointKind::Fixed,
            Some(AxisMotion::Shift(_)) => JointKind::Prismatic,
            Some(AxisMotion::Turn(_)) => JointKind::Revolute,
        };
        self.study.joints.push(Joint {
            name: name.into(),
            kind,
            parent,
            child,
            orientation: None,
            axes,
            rotation: None,
            length: None,
            closes_loop: false,
            span: Span::default(),
        });
        self.study.joints.len() - 1
    }

    pub fn symbols(&self, joint: usize) -> JointSymbols {
        self.study.joints[joint].single_axis().expect("joint moves").symbols
    }

    /// A force element whose load is `law(graph, x, v)`.
    pub fn force(&mut self, name: &str, place: ForcePlace, law: impl FnOnce(&mut Graph, Node, Node) -> Node) -> usize {
        let graph = &mut self.study.graph;
        let coordinate = graph.symbol(&format!("{name}.elongation"));
        let rate = graph.symbol(&format!("{name}.rate"));
        let (x, v) = (graph.variable(coordinate), graph.variable(rate));
        let load = law(graph, x, v);
        self.study.forces.push(Force {
            name: name.into(),
            law: "law".into(),
            is_actuator: false,
            place,
            load,
            coordinate,
            rate,
            span: Span::default(),
        });
        self.study.forces.len() - 1
    }

    pub fn state(&mut self, name: &str) -> Symbol {
        let symbol = self.study.graph.symbol(name);
        let zero = self.number(0.0);
        self.study.states.push(State {
            name: name.into(),
            symbol,
            derivative: zero,
            initial: zero,
            nominal: None,
            dimension: Dimension { length: 1, ..Dimension::default() },
            span: Span::default(),
        });
        symbol
    }

    pub fn measure(&mut self, name: &str, value: Node) {
        self.study.measures.push(Measure {
            name: name.into(),
            title: String::new(),
            unit: unit(),
            value,
            noise: None,
            weight: 1.0,
            delay: None,
            quantisation: None,
            span: Span::default(),
        });
    }

    /// Measures x, y, z of a point's motion.
    pub fn measure_point(&mut self, name: &str, point: Attachment, motion: PointMotion) {
        for axis in 0..3 {
            let symbol = self.study.graph.symbol(&format!("{name}.{motion:?}.{axis}"));
            self.study.point_quantities.push(PointQuantity { symbol, point, motion, axis });
            let node = self.study.graph.variable(symbol);
            self.measure(&format!("{name}_{}", ["x", "y", "z"][axis]), node);
        }
    }

    pub fn experiment(&mut self, start: Start) {
        self.study.experiments.push(Experiment {
            name: format!("experiment_{}", self.study.experiments.len()),
            role: Role::Estimation,
            data: "data.csv".into(),
            time_column: "t".into(),
            columns: vec![],
            constant_inputs: vec![],
            measures: vec![],
            window: None,
            start,
            span: Span::default(),
            data_span: Span::default(),
        });
    }
}

/// Deterministic numbers in (-1, 1).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1_u64 << 53) as f64) * 2.0 - 1.0
    }

    pub fn vector(&mut self) -> [f64; 3] {
        [self.next(), self.next(), self.next()]
    }

    pub fn unit(&mut self) -> [f64; 3] {
        let v = self.vector();
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / length)
    }

    pub fn state(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

pub struct NoInputs;

impl ident::tape::InputSource for NoInputs {
    fn sample(&self, _input: u32, _order: u8, _t: f64) -> f64 {
        f64::NAN
    }
}

#[track_caller]
pub fn assert_close(actual: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(actual.len(), expected.len());
    let scale = expected.iter().fold(1e-30_f64, |s, x| s.max(x.abs()));
    for (i, (a, e)) in actual.iter().zip(expected).enumerate() {
        assert!((a - e).abs() <= relative * scale, "element {i}: {a} instead of {e} (scale {scale})");
    }
}
