//! Identifiability, covariance, noise, comparison: against closed solutions, tabulated SciPy 1.17.1 figures and
//! repeated experiments with known truth.

use ident::fit::{Bounds, Control, EvaluationFailure, LeastSquares, Options, levenberg_marquardt};
use ident::signal::{Butterworth, Prefilter};
use ident::statistics::{
    Covariance, Information, NoiseChannel, aicc, bic, block_length, chi_square_p, combine, compare_blocks,
    confidence_interval, error_change, f_test_p, filtered_noise_gamma, identifiability, likelihood_ratio_p, mixture_p,
    noise_variance, noise_variances, normal_quantile, principal_angles, stationary_noise_gamma, student_quantile,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Standard normal samples by the Box-Muller transformation.
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = move || ((generator.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    (0..count).map(|_| (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()).collect()
}

fn columns(count: usize, functions: &[&dyn Fn(f64) -> f64]) -> Vec<f64> {
    functions.iter().flat_map(|function| (0..count).map(|k| function(k as f64 / count as f64))).collect()
}

fn close(value: f64, reference: f64, relative: f64) -> bool {
    (value - reference).abs() <= relative * reference.abs()
}

// ---- identifiability ----

fn description(gradient: &[f64], scale: &[f64], values: &[f64], names: &[&str]) -> Vec<String> {
    let result = identifiability(gradient, scale, values, names, 1e-8).unwrap();
    result.undetermined.into_iter().map(|direction| direction.description).collect()
}

#[test]
fn undetermined_directions_are_named() {
    let wave = |x: f64| (9.0 * x).sin();
    let ramp = |x: f64| x * x;
    let names = ["c1", "c2", "m"];
    // Parallel springs: the load is (c1 + c2) x, whatever the width of their bounds.
    let parallel = columns(50, &[&wave, &wave, &ramp]);
    assert_eq!(
        description(&parallel, &[100.0, 40.0, 1.0], &[30.0, 20.0, 1.0], &names),
        ["only the sum `c1 + c2` is determined"]
    );
    let opposed = columns(50, &[&wave, &|x| -wave(x), &ramp]);
    assert_eq!(
        description(&opposed, &[1.0; 3], &[30.0, 20.0, 1.0], &names),
        ["only the difference `c1 - c2` is determined"]
    );
    // y = c1 c2 wave and y = c1 / c2 wave at c1 = 30, c2 = 20.
    let factors = columns(50, &[&|x| 20.0 * wave(x), &|x| 30.0 * wave(x), &ramp]);
    assert_eq!(
        description(&factors, &[100.0, 40.0, 1.0], &[30.0, 20.0, 1.0], &names),
        ["only the product `c1 * c2` is determined"]
    );
    let ratio = columns(50, &[&|x| wave(x) / 20.0, &|x| -30.0 / 400.0 * wave(x), &ramp]);
    assert_eq!(
        description(&ratio, &[100.0, 40.0, 1.0], &[30.0, 20.0, 1.0], &names),
        ["only the ratio `c1 / c2` is determined"]
    );
    let idle = columns(50, &[&wave, &|_| 0.0, &ramp]);
    assert_eq!(description(&idle, &[1.0; 3], &[1.0; 3], &names), ["`c2` has no influence on the compared data"]);
    let three = columns(50, &[&wave, &wave, &wave]);
    assert_eq!(description(&three, &[1.0, 5.0, 9.0], &[1.0; 3], &names), ["only the sum `c1 + c2 + m` is determined"]);
    assert!(description(&columns(50, &[&wave, &ramp, &|x| x]), &[1.0; 3], &[1.0; 3], &names).is_empty());
}

/// Two springs in series act as k1 k2 / (k1 + k2): exactly one undetermined direction, which takes part in neither the
/// combined stiffness nor its derivative, but in each spring alone (the seed document's section 5.2.4).
#[test]
fn springs_in_series() {
    let (k1, k2, scale) = (40.0, 25.0, [100.0, 60.0, 2.0]);
    let total = k1 + k2;
    let by = [k2 * k2 / (total * total), k1 * k1 / (total * total)];
    let gradient = columns(60, &[&|x| by[0] * (7.0 * x).sin(), &|x| by[1] * (7.0 * x).sin(), &|x| x]);
    let result = identifiability(&gradient, &scale, &[k1, k2, 1.0], &["k1", "k2", "d"], 1e-8).unwrap();
    assert_eq!((result.rank, result.undetermined.len()), (2, 1));
    let family = &result.undetermined[0];
    assert_eq!((family.parameters.as_slice(), family.directions.len()), ([0, 1].as_slice(), 1));
    assert_eq!(family.description, "only the series `1/(1/k1 + 1/k2)` is determined");
    assert!(result.measures[2] < 1.0 && result.measures.iter().all(|measure| (0.0..=1.0).contains(measure)));

    let covariance = Covariance::new(&gradient, &scale, 0.01, None, 1e-8).unwrap();
    assert_eq!(covariance.undetermined.len(), 1);
    assert!(covariance.standard_deviations[0].is_none() && covariance.standard_deviations[2].is_some());
    assert!(covariance.variance_of(&[by[0], by[1], 0.0], &scale).is_some());
    assert!(covariance.variance_of(&[1.0, 0.0, 0.0], &scale).is_none());
    let correlation = covariance.correlation();
    assert_eq!((correlation[0], correlation[1], correlation[8]), (1.0, 0.0, 1.0));
}

// ---- repeated experiments: noise variance and coverage ----

/// y = theta . columns, compared after the prefilter; the same optimiser that studies use.
struct Linear<'a> {
    columns: &'a [f64],
    filtered: &'a [f64],
    measured: &'a [f64],
    filter: &'a Prefilter,
}

impl LeastSquares for Linear<'_> {
    fn residual(&mut self, theta: &[f64]) -> Result<Vec<f64>, EvaluationFailure> {
        let rows = self.measured.len();
        let mut error: Vec<f64> = (0..rows)
            .map(|i| {
                theta.iter().enumerate().map(|(j, value)| self.columns[j * rows + i] * value).sum::<f64>()
                    - self.measured[i]
            })
            .collect();
        self.filter.apply(&mut error);
        Ok(error)
    }

    fn residual_and_gradient(&mut self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), EvaluationFailure> {
        Ok((self.residual(theta)?, self.filtered.to_vec()))
    }
}

struct Repetitions {
    /// Share of 95 % intervals that hold the truth, per parameter.
    coverage: Vec<f64>,
    mean_variance: f64,
    mean_plain_variance: f64,
}

const TRUTH: [f64; 4] = [1.5, -0.7, 2.0, 0.4];
const SAMPLES: usize = 150;

/// 500 fits with fresh noise. `autocovariance` of the noise: white when it has one entry.
fn repeat(filter: &Prefilter, autocovariance: &[f64], make_noise: &dyn Fn(u64) -> Vec<f64>) -> Repetitions {
    let shapes: [&dyn Fn(f64) -> f64; 4] = [&|x| (11.0 * x).sin(), &|x| (4.0 * x).cos(), &|x| x, &|x| (25.0 * x).sin()];
    let columns = columns(SAMPLES, &shapes);
    let mut filtered = columns.clone();
    filter.apply_columns(SAMPLES, &mut filtered);
    let clean: Vec<f64> = (0..SAMPLES).map(|i| (0..4).map(|j| columns[j * SAMPLES + i] * TRUTH[j]).sum()).collect();
    let scale = [6.0; 4];
    let trace = filter.trace(SAMPLES);
    let repetitions = 500;
    let mut hits = [0; 4];
    let (mut variances, mut plain) = (0.0, 0.0);
    for seed in 0..repetitions {
        let measured: Vec<f64> = clean.iter().zip(make_noise(seed)).map(|(y, e)| y + e).collect();
        let mut problem = Linear { columns: &columns, filtered: &filtered, measured: &measured, filter };
        let bounds = Bounds::new(vec![-3.0; 4], vec![3.0; 4]);
        let estimate =
            levenberg_marquardt(&mut problem, &[0.0; 4], &bounds, &Options::default(), &mut |_| Control::Continue)
                .unwrap();
        let block =
            NoiseChannel { channel: 0, residual: &estimate.residual, gradient: &estimate.gradient, weight: 1.0, trace };
        let variance = noise_variances(&[block], &scale, None, 1e-10, &|_, column| filter.apply(column)).unwrap()[0];
        variances += variance;
        plain += noise_variance(estimate.cost, trace);
        let gamma = if autocovariance.len() > 1 {
            stationary_noise_gamma(&estimate.gradient, 4, &[(SAMPLES, autocovariance.to_vec())])
        } else {
            filtered_noise_gamma(&estimate.gradient, 4, &[(SAMPLES, variance)], &|column| filter.apply(column))
        };
        let covariance = Covariance::new(&estimate.gradient, &scale, variance, Some(&gamma), 1e-10).unwrap();
        for j in 0..4 {
            let deviation = covariance.standard_deviations[j].unwrap();
            let (low, high) = confidence_interval(estimate.theta[j], deviation, SAMPLES as f64 - 4.0, 0.95);
            hits[j] += usize::from(low <= TRUTH[j] && TRUTH[j] <= high);
        }
    }
    let count = repetitions as f64;
    Repetitions {
        coverage: hits.iter().map(|&hit| hit as f64 / count).collect(),
        mean_variance: variances / count,
        mean_plain_variance: plain / count,
    }
}

fn scaled_noise(deviation: f64) -> impl Fn(u64) -> Vec<f64> {
    move |seed| noise(SAMPLES, 1000 + seed).into_iter().map(|value| deviation * value).collect()
}

/// 500 repetitions: the standard error of a coverage of 95 % is 1 %; the mean of the variances (150 samples, a third of
/// them left by the filter) is good to about 1 %.
fn assert_honest(result: &Repetitions, variance: f64) {
    println!(
        "coverage {:?}, variance {} (plain {})",
        result.coverage, result.mean_variance, result.mean_plain_variance
    );
    let mean = result.coverage.iter().sum::<f64>() / 4.0;
    assert!((0.93..=0.97).contains(&mean), "{:?}", result.coverage);
    assert!(result.coverage.iter().all(|share| (0.92..=0.98).contains(share)), "{:?}", result.coverage);
    assert!(close(result.mean_variance, variance, 0.02), "{} against {variance}", result.mean_variance);
}

#[test]
fn intervals_are_honest_for_white_noise() {
    assert_honest(&repeat(&Prefilter::identity(), &[1.0], &scaled_noise(0.3)), 0.09);
}

/// With the prefilter; the plain estimate (method 4.6) is too small by the share of the fitted parameters, the exact
/// one (4.5) is not.
#[test]
fn intervals_are_honest_behind_a_prefilter() {
    let filter = Prefilter::new(Some(Butterworth::with_cutoff(4, 8.0, 50.0).unwrap()), false);
    let result = repeat(&filter, &[1.0], &scaled_noise(0.3));
    assert_honest(&result, 0.09);
    assert!(result.mean_plain_variance < 0.95 * 0.09, "{}", result.mean_plain_variance);
}

/// AR(1) noise with known autocovariance: honest with it, far too narrow when taken as white.
#[test]
fn intervals_are_honest_for_coloured_noise() {
    let (a, deviation) = (0.7_f64, 0.2);
    let coloured = |seed: u64| {
        let innovations = noise(SAMPLES + 100, 5000 + seed);
        let mut state = 0.0;
        let samples: Vec<f64> = innovations
            .iter()
            .map(|e| {
                state = a * state + deviation * e;
                state
            })
            .collect();
        samples[100..].to_vec()
    };
    let variance = deviation * deviation / (1.0 - a * a);
    let autocovariance: Vec<f64> = (0..60).map(|lag| variance * a.powi(lag)).collect();
    let honest = repeat(&Prefilter::identity(), &autocovariance, &coloured);
    println!("coverage {:?}", honest.coverage);
    assert!(honest.coverage.iter().all(|share| (0.92..=0.98).contains(share)), "{:?}", honest.coverage);
    let naive = repeat(&Prefilter::identity(), &[1.0], &coloured);
    assert!(naive.coverage[2] < 0.85, "{:?}", naive.coverage);
}

/// Two channels of different noise, one of them in two records: every variance is found, although the channels share
/// the parameters.
#[test]
fn noise_variances_of_several_channels() {
    let deviations = [0.1, 2.0];
    let (blocks, rows, repetitions) = ([(0, 40), (1, 40), (0, 25)], 105, 400);
    let gradient = {
        let wave = columns(rows, &[&|x| (30.0 * x).sin(), &|x| 1.0 + x, &|x| (12.0 * x).cos()]);
        let mut weighted = wave.clone();
        for j in 0..3 {
            (40..80).for_each(|i| weighted[j * rows + i] *= 0.5);
        }
        weighted
    };
    let weights = [1.0, 0.5];
    let inverse = Covariance::new(&gradient, &[1.0; 3], 1.0, None, 0.0).unwrap().matrix;
    let mut means = [0.0; 2];
    for seed in 0..repetitions {
        let raw = noise(rows, 90_000 + seed);
        let mut residual = Vec::new();
        for (channel, length) in blocks {
            let first = residual.len();
            residual.extend(raw[first..first + length].iter().map(|e| weights[channel] * deviations[channel] * e));
        }
        // Linear least squares by the normal equations leaves the projection.
        let right: Vec<f64> = (0..3).map(|j| (0..rows).map(|i| gradient[j * rows + i] * residual[i]).sum()).collect();
        let step: Vec<f64> = (0..3).map(|i| (0..3).map(|j| inverse[j * 3 + i] * right[j]).sum()).collect();
        (0..rows).for_each(|i| residual[i] -= (0..3).map(|j| gradient[j * rows + i] * step[j]).sum::<f64>());
        let mut first = 0;
        let mut parts = Vec::new();
        for (channel, length) in blocks {
            let own: Vec<f64> =
                (0..3).flat_map(|j| gradient[j * rows + first..j * rows + first + length].to_vec()).collect();
            parts.push((channel, residual[first..first + length].to_vec(), own));
            first += length;
        }
        let channels: Vec<NoiseChannel> = parts
            .iter()
            .map(|(channel, residual, gradient)| NoiseChannel {
                channel: *channel,
                residual,
                gradient,
                weight: weights[*channel],
                trace: residual.len() as f64,
            })
            .collect();
        let variances = noise_variances(&channels, &[1.0; 3], None, 0.0, &|_, _| {}).unwrap();
        (0..2).for_each(|k| means[k] += variances[k] / repetitions as f64);
    }
    assert!(close(means[0], 0.01, 0.02) && close(means[1], 4.0, 0.03), "{means:?}");
}

// ---- combination ----

/// Two halves of a record combined give the estimate and covariance of the whole (exact for a linear model); also when
/// one half alone leaves a direction open.
#[test]
fn halves_combine_to_the_whole() {
    let rows = 60;
    let gradient = columns(rows, &[&|x| (20.0 * x).sin(), &|x| if x < 0.5 { (20.0 * x).sin() } else { x }, &|x| x * x]);
    let noise = noise(rows, 4);
    let measured: Vec<f64> =
        (0..rows).map(|i| (0..3).map(|j| gradient[j * rows + i] * TRUTH[j]).sum::<f64>() + 0.1 * noise[i]).collect();
    let scale = [2.0, 5.0, 1.0];
    let part = |from: usize, to: usize| {
        let own: Vec<f64> = (0..3).flat_map(|j| gradient[j * rows + from..j * rows + to].to_vec()).collect();
        let covariance = Covariance::new(&own, &scale, 0.01, None, 1e-9).unwrap();
        let right: Vec<f64> = (0..3).map(|j| (from..to).map(|i| gradient[j * rows + i] * measured[i]).sum()).collect();
        let theta: Vec<f64> =
            (0..3).map(|i| (0..3).map(|j| covariance.matrix[j * 3 + i] * right[j] / 0.01).sum()).collect();
        (theta, covariance, own)
    };
    let (first, second, whole) = (part(0, 30), part(30, 60), part(0, 60));
    assert_eq!((first.1.undetermined.len(), second.1.undetermined.len()), (1, 0));
    let from_covariance = |(theta, covariance, _): &(Vec<f64>, Covariance, Vec<f64>)| {
        Information::from_covariance(theta, &covariance.matrix, &covariance.undetermined, &scale).unwrap()
    };
    let from_gradient =
        |(theta, _, own): &(Vec<f64>, Covariance, Vec<f64>)| Information::from_gradient(theta, own, 0.01);
    for (a, b) in [
        (from_covariance(&first), from_covariance(&second)),
        (from_gradient(&first), from_gradient(&second)),
        (from_covariance(&second), from_covariance(&first)),
    ] {
        let combined = combine(&a, &b, &scale, 1e-9).unwrap();
        assert!(combined.undetermined.is_empty());
        for k in 0..3 {
            assert!((combined.theta[k] - whole.0[k]).abs() < 1e-8, "{:?} {:?}", combined.theta, whole.0);
        }
        for k in 0..9 {
            assert!((combined.covariance[k] - whole.1.matrix[k]).abs() < 1e-8 * whole.1.matrix[8]);
        }
    }
    let same = combine(&from_gradient(&first), &from_gradient(&first), &scale, 1e-7).unwrap();
    assert_eq!(same.undetermined.len(), 1);
}

// ---- comparison ----

/// `scipy.stats`: chi2.sf, f.sf, t.ppf, norm.ppf.
#[test]
fn probabilities_agree_with_scipy() {
    assert!(close(chi_square_p(12.3, 3), 0.006423057576577938, 1e-9));
    assert!(close(chi_square_p(300.0, 2), 7.175095973164448e-66, 1e-9));
    assert!(close(f_test_p(1.0 + 2.0 * 4.2 / 37.0, 1.0, 2, 37.0), 0.022709031743631255, 1e-9));
    assert!(close(student_quantile(0.975, 7.0), 2.364624251592784, 1e-7));
    assert!(close(student_quantile(0.995, 900.0), 2.5813030580049316, 1e-7));
    assert!(close(student_quantile(0.05, 3.0), -2.353363434801824, 1e-7));
    assert!(close(student_quantile(0.975, 1001.0), 1.9623367052808798, 1e-10));
    assert!(close(student_quantile(0.975, 1e5), 1.9599877075346095, 1e-10));
    assert!(close(normal_quantile(0.975), 1.959963984540054, 1e-9));
    assert_eq!(student_quantile(0.975, f64::INFINITY), normal_quantile(0.975));
    assert!(close(likelihood_ratio_p(2.0, 1.0, 12.3 / 2.0_f64.ln(), 3), 0.006423057576577938, 1e-9));
    assert!(close(mixture_p(2.705543454095404, 1, true), 0.05, 1e-6));
    assert_eq!((chi_square_p(0.0, 0), chi_square_p(1.0, 0)), (1.0, 0.0));
}

/// A superfluous column is chosen by BIC in few of 200 cases, a real one in nearly all.
#[test]
fn criteria_choose_the_true_structure() {
    let rows = 80;
    let mut chosen = [0, 0];
    for seed in 0..200 {
        let e = noise(rows, 777 + seed);
        for (case, strength) in [0.0, 0.8].into_iter().enumerate() {
            let y: Vec<f64> = (0..rows).map(|i| strength * (0.3 * i as f64).sin() + e[i]).collect();
            let energy: f64 = y.iter().map(|value| value * value).sum();
            let shape: Vec<f64> = (0..rows).map(|i| (0.3 * i as f64).sin()).collect();
            let product: f64 = shape.iter().zip(&y).map(|(a, b)| a * b).sum();
            let reduced = energy - product * product / shape.iter().map(|value| value * value).sum::<f64>();
            let better = bic(reduced, rows, rows as f64, 1) < bic(energy, rows, rows as f64, 0);
            chosen[case] += usize::from(better);
        }
    }
    assert!(chosen[0] < 20 && chosen[1] > 190, "{chosen:?}");
    assert_eq!(aicc(1.0, 3, 3.0, 1), f64::INFINITY);
    assert!(aicc(10.0, 50, 50.0, 2) < aicc(10.0, 50, 50.0, 3));
    // Half the effective count halves the weight of the evidence.
    let evidence = |count: f64| bic(10.0, 50, count, 0) - bic(5.0, 50, count, 0);
    assert!(close(evidence(25.0), 0.5 * evidence(50.0), 1e-12));
}

#[test]
fn bootstrap_intervals_of_a_change() {
    let squares = |values: &[f64]| values.iter().map(|value| value * value).collect::<Vec<f64>>();
    let (a, b) = (noise(600, 1), noise(600, 2));
    let independent = error_change(&[(squares(&a), squares(&b))], 10, 2000, 0.95, 7).unwrap();
    assert!(independent.lower < 0.0 && independent.upper > 0.0 && !independent.is_improvement());
    let smaller: Vec<f64> = a.iter().zip(&b).map(|(x, y)| 0.8 * x + 0.1 * y).collect();
    let better = error_change(&[(squares(&a), squares(&smaller))], 10, 2000, 0.95, 7).unwrap();
    assert!(better.is_improvement() && better.lower > -0.45 && better.upper < -0.25, "{better:?}");
    assert_eq!(Some(better), error_change(&[(squares(&a), squares(&smaller))], 10, 2000, 0.95, 7));
    let norm = better.of_norm();
    assert!(close((1.0 + norm.estimate).powi(2), 1.0 + better.estimate, 1e-12));
    assert_eq!(error_change(&[(vec![0.0; 5], vec![1.0; 5])], 2, 100, 0.95, 1), None);
    assert_eq!(error_change(&[], 2, 100, 0.95, 1), None);
    let two = error_change(
        &[(squares(&a[..300]), squares(&smaller[..300])), (squares(&a[300..]), squares(&smaller[300..]))],
        10,
        2000,
        0.95,
        7,
    );
    assert!(close(two.unwrap().estimate, better.estimate, 1e-12));
    assert!((8..20).contains(&block_length(&a)), "{}", block_length(&a));
}

/// Coverage of the bootstrap for a known change of variance (1 to 0.81, independent noise): 300 repetitions.
#[test]
fn bootstrap_intervals_hold_the_truth() {
    let hits = (0..300)
        .filter(|seed| {
            let (a, b) = (noise(400, 20_000 + seed), noise(400, 40_000 + seed));
            let base: Vec<f64> = a.iter().map(|value| value * value).collect();
            let extended: Vec<f64> = b.iter().map(|value| 0.81 * value * value).collect();
            let change = error_change(&[(base, extended)], 8, 500, 0.95, *seed).unwrap();
            change.lower <= -0.19 && -0.19 <= change.upper
        })
        .count();
    assert!((270..=297).contains(&hits), "{hits} of 300");
}

#[test]
fn blocks_show_where_a_model_is_better() {
    let (a, b) = (noise(400, 8), noise(400, 9));
    let better: Vec<f64> = a.iter().map(|value| 0.9 * value).collect();
    let comparison = compare_blocks(&[&a, &b], &[&better, &b], 8).unwrap();
    assert_eq!((comparison.wins, comparison.costs.len()), (8, 8));
    assert!(comparison.mean_log_ratio < 0.0 && comparison.interval.1 < 0.0 && comparison.p_value < 1e-3);
    let even = compare_blocks(&[&a], &[&b], 8).unwrap();
    assert!(even.interval.0 < 0.0 && even.interval.1 > 0.0 && even.p_value > 0.05);
    assert_eq!(compare_blocks(&[&a], &[&b], 1), None);
}

/// Planes in space at known angles; and v|v| against v^3 over a uniform v: cosine (1/6) / sqrt(1/5 * 1/7).
#[test]
fn principal_angles_of_known_spans() {
    let (c, s) = (0.3_f64.cos(), 0.3_f64.sin());
    let angles = principal_angles(3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &[1.0, 0.0, 0.0, 0.0, 5.0 * c, 5.0 * s]).unwrap();
    assert!(angles.len() == 2 && angles[0] < 1e-15 && (angles[1] - 0.3).abs() < 1e-14);
    let tiny = principal_angles(3, &[1.0, 0.0, 0.0], &[1.0, 1e-9, 0.0, 2.0, 2e-9, 0.0]).unwrap();
    assert!(tiny.len() == 1 && (tiny[0] - 1e-9).abs() < 1e-15, "{tiny:?}");
    assert!((principal_angles(2, &[1.0, 0.0], &[0.0, 3.0]).unwrap()[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert!(principal_angles(2, &[0.0, 0.0], &[0.0, 3.0]).unwrap().is_empty());
    let velocity: Vec<f64> = (0..20_001).map(|k| f64::from(k) / 10_000.0 - 1.0).collect();
    let drag: Vec<f64> = velocity.iter().map(|v| v * v.abs()).collect();
    let cubic: Vec<f64> = velocity.iter().map(|v| v * v * v).collect();
    let angle = principal_angles(velocity.len(), &drag, &cubic).unwrap()[0];
    assert!(close(angle.cos(), (1.0 / 6.0) / (1.0_f64 / 35.0).sqrt(), 1e-4));
}

// ---- autoregressive noise ----

/// Shaped columns multiply to x^T R y, R the covariance matrix of the process: AR(2) with known autocovariance.
#[test]
fn coloured_columns_multiply_by_the_covariance() {
    let mut samples = vec![0.0; 4000];
    let innovations = noise(4000, 77);
    for t in 2..4000 {
        samples[t] = 1.2 * samples[t - 1] - 0.6 * samples[t - 2] + innovations[t];
    }
    let model = ident::signal::AutoRegression::burg(&samples, 2);
    let (a, b, variance) = (model.coefficients[0], model.coefficients[1], model.variance);
    assert!((a - 1.2).abs() < 0.05 && (b + 0.6).abs() < 0.05);
    // Yule-Walker equations of AR(2).
    let mut covariance = vec![(1.0 - b) * variance / ((1.0 + b) * ((1.0 - b).powi(2) - a * a))];
    covariance.push(a / (1.0 - b) * covariance[0]);
    for lag in 2..60 {
        covariance.push(a * covariance[lag - 1] + b * covariance[lag - 2]);
    }
    let (x, y): (Vec<f64>, Vec<f64>) = (0..60).map(|i| ((0.1 * f64::from(i)).sin(), 0.3 + 0.02 * f64::from(i))).unzip();
    let exact: f64 = (0..60)
        .flat_map(|i| (0..60_usize).map(move |j| (i, j)))
        .map(|(i, j)| x[i] * covariance[j.abs_diff(i)] * y[j])
        .sum();
    let shaped: f64 = model.colour(&x).iter().zip(model.colour(&y)).map(|(u, v)| u * v).sum();
    assert!(close(shaped, exact, 1e-9), "{shaped} {exact}");
}
