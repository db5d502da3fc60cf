//! Mechanisms of every kind of joint, with and without loops, against Newton and Euler in absolute coordinates: at
//! every sample of a motion the bodies' accelerations balance gravity, elements and reactions, reactions do on the
//! freedom of their joints what elements there do, the joints' coordinates put the child where it is, prescribed ones
//! are what they shall be, and accelerations are the derivatives of velocities. Together these determine the motion and
//! all reactions; nothing of the product's formalism is used.

mod closing;
mod loops;
mod trees;

use crate::run::{Channels, checked, run};
use ident::expression::Node;
use ident::study::{Attachment, AxisMotion, Body, ForcePlace, Joint, JointKind, Study};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

pub use loops::suspension;

pub type V = Vector3<f64>;
pub type M = Matrix3<f64>;

/// Motion of a body at one sample, ground axes.
pub struct Motion {
    pub axes: M,
    pub origin: V,
    pub origin_velocity: V,
    pub origin_acceleration: V,
    pub centre: V,
    velocity: V,
    acceleration: V,
    pub spin: V,
    pub spin_rate: V,
}

pub struct Mechanism {
    pub study: Study,
    pub channels: Channels,
    /// Of the samples.
    pub times: Vec<f64>,
}

const STILL: &str = "position velocity acceleration angular_velocity angular_acceleration axis_x axis_y axis_z";

/// Measures of everything that the balance needs, as text.
pub fn measures(text: &str) -> String {
    let bare = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let mut lines = String::new();
    let mut all = |prefix: &str, path: &str, unit: &str| {
        for axis in ["x", "y", "z"] {
            lines += &format!("measure {prefix}_{axis} [{unit}] = {path}.{axis}\n");
        }
    };
    for body in &bare.bodies {
        let name = &body.name;
        for (word, unit) in STILL.split(' ').zip(["m", "m/s", "m/s^2", "rad/s", "rad/s^2", "1", "1", "1"]) {
            all(&format!("{name}_{word}"), &format!("{name}.{word}"), unit);
        }
        for (word, unit) in [("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2")] {
            all(&format!("{name}_c_{word}"), &format!("{name}.centre_of_gravity.{word}"), unit);
        }
    }
    for joint in &bare.joints {
        let name = &joint.name;
        all(&format!("{name}_force"), &format!("{name}.reaction.force"), "N");
        all(&format!("{name}_moment"), &format!("{name}.reaction.moment"), "N*m");
    }
    for axis in bare.joints.iter().flat_map(|joint| &joint.axes) {
        let (name, unit) = (&axis.name, if matches!(axis.motion, AxisMotion::Turn(_)) { "rad" } else { "m" });
        for (word, per) in [("position", ""), ("velocity", "/s"), ("acceleration", "/s^2")] {
            lines += &format!("measure {}_{word} [{unit}{per}] = {name}.{word}\n", name.replace('.', "_"));
        }
    }
    for joint in bare.joints.iter().filter(|joint| joint.rotation.is_some()) {
        let name = &joint.name;
        lines += &format!("measure {name}_quaternion_w = {name}.quaternion.w\n");
        for (word, unit) in [("quaternion", "1"), ("angular_velocity", "rad/s"), ("angular_acceleration", "rad/s^2")] {
            for axis in ["x", "y", "z"] {
                lines += &format!("measure {name}_{word}_{axis} [{unit}] = {name}.{word}.{axis}\n");
            }
        }
    }
    for force in &bare.forces {
        let turns = |joint: usize, axis: usize| matches!(bare.joints[joint].axes[axis].motion, AxisMotion::Turn(_));
        let (unit, word) = match force.place {
            ForcePlace::Joint { joint, axis } if turns(joint, axis) => ("N*m", "torque"),
            _ => ("N", "force"),
        };
        lines += &format!("measure {0}_load [{unit}] = {0}.{word}\n", force.name);
    }
    lines
}

impl Mechanism {
    fn run(text: &str) -> Self {
        let text = format!("{text}{}criterion c = max(t / 1 s) in go\nsolver {{ tolerance = 1e-9 }}\n", measures(text));
        let study = checked(&text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
        let channels = run(&text, &[]).remove(0);
        let samples = channels.values().next().map_or(0, Vec::len);
        let times = (0..samples).map(|k| k as f64 * study.manoeuvres[0].step).collect();
        Self { study, channels, times }
    }

    /// Without any samples yet.
    pub fn still(study: Study) -> Self {
        Self { study, channels: Channels::new(), times: vec![] }
    }

    fn samples(&self) -> usize {
        self.channels.values().next().map_or(0, Vec::len)
    }

    pub fn value(&self, node: Node) -> f64 {
        self.study.graph.constant_value(node).expect("numbers only")
    }

    pub fn vector(&self, nodes: [Node; 3]) -> V {
        V::from(nodes.map(|node| self.value(node)))
    }

    pub fn three(&self, prefix: &str, sample: usize) -> V {
        V::from(["x", "y", "z"].map(|axis| self.channels[&format!("{prefix}_{axis}")][sample]))
    }

    pub fn motion(&self, body: &Body, k: usize) -> Motion {
        let own = |word: &str| self.three(&format!("{}_{word}", body.name), k);
        Motion {
            axes: M::from_columns(&[own("axis_x"), own("axis_y"), own("axis_z")]),
            origin: own("position"),
            origin_velocity: own("velocity"),
            origin_acceleration: own("acceleration"),
            centre: own("c_position"),
            velocity: own("c_velocity"),
            acceleration: own("c_acceleration"),
            spin: own("angular_velocity"),
            spin_rate: own("angular_acceleration"),
        }
    }

    pub fn inertia(&self, body: &Body, axes: M) -> M {
        let [xx, yy, zz, xy, xz, yz] = body.inertia.map(|node| self.value(node));
        axes * M::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * axes.transpose()
    }

    /// Axes and place of a joint's end.
    pub fn end(&self, end: &Attachment, k: usize) -> (M, V) {
        let place = self.vector(end.position);
        match end.body {
            None => (M::identity(), place),
            Some(body) => {
                let motion = self.motion(&self.study.bodies[body], k);
                (motion.axes, motion.origin + motion.axes * place)
            }
        }
    }

    /// Residuals of force and moment of every body.
    fn unbalanced(&self, k: usize) -> f64 {
        let mut rest: Vec<(V, V)> = Vec::new();
        for body in &self.study.bodies {
            let motion = self.motion(body, k);
            let gravity = self.vector(self.study.gravity);
            let inertia = self.inertia(body, motion.axes);
            let force = self.value(body.mass) * (motion.acceleration - gravity);
            rest.push((force, inertia * motion.spin_rate + motion.spin.cross(&(inertia * motion.spin))));
        }
        let mut push = |body: Option<usize>, force: V, moment: V, at: V| {
            if let Some(body) = body {
                let arm = at - self.motion(&self.study.bodies[body], k).centre;
                rest[body].0 -= force;
                rest[body].1 -= moment + arm.cross(&force);
            }
        };
        for joint in &self.study.joints {
            let (force, moment) = self.reaction(joint, k);
            let at = self.end(&joint.child, k).1;
            push(joint.child.body, force, moment, at);
            push(joint.parent.body, -force, -moment, at);
        }
        for element in &self.study.forces {
            // What stands on a joint belongs to what the joint transmits.
            let (first, second) = match &element.place {
                ForcePlace::Joint { .. } => continue,
                ForcePlace::Between { first, second, along: None, .. } => (first, second),
                place => panic!("elements on joints or between points only: {place:?}"),
            };
            let (a, b) = (self.end(first, k).1, self.end(second, k).1);
            let force = self.channels[&format!("{}_load", element.name)][k] * (b - a).normalize();
            push(second.body, force, V::zeros(), b);
            push(first.body, -force, V::zeros(), a);
        }
        rest.iter().map(|(force, moment)| force.amax().max(moment.amax())).fold(0.0, f64::max)
    }

    pub fn reaction(&self, joint: &Joint, k: usize) -> (V, V) {
        (self.three(&format!("{}_force", joint.name), k), self.three(&format!("{}_moment", joint.name), k))
    }

    pub fn scalar(&self, path: &str, k: usize) -> f64 {
        self.channels[&path.replace('.', "_")][k]
    }

    /// How far a joint is from its definition (m, 1), and what its reaction does on its free motions beside the
    /// elements there (N, N m).
    pub fn joint(&self, joint: &Joint, k: usize) -> (f64, f64) {
        let ((parent, at_parent), (child, at_child)) = (self.end(&joint.parent, k), self.end(&joint.child, k));
        let (force, moment) = self.reaction(joint, k);
        if joint.kind == JointKind::Distance {
            let distance = at_child - at_parent;
            let length = self.value(joint.length.expect("a length"));
            let across = force - distance * (force.dot(&distance) / distance.norm_squared());
            return (distance.norm() - length, across.amax().max(moment.amax()));
        }
        // From the parent to the child, one motion after the other.
        let (mut axes, mut place) = (parent, at_parent);
        let (mut error, mut work) = (0.0_f64, 0.0_f64);
        let number = self.study.joints.iter().position(|other| other.name == joint.name);
        for (at, axis) in joint.axes.iter().enumerate() {
            let coordinate = self.scalar(&format!("{}.position", axis.name), k);
            let way = axes * V::from(axis.motion.direction());
            let on_axis = match axis.motion {
                AxisMotion::Shift(_) => force.dot(&way),
                AxisMotion::Turn(_) => moment.dot(&way) + force.dot(&way.cross(&(at_child - place))),
            };
            match axis.motion {
                AxisMotion::Shift(_) => place += way * coordinate,
                AxisMotion::Turn(_) => axes = Rotation3::new(way * coordinate) * axes,
            }
            match axis.prescribed {
                Some(meant) => {
                    let known = |symbol| if symbol == self.study.time { self.times[k] } else { f64::NAN };
                    let meant = self.study.graph.evaluate(&[meant], known, |_, _, _| f64::NAN)[0];
                    let turn = std::f64::consts::TAU;
                    let apart = coordinate - meant;
                    let turns = if matches!(axis.motion, AxisMotion::Turn(_)) { (apart / turn).round() } else { 0.0 };
                    error = error.max((apart - turns * turn).abs());
                }
                None => {
                    let own = |f: &&ident::study::Force| matches!(f.place, ForcePlace::Joint { joint: j, axis: a } if Some(j) == number && a == at);
                    let load: f64 =
                        self.study.forces.iter().filter(own).map(|f| self.scalar(&format!("{}.load", f.name), k)).sum();
                    work = work.max((on_axis - load).abs());
                }
            }
        }
        if let Some(rows) = joint.orientation {
            let rows = rows.map(|row| self.vector(row));
            axes *= M::from_rows(&rows.map(|row| row.transpose()));
        }
        if joint.rotation.is_some() {
            let [w, x, y, z] =
                ["w", "x", "y", "z"].map(|part| self.scalar(&format!("{}.quaternion.{part}", joint.name), k));
            axes *= UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
            let at = self.motion_of(joint.child.body, k).0 - self.motion_of(joint.parent.body, k).0;
            let spin = child.transpose() * at;
            error = error.max((spin - self.three(&format!("{}_angular_velocity", joint.name), k)).amax());
            work = work.max(moment.amax());
        }
        error = error.max((place - at_child).amax()).max((axes - child).amax());
        (error, work)
    }

    /// Angular velocity and acceleration, zero for ground.
    fn motion_of(&self, body: Option<usize>, k: usize) -> (V, V) {
        body.map_or((V::zeros(), V::zeros()), |body| {
            let motion = self.motion(&self.study.bodies[body], k);
            (motion.spin, motion.spin_rate)
        })
    }

    fn energy(&self, k: usize) -> f64 {
        let of_body = |body: &Body| {
            let motion = self.motion(body, k);
            let inertia = self.inertia(body, motion.axes);
            let mass = self.value(body.mass);
            0.5 * mass * motion.velocity.norm_squared() + 0.5 * motion.spin.dot(&(inertia * motion.spin))
                - mass * self.vector(self.study.gravity).dot(&motion.centre)
        };
        self.study.bodies.iter().map(of_body).sum()
    }

    /// Largest force or moment of a joint, at least 1.
    fn load(&self) -> f64 {
        let sizes = self.study.joints.iter().flat_map(|joint| (0..self.samples()).map(move |k| (joint, k)));
        sizes.map(|(joint, k)| self.reaction(joint, k)).map(|(f, m)| f.amax().max(m.amax())).fold(1.0, f64::max)
    }
}

/// All of it, with the accuracy of positions (m, 1).
#[track_caller]
fn prove(name: &str, text: &str, closed: f64) {
    let mechanism = Mechanism::run(&format!("study {name}\ngravity = 9.81 m/s^2 along (0.1, 0.2, -1)\n{text}"));
    let load = mechanism.load();
    let (mut unbalanced, mut error, mut work) = (0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..mechanism.samples() {
        unbalanced = unbalanced.max(mechanism.unbalanced(k));
        for joint in &mechanism.study.joints {
            let (gap, power) = mechanism.joint(joint, k);
            assert!(gap.abs() < closed, "{name}: joint {} is off by {gap:.1e} at sample {k}", joint.name);
            error = error.max(gap.abs());
            assert!(power < 1e-6 * load, "{name}: {} works on its freedom, {power:.1e} of {load:.1e}", joint.name);
            work = work.max(power);
        }
    }
    println!("{name}: loads {load:.1e}, unbalanced {unbalanced:.1e}, gaps {error:.1e}, work {work:.1e}");
    assert!(unbalanced < 1e-6 * load, "{name}: {unbalanced:.1e} of {load:.1e} is not balanced");
    let driven = mechanism.study.joints.iter().flat_map(|joint| &joint.axes).any(|axis| axis.prescribed.is_some());
    if !driven && mechanism.study.forces.is_empty() {
        let energies: Vec<f64> = (0..mechanism.samples()).map(|k| mechanism.energy(k)).collect();
        let drift = crate::run::drift(&energies);
        assert!(drift < 1e-5, "{name}: the energy drifts by {drift:.1e}");
    }
    derivatives(name, &mechanism);
    derivatives_of_coordinates(name, &mechanism);
}

/// Velocities and accelerations are derivatives: over each step of the samples by Simpson's rule on pairs of steps.
#[track_caller]
fn derivatives(name: &str, mechanism: &Mechanism) {
    let step = mechanism.study.manoeuvres[0].step;
    for body in &mechanism.study.bodies {
        let at: Vec<Motion> = (0..mechanism.samples()).map(|k| mechanism.motion(body, k)).collect();
        for three in at.windows(3) {
            let simpson =
                |of: &dyn Fn(&Motion) -> V| (of(&three[0]) + 4.0 * of(&three[1]) + of(&three[2])) * (step / 3.0);
            let largest = |of: &dyn Fn(&Motion) -> V| three.iter().map(|m| of(m).amax()).fold(0.0, f64::max);
            let check = |what: &str, change: V, rate: &dyn Fn(&Motion) -> V| {
                let rest = (change - simpson(rate)).amax();
                let allowed = 1e-7 + 2e-3 * largest(rate) * 2.0 * step;
                assert!(rest < allowed, "{name}: the {what} of {} is no derivative: {rest:.1e}", body.name);
            };
            check("velocity", three[2].centre - three[0].centre, &|m| m.velocity);
            check("acceleration", three[2].velocity - three[0].velocity, &|m| m.acceleration);
            check("angular acceleration", three[2].spin - three[0].spin, &|m| m.spin_rate);
        }
    }
}

/// The same for the coordinates of joints.
#[track_caller]
fn derivatives_of_coordinates(name: &str, mechanism: &Mechanism) {
    let step = mechanism.study.manoeuvres[0].step;
    let axes = mechanism.study.joints.iter().flat_map(|joint| &joint.axes).map(|axis| axis.name.replace('.', "_"));
    let mut pairs: Vec<(String, String)> = axes
        .flat_map(|axis| ["position velocity", "velocity acceleration"].map(|pair| (axis.clone(), pair)))
        .map(|(axis, pair)| {
            pair.split_once(' ').map(|(of, rate)| (format!("{axis}_{of}"), format!("{axis}_{rate}"))).expect("a pair")
        })
        .collect();
    for joint in mechanism.study.joints.iter().filter(|joint| joint.rotation.is_some()) {
        let word = |word: &str, axis: &str| format!("{}_angular_{word}_{axis}", joint.name);
        pairs.extend(["x", "y", "z"].map(|axis| (word("velocity", axis), word("acceleration", axis))));
    }
    for (of, rate) in pairs {
        let (values, rates) = (&mechanism.channels[&of], &mechanism.channels[&rate]);
        for (three, slopes) in values.windows(3).zip(rates.windows(3)) {
            let simpson = (slopes[0] + 4.0 * slopes[1] + slopes[2]) * (step / 3.0);
            let largest = slopes.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            // Angles that are read off jump by a turn.
            let turn = std::f64::consts::TAU;
            let apart = three[2] - three[0] - simpson;
            let rest = (apart - turn * (apart / turn).round()).abs();
            assert!(rest < 1e-7 + 2e-3 * largest * 2.0 * step, "{name}: {rate} is not the derivative: {rest:.1e}");
        }
    }
}

const HOLDING: &str =
    "law holding(x: coordinate, v: rate, gain: load/coordinate) -> load { = -gain * x - gain * 0.1 s * v }\n";
const GO: &str = "manoeuvre go { for 200 ms, step = 2 ms, start = rest";
