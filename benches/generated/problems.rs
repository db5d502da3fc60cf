//! The reference problems P1 (quarter vehicle on a rig) and P2 (chain of forty bodies) as studies of bodies, joints and
//! laws.

use std::f64::consts::PI;
use std::fmt::Write;

/// The damper and the friction of the reference problems; the actuator follows its command whatever pushes against it.
const LAWS: &str = "
law digressive(v: rate) -> load {
  param extension.slope: load/rate, extension.knee: rate, extension.ratio: ratio
  param compression.slope: load/rate, compression.knee: rate, compression.ratio: ratio
  = if v < 0 m/s
    then -compression.slope * v * (compression.ratio + (1 - compression.ratio) / sqrt(1 + (v / compression.knee)^2))
    else -extension.slope * v * (extension.ratio + (1 - extension.ratio) / sqrt(1 + (v / extension.knee)^2))
}
law servo(x: coordinate, v: rate, inertia: load/acceleration, command: coordinate, carried: load) -> load {
  param largest: acceleration
  let omega = 2 * pi * 25 Hz
  = inertia * largest * tanh((omega^2 * (command - x) - 2 * 0.7 * omega * v) / largest) + carried
}
";

/// `sum A0/f_i sin(2 pi f_i t + phi_i)`, in m.
fn sines(count: usize, low: f64, high: f64, amplitude: f64, offset: usize) -> String {
    let golden = 0.618_033_988_749_894_9_f64;
    let mut text = String::new();
    for i in 1..=count {
        let frequency = low * (high / low).powf((i - 1) as f64 / (count - 1) as f64);
        let phase = 2.0 * PI * ((i + offset) as f64 * golden).fract();
        let plus = if i == 1 { "" } else { " + " };
        let _ = write!(
            text,
            "{plus}{:.17} m * sin({:.17} rad/s * t + {phase:.17})",
            amplitude / frequency,
            2.0 * PI * frequency
        );
    }
    text
}

fn actuator(text: &mut String, index: usize, command: &str, body: &str, stiffness: &str) {
    let _ = writeln!(
        text,
        "signal command_{index} = {command}\n\
         body table_{index} {{ mass = 1 kg }}\n\
         joint slide_{index}: prismatic(z) ground -> table_{index}\n\
         actuator servo_{index}: servo on slide_{index} {{ command = command_{index}, carried = tyre_{index}.force + tyre_damper_{index}.force, largest = 60 m/s^2 }}\n\
         force tyre_{index}: spring table_{index} -> {body} {{ stiffness = {stiffness} }}\n\
         force tyre_damper_{index}: damper table_{index} -> {body} {{ damping = 150 N*s/m }}"
    );
}

/// Quarter vehicle: 6 states, 10 parameters, 4 measures.
pub fn p1(tolerance: f64) -> String {
    let mut text = format!("study p1 \"Quarter vehicle on a rig\"{LAWS}");
    text += "body wheel { mass = m_u }\nbody chassis { mass = 400 kg }\n\
             joint wheel_guide: prismatic(z) ground -> wheel\njoint chassis_guide: prismatic(z) ground -> chassis\n";
    actuator(&mut text, 0, &sines(16, 0.5, 25.0, 0.012, 0), "wheel", "k_t");
    text += "force strut: spring wheel -> chassis { stiffness = k_s }\n\
             force damper: digressive wheel -> chassis {\n\
               extension = { slope = ma_e, knee = vgr_e, ratio = mve_e }\n\
               compression = { slope = ma_c, knee = vgr_c, ratio = mve_c }\n\
             }\n\
             force glide: coulomb_glide wheel -> chassis { friction = mu, normal = 2000 N, creep = 1 mm/s }\n\
             measure deflection [m] = chassis_guide.position - wheel_guide.position\n\
             measure tyre [m] = wheel_guide.position - slide_0.position\n\
             measure v_chassis [m/s] = chassis_guide.velocity\n\
             measure v_wheel [m/s] = wheel_guide.velocity\n\
             identify {\n\
               k_s in 5 .. 80 kN/m from 20 kN/m\n  k_t in 50 .. 800 kN/m from 200 kN/m\n  m_u in 10 .. 160 kg from 40 kg\n\
               ma_e in 500 .. 9000 N*s/m from 3000 N*s/m\n  vgr_e in 0.01 .. 1 m/s from 0.12 m/s\n  mve_e in 0.01 .. 1 from 0.25\n\
               ma_c in 500 .. 9000 N*s/m from 1500 N*s/m\n  vgr_c in 0.01 .. 1 m/s from 0.15 m/s\n  mve_c in 0.01 .. 1 from 0.30\n\
               mu in 0.001 .. 0.5 from 0.05\n\
             }\n";
    finish(text, tolerance)
}

/// Chain of forty bodies on four actuators: 88 states, 34 parameters, 33 measures.
pub fn p2(tolerance: f64) -> String {
    let mut text = format!("study p2 \"Chain vehicle\"{LAWS}");
    for i in 1..=40 {
        let mass = 20 + 10 * ((7 * i) % 5);
        let _ = writeln!(text, "body b_{i} {{ mass = {mass} kg }}\njoint g_{i}: prismatic(z) ground -> b_{i}");
    }
    for (a, body) in [1, 14, 27, 40].into_iter().enumerate() {
        let low = 0.5 + 0.1 * a as f64;
        let command = sines(8, low, 8.0 - 0.5 * a as f64, 0.015, 8 * a);
        actuator(&mut text, a, &command, &format!("b_{body}"), &format!("kt_{a}"));
    }
    for j in 1..=39 {
        let (k, d, m) = ((j - 1) % 8, (j - 1) % 3, (j - 1) % 4);
        let ends = format!("b_{j} -> b_{}", j + 1);
        let _ = writeln!(
            text,
            "force s_{j}: spring {ends} {{ stiffness = k_{k} }}\n\
             force d_{j}: digressive {ends} {{\n  extension = {{ slope = mae_{d}, knee = vge_{d}, ratio = mve_{d} }}\n  \
             compression = {{ slope = mac_{d}, knee = vgc_{d}, ratio = mvc_{d} }}\n}}\n\
             force f_{j}: coulomb_glide {ends} {{ friction = mu_{m}, normal = 1000 N, creep = 1 mm/s }}"
        );
    }
    for body in (2..=40).step_by(2) {
        let _ = writeln!(text, "measure v_{body} [m/s] = g_{body}.velocity");
    }
    for joint in (3..=39).step_by(3) {
        let _ = writeln!(text, "measure x_{joint} [m] = g_{}.position - g_{joint}.position", joint + 1);
    }
    text += "identify {\n";
    for g in 0..8 {
        let _ = writeln!(text, "  k_{g} in 20 .. 500 kN/m from {} kN/m", 100.0 * (1.0 + 0.1 * g as f64));
    }
    for g in 0..3 {
        let f = g as f64;
        for (name, unit, value) in [
            ("mae", "N*s/m", 1500.0 + 250.0 * f),
            ("vge", "m/s", 0.10 + 0.02 * f),
            ("mve", "", 0.25 + 0.05 * f),
            ("mac", "N*s/m", 800.0 + 150.0 * f),
            ("vgc", "m/s", 0.12 + 0.02 * f),
            ("mvc", "", 0.30 + 0.05 * f),
        ] {
            let (low, high) = (0.1 * value, 10.0 * value);
            let _ = writeln!(text, "  {name}_{g} in {low} .. {high} {unit} from {value} {unit}");
        }
    }
    for g in 0..4 {
        let _ = writeln!(text, "  mu_{g} in 0.001 .. 0.5 from {}", 0.030 + 0.005 * g as f64);
    }
    for a in 0..4 {
        let _ = writeln!(text, "  kt_{a} in 50 .. 800 kN/m from {} kN/m", 200.0 * (1.0 + 0.05 * a as f64));
    }
    text += "}\n";
    finish(text, tolerance)
}

fn finish(mut text: String, tolerance: f64) -> String {
    let _ =
        writeln!(text, "experiment run {{ data = \"run.csv\", start = rest }}\nsolver {{ tolerance = {tolerance:e} }}");
    text
}
