//! The discrepancy tree as rows with bars.

use crate::identify::{DiscrepancyNode, Identification};
use crate::report::chart::{Bar, Style, bars};
use crate::report::page::histories::Curve;
use crate::report::{number, words};
use serde::Serialize;

#[derive(Serialize)]
pub struct TreeRow {
    pub name: String,
    /// Indentation in the tree.
    pub depth: usize,
    /// One figure per fit, `-` where the fit lacks the node.
    pub figures: Vec<String>,
    pub bars_svg: String,
}

const BAR_WIDTH: f64 = 380.0;

/// Rows of all records; every row carries one bar per fit, on a scale common to all rows.
pub fn rows(curves: &[Curve]) -> Vec<TreeRow> {
    let Some(first) = curves.first() else { return Vec::new() };
    let full = curves.iter().flat_map(|curve| &curve.fit.records).map(|record| largest(&record.discrepancy));
    let scale = Scale { full: full.fold(1e-9, f64::max), styles: curves.iter().map(|curve| curve.style).collect() };
    let mut rows = Vec::new();
    for record in &first.fit.records {
        let in_fit = |fit: &Identification| words::counterpart(record, fit).map(|record| record.discrepancy.clone());
        let nodes: Vec<Option<DiscrepancyNode>> = curves.iter().map(|curve| in_fit(curve.fit)).collect();
        let nodes: Vec<Option<&DiscrepancyNode>> = nodes.iter().map(Option::as_ref).collect();
        let title = format!("{}, {}", record.experiment, words::role(&record.role));
        scale.collect(&title, &record.discrepancy, &nodes, 0, &mut rows);
    }
    rows
}

fn largest(node: &DiscrepancyNode) -> f64 {
    node.children.iter().map(largest).chain([node.discrepancy]).filter(|value| value.is_finite()).fold(0.0, f64::max)
}

struct Scale {
    full: f64,
    styles: Vec<Style>,
}

impl Scale {
    fn collect(
        &self,
        title: &str,
        node: &DiscrepancyNode,
        nodes: &[Option<&DiscrepancyNode>],
        depth: usize,
        rows: &mut Vec<TreeRow>,
    ) {
        let values: Vec<Option<f64>> = nodes.iter().map(|node| node.map(|node| node.discrepancy)).collect();
        let bar = |(value, style): (&Option<f64>, &Style)| Bar { value: value.unwrap_or(f64::NAN), style: *style };
        let drawn: Vec<Bar> = values.iter().zip(&self.styles).map(bar).collect();
        rows.push(TreeRow {
            name: title.into(),
            depth,
            figures: values.iter().map(|value| value.map_or("-".into(), number::percent)).collect(),
            bars_svg: bars(&drawn, self.full, BAR_WIDTH),
        });
        // A single channel has the discrepancy of its record or group: one row says both.
        let mut innermost = node;
        while let [only] = innermost.children.as_slice() {
            innermost = only;
        }
        if innermost.children.is_empty() {
            if innermost.name != node.name {
                rows.last_mut().into_iter().for_each(|row| row.name.push_str(&format!(": {}", innermost.name)));
            }
            return;
        }
        for child in &node.children {
            let below: Vec<Option<&DiscrepancyNode>> = nodes
                .iter()
                .map(|node| node.and_then(|node| node.children.iter().find(|c| c.name == child.name)))
                .collect();
            self.collect(&child.name, child, &below, depth + 1, rows);
        }
    }
}
