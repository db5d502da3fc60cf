//! Whether elastic bodies turn so fast that what is neglected of their deformation would count.

use super::prepare::Record;
use super::run::{Compiled, probe};
use crate::diagnostics::{Code, Diagnostic};
use crate::mechanics::TURNING;
use crate::study::Body;

/// Angular velocity over the lowest circular frequency from which on it is told: centrifugal forces, which go with its square,
/// then change the stiffness by some percent.
const FAST: f64 = 0.2;

/// One warning per elastic body that turns fast in this record, with the parameters `theta` (SI). A record that cannot be
/// simulated has none: that it fails is told elsewhere.
pub fn fast_turning(compiled: &Compiled, record: &Record, theta: &[f64]) -> Vec<Diagnostic> {
    let of_body = |body: &Body| {
        let name = format!("{}.{TURNING}", body.name);
        let at = compiled.system.probes.iter().position(|probe| probe.name == name)?;
        Some((at, body.name.clone(), body.elastic.as_ref()?.span))
    };
    let probes: Vec<_> = compiled.study.bodies.iter().filter_map(of_body).collect();
    if probes.is_empty() {
        return Vec::new();
    }
    let Ok(trajectory) = probe(compiled, record, theta) else { return Vec::new() };
    let mut warnings = Vec::new();
    for (at, body, span) in probes {
        let fastest = trajectory.probes[at].iter().fold(0.0_f64, |most, square| most.max(*square)).sqrt();
        if fastest > FAST {
            let message = format!(
                "elastic body `{body}` turns at up to {:.0} % of its lowest circular frequency in {}",
                100.0 * fastest,
                record.name
            );
            let diagnostic = Diagnostic::warning(Code::ELASTIC_TURNS_FAST, message)
                .label(span, "these modes do not know what centrifugal forces do to their stiffness")
                .help("divide the body into several by joints with bending springs, or keep to slower records");
            warnings.push(diagnostic);
        }
    }
    warnings
}
