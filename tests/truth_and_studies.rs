//! The shipped studies say what the truth simulators do: the same motion from the text (law by law, effect by effect,
//! through compiler and tapes) and from equations written by hand. Both are driven by the exact excitation and
//! integrated by fixed fine steps, so that only meaning is compared.

mod support;
mod truth;

use ident::integrate::Dynamics;
use ident::tape::{Bound, InputSource, Model};
use support::strength::{Strength, calibrated};
use truth::effect::Effect;
use truth::excitation::Multisine;
use truth::mechanism::{Mechanism, Motion};
use truth::record::{excite, strength};
use truth::simulator::Samples;

const SEED: u64 = 77;

/// The mechanism's excitation as an input of the tapes.
struct Exact(Multisine);

impl InputSource for Exact {
    fn sample(&self, _input: u32, order: u8, t: f64) -> f64 {
        match order {
            0 => self.0.value(t),
            _ => {
                let half = 1e-6;
                (self.0.value(t + half) - self.0.value(t - half)) / (2.0 * half)
            }
        }
    }
}

/// Compiles a shipped study with a variant's text behind it; `None`: as it stands.
fn compile(study: &str, extension: Option<&str>) -> Model {
    let path = support::studies().join(study).join(format!("{study}.ident"));
    let mut loaded = ident::study::load(&path);
    if let Some(text) = extension {
        loaded = loaded.with_text(&format!("variant hidden of base {{\n{text}\n}}"));
    }
    let checked = match ident::study::check(&loaded, extension.map(|_| "hidden")) {
        Ok(checked) => checked,
        Err(findings) => panic!("{study}: {}", ident::diagnostics::render(&findings, &loaded.sources, false)),
    };
    match ident::mechanics::derive(&checked.study) {
        Ok(system) => Model::compile(&system),
        Err(findings) => panic!("{study}: {}", ident::diagnostics::render(&findings, &loaded.sources, false)),
    }
}

/// Simulates the study's text at the truth's parameters, from zero states.
fn simulate_text(mechanism: &dyn Mechanism, model: &Model) -> Vec<Vec<f64>> {
    let truth = mechanism.parameters();
    let theta: Vec<f64> = model
        .parameter_names()
        .iter()
        .map(|name| truth.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no truth of {name}")).1)
        .collect();
    let schedule = mechanism.schedule();
    let input =
        Exact(Multisine::new(SEED, schedule.band, schedule.lines, schedule.slope, schedule.rms, schedule.fade_in));
    let mut bound = Bound::new(model, &input, &theta);
    let mut y = vec![0.0; model.dimension()];
    let step = 1.0 / (schedule.sampling * schedule.substeps as f64);
    let mut channels = vec![vec![]; model.output_count()];
    let mut outputs = vec![0.0; model.output_count()];
    for sample in 0..=(schedule.duration * schedule.sampling).round() as usize {
        let t = sample as f64 / schedule.sampling;
        bound.outputs(t, &y, &mut outputs);
        for (channel, value) in channels.iter_mut().zip(&outputs) {
            channel.push(*value);
        }
        for substep in 0..schedule.substeps {
            runge_kutta(&mut bound, t + substep as f64 * step, step, &mut y);
        }
    }
    channels
}

fn runge_kutta(bound: &mut Bound, t: f64, step: f64, y: &mut [f64]) {
    let mut rates = |t: f64, y: &[f64]| {
        let mut rates = vec![0.0; y.len()];
        assert!(bound.explicit_rates(t, y, &mut rates), "the shipped studies are ordinary differential equations");
        rates
    };
    let moved = |factor: f64, k: &[f64]| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + factor * k).collect() };
    let k1 = rates(t, y);
    let k2 = rates(t + 0.5 * step, &moved(0.5 * step, &k1));
    let k3 = rates(t + 0.5 * step, &moved(0.5 * step, &k2));
    let k4 = rates(t + step, &moved(step, &k3));
    for (index, value) in y.iter_mut().enumerate() {
        *value += step / 6.0 * (k1[index] + 2.0 * k2[index] + 2.0 * k3[index] + k4[index]);
    }
}

/// rms difference relative to the motion, as [`strength`] measures it.
fn difference(exact: &Samples, text: Vec<Vec<f64>>) -> f64 {
    let samples = Samples { time: vec![], input: vec![], channels: text, places: vec![] };
    strength(exact, &samples)
}

const MECHANISMS: [&str; 4] = ["quarter_vehicle", "two_mass", "crane_pendulum", "spring_slide"];

#[test]
fn each_study_moves_as_its_simulator() {
    for name in MECHANISMS {
        let mechanism = truth::mechanism(name).expect("known name");
        let exact = excite(mechanism.as_ref(), &Effect::Nothing, SEED, 1.0);
        let difference = difference(&exact, simulate_text(mechanism.as_ref(), &compile(name, None)));
        assert!(difference < 1e-7, "{name}: {difference:e}");
    }
}

/// Study, effect, place, largest relative difference: rounding for smooth effects; for kinked ones what a step across a
/// kink costs the simulation of the text; for dry friction what the smooth law leaves of sticking.
const EFFECTS: [(&str, &str, &str, f64); 17] = [
    ("quarter_vehicle", "viscous_damping", "tyre", 1e-7),
    ("quarter_vehicle", "quadratic_drag", "chassis_guide", 1e-7),
    ("quarter_vehicle", "cubic_stiffness", "tyre", 1e-7),
    ("quarter_vehicle", "end_stop", "strut", 1e-4),
    ("quarter_vehicle", "sensor_lag", "a_axle", 1e-7),
    ("quarter_vehicle", "sensor_offset", "F_tyre", 1e-7),
    ("quarter_vehicle", "harmonic_disturbance", "chassis_guide", 1e-7),
    ("quarter_vehicle", "dry_friction", "chassis_guide", 3e-3),
    ("two_mass", "backlash", "coupling", 1e-4),
    ("two_mass", "actuator_limit", "motor_torque", 1e-4),
    ("two_mass", "input_delay", "torque", 1e-7),
    ("two_mass", "dry_friction", "bearing", 3e-3),
    ("two_mass", "cubic_stiffness", "coupling", 1e-7),
    ("crane_pendulum", "quadratic_drag", "hook", 1e-7),
    ("crane_pendulum", "end_stop", "rail", 1e-4),
    ("crane_pendulum", "dry_friction", "rail", 3e-3),
    ("spring_slide", "damper_saturation", "damper", 1e-7),
];

#[test]
fn each_effect_of_the_catalogue_means_what_the_simulators_hide() {
    let mut wrong = vec![];
    for (study, effect, place, tolerance) in EFFECTS {
        let mechanism = truth::mechanism(study).expect("known name");
        let (hidden, change) = calibrated(mechanism.as_ref(), effect, place, Strength::Strong, SEED);
        let extension = declaration(mechanism.as_ref(), effect, place, &hidden);
        let exact = excite(mechanism.as_ref(), &hidden, SEED, 1.0);
        let difference = difference(&exact, simulate_text(mechanism.as_ref(), &compile(study, Some(&extension))));
        if difference.is_nan() || difference > tolerance {
            wrong.push(format!("{study}, {extension}: {difference:e} of {change:.3}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// `add effect ..` with the truth's numbers.
fn declaration(mechanism: &dyn Mechanism, effect: &str, place: &str, hidden: &Effect) -> String {
    let rotational = mechanism.place(place).is_some_and(|index| mechanism.places()[index].motion == Motion::Rotational);
    let pick = |translational: &'static str, turning: &'static str| if rotational { turning } else { translational };
    let fields = match *hidden {
        Effect::Nothing => String::new(),
        Effect::DryFriction { load, .. } => {
            format!("F = {load:e} {}, creep = 0.5 {}", pick("N", "N*m"), pick("mm/s", "mrad/s"))
        }
        Effect::ViscousDamping { slope, .. } => format!("d = {slope:e} {}", pick("N*s/m", "N*m*s/rad")),
        Effect::QuadraticDrag { factor, .. } => format!("c = {factor:e} {}", pick("N*s^2/m^2", "N*m*s^2/rad^2")),
        Effect::CubicStiffness { factor, .. } => format!("c = {factor:e} {}", pick("N/m^3", "N*m/rad^3")),
        Effect::Backlash { gap, .. } => format!("gap = {gap:e} {}", pick("m", "rad")),
        Effect::EndStop { gap, stiffness, .. } => {
            format!("stiffness = {stiffness:e} {}, gap = {gap:e} {}", pick("N/m", "N*m/rad"), pick("m", "rad"))
        }
        Effect::DamperSaturation { knee, ratio, .. } => {
            format!("loss = {:e}, knee = {knee:e} {}", 1.0 - ratio, pick("m/s", "rad/s"))
        }
        Effect::LoadLimit { limit, .. } => format!("inverse_limit = {:e} {}", 1.0 / limit, pick("1/N", "1/(N*m)")),
        Effect::InputDelay { time } | Effect::SensorLag { time, .. } => format!("tau = {time:e} s"),
        Effect::SensorOffset { channel, value } => {
            let channel = mechanism.channels()[channel];
            format!("b = {:e} {}", value / channel.factor, channel.unit)
        }
        Effect::HarmonicDisturbance { amplitude, frequency, phase, .. } => {
            let (sine, cosine) = (amplitude * phase.cos(), amplitude * phase.sin());
            let unit = pick("N", "N*m");
            format!("A = {sine:e} {unit}, B = {cosine:e} {unit}, frequency = {frequency:e} Hz")
        }
    };
    format!("add effect hidden_cause: {effect} on {place} {{ {fields} }}")
}
