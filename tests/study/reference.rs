//! Every example of the language reference is part of a study that compiles to equations: what it leaves out is added
//! here, by heading and number.

use ident::diagnostics::{Diagnostic, render};
use ident::mechanics::derive;
use ident::study::{check, load};
use std::fs;
use std::path::Path;

/// What an example needs beside it.
struct Completion {
    heading: &'static str,
    /// Which of the heading's examples.
    number: usize,
    text: &'static str,
}

const fn completion(heading: &'static str, number: usize, text: &'static str) -> Completion {
    Completion { heading, number, text }
}

const COMPLETIONS: [Completion; 24] = [
    completion(
        "Numbers, units, expressions",
        1,
        "input u [mm]\nbody block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\nmeasure a [mm] = limited\nmeasure e [J] = energy\n",
    ),
    completion(
        "Study, files, gravity, constants, inputs",
        1,
        "force push: external_load on guide { value = u * 1 N/mm }\nbody load { mass = mass_of_load }\njoint guide: prismatic(z) ground -> load\n",
    ),
    completion("Bodies and points", 1, "joint a: prismatic(z) ground -> wheel\njoint b: revolute(y) wheel -> arm\n"),
    completion(
        "Bodies and points",
        2,
        "joint root: revolute(y) ground -> beam\nforce tip: spring ground -> beam.tip along z { stiffness = 1 kN/m }\n\
         measure q [mm] = beam.mode_1.position\nidentify { s_beam in 0.5 .. 2 from 1 }\n",
    ),
    completion(
        "Joints",
        1,
        "for i in 1 .. 8 { joint hold[i]: free ground -> loose[i], body loose[i] { mass = 1 kg, inertia = 1 kg*m^2 } }\n\
         body wheel { mass = 1 kg }\nbody arm { mass = 1 kg, inertia = 1 kg*m^2, point tip = (1 m, 0 m, 0 m) }\n\
         joint arm_hinge: revolute(z) ground -> arm\n\
         body rod { mass = 1 kg, inertia = 1 kg*m^2, point head = (0.1 m, 0 m, 0 m) }\nbody plate { mass = 1 kg, inertia = 1 kg*m^2 }\n\
         body shaft { mass = 1 kg, inertia = 1 kg*m^2, point end = (0 m, 0 m, 1 m) }\njoint bearing: revolute(z) ground -> shaft\n\
         body pinion { mass = 1 kg, inertia = 1 kg*m^2 }\n\
         body carbody { mass = 1 t, inertia = 1 t*m^2, point eye = (1 m, 0 m, 1 m) }\n\
         body bogie { mass = 1 t, inertia = 1 t*m^2, point eye = (1 m, 0 m, 0.38 m) }\njoint bogie_float: free ground -> bogie\n\
         body wheelset { mass = 1 t, inertia = 1 t*m^2 }\nbody pendulum { mass = 1 kg, inertia = 1 kg*m^2 }\nbody crank { mass = 1 kg, inertia = 1 kg*m^2 }\n",
    ),
    completion(
        "Couplings",
        1,
        "constant z_sun = 24\nconstant z_ring = 60\nconstant mu = 0.1\n\
         for i in 1 .. 7 { body disc[i] { mass = 1 kg, inertia = 0.1 kg*m^2 } }\nfor i in 1 .. 6 { body block[i] { mass = 1 kg } }\n\
         joint motor: revolute(z) ground -> disc[1]\njoint wheel: revolute(z) ground -> disc[2]\njoint pinion: revolute(z) ground -> disc[3]\n\
         joint spindle: revolute(z) ground -> disc[4]\njoint sun: revolute(z) ground -> disc[5]\njoint ring: revolute(z) ground -> disc[6]\n\
         joint carrier: revolute(z) ground -> disc[7]\njoint slide: prismatic(z) ground -> block[1]\n\
         joint carriage: prismatic(z) ground -> block[2]\njoint hook: prismatic(z) ground -> block[3]\n\
         joint left_end: prismatic(z) ground -> block[4]\njoint right_end: prismatic(z) ground -> block[5]\n\
         joint follower: prismatic(z) ground -> block[6]\n\
         body camdisc { mass = 1 kg, inertia = 0.1 kg*m^2 }\njoint camshaft: revolute(y) ground -> camdisc\n\
         table cam_table(turned: angle) -> length { points = ((0 deg, 0 mm), (90, 4), (180, 9)), interpolation = cubic, extrapolation = linear }\n\
         law tooth_friction(v: angular_velocity, transmitted: torque) -> torque { param share: ratio\n = -share * abs(transmitted) * tanh(v / (0.1 rad/s)) }\n",
    ),
    completion(
        "Couplings",
        2,
        "constant radius = 0.3 m\nbody hub { mass = 1 kg }\nbody wheel { mass = 2 kg, inertia = 0.05 kg*m^2 }\n\
         joint slide: prismatic(x) ground -> hub\njoint axle: revolute(y) hub -> wheel\n\
         body slider { mass = 1 kg }\nbody sledge { mass = 1 kg, inertia = 0.1 kg*m^2 }\n\
         joint plane: axes(shift x, shift y) ground -> slider\njoint heading: revolute(z) slider -> sledge\n\
         body ball { mass = 2 kg, inertia = 0.01 kg*m^2 }\njoint float: free ground -> ball\n",
    ),
    completion(
        "Forces, actuators, signals",
        1,
        "input u [mm]\ninput q_ref [mm]\nbody table { mass = 80 kg }\nbody wheel { mass = 45 kg }\nbody chassis { mass = 320 kg }\n\
         joint table_guide: prismatic(z) ground -> table\njoint wheel_guide: prismatic(z) ground -> wheel\njoint chassis_guide: prismatic(z) ground -> chassis\n\
         body rod { mass = 1 kg, inertia = 0.1 kg*m^2, point head = (0.1 m, 0.2 m, 0.2 m) }\njoint rod_float: free ground -> rod\n\
         body carbody { mass = 1 t, inertia = 1 t*m^2, point eye = (1 m, 0 m, 1 m) }\nbody bogie { mass = 1 t, inertia = 1 t*m^2, point eye = (1 m, 0.1 m, 0.4 m) }\n\
         joint car_float: free ground -> carbody\njoint bogie_float: free ground -> bogie\n\
         body wheelset { mass = 1 t, inertia = 1 t*m^2 }\njoint roller: axes(shift y, turn z, turn x) ground -> wheelset\n\
         body block { mass = 2 kg }\njoint slide: prismatic(x) ground -> block\n\
         law cascade(reference: length, position: length) -> length { = reference - position }\n\
         constant d_r = 3 kN*s/m\nconstant v_r = 0.2 m/s\nconstant m_r = 0.4\n\
         measure power_shown [W] = power\nmeasure control [mm] = controller\n\
         identify { c in 1 .. 9 kN/m from 2 kN/m, d_c in 1 .. 9 kN*s/m from 2 kN*s/m, v_c in 0.1 .. 1 m/s from 0.2 m/s, m_c in 0.1 .. 0.9 from 0.3\n\
                    f_act in 5 .. 60 Hz from 20 Hz, d_act in 0.1 .. 2 from 0.8 }\n",
    ),
    completion(
        "Measures and groups",
        1,
        "body wheel { mass = 45 kg }\nbody chassis { mass = 320 kg }\njoint wheel_guide: prismatic(z) ground -> wheel\n\
         joint chassis_guide: prismatic(z) ground -> chassis\nidentify { T_w in 0 .. 20 ms from 3 ms }\n",
    ),
    completion(
        "Experiments, filter, solver",
        1,
        "input u [mm]\nbody block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\n\
         law seal(x: length, v: velocity) -> force {\n  param stiffness: stiffness, time: time\n  state z: length from 0 mm { z' = (x - z) / time }\n  = -stiffness * (x - z)\n}\n\
         force strut: seal ground -> block { stiffness = 1 kN/m, time = 1 s }\nforce push: external_load on slide { value = u * 1 N/mm }\n\
         measure z_body [mm] = slide.position\nmeasure a_axle [m/s^2] = slide.acceleration\nconstant v0 = 1 mm/s\n",
    ),
    completion(
        "Manoeuvres and criteria",
        1,
        "input u [mm]\nbody wheel { mass = 45 kg }\nbody chassis { mass = 320 kg }\njoint wheel_guide: prismatic(z) ground -> wheel\n\
         joint chassis_guide: prismatic(z) ground -> chassis\nforce tyre: following_spring on wheel_guide { stiffness = 200 kN/m, height = u }\n\
         force strut: spring wheel -> chassis { stiffness = 20 kN/m }\n",
    ),
    completion(
        "Parameters to identify",
        1,
        "body wheel { mass = 45 kg }\nbody chassis { mass = 320 kg }\njoint wheel_guide: prismatic(z) ground -> wheel\n\
         joint chassis_guide: prismatic(z) ground -> chassis\nforce tyre: spring ground -> wheel { stiffness = 200 kN/m }\n\
         force strut: spring wheel -> chassis { stiffness = c_strut }\n\
         law sliding(v: rate, mu: ratio) -> load { = -mu * 100 N * tanh(v / (1 mm/s)) }\nforce friction: sliding on chassis_guide { mu = mu }\n\
         measure z [mm] = chassis_guide.position\n\
         experiment a estimation { data = \"a.csv\", start = equilibrium }\nexperiment b estimation { data = \"b.csv\", start = equilibrium }\n",
    ),
    completion(
        "Variants",
        1,
        "body table { mass = 80 kg }\nbody wheel { mass = 45 kg }\njoint table_guide: prismatic(z) ground -> table\njoint slide: prismatic(z) ground -> wheel\n\
         force tyre: spring table -> wheel { stiffness = 170 kN/m }\nforce hold: spring on table_guide { stiffness = 170 kN/m }\n\
         force end_stop: spring on slide { stiffness = 1 kN/m }\nmeasure z [mm] = slide.position\nconstant c_3 = 10 MN/m^3\n",
    ),
    completion(
        "Laws",
        1,
        "body block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\nforce a: maxwell on slide { stiffness = 1 kN/m, damping = 10 N*s/m }\n\
         force b: coulomb_glide on slide { friction = 0.3, normal = 20 N }\n",
    ),
    completion(
        "Laws",
        2,
        "input u [1]\nbody block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\nforce a: hard_stop on slide { limit = 3 mm, restitution = 0.4 }\n\
         force b: belt_friction on slide { applied = -(1 kN/m) * slide.position, belt = 0.1 m/s, static = 3 N, kinetic = 2 N }\n\
         signal c: sampled_pi { error = u - slide.position / (1 m), period = 1 ms, proportional = 2, integral = 3 1/s }\n\
         force d: external_load on slide { value = c * 1 N }\n",
    ),
    completion(
        "Laws",
        3,
        "body block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\nforce a: yielding_spring on slide { stiffness = 20 kN/m, limit = 300 N }\n",
    ),
    completion(
        "Effects",
        1,
        "body block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\nforce a: spring on slide { stiffness = 20 kN/m }\n\
         measure z [mm] = slide.position\neffect one: dry_friction on slide { F = 3 N, creep = 1 mm/s }\n\
         effect two: load_saturation on a { limit = 100 N }\neffect three: sensor_lag on z { tau = 3 ms }\n",
    ),
    completion(
        "Effects",
        2,
        "body block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\ngravity = 9.81 m/s^2 along -z\nidentify { F_slide in 0 .. 100 N from 20 N, a_tilt in -1 .. 1 m/s^2 from 0 m/s^2 }\nmeasure z [mm] = slide.position\n",
    ),
    completion(
        "Models, parts, families",
        1,
        "identify { c_s in 100 .. 900 kN/m from 400 kN/m }\nmeasure z_car [mm] = heave.position\n",
    ),
    completion(
        "Models, parts, families",
        2,
        "body subframe { mass = 40 kg, inertia = 2 kg*m^2, point eye = (0.1 m, 0 m, 0 m) }\nbody carbody { mass = 1 t, inertia = 1 t*m^2, point eye = (0.1 m, 0 m, 0 m) }\n\
         joint a: free ground -> subframe\njoint b: free ground -> carbody\nidentify { c_torsion in 1 .. 2000 N*m/rad from 500 N*m/rad }\n",
    ),
    completion("Models, parts, families", 3, ""),
    completion(
        "Tables",
        1,
        "body block { mass = 2 kg }\njoint slide: prismatic(z) ground -> block\nforce a: damper_curve on slide\nforce c: damper_map on slide\nforce b: following_spring on slide { stiffness = 1 kN/m, height = track_height(3 m/s * t) }\n",
    ),
    completion(
        "Tables",
        2,
        "constant speed = 20 m/s\nconstant roughness = 1e-6 m\nbody wheel { mass = 500 kg }\njoint wheel_guide: prismatic(z) ground -> wheel\n\
         measure rear [mm] = under_rear_wheel\nmeasure front [mm] = under_front_wheel\nidentify { e_3 in 0 .. 1 mm from 0.1 mm }\n",
    ),
    completion(
        "Tables",
        3,
        "table damper_curve(v: rate) -> load { points = ((-1 m/s, 3.1 kN), (0, 0), (1, -1.8)), interpolation = monotone, extrapolation = linear }\n\
         table track_height(s: length) -> length { file = \"track.csv\", interpolation = monotone, extrapolation = constant }\n\
         table damper_map(x: length, v: velocity) -> force { points = ((0 mm, 0 m/s, 0 N), (1, 0, 1), (0, 1, -9), (1, 1, -7)), interpolation = linear, extrapolation = linear }\n\
         measure spare_shown [N] = spare\nbody wheel { mass = 45 kg }\nbody chassis { mass = 320 kg }\njoint wheel_guide: prismatic(z) ground -> wheel\n\
         joint chassis_guide: prismatic(z) ground -> chassis\nbody train { mass = 1 t }\njoint run: prismatic(x) ground -> train\n\
         force other: symmetric_damper wheel -> chassis\nmeasure height [mm] = height_below_axle\nidentify { wear in 0.1 .. 2 from 1 }\n",
    ),
];

/// (heading, number under it, text)
fn examples(reference: &str) -> Vec<(String, usize, String)> {
    let mut found = Vec::new();
    for section in reference.split("\n## ").skip(1) {
        let heading = section.lines().next().unwrap_or_default().to_owned();
        let blocks = section.split("```ident\n").skip(1).filter_map(|rest| rest.split("```").next());
        found.extend(blocks.enumerate().map(|(at, block)| (heading.clone(), at + 1, block.to_owned())));
    }
    found
}

fn compiled(text: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable folder");
        fs::write(path, text).expect("writable folder");
    };
    let modes = fs::read_to_string(root.join("tests/mechanics/beam_modes.csv")).expect("modes of the beam");
    file("tests/mechanics/beam_modes.csv", &modes);
    file("bogie.ident", "constant wheel_radius = 460 mm\n");
    file("track.csv", "s [m],height [mm]\n0,0\n1,2\n2,-1\n3,0\n");
    file("study.ident", text);
    let loaded = load(&folder.path().join("study.ident"));
    let told = |findings: Vec<Diagnostic>| render(&findings, &loaded.sources, false);
    let checked = check(&loaded, None).map_err(told)?;
    derive(&checked.study).map_err(told)?;
    let variants: Vec<&str> =
        text.lines().filter_map(|line| line.strip_prefix("variant ")?.split(' ').next()).collect();
    for variant in variants {
        let checked = check(&loaded, Some(variant)).map_err(told)?;
        derive(&checked.study).map_err(told)?;
    }
    Ok(())
}

#[test]
fn every_example_of_the_reference_compiles() {
    let reference =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("grammar/README.md")).expect("the reference");
    let mut faults = String::new();
    let examples = examples(&reference);
    assert_eq!(examples.len(), COMPLETIONS.len(), "one completion per example");
    for (heading, number, code) in &examples {
        let known = COMPLETIONS.iter().find(|c| c.heading == heading && c.number == *number);
        let completion = known.unwrap_or_else(|| panic!("no completion of example {number} of {heading}"));
        let head = if code.contains("study ") { "" } else { "study example\n" };
        let text = format!("{head}{code}{}", completion.text);
        if let Err(findings) = compiled(&text) {
            faults += &format!("---- example {number} of `{heading}`\n{findings}\n");
        }
    }
    assert!(faults.is_empty(), "{faults}");
}

/// The fragments of README's line-by-line study are together a study that compiles.
#[test]
fn readmes_own_study_compiles() {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("README.md");
    let blocks: Vec<&str> = text.split("```ident\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 5, "{} fragments", blocks.len());
    if let Err(findings) = compiled(&blocks.concat()) {
        panic!("{findings}");
    }
    // Left out, every fragment is missed by the rest: none of them stands there without being read.
    for left_out in 0..blocks.len() {
        let rest: Vec<&str> = (0..blocks.len()).filter(|&at| at != left_out).map(|at| blocks[at]).collect();
        let told = compiled(&rest.concat());
        let needed = !blocks[left_out].contains("experiment ") && !blocks[left_out].contains("measure ");
        assert_eq!(told.is_err(), needed, "without\n{}", blocks[left_out]);
    }
}
