//! Every law and effect of the prelude compiles at each place it admits.

use crate::evaluate::{study, value};
use ident::expression::Node;
use ident::quantities::{Dimension, Unit, named_type};
use ident::study::{PlaceKind, Study, load_text};
use ident::syntax::{Declared, EffectDeclaration, ItemKind, LawDeclaration, Tree};

/// A machine with one place of every kind, translational and rotational.
const MACHINE: &str = "study machine
gravity = 9.81 m/s^2 along -z
input u [mm]
input p [V]
body cart { mass = 2 kg }
body wheel { mass = 1 kg, inertia = 3 kg*m^2 }
joint slide: prismatic(x) ground -> cart
joint hinge: revolute(y) cart -> wheel
force spring_1: spring on slide { stiffness = 100 N/m }
force spring_2: spring on hinge { stiffness = 100 N*m/rad }
force damper_1: damper ground -> cart { damping = 10 N*s/m }
actuator drive_1: amplifier on slide { command = u, gain = 10 N/m }
actuator drive_2: amplifier on hinge { command = p, gain = 10 N*m/V }
signal controller = 3 V/m * (u - slide.position)
measure position [mm] = slide.position
measure angle [deg] = hinge.position
";

fn prelude_items() -> Vec<(LawDeclaration, String)> {
    items(|kind| if let ItemKind::Law(law) = kind { Some(law.clone()) } else { None })
}

fn prelude_effects() -> Vec<(EffectDeclaration, String)> {
    items(|kind| if let ItemKind::Effect(effect) = kind { Some(effect.clone()) } else { None })
}

fn items<T>(pick: impl Fn(&ItemKind) -> Option<T>) -> Vec<(T, String)> {
    let loaded = load_text("empty", "study s");
    assert!(
        loaded.diagnostics.is_empty(),
        "{}",
        ident::diagnostics::render(&loaded.diagnostics, &loaded.sources, false)
    );
    let trees: Vec<&Tree> = loaded.trees().filter(|(_, is_prelude)| *is_prelude).map(|(tree, _)| tree).collect();
    let all = trees.iter().flat_map(|tree| &tree.items);
    all.filter_map(|item| Some((pick(&item.kind)?, item.documentation.clone()))).collect()
}

/// A number with the SI unit of its declared type, where coordinates are in `coordinate`, loads in `load`, values in
/// `value`.
fn number(number: f64, declared: &Declared, [coordinate, load, value]: [&str; 3]) -> String {
    let Some(kind) = &declared.kind else { return format!("{number}") };
    if let [(name, 1)] = kind.factors.as_slice()
        && name.text == "frequency"
    {
        return format!("{number} Hz");
    }
    let mut dimension = Dimension::ONE;
    for (name, exponent) in &kind.factors {
        let of = |unit: &str| Unit::parse(unit).expect("a unit").dimension;
        let factor = match name.text.as_str() {
            "coordinate" => of(coordinate),
            "rate" => of(coordinate) / Dimension::TIME,
            "acceleration" => of(coordinate) / Dimension::TIME / Dimension::TIME,
            "load" => of(load),
            "value" => of(value),
            other => named_type(other).expect("a named type").dimension,
        };
        dimension = dimension * factor.power(i32::from(*exponent)).expect("a dimension");
    }
    if dimension.is_one() { format!("{number}") } else { format!("{number} {}", dimension.symbol()) }
}

/// `{ a = .., group.b = .. }`
fn fields<'a>(declared: impl Iterator<Item = &'a Declared>, size: f64, units: [&str; 3]) -> String {
    let fields: Vec<String> =
        declared.map(|declared| format!("{} = {}", declared.name.text, number(size, declared, units))).collect();
    format!("{{ {} }}", fields.join(", "))
}

const TRANSLATION: [&str; 3] = ["m", "N", "V"];
const ROTATION: [&str; 3] = ["rad", "N*m", "V"];

#[test]
fn laws_compile_at_every_place() {
    let laws = prelude_items();
    assert!(laws.len() >= 18, "{}", laws.len());
    for (law, documentation) in laws {
        assert!(!documentation.trim().is_empty(), "{} has no documentation", law.name.text);
        let name = &law.name.text;
        let is_load = law.result.factors.iter().any(|(factor, _)| factor.text == "load");
        let free = |port: &&Declared| !is_load || !["x", "v", "inertia"].contains(&port.name.text.as_str());
        let all = || law.ports.iter().filter(free).chain(&law.parameters);
        if !is_load {
            let machine = study(&format!("{MACHINE}signal s: {name} {}", fields(all(), 0.5, TRANSLATION)));
            assert!(machine.signals.iter().any(|signal| signal.name == "s"), "{name}");
            continue;
        }
        for role in ["force", "actuator"] {
            study(&format!("{MACHINE}{role} f: {name} on slide {}", fields(all(), 0.5, TRANSLATION)));
            study(&format!("{MACHINE}{role} f: {name} on hinge {}", fields(all(), 0.5, ROTATION)));
            if law.ports.iter().all(|port| port.name.text != "inertia") {
                study(&format!("{MACHINE}{role} f: {name} ground -> cart {}", fields(all(), 0.5, TRANSLATION)));
                study(&format!(
                    "{MACHINE}{role} f: {name} ground -> wheel along x {}",
                    fields(all(), 0.5, TRANSLATION)
                ));
            }
        }
    }
}

/// Places of a kind: name and units of coordinate, load, value.
fn places(kind: &str) -> Vec<(&'static str, [&'static str; 3])> {
    match kind {
        "joint" => vec![("slide", TRANSLATION), ("hinge", ROTATION)],
        "force" => vec![("spring_1", TRANSLATION), ("spring_2", ROTATION), ("damper_1", TRANSLATION)],
        "actuator" => vec![("drive_1", ["m", "N", "m"]), ("drive_2", ROTATION)],
        "input" => vec![("u", ["m", "N", "m"]), ("p", TRANSLATION)],
        "measure" => vec![("position", ["m", "N", "m"]), ("angle", ["m", "N", "rad"])],
        "signal" => vec![("controller", TRANSLATION)],
        "gravity" => vec![("gravity.x", ["m", "N", "m/s^2"]), ("gravity.y", ["m", "N", "m/s^2"])],
        other => panic!("no place of kind `{other}`"),
    }
}

const VALUES: [(&str, f64); 16] = [
    ("t", 0.37),
    ("slide.position", 0.4),
    ("slide.velocity", -0.3),
    ("hinge.position", -0.7),
    ("hinge.velocity", 0.8),
    ("damper_1.elongation", 0.2),
    ("damper_1.rate", 0.9),
    ("slide.inertia", 2.0),
    ("hinge.inertia", 3.0),
    ("slide.reaction.force.x", 0.6),
    ("slide.reaction.force.y", -1.1),
    ("slide.reaction.force.z", 2.3),
    ("hinge.reaction.force.x", 1.7),
    ("hinge.reaction.force.y", 0.4),
    ("hinge.reaction.force.z", -0.9),
    ("e.none", 0.0),
];

/// What an effect at `place` acts on.
fn affected(study: &Study, kind: &str, place: &str) -> Node {
    match kind {
        "joint" => match study.forces.iter().find(|force| force.name == "e") {
            Some(force) => force.load,
            None => study.graph.clone().constant(0.0),
        },
        "force" | "actuator" => study.forces.iter().find(|force| force.name == place).expect("a force").load,
        "measure" => study.measures.iter().find(|measure| measure.name == place).expect("a measure").value,
        "signal" => study.signals.iter().find(|signal| signal.name == place).expect("a signal").value,
        "gravity" => {
            study.gravity
                [["gravity.x", "gravity.y", "gravity.z"].iter().position(|axis| *axis == place).expect("an axis")]
        }
        _ => study.places.iter().find(|other| other.name == place).expect("a place").probes[0].1,
    }
}

#[test]
fn effects_compile_at_every_place_and_vanish_at_their_neutral_strength() {
    let catalogue = study(MACHINE).effects;
    let effects = prelude_effects();
    let base = study(MACHINE);
    let mut checked = 0;
    assert!(effects.len() >= 24, "{}", effects.len());
    assert_eq!(catalogue.len(), effects.len());
    for ((effect, documentation), data) in effects.iter().zip(&catalogue) {
        assert_eq!(effect.name.text, data.name);
        assert!(!documentation.trim().is_empty() && !data.title.is_empty(), "{} has no documentation", data.name);
        let mut seen = false;
        for kind in &effect.places {
            for (place, units) in places(&kind.text) {
                // An effect that replaces a port needs a law that has it: no backlash in a damper.
                if !base.places.iter().any(|candidate| candidate.name == place && data.fits(candidate)) {
                    continue;
                }
                checked += 1;
                let with = |size: f64| {
                    let amplitudes = fields(effect.amplitudes.iter(), size, units);
                    let shapes = fields(effect.shapes.iter(), 0.5, units);
                    let all = format!("{} , {}", amplitudes.trim_end_matches('}'), shapes.trim_start_matches('{'));
                    study(&format!("{MACHINE}effect e: {} on {place} {all}", data.name))
                };
                let strong = with(0.5);
                let is_dynamic = !effect.states.is_empty();
                if data.kinds.contains(&PlaceKind::Joint) && kind.text == "joint" {
                    assert!(strong.forces.iter().any(|force| force.name == "e"), "{}", data.name);
                }
                assert_eq!(strong.states.len(), effect.states.len(), "{}", data.name);
                if is_dynamic {
                    continue;
                }
                let weak = with(0.0);
                let undisturbed =
                    if kind.text == "joint" { 0.0 } else { value(&base, affected(&base, &kind.text, place), &VALUES) };
                let neutral = value(&weak, affected(&weak, &kind.text, place), &VALUES);
                let disturbed = value(&strong, affected(&strong, &kind.text, place), &VALUES);
                assert!((neutral - undisturbed).abs() < 1e-12, "{} on {place}: {neutral}", data.name);
                // Limits above the present value do nothing; everything else is seen.
                let is_limit =
                    data.name.contains("limit") || data.name.contains("saturation") || data.name.contains("stop");
                seen |= is_limit || (disturbed - undisturbed).abs() > 1e-12;
            }
        }
        // A law that does not read the replaced port is left alone (a backlash in a damper); some place must show it.
        assert!(seen || !effect.states.is_empty(), "{} does nothing anywhere", data.name);
    }
    assert!(checked >= effects.len(), "only {checked} placements fit");
}

#[test]
fn the_catalogue_is_data_for_diagnosis() {
    let catalogue = study(MACHINE).effects;
    let find =
        |name: &str| catalogue.iter().find(|effect| effect.name == name).unwrap_or_else(|| panic!("no `{name}`"));
    let friction = find("dry_friction");
    assert_eq!(friction.kinds, [PlaceKind::Joint, PlaceKind::Force]);
    assert!(friction.amplitudes[0].one_sided && !friction.amplitudes[0].finite_only);
    assert_eq!(friction.shapes[0].relative_range, Some((0.001, 0.1)));
    assert!(friction.is_prelude && friction.title == "Dry friction");
    let drag = find("quadratic_drag");
    let monomial = &drag.amplitudes[0].monomial;
    assert_eq!(format!("{monomial:?}"), "[(Load, 1), (Rate, -2)]");
    let delay = find("input_delay");
    assert_eq!(delay.amplitudes[0].range, Some((0.0, 0.1)));
    assert_eq!(delay.amplitudes[0].dimension, Some(Dimension::TIME));
    assert_eq!(delay.amplitudes[0].unit.as_ref().map(|unit| unit.symbol.as_str()), Some("ms"));
    assert!(find("backlash").amplitudes[0].finite_only);
    let drift = find("sensor_drift");
    assert_eq!(format!("{:?}", drift.amplitudes[0].monomial), "[(Value, 1), (Time, -1)]");
}
