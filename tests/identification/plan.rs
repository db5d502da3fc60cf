//! What a plan promises is what a test of that kind then tells.

use crate::shipped::{compiled, fitted, loaded};
use ident::analyse::{Plan, PlanOptions, plan};
use ident::fit::PriorRow;
use ident::identify::{SavedResult, Settings, confidence};
use ident::simulation::{Compiled, Gradient, excitation, simulate};
use ident::statistics::NormalStream;

const OFFERED: &str = "
manoeuvre creep { push_force = 60 N * sin(0.6 * t / (1 s)), for 3 s, step = 4 ms, start = rest }
manoeuvre sweep { push_force = 60 N * sin((6 + 8 * t / (1 s)) * t / (1 s)), for 3 s, step = 4 ms, start = rest }
manoeuvre blow { push_force = 500 N * smoothstep(t / 20 ms), for 2 s, start = rest }
criterion travel = max(guide.position) in blow { below = 1 m }";

fn spring_slide() -> Compiled {
    compiled(&loaded("spring_slide").with_text(OFFERED)).0
}

fn options(compiled: &Compiled) -> PlanOptions {
    let theta = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
    PlanOptions { theta, rate: None, accuracy: 0.01, knowledge: Vec::new() }
}

fn planned(compiled: &Compiled, options: &PlanOptions) -> Plan {
    plan(compiled, options).expect("a plan")
}

/// Deviations promised for the sweep are those that a fit of the sweep with noise of that size reports.
#[test]
fn promised_deviations_are_those_of_a_fit() {
    let mut compiled = spring_slide();
    let noise = [0.2e-3, 0.1];
    compiled.study.measures.iter_mut().zip(noise).for_each(|(measure, noise)| measure.noise = Some(noise));
    let options = options(&compiled);
    let plan = planned(&compiled, &options);
    let mut record = excitation(&compiled.study, 1, 4e-3);
    let exact = simulate(&compiled, &record, &options.theta, Gradient::None).expect("a simulation").channels;
    let mut stream = NormalStream::new(3, 0);
    let noisy = exact
        .iter()
        .zip(noise)
        .map(|(channel, noise)| channel.iter().map(|value| value + noise * stream.normal()).collect());
    record.measured = noisy.collect();
    let fit = fitted(&compiled, &[record], &Settings::default());
    let confidence = confidence(&compiled, &fit);
    let promised = &plan.excitations.iter().find(|e| e.name == "sweep").expect("the sweep").outcome.parameters;
    for (j, (parameter, declared)) in promised.iter().zip(&compiled.study.parameters).enumerate() {
        let obtained = declared.unit.difference_from_si(confidence.standard_deviation(j).expect("determined"));
        let ratio = parameter.standard_deviation.expect("determined") / obtained;
        assert!((0.85..1.15).contains(&ratio), "{}: {ratio}", parameter.name);
    }
}

/// A slow push moves the spring only: mass and damping are hardly seen, the sweep wins; the rate follows its band.
#[test]
fn the_excitation_that_moves_everything_wins() {
    let compiled = spring_slide();
    let plan = planned(&compiled, &options(&compiled));
    let winner = |measure: &str| {
        plan.best
            .iter()
            .find(|best| best.measure == measure)
            .and_then(|best| best.excitation.clone())
            .unwrap_or_default()
    };
    assert_ne!(winner("D"), "creep");
    assert_ne!(winner("A"), "creep");
    let by_name = |name: &str| plan.excitations.iter().find(|e| e.name == name).expect("offered");
    let (creep, sweep) = (by_name("creep"), by_name("sweep"));
    assert!(creep.outcome.d_measure > sweep.outcome.d_measure);
    assert!(creep.repetitions > sweep.repetitions);
    assert!(sweep.useful_rate > 20.0 && sweep.useful_rate < 400.0, "{}", sweep.useful_rate);
    let mean = |outcome: &ident::analyse::Outcome| outcome.a_measure.expect("determined");
    assert!(plan.excitations.iter().all(|e| mean(&plan.together) <= mean(&e.outcome)));
}

/// Twice the rate is twice the information, and knowledge from before adds up.
#[test]
fn rate_and_earlier_knowledge_count() {
    let compiled = spring_slide();
    let plain = options(&compiled);
    let deviation = |options: &PlanOptions| {
        planned(&compiled, options).excitations[1].outcome.parameters[0].standard_deviation.expect("determined")
    };
    let once = deviation(&plain);
    let faster = deviation(&PlanOptions { rate: Some(500.0), ..plain.clone() });
    assert!((once / faster / 2f64.sqrt() - 1.0).abs() < 0.02, "{once} {faster}");
    let known = PriorRow::gaussian(0, 7.0, 1e-4);
    let with = deviation(&PlanOptions { knowledge: vec![known], ..plain });
    assert!(with < 1.01e-4, "{with}");
}

/// Two springs in series: no excitation determines both, and the plan says so before any test.
#[test]
fn what_no_test_determines_is_named_before() {
    let (compiled, records) = compiled(&loaded("series_springs"));
    let plan = planned(&compiled, &options(&compiled));
    assert_eq!(plan.together.undetermined, ["only the series `1/(1/c_near + 1/c_far)` is determined"]);
    assert!(plan.best.iter().any(|best| best.measure == "D" && best.excitation.is_none()));
    assert_eq!(plan.fix.len(), 1);
    let named = |name: &str| plan.together.criteria.iter().find(|criterion| criterion.name == name).expect("declared");
    assert!(named("travel").standard_deviation.is_some() && named("near_stretch").standard_deviation.is_none());
    // A saved result of the series alone does not help, a prior for one spring does.
    let fit = fitted(&compiled, &records, &Settings::default());
    let saved = SavedResult::new(&compiled, &fit, &confidence(&compiled, &fit), Vec::new()).expect("finite");
    let rows = saved.rows(&compiled.study.parameters).expect("the same parameters");
    assert_eq!(rows.len(), 2);
    let helped = planned(
        &compiled,
        &PlanOptions { knowledge: vec![PriorRow::gaussian(0, 9300.0, 100.0)], ..options(&compiled) },
    );
    assert!(helped.together.undetermined.is_empty());
}

/// Every listed choice is the best of its size by an independent count, and more is listed only where it helps; what
/// limits the test is named with the repetitions that deviations over roots promise.
#[test]
fn tests_and_sensors_are_chosen_together() {
    let compiled = spring_slide();
    let options = options(&compiled);
    let plan = planned(&compiled, &options);
    let of = |measure: &str| plan.combinations.iter().filter(|c| c.measure == measure).cloned().collect::<Vec<_>>();
    for measure in ["D", "A", "travel"] {
        let listed = of(measure);
        assert!(!listed.is_empty() && listed.iter().all(|choice| choice.exact), "{measure}");
        for (k, choice) in listed.iter().enumerate() {
            let smaller = listed[..k].iter().filter(|other| {
                other.sensors.len() <= choice.sensors.len() && other.excitations.len() <= choice.excitations.len()
            });
            assert!(smaller.into_iter().all(|other| choice.value < 0.96 * other.value), "{measure}: {listed:?}");
        }
        let last = listed.last().expect("listed");
        assert!(last.value <= 1.06 * last.with_everything && last.value >= last.with_everything, "{last:?}");
    }
    // One test with one sensor: what the excitation's table says.
    let single = of("D").into_iter().find(|c| c.sensors.len() == 1 && c.excitations.len() == 1).expect("one each");
    let alone = plan.excitations.iter().flat_map(|e| e.sensors.iter().filter_map(move |s| Some((s.alone?, e, s))));
    let best = alone.min_by(|a, b| a.0.total_cmp(&b.0)).expect("one that determines all");
    assert_eq!((&single.excitations[0], &single.sensors[0]), (&best.1.name, &best.2.name));
    assert!((single.value / best.0 - 1.0).abs() < 1e-9);
    for excitation in &plan.excitations {
        let factors: Vec<f64> = excitation.needs.iter().map(|need| need.repetitions.expect("determined")).collect();
        for (need, parameter) in excitation.needs.iter().zip(&excitation.outcome.parameters) {
            let half_width = 1.959_964 * parameter.standard_deviation.expect("determined");
            assert!((need.repetitions.expect("determined") / (half_width / need.wanted).powi(2) - 1.0).abs() < 1e-4);
        }
        let most = factors.iter().copied().fold(1.0, f64::max).ceil();
        assert_eq!(excitation.repetitions, Some(most), "{}", excitation.name);
    }
}
