//! The residual of the base model taken apart.

use crate::diagnose::{Answer, ChannelAnatomy};
use crate::report::chart::spectrum_bars;
use crate::report::number;
use serde::Serialize;

#[derive(Serialize)]
pub struct AnatomyRow {
    pub record: String,
    pub channel: String,
    pub residual: String,
    pub noise: String,
    pub unit: String,
    pub ratio: String,
    pub noise_source: String,
    pub whiteness: String,
    pub spectrum_svg: String,
    /// (function of the motion, correlation, share of the bar's half width, whether negative)
    pub correlations: Vec<Correlation>,
}

#[derive(Serialize)]
pub struct Correlation {
    pub name: String,
    pub value: String,
    /// 0..100 % of the half width.
    pub length: f64,
    pub negative: bool,
}

/// Correlations shown per channel.
const SHOWN: usize = 4;

pub fn rows(answer: &Answer) -> Vec<AnatomyRow> {
    answer.anatomy.iter().map(row).collect()
}

fn row(anatomy: &ChannelAnatomy) -> AnatomyRow {
    let correlation = |(name, value): &(String, f64)| Correlation {
        name: name.clone(),
        value: number::fixed(*value, 2),
        length: if value.is_finite() { (1000.0 * value.abs().min(1.0)).round() / 10.0 } else { 0.0 },
        negative: *value < 0.0,
    };
    let mut strongest: Vec<&(String, f64)> = anatomy.correlations.iter().collect();
    strongest.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    AnatomyRow {
        record: anatomy.experiment.clone(),
        channel: anatomy.channel.clone(),
        residual: number::significant(anatomy.residual_rms, 3),
        noise: number::significant(anatomy.noise_rms, 3),
        unit: anatomy.unit.clone(),
        ratio: number::short(anatomy.residual_rms / anatomy.noise_rms, 2),
        noise_source: anatomy.noise_source.clone(),
        whiteness: number::probability(anatomy.whiteness_p),
        spectrum_svg: spectrum_bars(&anatomy.bands, 240.0),
        correlations: strongest.into_iter().take(SHOWN).map(correlation).collect(),
    }
}
