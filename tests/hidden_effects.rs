//! Hidden effects: each case is a study whose records contain something that the study does not say.

mod support;
mod truth;

use Strength::{Medium, Strong, Weak};
use ident::diagnose::{Answer, Options, Verdict, diagnose};
use ident::diagnostics::{Diagnostic, render};
use ident::study::check;
use rayon::prelude::*;
use std::path::Path;
use support::judge::Outcome;
use support::{Case, Prepared, Strength};
use truth::effect::Effect;
use truth::excitation::Multisine;
use truth::magnet::{Pulled, TOOTH, cogging, magnet};
use truth::random::Random;
use truth::record::Record;

const CASES: [Case; 38] = [
    case("quarter_vehicle", "dry_friction", "chassis_guide", Strong, 1),
    case("quarter_vehicle", "dry_friction", "strut", Medium, 2),
    case("quarter_vehicle", "quadratic_drag", "chassis_guide", Medium, 3),
    case("quarter_vehicle", "viscous_damping", "tyre", Strong, 4),
    case("quarter_vehicle", "end_stop", "strut", Strong, 5),
    case("quarter_vehicle", "sensor_offset", "F_tyre", Medium, 6),
    case("quarter_vehicle", "sensor_lag", "a_axle", Medium, 7),
    case("quarter_vehicle", "input_delay", "u", Strong, 8),
    case("quarter_vehicle", "harmonic_disturbance", "chassis_guide", Medium, 9),
    case("quarter_vehicle", "cubic_stiffness", "tyre", Medium, 10),
    case("two_mass", "backlash", "coupling", Strong, 11),
    case("two_mass", "backlash", "coupling", Medium, 12),
    case("two_mass", "dry_friction", "bearing", Medium, 13),
    case("two_mass", "quadratic_drag", "bearing", Strong, 14),
    case("two_mass", "cubic_stiffness", "shaft", Medium, 15),
    case("two_mass", "actuator_limit", "motor_torque", Strong, 16),
    case("two_mass", "input_delay", "torque", Medium, 17),
    case("two_mass", "harmonic_disturbance", "bearing", Strong, 18),
    case("two_mass", "dry_friction", "bearing", Weak, 19),
    case("crane_pendulum", "dry_friction", "rail", Strong, 20),
    case("crane_pendulum", "dry_friction", "hook", Medium, 21),
    case("crane_pendulum", "quadratic_drag", "hook", Medium, 22),
    case("crane_pendulum", "viscous_damping", "hook", Strong, 23),
    case("crane_pendulum", "end_stop", "rail", Strong, 24),
    case("crane_pendulum", "input_delay", "drive_force", Medium, 25),
    case("crane_pendulum", "sensor_offset", "swing", Weak, 26),
    case("spring_slide", "damper_saturation", "damper", Strong, 27),
    case("spring_slide", "cubic_stiffness", "return_spring", Strong, 28),
    case("spring_slide", "dry_friction", "guide", Weak, 29),
    case("spring_slide", "sensor_lag", "position", Medium, 30),
    nothing("quarter_vehicle", 31),
    nothing("quarter_vehicle", 32),
    nothing("two_mass", 33),
    nothing("two_mass", 34),
    nothing("crane_pendulum", 35),
    nothing("crane_pendulum", 36),
    nothing("spring_slide", 37),
    nothing("spring_slide", 38),
];

const fn case(study: &'static str, effect: &'static str, place: &'static str, strength: Strength, seed: u64) -> Case {
    Case { study, hidden: Some((effect, place)), strength, seed }
}

const fn nothing(study: &'static str, seed: u64) -> Case {
    Case { study, hidden: None, strength: Weak, seed }
}

/// Diagnoses the cases and prints a line for each.
fn outcomes(selected: impl Fn(&Case) -> bool) -> Vec<Outcome> {
    let cases: Vec<Case> = CASES.into_iter().filter(selected).collect();
    let outcomes: Vec<Outcome> = cases.par_iter().map(diagnosed).collect();
    for outcome in &outcomes {
        println!("{outcome}");
    }
    outcomes
}

fn diagnosed(case: &Case) -> Outcome {
    let prepared = case.prepare();
    let answer = answer(&prepared);
    Outcome::judge(&prepared, &answer)
}

fn answer(prepared: &Prepared) -> Answer {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = prepared.write(folder.path()).expect("the case is written");
    answer_of(&file, &prepared.case.title())
}

/// Of the study in `file` with the records beside it.
fn answer_of(file: &Path, title: &str) -> Answer {
    let loaded = ident::study::load(file);
    let shown = |findings: &[Diagnostic]| render(findings, &loaded.sources, false);
    let checked = check(&loaded, None).unwrap_or_else(|findings| panic!("{title}: {}", shown(&findings)));
    let folder = file.parent().expect("a folder");
    let (records, findings) = ident::simulation::prepare(&checked.study, folder, &[]);
    assert!(!findings.iter().any(Diagnostic::is_error), "{title}: {}", shown(&findings));
    diagnose(&loaded, &records, &Options::default(), &|_| {})
        .unwrap_or_else(|findings| panic!("{title}: {}", shown(&findings)))
}

/// Requirements on the cases of one study: strong and medium causes are named at the right place or stand in the stated
/// group, and the extension then gains on the held-out record at least nine tenths of what the truth gains.
fn causes_are_found_in(study: &str) {
    let outcomes = outcomes(|case| case.study == study && case.hidden.is_some());
    let failures: Vec<String> = outcomes.iter().filter_map(Outcome::failure).collect();
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

#[test]
fn causes_are_found_in_the_quarter_vehicle() {
    causes_are_found_in("quarter_vehicle");
}

#[test]
fn causes_are_found_in_the_two_mass_drive() {
    causes_are_found_in("two_mass");
}

#[test]
fn causes_are_found_in_the_crane() {
    causes_are_found_in("crane_pendulum");
}

#[test]
fn causes_are_found_in_the_spring_slide() {
    causes_are_found_in("spring_slide");
}

#[test]
fn nothing_is_invented_where_nothing_is_hidden() {
    let outcomes = outcomes(|case| case.hidden.is_none());
    let alarms: Vec<String> =
        outcomes.iter().filter(|outcome| outcome.raised_alarm()).map(ToString::to_string).collect();
    assert!(alarms.len() <= 1, "\n{}", alarms.join("\n"));
}

/// What is found in records of the slider with a force over its position.
fn pulled(force: fn(f64) -> f64, seed: u64) -> (Answer, Outcome) {
    let measured = |seed: u64, level: f64| Record::measure(&Pulled::by(force), &Effect::Nothing, seed, level);
    let (estimation, validation) = (measured(seed, 1.0), measured(seed + 1, 1.1));
    let case = nothing("spring_slide", seed);
    let prepared = Prepared { case, effect: Effect::Nothing, measured_strength: 0.0, estimation, validation };
    let answer = answer(&prepared);
    let outcome = Outcome::judge(&prepared, &answer);
    println!("{outcome}");
    (answer, outcome)
}

/// A period along the path that lies between the values of any coarse grid.
#[test]
fn cogging_is_found_with_its_period() {
    let (answer, outcome) = pulled(cogging, 41);
    assert_eq!(outcome.accepted, ["ripple at guide"], "{outcome}");
    assert!(outcome.gain > 0.95 * outcome.true_gain, "{outcome}");
    let refit = answer.steps[0].ranking[0].refit.as_ref().expect("the accepted cause was refitted");
    let pitch = refit.parameters.iter().find(|strength| strength.0.ends_with("pitch")).expect("its period");
    assert!((pitch.1 / TOOTH - 1.0).abs() < 0.01, "{} m", pitch.1);
}

/// A force that no law of the catalogue describes: the verdict says so, the extension transfers (eleven points do not
/// make it exact, and the held-out record goes further out), and the shape shown is the magnet's, with a mean slope
/// that the spring takes.
#[test]
fn a_force_without_a_law_is_shown_by_its_shape() {
    let (answer, outcome) = pulled(magnet, 39);
    assert_eq!(answer.verdict, Verdict::ShapeWithoutName, "{outcome}");
    // The spring lies on the guide: a force over its elongation is the same one.
    let place = match &outcome.accepted[..] {
        [accepted] => ["guide", "return_spring"].into_iter().find(|place| accepted.ends_with(&format!(" at {place}"))),
        _ => None,
    };
    let place = place.unwrap_or_else(|| panic!("{outcome}"));
    assert_eq!(outcome.accepted, [format!("force_over_position at {place}")], "{outcome}");
    assert!(outcome.gain > 0.8 * outcome.true_gain, "{outcome}");
    let shown = answer.missing_forces.iter().find(|missing| missing.place == place).expect("the place is drawn");
    assert_eq!(shown.explained.len(), shown.coordinate.len(), "the curve is drawn");
    let (mut a, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
    for (&x, &force) in shown.coordinate.iter().zip(&shown.explained) {
        let row = [magnet(x), 1e3 * x];
        for i in 0..2 {
            b[i] += row[i] * force;
            (0..2).for_each(|j| a[i][j] += row[i] * row[j]);
        }
    }
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let share = (b[0] * a[1][1] - b[1] * a[0][1]) / determinant;
    let slope = (a[0][0] * b[1] - a[1][0] * b[0]) / determinant;
    assert!((share - 1.0).abs() < 0.1, "{share} of the magnet, {slope} N/mm");
    let points = || shown.coordinate.iter().zip(&shown.explained);
    let rest: f64 = points().map(|(&x, force)| (force - share * magnet(x) - slope * 1e3 * x).powi(2)).sum();
    let size: f64 = points().map(|(&x, _)| magnet(x).powi(2)).sum();
    assert!(rest < 0.02 * size, "{} of the shape is something else", rest / size);
}

/// A logger that rounds coarsely: its errors follow the signal, yet no cause is made of them, and the steps are told.
#[test]
fn steps_of_a_logger_are_no_cause() {
    let mut prepared = nothing("two_mass", 42).prepare();
    let step = 0.1 * truth::record::rms(&prepared.estimation.noise_free[0]);
    for record in [&mut prepared.estimation, &mut prepared.validation] {
        record.columns[2] = record.noise_free[0].iter().map(|value| (value / step).round() * step).collect();
    }
    let answer = answer(&prepared);
    println!("{}\n{:?}", answer.summary, answer.remarks);
    assert!(answer.extension.is_none(), "{}", answer.summary);
    let told = |remark: &&String| remark.starts_with("motor_angle comes in steps of ");
    let remark = answer.remarks.iter().find(told).unwrap_or_else(|| panic!("{:?}", answer.remarks));
    let shown: f64 = remark.split_whitespace().nth(5).and_then(|text| text.parse().ok()).expect("the step");
    assert!((shown / step - 1.0).abs() < 0.01, "{remark}");
}

const LEVER: &str = "study lever
input push [N]
body beam { mass = 4 kg, inertia = J_beam, point near = (0.25 m, 0 m, 0 m), point far = (-0.4 m, 0 m, 0 m) }
joint pivot: revolute(z) ground -> beam
force hit: external_load ground -> beam.far along y { value = push }
force leg: spring_damper ground -> beam.near along y { stiffness = c_leg, damping = 12 N*s/m }
force bearing: damper on pivot { damping = d_pivot }
measure phi [rad] = pivot.position
measure F_leg [N] = leg.force
identify {
  J_beam in 0.01 .. 1 kg*m^2 from 0.1 kg*m^2
  c_leg in 0.2 .. 20 kN/m from 1 kN/m
  d_pivot in 0 .. 5 N*m*s/rad from 0.2 N*m*s/rad
}
experiment one estimation { data = \"estimation.csv\", start = rest }
experiment two validation { data = \"validation.csv\", start = rest }
";

/// A record of the lever whose leg stands 0.21 m from the pivot instead of 0.25 m, by the classical method of order 4
/// with fine steps; 2 % noise.
fn lever(seed: u64, level: f64) -> String {
    const ARM: f64 = 0.21;
    const STEP: f64 = 1e-3;
    const STEPS_PER_SAMPLE: usize = 10;
    let push = Multisine::new(seed, (0.3, 6.0), 20, 0.0, level, 0.5);
    let force = |[angle, rate]: [f64; 2]| -(3000.0 * ARM * angle.sin() + 12.0 * ARM * angle.cos() * rate);
    let slope = |t: f64, state: [f64; 2]| {
        let load = -0.4 * push.value(t) + ARM * force(state);
        [state[1], (load * state[0].cos() - 0.3 * state[1]) / 0.12]
    };
    let ahead = |state: [f64; 2], slope: [f64; 2], h: f64| [state[0] + h * slope[0], state[1] + h * slope[1]];
    let (mut state, mut rows) = ([0.0; 2], Vec::new());
    for step in 0..=1000 * STEPS_PER_SAMPLE {
        let t = step as f64 * STEP;
        if step % STEPS_PER_SAMPLE == 0 {
            rows.push([t, push.value(t), state[0], force(state)]);
        }
        let first = slope(t, state);
        let second = slope(t + STEP / 2.0, ahead(state, first, STEP / 2.0));
        let third = slope(t + STEP / 2.0, ahead(state, second, STEP / 2.0));
        let fourth = slope(t + STEP, ahead(state, third, STEP));
        let mean = [0, 1].map(|i| (first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i]) / 6.0);
        state = ahead(state, mean, STEP);
    }
    let mut random = Random::new(seed + 1000);
    let deviations = [2, 3].map(|channel| {
        let values: Vec<f64> = rows.iter().map(|row| row[channel]).collect();
        0.02 * truth::record::rms(&values)
    });
    let mut text = "t [s],push [N],phi [rad],F_leg [N]\n".to_owned();
    for [t, push, phi, force] in rows {
        let noisy = [phi + deviations[0] * random.normal(), force + deviations[1] * random.normal()];
        text += &format!("{t:.3},{push:.6},{:.7},{:.5}\n", noisy[0], noisy[1]);
    }
    text
}

/// The identified stiffness takes up most of a wrong arm, and only as far as products of the two do not matter: finite
/// strengths alone do not find it.
#[test]
fn a_wrong_lever_arm_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, seed, level) in [("estimation", 43, 20.0), ("validation", 44, 23.0)] {
        std::fs::write(folder.path().join(format!("{name}.csv")), lever(seed, level)).expect("it is written");
    }
    let file = folder.path().join("lever.ident");
    std::fs::write(&file, LEVER).expect("it is written");
    let answer = answer_of(&file, "lever");
    println!("{}", answer.summary);
    assert_eq!(answer.verdict, Verdict::CauseNamed, "{}", answer.summary);
    let accepted: Vec<&str> =
        answer.steps.iter().filter_map(|step| Some(step.ranking[step.accepted?].name.as_str())).collect();
    assert_eq!(accepted, ["beam.near.x set free"], "{}", answer.summary);
    let arm = answer.extended.parameters.iter().find(|parameter| parameter.name == "beam.near.x");
    let arm = arm.unwrap_or_else(|| panic!("{:?}", answer.extended.parameters));
    assert!((arm.value - 0.21).abs() < 0.01, "{} {}", arm.value, arm.unit);
}
