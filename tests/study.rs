//! The check of studies: what laws and effects become, and how errors read.

use ident::diagnostics::render;
use ident::study::{check, load_text};

const QUARTER: &str = include_str!("../studies/quarter_vehicle/quarter_vehicle.ident");

#[test]
fn shipped_studies_are_sound() {
    for name in ["quarter_vehicle", "two_mass", "crane_pendulum", "spring_slide"] {
        let path = format!("{}/studies/{name}/{name}.ident", env!("CARGO_MANIFEST_DIR"));
        let loaded = ident::study::load(std::path::Path::new(&path));
        match check(&loaded, None) {
            Ok(checked) => {
                assert!(checked.warnings.is_empty(), "{}", render(&checked.warnings, &loaded.sources, false))
            }
            Err(findings) => panic!("{}", render(&findings, &loaded.sources, false)),
        }
    }
    let _ = load_text("quarter.ident", QUARTER);
}
