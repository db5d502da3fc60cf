//! Mechanisms of every kind of joint, with and without loops, against Newton and Euler in absolute coordinates: at every sample of
//! a motion the bodies' accelerations balance gravity, elements and reactions, reactions do on the freedom of their joints what
//! elements there do, the joints' coordinates put the child where it is, prescribed ones are what they shall be, and accelerations
//! are the derivatives of velocities. Together these
//! determine the motion and all reactions; nothing of the product's formalism is used.

use crate::run::{Channels, checked, run};
use ident::expression::Node;
use ident::study::{Attachment, AxisMotion, Body, ForcePlace, Joint, JointKind, Study};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

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

    /// How far a joint is from its definition (m, 1), and what its reaction does on its free motions beside the elements
    /// there (N, N m).
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

#[test]
fn trees_of_every_kind_of_joint() {
    let body = |name: &str| {
        format!(
            "body {name} {{ mass = 1.5 kg, inertia = (0.3, 0.4, 0.5, 0.02, -0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, -0.2 m, 0.15 m), point tip = (0.3 m, 0.1 m, -0.2 m) }}\n"
        )
    };
    let joints = [
        (
            "universal(x, z)",
            "{ orientation = (20 deg, 30 deg, -50 deg) }",
            "turn_x.velocity = 2 rad/s, j.turn_z.velocity = -1 rad/s",
        ),
        (
            "cylindrical(0, 0.6, 0.8)",
            "{ orientation = (10 deg, -40 deg, 5 deg) }",
            "turn_2.velocity = 3 rad/s, j.shift_1.velocity = 0.4 m/s",
        ),
        ("planar(0.6, 0, 0.8)", "", "turn_3.velocity = 3 rad/s, j.shift_1.velocity = -0.5 m/s"),
        (
            "spherical",
            "{ orientation = (0 deg, 70 deg, 0 deg) }",
            "angular_velocity.x = 3 rad/s, j.angular_velocity.z = 1 rad/s",
        ),
        ("free", "", "angular_velocity.y = 3 rad/s, j.shift_z.velocity = 1 m/s"),
        ("axes(shift (0, 0.6, 0.8), turn z, turn x)", "", "turn_x.velocity = 2 rad/s, j.turn_z.velocity = 1 rad/s"),
        (
            "axes(turn (0.6, 0, 0.8), shift y)",
            "{ orientation = (0 deg, 0 deg, 30 deg) }",
            "turn_1.velocity = 2 rad/s, j.shift_y.velocity = 1 m/s",
        ),
        // Euler angles; the third has a name of its own.
        (
            "axes(turn z, turn x, turn z)",
            "{ orientation = (5 deg, 0 deg, 0 deg) }",
            "turn_x.position = 0.9, j.turn_z.velocity = 1 rad/s, j.turn_3.velocity = -2 rad/s",
        ),
        (
            "cylindrical(z)",
            "{ motion = { turn_z = 3 rad/s * t + 0.2 * sin(8 rad/s * t) } }",
            "shift_z.velocity = 0.4 m/s",
        ),
    ];
    for (number, (kind, fields, start)) in joints.iter().enumerate() {
        for is_reversed in [false, true] {
            let ends = if is_reversed { "outer.tip -> inner.tip" } else { "inner.tip -> outer.tip" };
            let head = format!(
                "{}{}joint root: revolute(0, 0.6, 0.8) ground -> inner\njoint j: {kind} {ends} {fields}\n",
                body("inner"),
                body("outer"),
            );
            let start = format!("{GO} {{ root.velocity = 2.5 rad/s, j.{start} }} }}\n");
            prove(&format!("tree_{number}_{is_reversed}"), &format!("{head}{start}"), 1e-9);
            let study = checked(&format!("study s\n{head}"), &[]).unwrap_or_else(|findings| panic!("{findings}"));
            let elements: String = study.joints[1]
                .axes
                .iter()
                .enumerate()
                .map(|(at, axis)| {
                    let gain = if matches!(axis.motion, AxisMotion::Turn(_)) { "9 N*m" } else { "400 N/m" };
                    format!("force on_{at}: holding on {} {{ gain = {gain} }}\n", axis.name)
                })
                .collect();
            if !elements.is_empty() {
                prove(&format!("held_{number}_{is_reversed}"), &format!("{head}{HOLDING}{elements}{start}"), 1e-9);
            }
        }
    }
}

/// Every coordinate of every kind of joint may follow a prescribed motion, walked outwards and inwards, bodies turned.
#[test]
fn every_coordinate_of_a_tree_may_be_driven() {
    let body = |name: &str| {
        format!(
            "body {name} {{ mass = 1.5 kg, inertia = (0.3, 0.4, 0.5, 0.02, -0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, -0.2 m, 0.15 m), point tip = (0.3 m, 0.1 m, -0.2 m) }}\n"
        )
    };
    let kinds = [
        ("prismatic(0, 0.6, 0.8)", "orientation = (0 deg, 40 deg, 0 deg)"),
        ("revolute(0.6, 0, 0.8)", "orientation = (10 deg, 0 deg, 0 deg)"),
        ("cylindrical(x)", ""),
        ("universal(x, z)", "orientation = (20 deg, 30 deg, -50 deg)"),
        ("planar(y)", "orientation = (0 deg, 0 deg, 25 deg)"),
        ("axes(turn x, shift y, turn z)", ""),
        ("free", "orientation = (0 deg, 70 deg, 0 deg)"),
    ];
    for (kind, fields) in kinds {
        for ends in ["inner.tip -> outer.tip", "outer.tip -> inner.tip"] {
            let bodies = body("inner") + &body("outer") + "joint root: revolute(0, 0.6, 0.8) ground -> inner\n";
            let bare = checked(&format!("study s\n{bodies}joint j: {kind} {ends}\n"), &[]).expect("a study");
            let axes = &bare.joints[1].axes;
            for axis in axes {
                let size = if matches!(axis.motion, AxisMotion::Turn(_)) { "0.4" } else { "0.1 m" };
                let motion = format!("{size} * sin(9 rad/s * t + 0.3) + {size} * t / 1 s");
                let motion = match axis.name.strip_prefix("j.") {
                    Some(name) if axes.len() > 1 => format!("{{ {name} = {motion} }}"),
                    _ => motion,
                };
                let text = format!(
                    "{bodies}joint j: {kind} {ends} {{ motion = {motion}, {fields} }}\n{GO} {{ root.velocity = 2 rad/s }} }}\n"
                );
                prove(
                    &format!("driven {kind} {ends} {}", axis.name)
                        .replace(' ', "_")
                        .replace(|c: char| !c.is_alphanumeric(), "_"),
                    &text,
                    1e-9,
                );
            }
        }
    }
}

#[test]
fn spatial_four_bar_with_balls() {
    let text = format!(
        "body ground {{ point far = (0.5 m, 0.3 m, 0 m), point above = (0 m, 0 m, 1 m) }}
         body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }}
         body coupler {{ mass = 2 kg, inertia = (0.01, 0.05, 0.05 kg*m^2), centre_of_gravity = (0.3 m, 0 m, 0.02 m), point tip = (0.6 m, 0 m, 0 m) }}
         body rocker {{ mass = 1.5 kg, inertia = 0.02 kg*m^2, point tip = (0 m, 0 m, 0.4 m) }}
         joint motor: revolute(z) ground -> crank
         joint near: spherical crank.tip -> coupler
         joint foot: revolute(y) ground.far -> rocker
         joint head: spherical coupler.tip -> rocker.tip
         law linear(x: length, v: velocity) -> force {{ = -500 N/m * x - 20 N*s/m * v }}
         force strut: linear ground.above -> coupler.tip {{ free_length = 0.5 m }}
         {GO} {{ motor.velocity = 5 rad/s, near.angular_velocity.x = 8 rad/s }} }}\n"
    );
    prove("rssr", &text, 1e-8);
}

#[test]
fn slider_crank_on_universal_and_cylindrical_joints() {
    let text = format!(
        "body ground {{ point guide = (0.5 m, 0 m, 0.05 m) }}
         body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0 m, 0.1 m, 0 m) }}
         body rod {{ mass = 2 kg, inertia = (0.01, 0.05, 0.05 kg*m^2), centre_of_gravity = (0.25 m, 0 m, 0 m), point tip = (0.5 m, 0 m, 0 m) }}
         body slider {{ mass = 1.5 kg, inertia = 0.02 kg*m^2 }}
         joint motor: revolute(z) ground -> crank
         joint near: spherical crank.tip -> rod
         joint far: universal(y, z) rod.tip -> slider
         joint guide: cylindrical(x) ground.guide -> slider
         {GO} {{ motor.velocity = 10 rad/s }} }}\n"
    );
    prove("slider_crank", &text, 1e-8);
    let own =
        Mechanism::run(&format!("study s\ngravity = 9.81 m/s^2 along -z\n{text}measure angle = motor.position\n"));
    for k in 0..own.samples() {
        let angle = own.channels["angle"][k];
        let expected = -0.1 * angle.sin() + (0.25 - (0.1 * angle.cos()).powi(2) - 0.0025_f64).sqrt();
        assert!((own.channels["slider_position_x"][k] - expected).abs() < 1e-8);
    }
}

/// Three bodies on four hinges that are not parallel: by the count of freedoms it could not move.
fn bennett() -> String {
    let (alpha, beta) = (30.0_f64.to_radians(), (0.8 * 0.5_f64).asin());
    let axis = |angle: f64| format!("0, {}, {}", -angle.sin(), angle.cos());
    format!(
        "body ground {{ point far = (-0.8 m, 0 m, 0 m) }}
         body l1 {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (1 m, 0 m, 0 m) }}
         body l2 {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.8 m, 0 m, 0 m) }}
         body l3 {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (1 m, 0 m, 0 m) }}
         joint A: revolute(z) ground -> l1
         joint B: revolute({}) l1.tip -> l2 {{ orientation = (30 deg, 0 deg, 0 deg) }}
         joint C: revolute({}) l2.tip -> l3 {{ orientation = ({} deg, 0 deg, 0 deg) }}
         joint D: revolute({}) l3.tip -> ground.far {{ orientation = ({} deg, 0 deg, 0 deg) }}\n",
        axis(alpha),
        axis(beta),
        beta.to_degrees(),
        axis(alpha),
        (alpha + beta).to_degrees()
    )
}

#[test]
fn bennett_linkage_moves_and_names_what_is_redundant() {
    prove("bennett", &format!("{}{GO} {{ A.position = 1, A.velocity = 3 rad/s }} }}\n", bennett()), 1e-6);
    // Half angles of neighbouring hinges have a constant product of tangents.
    let text = format!(
        "study b\n{}measure a = A.position\nmeasure b = B.position\n{GO} {{ A.position = 1, A.velocity = 3 rad/s }} }}\ncriterion c = max(t / 1 s) in go\nsolver {{ tolerance = 1e-9 }}\n",
        bennett()
    );
    let own = &run(&text, &[])[0];
    let (alpha, beta) = (30.0_f64.to_radians(), (0.8 * 0.5_f64).asin());
    let constant = ((beta + alpha) / 2.0).sin() / ((beta - alpha) / 2.0).sin();
    for (a, b) in own["a"].iter().zip(&own["b"]) {
        let product = (a / 2.0).tan() * (b / 2.0).tan();
        assert!((product - constant).abs() < 1e-5 * constant.abs(), "{product} instead of {constant}");
    }
    let study = checked(&text, &[]).expect("a study");
    let warnings = ident::mechanics::derive(&study).expect("it moves").warnings;
    let [warning] = warnings.as_slice() else { panic!("one joint is redundant: {warnings:?}") };
    assert!(warning.message.contains("`D`") && warning.message.matches("about").count() >= 1, "{}", warning.message);
    // Five constraints of one hinge, three freedoms of the others, one is left: two are independent.
    assert_eq!(
        warning.message.split(':').nth(1).map(|held| held.split(" about ").count() + held.split(" along ").count() - 2),
        Some(3)
    );
}

/// An upright on five rods, carried by a free joint.
pub fn suspension(centre_of_gravity: &str) -> String {
    let length = 0.408_533_964_316_309_95;
    format!(
        "body ground {{ point a1 = (0.15 m, 0.3 m, 0.2 m), point a2 = (-0.15 m, 0.3 m, 0.2 m), point b1 = (0.15 m, 0.3 m, 0.45 m), point b2 = (-0.15 m, 0.3 m, 0.45 m), point tie = (0.15 m, 0.32 m, 0.25 m), point top = (0 m, 0.4 m, 0.8 m), point home = (0 m, 0.7 m, 0.3 m) }}
         body upright {{ mass = 20 kg, inertia = (0.5, 0.6, 0.5 kg*m^2), centre_of_gravity = {centre_of_gravity}, point low = (0 m, -0.02 m, -0.1 m), point up = (0 m, -0.02 m, 0.15 m), point tie = (0.15 m, -0.05 m, -0.05 m) }}
         joint float: free ground.home -> upright
         joint r1: distance ground.a1 -> upright.low {{ length = {length} m }}
         joint r2: distance ground.a2 -> upright.low {{ length = {length} m }}
         joint r3: distance ground.b1 -> upright.up {{ length = {length} m }}
         joint r4: distance ground.b2 -> upright.up {{ length = {length} m }}
         joint r5: distance ground.tie -> upright.tie {{ length = 0.33 m }}
         law linear(x: length, v: velocity) -> force {{ = -20 kN/m * x - 1 kN*s/m * v }}
         force strut: linear ground.top -> upright.low {{ free_length = 0.7 m }}\n"
    )
}

#[test]
fn double_wishbone_on_rods() {
    prove("wishbone", &format!("{}{GO} }}\n", suspension("(0 m, 0 m, 0 m)")), 1e-8);
}

/// Loops closed by joints of every kind that can: of one chain of five single joints.
#[test]
fn every_kind_of_joint_closes_a_loop() {
    let closing = [
        ("axes(turn z, shift x)", "arm.tip -> slider", ""),
        ("axes(turn z, shift x)", "slider -> arm.tip", "{ orientation = (0 deg, 10 deg, 20 deg) }"),
        ("cylindrical(x)", "arm.tip -> slider", ""),
        ("universal(x, y)", "slider -> arm.tip", "{ orientation = (10 deg, 0 deg, 30 deg) }"),
        ("planar(z)", "arm.tip -> slider", "{ orientation = (5 deg, 0 deg, 10 deg) }"),
        ("spherical", "slider -> arm.tip", ""),
        ("axes(shift x, turn z, turn y)", "slider -> arm.tip", "{ orientation = (0 deg, 0 deg, 20 deg) }"),
        ("axes(turn y, turn z, shift (0.6, 0, 0.8))", "slider -> arm.tip", ""),
        ("axes(shift x, shift (0.6, 0.8, 0), turn z, turn y)", "slider -> arm.tip", ""),
    ];
    let link = |name: &str| {
        format!(
            "body {name} {{ mass = 1 kg, inertia = (0.02, 0.03, 0.04 kg*m^2), centre_of_gravity = (0.1 m, 0.05 m, 0 m), point tip = (0.4 m, 0 m, 0 m) }}\n"
        )
    };
    for (number, (kind, ends, fields)) in closing.iter().enumerate() {
        let text = format!(
            "{}body ground {{ point rail = (0.35 m, -0.1 m, 0.05 m) }}
             joint hinge: revolute(z) ground -> first
             joint tilt: revolute(y) first -> arm
             joint rail: prismatic(1, 0.1, 0) ground.rail -> run
             joint roll: revolute(x) run -> third {{ orientation = (5 deg, 0 deg, 10 deg) }}
             joint nod: revolute(0, 1, 0.2) third -> slider
             joint pin: {kind} {ends} {fields}
             {GO} {{ hinge.velocity = 1 rad/s }} }}\n",
            ["first", "arm", "run", "third", "slider"].map(link).concat()
        );
        prove(&format!("closing_{number}"), &text, 1e-8);
    }
}

/// Three bodies on three joints, each with a prescribed motion: one of them closes the loop.
fn driven_loop(kind: &str, ends: &str, fields: &str, (element, head): (&str, &str)) -> String {
    let link = |name: &str| {
        format!(
            "body {name} {{ mass = 1.2 kg, inertia = (0.02, 0.03, 0.04, 0.002, -0.001, 0.003 kg*m^2), centre_of_gravity = (0.1 m, 0.05 m, -0.02 m), point tip = (0.4 m, 0.05 m, 0 m) }}\n"
        )
    };
    format!(
        "{}{}body ground {{ point home = (0.35 m, 0.1 m, 0.05 m) }}
         {HOLDING}         joint lift: cylindrical(z) ground -> a {{ motion = {{ shift_z = 0.05 m * sin(7 rad/s * t) }} }}
         joint head: axes(turn x, turn y, turn z) a.tip -> b {{ motion = {{ {head} = 0.3 * sin(9 rad/s * t) }}, orientation = (10 deg, 0 deg, 20 deg) }}
         joint pin: {kind} {ends} {{ {fields} }}
         {element}
         {GO} {{ lift.turn_z.velocity = 1 rad/s }} }}\n",
        link("a"),
        link("b")
    )
}

#[test]
fn closing_joints_may_be_driven() {
    let shift = "0.04 m * sin(6 rad/s * t)";
    let turn = "0.3 * sin(5 rad/s * t)";
    let cases = [
        ("axes(shift x, shift y, shift z, turn z, turn x)", format!("motion = {{ shift_y = {shift} }}")),
        ("axes(shift x, shift y, shift z, turn z, turn x)", format!("motion = {{ turn_z = {turn} }}")),
        (
            "axes(shift x, shift y, shift z, turn z, turn x)",
            format!("motion = {{ turn_x = {turn} }}, orientation = (0 deg, 0 deg, 15 deg)"),
        ),
        ("axes(turn z, turn y, shift x, shift y, shift z)", format!("motion = {{ turn_z = {turn} }}")),
        ("axes(turn z, turn y, shift x, shift y, shift z)", format!("motion = {{ shift_x = {shift} }}")),
        ("axes(turn z, turn y, shift (0.6, 0, 0.8), shift y, shift z)", format!("motion = {{ shift_y = {shift} }}")),
        (
            "axes(shift x, turn z, turn x, turn y, shift (0.6, 0, 0.8))",
            format!("motion = {{ turn_y = {turn} }}, orientation = (0 deg, 0 deg, 15 deg)"),
        ),
        ("free", format!("motion = {{ shift_x = {shift}, shift_z = {shift} }}")),
    ];
    for (number, (kind, fields)) in cases.iter().enumerate() {
        for (way, ends) in [("out", "b.tip -> ground.home"), ("in", "ground.home -> b.tip")] {
            // What the pin turns about x, the head does not.
            let head = if fields.contains("turn_x =") { "turn_z" } else { "turn_x" };
            prove(&format!("driven_{number}_{way}"), &driven_loop(kind, ends, fields, ("", head)), 1e-8);
        }
    }
}

/// Elements on every coordinate of a joint that closes a loop do there what they do anywhere.
#[test]
fn closing_joints_carry_elements_on_all_coordinates() {
    let cases = [
        (
            "axes(shift x, shift (0.6, 0.8, 0), shift z, turn z, turn (1, 0, 1))",
            "shift_x shift_2 shift_z",
            "turn_z turn_5",
        ),
        ("axes(turn z, turn x, shift x, shift y, shift (0, 0.6, 0.8))", "shift_x shift_y shift_5", "turn_z turn_x"),
        ("axes(shift x, shift z, turn z, turn x, shift y)", "shift_x shift_y shift_z", "turn_z turn_x"),
        ("axes(shift x, shift y, turn z, turn y, turn x)", "shift_x shift_y", "turn_x turn_y turn_z"),
    ];
    for (number, (kind, shifts, turns)) in cases.iter().enumerate() {
        let on = |axes: &str, gain: &str| -> String {
            let lines = axes
                .split_whitespace()
                .map(|axis| format!("force on_{axis}: holding on pin.{axis} {{ gain = {gain} }}\n"));
            lines.collect()
        };
        let elements = on(shifts, "300 N/m") + &on(turns, "4 N*m");
        for (way, ends) in [("out", "b.tip -> ground.home"), ("in", "ground.home -> b.tip")] {
            prove(&format!("carrying_{number}_{way}"), &driven_loop(kind, ends, "", (&elements, "turn_x")), 1e-8);
        }
    }
}

/// A planar four-bar in space whose hinge is driven: four hinges hold three directions twice.
#[test]
fn driven_four_bar_names_its_redundant_hinge() {
    let text = format!(
        "body ground {{ point far = (0.5 m, 0 m, 0 m) }}
         body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = (0.1 m, 0 m, 0 m) }}
         body coupler {{ mass = 2 kg, inertia = 0.03 kg*m^2, centre_of_gravity = (0.2 m, 0.01 m, 0 m), point tip = (0.42 m, 0 m, 0 m) }}
         body rocker {{ mass = 1.5 kg, inertia = 0.02 kg*m^2, point tip = (0.3 m, 0 m, 0 m) }}
         joint motor: revolute(z) ground -> crank {{ motion = 3 rad/s * t + 0.1 * sin(20 rad/s * t) }}
         joint pin: revolute(z) crank.tip -> coupler
         joint foot: revolute(z) ground.far -> rocker
         joint head: revolute(z) coupler.tip -> rocker.tip
         {GO} {{ pin.position = 0.8, foot.position = 2 }} }}\n"
    );
    prove("four_bar", &text, 1e-8);
    let study = checked(&format!("study f\n{text}"), &[]).expect("a study");
    let warnings = ident::mechanics::derive(&study).expect("it moves").warnings;
    let [warning] = warnings.as_slice() else { panic!("one joint is redundant: {warnings:?}") };
    assert_eq!(
        warning.message,
        "joint `head` holds what the rest of its loop holds already: shifting along z, turning about x, turning about y"
    );
    assert!(
        warning.help.iter().any(|help| help.contains("axes(shift z, turn x, turn y, turn z)")),
        "{:?}",
        warning.help
    );
}

/// A mechanism without equilibrium says so, with what has nothing to hold it; one that cannot move as well.
#[test]
fn no_equilibrium_and_no_freedom_are_said() {
    let text = "study falling\ngravity = 9.81 m/s^2 along -z
        body load { mass = 2 kg }\nbody guide { mass = 1 kg }
        joint rail: prismatic(x) ground -> guide\njoint lift: prismatic(z) guide -> load
        force spring_x: spring on rail { stiffness = 1 kN/m }
        measure z [m] = lift.position\nmanoeuvre go { for 1 s, start = equilibrium }\ncriterion c = max(lift.position) in go\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let compiled = ident::simulation::Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let record = ident::simulation::manoeuvre(&compiled.study, 0);
    let failure = ident::simulation::simulate(&compiled, &record, &[], ident::simulation::Gradient::None)
        .expect_err("nothing holds the load");
    let told = format!("{failure} {}", failure.help);
    assert!(told.contains("no equilibrium"), "{told}");
    assert!(told.contains("rate of `lift.velocity` (on which act gravity)"), "{told}");

    let text = "study truss\nbody ground { point far = (1 m, 0 m, 0 m) }
        body a { mass = 1 kg, inertia = 0.1 kg*m^2, point tip = (0.6 m, 0 m, 0 m) }
        body b { mass = 1 kg, inertia = 0.1 kg*m^2, point tip = (0.7 m, 0 m, 0 m) }
        joint left: revolute(y) ground -> a\njoint right: revolute(y) ground.far -> b\njoint top: revolute(y) a.tip -> b.tip
        measure angle = left.position\nmanoeuvre go { for 1 s, start = rest { left.position = -0.7, right.position = -2.5 } }
        criterion c = max(left.position) in go\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let findings = ident::mechanics::derive(&study).expect_err("two bars on two hinges");
    assert!(findings[0].message.contains("cannot move") && findings[0].message.contains("top"), "{findings:?}");
}
