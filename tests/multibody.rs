//! Mechanisms declared as bodies and joints, against published solutions and closed forms.

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

/// Seven bodies, ten revolute joints, three loops: positions along the whole motion, the crank's velocity and acceleration,
/// and the force in one of the closing joints.
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
