//! A quarter vehicle on a shaker whose damper saturates; the model has a linear one. Two causes fit equally well.

use super::*;
use ident::diagnose::{Answer, ChannelAnatomy, MissingForce, Step, Verdict};

const STEP: f64 = 2e-3;

struct Run {
    time: Vec<f64>,
    body: Vec<f64>,
    axle: Vec<f64>,
    tyre: Vec<f64>,
    rate: Vec<f64>,
    elongation: Vec<f64>,
}

/// Semi-implicit Euler with ten substeps; only its looks matter.
fn run(samples: usize, road: impl Fn(f64) -> f64, damper: impl Fn(f64) -> f64) -> Run {
    let (body_mass, wheel_mass, strut, tyre) = (320.0, 45.0, 22e3, 180e3);
    let (mut zb, mut vb, mut zw, mut vw) = (0.0, 0.0, 0.0, 0.0);
    let mut out = Run { time: vec![], body: vec![], axle: vec![], tyre: vec![], rate: vec![], elongation: vec![] };
    for index in 0..samples {
        let mut wheel_acceleration = 0.0;
        let mut tyre_force = 0.0;
        for substep in 0..10 {
            let t = (index as f64 + substep as f64 / 10.0) * STEP;
            let inner = strut * (zw - zb) + damper(vw - vb);
            tyre_force = tyre * (road(t) - zw);
            wheel_acceleration = (tyre_force - inner) / wheel_mass;
            vb += inner / body_mass * STEP / 10.0;
            vw += wheel_acceleration * STEP / 10.0;
            zb += vb * STEP / 10.0;
            zw += vw * STEP / 10.0;
        }
        out.time.push(1.0 + index as f64 * STEP);
        out.body.push(1e3 * zb);
        out.axle.push(wheel_acceleration);
        out.tyre.push(1e-3 * tyre_force);
        out.rate.push(vb - vw);
        out.elongation.push(1e3 * (zb - zw));
    }
    out
}

fn noisy(values: &[f64], level: f64, seed: u64) -> Vec<f64> {
    let mut noise = Noise(seed);
    values.iter().map(|value| value + level * noise.next()).collect()
}

fn record_of(experiment: &str, role: &str, truth: &Run, model: &Run) -> RecordFit {
    let channels = vec![
        channel("z_body", "body travel", "mm", noisy(&truth.body, 0.2, 3), model.body.clone(), 0.2),
        channel("a_axle", "axle acceleration", "m/s^2", noisy(&truth.axle, 0.4, 4), model.axle.clone(), 0.4),
        channel("F_tyre", "tyre force", "kN", noisy(&truth.tyre, 0.015, 5), model.tyre.clone(), 0.015),
    ];
    record(experiment, role, &truth.time, channels, &[("motion", &[0, 1]), ("load", &[2])])
}

pub fn quarter_vehicle() -> Answer {
    let sweep = |t: f64| 0.012 * (std::f64::consts::TAU * (0.5 * t + 0.55 * t * t)).sin() / (1.0 + 0.25 * t);
    let kerb = |t: f64| 0.06 * (((t - 1.0) / 0.02).clamp(0.0, 1.0)).powi(2);
    let saturating = |v: f64| 1800.0 * v / (1.0 + (v / 0.22).powi(2)).sqrt();
    let linear = |v: f64| 1290.0 * v;
    let almost = |v: f64| 1790.0 * v / (1.0 + (v / 0.215).powi(2)).sqrt();
    let truth = (run(4500, sweep, saturating), run(2000, kerb, saturating));
    let before = (run(4500, sweep, linear), run(2000, kerb, linear));
    let after = (run(4500, sweep, almost), run(2000, kerb, almost));
    let fit = |variant: &str, model: &(Run, Run), rows: &[Row]| {
        let records = vec![
            record_of("sweep", "estimation", &truth.0, &model.0),
            record_of("kerb", "validation", &truth.1, &model.1),
        ];
        identification(variant, parameters(rows), records)
    };
    let common: [Row; 3] = [
        ("c_strut", "kN/m", 10.0, 40.0, 22.0, 22.08, Some(0.21)),
        ("d_c", "kN*s/m", 0.0, 5.0, 1.2, 1.29, Some(0.031)),
        ("tyre.stiffness", "kN/m", 100.0, 300.0, 180.0, 181.3, Some(2.4)),
    ];
    let mut richer = common;
    richer[1].5 = 1.79;
    let richer: Vec<Row> = richer
        .into_iter()
        .chain([
            ("damper_limit", "kN", 0.05, 5.0, 0.5, 0.385, Some(0.012)),
            ("wheel.mass", "kg", 30.0, 60.0, 45.0, 60.0, None),
        ])
        .collect();
    let base = fit("base", &before, &common);
    let mut extended = fit("with_load_saturation", &after, &richer);
    extended.undetermined.push("wheel.mass alone: the data change by less than their noise along it".into());
    extended
        .remarks
        .push("wheel.mass ended at its upper bound: a sign of a structural error or of missing information.".into());

    let residual: Vec<f64> = before.0.rate.iter().map(|v| 1e3 * (linear(*v) - saturating(*v)) * 1e-3).collect();
    let force = noisy(&residual, 12.0, 9);
    let missing = |place: &str, share: f64, explained: Vec<f64>| MissingForce {
        place: place.into(),
        unit: "N".into(),
        coordinate: before.0.elongation.clone(),
        coordinate_unit: "mm".into(),
        rate: before.0.rate.clone(),
        rate_unit: "m/s".into(),
        time: before.0.time.clone(),
        force: force.clone(),
        explained,
        share,
    };
    let explained = before.0.rate.iter().map(|v| linear(*v) - almost(*v)).collect();
    let judged = |factor: f64, confidence: f64, bic: f64| Judged {
        estimation: extended.estimation_discrepancy * factor,
        validation: extended.validation_discrepancy.unwrap() * factor,
        change: (-97.6 * factor, -94.8 * factor),
        bic,
        p_value: 2e-9,
        confidence,
    };
    let step = Step {
        ranking: vec![
            refitted(
                screened("load_saturation at damper", "The force of an element levels off.", None, 0.36, 0.88),
                judged(1.0, 0.55, -912.0),
                &[("damper_limit", 0.385, 0.012, "kN")],
                None,
            ),
            refitted(
                screened("degressive_rate at damper", "Damping falls with speed.", Some(702.0), 0.35, 0.87),
                judged(1.01, 0.45, -911.6),
                &[("damper_knee", 0.22, 0.009, "m/s")],
                None,
            ),
            refitted(
                screened("series_elasticity at damper", "A soft mount in series with the element.", None, 0.17, 0.35),
                Judged {
                    estimation: 31.0,
                    validation: 66.9,
                    change: (-18.0, 21.0),
                    bic: -97.0,
                    p_value: 0.004,
                    confidence: 0.0,
                },
                &[("damper_mount", 140.0, 41.0, "kN/m")],
                Some("improves the fit, does not transfer"),
            ),
            screened(
                "dry_friction at chassis_guide",
                "Dry friction, smooth below the creep velocity.",
                Some(41.0),
                0.22,
                0.05,
            ),
        ],
        screened: 71,
        accepted: Some(0),
        indistinguishable: vec!["load_saturation at damper".into(), "degressive_rate at damper".into()],
        judgement: "Accepted as a group: both members improve the held-out record by the same amount.".into(),
    };
    let anatomy = |experiment: &str, fit: &ChannelFit, p: f64| ChannelAnatomy {
        experiment: experiment.into(),
        channel: fit.name.clone(),
        unit: fit.unit.clone(),
        residual_rms: fit.residual_rms,
        noise_rms: fit.noise,
        noise_source: "repeated excitation".into(),
        whiteness_p: p,
        bands: vec![(0.0, 1.0, 0.12), (1.0, 2.0, 0.41), (2.0, 5.0, 0.18), (5.0, 12.0, 0.24), (12.0, 250.0, 0.05)],
        correlations: vec![("damper.rate".into(), 0.31), ("damper.rate * |damper.rate|".into(), 0.44)],
    };
    let anatomies = base.records[0].channels.iter().map(|channel| anatomy("sweep", channel, 1e-9)).collect();
    Answer {
        study: "quarter_vehicle".into(),
        file: "studies/quarter_vehicle.ident".into(),
        title: "One wheel on a shaker".into(),
        verdict: Verdict::GroupOfCauses,
        summary: "The damper's force levels off at about 0.39 kN; whether by a force limit or by a degressive rate this data cannot tell.".into(),
        roles: "sweep: fitted and screened; kerb: decided".into(),
        anatomy: anatomies,
        missing_forces: vec![missing("damper", 0.91, explained), missing("chassis_guide", 0.34, vec![])],
        steps: vec![step],
        extension: Some("variant with_load_saturation of base {\n  add effect damper_limit: load_saturation on damper { limit = damper_limit }\n  identify { damper_limit in 0.05 .. 5 kN from 0.39 kN }\n}\n".into()),
        cannot_judge: vec!["input_delay at u: visibility 0.02".into()],
        remarks: vec![],
        simulations: 2210,
        base,
        extended,
    }
}
