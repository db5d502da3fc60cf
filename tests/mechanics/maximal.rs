//! An independent formalism: Newton-Euler equations of every body in ground axes with constraint forces of the joints
//! as unknowns, solved as one dense linear system. Shares nothing with the product but the study's data.

use ident::expression::Node;
use ident::study::*;

pub type V = [f64; 3];
pub type M = [[f64; 3]; 3];

pub fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
pub fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
pub fn mul(f: f64, a: V) -> V {
    a.map(|x| f * x)
}
pub fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
pub fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
pub fn apply(m: M, a: V) -> V {
    m.map(|row| dot(row, a))
}
fn transpose(m: M) -> M {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}
fn product(a: M, b: M) -> M {
    let columns = transpose(b);
    a.map(|row| columns.map(|column| dot(row, column)))
}
const ONE: M = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Rotation by a quaternion (not the product's formula).
fn turn(axis: V, angle: f64) -> M {
    let (w, [x, y, z]) = ((angle / 2.0).cos(), mul((angle / 2.0).sin(), axis));
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Pose and motion of a body's axes: orientation, origin, angular velocity, velocity of the origin.
#[derive(Clone, Copy)]
pub struct Pose {
    pub r: M,
    pub o: V,
    pub w: V,
    pub v: V,
}

impl Pose {
    pub fn point(&self, p: V) -> V {
        add(self.o, apply(self.r, p))
    }
    pub fn velocity(&self, p: V) -> V {
        add(self.v, cross(self.w, apply(self.r, p)))
    }
}

const GROUND: Pose = Pose { r: ONE, o: [0.0; 3], w: [0.0; 3], v: [0.0; 3] };

pub struct Mechanism<'a> {
    pub study: &'a Study,
    /// Per joint of the study.
    pub q: Vec<f64>,
    pub v: Vec<f64>,
}

fn value(study: &Study, node: Node) -> f64 {
    study.graph.constant_value(node).expect("the test's geometry is numbers")
}

pub fn numbers(study: &Study, nodes: [Node; 3]) -> V {
    nodes.map(|node| value(study, node))
}

impl Mechanism<'_> {
    fn axis(&self, joint: &Joint) -> V {
        match joint.single_axis().map(|axis| axis.motion) {
            None => [0.0; 3],
            Some(AxisMotion::Shift(axis)) | Some(AxisMotion::Turn(axis)) => axis,
        }
    }

    fn pose_of(poses: &[Option<Pose>], body: Option<usize>) -> Option<Pose> {
        body.map_or(Some(GROUND), |body| poses[body])
    }

    /// Poses of all bodies from the joints' coordinates.
    pub fn poses(&self) -> Vec<Pose> {
        let mut poses: Vec<Option<Pose>> = vec![None; self.study.bodies.len()];
        for _ in 0..=self.study.joints.len() {
            for (k, joint) in self.study.joints.iter().enumerate() {
                let ends = [joint.parent.body, joint.child.body].map(|body| Self::pose_of(&poses, body));
                let [a, b] = [joint.parent, joint.child].map(|end| numbers(self.study, end.position));
                let axis = self.axis(joint);
                let (angle, way) = match joint.single_axis().map(|axis| axis.motion) {
                    Some(AxisMotion::Turn(_)) => ([self.q[k], self.v[k]], [0.0, 0.0]),
                    _ => ([0.0, 0.0], [self.q[k], self.v[k]]),
                };
                let relative = turn(axis, angle[0]);
                match ends {
                    [Some(p), None] => {
                        let u = apply(p.r, axis);
                        let r = product(p.r, relative);
                        let w = add(p.w, mul(angle[1], u));
                        let place = add(p.point(a), mul(way[0], u));
                        let carried = add(p.v, cross(p.w, sub(place, p.o)));
                        let speed = add(carried, mul(way[1], u));
                        let o = sub(place, apply(r, b));
                        poses[joint.child.body.unwrap()] =
                            Some(Pose { r, o, w, v: add(speed, cross(w, sub(o, place))) });
                    }
                    [None, Some(c)] => {
                        let r = product(c.r, transpose(relative));
                        let u = apply(r, axis);
                        let w = sub(c.w, mul(angle[1], u));
                        let place = c.point(b);
                        let o = sub(sub(place, mul(way[0], u)), apply(r, a));
                        // The child's point moves with the parent plus along the axis.
                        let carried = sub(c.velocity(b), mul(way[1], u));
                        poses[joint.parent.body.unwrap()] =
                            Some(Pose { r, o, w, v: sub(carried, cross(w, sub(place, o))) });
                    }
                    _ => {}
                }
            }
        }
        poses.into_iter().map(|pose| pose.expect("connected")).collect()
    }

    fn mass(&self, body: usize) -> f64 {
        value(self.study, self.study.bodies[body].mass)
    }

    fn centre(&self, body: usize) -> V {
        numbers(self.study, self.study.bodies[body].centre_of_gravity)
    }

    /// Inertia about the centre of gravity in ground axes.
    fn inertia(&self, body: usize, pose: &Pose) -> M {
        let [xx, yy, zz, xy, xz, yz] = self.study.bodies[body].inertia.map(|node| value(self.study, node));
        product(product(pose.r, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), transpose(pose.r))
    }

    pub fn kinetic_energy(&self) -> f64 {
        let energy = |(body, pose): (usize, &Pose)| {
            let v = pose.velocity(self.centre(body));
            0.5 * self.mass(body) * dot(v, v) + 0.5 * dot(pose.w, apply(self.inertia(body, pose), pose.w))
        };
        self.poses().iter().enumerate().map(energy).sum()
    }

    pub fn gravity_energy(&self) -> f64 {
        let g = numbers(self.study, self.study.gravity);
        let energy = |(body, pose): (usize, &Pose)| -self.mass(body) * dot(g, pose.point(self.centre(body)));
        self.poses().iter().enumerate().map(energy).sum()
    }

    /// Ground-axis position and velocity of an attachment.
    pub fn end(&self, poses: &[Pose], end: &Attachment) -> (V, V) {
        let pose = end.body.map_or(GROUND, |body| poses[body]);
        let p = numbers(self.study, end.position);
        (pose.point(p), pose.velocity(p))
    }

    /// Elongation and rate of a force element from the definition of the language.
    pub fn elongation(&self, force: &Force) -> (f64, f64) {
        let poses = self.poses();
        let zeros = vec![0.0; self.q.len()];
        let drawn = Mechanism { study: self.study, q: zeros.clone(), v: zeros }.poses();
        match &force.place {
            ForcePlace::Joint { joint, .. } => (self.q[*joint], self.v[*joint]),
            ForcePlace::Between { first, second, along, free_length } => {
                let difference = |poses: &[Pose]| {
                    let (a, b) = (self.end(poses, first), self.end(poses, second));
                    (sub(b.0, a.0), sub(b.1, a.1))
                };
                let (now, rate) = difference(&poses);
                let (before, _) = difference(&drawn);
                match along {
                    Some(along) => (dot(along.axis, sub(now, before)), dot(along.axis, rate)),
                    None => {
                        let length = dot(now, now).sqrt();
                        let free = free_length.map_or(dot(before, before).sqrt(), |node| value(self.study, node));
                        (length - free, dot(rate, now) / length)
                    }
                }
            }
        }
    }

    /// Accelerations of the joints' coordinates (per joint, zero for fixed ones) under the given loads of the force
    /// elements, and per body the angular acceleration and the acceleration of its origin.
    pub fn accelerations(&self, loads: &[f64]) -> (Vec<f64>, Vec<(V, V)>) {
        let poses = self.poses();
        let bodies = self.study.bodies.len();
        let (force, moment) = self.applied(&poses, loads);
        let rows: Vec<(Vec<f64>, f64)> =
            self.study.joints.iter().enumerate().flat_map(|(k, j)| self.constraints(k, j, &poses)).collect();
        let size = 6 * bodies + rows.len();
        let mut a = vec![vec![0.0; size + 1]; size];
        let g = numbers(self.study, self.study.gravity);
        for body in 0..bodies {
            let inertia = self.inertia(body, &poses[body]);
            let gyro = cross(poses[body].w, apply(inertia, poses[body].w));
            for i in 0..3 {
                a[6 * body + i][6 * body + i] = self.mass(body);
                a[6 * body + i][size] = self.mass(body) * g[i] + force[body][i];
                for j in 0..3 {
                    a[6 * body + 3 + i][6 * body + 3 + j] = inertia[i][j];
                }
                a[6 * body + 3 + i][size] = moment[body][i] - gyro[i];
            }
        }
        for (k, (row, right)) in rows.iter().enumerate() {
            for (column, &element) in row.iter().enumerate() {
                a[6 * bodies + k][column] = element;
                a[column][6 * bodies + k] = element;
            }
            a[6 * bodies + k][size] = *right;
        }
        let x = solve(a);
        let motion = |body: Option<usize>| match body {
            None => ([0.0; 3], [0.0; 3]),
            Some(b) => ([x[6 * b + 3], x[6 * b + 4], x[6 * b + 5]], [x[6 * b], x[6 * b + 1], x[6 * b + 2]]),
        };
        let joints = self.study.joints.iter().enumerate().map(|(k, joint)| {
            let (rows, right) = self.along(k, joint, &poses);
            rows.iter().zip(&x).map(|(r, x)| r * x).sum::<f64>() - right
        });
        let joints: Vec<f64> = joints.collect();
        let origins = (0..bodies).map(|body| {
            let (alpha, a) = motion(Some(body));
            let back = mul(-1.0, apply(poses[body].r, self.centre(body)));
            let w = poses[body].w;
            (alpha, add(a, add(cross(alpha, back), cross(w, cross(w, back)))))
        });
        (joints, origins.collect())
    }

    /// Applied forces and moments about the centres of gravity.
    fn applied(&self, poses: &[Pose], loads: &[f64]) -> (Vec<V>, Vec<V>) {
        let mut force = vec![[0.0; 3]; poses.len()];
        let mut moment = vec![[0.0; 3]; poses.len()];
        let mut push = |body: Option<usize>, at: V, f: V, m: V| {
            if let Some(b) = body {
                let lever = sub(at, poses[b].point(self.centre(b)));
                force[b] = add(force[b], f);
                moment[b] = add(moment[b], add(m, cross(lever, f)));
            }
        };
        for (element, &load) in self.study.forces.iter().zip(loads) {
            match &element.place {
                ForcePlace::Joint { joint: k, .. } => {
                    let joint = &self.study.joints[*k];
                    let u = self.ground_axis(joint, poses);
                    let at = self.end(poses, &joint.child).0;
                    let (f, m) = match joint.single_axis().map(|axis| axis.motion) {
                        Some(AxisMotion::Turn(_)) => ([0.0; 3], mul(load, u)),
                        _ => (mul(load, u), [0.0; 3]),
                    };
                    push(joint.child.body, at, f, m);
                    push(joint.parent.body, at, mul(-1.0, f), mul(-1.0, m));
                }
                ForcePlace::Between { first, second, along, .. } => {
                    let (a, b) = (self.end(poses, first).0, self.end(poses, second).0);
                    let line = sub(b, a);
                    let direction = along.map_or(mul(1.0 / dot(line, line).sqrt(), line), |along| along.axis);
                    push(second.body, b, mul(load, direction), [0.0; 3]);
                    push(first.body, a, mul(-load, direction), [0.0; 3]);
                }
            }
        }
        (force, moment)
    }

    fn ground_axis(&self, joint: &Joint, poses: &[Pose]) -> V {
        apply(joint.parent.body.map_or(ONE, |body| poses[body].r), self.axis(joint))
    }

    /// Row and known part of `direction . (relative acceleration of the joint)`: linear at the joint or angular.
    fn relative(&self, k: usize, joint: &Joint, poses: &[Pose], direction: V, is_angular: bool) -> (Vec<f64>, f64) {
        let mut row = vec![0.0; 6 * poses.len()];
        let mut known = 0.0;
        let at = self.end(poses, &joint.child).0;
        for (sign, body) in [(1.0, joint.child.body), (-1.0, joint.parent.body)] {
            let Some(b) = body else { continue };
            let lever = sub(at, poses[b].point(self.centre(b)));
            let by_rotation = if is_angular { direction } else { cross(lever, direction) };
            for i in 0..3 {
                if !is_angular {
                    row[6 * b + i] += sign * direction[i];
                }
                row[6 * b + 3 + i] += sign * by_rotation[i];
            }
            if !is_angular {
                let w = poses[b].w;
                known -= sign * dot(direction, cross(w, cross(w, lever)));
            }
        }
        let w_parent = joint.parent.body.map_or([0.0; 3], |body| poses[body].w);
        let motion = mul(self.v[k], self.ground_axis(joint, poses));
        known += match (joint.single_axis().map(|axis| axis.motion), is_angular) {
            (Some(AxisMotion::Turn(_)), true) => dot(direction, cross(w_parent, motion)),
            (Some(AxisMotion::Shift(_)), false) => 2.0 * dot(direction, cross(w_parent, motion)),
            _ => 0.0,
        };
        (row, known)
    }

    fn along(&self, k: usize, joint: &Joint, poses: &[Pose]) -> (Vec<f64>, f64) {
        let is_angular = matches!(joint.single_axis().map(|axis| axis.motion), Some(AxisMotion::Turn(_)));
        self.relative(k, joint, poses, self.ground_axis(joint, poses), is_angular)
    }

    fn constraints(&self, k: usize, joint: &Joint, poses: &[Pose]) -> Vec<(Vec<f64>, f64)> {
        let all = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].to_vec();
        let u = self.ground_axis(joint, poses);
        let helper = if u[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let across = vec![cross(u, helper), cross(u, cross(u, helper))];
        let (linear, angular) = match joint.single_axis().map(|axis| axis.motion) {
            None => (all.clone(), all),
            Some(AxisMotion::Shift(_)) => (across, all),
            Some(AxisMotion::Turn(_)) => (all, across),
        };
        let rows = linear.into_iter().map(|d| self.relative(k, joint, poses, d, false));
        rows.chain(angular.into_iter().map(|d| self.relative(k, joint, poses, d, true))).collect()
    }
}

/// Gauss with row pivoting; the right-hand side is the last column.
fn solve(mut a: Vec<Vec<f64>>) -> Vec<f64> {
    let n = a.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs())).unwrap();
        a.swap(column, pivot);
        let top = a[column].clone();
        for row in &mut a[column + 1..] {
            let factor = row[column] / top[column];
            for (x, t) in row.iter_mut().zip(&top).skip(column) {
                *x -= factor * t;
            }
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let rest: f64 = (i + 1..n).map(|j| a[i][j] * x[j]).sum();
        x[i] = (a[i][n] - rest) / a[i][i];
    }
    x
}
