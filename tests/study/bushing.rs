//! The bushing of the prelude: six springs and dampers in the axes of its first body.

use crate::evaluate::study;
use ident::simulation::{Compiled, Gradient, excitation, simulate};

/// A block on a bushing whose first body lies turned about z.
fn block(degrees: f64, more: &str) -> Vec<Vec<f64>> {
    let text = format!(
        "study s\nbody pad {{ mass = 1 kg, point eye = (0.3 m, 0 m, 0.1 m) }}\n\
         joint base: fixed ground -> pad {{ orientation = (0 deg, 0 deg, {degrees} deg) }}\n\
         body b {{ mass = 2 kg, inertia = (0.02 kg*m^2, 0.03 kg*m^2, 0.04 kg*m^2) }}\n\
         joint free: free pad.eye -> b\n\
         part mount: bushing at pad.eye, b {{\n\
           stiffness = {{ x = 20 kN/m, y = 30 kN/m, z = 40 kN/m, turn_x = 100 N*m/rad, turn_y = 200 N*m/rad,\n\
             turn_z = 300 N*m/rad }}\n\
           damping = {{ x = 20 N*s/m, y = 30 N*s/m, z = 40 N*s/m, turn_x = 0.2 N*m*s/rad, turn_y = 0.3 N*m*s/rad,\n\
             turn_z = 0.4 N*m*s/rad }}\n\
         }}\n\
         measure x [m] = free.shift_x.position\nmeasure y [m] = free.shift_y.position\n\
         measure z [m] = free.shift_z.position\nmeasure a [rad] = atan2(-b.axis_z.y, b.axis_z.z)\n\
         measure b_ [rad] = atan2(b.axis_z.x, b.axis_z.z)\n\
         measure c [rad] = atan2(b.axis_x.y, b.axis_x.x) - {degrees} deg\n\
         measure F [N] = mount.shift_x.force\nmeasure M [N*m] = mount.turn_y.torque\n\
         solver {{ tolerance = 1e-10 }}\n{more}"
    );
    let study = study(&text);
    let record = excitation(&study, 0, 0.002);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure}")).channels
}

#[test]
fn loads_in_ground_axes_deflect_it_along_its_own() {
    let mut found = block(
        30.0,
        "force fx: external_load ground -> b along x { value = 4 N }\n\
         force fz: external_load ground -> b along z { value = -8 N }\n\
         force mx: external_load ground -> b about x { value = 0.03 N*m }\n\
         force mz: external_load ground -> b about z { value = 0.06 N*m }\n\
         manoeuvre m { start = equilibrium, for 0.01 s }",
    );
    let (cos, sin) = (30f64.to_radians().cos(), 30f64.to_radians().sin());
    // The measured angles are about the axes of ground.
    let (about_x, about_y) = (found[3][0], found[4][0]);
    (found[3][0], found[4][0]) = (cos * about_x + sin * about_y, cos * about_y - sin * about_x);
    // Components along the pad's axes over the stiffness; angles of 1e-3 and less.
    let expected = [
        4.0 * cos / 20e3,
        -4.0 * sin / 30e3,
        -8.0 / 40e3,
        0.03 * cos / 100.0,
        -0.03 * sin / 200.0,
        0.06 / 300.0,
        -4.0 * cos,
        0.03 * sin,
    ];
    for (channel, expected) in found.iter().zip(expected) {
        assert!((channel[0] - expected).abs() < 2e-3 * expected.abs(), "{} instead of {expected}", channel[0]);
    }
}

/// Each direction is an oscillator of its own: m x'' + d x' + c x = 0 from a start velocity; turns may be large.
#[test]
fn every_direction_swings_by_itself() {
    let (mass, inertia) = (2.0, [0.02, 0.03, 0.04]);
    let start = "free.shift_x.velocity = 10 mm/s, free.shift_y.velocity = 10 mm/s, free.shift_z.velocity = 10 mm/s";
    let found = block(0.0, &format!("manoeuvre m {{ start = rest {{ {start} }}, for 0.2 s }}"));
    let swing = |t: f64, m: f64, c: f64, d: f64, v: f64| {
        let (decay, omega) = (d / (2.0 * m), (c / m - (d / (2.0 * m)).powi(2)).sqrt());
        v / omega * (-decay * t).exp() * (omega * t).sin()
    };
    for (axis, (c, d)) in [(20e3, 20.0), (30e3, 30.0), (40e3, 40.0)].into_iter().enumerate() {
        for (k, value) in found[axis].iter().enumerate() {
            let expected = swing(k as f64 * 0.002, mass, c, d, 0.01);
            assert!((value - expected).abs() < 1e-9, "{axis} {k}: {value} {expected}");
        }
    }
    for (axis, (name, c, d)) in [("x", 100.0, 0.2), ("y", 200.0, 0.3), ("z", 300.0, 0.4)].into_iter().enumerate() {
        let start = format!("free.angular_velocity.{name} = 1 rad/s");
        let found = block(0.0, &format!("manoeuvre m {{ start = rest {{ {start} }}, for 0.2 s }}"));
        for (k, value) in found[3 + axis].iter().enumerate() {
            let expected = swing(k as f64 * 0.002, inertia[axis], c, d, 1.0);
            assert!((value - expected).abs() < 1e-7, "{axis} {k}: {value} {expected}");
        }
    }
}

/// A hardening bushing at rest under a load: `F = c x + k x^3`.
#[test]
fn it_hardens_with_the_third_power() {
    let text = "study s\nbody pad { mass = 1 kg }\njoint base: fixed ground -> pad\nbody b { mass = 2 kg, inertia = 0.02 kg*m^2 }\n\
                joint free: free pad -> b\npart mount: bushing at pad, b {\n\
                  stiffness = { x = 20 kN/m, y = 20 kN/m, z = 20 kN/m, turn_x = 9 N*m/rad, turn_y = 9 N*m/rad, turn_z = 9 N*m/rad }\n\
                  cubic = { y = 500 MN/m^3, turn_z = 40 N*m }\n}\n\
                force fx: external_load ground -> b along x { value = 40 N }\n\
                force fy: external_load ground -> b along y { value = 100 N }\n\
                force mz: external_load ground -> b about z { value = 1 N*m }\n\
                measure x [m] = free.shift_x.position\nmeasure y [m] = free.shift_y.position\n\
                measure c [rad] = atan2(b.axis_x.y, b.axis_x.x)\n\
                solver { tolerance = 1e-10 }\nmanoeuvre m { start = equilibrium, for 0.01 s }";
    let study = study(text);
    let record = excitation(&study, 0, 0.002);
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let run = simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure}"));
    let [x, y, c] = [0, 1, 2].map(|channel: usize| run.channels[channel][0]);
    assert!((x - 2e-3).abs() < 1e-9, "{x}");
    assert!((20e3 * y + 500e6 * y.powi(3) - 100.0).abs() < 1e-4, "{y}");
    assert!((9.0 * c + 40.0 * c.powi(3) - 1.0).abs() < 1e-6, "{c}");
}
