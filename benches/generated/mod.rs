//! Study texts of any size, for measurements of growth.

use std::fmt::Write;

/// A chain of `count` spatial bodies on hinges about changing axes, each with a spring and a damper.
pub fn chain(count: usize) -> String {
    let mut text = format!("study chain \"Chain of {count} bodies\"\ngravity = 9.81 m/s^2 along -z\n");
    for i in 0..count {
        let parent = if i == 0 { "ground".to_owned() } else { format!("link_{}.tip", i - 1) };
        hinged_body(&mut text, i, &parent);
    }
    let last = count - 1;
    let _ = writeln!(text, "measure tip_z [m] = link_{last}.tip.position.z");
    finish(&mut text, "damper_0.damping in 0 .. 5 N*m*s/rad from 0.5 N*m*s/rad")
}

/// As [`chain`], but every body carries two others.
pub fn tree(count: usize) -> String {
    let mut text = format!("study tree \"Tree of {count} bodies\"\ngravity = 9.81 m/s^2 along -z\n");
    for i in 0..count {
        let parent = if i == 0 { "ground".to_owned() } else { format!("link_{}.tip", (i - 1) / 2) };
        hinged_body(&mut text, i, &parent);
    }
    let last = count - 1;
    let _ = writeln!(text, "measure tip_z [m] = link_{last}.tip.position.z");
    finish(&mut text, "damper_0.damping in 0 .. 5 N*m*s/rad from 0.5 N*m*s/rad")
}

fn hinged_body(text: &mut String, i: usize, parent: &str) {
    let axis = ["x", "y", "0, 0.6, 0.8", "z"][i % 4];
    let _ = writeln!(
        text,
        "body link_{i} {{ mass = 1 kg, centre_of_gravity = (0 m, 0.05 m, -0.1 m), inertia = (0.02, 0.03, 0.01 kg*m^2), point tip = (0.02 m, 0 m, -0.2 m) }}\n\
         joint hinge_{i}: revolute({axis}) {parent} -> link_{i}\n\
         force spring_{i}: spring on hinge_{i} {{ stiffness = 50 N*m/rad }}\n\
         force damper_{i}: damper on hinge_{i} {{ damping = 0.5 N*m*s/rad }}"
    );
}

fn finish(text: &mut String, identified: &str) -> String {
    let _ = writeln!(text, "experiment run {{ data = \"run.csv\", start = rest }}\nidentify {{ {identified} }}");
    std::mem::take(text)
}

/// Elastically mounted bodies in the carbody.
const EQUIPMENT: usize = 33;

/// A rail vehicle of the reference application's size: 73 bodies, 17 closed loops, 158 force elements, 34 parameters.
///
/// Carbody, two bogies with two wheelsets, axle boxes on radius rods, anti-roll bars, traction rods, motors on torque
/// rods, and elastically mounted equipment; the wheelsets stand on shaken rails.
pub fn vehicle() -> String {
    let mut v = Vehicle {
        text: String::from("study vehicle \"Rail vehicle about its equilibrium\"\n"),
        bodies: 0,
        loops: 0,
        forces: 0,
    };
    v.body(
        "carbody",
        30_000.0,
        [60_000.0, 1_500_000.0, 1_500_000.0],
        &[("front", [9.0, 0.0, -0.9]), ("rear", [-9.0, 0.0, -0.9])],
    );
    v.line("joint carbody_joint: free ground -> carbody");
    for (b, (bogie, side)) in [("front", 1.0), ("rear", -1.0)].into_iter().enumerate() {
        v.bogie(b, bogie, 9.0 * side);
    }
    for i in 0..EQUIPMENT {
        let x = -8.0 + 16.0 * i as f64 / (EQUIPMENT - 1) as f64;
        let name = format!("equipment_{i}");
        v.body(&name, 200.0 + 10.0 * i as f64, [10.0, 10.0, 10.0], &[]);
        v.point_on("carbody", &format!("seat_{i}"), [x, 0.4 - 0.8 * (i % 2) as f64, -0.5]);
        v.line(&format!("joint {name}_guide: prismatic(z) carbody.seat_{i} -> {name}"));
        v.pair(&format!("mount_{i}"), &format!("on {name}_guide"), 4.0e5 + 1.0e4 * i as f64, 2.0e3);
    }
    assert_eq!((v.bodies, v.loops, v.forces), (73, 17, 158));
    v.line("measure z_body [mm] = carbody.position.z");
    v.line("measure a_floor [m/s^2] = carbody.front.acceleration.z");
    v.line("measure y_bogie [mm] = frame_front.position.y");
    v.line("measure a_box [m/s^2] = box_front_0_left.acceleration.z");
    let mut identified: Vec<String> = Vec::new();
    for bogie in ["front", "rear"] {
        for axle in 0..2 {
            for (element, range) in [
                ("primary_z_{}.spring.stiffness", "0.2 .. 5 MN/m from 1.1 MN/m"),
                ("primary_z_{}.damper.damping", "0 .. 50 kN*s/m from 9 kN*s/m"),
                ("primary_x_{}.spring.stiffness", "1 .. 50 MN/m from 9 MN/m"),
            ] {
                for side in ["left", "right"] {
                    let path = element
                        .replace("{}", &format!("{bogie}_{axle}_{side}"))
                        .replace(".spring", "_spring")
                        .replace(".damper", "_damper");
                    identified.push(format!("{path} in {range}"));
                }
            }
        }
        for (element, range) in [
            ("secondary_z_{}_left_spring.stiffness", "0.1 .. 2 MN/m from 0.45 MN/m"),
            ("secondary_z_{}_right_damper.damping", "0 .. 80 kN*s/m from 25 kN*s/m"),
            ("secondary_y_{}_left_spring.stiffness", "0.05 .. 1 MN/m from 0.18 MN/m"),
            ("secondary_y_{}_right_damper.damping", "0 .. 80 kN*s/m from 28 kN*s/m"),
            ("yaw_{}_left.damping", "0 .. 900 kN*s/m from 200 kN*s/m"),
        ] {
            identified.push(format!("{} in {range}", element.replace("{}", bogie)));
        }
    }
    assert_eq!(identified.len(), 34);
    v.line("identify {");
    identified.iter().for_each(|line| v.line(line));
    v.line("}");
    v.line("experiment run { data = \"run.csv\", start = rest { carbody_joint.shift_z.velocity = 0.2 m/s, carbody_joint.shift_y.velocity = 0.1 m/s } }");
    v.text
}

/// Ends the declaration of a body, so that points can be added to it.
fn mark(body: &str) -> String {
    format!(" }} // {body} ends")
}

struct Vehicle {
    text: String,
    bodies: usize,
    loops: usize,
    forces: usize,
}

impl Vehicle {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn body(&mut self, name: &str, mass: f64, inertia: [f64; 3], points: &[(&str, [f64; 3])]) {
        let [x, y, z] = inertia;
        let mut line = format!("body {name} {{ mass = {mass} kg, inertia = ({x}, {y}, {z} kg*m^2)");
        for (point, [x, y, z]) in points {
            let _ = write!(line, ", point {point} = ({x} m, {y} m, {z} m)");
        }
        self.line(&(line + &mark(name)));
        self.bodies += 1;
    }

    fn point_on(&mut self, body: &str, point: &str, [x, y, z]: [f64; 3]) {
        let at = self.text.find(&mark(body)).expect("a body");
        self.text.insert_str(at, &format!(", point {point} = ({x} m, {y} m, {z} m)"));
    }

    /// Spring and damper.
    fn pair(&mut self, name: &str, place: &str, stiffness: f64, damping: f64) {
        self.line(&format!("force {name}_spring: spring {place} {{ stiffness = {stiffness} N/m }}"));
        self.line(&format!("force {name}_damper: damper {place} {{ damping = {damping} N*s/m }}"));
        self.forces += 2;
    }

    /// A rod between two points, hinged like a cardan shaft at one end and with a ball at the other, which closes a
    /// loop.
    fn rod(&mut self, name: &str, from: &str, to: &str, reach: [f64; 3]) {
        let middle = reach.map(|x| x / 2.0);
        self.body(name, 15.0, [0.4, 0.4, 0.4], &[("end", reach)]);
        let [x, y, z] = middle;
        let own = format!("mass = 15 kg, centre_of_gravity = ({x} m, {y} m, {z} m)");
        let at = self.text.rfind("mass = 15 kg").expect("the rod");
        self.text.replace_range(at..at + "mass = 15 kg".len(), &own);
        let across = if reach[0].abs() > reach[2].abs() { "y, z" } else { "x, y" };
        self.line(&format!("joint {name}_pin: universal({across}) {from} -> {name}"));
        self.line(&format!("joint {name}_ball: spherical {name}.end -> {to}"));
        self.loops += 1;
    }

    fn bogie(&mut self, b: usize, bogie: &str, x: f64) {
        let frame = format!("frame_{bogie}");
        self.body(&frame, 3_000.0, [1_500.0, 2_500.0, 3_500.0], &[]);
        self.point_on("carbody", &format!("pivot_{bogie}"), [x, 0.0, -0.9]);
        self.line(&format!("joint {frame}_joint: free carbody.pivot_{bogie} -> {frame}"));
        for (side, y) in [("left", 1.0), ("right", -1.0)] {
            self.point_on(&frame, &format!("spring_{side}"), [0.0, y, 0.3]);
            self.point_on("carbody", &format!("spring_{bogie}_{side}"), [x, y, -0.6]);
            let place = format!("{frame}.spring_{side} -> carbody.spring_{bogie}_{side} along");
            for (axis, stiffness, damping) in [("x", 1.6e5, 5.0e3), ("y", 1.8e5, 2.8e4), ("z", 4.5e5, 2.5e4)] {
                self.pair(&format!("secondary_{axis}_{bogie}_{side}"), &format!("{place} {axis}"), stiffness, damping);
            }
            self.line(&format!("force yaw_{bogie}_{side}: damper {frame}.spring_{side} -> carbody.spring_{bogie}_{side} along x {{ damping = 200 kN*s/m }}"));
            self.forces += 1;
            // Anti-roll bar: a lever on the frame, a rod to the carbody.
            let lever = format!("lever_{bogie}_{side}");
            self.body(&lever, 40.0, [2.0, 2.0, 2.0], &[("tip", [0.4, 0.0, 0.0])]);
            self.point_on(&frame, &format!("bar_{side}"), [-0.4, 0.8 * y, 0.2]);
            self.point_on("carbody", &format!("bar_{bogie}_{side}"), [x, 0.8 * y, -0.2]);
            self.line(&format!("joint {lever}_hinge: revolute(y) {frame}.bar_{side} -> {lever}"));
            self.rod(
                &format!("link_{bogie}_{side}"),
                &format!("{lever}.tip"),
                &format!("carbody.bar_{bogie}_{side}"),
                [0.0, 0.0, 0.5],
            );
        }
        self.point_on(&frame, "traction", [0.5, 0.0, 0.0]);
        self.point_on("carbody", &format!("traction_{bogie}"), [x - 0.5, 0.0, -0.9]);
        self.rod(
            &format!("traction_{bogie}"),
            &format!("{frame}.traction"),
            &format!("carbody.traction_{bogie}"),
            [-1.0, 0.0, 0.0],
        );
        for axle in 0..2 {
            self.wheelset(b, bogie, axle, &frame);
        }
    }

    fn wheelset(&mut self, b: usize, bogie: &str, axle: usize, frame: &str) {
        let wheelset = format!("wheelset_{bogie}_{axle}");
        let x = if axle == 0 { 1.25 } else { -1.25 };
        self.body(&wheelset, 1_500.0, [900.0, 100.0, 900.0], &[("left", [0.0, 1.0, 0.0]), ("right", [0.0, -1.0, 0.0])]);
        self.point_on(frame, &format!("axle_{axle}"), [x, 0.0, -0.2]);
        self.line(&format!("joint {wheelset}_joint: free {frame}.axle_{axle} -> {wheelset}"));
        self.line(&format!(
            "force rail_z_{bogie}_{axle}_spring: spring ground -> {wheelset} along z {{ stiffness = 50 MN/m }}"
        ));
        self.line(&format!(
            "force rail_y_{bogie}_{axle}_damper: damper ground -> {wheelset} along y {{ damping = 300 kN*s/m }}"
        ));
        self.forces += 2;
        for (side, y) in [("left", 1.0), ("right", -1.0)] {
            let axle_box = format!("box_{bogie}_{axle}_{side}");
            self.body(&axle_box, 120.0, [4.0, 4.0, 4.0], &[("arm", [0.2, 0.0, 0.0])]);
            self.line(&format!("joint {axle_box}_bearing: revolute(y) {wheelset}.{side} -> {axle_box}"));
            self.point_on(frame, &format!("box_{axle}_{side}"), [x, y, -0.2]);
            let place = format!("{frame}.box_{axle}_{side} -> {axle_box} along");
            for (axis, stiffness, damping) in [("x", 9.0e6, 1.0e4), ("y", 4.0e6, 1.0e4), ("z", 1.1e6, 9.0e3)] {
                self.pair(
                    &format!("primary_{axis}_{bogie}_{axle}_{side}"),
                    &format!("{place} {axis}"),
                    stiffness,
                    damping,
                );
            }
            self.point_on(frame, &format!("radius_{axle}_{side}"), [x + 0.7, y, -0.2]);
            self.rod(
                &format!("radius_{bogie}_{axle}_{side}"),
                &format!("{axle_box}.arm"),
                &format!("{frame}.radius_{axle}_{side}"),
                [0.5, 0.0, 0.0],
            );
        }
        let motor = format!("motor_{bogie}_{axle}");
        self.body(&motor, 800.0, [50.0, 50.0, 50.0], &[("nose", [0.6, 0.0, 0.0])]);
        self.point_on(frame, &format!("motor_{axle}"), [x / 2.0, 0.0, 0.1]);
        if b == 1 && axle == 1 {
            self.line(&format!("joint {motor}_guide: prismatic(z) {frame}.motor_{axle} -> {motor}"));
            self.pair(&format!("{motor}_mount"), &format!("on {motor}_guide"), 3.0e6, 6.0e3);
        } else {
            // A motor on a rocking hinge, held by a rod whose far end slides in a rubber: the rod closes the loop.
            self.line(&format!("joint {motor}_joint: axes(shift z, turn y) {frame}.motor_{axle} -> {motor}"));
            self.pair(&format!("{motor}_mount"), &format!("on {motor}_joint.shift_z"), 3.0e6, 6.0e3);
            self.point_on(frame, &format!("nose_{axle}"), [x / 2.0 + 0.6, 0.0, 0.5]);
            self.rod(
                &format!("torque_{bogie}_{axle}"),
                &format!("{motor}.nose"),
                &format!("{frame}.nose_{axle}"),
                [0.0, 0.0, 0.4],
            );
        }
    }
}
