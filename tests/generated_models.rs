//! Large mechanisms go through the whole compiler. Times are measured by `cargo bench --bench scale`.

#[path = "../benches/generated/mod.rs"]
mod generated;

use ident::diagnostics::render;
use ident::mechanics::derive;
use ident::study::{check, load_text};
use ident::tape::Model;

fn compiled(text: &str) -> (ident::mechanics::System, Model) {
    let loaded = load_text("generated.ident", text);
    let complain = |findings: &[_]| -> ! { panic!("{}", render(findings, &loaded.sources, false)) };
    let checked = check(&loaded, None).unwrap_or_else(|findings| complain(&findings));
    let system = derive(&checked.study).unwrap_or_else(|findings| complain(&findings));
    let model = Model::compile(&system);
    (system, model)
}

/// The length of the programs grows in proportion to the number of bodies.
#[test]
fn programs_grow_with_the_mechanism() {
    for family in [generated::chain, generated::tree] {
        let rates = |count: usize| compiled(&family(count)).1.instruction_counts()[0] as f64;
        let growth = rates(80) / rates(20);
        assert!(growth < 4.6, "four times the bodies, {growth:.1} times the instructions");
    }
}

#[test]
fn a_vehicle_with_closed_loops_compiles() {
    let (system, model) = compiled(&generated::vehicle());
    // Seventeen balls, three constraints each, on two levels.
    assert_eq!(system.algebraic.len(), 17 * 3 * 2);
    assert!(system.warnings.is_empty());
    assert_eq!(model.parameter_count(), 34);
}

#[path = "../benches/generated/problems.rs"]
mod problems;

/// The reference problems as bodies, joints and laws have the size of their definition.
#[test]
fn reference_problems_compile() {
    for (text, states, parameters, measures) in [(problems::p1(1e-6), 6, 10, 4), (problems::p2(1e-6), 88, 34, 33)] {
        let (system, model) = compiled(&text);
        assert_eq!(
            (model.state_count(), model.parameter_count(), model.output_count()),
            (states, parameters, measures)
        );
        assert!(system.algebraic.is_empty());
    }
}
