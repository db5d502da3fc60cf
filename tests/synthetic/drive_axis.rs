//! A drive axis under position control: mass, viscous damping and offset are modelled, dry friction is not.

use super::*;
use ident::diagnose::{Answer, ChannelAnatomy, MissingForce, Step, Verdict};

const STEP: f64 = 1e-3;

struct Motion {
    time: Vec<f64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    force: Vec<f64>,
}

/// Back-and-forth strokes with smooth ends; force of a slide with 95 kg, 203 N*s/m, dry friction and offset.
fn motion(samples: usize, period: f64, stroke_speed: f64, seed: u64) -> Motion {
    let mut noise = Noise(seed);
    let mut coloured = 0.0;
    let speed = |t: f64| {
        let phase = std::f64::consts::TAU * t / period;
        stroke_speed * (2.4 * phase.sin()).tanh() * (0.75 + 0.25 * (0.31 * phase).cos()) + 0.012 * (5.7 * t).sin()
    };
    let time: Vec<f64> = (0..samples).map(|index| index as f64 * STEP).collect();
    let velocity: Vec<f64> = time.iter().map(|t| speed(*t)).collect();
    let mut position = Vec::with_capacity(samples);
    let mut place = 0.0;
    let mut force = Vec::with_capacity(samples);
    for (t, v) in time.iter().zip(&velocity) {
        place += v * STEP;
        position.push(place);
        let acceleration = (speed(t + STEP) - speed(t - STEP)) / (2.0 * STEP);
        let damping = if *v > 0.0 { 203.0 } else { 214.0 };
        coloured = 0.9 * coloured + 0.6 * noise.next();
        force.push(95.1 * acceleration + damping * v + 20.3 * (v / 1e-3).tanh() - 3.1 + coloured);
    }
    Motion { time, position, velocity, force }
}

fn regressors(motion: &Motion, with_friction: bool) -> Vec<Vec<f64>> {
    let v = &motion.velocity;
    let last = v.len() - 1;
    let acceleration = (0..v.len()).map(|k| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        (v[b] - v[a]) / ((b - a) as f64 * STEP)
    });
    let mut columns = vec![acceleration.collect(), v.clone(), vec![1.0; v.len()]];
    if with_friction {
        columns.push(v.iter().map(|v| (v / 1e-3).tanh()).collect());
    }
    columns
}

/// Least squares by normal equations and elimination; enough for three or four columns.
fn least_squares(columns: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let count = columns.len();
    let mut rows: Vec<Vec<f64>> = (0..count)
        .map(|i| columns.iter().map(|c| dot(&columns[i], c)).chain([dot(&columns[i], right)]).collect())
        .collect();
    for pivot in 0..count {
        for row in 0..count {
            if row != pivot {
                let factor = rows[row][pivot] / rows[pivot][pivot];
                let pivot_row = rows[pivot].clone();
                rows[row].iter_mut().zip(&pivot_row).for_each(|(value, above)| *value -= factor * above);
            }
        }
    }
    (0..count).map(|i| rows[i][count] / rows[i][i]).collect()
}

fn simulated(motion: &Motion, values: &[f64]) -> Vec<f64> {
    let columns = regressors(motion, values.len() > 3);
    (0..motion.time.len()).map(|k| columns.iter().zip(values).map(|(column, value)| column[k] * value).sum()).collect()
}

fn fit(variant: &str, records: &[(&str, &str, &Motion)], values: &[f64], deviations: &[f64]) -> Identification {
    let all = [
        ("slide.mass", "kg", 20.0, 200.0, 80.0),
        ("viscous", "N*s/m", 0.0, 500.0, 100.0),
        ("offset", "N", -20.0, 20.0, 0.0),
        ("slide_F", "N", 0.0, 100.0, 20.0),
    ];
    let rows: Vec<Row> = (values.iter().zip(deviations).zip(all))
        .map(|((value, deviation), (name, unit, lower, upper, start))| {
            (name, unit, lower, upper, start, *value, Some(*deviation))
        })
        .collect();
    let record_of = |(experiment, role, motion): &(&str, &str, &Motion)| {
        let channels =
            vec![channel("force", "motor force", "N", motion.force.clone(), simulated(motion, values), 1.37)];
        record(experiment, role, &motion.time, channels, &[])
    };
    identification(variant, parameters(&rows), records.iter().map(record_of).collect())
}

pub fn drive_axis() -> Answer {
    let estimation = motion(25_000, 5.0, 0.21, 11);
    let validation = motion(25_000, 3.7, 0.17, 12);
    let records = [("trajectory", "estimation", &estimation), ("pulses", "validation", &validation)];
    let base_values = least_squares(&regressors(&estimation, false), &estimation.force);
    let extended_values = least_squares(&regressors(&estimation, true), &estimation.force);
    let base = fit("base", &records, &base_values, &[0.41, 1.1, 0.13]);
    let mut extended = fit("with_dry_friction", &records, &extended_values, &[0.12, 0.74, 0.04, 0.11]);
    extended.correlation[1][3] = -0.93;
    extended.correlation[3][1] = -0.93;
    extended
        .remarks
        .push("slide_F: the interval comes from the linearised model; the creep velocity is held at 1 mm/s.".into());

    let before = simulated(&estimation, &base_values);
    let after = simulated(&estimation, &extended_values);
    let kept: Vec<usize> = (0..25_000).step_by(5).collect();
    let pick = |values: &[f64]| kept.iter().map(|k| values[*k]).collect::<Vec<f64>>();
    let residual: Vec<f64> = estimation.force.iter().zip(&before).map(|(m, s)| m - s).collect();
    let explained: Vec<f64> = after.iter().zip(&before).map(|(a, b)| a - b).collect();
    let missing = MissingForce {
        place: "slide".into(),
        unit: "N".into(),
        coordinate: pick(&estimation.position),
        coordinate_unit: "m".into(),
        rate: pick(&estimation.velocity),
        rate_unit: "m/s".into(),
        time: pick(&estimation.time),
        force: pick(&residual),
        explained: pick(&explained),
        share: 0.94,
    };
    let held_out = base.validation_discrepancy.unwrap();
    let reached = extended.validation_discrepancy.unwrap();
    let first = Step {
        ranking: vec![
            refitted(
                screened(
                    "dry_friction at slide",
                    "Dry friction, smooth below the creep velocity.",
                    Some(1893.0),
                    0.42,
                    0.927,
                ),
                Judged {
                    estimation: extended.estimation_discrepancy,
                    validation: reached,
                    change: (-85.9, -79.8),
                    bic: -1732.4,
                    p_value: 1e-16,
                    confidence: 0.9996,
                },
                &[("slide_F", extended_values[3], 0.11, "N")],
                None,
            ),
            refitted(
                screened(
                    "stribeck_friction at slide",
                    "Dry friction that falls with growing speed.",
                    Some(1893.0),
                    0.42,
                    0.927,
                ),
                Judged {
                    estimation: extended.estimation_discrepancy * 0.999,
                    validation: reached * 1.03,
                    change: (-85.4, -79.1),
                    bic: -1716.5,
                    p_value: 1e-16,
                    confidence: 0.0004,
                },
                &[("slide_F", 20.1, 0.31, "N"), ("slide_v_s", 0.012, 0.018, "m/s")],
                Some("strength of the drop not different from zero"),
            ),
            refitted(
                screened("backlash at drive", "Play between drive and slide.", None, 0.11, 0.31),
                Judged {
                    estimation: 9.4,
                    validation: 13.2,
                    change: (-52.0, 7.0),
                    bic: -212.0,
                    p_value: 3e-5,
                    confidence: 0.0,
                },
                &[("drive_gap", 0.21, 0.04, "mm")],
                Some("improves the fit, does not transfer"),
            ),
            screened(
                "quadratic_drag at slide",
                "Resistance that grows with the square of the speed.",
                Some(88.0),
                0.21,
                0.046,
            ),
            screened("input_delay at q_ref", "The command reaches the actuator late.", Some(12.1), 0.64, 0.007),
            screened("slide.mass set free", "A constant that the study holds fixed.", Some(3.2), 0.03, 0.001),
        ],
        screened: 46,
        accepted: Some(0),
        indistinguishable: vec!["dry_friction at slide".into()],
        judgement: format!(
            "Accepted: held-out discrepancy {held_out:.1} % -> {reached:.1} % on pulses, 95 % interval of the change excludes zero; \
             gain agrees with the prediction; 20.3 N lies inside its bounds."
        ),
    };
    let second = Step {
        ranking: vec![
            refitted(
                screened(
                    "direction_dependent_damping at slide",
                    "Damping differs between the directions.",
                    Some(14.2),
                    0.31,
                    0.024,
                ),
                Judged {
                    estimation: extended.estimation_discrepancy * 0.98,
                    validation: reached * 0.994,
                    change: (-1.9, 0.8),
                    bic: -3.9,
                    p_value: 0.21,
                    confidence: 0.61,
                },
                &[("slide_dd", 8.4, 3.1, "N*s/m")],
                Some("held-out interval includes zero"),
            ),
            screened("harmonic_disturbance at slide", "A periodic force of unknown frequency.", None, 0.88, 0.004),
        ],
        screened: 45,
        accepted: None,
        indistinguishable: vec!["direction_dependent_damping at slide".into()],
        judgement: "Stopped: nothing further transfers to the held-out record.".into(),
    };
    Answer {
        study: "drive_axis".into(),
        file: "drive_axis.ident".into(),
        title: "Drive axis under position control".into(),
        verdict: Verdict::CauseNamed,
        summary: format!(
            "The slide has dry friction of 20.3 N that the model lacks. With it the force error on data not used to find it \
             falls from {held_out:.1} % to {reached:.1} %."
        ),
        roles: "trajectory: fitted and screened; pulses: decided".into(),
        anatomy: vec![
            ChannelAnatomy {
                experiment: "trajectory".into(),
                channel: "force".into(),
                unit: "N".into(),
                residual_rms: base.records[0].channels[0].residual_rms,
                noise_rms: 1.37,
                noise_source: "idle stretches".into(),
                whiteness_p: 0.0,
                bands: vec![(0.0, 0.5, 0.46), (0.5, 1.0, 0.21), (1.0, 2.0, 0.13), (2.0, 5.0, 0.1), (5.0, 10.0, 0.05), (10.0, 50.0, 0.04), (50.0, 500.0, 0.01)],
                correlations: vec![
                    ("sign(slide.velocity)".into(), 0.62),
                    ("slide.velocity".into(), 0.0),
                    ("slide.velocity * |slide.velocity|".into(), -0.19),
                    ("slide.position".into(), 0.04),
                ],
            },
            ChannelAnatomy {
                experiment: "pulses".into(),
                channel: "force".into(),
                unit: "N".into(),
                residual_rms: base.records[1].channels[0].residual_rms,
                noise_rms: 1.37,
                noise_source: "idle stretches".into(),
                whiteness_p: 0.0,
                bands: vec![(0.0, 0.5, 0.31), (0.5, 1.0, 0.24), (1.0, 2.0, 0.19), (2.0, 5.0, 0.12), (5.0, 10.0, 0.08), (10.0, 50.0, 0.05), (50.0, 500.0, 0.01)],
                correlations: vec![("sign(slide.velocity)".into(), 0.57), ("slide.velocity * |slide.velocity|".into(), -0.22)],
            },
        ],
        missing_forces: vec![missing],
        steps: vec![first, second],
        extension: Some(
            "variant with_dry_friction of base {\n  add effect slide_friction: dry_friction on slide { F = slide_F, creep = 1 mm/s }\n  \
             identify { slide_F in 0 .. 100 N from 20.3 N }\n}\n"
                .into(),
        ),
        cannot_judge: vec![
            "end_stop at slide: the motion stays 40 mm away from both ends".into(),
            "sensor_lag at force: below 0.8 ms it would not show".into(),
        ],
        remarks: vec!["Excitation is not periodic: the split into odd and even distortion is not available.".into()],
        simulations: 1873,
        base,
        extended,
    }
}
