//! What laws, fields, effects and variants become in the graph.

use crate::evaluate::{close, study, value, variant};
use ident::diagnostics::Code;
use ident::quantities::Dimension;
use ident::study::{
    Attachment, Force, ForcePlace, Interpolation, Motion, PlaceKind, PlaceQuantity, PointMotion, StartBase, Study,
    check, load_text,
};

const SLIDE: &str = "study s\ninput u [mm]\ninput p [V] { interpolation = linear }\nbody b { mass = 2 kg }\n\
    joint guide: prismatic(z) ground -> b\nmeasure z [mm] = guide.position + u + p * (1 mm/V)\n";

fn force<'a>(study: &'a Study, name: &str) -> &'a Force {
    study.forces.iter().find(|force| force.name == name).unwrap_or_else(|| panic!("no force `{name}`"))
}

fn load(study: &Study, name: &str, values: &[(&str, f64)]) -> f64 {
    value(study, force(study, name).load, values)
}

#[test]
fn the_damper_saturates_on_each_side_by_its_own_values() {
    let text = format!(
        "{SLIDE}force d: saturating_damper on guide {{ compression = {{ slope = 1.1 kN*s/m, knee = 0.15 m/s, ratio = 30 % }}
        rebound = {{ slope = 2300 N*s/m, knee = 200 mm/s, ratio = 0.25 }} }}"
    );
    let study = study(&text);
    let branch = |v: f64, slope: f64, knee: f64, ratio: f64| {
        slope * v * (ratio + (1.0 - ratio) / (1.0 + (v / knee) * (v / knee)).sqrt())
    };
    for v in [0.01, 0.3, 2.0] {
        close(load(&study, "d", &[("guide.velocity", v)]), -branch(v, 2300.0, 0.2, 0.25));
        close(load(&study, "d", &[("guide.velocity", -v)]), branch(v, 1100.0, 0.15, 0.3));
    }
}

#[test]
fn the_servo_uses_the_inertia_that_its_joint_moves() {
    let study = study(&format!(
        "{SLIDE}actuator a: pt2 on guide {{ command = u, frequency = f, damping = 0.7, force_limit = 3 kN }}
        identify {{ f in 5 .. 60 Hz from 30 Hz }}"
    ));
    let omega = std::f64::consts::TAU * 24.0;
    let demand = 2.0 * (omega * omega * (0.3f64.sin() - 0.1) - 2.0 * 0.7 * omega * 0.5);
    let values = [("t", 0.3), ("guide.position", 0.1), ("guide.velocity", 0.5), ("guide.inertia", 2.0), ("f", 24.0)];
    close(load(&study, "a", &values), 3e3 * (demand / 3e3).tanh());
    assert!(force(&study, "a").is_actuator);
}

#[test]
fn one_law_serves_translation_and_rotation() {
    let study = study(
        "study s\nbody b { mass = 1 kg, inertia = 2 kg*m^2 }\njoint hinge: revolute(y) ground -> b\n\
         force f: spring on hinge { stiffness = 10 N*m/deg }\nmeasure M [N*m] = f.torque",
    );
    close(load(&study, "f", &[("hinge.position", 0.1)]), -10.0 * 180.0 / std::f64::consts::PI * 0.1);
    let place = study.places.iter().find(|place| place.name == "f").expect("a place");
    assert_eq!((place.motion, place.dimension), (Some(Motion::Rotational), Dimension::TORQUE));
}

#[test]
fn states_of_laws_have_names_derivatives_and_start_values() {
    let study = study(&format!(
        "{SLIDE}force m: maxwell on guide {{ stiffness = 100 N/m, damping = 20 N*s/m }}\nmeasure y [mm] = m.flow"
    ));
    let [state] = study.states.as_slice() else { panic!("one state") };
    assert_eq!((state.name.as_str(), state.dimension), ("m.flow", Dimension::LENGTH));
    let values = [("guide.position", 0.5), ("m.flow", 0.2)];
    close(value(&study, state.derivative, &values), 100.0 * 0.3 / 20.0);
    close(value(&study, state.initial, &values), 0.5);
    close(load(&study, "m", &values), -30.0);
}

#[test]
fn controllers_infer_the_dimension_of_their_output() {
    let study = study(&format!(
        "{SLIDE}signal c: cascade {{ reference = u, position = guide.position, velocity = guide.velocity,
        position_gain = 160 1/s, velocity_gain = 243 V*s/m }}
        signal filtered: pt1 {{ u = c + p, lag = 2 ms }}
        actuator drive: amplifier on guide {{ command = filtered, gain = 35 N/V }}"
    ));
    let volt = Dimension::new(1, 2, -3, -1, 0);
    assert!(study.signals.iter().all(|signal| signal.dimension == volt));
    let values = [("t", 0.0), ("guide.position", 0.01), ("guide.velocity", 0.2), ("filtered.z", 4.0)];
    close(value(&study, study.signals[0].value, &values), 243.0 * (160.0 * -0.01 - 0.2));
    close(load(&study, "drive", &values), 140.0);
    let state = study.states.iter().find(|state| state.name == "filtered.z").expect("a state");
    close(value(&study, state.derivative, &values), (243.0 * (160.0 * -0.01 - 0.2) - 4.0) / 2e-3);
}

#[test]
fn filters_break_circles_of_signals() {
    let study = study(&format!(
        "{SLIDE}law first(u: voltage) -> voltage {{ param lag: time
         state z: voltage from 0 V {{ z' = (u - z) / lag }}
         = z }}
         signal a: first {{ u = p - back, lag = 1 ms }}\nsignal back = 2 * a"
    ));
    assert_eq!(study.signals.len(), 2);
}

#[test]
fn past_and_rate_of_inputs() {
    let study = study(&format!(
        "{SLIDE}measure late [mm] = delayed(u, tau)\nmeasure rate [V/s] = derivative(p)
        measure step = smoothstep((t - 1 s) / 20 ms)\nidentify {{ tau in 0 .. 9 ms from 3 ms }}"
    ));
    let measured = |index: usize, t: f64| value(&study, study.measures[index].value, &[("t", t), ("tau", 0.004)]);
    close(measured(1, 0.5), 0.496f64.sin());
    close(measured(2, 0.5), 2.0 * 1.0f64.cos());
    close(measured(3, 1.005), 3.0 * 0.0625 - 2.0 * 0.015625);
    close(measured(3, 0.9), 0.0);
    close(measured(3, 1.1), 1.0);
    assert_eq!(study.inputs[1].interpolation, Interpolation::Linear);
    assert_eq!(study.inputs[0].interpolation, Interpolation::Cubic);
}

#[test]
fn conditions_and_powers() {
    let study = study(&format!(
        "{SLIDE}measure a = if t >= 1 s and not_late > 0 or t < 0.1 s then 2^3^2 else -2^2
        signal not_late = if t <= 2 s then 1 else 0\nmeasure c = (4 m^2)^1.5 / (1 m^3) + (9 s^2)^0.5 / (1 s)"
    ));
    let measured = |index: usize, t: f64| value(&study, study.measures[index].value, &[("t", t)]);
    for (t, expected) in [(0.05, 512.0), (0.5, -4.0), (1.0, 512.0), (2.0, 512.0), (2.1, -4.0)] {
        close(measured(1, t), expected);
    }
    close(measured(2, 0.0), 11.0);
}

#[test]
fn effects_compose_in_order_of_declaration() {
    let text = format!(
        "{SLIDE}force s: spring on guide {{ stiffness = 100 N/m }}
        effect play: backlash on s {{ gap = 0.2 m }}
        effect more: missing_stiffness on s {{ c = 10 N/m }}
        effect limit: load_saturation on s {{ inverse_limit = 0.01 1/N }}
        effect rub: dry_friction on guide {{ F = 3 N, creep = 1 mm/s }}"
    );
    let study = study(&text);
    let values = [("guide.position", 0.5), ("guide.velocity", 0.002)];
    // The stiffness beside the spring was declared after the backlash and feels it too.
    let linear: f64 = -110.0 * 0.4;
    close(load(&study, "s", &values), linear / (1.0 + (0.01 * linear) * (0.01 * linear)).sqrt());
    close(load(&study, "rub", &values), -3.0 * 2.0f64.tanh());
    assert!(matches!(force(&study, "rub").place, ForcePlace::Joint { joint: 0, axis: 0 }));
    assert!(study.places.iter().all(|place| place.name != "rub"), "effects are no places for effects");
    let sums = study.places.iter().find(|place| place.name == "guide").expect("the joint");
    let total = sums.probes.iter().find(|(quantity, _)| *quantity == PlaceQuantity::Load).expect("its load").1;
    // Inertia 3 kg at 2 m/s^2: the load that accelerates is added as root of the sum of squares.
    let moving = [values.as_slice(), &[("guide.inertia", 3.0), ("guide.acceleration", 2.0)]].concat();
    let applied = load(&study, "s", &values) + load(&study, "rub", &values);
    close(value(&study, total, &moving), applied.hypot(6.0));
}

#[test]
fn effects_on_inputs_measures_and_commands() {
    let study = study(&format!(
        "{SLIDE}actuator a: amplifier on guide {{ command = u, gain = 2 N/m }}
        effect late: input_delay on u {{ tau = 4 ms }}\neffect weak: input_gain on u {{ g = -0.1 }}
        effect shift: sensor_offset on z {{ b = 1 mm }}\neffect slow: sensor_lag on z {{ tau = 2 ms }}
        effect dead: dead_band on a {{ gap = 0.2 m }}
        effect dead_band at any actuator {{ amplitude gap: value one_sided finite
          replaces command by command - max(min(command, gap / 2), -gap / 2) }}"
    ));
    let u = 0.9 * 0.496f64.sin();
    let values = [("t", 0.5), ("guide.position", 0.3), ("slow.z", 0.7)];
    close(load(&study, "a", &values), 2.0 * (u - 0.1));
    close(value(&study, study.measures[0].value, &values), 0.7);
    let state = study.states.iter().find(|state| state.name == "slow.z").expect("a state");
    let shifted = 0.3 + u + 1e-3 * 1.0f64.sin() + 1e-3;
    close(value(&study, state.derivative, &values), (shifted - 0.7) / 2e-3);
}

#[test]
fn sensors_lag_before_gain_and_offset() {
    let study = study(
        "study s\nbody b { mass = 2 kg }\njoint guide: prismatic(z) ground -> b\n\
         measure a [m/s^2] \"acceleration\" = guide.acceleration { lag = 0.5 ms, gain = 1.1, offset = 0.2 m/s^2, noise = 0.1 g0 }\n\
         signal seen = a",
    );
    let [state] = study.states.as_slice() else { panic!("one state") };
    assert_eq!(state.name, "a.sensor");
    let values = [("guide.acceleration", 3.0), ("a.sensor", 2.0)];
    close(value(&study, state.derivative, &values), 1.0 / 0.5e-3);
    close(value(&study, study.measures[0].value, &values), 2.4);
    close(study.measures[0].noise.unwrap_or_default(), 0.980665);
    let paths: Vec<&str> = study.constants.iter().map(|constant| constant.path.as_str()).collect();
    assert_eq!(paths, ["b.mass", "a.lag", "a.gain", "a.offset"]);
}

#[test]
fn fixed_numbers_can_be_identified_by_their_path() {
    let study = study(&format!(
        "{SLIDE}constant c_0 = 3 N/m\nforce s: spring_damper on guide {{ stiffness = 100 N/m + c_0, damping = 5 N*s/m }}
        identify {{ s.damping in 1 .. 9 N*s/m from 4 N*s/m prior 5 +- 1 N*s/m
        b.mass in 1 .. 3 kg from 2.5 kg, c_0 in 0.001 .. 0.009 kN/m from 2 N/m }}"
    ));
    let values = [("guide.position", 1.0), ("guide.velocity", 1.0), ("s.damping", 7.0), ("c_0", 2.0)];
    close(load(&study, "s", &values), -109.0);
    close(value(&study, study.bodies[0].mass, &[("b.mass", 2.5)]), 2.5);
    let names: Vec<&str> = study.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(names, ["s.damping", "b.mass", "c_0"]);
    assert!(study.constants.is_empty(), "{:?}", study.constants);
    let [damping, _, stiffness] = study.parameters.as_slice() else { panic!("three parameters") };
    assert_eq!(damping.prior.map(|prior| (prior.mean, prior.standard_deviation)), Some((5.0, 1.0)));
    assert_eq!((stiffness.lower, stiffness.upper, stiffness.start), (1.0, 9.0, 2.0));
    assert_eq!(stiffness.unit.symbol, "N/m");
}

#[test]
fn variants_build_on_each_other() {
    let text = format!(
        "{SLIDE}force s: spring on guide {{ stiffness = c }}\nforce d: damper on guide {{ damping = 1 N*s/m }}
        identify {{ c in 1 .. 9 N/m from 4 N/m }}
        variant second of first {{ remove d  identify {{ F in 0 .. 9 N from 3 N }} }}
        variant first of base {{ add effect rub: dry_friction on guide {{ F = F, creep = 1 mm/s }}
          replace force s: cubic_spring on guide {{ stiffness = c, cubic = 3 N/m^3 }}
          identify {{ F in 0 .. 9 N from 1 N, c in 1 .. 9 N/m from 5 N/m }} }}"
    );
    let names = |study: &Study| study.forces.iter().map(|force| force.law.clone()).collect::<Vec<_>>().join(" ");
    let starts = |study: &Study| study.parameters.iter().map(|parameter| parameter.start).collect::<Vec<_>>();
    let base = study(&text);
    assert_eq!((names(&base).as_str(), starts(&base)), ("spring damper", vec![4.0]));
    assert_eq!(base.variants, ["second", "first"]);
    let first = variant(&text, Some("first"));
    assert_eq!((names(&first).as_str(), starts(&first)), ("cubic_spring damper dry_friction", vec![5.0, 1.0]));
    let second = variant(&text, Some("second"));
    assert_eq!((names(&second).as_str(), starts(&second)), ("cubic_spring dry_friction", vec![5.0, 3.0]));
    assert_eq!(second.variant, "second");
}

#[test]
fn parameters_made_idle_by_a_variant_are_left_out_with_a_warning() {
    let text = format!(
        "{SLIDE}force s: spring on guide {{ stiffness = c }}\nforce d: damper on guide {{ damping = 1 N*s/m }}
        identify {{ c in 1 .. 9 N/m from 4 N/m\nd.damping in 0 .. 2 N*s/m from 1 N*s/m }}\nvariant v of base {{ remove d }}"
    );
    let checked = check(&load_text("s", &text), Some("v")).unwrap_or_else(|findings| panic!("{findings:?}"));
    assert_eq!(checked.study.parameters.len(), 1);
    assert!(checked.warnings.iter().any(|finding| finding.code == Code::LEFT_OUT));
}

#[test]
fn elements_between_bodies_on_parallel_guides_act_along_them() {
    let study = study(
        "study s\nbody a { mass = 1 kg }\nbody b { mass = 1 kg, point eye = (0, 300 mm, 0.4 m) }\nbody arm { mass = 1 kg, inertia = 0 kg*m^2 }\n\
         body ground { point wall = (0, 0, 2 m) }\n\
         joint one: prismatic(z) ground -> a\njoint two: prismatic(-z) a -> b\njoint pivot: revolute(y) b.eye -> arm\n\
         force along_guides: spring a -> b.eye { stiffness = 1 N/m }\nforce free: spring ground.wall -> arm { stiffness = 1 N/m }\n\
         force given: spring a -> arm { stiffness = 1 N/m, free_length = L }\nforce stated: spring a -> arm along (0, 0.6, 0.8) { stiffness = 1 N/m }\n\
         identify { L in 0.1 .. 1 m from 0.5 m }",
    );
    let along = |name: &str| match force(&study, name).place {
        ForcePlace::Between { along, free_length, .. } => (along.map(|along| along.axis), free_length),
        ForcePlace::Joint { .. } => panic!("stands on a joint"),
    };
    assert_eq!(along("along_guides"), (Some([0.0, 0.0, -1.0]), None));
    let (axis, length) = along("free");
    assert_eq!(axis, None);
    // From (0, 0, 2) to the eye at (0, 0.3, 0.4).
    close(value(&study, length.expect("a length"), &[]), (0.09f64 + 1.6 * 1.6).sqrt());
    close(value(&study, along("given").1.expect("a length"), &[("L", 0.7)]), 0.7);
    assert_eq!(along("stated"), (Some([0.0, 0.6, 0.8]), None));
}

#[test]
fn joints_come_out_parents_first_and_points_are_quantities() {
    let study = study(
        "study s\ngravity = 9.81 m/s^2 along (0, 0, -2)\nbody arm { mass = 1 kg, inertia = (1, 2, 3 kg*m^2), point tip = (0, 0, 0.4 m) }\nbody rod { mass = 1 kg, inertia = 1 kg*m^2 }\n\
         joint head: revolute(y) arm.tip -> rod\njoint pivot: revolute(y) ground -> arm\n\
         force f: spring on head { stiffness = 1 N*m/rad }\nmeasure v [m/s] = arm.tip.velocity.x + rod.velocity.x",
    );
    let names: Vec<&str> = study.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["pivot", "head"]);
    assert!(matches!(force(&study, "f").place, ForcePlace::Joint { joint: 1, axis: 0 }));
    assert_eq!(study.point_quantities.len(), 2);
    let quantity = &study.point_quantities[0];
    assert_eq!((quantity.motion, quantity.axis), (PointMotion::Velocity, 0));
    let Attachment { body, position, .. } = quantity.point;
    assert_eq!(body, Some(0));
    close(value(&study, position[2], &[]), 0.4);
    close(value(&study, study.gravity[2], &[]), -9.81);
    close(value(&study, study.bodies[0].inertia[1], &[]), 2.0);
    let tip = study.constants.iter().find(|constant| constant.path == "arm.tip.z").expect("a length that can be freed");
    close(tip.value, 0.4);
}

#[test]
fn experiments_filters_and_groups() {
    let study = study(&format!(
        "{SLIDE}measure v [m/s] = guide.velocity\nforce m: maxwell on guide {{ stiffness = 1 N/m, damping = 1 N*s/m }}
        experiment e validation {{ data = \"data/e.csv\", window = 1 .. 10 s, measures = {{ v }}, columns = {{ v = \"speed\" }}
          inputs = {{ p = 5 V }}, start = rest {{ guide.velocity = v0, m.flow = 1 mm }} }}
        filter {{ lowpass butterworth pass 5 Hz (2 dB) stop 7 Hz (20 dB) single_pass, remove_mean }}
        solver {{ tolerance = 1e-8, method = runge_kutta }}\ngroup motion {{ z }}\ngroup top {{ motion }}
        identify {{ v0 in -1 .. 1 m/s from 0 m/s }}"
    ));
    let [experiment] = study.experiments.as_slice() else { panic!("one experiment") };
    assert_eq!((experiment.window, experiment.measures.as_slice()), (Some((1.0, 10.0)), [1].as_slice()));
    assert_eq!(experiment.columns, [("v".to_owned(), "speed".to_owned())]);
    assert_eq!((experiment.start.base, experiment.start.overrides.len()), (StartBase::Rest, 2));
    assert_eq!(experiment.constant_inputs, [(1, 5.0)]);
    let filter = study.filter.expect("a filter");
    assert_eq!((filter.pass, filter.pass_drop, filter.stop, filter.stop_attenuation), (5.0, 2.0, 7.0, 20.0));
    assert!(filter.single_pass_specification && study.remove_mean);
    close(study.solver.relative_tolerance, 1e-8);
    assert_eq!(study.groups.channels, [1]);
    assert_eq!(
        (study.groups.groups[0].name.as_str(), study.groups.groups[0].groups[0].channels.as_slice()),
        ("top", [0].as_slice())
    );
    let kinds: Vec<PlaceKind> = study.places.iter().map(|place| place.kind).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == PlaceKind::Input).count(), 2);
}
