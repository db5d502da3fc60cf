//! Equations of motion of mechanisms with closed loops at random states: positions and velocities drawn by chance and
//! brought onto the constraints, then accelerations of all bodies and reactions of all joints against Newton's and
//! Euler's equations of the single bodies, solved as one dense system for accelerations, joint accelerations and all
//! six reactions of every joint.

use crate::newton_euler::{M, Mechanism, V, measures, suspension};
use crate::run::checked;
use ident::expression::{Graph, Node, Symbol};
use ident::mechanics::{System, VariableKind, derive};
use ident::study::{AxisMotion, ForcePlace, Joint, JointKind};
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

type Values = HashMap<Symbol, f64>;

/// Numbers between -1 and 1, the same on every run (splitmix64).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
    }
}

/// A system with the derivatives of its constraints.
struct Constrained {
    system: System,
    graph: Graph,
    symbols: Vec<Symbol>,
    /// d(velocity constraints, position constraints)/d(states, time): row, column, value.
    slopes: Vec<(usize, usize, Node)>,
}

impl Constrained {
    fn new(system: System) -> Self {
        let mut graph = system.graph.clone();
        let mut symbols: Vec<Symbol> = system.states.iter().map(|state| state.symbol).collect();
        symbols.push(system.time);
        let constraints = &system.constraints[..2 * system.loop_constraints];
        let slopes = graph.jacobian(constraints, &symbols);
        let slopes = slopes.into_iter().map(|entry| (entry.row, entry.column, entry.value)).collect();
        Self { system, graph, symbols, slopes }
    }

    fn count(&self) -> usize {
        self.system.loop_constraints
    }

    fn evaluate(&self, nodes: &[Node], values: &Values) -> DVector<f64> {
        let known = |symbol: Symbol| values.get(&symbol).copied().unwrap_or(0.0);
        DVector::from_vec(self.graph.evaluate(nodes, known, |_, _, _| f64::NAN))
    }

    /// Rows of one level against the states of one kind (all of them and the time where none is named).
    fn jacobian(&self, first: usize, kind: Option<VariableKind>, values: &Values) -> DMatrix<f64> {
        let nodes: Vec<Node> = self.slopes.iter().map(|(_, _, node)| *node).collect();
        let numbers = self.evaluate(&nodes, values);
        let mut matrix = DMatrix::zeros(self.count(), self.symbols.len());
        for ((row, column, _), number) in self.slopes.iter().zip(numbers.iter()) {
            let is_meant = kind.is_none_or(|kind| self.system.states.get(*column).is_some_and(|s| s.kind == kind));
            if (first..first + self.count()).contains(row) && is_meant {
                matrix[(row - first, *column)] = *number;
            }
        }
        matrix
    }

    /// The shortest step of the states of one kind that removes the residual.
    fn correct(&self, first: usize, kind: VariableKind, values: &mut Values) -> f64 {
        let residual = self.evaluate(&self.system.constraints[first..first + self.count()], values);
        let step =
            self.jacobian(first, Some(kind), values).svd(true, true).solve(&residual, 1e-10).expect("a solution");
        for (state, amount) in self.system.states.iter().zip(step.iter()) {
            *values.entry(state.symbol).or_insert(0.0) -= amount;
        }
        residual.amax()
    }

    /// A consistent state with its multipliers.
    fn state(&self, chance: &mut Chance) -> Values {
        let mut values = Values::from([(self.system.time, 0.3 + 0.2 * chance.next())]);
        for state in &self.system.states {
            let is_length = state.dimension.length != 0;
            let size = match state.kind {
                VariableKind::Position => {
                    if is_length {
                        0.03
                    } else {
                        0.25
                    }
                }
                _ => {
                    if is_length {
                        0.5
                    } else {
                        2.0
                    }
                }
            };
            let middle = if state.kind == VariableKind::Position { state.reference } else { 0.0 };
            values.insert(state.symbol, middle + size * chance.next());
        }
        let closed = (0..40).any(|_| {
            self.normalise(&mut values);
            self.correct(self.count(), VariableKind::Position, &mut values) < 1e-13
        });
        assert!(closed, "a position near the drawn one closes the loops");
        self.normalise(&mut values);
        self.correct(0, VariableKind::Velocity, &mut values);
        self.multiply(&mut values);
        values
    }

    fn normalise(&self, values: &mut Values) {
        let quaternions: Vec<Symbol> =
            self.system.states.iter().filter(|s| s.name.contains(".quaternion.")).map(|s| s.symbol).collect();
        for four in quaternions.chunks(4) {
            let length = four.iter().map(|s| values[s] * values[s]).sum::<f64>().sqrt();
            four.iter().for_each(|s| *values.entry(*s).or_default() /= length);
        }
    }

    /// Multipliers with which the velocity constraints keep to be fulfilled.
    fn multiply(&self, values: &mut Values) {
        let m = self.count();
        let all = self.jacobian(0, None, values);
        let change = |values: &Values| {
            let mut rates: Vec<f64> = self.evaluate(&self.system.rates, values).iter().copied().collect();
            rates.push(1.0);
            &all * DVector::from_vec(rates)
        };
        let resting = change(values);
        let mut matrix = DMatrix::zeros(m, m);
        for column in 0..m {
            let symbol = self.system.algebraic[column].symbol;
            values.insert(symbol, 1.0);
            matrix.set_column(column, &(change(values) - &resting));
            values.insert(symbol, 0.0);
        }
        let multipliers = matrix.lu().solve(&-resting).expect("independent constraints");
        for (variable, value) in self.system.algebraic.iter().zip(multipliers.iter()) {
            values.insert(variable.symbol, *value);
        }
    }
}

/// One row of the dense system: coefficients of the unknowns and the right-hand side.
struct Dense {
    rows: Vec<(Vec<(usize, f64)>, f64)>,
    bodies: usize,
    joints: usize,
    accelerations: usize,
}

impl Dense {
    fn alpha(body: usize, i: usize) -> usize {
        6 * body + i
    }
    fn origin(body: usize, i: usize) -> usize {
        6 * body + 3 + i
    }
    fn force(&self, joint: usize, i: usize) -> usize {
        6 * self.bodies + 6 * joint + i
    }
    fn moment(&self, joint: usize, i: usize) -> usize {
        6 * self.bodies + 6 * joint + 3 + i
    }
    fn second(&self, number: usize) -> usize {
        6 * (self.bodies + self.joints) + number
    }

    fn solve(self) -> DVector<f64> {
        let n = 6 * (self.bodies + self.joints) + self.accelerations;
        assert_eq!(self.rows.len(), n, "as many equations as unknowns");
        let (mut a, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (i, (row, right)) in self.rows.into_iter().enumerate() {
            row.into_iter().for_each(|(column, value)| a[(i, column)] += value);
            b[i] = right;
        }
        a.lu().solve(&b).expect("a mechanism without redundant constraints")
    }
}

fn unit(i: usize) -> V {
    V::from_fn(|k, _| if k == i { 1.0 } else { 0.0 })
}

/// What each free coordinate of a joint does: angular and linear acceleration of the child at its attachment per unit,
/// the load on it per force and moment there; and the accelerations without any of them. Plain composition of moving
/// frames.
struct Passage {
    free: Vec<(V, V)>,
    alpha: V,
    acceleration: V,
    spin: V,
    velocity: V,
    /// From the parent's attachment to the child's.
    arm: V,
}

impl Mechanism {
    fn passage(&self, joint: &Joint, k: usize) -> Passage {
        let parent = joint.parent.body.map(|body| self.motion(&self.study.bodies[body], k));
        let (mut axes, start) = self.end(&joint.parent, k);
        let (child_axes, end) = self.end(&joint.child, k);
        let mut spin = parent.as_ref().map_or(V::zeros(), |motion| motion.spin);
        let mut velocity = parent
            .as_ref()
            .map_or(V::zeros(), |motion| motion.origin_velocity + motion.spin.cross(&(start - motion.origin)));
        let (mut alpha, mut acceleration, mut place) = (V::zeros(), V::zeros(), start);
        if let Some(motion) = &parent {
            acceleration = motion.spin.cross(&motion.spin.cross(&(start - motion.origin)));
        }
        let mut ways = Vec::new();
        for axis in &joint.axes {
            let way = axes * V::from(axis.motion.direction());
            let [q, v, a] =
                ["position", "velocity", "acceleration"].map(|word| self.scalar(&format!("{}.{word}", axis.name), k));
            let given = if axis.prescribed.is_some() { a } else { 0.0 };
            let is_turn = matches!(axis.motion, AxisMotion::Turn(_));
            if axis.prescribed.is_none() {
                ways.push((way, is_turn, place + if is_turn { V::zeros() } else { way * q }));
            }
            if is_turn {
                alpha += way * given + spin.cross(&way) * v;
                spin += way * v;
                axes = *nalgebra::Rotation3::new(way * q).matrix() * axes;
            } else {
                let moved = way * q;
                acceleration +=
                    alpha.cross(&moved) + spin.cross(&spin.cross(&moved)) + 2.0 * v * spin.cross(&way) + way * given;
                velocity += spin.cross(&moved) + way * v;
                place += moved;
            }
        }
        let mut free: Vec<(V, V)> = ways
            .into_iter()
            .map(|(way, is_turn, at)| if is_turn { (way, way.cross(&(end - at))) } else { (V::zeros(), way) })
            .collect();
        if joint.rotation.is_some() {
            let relative = child_axes * self.three(&format!("{}_angular_velocity", joint.name), k);
            alpha += spin.cross(&relative);
            spin += relative;
            free.extend((0..3).map(|i| (child_axes * unit(i), V::zeros())));
        }
        Passage { free, alpha, acceleration, spin, velocity, arm: end - start }
    }

    /// Largest difference of accelerations and reactions, with the largest values.
    fn against_single_bodies(&self, k: usize) -> [(f64, f64); 2] {
        let (bodies, joints) = (self.study.bodies.len(), self.study.joints.len());
        let passages: Vec<Passage> = self.study.joints.iter().map(|joint| self.passage(joint, k)).collect();
        let is_rod = |joint: &Joint| joint.kind == JointKind::Distance;
        let accelerations = passages.iter().map(|passage| passage.free.len()).sum();
        let mut dense = Dense { rows: vec![], bodies, joints, accelerations };
        self.balances(&mut dense, k);
        let mut number = 0;
        for (j, (joint, passage)) in self.study.joints.iter().zip(&passages).enumerate() {
            if is_rod(joint) {
                self.rod(&mut dense, j, passage, k);
            } else {
                self.carried(&mut dense, j, passage, number, k);
            }
            number += passage.free.len();
        }
        let x = dense.solve();
        let mut motion = (0.0_f64, 1.0_f64);
        for (b, body) in self.study.bodies.iter().enumerate() {
            let own = self.motion(body, k);
            for i in 0..3 {
                for (unknown, value) in
                    [(Dense::alpha(b, i), own.spin_rate[i]), (Dense::origin(b, i), own.origin_acceleration[i])]
                {
                    motion = (motion.0.max((x[unknown] - value).abs()), motion.1.max(value.abs()));
                }
            }
        }
        let mut loads = (0.0_f64, 1.0_f64);
        for (j, joint) in self.study.joints.iter().enumerate() {
            let (force, moment) = self.reaction(joint, k);
            for i in 0..6 {
                let value = if i < 3 { force[i] } else { moment[i - 3] };
                loads = (loads.0.max((x[6 * bodies + 6 * j + i] - value).abs()), loads.1.max(value.abs()));
            }
        }
        [motion, loads]
    }

    /// Newton and Euler of every body.
    fn balances(&self, dense: &mut Dense, k: usize) {
        let gravity = self.vector(self.study.gravity);
        let mut rows: Vec<(Vec<(usize, f64)>, f64)> = Vec::new();
        for (b, body) in self.study.bodies.iter().enumerate() {
            let own = self.motion(body, k);
            let (mass, inertia) = (self.value(body.mass), self.inertia(body, own.axes));
            let arm = own.centre - own.origin;
            let centripetal = own.spin.cross(&own.spin.cross(&arm));
            let gyroscopic = own.spin.cross(&(inertia * own.spin));
            for i in 0..3 {
                let mut row = vec![(Dense::origin(b, i), mass)];
                row.extend((0..3).map(|c| (Dense::alpha(b, c), mass * unit(c).cross(&arm)[i])));
                rows.push((row, mass * (gravity[i] - centripetal[i])));
            }
            for i in 0..3 {
                rows.push(((0..3).map(|c| (Dense::alpha(b, c), inertia[(i, c)])).collect(), -gyroscopic[i]));
            }
        }
        let arm = |body: usize, at: V| at - self.motion(&self.study.bodies[body], k).centre;
        for (j, joint) in self.study.joints.iter().enumerate() {
            let at = self.end(&joint.child, k).1;
            for (body, sign) in [(joint.child.body, -1.0), (joint.parent.body, 1.0)] {
                let Some(body) = body else { continue };
                for i in 0..3 {
                    rows[6 * body + i].0.push((dense.force(j, i), sign));
                    rows[6 * body + 3 + i].0.push((dense.moment(j, i), sign));
                    let by_force = arm(body, at);
                    rows[6 * body + 3 + i]
                        .0
                        .extend((0..3).map(|c| (dense.force(j, c), sign * by_force.cross(&unit(c))[i])));
                }
            }
        }
        for element in &self.study.forces {
            let ForcePlace::Between { first, second, along: None, .. } = &element.place else { continue };
            let (a, b) = (self.end(first, k).1, self.end(second, k).1);
            let force = self.scalar(&format!("{}.load", element.name), k) * (b - a).normalize();
            for (body, at, force) in [(second.body, b, force), (first.body, a, -force)] {
                let Some(body) = body else { continue };
                let moment = arm(body, at).cross(&force);
                (0..3).for_each(|i| {
                    rows[6 * body + i].1 += force[i];
                    rows[6 * body + 3 + i].1 += moment[i];
                });
            }
        }
        dense.rows.extend(rows);
    }

    /// The acceleration of a body's point as coefficients and known part.
    fn point(&self, body: Option<usize>, at: V, i: usize, k: usize) -> (Vec<(usize, f64)>, f64) {
        let Some(b) = body else { return (vec![], 0.0) };
        let own = self.motion(&self.study.bodies[b], k);
        let arm = at - own.origin;
        let mut row = vec![(Dense::origin(b, i), 1.0)];
        row.extend((0..3).map(|c| (Dense::alpha(b, c), unit(c).cross(&arm)[i])));
        (row, own.spin.cross(&own.spin.cross(&arm))[i])
    }

    /// The child moves as the joint lets it; what the joint transmits does on its freedom what elements there do.
    fn carried(&self, dense: &mut Dense, j: usize, passage: &Passage, number: usize, k: usize) {
        let joint = &self.study.joints[j];
        let (start, end) = (self.end(&joint.parent, k).1, self.end(&joint.child, k).1);
        for i in 0..3 {
            let mut turning: Vec<(usize, f64)> = Vec::new();
            turning.extend(joint.child.body.map(|b| (Dense::alpha(b, i), 1.0)));
            turning.extend(joint.parent.body.map(|b| (Dense::alpha(b, i), -1.0)));
            turning.extend(passage.free.iter().enumerate().map(|(n, free)| (dense.second(number + n), -free.0[i])));
            dense.rows.push((turning, passage.alpha[i]));
            let (mut row, known) = self.point(joint.child.body, end, i, k);
            let (parent, _) = self.point(joint.parent.body, start, i, k);
            row.extend(parent.into_iter().map(|(column, value)| (column, -value)));
            if let Some(b) = joint.parent.body {
                row.extend((0..3).map(|c| (Dense::alpha(b, c), -unit(c).cross(&passage.arm)[i])));
            }
            row.extend(passage.free.iter().enumerate().map(|(n, free)| (dense.second(number + n), -free.1[i])));
            dense.rows.push((row, passage.acceleration[i] - known));
        }
        let axes: Vec<usize> = (0..joint.axes.len()).filter(|&at| joint.axes[at].prescribed.is_none()).collect();
        for (n, free) in passage.free.iter().enumerate() {
            let mut row: Vec<(usize, f64)> = (0..3).map(|c| (dense.force(j, c), free.1[c])).collect();
            row.extend((0..3).map(|c| (dense.moment(j, c), free.0[c])));
            let own = |at: usize| {
                let here = |f: &&ident::study::Force| matches!(f.place, ForcePlace::Joint { joint, axis } if joint == j && axis == at);
                self.study.forces.iter().filter(here).map(|f| self.scalar(&format!("{}.load", f.name), k)).sum::<f64>()
            };
            dense.rows.push((row, axes.get(n).map_or(0.0, |&at| own(at))));
        }
    }

    /// A rod keeps its length and transmits a force along itself.
    fn rod(&self, dense: &mut Dense, j: usize, passage: &Passage, k: usize) {
        let joint = &self.study.joints[j];
        let (start, end) = (self.end(&joint.parent, k).1, self.end(&joint.child, k).1);
        let speed = |body: Option<usize>, at: V| {
            body.map_or(V::zeros(), |b| {
                let own = self.motion(&self.study.bodies[b], k);
                own.origin_velocity + own.spin.cross(&(at - own.origin))
            })
        };
        let relative = speed(joint.child.body, end) - speed(joint.parent.body, start);
        let (mut row, mut known) = (Vec::new(), relative.norm_squared());
        for i in 0..3 {
            for (sign, (part, constant)) in
                [(1.0, self.point(joint.child.body, end, i, k)), (-1.0, self.point(joint.parent.body, start, i, k))]
            {
                row.extend(part.into_iter().map(|(column, value)| (column, sign * passage.arm[i] * value)));
                known += sign * passage.arm[i] * constant;
            }
            dense.rows.push((vec![(dense.moment(j, i), 1.0)], 0.0));
        }
        dense.rows.push((row, -known));
        let helper = unit(passage.arm.iamin());
        let first = passage.arm.cross(&helper);
        for across in [first, passage.arm.cross(&first)] {
            dense.rows.push(((0..3).map(|c| (dense.force(j, c), across[c])).collect(), 0.0));
        }
    }

    /// The child's velocities follow from the joints', too.
    fn velocity_gap(&self, k: usize) -> f64 {
        let gap = |joint: &Joint| {
            let passage = self.passage(joint, k);
            let end = self.end(&joint.child, k).1;
            let (spin, velocity) = joint.child.body.map_or((V::zeros(), V::zeros()), |b| {
                let own = self.motion(&self.study.bodies[b], k);
                (own.spin, own.origin_velocity + own.spin.cross(&(end - own.origin)))
            });
            (passage.spin - spin).amax().max((passage.velocity - velocity).amax())
        };
        self.study.joints.iter().filter(|joint| joint.kind != JointKind::Distance).map(gap).fold(0.0, f64::max)
    }
}

const STATES: usize = 12;

#[track_caller]
fn prove(name: &str, text: &str) {
    let head = format!("study {name}\ngravity = 9.81 m/s^2 along (0.1, 0.2, -1)\n{text}");
    let study = checked(&format!("{head}{}", measures(&head)), &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let system = derive(&study).unwrap_or_else(|findings| panic!("{findings:?}"));
    assert!(system.warnings.iter().all(|w| w.code.text != "E0309"), "{name} is redundant: {:?}", system.warnings);
    let constrained = Constrained::new(system);
    assert!(constrained.count() > 0, "{name} has loops");
    let outputs: Vec<Node> = constrained.system.outputs.iter().map(|output| output.value).collect();
    let mut chance = Chance(name.len() as u64);
    let mut mechanism = Mechanism::still(study);
    let times: Vec<f64> = (0..STATES)
        .map(|_| {
            let values = constrained.state(&mut chance);
            let shown = constrained.evaluate(&outputs, &values);
            for (output, value) in constrained.system.outputs.iter().zip(shown.iter()) {
                mechanism.channels.entry(output.name.clone()).or_default().push(*value);
            }
            values[&constrained.system.time]
        })
        .collect();
    mechanism.times = times;
    let (mut gap, mut motion, mut loads) = (0.0_f64, (0.0_f64, 0.0_f64), (0.0_f64, 0.0_f64));
    for k in 0..STATES {
        for joint in &mechanism.study.joints {
            gap = gap.max(mechanism.joint(joint, k).0.abs());
        }
        gap = gap.max(mechanism.velocity_gap(k));
        let [m, l] = mechanism.against_single_bodies(k);
        motion = (motion.0.max(m.0), motion.1.max(m.1));
        loads = (loads.0.max(l.0), loads.1.max(l.1));
    }
    println!(
        "{name}: gaps {gap:.1e}, accelerations {:.1e} of {:.1e}, reactions {:.1e} of {:.1e}",
        motion.0, motion.1, loads.0, loads.1
    );
    assert!(gap < 1e-9, "{name}: joints are off by {gap:.1e}");
    assert!(motion.0 < 1e-8 * motion.1, "{name}: accelerations differ by {:.1e} of {:.1e}", motion.0, motion.1);
    assert!(loads.0 < 1e-8 * loads.1, "{name}: reactions differ by {:.1e} of {:.1e}", loads.0, loads.1);
}

/// Six legs, each a universal joint, a slide with spring and damper, and a ball at the platform.
#[test]
fn stewart_platform() {
    let (mut ground, mut plate, mut rest) = (String::new(), String::new(), String::new());
    for leg in 0..6 {
        let angle = |offset: f64| (60.0 * f64::from(leg) + if leg % 2 == 0 { offset } else { -offset }).to_radians();
        let (low, high) = (angle(20.0), angle(-15.0));
        let foot = V::new(low.cos(), low.sin(), 0.0);
        let head = V::new(0.6 * high.cos(), 0.6 * high.sin(), 0.9);
        let way = head - foot;
        let direction = way.normalize();
        // The leg's z axis along it: turned about x, then about the turned y.
        let (about_x, about_y) = ((-direction.y).atan2(direction.z), direction.x.asin());
        ground += &format!(", point f{leg} = ({} m, {} m, 0 m)", foot.x, foot.y);
        plate += &format!(", point h{leg} = ({} m, {} m, 0 m)", head.x, head.y);
        let half = way.norm() / 2.0;
        rest += &format!(
            "body lower{leg} {{ mass = 3 kg, inertia = (0.1, 0.1, 0.01 kg*m^2), centre_of_gravity = (0.01 m, 0 m, 0.2 m), point top = (0 m, 0 m, {half} m) }}
             body upper{leg} {{ mass = 2 kg, inertia = (0.1, 0.12, 0.01, 0.002, 0, 0.001 kg*m^2), centre_of_gravity = (0 m, 0.01 m, 0.15 m), point tip = (0 m, 0 m, {half} m) }}
             joint foot{leg}: universal(x, y) ground.f{leg} -> lower{leg} {{ orientation = ({about_x}, {about_y}, 0) }}
             joint slide{leg}: prismatic(z) lower{leg}.top -> upper{leg}
             joint ball{leg}: spherical upper{leg}.tip -> plate.h{leg} {{ orientation = ({}, {}, {}) }}
             force spring{leg}: leg_spring on slide{leg}\n",
            // The plate is parallel to the ground: the leg's turns backwards, as angles about x, y, z.
            inverse(about_x, about_y).0,
            inverse(about_x, about_y).1,
            inverse(about_x, about_y).2,
        );
    }
    let ground = ground.trim_start_matches(", ");
    prove(
        "stewart",
        &format!(
            "body ground {{ {ground} }}\nbody plate {{ mass = 20 kg, inertia = (1, 1.1, 2, 0.05, 0.02, -0.03 kg*m^2), centre_of_gravity = (0.02 m, -0.01 m, 0.03 m){plate} }}
             law leg_spring(x: length, v: velocity) -> force {{ = -8 kN/m * x - 200 N*s/m * v }}\n{rest}"
        ),
    );
}

/// Angles about x, the turned y and the turned z of the inverse of turns about x and the turned y.
fn inverse(about_x: f64, about_y: f64) -> (f64, f64, f64) {
    let turn = nalgebra::Rotation3::new(V::x() * about_x) * nalgebra::Rotation3::new(V::y() * about_y);
    let m: M = turn.inverse().into_inner();
    ((-m[(1, 2)]).atan2(m[(2, 2)]), m[(0, 2)].asin(), (-m[(0, 1)]).atan2(m[(0, 0)]))
}

#[test]
fn spatial_four_bar_with_balls() {
    prove(
        "rssr",
        "body ground { point far = (0.5 m, 0.3 m, 0 m), point above = (0 m, 0 m, 1 m) }
         body crank { mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }
         body coupler { mass = 2 kg, inertia = (0.01, 0.05, 0.05 kg*m^2), centre_of_gravity = (0.3 m, 0 m, 0.02 m), point tip = (0.6 m, 0 m, 0 m) }
         body rocker { mass = 1.5 kg, inertia = 0.02 kg*m^2, point tip = (0 m, 0 m, 0.4 m) }
         joint motor: revolute(z) ground -> crank
         joint near: spherical crank.tip -> coupler
         joint foot: revolute(y) ground.far -> rocker
         joint head: spherical coupler.tip -> rocker.tip
         law linear(x: length, v: velocity) -> force { = -500 N/m * x - 20 N*s/m * v }
         force strut: linear ground.above -> coupler.tip { free_length = 0.5 m }\n",
    );
}

#[test]
fn suspension_on_rods() {
    prove("wishbone", &suspension("(0.01 m, 0.02 m, 0 m)"));
}

/// A chain of five single joints, closed by joints of every kind, in either sense.
#[test]
fn chains_closed_by_every_kind_of_joint() {
    let link = |name: &str| {
        format!(
            "body {name} {{ mass = 1 kg, inertia = (0.02, 0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, 0.05 m, 0 m), point tip = (0.4 m, 0 m, 0 m) }}\n"
        )
    };
    for (number, kind) in [
        "axes(turn z, shift x)",
        "cylindrical(x)",
        "universal(x, y)",
        "planar(z)",
        "spherical",
        "axes(shift x, turn z, shift y)",
        "axes(shift x, turn z, turn y)",
        "axes(turn y, turn z, shift (0.6, 0, 0.8))",
        "axes(shift x, shift (0.6, 0.8, 0), turn z, turn (0, 1, 1))",
    ]
    .iter()
    .enumerate()
    {
        for (way, ends) in [("out", "arm.tip -> slider"), ("in", "slider -> arm.tip")] {
            let text = format!(
                "{}body ground {{ point rail = (0.35 m, -0.1 m, 0.05 m) }}
                 joint hinge: revolute(z) ground -> first
                 joint tilt: revolute(y) first -> arm
                 joint rail: prismatic(1, 0.1, 0) ground.rail -> run
                 joint roll: revolute(x) run -> third {{ orientation = (5 deg, 0 deg, 10 deg) }}
                 joint nod: universal((0, 1, 0.2), z) third -> slider
                 joint pin: {kind} {ends} {{ orientation = (10 deg, 0 deg, 20 deg) }}\n",
                ["first", "arm", "run", "third", "slider"].map(link).concat()
            );
            prove(&format!("chain_{number}_{way}"), &text);
        }
    }
}
