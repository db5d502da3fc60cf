//! Elastic bodies against the beam of Euler and Bernoulli, and against Lagrange's equations of a body of point masses.

use crate::build::NoInputs;
use crate::run::{Channels, checked, drift, run};
use ident::integrate::Dynamics;
use ident::mechanics::derive;
use ident::tape::{Bound, Model};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Unit, Vector3};
use std::f64::consts::{PI, TAU};

const LENGTH: f64 = 1.0;
const MASS: f64 = 1.5;
const STIFFNESS: f64 = 200.0;

/// Roots of `f` near the given places, by bisection.
fn root(f: impl Fn(f64) -> f64, near: f64) -> f64 {
    let (mut low, mut high) = (near - 0.6, near + 0.6);
    assert!(f(low) * f(high) < 0.0, "no root near {near}");
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(low) * f(middle) <= 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Frequency (Hz) of a uniform beam with the wave number `b` / length.
fn frequency(b: f64) -> f64 {
    b * b * (STIFFNESS / (MASS / LENGTH)).sqrt() / (LENGTH * LENGTH) / TAU
}

/// Wave number and shape at the end (deflection, slope, integral, first moment) of the modes of a clamped beam, scaled
/// to a modal mass of 1 kg.
fn clamped(number: usize) -> (f64, [f64; 4]) {
    let b = root(|b| b.cos() + 1.0 / b.cosh(), (number as f64 - 0.5) * PI);
    let sigma = (b.cosh() + b.cos()) / (b.sinh() + b.sin());
    // cosh - sigma sinh at the end without cancellation.
    let growing = (b.sin() - b.cos() - (-b).exp()) * b.exp() / (b.sinh() + b.sin());
    let falling = (1.0 + sigma) * (-b).exp();
    let end = 0.5 * (growing + falling) - b.cos() + sigma * b.sin();
    let slope = b / LENGTH * (0.5 * (growing - falling) + b.sin() + sigma * b.cos());
    let factor = 1.0 / MASS.sqrt();
    let density = MASS / LENGTH;
    let integral = density * factor * 2.0 * sigma * LENGTH / b;
    let moment = density * factor * 2.0 * LENGTH * LENGTH / (b * b);
    (b, [factor * end, factor * slope, integral, moment])
}

const HEAD: &str = "mode,frequency [Hz],participation_x [kg],participation_y [kg],participation_z [kg],moment_x [kg*m],\
                    moment_y [kg*m],moment_z [kg*m],tip.shift_x,tip.shift_y,tip.shift_z,tip.turn_x [rad/m],tip.turn_y [rad/m],\
                    tip.turn_z [rad/m]\n";

/// Modes of a beam along x that is clamped at its origin, bending along z and along y in turn.
fn clamped_file(count: usize) -> String {
    let mut text = HEAD.to_owned();
    for mode in 0..2 * count {
        let (b, [end, slope, integral, moment]) = clamped(mode / 2 + 1);
        let f = frequency(b);
        let values = if mode % 2 == 0 {
            [0.0, 0.0, integral, 0.0, -moment, 0.0, 0.0, 0.0, end, 0.0, -slope, 0.0]
        } else {
            [0.0, integral, 0.0, 0.0, 0.0, moment, 0.0, end, 0.0, 0.0, 0.0, slope]
        };
        let cells: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
        text += &format!("{},{f:e},{}\n", mode + 1, cells.join(","));
    }
    text
}

fn beam(more: &str) -> String {
    format!(
        "body beam {{ mass = 1.5 kg, inertia = (0, 0.125, 0.125 kg*m^2), centre_of_gravity = (0.5 m, 0 m, 0 m)
           modes = \"beam.csv\", damping_ratio = 0, point tip = (1 m, 0 m, 0 m), {more} }}\n"
    )
}

/// Frequencies (Hz) above 0.1 Hz of the motion about the reference configuration, without gravity and damping.
fn frequencies(text: &str, count: usize) -> Vec<f64> {
    let study = checked(text, &[("beam.csv", clamped_file(count))]).unwrap_or_else(|findings| panic!("{findings}"));
    let model = Model::compile(&derive(&study).unwrap_or_else(|findings| panic!("{findings:?}")));
    let mut bound = Bound::new(&model, &NoInputs, &[]);
    let y: Vec<f64> = model.variables().iter().map(|variable| variable.reference).collect();
    let n = y.len();
    let mut rates_at = |y: &[f64]| {
        let mut rates = vec![0.0; n];
        assert!(bound.explicit_rates(0.0, y, &mut rates));
        rates
    };
    let h = 1e-6;
    let mut matrix = DMatrix::zeros(n, n);
    for column in 0..n {
        let moved =
            |sign: f64| -> Vec<f64> { (0..n).map(|i| if i == column { y[i] + sign * h } else { y[i] }).collect() };
        let (after, before) = (rates_at(&moved(1.0)), rates_at(&moved(-1.0)));
        (0..n).for_each(|row| matrix[(row, column)] = (after[row] - before[row]) / (2.0 * h));
    }
    let values = matrix.complex_eigenvalues();
    let mut found: Vec<f64> = values.iter().map(|value| value.im / TAU).filter(|f| *f > 0.1).collect();
    found.sort_by(f64::total_cmp);
    found
}

#[track_caller]
fn assert_near(found: f64, expected: f64, accuracy: f64) {
    assert!((found - expected).abs() <= accuracy * expected.abs(), "{found} instead of {expected}");
}

/// Load and moment at the end of a cantilever: `F l^3 / (3 E I)` and `F l^2 / (2 E I)`, approached by the exact series,
/// and the reactions at the clamp.
#[test]
fn cantilever_bends_as_the_beam_does() {
    let force = 3.0;
    let text = |count: usize| {
        format!(
            "study cantilever\n{}joint clamp: fixed ground -> beam
             law push() -> load {{ param size: load\n = size }}
             force load: push ground -> beam.tip along z {{ size = {force} N }}
             measure z [m] = beam.tip.position.z
             measure slope = beam.tip.axis_x.z
             measure F [N] = clamp.reaction.force.z
             measure M [N*m] = clamp.reaction.moment.y
             manoeuvre rest {{ for 1 s, step = 0.5 s, start = equilibrium }}\ncriterion c = max(beam.tip.position.z) in rest
             solver {{ tolerance = 1e-10 }}\n",
            beam(&format!("mode_count = {}", 2 * count))
        )
    };
    let exact = force * LENGTH.powi(3) / (3.0 * STIFFNESS);
    for count in [1, 2, 4, 8] {
        let own = &run(&text(count), &[("beam.csv", clamped_file(8))])[0];
        let series: f64 =
            (1..=count).map(clamped).map(|(b, [end, ..])| force * end * end / (TAU * frequency(b)).powi(2)).sum();
        assert_near(own["z"][2], series, 1e-6);
        let missing = (exact - own["z"][2]) / exact;
        println!("{count} modes: {missing:.1e} of the deflection is missing");
        // The rest of the series: the sum of 12 / b^4 over the modes left out, b near (k - 1/2) pi.
        let rest = 4.0 / (PI.powi(4) * (count as f64).powi(3));
        assert!(missing > 0.0 && missing < 1.05 * rest, "{missing} where {rest} may be missing");
        assert_near(own["F"][2], -force, 1e-8);
        assert_near(own["M"][2], force * LENGTH, 1e-8);
        if count == 8 {
            assert_near(own["slope"][2], force * LENGTH * LENGTH / (2.0 * STIFFNESS), 1e-2);
        }
    }
}

/// The modes of the clamped beam on other supports: hinged, free, with a mass at its end, clamped at the other end.
/// Roots of the frequency equations of Euler and Bernoulli.
#[test]
fn clamped_modes_serve_every_support() {
    // Hinged at one end: tan b = tanh b.
    let hinged =
        |k: usize| frequency(root(|b| b.sin() / b.cosh() - b.cos() * b.tanh() / b.cosh(), (k as f64 + 0.25) * PI));
    let own =
        frequencies(&format!("study hinged\n{}joint pin: revolute(y) ground -> beam\n", beam("mode_count = 24")), 12);
    // Bending along y stays clamped at the hinge.
    let along_z: Vec<f64> = own.iter().copied().filter(|f| (f / hinged(1) - 1.0).abs() < 0.02).collect();
    assert_near(along_z[0], hinged(1), 2e-3);

    // Free at both ends: cos b cosh b = 1, in both planes.
    let free = |k: usize| frequency(root(|b| b.cos() - 1.0 / b.cosh(), (k as f64 + 0.5) * PI));
    let text = format!(
        "study free\n{}joint floating: free ground -> beam\n",
        beam("mode_count = 24").replace("(0, ", "(1e-4, ")
    );
    let own = frequencies(&text, 12);
    for (found, expected) in own.iter().zip([free(1), free(1), free(2), free(2)]) {
        assert_near(*found, expected, 1.2e-2);
    }

    // A mass at the end: 1 + cos b cosh b + r b (cos b sinh b - sin b cosh b) = 0 with r its share of the beam's mass.
    let ratio = 2.0;
    let loaded = frequency(root(
        |b| (1.0 + b.cos() * b.cosh() + ratio * b * (b.cos() * b.sinh() - b.sin() * b.cosh())) / b.cosh(),
        1.2,
    ));
    let text = format!(
        "study loaded\n{}body ball {{ mass = 3 kg, inertia = 0 kg*m^2 }}\njoint clamp: fixed ground -> beam\njoint grip: fixed beam.tip -> ball\n",
        beam("mode_count = 24")
    );
    let own = frequencies(&text, 12);
    assert_near(own[0], loaded, 1e-5);
    assert_near(own[1], loaded, 1e-5);

    // Held at its tip the beam is a cantilever again: the joint stands on a frame that the modes move. These modes have
    // no curvature there, so that the error falls with the number of modes only; what it falls to is right.
    let text = |count: usize| {
        format!("study turned\n{}joint clamp: fixed ground -> beam.tip\n", beam(&format!("mode_count = {count}")))
    };
    let [few, many] = [12, 24].map(|count| frequencies(&text(count), 12));
    for ((few, many), k) in few.iter().zip(&many).zip([1, 1, 2, 2]) {
        let expected = frequency(clamped(k).0);
        assert!(few > many && *many > expected, "{few}, {many} do not fall to {expected}");
        assert_near(2.0 * many - few, expected, 2e-2);
    }
}

/// In free flight, deforming and turning fast, momentum, angular momentum and energy stay.
#[test]
fn free_elastic_body_keeps_its_momentum() {
    let text = format!(
        "study flight\n{}joint floating: free ground -> beam\n{}{}{}
         manoeuvre fly {{ for 0.4 s, step = 20 ms
           start = rest {{ floating.angular_velocity.x = 2 rad/s, floating.angular_velocity.y = 3 rad/s, floating.angular_velocity.z = -1 rad/s
             floating.shift_x.velocity = 0.3 m/s, beam.mode_1.velocity = 0.4 m/s, beam.mode_2.position = 20 mm, beam.mode_3.velocity = -1 m/s }} }}
         criterion c = max(beam.position.z) in fly\nsolver {{ tolerance = 1e-10 }}\n",
        beam("mode_count = 4").replace("(0, ", "(0.05, "),
        (1..=4).map(|k| format!("measure q{k} [m] = beam.mode_{k}.position\nmeasure v{k} [m/s] = beam.mode_{k}.velocity\n")).collect::<String>(),
        ["x", "y", "z"].map(|a| format!("measure w{a} [rad/s] = floating.angular_velocity.{a}\nmeasure p{a} [m] = beam.position.{a}\nmeasure u{a} [m/s] = beam.velocity.{a}\n")).concat(),
        ["x", "y", "z"].iter().flat_map(|a| ["x", "y", "z"].map(|b| format!("measure e{a}{b} = beam.axis_{a}.{b}\n"))).collect::<String>(),
    );
    let own = &run(&text, &[("beam.csv", clamped_file(2))])[0];
    let at = |name: &str, k: usize| own[name][k];
    let three = |own: &Channels, stem: &str, k: usize| {
        Vector3::new(own[&format!("{stem}x")][k], own[&format!("{stem}y")][k], own[&format!("{stem}z")][k])
    };
    let mut conserved: Vec<[f64; 7]> = Vec::new();
    for k in 0..own["q1"].len() {
        let axes = Matrix3::from_columns(&["x", "y", "z"].map(|a| three(own, &format!("e{a}"), k)));
        let (w, p, u) = (three(own, "w", k), three(own, "p", k), axes.transpose() * three(own, "u", k));
        let arm = Vector3::new(0.75, 0.0, 0.0);
        let inertia = Matrix3::from_diagonal(&Vector3::new(0.05, 0.125 + 0.375, 0.125 + 0.375));
        let mut momentum = MASS * u + w.cross(&arm);
        let mut angular = inertia * w + arm.cross(&u);
        let mut energy = 0.5 * MASS * u.dot(&u) + u.dot(&w.cross(&arm)) + 0.5 * w.dot(&(inertia * w));
        for mode in 0..4 {
            let (b, [_, _, integral, moment]) = clamped(mode / 2 + 1);
            let (take, turn) = if mode % 2 == 0 {
                (Vector3::new(0.0, 0.0, integral), Vector3::new(0.0, -moment, 0.0))
            } else {
                (Vector3::new(0.0, integral, 0.0), Vector3::new(0.0, 0.0, moment))
            };
            let (q, v) = (at(&format!("q{}", mode + 1), k), at(&format!("v{}", mode + 1), k));
            momentum += v * take;
            angular += v * turn;
            energy += v * (take.dot(&u) + turn.dot(&w)) + 0.5 * v * v + 0.5 * (TAU * frequency(b) * q).powi(2);
        }
        let momentum = axes * momentum;
        let angular = p.cross(&momentum) + axes * angular;
        conserved.push([momentum.x, momentum.y, momentum.z, angular.x, angular.y, angular.z, energy]);
    }
    for quantity in 0..7 {
        let values: Vec<f64> = conserved.iter().map(|row| row[quantity]).collect();
        assert!(drift(&values) < 1e-7, "quantity {quantity} drifts by {:.1e} from {}", drift(&values), values[0]);
    }
    let swing = drift(&own["q1"]);
    assert!(swing > 1e-3, "it must deform: {swing}");
}

/// Without modes an elastic body is the rigid one, to the digit.
#[test]
fn no_modes_is_rigid() {
    let text = |modes: &str| {
        format!(
            "study rigid\ngravity = 9.81 m/s^2 along -z\nbody beam {{ mass = 1.5 kg, inertia = (0.01, 0.125, 0.125 kg*m^2), centre_of_gravity = (0.5 m, 0 m, 0 m), point tip = (1 m, 0 m, 0 m) {modes} }}
             body end {{ mass = 1 kg, inertia = 0.1 kg*m^2 }}
             joint pin: revolute(0, 0.6, 0.8) ground -> beam\njoint elbow: revolute(y) beam.tip -> end
             measure z [m] = end.position.z\nmanoeuvre fall {{ for 1 s, step = 0.1 s, start = rest }}\ncriterion c = max(end.position.z) in fall\n"
        )
    };
    let files = [("beam.csv", clamped_file(1))];
    let rigid = run(&text(""), &files);
    let elastic = run(&text(", modes = \"beam.csv\", damping_ratio = 0, mode_count = 0"), &files);
    assert_eq!(rigid[0]["z"], elastic[0]["z"]);
}

/// A body of point masses with random mode shapes, hinged at one of its frames, a block on a universal joint at
/// another.
struct Lumps {
    masses: Vec<f64>,
    places: Vec<Vector3<f64>>,
    /// Per mode, per mass.
    shapes: Vec<Vec<Vector3<f64>>>,
    /// Per mode: shift and turn at the root and at the tip.
    root: Vec<[Vector3<f64>; 2]>,
    tip: Vec<[Vector3<f64>; 2]>,
}

const MODES: usize = 3;
const FREQUENCIES: [f64; MODES] = [0.6, 0.9, 1.4];
const ROOT: [f64; 3] = [-0.4, 0.1, 0.05];
const TIP: [f64; 3] = [0.7, -0.1, 0.2];
const GRAVITY: f64 = 9.81;

impl Lumps {
    fn new(random: &mut impl FnMut() -> f64) -> Self {
        let mut vector = |size: f64| Vector3::new(size * random(), size * random(), size * random());
        let places: Vec<Vector3<f64>> = (0..8).map(|_| vector(1.0)).collect();
        let masses: Vec<f64> = (0..8).map(|i| 0.3 + 0.1 * f64::from(i)).collect();
        let mut shapes: Vec<Vec<Vector3<f64>>> = (0..MODES).map(|_| (0..8).map(|_| vector(1.0)).collect()).collect();
        // Gram and Schmidt with the masses: modal masses one, modes at right angles.
        for k in 0..MODES {
            let product = |a: &[Vector3<f64>], b: &[Vector3<f64>]| -> f64 {
                masses.iter().zip(a).zip(b).map(|((m, a), b)| m * a.dot(b)).sum()
            };
            for l in 0..k {
                let along = product(&shapes[k], &shapes[l]);
                let other = shapes[l].clone();
                shapes[k].iter_mut().zip(&other).for_each(|(s, o)| *s -= along * o);
            }
            let size = product(&shapes[k], &shapes[k]).sqrt();
            shapes[k].iter_mut().for_each(|s| *s /= size);
        }
        let root = (0..MODES).map(|_| [vector(0.3), vector(0.5)]).collect();
        let tip = (0..MODES).map(|_| [vector(0.5), vector(0.5)]).collect();
        Self { masses, places, shapes, root, tip }
    }

    fn file(&self) -> String {
        let mut text = "frequency [Hz],damping,modal_mass [kg],".to_owned();
        for name in [
            "participation_{} [kg]",
            "moment_{} [kg*m]",
            "root.shift_{}",
            "root.turn_{} [rad/m]",
            "tip.shift_{}",
            "tip.turn_{} [rad/m]",
        ] {
            text += &["x", "y", "z"].map(|axis| name.replace("{}", axis)).join(",");
            text.push(',');
        }
        text.pop();
        for (k, frequency) in FREQUENCIES.iter().enumerate() {
            let parts = || self.masses.iter().zip(&self.places).zip(&self.shapes[k]);
            let take: Vector3<f64> = parts().map(|((m, _), s)| *m * s).sum();
            let moment: Vector3<f64> = parts().map(|((m, r), s)| *m * r.cross(s)).sum();
            text += &format!("\n{frequency},0,1");
            for value in
                [take, moment, self.root[k][0], self.root[k][1], self.tip[k][0], self.tip[k][1]].iter().flatten()
            {
                text += &format!(",{value:e}");
            }
        }
        text + "\n"
    }

    fn study(&self) -> String {
        let mass: f64 = self.masses.iter().sum();
        let centre: Vector3<f64> =
            self.masses.iter().zip(&self.places).map(|(m, r)| *m * r).sum::<Vector3<f64>>() / mass;
        let inertia: Matrix3<f64> = (self.masses.iter().zip(&self.places))
            .map(|(m, r)| {
                let d = r - centre;
                *m * (d.dot(&d) * Matrix3::identity() - d * d.transpose())
            })
            .sum();
        let tuple = |v: &[f64]| v.iter().map(|x| format!("{x:e} m")).collect::<Vec<_>>().join(", ");
        let tensor =
            [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| format!("{:e} kg*m^2", inertia[(i, j)]));
        format!(
            "study lumps\ngravity = {GRAVITY} m/s^2 along -z
             body flex {{ mass = {mass:e} kg, centre_of_gravity = ({}), inertia = ({}), modes = \"flex.csv\", point root = ({}), point tip = ({}) }}
             body block {{ mass = 2 kg, inertia = (0.2, 0.3, 0.4 kg*m^2), centre_of_gravity = (0.1 m, 0.2 m, -0.1 m), point eye = (0 m, 0.1 m, 0 m) }}
             joint hinge: revolute(0, 0.6, 0.8) ground -> flex.root {{ orientation = (20 deg, 30 deg, -40 deg) }}
             joint cross: universal(x, z) flex.tip -> block.eye {{ orientation = (10 deg, -50 deg, 15 deg) }}\n",
            tuple(centre.as_slice()),
            tensor.join(", "),
            tuple(&ROOT),
            tuple(&TIP),
        )
    }

    /// A shape at a place less the rigid motion of the root.
    fn seen_from_root(&self, k: usize, shift: Vector3<f64>, place: Vector3<f64>) -> Vector3<f64> {
        shift - self.root[k][0] - self.root[k][1].cross(&(place - Vector3::from(ROOT)))
    }

    /// Axes of the body; the displacement of every mass against its place in the undeformed body by the modes.
    fn axes(q: &[f64]) -> Rotation3<f64> {
        let axis = Unit::new_normalize(Vector3::new(0.0, 0.6, 0.8));
        Rotation3::from_axis_angle(&axis, q[0]) * cardan([20.0, 30.0, -40.0].map(f64::to_radians))
    }

    /// Axes and centre of gravity of the block.
    fn block(&self, q: &[f64]) -> (Rotation3<f64>, Vector3<f64>) {
        let (mut place, mut turn) = (Vector3::from(TIP) - Vector3::from(ROOT), Vector3::zeros());
        for k in 0..MODES {
            place += q[3 + k] * self.seen_from_root(k, self.tip[k][0], Vector3::from(TIP));
            turn += q[3 + k] * (self.tip[k][1] - self.root[k][1]);
        }
        let axes = Self::axes(q);
        let cross =
            Rotation3::from_axis_angle(&Vector3::x_axis(), q[1]) * Rotation3::from_axis_angle(&Vector3::z_axis(), q[2]);
        let own = axes * cardan(turn.into()) * cross * cardan([10.0, -50.0, 15.0].map(f64::to_radians));
        let arm = Vector3::new(0.1, 0.2, -0.1) - Vector3::new(0.0, 0.1, 0.0);
        (own, axes * place + own * arm)
    }

    fn potential(&self, q: &[f64]) -> f64 {
        let axes = Self::axes(q);
        let mut energy = 2.0 * GRAVITY * self.block(q).1.z;
        for (i, (mass, place)) in self.masses.iter().zip(&self.places).enumerate() {
            let mut at = place - Vector3::from(ROOT);
            (0..MODES).for_each(|k| at += q[3 + k] * self.seen_from_root(k, self.shapes[k][i], *place));
            energy += mass * GRAVITY * (axes * at).z;
        }
        energy + (0..MODES).map(|k| 0.5 * (TAU * FREQUENCIES[k] * q[3 + k]).powi(2)).sum::<f64>()
    }

    /// The mass matrix: velocities of all parts per unit of each rate.
    fn masses(&self, q: &[f64]) -> DMatrix<f64> {
        let n = q.len();
        let h = 1e-5;
        let moved = |i: usize, h: f64| -> Vec<f64> { (0..n).map(|j| if i == j { q[j] + h } else { q[j] }).collect() };
        let spin = |after: Rotation3<f64>, before: Rotation3<f64>, now: Rotation3<f64>| {
            let rate = (after.matrix() - before.matrix()) / (2.0 * h) * now.matrix().transpose();
            Vector3::new(rate[(2, 1)] - rate[(1, 2)], rate[(0, 2)] - rate[(2, 0)], rate[(1, 0)] - rate[(0, 1)]) / 2.0
        };
        let (own, _) = self.block(q);
        let tensor = own.matrix() * Matrix3::from_diagonal(&Vector3::new(0.2, 0.3, 0.4)) * own.matrix().transpose();
        let mut columns = Vec::new();
        for i in 0..n {
            let (after, before) = (moved(i, h), moved(i, -h));
            let (a, b) = (self.block(&after), self.block(&before));
            let body = spin(Self::axes(&after), Self::axes(&before), Self::axes(q));
            // The inertia of the body at its undeformed shape.
            let points: Vec<Vector3<f64>> = (self.places.iter().enumerate())
                .map(|(m, place)| {
                    let carried = body.cross(&(Self::axes(q) * (place - Vector3::from(ROOT))));
                    let own = if i >= 3 {
                        self.seen_from_root(i - 3, self.shapes[i - 3][m], *place)
                    } else {
                        Vector3::zeros()
                    };
                    carried + Self::axes(q) * own
                })
                .collect();
            columns.push((points, (a.1 - b.1) / (2.0 * h), spin(a.0, b.0, own)));
        }
        DMatrix::from_fn(n, n, |i, j| {
            let (a, b) = (&columns[i], &columns[j]);
            let points: f64 = self.masses.iter().zip(a.0.iter().zip(&b.0)).map(|(m, (a, b))| m * a.dot(b)).sum();
            points + 2.0 * a.1.dot(&b.1) + a.2.dot(&(tensor * b.2))
        })
    }

    /// Lagrange: M q'' = -dM/dt q' + d(T - V)/dq.
    fn accelerations(&self, q: &[f64], v: &[f64]) -> Vec<f64> {
        let rate = DVector::from_column_slice(v);
        let kinetic = |q: &[f64]| 0.5 * (rate.transpose() * self.masses(q) * &rate)[0];
        let moved = |way: &[f64], h: f64| -> Vec<f64> { q.iter().zip(way).map(|(q, w)| q + h * w).collect() };
        let h = 2e-3;
        let slope = |f: &dyn Fn(f64) -> DVector<f64>| {
            (f(-2.0 * h) - f(2.0 * h)) / (12.0 * h) + (f(h) - f(-h)) * (8.0 / (12.0 * h))
        };
        let n = q.len();
        let mut load = -slope(&|h| self.masses(&moved(v, h)) * &rate);
        for i in 0..n {
            let way: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
            load[i] += slope(&|h| {
                let q = moved(&way, h);
                DVector::from_element(1, kinetic(&q) - self.potential(&q))
            })[0];
        }
        self.masses(q).lu().solve(&load).expect("regular").as_slice().to_vec()
    }
}

/// Turns about x, then the turned y, then the turned z.
fn cardan([x, y, z]: [f64; 3]) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), x)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), y)
        * Rotation3::from_axis_angle(&Vector3::z_axis(), z)
}

/// An elastic body in space that is carried by one of its elastic frames and carries a block on another, at random
/// states.
#[test]
fn elastic_chain_accelerates_as_lagrange_says() {
    let mut state = 12345_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    for _ in 0..2 {
        let lumps = Lumps::new(&mut random);
        let study =
            checked(&lumps.study(), &[("flex.csv", lumps.file())]).unwrap_or_else(|findings| panic!("{findings}"));
        let model = Model::compile(&derive(&study).unwrap_or_else(|findings| panic!("{findings:?}")));
        let mut bound = Bound::new(&model, &NoInputs, &[]);
        let n = model.dimension() / 2;
        let names: Vec<&str> = model.variables().iter().map(|variable| variable.name.as_str()).collect();
        assert_eq!(
            &names[..n],
            [
                "hinge.position",
                "cross.turn_x.position",
                "cross.turn_z.position",
                "flex.mode_1.position",
                "flex.mode_2.position",
                "flex.mode_3.position"
            ]
        );
        for _ in 0..3 {
            let y: Vec<f64> = (0..2 * n).map(|i| if (3..n).contains(&i) { 0.1 * random() } else { random() }).collect();
            let mut rates = vec![0.0; 2 * n];
            assert!(bound.explicit_rates(0.0, &y, &mut rates));
            let expected = lumps.accelerations(&y[..n], &y[n..]);
            let size = expected.iter().fold(1.0_f64, |m, a| m.max(a.abs()));
            for (own, expected) in rates[n..].iter().zip(&expected) {
                assert!((own - expected).abs() < 1e-6 * size, "{:?}\ninstead of {expected:?}", &rates[n..]);
            }
        }
    }
}
