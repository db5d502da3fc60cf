//! Butterworth design and zero-phase filtering against SciPy 1.17.1 (`buttord`, `butter`, `sosfiltfilt`), tabulated.

use ident::diagnostics::{Code, Span};
use ident::signal::{Butterworth, FilterError, LowPass, Passes, Prefilter};

const AGREEMENT: f64 = 1e-9;

fn low_pass(pass: f64, stop: f64, pass_drop: f64, stop_attenuation: f64) -> LowPass {
    LowPass { pass, pass_drop, stop, stop_attenuation, passes: Passes::One }
}

fn relative(value: f64, reference: f64) -> f64 {
    (value - reference).abs() / reference.abs()
}

/// The signal that SciPy was given: x[k] for k = 0..199.
fn signal() -> Vec<f64> {
    (0..200)
        .map(|k| {
            let t = f64::from(k);
            (0.05 * t).sin() + 0.3 * (1.7 * t).cos() + 0.01 * t + 0.2 * f64::from((k * 7919) % 13) / 13.0
        })
        .collect()
}

/// `scipy.signal.buttord(pass, stop, drop, attenuation, fs=rate)`.
#[test]
fn order_and_cutoff_agree_with_scipy() {
    let table = [
        (50.0, 5.0, 7.0, 2.0, 20.0, 7, 5.1819782316713425),
        (50.0, 5.0, 7.0, 1.0, 10.0, 5, 5.667101123337658),
        (50.0, 2.0, 10.0, 3.0, 40.0, 3, 2.001566969292202),
        (50.0, 10.0, 20.0, 0.5, 30.0, 4, 12.050543783457385),
        (100.0, 5.0, 7.0, 2.0, 20.0, 8, 5.1675114220662905),
        (100.0, 5.0, 7.0, 1.0, 10.0, 6, 5.584403216576248),
        (100.0, 2.0, 10.0, 3.0, 40.0, 3, 2.0015794382363548),
        (100.0, 10.0, 20.0, 0.5, 30.0, 6, 11.75841938844393),
        (1000.0, 5.0, 7.0, 2.0, 20.0, 8, 5.170413088731755),
        (1000.0, 5.0, 7.0, 1.0, 10.0, 6, 5.595811720062137),
        (1000.0, 2.0, 10.0, 3.0, 40.0, 3, 2.001583566039267),
        (1000.0, 10.0, 20.0, 0.5, 30.0, 7, 11.619976556898129),
    ];
    for (rate, pass, stop, drop, attenuation, order, cutoff) in table {
        let filter = Butterworth::design(&low_pass(pass, stop, drop, attenuation), rate).unwrap();
        assert_eq!(filter.order, order, "{pass}/{stop} Hz at {rate} Hz");
        assert!(relative(filter.cutoff, cutoff) < AGREEMENT, "{} against {cutoff}", filter.cutoff);
    }
}

/// The seed document's example (its section 4.1.2): 5/7 Hz, 2/20 dB gives order 8 when the figures are those of one
/// pass; referred to the whole zero-phase operation (1/10 dB per pass) order 6 is enough.
#[test]
fn the_document_s_example_is_of_order_eight_for_one_pass() {
    let one = low_pass(5.0, 7.0, 2.0, 20.0);
    let filter = Butterworth::design(&one, 1000.0).unwrap();
    assert_eq!(filter.order, 8);
    assert!((20.0 * filter.amplitude(5.0).log10() + 2.0).abs() < 1e-9);
    assert!(20.0 * filter.amplitude(7.0).log10() < -20.0);
    let whole = Prefilter::new(Some(filter), false);
    assert!((20.0 * whole.amplitude(5.0).log10() + 4.0).abs() < 1e-9);

    let both = Butterworth::design(&LowPass { passes: Passes::Both, ..one }, 1000.0).unwrap();
    assert_eq!(both.order, 6);
    let whole = Prefilter::new(Some(both), false);
    assert!((20.0 * whole.amplitude(5.0).log10() + 2.0).abs() < 1e-9);
    assert!(20.0 * whole.amplitude(7.0).log10() < -20.0);
}

/// `scipy.signal.butter(8, 5.1675114220662905, fs=100, output='sos')`; SciPy carries the whole gain in its first
/// section.
#[test]
fn sections_agree_with_scipy() {
    let filter = Butterworth::with_cutoff(8, 5.1675114220662905, 100.0).unwrap();
    let table = [
        [-1.4437747957075424, 0.5233685491933865],
        [-1.498129027471099, 0.5807192713630392],
        [-1.6101350988624563, 0.6989001171456288],
        [-1.7844466901351708, 0.8828213191877893],
    ];
    for (section, a) in filter.sections.iter().zip(table) {
        assert!(relative(section.a[0], a[0]) < AGREEMENT && relative(section.a[1], a[1]) < AGREEMENT);
        assert!(relative(section.b[1], 2.0 * section.b[0]) < 1e-15);
    }
    let gain: f64 = filter.sections.iter().map(|section| section.b[0]).product();
    assert!(relative(gain, 2.242294871202567e-07) < AGREEMENT);
}

/// `sosfiltfilt(butter(order, cutoff, fs=rate, output='sos'), x, padlen=padding)` at samples 0, 1, 50, 117, 198, 199.
#[test]
fn zero_phase_filtering_agrees_with_scipy() {
    type Case = (u32, f64, f64, usize, [f64; 6]);
    let document = 5.1675114220662905;
    #[rustfmt::skip]
    let table: [Case; 8] = [
        (8, document, 100.0, 27, [0.29507026355338445, 0.31222156608725005, 1.1887991633666208, 0.8428274089284037, 1.768957409929332, 1.7644230263625977]),
        (8, document, 100.0, 100, [0.2999282094958111, 0.31718973230380665, 1.1885680405766879, 0.8427251143398732, 1.7702988198732141, 1.7759612913216962]),
        (1, 10.0, 100.0, 6, [0.3020474747233616, 0.2279745131046262, 1.1774898921143429, 0.8155770051104195, 1.6816091756941272, 1.778059897670205]),
        (2, 3.0, 100.0, 9, [0.3031325788679454, 0.3256474992345273, 1.1879056600867317, 0.8442371386747078, 1.7819144750980735, 1.776354548016588]),
        (3, 20.0, 100.0, 12, [0.299999763721735, 0.08730714403808465, 1.2207347213160196, 0.7992892319173415, 1.5909096180790379, 1.7758495807238726]),
        (4, 100.0, 1000.0, 15, [0.3011142230878964, 0.27329542860836387, 1.1828574100484537, 0.8283418677258013, 1.7180409772171772, 1.7764029193494097]),
        (5, 12.0, 81.0, 18, [0.3001520329123304, 0.2029133299720986, 1.2054658877725064, 0.8210472379614924, 1.6544618983613453, 1.775127127526448]),
        (7, 1.0, 1000.0, 150, [-1.478799964955835, -1.478789088390504, -1.478420160814295, -1.4782410560488624, -1.4782042849520431, -1.4782042008067364]),
    ];
    for (order, cutoff, rate, padding, expected) in table {
        let design = Butterworth::with_cutoff(order, cutoff, rate).unwrap();
        let mut column = signal();
        Prefilter::new(Some(design), false).with_padding(padding).apply(&mut column);
        for (index, reference) in [0, 1, 50, 117, 198, 199].into_iter().zip(expected) {
            let error = (column[index] - reference).abs();
            assert!(error < AGREEMENT, "order {order}, {cutoff} Hz, sample {index}: {error:e}");
        }
    }
}

/// Energy of the impulse response and trace(F^T F) for 300 samples, from SciPy's filter applied to unit columns.
#[test]
fn noise_energy_agrees_with_scipy() {
    let design = Butterworth::with_cutoff(8, 5.1675114220662905, 100.0).unwrap();
    let filter = Prefilter::new(Some(design), false).with_padding(100);
    assert!(relative(filter.noise_gain(), 0.09759082649760743) < AGREEMENT);
    assert!(relative(filter.trace(300), 33.45751186536663) < AGREEMENT);
}

/// The fast trace (ends plus shifted copies) equals the sum over all unit columns.
#[test]
fn trace_of_long_columns_is_exact() {
    let design = Butterworth::with_cutoff(4, 12.0, 100.0).unwrap();
    for remove_mean in [false, true] {
        let filter = Prefilter::new(Some(design.clone()), remove_mean);
        let count = 900;
        let direct: f64 = (0..count)
            .map(|index| {
                let mut column = vec![0.0; count];
                column[index] = 1.0;
                filter.apply(&mut column);
                column.iter().map(|value| value * value).sum::<f64>()
            })
            .sum();
        assert!(relative(filter.trace(count), direct) < 1e-6, "{} against {direct}", filter.trace(count));
    }
}

#[test]
fn the_operator_is_linear_and_keeps_lines_but_for_transients() {
    let design = Butterworth::design(&low_pass(5.0, 7.0, 2.0, 20.0), 200.0).unwrap();
    let filter = Prefilter::new(Some(design), false);
    let line: Vec<f64> = (0..400).map(|k| 3.0 - 0.02 * f64::from(k)).collect();
    let mut filtered = line.clone();
    filter.apply(&mut filtered);
    // What is left of the start-up transient after the padding: 1e-3 of the filter's lag (40 samples) times the slope.
    assert!(line.iter().zip(&filtered).all(|(a, b)| (a - b).abs() < 2e-3));

    let (mut a, mut b) = (signal(), line[..200].to_vec());
    let mut sum: Vec<f64> = a.iter().zip(&b).map(|(x, y)| 2.0 * x - 0.5 * y).collect();
    filter.apply(&mut a);
    filter.apply(&mut b);
    filter.apply(&mut sum);
    assert!((0..200).all(|k| (sum[k] - 2.0 * a[k] + 0.5 * b[k]).abs() < 1e-12));
}

#[test]
fn short_columns_and_the_mean() {
    let design = Butterworth::with_cutoff(8, 5.0, 1000.0).unwrap();
    let filter = Prefilter::new(Some(design), true);
    for count in 0..5 {
        let mut column = vec![2.5; count];
        filter.apply(&mut column);
        assert!(column.iter().all(|value| value.abs() < 1e-9));
    }
    let mut columns = vec![1.0, 2.0, 3.0, 10.0, 10.0, 10.0];
    Prefilter::new(None, true).apply_columns(3, &mut columns);
    assert_eq!(columns, [-1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn impossible_specifications_are_refused() {
    let design = |specification: LowPass, rate| Butterworth::design(&specification, rate).err();
    assert_eq!(design(low_pass(7.0, 5.0, 2.0, 20.0), 100.0), Some(FilterError::Contradictory));
    assert_eq!(design(low_pass(5.0, 7.0, 20.0, 2.0), 100.0), Some(FilterError::Contradictory));
    assert_eq!(design(low_pass(f64::NAN, 7.0, 2.0, 20.0), 100.0), Some(FilterError::Contradictory));
    assert_eq!(
        design(low_pass(5.0, 7.0, 2.0, 20.0), 12.0),
        Some(FilterError::StopAboveNyquist { stop: 7.0, nyquist: 6.0 })
    );
    assert!(matches!(design(low_pass(5.0, 5.01, 1.0, 60.0), 100.0), Some(FilterError::TooSteep { .. })));
}

#[test]
fn an_impossible_filter_is_reported_at_its_place() {
    let error = Butterworth::design(&low_pass(5.0, 7.0, 2.0, 20.0), 12.0).unwrap_err();
    let diagnostic = error.diagnostic(Span { file: 0, start: 3, end: 9 });
    assert_eq!(diagnostic.code, Code::FILTER_IMPOSSIBLE);
    assert_eq!(diagnostic.message, "the stop edge 7 Hz is not below half the sampling rate, 6 Hz");
    assert!(diagnostic.help[0].contains("below 6 Hz"));
}
