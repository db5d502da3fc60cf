//! Mechanisms declared as bodies and joints, against published solutions and closed forms.

#![allow(clippy::needless_range_loop, reason = "several channels are read side by side")]

use ident::diagnostics::render;
use ident::simulation::{Compiled, Gradient, prepare, simulate};
use ident::study::{check, load_text};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Channels by name, at the samples of `record`.
fn simulated(name: &str, text: &str, record: &str) -> BTreeMap<String, Vec<f64>> {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("run.csv"), record).expect("writable folder");
    let loaded = load_text(&format!("{name}.ident"), text);
    let complain = |findings: &[_]| -> ! { panic!("{}", render(findings, &loaded.sources, false)) };
    let checked = check(&loaded, None).unwrap_or_else(|findings| complain(&findings));
    let compiled = Compiled::new(checked.study).unwrap_or_else(|findings| complain(&findings));
    let (records, findings) = prepare(&compiled.study, folder.path(), &[]);
    if findings.iter().any(|finding| finding.is_error()) {
        complain(&findings);
    }
    let theta: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    let trajectory = simulate(&compiled, &records[0], &theta, Gradient::None).unwrap_or_else(|f| panic!("{f:?}"));
    let names = records[0].measures.iter().map(|&measure| compiled.study.measures[measure].name.clone());
    names.zip(trajectory.channels).collect()
}

fn study(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/multibody/{name}.ident"));
    fs::read_to_string(path).expect("the study")
}

/// The reference data, or a printed reason why the test is skipped.
fn shared(path: &str) -> Option<String> {
    let root = std::env::var_os("IDENT_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let path = root.join("data").join(path);
    let text = fs::read_to_string(&path).ok();
    if text.is_none() {
        println!("skipped: {} is not there", path.display());
    }
    text
}

struct Table {
    heads: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    fn read(text: &str) -> Self {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let heads = reader.headers().expect("heads").iter().map(str::to_owned).collect();
        let rows = reader
            .records()
            .map(|row| row.expect("a row").iter().map(|cell| cell.parse().expect("a number")).collect())
            .collect();
        Self { heads, rows }
    }

    fn column(&self, head: &str) -> Vec<f64> {
        let at = self.heads.iter().position(|own| own == head).unwrap_or_else(|| panic!("no column {head}"));
        self.rows.iter().map(|row| row[at]).collect()
    }
}

fn record(columns: &[(&str, Vec<f64>)]) -> String {
    let heads: Vec<&str> = columns.iter().map(|(head, _)| *head).collect();
    let mut text = heads.join(",") + "\n";
    for row in 0..columns[0].1.len() {
        let cells: Vec<String> = columns.iter().map(|(_, values)| format!("{:e}", values[row])).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn size(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Seven bodies, ten revolute joints, three loops: positions along the whole motion, the crank's velocity and
/// acceleration, and the force in one of the closing joints.
#[test]
fn andrews_mechanism_moves_as_published() {
    let Some(text) = shared("ivp/andrews_trajectory.csv") else { return };
    let reference = Table::read(&text);
    let pairs = [
        ("q_beta", "beta[rad]", 1e-7),
        ("q_theta", "Theta[rad]", 1e-7),
        ("q_gamma", "gamma[rad]", 1e-6),
        ("q_phi", "phi[rad]", 1e-6),
        ("q_delta", "delta[rad]", 1e-7),
        ("q_omega", "omega[rad]", 1e-6),
        ("q_epsilon", "epsilon[rad]", 1e-7),
        ("v_beta [rad/s]", "d_beta[rad/s]", 1e-6),
        ("a_beta [rad/s^2]", "dd_beta[rad/s^2]", 1e-5),
        ("l1 [N]", "lambda1[N]", 1e-5),
        ("l2 [N]", "lambda2[N]", 1e-5),
    ];
    let mut columns = vec![("t [s]", reference.column("t[s]"))];
    columns.extend(pairs.map(|(own, theirs, _)| (own, reference.column(theirs))));
    let own = simulated("andrews", &study("andrews"), &record(&columns));
    for (name, theirs, accuracy) in pairs {
        let name = name.split(' ').next().unwrap_or_default();
        let theirs = reference.column(theirs);
        let error = largest_difference(&own[name], &theirs) / size(&theirs);
        println!("andrews {name}: largest error {error:.1e} of its size");
        assert!(error < accuracy, "{name}: {error:.2e}");
    }
}

/// A guide that turns as prescribed, a massless rod, two point masses: positions at the end, and the rod's force.
#[test]
fn car_axis_moves_as_published() {
    let Some(text) = shared("ivp/car_axis_trajectory.csv") else { return };
    let reference = Table::read(&text);
    let [xl, xr, lambda] = ["xl[m]", "xr[m]", "lambda2[1]"].map(|head| reference.column(head));
    let tension: Vec<f64> = (0..xl.len()).map(|i| -2e4 * lambda[i] * (xl[i] - xr[i])).collect();
    let pairs = [
        ("xl [m]", reference.column("xl[m]"), 1e-7),
        ("yl [m]", reference.column("yl[m]"), 1e-7),
        ("xr [m]", reference.column("xr[m]"), 1e-7),
        ("yr [m]", reference.column("yr[m]"), 1e-7),
        ("v_yr [m/s]", reference.column("d_yr[m/s]"), 1e-6),
        ("tension_x [N]", tension, 1e-4),
    ];
    let mut columns = vec![("t [s]", reference.column("t[s]"))];
    columns.extend(pairs.iter().map(|(own, theirs, _)| (*own, theirs.clone())));
    let own = simulated("car_axis", &study("car_axis"), &record(&columns));
    for (name, theirs, accuracy) in pairs {
        let name = name.split(' ').next().unwrap_or_default();
        let error = largest_difference(&own[name], &theirs) / size(&theirs);
        println!("car axis {name}: largest error {error:.1e} of its size");
        assert!(error < accuracy, "{name}: {error:.2e}");
    }
}

/// Angle and rate of the pendulum of the hinge, ball and universal cases at 1 .. 5 s, good to all digits.
const PENDULUM: [(f64, f64); 5] = [
    (2.033300678182, 2.926138323709),
    (2.920045216315, -1.449948150556),
    (0.363706250701, -1.844866925090),
    (0.865207275038, 2.698710293687),
    (3.123812342989, 0.412436065475),
];
const DAMPED_PENDULUM: [(f64, f64); 5] = [
    (0.071282632715, 0.120181664592),
    (0.093521368627, 0.057566393239),
    (0.097945136662, 0.017040785390),
    (0.098120660006, 0.003125418964),
    (0.097818710858, 0.000007726005),
];

/// Accuracy of the printed curves by quantity: position, velocity, acceleration, angular rate, force, torque.
struct Printed {
    position: f64,
    velocity: f64,
    acceleration: f64,
    rate: f64,
    force: f64,
}

impl Printed {
    fn of(&self, head: &str) -> f64 {
        match head.as_bytes() {
            [b'x' | b'y' | b'z', b'['] | [b'x' | b'y' | b'z', b'[', ..] => self.position,
            [b'v', ..] => self.velocity,
            [b'a', ..] => self.acceleration,
            [b'w', b'd', ..] => self.acceleration,
            [b'w', ..] => self.rate,
            _ => self.force,
        }
    }
}

const PRINTED: Printed = Printed { position: 6e-6, velocity: 6e-6, acceleration: 7e-4, rate: 6e-6, force: 7e-4 };
/// The reference curves themselves carry an integration error there.
const COARSE: Printed = Printed { position: 9e-4, velocity: 2.7e-3, acceleration: 1.4e-2, rate: 1.1e-3, force: 1.4e-2 };

/// All channels of a case against the table; returns the channels.
fn joint_case(name: &str, file: &str, printed: &Printed) -> Option<BTreeMap<String, Vec<f64>>> {
    let text = shared(&format!("joints/{file}.csv"))?;
    let reference = Table::read(&text);
    let own = simulated(name, &study(name), &text);
    for (channel, values) in &own {
        let head = reference.heads.iter().find(|head| head.split('[').next() == Some(channel)).expect("a column");
        let error = largest_difference(values, &reference.column(head));
        println!("{name} {head}: largest difference {error:.1e}");
        assert!(error <= printed.of(head), "{name} {head}: {error:.2e}");
    }
    Some(own)
}

/// Positions and rate at full seconds against own values: two metres below or beside the joint.
fn full_seconds(own: &BTreeMap<String, Vec<f64>>, across: &str, rate: (&str, f64), values: [(f64, f64); 5]) {
    for (k, (angle, velocity)) in values.into_iter().enumerate() {
        let at = 100 * (k + 1);
        for (channel, expected) in [(across, 2.0 * angle.cos()), ("z", -2.0 * angle.sin()), (rate.0, rate.1 * velocity)]
        {
            let error = (own[channel][at] - expected).abs();
            assert!(error < 2e-8, "{channel} at {} s: {error:.2e}", k + 1);
        }
    }
}

#[test]
fn pendulum_on_a_hinge() {
    if let Some(own) = joint_case("revolute", "Revolute_Case01", &PRINTED) {
        full_seconds(&own, "x", ("wy", 1.0), PENDULUM);
    }
}

#[test]
fn pendulum_on_a_ball_joint() {
    if let Some(own) = joint_case("spherical", "Spherical_Case01", &COARSE) {
        full_seconds(&own, "x", ("wy", 1.0), PENDULUM);
    }
}

#[test]
fn pendulum_on_a_universal_joint() {
    if let Some(own) = joint_case("universal", "Universal_Case01", &COARSE) {
        full_seconds(&own, "y", ("wx", -1.0), PENDULUM);
    }
}

#[test]
fn pendulum_with_a_torsional_spring() {
    if let Some(own) = joint_case("rotational_spring", "RotSpring_Case01", &PRINTED_WITH_TORQUE) {
        full_seconds(&own, "x", ("wy", 1.0), DAMPED_PENDULUM);
    }
}

const PRINTED_WITH_TORQUE: Printed =
    Printed { position: 6e-6, velocity: 1.1e-5, acceleration: 9e-4, rate: 6e-6, force: 9e-4 };

#[test]
fn free_fall_along_a_guide() {
    let printed = Printed { position: 5e-4, velocity: 6e-5, ..PRINTED };
    if let Some(own) = joint_case("prismatic", "Prismatic_Case01", &printed) {
        assert!((own["z"][500] + 9.80665 * 12.5).abs() < 1e-9);
    }
}

#[test]
fn mass_on_a_spring_of_no_length() {
    let printed = Printed { acceleration: 6e-6, force: 6e-5, ..PRINTED };
    let Some(own) = joint_case("translational_spring", "TransSpring_Case01", &printed) else { return };
    for (k, z) in
        [-1.745016599224, -0.384982411961, -1.444844467633, -0.619000154354, -1.262422874812].iter().enumerate()
    {
        assert!((own["z"][100 * (k + 1)] - z).abs() < 2e-8);
    }
}

/// A record of some values: only its times matter. `heads` as `name [unit]`.
fn times_only(heads: &[&str], duration: f64) -> String {
    let times: Vec<f64> = (0..=200).map(|k| duration * f64::from(k) / 200.0).collect();
    let mut columns = vec![("t [s]", times.clone())];
    columns.extend(
        heads.iter().enumerate().map(|(i, head)| (*head, times.iter().map(|t| (3.0 * t + i as f64).sin()).collect())),
    );
    record(&columns)
}

/// A body without loads: kinetic energy and angular momentum (ground axes) stay, and the rates follow Euler's equations
/// integrated here by fixed fine steps.
#[test]
fn free_body_turns_as_euler_says() {
    let text = r#"
study euler_top
body top { mass = 2 kg, inertia = (0.3, 0.5, 0.9 kg*m^2) }
joint floating: free ground -> top
measure wx [rad/s] = floating.angular_velocity.x
measure wy [rad/s] = floating.angular_velocity.y
measure wz [rad/s] = floating.angular_velocity.z
measure Lx [N*m*s] = (0.3 * floating.angular_velocity.x * top.axis_x.x + 0.5 * floating.angular_velocity.y * top.axis_y.x + 0.9 * floating.angular_velocity.z * top.axis_z.x) * 1 kg*m^2
measure Lz [N*m*s] = (0.3 * floating.angular_velocity.x * top.axis_x.z + 0.5 * floating.angular_velocity.y * top.axis_y.z + 0.9 * floating.angular_velocity.z * top.axis_z.z) * 1 kg*m^2
experiment run {
  data = "run.csv"
  start = rest { floating.angular_velocity.x = 0.2 rad/s, floating.angular_velocity.y = 5 rad/s, floating.angular_velocity.z = 0.1 rad/s }
}
solver { tolerance = 1e-11 }
"#;
    let heads = ["wx [rad/s]", "wy [rad/s]", "wz [rad/s]", "Lx [N*m*s]", "Lz [N*m*s]"];
    let own = simulated("euler_top", text, &times_only(&heads, 20.0));
    let inertia = [0.3, 0.5, 0.9];
    let euler = |w: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            (inertia[j] - inertia[k]) / inertia[i] * w[j] * w[k]
        })
    };
    let mut w = [0.2, 5.0, 0.1];
    let (count, h) = (1000, 20.0 / 200.0 / 1000.0);
    let moved = |w: [f64; 3], k: [f64; 3], h: f64| -> [f64; 3] { std::array::from_fn(|i| w[i] + h * k[i]) };
    for sample in 0..=200 {
        for (channel, value) in ["wx", "wy", "wz"].iter().zip(w) {
            let error = (own[*channel][sample] - value).abs();
            assert!(error < 2e-7, "{channel} at sample {sample}: {error:.2e}");
        }
        for _ in 0..count {
            let a = euler(w);
            let b = euler(moved(w, a, h / 2.0));
            let c = euler(moved(w, b, h / 2.0));
            let d = euler(moved(w, c, h));
            w = std::array::from_fn(|i| w[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
    }
    for channel in ["Lx", "Lz"] {
        let drift = own[channel].iter().map(|value| (value - own[channel][0]).abs()).fold(0.0, f64::max);
        println!("Euler top: {channel} drifts by {drift:.1e}");
        assert!(drift < 1e-8, "{channel} drifts by {drift:.2e}");
    }
}

/// Heavy symmetric top in steady precession: `(I3 w3 - I1 W cos th) W = m g l` (Goldstein-2002, 5.7).
#[test]
fn heavy_top_precesses_steadily() {
    let (tilt, precession): (f64, f64) = (0.6, 2.5);
    let (i1, i3, mgl) = (0.05 + 1.5 * 0.2 * 0.2, 0.02, 1.5 * 9.81 * 0.2);
    let spin = (mgl / precession + i1 * precession * tilt.cos()) / i3;
    let text = format!(
        r#"
study heavy_top
gravity = 9.81 m/s^2 along -z
body top {{ mass = 1.5 kg, centre_of_gravity = (0 m, 0 m, 0.2 m), inertia = (0.05, 0.05, 0.02 kg*m^2) }}
joint foot: spherical ground -> top
measure nx = top.axis_z.x
measure ny = top.axis_z.y
measure nz = top.axis_z.z
experiment run {{
  data = "run.csv"
  start = rest {{
    foot.quaternion.w = {}, foot.quaternion.x = {}
    foot.angular_velocity.y = {} rad/s, foot.angular_velocity.z = {spin} rad/s
  }}
}}
solver {{ tolerance = 1e-11 }}
"#,
        (tilt / 2.0).cos(),
        (tilt / 2.0).sin(),
        precession * tilt.sin()
    );
    let own = simulated("heavy_top", &text, &times_only(&["nx", "ny", "nz"], 5.0));
    for sample in 0..=200 {
        let angle = precession * 5.0 * sample as f64 / 200.0;
        let expected = [tilt.sin() * angle.sin(), -tilt.sin() * angle.cos(), tilt.cos()];
        for (channel, expected) in ["nx", "ny", "nz"].iter().zip(expected) {
            let error = (own[*channel][sample] - expected).abs();
            assert!(error < 1e-7, "{channel} at sample {sample}: {error:.2e}");
        }
    }
}

/// A point mass circling on a ball joint: `W^2 = g / (l cos th)`; the joint carries weight and centripetal force.
#[test]
fn conical_pendulum_circles() {
    let (tilt, length): (f64, f64) = (0.7, 1.3);
    let rate = (9.81 / (length * tilt.cos())).sqrt();
    let text = format!(
        r#"
study conical
gravity = 9.81 m/s^2 along -z
body ball {{ mass = 0.8 kg, inertia = 0 kg*m^2 }}
joint angles: axes(turn z, turn y) ground -> arm
joint grip: fixed arm.end -> ball
body arm {{ mass = 0 kg, inertia = 0 kg*m^2, point end = (0 m, 0 m, {} m) }}
measure x [m] = ball.position.x
measure y [m] = ball.position.y
measure Fz [N] = angles.reaction.force.z
measure Fx [N] = grip.reaction.force.x
experiment run {{
  data = "run.csv", start = rest {{ angles.turn_y.position = {tilt}, angles.turn_z.velocity = {rate} rad/s }}
}}
solver {{ tolerance = 1e-11 }}
"#,
        -length
    );
    let own = simulated("conical", &text, &times_only(&["x [m]", "y [m]", "Fz [N]", "Fx [N]"], 4.0));
    let radius = length * tilt.sin();
    for sample in 0..=200 {
        let angle = rate * 4.0 * sample as f64 / 200.0;
        let expected = [
            ("x", -radius * angle.cos()),
            ("y", -radius * angle.sin()),
            ("Fz", 0.8 * 9.81),
            ("Fx", 0.8 * rate * rate * radius * angle.cos()),
        ];
        for (channel, expected) in expected {
            let error = (own[channel][sample] - expected).abs();
            assert!(error < 1e-7, "{channel} at sample {sample}: {error:.2e}");
        }
    }
}

/// A four-bar linkage of hinges in space, its crank turned as prescribed: the rocker's angle by trigonometry, the
/// redundant constraints named once, and the coordinate of the joint that closes the loop.
#[test]
fn four_bar_follows_its_crank() {
    let (crank, coupler, rocker, base): (f64, f64, f64, f64) = (0.1, 0.42, 0.3, 0.5);
    let text = format!(
        r#"
study four_bar
body ground {{ point O2 = ({base} m, 0 m, 0 m) }}
body crank {{ mass = 1 kg, inertia = 0.01 kg*m^2, point tip = ({crank} m, 0 m, 0 m) }}
body coupler {{ mass = 2 kg, inertia = 0.03 kg*m^2, point tip = ({coupler} m, 0 m, 0 m) }}
body rocker {{ mass = 1.5 kg, inertia = 0.02 kg*m^2, point tip = ({rocker} m, 0 m, 0 m) }}
joint motor: revolute(z) ground -> crank {{ motion = 3 rad/s * t }}
joint pin: revolute(z) crank.tip -> coupler
joint foot: revolute(z) ground.O2 -> rocker
joint head: revolute(z) coupler.tip -> rocker.tip
measure rocker_angle = foot.position
measure head_angle = head.position
measure pin_angle = pin.position
measure rate [rad/s] = head.velocity
experiment run {{ data = "run.csv", start = rest {{ pin.position = 0.8, foot.position = 2 }} }}
solver {{ tolerance = 1e-9 }}
"#
    );
    let heads = ["rocker_angle", "head_angle", "pin_angle", "rate [rad/s]"];
    let own = simulated("four_bar", &text, &times_only(&heads, 4.0));
    for sample in 0..=200 {
        let angle: f64 = 3.0 * 4.0 * sample as f64 / 200.0;
        let (x, y) = (crank * angle.cos() - base, crank * angle.sin());
        let reach = (x * x + y * y).sqrt();
        // Angle between the rocker and the line from its foot to the crank's tip.
        let inner = ((reach * reach + rocker * rocker - coupler * coupler) / (2.0 * reach * rocker)).acos();
        let expected = y.atan2(x) - inner;
        let error = (own["rocker_angle"][sample] - expected.rem_euclid(2.0 * std::f64::consts::PI)).abs();
        assert!(error < 1e-7, "sample {sample}: {} instead of {expected}", own["rocker_angle"][sample]);
        let closing = own["rocker_angle"][sample] - angle - own["pin_angle"][sample];
        let error = (own["head_angle"][sample] - closing).sin().abs();
        assert!(error < 1e-7, "closing angle at sample {sample}: {error:.2e}");
    }
}

/// Friction in proportion to the force that a guide carries: the block stops where Coulomb says.
#[test]
fn friction_follows_the_reaction() {
    let text = r#"
study block
gravity = 9.81 m/s^2 along -z
body block { mass = 3 kg }
joint guide: prismatic(x) ground -> block
force rub: coulomb_glide on guide { friction = 0.2, normal = guide.reaction.force.z + 5 N, creep = 0.01 mm/s }
measure x [m] = guide.position
measure N [N] = guide.reaction.force.z
experiment run { data = "run.csv", start = rest { guide.velocity = 2 m/s } }
solver { tolerance = 1e-9 }
"#;
    let own = simulated("block", text, &times_only(&["x [m]", "N [N]"], 0.8));
    let deceleration = 0.2 * (3.0 * 9.81 + 5.0) / 3.0;
    for sample in 0..=200 {
        let t = 0.8 * sample as f64 / 200.0;
        let expected = 2.0 * t - 0.5 * deceleration * t * t;
        assert!((own["x"][sample] - expected).abs() < 1e-6, "at {t} s");
        assert!((own["N"][sample] - 3.0 * 9.81).abs() < 1e-6);
    }
}

/// Rates of a free rotation are about the axes of the child, however these stand at the start.
#[test]
fn a_child_turned_at_rest_turns_about_its_own_axes() {
    let rates = |orientation: &str| {
        let text = format!(
            r#"
study tumbling
body b {{ mass = 1 kg, inertia = (0.1, 0.2, 0.25 kg*m^2) }}
joint ball: spherical ground -> b {{ {orientation} }}
measure wx [rad/s] = ball.angular_velocity.x
measure wy [rad/s] = ball.angular_velocity.y
measure wz [rad/s] = ball.angular_velocity.z
measure ax = b.axis_x.x
measure bx [rad/s] = b.angular_velocity.x
experiment run {{
  data = "run.csv"
  start = rest {{ ball.angular_velocity.x = 1 rad/s, ball.angular_velocity.y = 3 rad/s, ball.angular_velocity.z = 0.2 rad/s }}
}}
solver {{ tolerance = 1e-10 }}
"#
        );
        simulated("tumbling", &text, &times_only(&["wx [rad/s]", "wy [rad/s]", "wz [rad/s]", "ax", "bx [rad/s]"], 4.0))
    };
    let (straight, turned) = (rates(""), rates("orientation = (0 deg, 0 deg, 30 deg)"));
    for name in ["wx", "wy", "wz"] {
        for (a, b) in straight[name].iter().zip(&turned[name]) {
            assert!((a - b).abs() < 1e-7, "{name}: {a} and {b}");
        }
    }
    let (sine, cosine) = 30_f64.to_radians().sin_cos();
    assert!((turned["ax"][0] - cosine).abs() < 1e-12);
    assert!((turned["bx"][0] - (cosine - 3.0 * sine)).abs() < 1e-12);
}
