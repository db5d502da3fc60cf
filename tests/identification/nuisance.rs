//! Offsets and values per experiment, constraints, robust losses, several starts.

use crate::shipped::{compiled, fitted, loaded};
use ident::identify::{Settings, active_constraints, confidence};
use ident::simulation::Record;

/// Two halves of the record, the second with a shifted position channel.
fn shifted(shift: f64, text: &str) -> (ident::simulation::Compiled, Vec<Record>) {
    let again =
        "experiment again estimation { data = \"data/estimation.csv\", start = rest, offsets = { position = 5 mm } }";
    let loaded = loaded("spring_slide").with_text(&format!("{again}\n{text}"));
    let (compiled, mut records) = compiled(&loaded);
    records[1].measured[0].iter_mut().for_each(|value| *value += shift);
    (compiled, records)
}

#[test]
fn an_offset_of_one_channel_in_one_experiment_is_found() {
    let (compiled, records) = shifted(1.25e-3, "");
    let fit = fitted(&compiled, &records, &Settings::default());
    let confidence = confidence(&compiled, &fit);
    let at = compiled.study.parameters.iter().position(|p| p.name == "offset of position in again").expect("an offset");
    let (low, high) = confidence.interval(at).expect("determined");
    assert!(low <= 1.25e-3 && 1.25e-3 <= high && high - low < 1e-3, "{low} {high}");
}

/// Both experiments are the same record: values of their own agree, and held-out simulations take their mean.
#[test]
fn values_per_experiment_are_parameters_of_their_own() {
    let (compiled, records) =
        shifted(0.0, "variant own of base { identify { d_slide in 0 .. 500 N*s/m from 70 N*s/m per experiment } }");
    assert!(compiled.study.parameters.iter().all(|parameter| parameter.name != "d_slide in again"));
    let loaded = loaded("spring_slide").with_text(
        "experiment again estimation { data = \"data/validation.csv\", start = rest }
         variant own of base { identify { d_slide in 0 .. 500 N*s/m from 70 N*s/m per experiment } }",
    );
    let study = ident::study::check(&loaded, Some("own")).expect("a study").study;
    let own = ident::simulation::Compiled::new(study).expect("a mechanism");
    let names: Vec<&str> = own.study.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(names, ["m_slider", "c_return", "d_slide in shaking", "d_slide in again"]);
    // The same model where both values are equal; the first record does not know the second value.
    let theta = [8.0, 6200.0, 90.0, 90.0];
    let simulate = ident::simulation::simulate;
    let gradient = ident::simulation::Gradient::AllParameters;
    let both = simulate(&own, &records[0], &theta, gradient).expect("a simulation");
    let samples = records[0].sample_count();
    assert!(both.gradient[0][3 * samples..4 * samples].iter().all(|slope| *slope == 0.0));
    assert!(both.gradient[0][2 * samples..3 * samples].iter().any(|slope| *slope != 0.0));
    let one = simulate(&compiled, &records[0], &[8.0, 6200.0, 90.0, 0.0], gradient).expect("a simulation");
    let largest = one.channels[0].iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let apart = one.channels[0].iter().zip(&both.channels[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-5 * largest, "{apart} of {largest}");
}

/// The damping would be about 80 N s/m; demanded is d >= c * 20 ms = 124 N s/m.
#[test]
fn an_active_constraint_holds() {
    let loaded =
        loaded("spring_slide").with_text("variant held of base { identify { constrain d_slide >= c_return * 20 ms } }");
    let study = ident::study::check(&loaded, Some("held")).expect("a study").study;
    let held = ident::simulation::Compiled::new(study).expect("a mechanism");
    let (_, records) = compiled(&loaded);
    let fit = fitted(&held, &records, &Settings::default());
    let excess = fit.theta[2] - 0.02 * fit.theta[1];
    assert!(excess.abs() < 2e-3, "{:?}", fit.theta);
    assert_eq!(active_constraints(&held.study, &fit.theta), ["d_slide >= c_return * 20 ms"]);
}

/// One sample in twenty is far off: squares are led astray, robust losses are not.
#[test]
fn outliers_do_not_lead_a_robust_fit_astray() {
    let with = |loss: &str| {
        let loaded = loaded("series_springs").with_text(&format!("solver {{ loss = {loss} }}"));
        let (compiled, mut records) = compiled(&loaded);
        for channel in &mut records[0].measured {
            channel.iter_mut().skip(7).step_by(20).for_each(|value| *value *= 3.0);
        }
        let fit = fitted(&compiled, &records, &Settings::default());
        (fit.theta[0] * fit.theta[1] / (fit.theta[0] + fit.theta[1]) / 6200.0 - 1.0).abs()
    };
    let [squares, huber, student] = ["squares", "huber", "student"].map(with);
    assert!(huber < 0.2 * squares && student < 0.05 * squares && student < 2e-3, "{squares} {huber} {student}");
}

/// Several starts on several experiments find the same minimum on one thread and on two, to the last digit.
#[test]
fn several_starts_give_the_same_digits_on_any_number_of_threads() {
    let (compiled, whole) = compiled(&loaded("spring_slide"));
    let records = [whole[0].part(0..400, "first"), whole[0].part(400..800, "second"), whole[0].part(800..1000, "last")];
    let settings = Settings { further_starts: 3, seed: 2, ..Settings::default() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let fit = pool.install(|| fitted(&compiled, &records, &settings));
        (fit.theta, fit.start_costs)
    };
    let (one, two) = (on(1), on(2));
    assert_eq!(one, two);
    assert_eq!(one.1.len(), 4);
    assert!(one.1.windows(2).all(|pair| pair[0] <= pair[1]));
}
