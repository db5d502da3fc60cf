//! Reference problems of the test set for initial value problems: digits reached, and the work it took.

use crate::mechanisms::*;
use crate::problems::*;
use crate::system::{Equations, System};
use ident::integrate::{MethodChoice, Options, Start, integrate};

fn shared() -> std::path::PathBuf {
    std::env::var_os("IDENT_SHARED").map_or_else(|| "../shared".into(), Into::into)
}

/// (end, values, whether the project's own digits are better than the published ones)
fn reference(name: &str) -> Option<(f64, Vec<f64>)> {
    let path = shared().join("data/ivp/reference.json");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {} not found", path.display());
        return None;
    };
    let all: serde_json::Value = serde_json::from_str(&text).expect("reference.json is JSON");
    let problem = &all["problems"][name];
    let digits = if problem["own_quad"].is_array() { &problem["own_quad"] } else { &problem["published"] };
    let values =
        digits.as_array().expect("values").iter().map(|v| v.as_str().expect("digits").parse().expect("number"));
    Some((problem["t_end"].as_f64().expect("end"), values.collect()))
}

/// Number of correct digits of the worst component: -log10 of its relative error.
fn digits(values: &[f64], reference: &[f64]) -> f64 {
    let worst = values.iter().zip(reference).map(|(a, b)| ((a - b) / b).abs()).fold(0.0, f64::max);
    -worst.log10()
}

struct Case<'a> {
    name: &'a str,
    method: MethodChoice,
    /// Components compared.
    compared: usize,
    absolute_factor: f64,
}

impl Case<'_> {
    /// One line per tolerance.
    fn table<E: Equations>(&self, system: &mut System<E>, start: &Start, tolerances: &[f64]) -> Option<(String, f64)> {
        let (end, expected) = reference(self.name)?;
        let mut lines = String::new();
        let mut last = 0.0;
        for &tolerance in tolerances {
            let options = Options {
                relative_tolerance: tolerance,
                absolute_factor: self.absolute_factor,
                method: self.method,
                ..Options::default()
            };
            let solution =
                integrate(system, start, &[end], &[], &options).unwrap_or_else(|f| panic!("{}: {f:?}", self.name));
            last = digits(&solution.y[..self.compared], &expected);
            if self.name == "andrews" {
                println!(
                    "vel {} lam {}",
                    digits(&solution.y[7..14], &expected[7..]),
                    digits(&solution.y[14..20], &expected[21..])
                );
            }
            if self.name == "car_axis" {
                println!(
                    "pos {} lam {}",
                    digits(&solution.y[0..4], &expected[0..]),
                    digits(&solution.y[8..10], &expected[8..])
                );
            }
            let work = &solution.work;
            lines += &format!(
                "{tolerance:.0e}: {} digits, {} steps, {}+{} rejected, {} Newton iterations, {} residuals, {} Jacobians, {} factorisations, {}\n",
                last.floor(),
                work.steps,
                work.rejected_error,
                work.rejected_newton,
                work.newton_iterations,
                work.residuals,
                work.jacobians,
                work.factorisations,
                work.method
            );
            println!("{} {tolerance:.0e} {last:.2}", self.name);
        }
        Some((lines, last))
    }
}

const TOLERANCES: [f64; 3] = [1e-4, 1e-7, 1e-10];

fn bdf(name: &str, compared: usize) -> Case<'_> {
    Case { name, method: MethodChoice::Bdf, compared, absolute_factor: 1e-3 }
}

#[test]
fn robertson() {
    let mut system = System::new(Robertson, &ROBERTSON);
    let start = system.start(&[1.0, 0.0, 0.0]);
    let Some((table, last)) = bdf("robertson", 3).table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
}

#[test]
fn hires() {
    let mut system = System::new(Hires, &[]);
    let start = system.start(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057]);
    let Some((table, last)) = bdf("hires", 8).table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
}

#[test]
fn pollution() {
    let mut system = System::new(Pollution, &[]);
    let start = system.start(&Pollution::initial());
    let Some((table, last)) = bdf("pollution", 20).table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
}

#[test]
fn van_der_pol() {
    let mut system = System::new(VanDerPol, &[1e-6]);
    let start = system.start(&[2.0, 0.0]);
    let Some((table, last)) = bdf("van_der_pol", 2).table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
    let automatic = Case { method: MethodChoice::Automatic, ..bdf("van_der_pol", 2) };
    let Some((table, last)) = automatic.table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
}

#[test]
fn pleiades() {
    let mut system = System::new(Pleiades, &[]);
    let start = system.start(&Pleiades::initial());
    let case = Case { method: MethodChoice::Automatic, ..bdf("pleiades", 28) };
    let Some((table, last)) = case.table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
}

#[test]
fn transistor_amplifier() {
    let mut system = System::new(TransistorAmplifier, &[]);
    let start = Start {
        time: 0.0,
        y: TransistorAmplifier::Y.to_vec(),
        y_prime: TransistorAmplifier::Y_PRIME.to_vec(),
        sensitivity: Vec::new(),
    };
    let Some((table, last)) =
        (Case { absolute_factor: 1.0, ..bdf("transistor_amplifier", 8) }).table(&mut system, &start, &TOLERANCES)
    else {
        return;
    };
    insta::assert_snapshot!(table);
    assert!(last >= 8.0, "{last} digits");
}

#[test]
fn andrews_squeezing_mechanism() {
    let mut system = System::new(Andrews, &[]);
    let mut y = ANDREWS_ANGLES.to_vec();
    y.resize(26, 0.0);
    let start = Start { time: 0.0, y, y_prime: vec![0.0; 26], sensitivity: Vec::new() };
    let Some((table, last)) = bdf("andrews", 7).table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 7.0, "{last} digits");
}

#[test]
fn car_axis() {
    let mut system = System::new(CarAxis, &[]);
    let y = vec![0.0, 0.5, 1.0, 0.5, -0.5, 0.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
    let start = Start { time: 0.0, y, y_prime: vec![0.0; 12], sensitivity: Vec::new() };
    let Some((table, last)) = bdf("car_axis", 10).table(&mut system, &start, &TOLERANCES) else { return };
    insta::assert_snapshot!(table);
    assert!(last >= 6.0, "{last} digits");
}

/// An algebraic equation among the reactions; the published solution stands in the test.
#[test]
fn akzo_nobel() {
    let mut system = System::new(AkzoNobel, &[]);
    let start = Start { time: 0.0, y: AkzoNobel::initial(), y_prime: vec![0.0; 6], sensitivity: Vec::new() };
    for (tolerance, wanted) in [(1e-5, 4.0), (1e-8, 7.0), (1e-11, 9.0)] {
        let options = Options { relative_tolerance: tolerance, ..Options::default() };
        let solution = integrate(&mut system, &start, &[180.0], &[], &options).expect("a solution");
        let digits = digits(&solution.y, &AkzoNobel::END);
        println!("{tolerance:.0e}: {digits:.1} digits, {} steps", solution.work.steps);
        assert!(digits >= wanted, "{tolerance}: {digits} digits");
    }
}
