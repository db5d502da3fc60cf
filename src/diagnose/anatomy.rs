//! The residual of the base model taken apart: by channel, frequency band and regime.

use super::ChannelAnatomy;
use crate::identify::Fitted;
use crate::signal::{band_shares, cross_correlation, ljung_box, periodogram};
use crate::simulation::{Compiled, Record, probe};
use crate::study::PlaceQuantity;

/// Number of frequency bands a spectrum is shown in, logarithmic from the record's length to half its sampling rate.
const BANDS: usize = 6;
/// Correlations shown per channel.
const CORRELATIONS: usize = 6;
/// Lags of the whiteness test.
const LAGS: usize = 20;

/// One entry per channel and estimation record.
pub(super) fn anatomy(compiled: &Compiled, fitted: &Fitted, records: &[&Record]) -> Vec<ChannelAnatomy> {
    let regressors: Vec<_> = records.iter().map(|record| regressors(compiled, record, &fitted.theta)).collect();
    fitted
        .blocks
        .iter()
        .map(|block| {
            let record = records[block.record];
            let measure = &compiled.study.measures[block.measure];
            let residual = &fitted.residual[block.rows.clone()];
            let to_unit = 1.0 / (fitted.weighting.weights[block.measure] * measure.unit.factor);
            let rms = (residual.iter().map(|r| r * r).sum::<f64>() / residual.len().max(1) as f64).sqrt();
            ChannelAnatomy {
                experiment: record.name.clone(),
                channel: measure.name.clone(),
                unit: measure.unit.symbol.clone(),
                residual_rms: rms * to_unit,
                noise_rms: measure.weight * to_unit,
                noise_source: fitted.weighting.sources[block.measure].to_owned(),
                whiteness_p: ljung_box(residual, LAGS, 0).1,
                bands: bands(record, residual),
                correlations: strongest(&regressors[block.record], residual),
            }
        })
        .collect()
}

/// Shares of the residual's power in logarithmic bands from four periods per record to half the sampling rate.
fn bands(record: &Record, residual: &[f64]) -> Vec<(f64, f64, f64)> {
    let rate = 1.0 / record.sample_step();
    let (lowest, highest) = (4.0 * rate / residual.len().max(1) as f64, 0.5 * rate);
    let mut edges = vec![0.0];
    edges.extend((0..BANDS).map(|k| lowest * (highest / lowest).powf(k as f64 / (BANDS - 1) as f64)));
    let shares = band_shares(&periodogram(residual, rate), &edges);
    edges.windows(2).zip(shares).map(|(edge, share)| (edge[0], edge[1], share)).collect()
}

/// Simple functions of the motion at every joint and force element: v, sign v, v|v|, x, x^3, and of the inputs.
fn regressors(compiled: &Compiled, record: &Record, theta: &[f64]) -> Vec<(String, Vec<f64>)> {
    let Ok(trajectory) = probe(compiled, record, theta) else {
        return Vec::new();
    };
    let mut list = Vec::new();
    let probes = compiled.study.places.iter().flat_map(|place| place.probes.iter().map(move |p| (place, p.0)));
    for ((place, quantity), values) in probes.zip(&trajectory.probes) {
        let name = &place.name;
        let mut push = |text: String, function: &dyn Fn(f64) -> f64| {
            list.push((text, values.iter().map(|&value| function(value)).collect::<Vec<f64>>()));
        };
        match quantity {
            PlaceQuantity::Rate => {
                push(format!("{name}.velocity"), &|v| v);
                push(format!("sign({name}.velocity)"), &|v| v.signum());
                push(format!("|{name}.velocity|"), &f64::abs);
                push(format!("{name}.velocity^2 (signed)"), &|v| v * v.abs());
            }
            PlaceQuantity::Coordinate => {
                push(format!("{name}.position"), &|x| x);
                push(format!("{name}.position^3"), &|x| x * x * x);
            }
            PlaceQuantity::Value => {
                push(name.clone(), &|u| u);
                push(format!("{name}^2"), &|u| u * u);
            }
            PlaceQuantity::Load | PlaceQuantity::Time => {}
        }
    }
    list
}

fn strongest(regressors: &[(String, Vec<f64>)], residual: &[f64]) -> Vec<(String, f64)> {
    let mut list: Vec<(String, f64)> = regressors
        .iter()
        .map(|(name, values)| (name.clone(), cross_correlation(values, residual, 0)[0]))
        .filter(|(_, r)| r.is_finite())
        .collect();
    list.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    list.truncate(CORRELATIONS);
    list
}
