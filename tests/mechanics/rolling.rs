//! Couplings of rates: rolling without slip, against solutions of textbooks and of Newton's equations by hand.

use crate::run::{Channels, checked, run};
use ident::mechanics::derive;
use ident::simulation::{Compiled, certify, manoeuvre};

fn one(text: &str) -> Channels {
    run(text, &[]).swap_remove(0)
}

#[track_caller]
fn assert_near(channel: &[f64], accuracy: f64, expected: impl Fn(usize) -> f64) {
    assert!(channel.len() > 50);
    for (k, value) in channel.iter().enumerate() {
        let expected = expected(k);
        assert!((value - expected).abs() < accuracy, "sample {k}: {value} instead of {expected}");
    }
}

/// A homogeneous ball on a turntable runs on a circle, at two sevenths of the table's speed, wherever it starts
/// (Earnshaw 1844); what holds it is its mass times its acceleration.
#[test]
fn a_ball_on_a_turntable_runs_on_a_circle() {
    let channels = one(
        "study ball\ngravity = 9.81 m/s^2 along -z\nsolver { tolerance = 1e-9 }\nconstant r = 0.1 m\nconstant W = 3 rad/s\n\
        body ball { mass = 2 kg, inertia = 0.008 kg*m^2 }\njoint float: free ground -> ball\n\
        coupling table: ball.position.z = 0 m\n\
        coupling roll_x: ball.velocity.x - r * ball.angular_velocity.y = -W * ball.position.y\n\
        coupling roll_y: ball.velocity.y + r * ball.angular_velocity.x = W * ball.position.x\n\
        measure time [s] = t\nmeasure x [m] = ball.position.x\nmeasure y [m] = ball.position.y\nmeasure normal [N] = table.force\n\
        measure push [N] = roll_x.force\nmeasure drilling [rad/s] = ball.angular_velocity.z\n\
        manoeuvre go { start = rest { float.shift_x.position = 0.5 m, float.shift_y.velocity = 0.2 m/s, \
        float.angular_velocity.z = 1 rad/s }, step = 20 ms, for 3 s }\n",
    );
    let (times, speed) = (channels["time"].clone(), 6.0 / 7.0);
    let radius = 0.2 / speed;
    assert_near(&channels["x"], 1e-7, |k| 0.5 - radius + radius * (speed * times[k]).cos());
    assert_near(&channels["y"], 1e-7, |k| radius * (speed * times[k]).sin());
    assert_near(&channels["normal"], 1e-5, |_| 2.0 * 9.81);
    assert_near(&channels["push"], 1e-5, |k| -2.0 * 0.2 * speed * (speed * times[k]).cos());
    assert_near(&channels["drilling"], 1e-6, |_| 1.0);
}

/// Chaplygin's sleigh, a body on a knife edge, geared to a flywheel: the equations of speed and turning
/// `u' = a w^2`, `(I + m a^2) w' = -m a u w` by Runge and Kutta. The start keeps its heading and its stated speed.
#[test]
fn a_sleigh_runs_on_its_edge() {
    let channels = one("study sleigh\nsolver { tolerance = 1e-9 }\n\
        body sleigh { mass = 3 kg, inertia = 0.5 kg*m^2, centre_of_gravity = (0.3 m, 0 m, 0 m) }\n\
        body dial { mass = 1 kg, inertia = 0.4 kg*m^2 }\n\
        joint plane: planar(z) ground -> sleigh\njoint pin: revolute(z) ground -> dial\n\
        coupling gear: plane.turn_z.position = 2 * pin.position\n\
        coupling edge: sleigh.velocity.x * sin(plane.turn_z.position) = sleigh.velocity.y * cos(plane.turn_z.position)\n\
        measure x [m] = sleigh.position.x\nmeasure y [m] = sleigh.position.y\nmeasure heading [rad] = plane.turn_z.position\n\
        manoeuvre go { start = rest { plane.turn_z.position = 0.3 rad, plane.turn_z.velocity = 2 rad/s, \
        plane.shift_x.velocity = -1 m/s }, step = 20 ms, for 2 s }\n");
    let (mass, arm, inertia) = (3.0, 0.3, 0.5 + 0.4 / 4.0);
    let rate = |s: [f64; 5]| {
        let [_, _, heading, u, w] = s;
        let turning = -mass * arm * u * w / (inertia + mass * arm * arm);
        [u * heading.cos(), u * heading.sin(), w, arm * w * w, turning]
    };
    let mut path = vec![[0.0, 0.0, 0.3, -1.0 / 0.3_f64.cos(), 2.0]];
    let (parts, h) = (20, 1e-3);
    for _ in 1..channels["x"].len() {
        let mut s = *path.last().expect("a start");
        for _ in 0..parts {
            let moved = |by: [f64; 5], f: f64| std::array::from_fn::<f64, 5, _>(|i| s[i] + f * h * by[i]);
            let first = rate(s);
            let second = rate(moved(first, 0.5));
            let third = rate(moved(second, 0.5));
            let fourth = rate(moved(third, 1.0));
            s = std::array::from_fn(|i| s[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i]));
        }
        path.push(s);
    }
    for (at, name) in ["x", "y", "heading"].into_iter().enumerate() {
        assert_near(&channels[name], 2e-7, |k| path[k][at]);
    }
}

/// A wheel on its hub, on a slope and a spring: the force of the road acts on the wheel where it touches, so that the
/// axle carries it to the hub. Rolling leaves the wheel at rest in any position: a stated angle decides on the equilibrium.
#[test]
fn a_rolling_wheel_is_held_at_the_road() {
    let text = |start: &str| {
        format!(
            "study wheel\ngravity = 10 m/s^2 along (0.6, 0, -0.8)\nsolver {{ tolerance = 1e-9 }}\n\
            body hub {{ mass = 1 kg }}\nbody wheel {{ mass = 2 kg, inertia = 0.05 kg*m^2 }}\n\
            joint slide: prismatic(x) ground -> hub\njoint axle: revolute(y) hub -> wheel\n\
            force holding: spring on slide {{ stiffness = 200 N/m }}\n\
            coupling roll: wheel.velocity.x = 0.3 m * axle.velocity\n\
            measure time [s] = t\nmeasure x [m] = slide.position\nmeasure road [N] = roll.force\n\
            measure axle_force [N] = axle.reaction.force.x\nmanoeuvre go {{ start = {start}, step = 10 ms, for 1 s }}\n"
        )
    };
    let channels = one(&text("rest"));
    let times = channels["time"].clone();
    let (at_rim, weight) = (0.05 / 0.09, 6.0);
    let omega = (200.0_f64 / (3.0 + at_rim)).sqrt();
    let way = 3.0 * weight / 200.0;
    let acceleration = |k: usize| way * omega * omega * (omega * times[k]).cos();
    assert_near(&channels["x"], 1e-8, |k| way * (1.0 - (omega * times[k]).cos()));
    // Multipliers are no part of what the error control looks at.
    assert_near(&channels["road"], 5e-3, |k| -at_rim * acceleration(k));
    assert_near(&channels["axle_force"], 5e-3, |k| (2.0 + at_rim) * acceleration(k) - 2.0 * weight);
    let resting = one(&text("equilibrium { axle.position = 0 deg }"));
    assert_near(&resting["x"], 1e-9, |_| way);
    assert_near(&resting["road"], 1e-6, |_| 0.0);
}

/// Radius and stiffness identified: the gradient through rolling is that of the discrete solution.
#[test]
fn rolling_has_exact_gradients() {
    let text = "study wheel\ngravity = 10 m/s^2 along (0.6, 0, -0.8)\nsolver { tolerance = 1e-8 }\n\
        body hub { mass = 1 kg }\nbody wheel { mass = 2 kg, inertia = 0.05 kg*m^2 }\n\
        joint slide: prismatic(x) ground -> hub\njoint axle: revolute(y) hub -> wheel\n\
        force holding: spring on slide { stiffness = c }\ncoupling roll: wheel.velocity.x = radius * axle.velocity\n\
        measure x [m] = slide.position\nidentify { c in 100 .. 400 N/m from 200 N/m\n radius in 0.1 .. 0.5 m from 0.3 m }\n\
        manoeuvre go { start = rest, step = 10 ms, for 0.5 s }\ncriterion end = final(x) in go\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let record = manoeuvre(&compiled.study, 0);
    let digits = certify(&compiled, &[&record], &[200.0, 0.3]).expect("a run").expect("parameters");
    assert!(digits > 8.0, "{digits} digits");
}

/// What a coupling of positions does at a point is a force there: a rope that holds a boom at its tip loads the hinge.
#[test]
fn a_rope_at_a_point_loads_the_joints_behind() {
    let channels = one("study boom\ngravity = 10 m/s^2 along -z\n\
        body boom { mass = 4 kg, inertia = 0.2 kg*m^2, centre_of_gravity = (0.5 m, 0 m, 0 m), point tip = (1 m, 0 m, 0 m) }\n\
        body weight { mass = 1 kg }\njoint hinge: revolute(y) ground -> boom\njoint guide: prismatic(z) ground -> weight\n\
        coupling rope: boom.tip.position.z = -2 * guide.position\n\
        measure pull [N] = rope.force\nmeasure carried [N] = hinge.reaction.force.z\n\
        measure balance [N] = hinge.reaction.force.z + rope.force - 40 N - 4 kg * boom.centre_of_gravity.acceleration.z\n\
        manoeuvre go { start = rest, step = 5 ms, for 0.5 s }\n");
    assert_near(&channels["balance"], 1e-6, |_| 0.0);
    // At the start: (I + m a^2) alpha = 20 N*m - 1 m * pull; the weight rises half as fast as the tip sinks.
    let inertia = 0.2 + 4.0 * 0.25;
    let alpha = (20.0 - 5.0) / (inertia + 0.25);
    assert!((channels["pull"][0] - (20.0 - inertia * alpha)).abs() < 1e-6, "{}", channels["pull"][0]);
}

/// Rolling that other couplings imply is named and left out.
#[test]
fn rolling_that_says_nothing_new_is_told() {
    let text = "study twice\nbody hub { mass = 1 kg }\nbody wheel { mass = 2 kg, inertia = 0.05 kg*m^2 }\n\
        joint slide: prismatic(x) ground -> hub\njoint axle: revolute(y) hub -> wheel\n\
        coupling rack: slide.position = 0.3 m * axle.position\ncoupling roll: wheel.velocity.x = 0.3 m * axle.velocity\n\
        measure x [m] = slide.position\nmanoeuvre go { start = rest, for 1 s }\n";
    let study = checked(text, &[]).unwrap_or_else(|findings| panic!("{findings}"));
    let warnings = derive(&study).expect("it moves").warnings;
    let [warning] = warnings.as_slice() else { panic!("one warning: {warnings:?}") };
    assert!(warning.message.contains("coupling `roll` says what"), "{warning:?}");
}
