//! What a law does: its load along a harmonic motion, or its answer in time.

use crate::diagnostics::Diagnostic;
use crate::quantities::{Dimension, Unit};
use crate::simulation::{Compiled, Gradient, excitation, simulate};
use crate::study::{Loaded, check, load_text};
use crate::syntax::{Item, ItemKind, LawDeclaration, print_item};
use std::fmt::Write;

/// How a law is shown: with which fields, and how its place moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Demonstration {
    /// As between the braces of an element: `stiffness = 180 kN/m`.
    pub fields: String,
    pub course: Course,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Course {
    /// Amplitude and frequency of a harmonic motion of the place, with units.
    Harmonic { amplitude: String, frequency: String },
    /// Duration of a response in time: the place moves freely, the fields are functions of `t`.
    Time { duration: String },
}

impl Demonstration {
    /// The line ``Example: `FIELDS` over AMPLITUDE at FREQUENCY`` or ``Example: `FIELDS` over DURATION`` of a law's
    /// remark.
    pub fn of_remark(documentation: &str) -> Option<Self> {
        let text = documentation.replace('\n', " ");
        let (_, example) = text.split_once("Example: `")?;
        let (fields, rest) = example.split_once('`')?;
        let rest = rest.trim().strip_prefix("over ")?;
        let course = match rest.split_once(" at ") {
            Some((amplitude, frequency)) => {
                Course::Harmonic { amplitude: amplitude.trim().to_owned(), frequency: frequency.trim().to_owned() }
            }
            None => Course::Time { duration: rest.trim().to_owned() },
        };
        Some(Self { fields: fields.to_owned(), course })
    }
}

/// Histories of a law at a place, in the units named.
#[derive(Clone, Debug)]
pub struct Characteristic {
    pub law: String,
    /// The fields and the course, in one line.
    pub shown: String,
    /// s
    pub time: Vec<f64>,
    /// The law's load or value.
    pub value: Trace,
    /// Coordinate of the place and its rate, where there is one.
    pub motion: Option<(Trace, Trace)>,
    /// The place moves in a given way, so that the load over the motion is the characteristic.
    pub is_harmonic: bool,
}

/// A quantity along the course.
#[derive(Clone, Debug)]
pub struct Trace {
    pub name: String,
    pub unit: String,
    pub values: Vec<f64>,
}

/// Instants shown.
const SAMPLES: usize = 1000;
/// Periods of a harmonic motion: the first begins at rest, the second shows the settled loop.
const PERIODS: f64 = 2.0;

/// The laws of a study and of the prelude, in order.
pub fn laws(loaded: &Loaded) -> Vec<(&Item, &LawDeclaration)> {
    let items = loaded.trees().flat_map(|(tree, _)| &tree.items);
    items.filter_map(|item| if let ItemKind::Law(law) = &item.kind { Some((item, law)) } else { None }).collect()
}

/// Runs `law` of `loaded`.
///
/// # Errors
/// The text of the small study that shows the law, and what is wrong in it.
pub fn characteristic(
    loaded: &Loaded,
    law: &LawDeclaration,
    demonstration: &Demonstration,
) -> Result<Characteristic, (Box<Loaded>, Vec<Diagnostic>)> {
    let text = study_text(loaded, law, demonstration);
    let own = load_text("example", &text);
    let failed = |findings: Vec<Diagnostic>| (Box::new(own.clone()), findings);
    let study = check(&own, None).map_err(failed)?.study;
    let units: Vec<String> = study.measures.iter().map(|measure| measure.unit.symbol.clone()).collect();
    let scales: Vec<Unit> = study.measures.iter().map(|measure| measure.unit.clone()).collect();
    let record = excitation(&study, 0, study.manoeuvres[0].step);
    let compiled = Compiled::new(study).map_err(failed)?;
    let outcome = simulate(&compiled, &record, &[], Gradient::None);
    let trajectory = outcome.map_err(|failure| {
        let message = failure.to_string();
        failed(vec![Diagnostic::error(crate::diagnostics::Code::SIMULATION_FAILED, message).help(&failure.help)])
    })?;
    let mut traces = trajectory.channels.into_iter().zip(units).zip(scales).map(|((channel, unit), scale)| {
        let values = channel.into_iter().map(|value| scale.from_si(value)).collect();
        Trace { name: String::new(), unit, values }
    });
    let named = |trace: Option<Trace>, name: &str| trace.map(|trace| Trace { name: name.to_owned(), ..trace });
    let is_load = is_load(law);
    let value = named(traces.next(), if is_load { "load" } else { "value" });
    let motion = named(traces.next(), "elongation").zip(named(traces.next(), "rate"));
    let Some(value) = value else { return Err(failed(Vec::new())) };
    let shown = match &demonstration.course {
        Course::Harmonic { amplitude, frequency } => {
            format!("{} over {amplitude} at {frequency}", demonstration.fields)
        }
        Course::Time { duration } => format!("{} over {duration}", demonstration.fields),
    };
    let is_harmonic = matches!(demonstration.course, Course::Harmonic { .. });
    Ok(Characteristic { law: law.name.text.clone(), shown, time: record.times, value, motion, is_harmonic })
}

fn is_load(law: &LawDeclaration) -> bool {
    law.result.factors.iter().any(|(name, _)| ["load", "force", "torque"].contains(&name.text.as_str()))
}

/// A study with the law at one place.
fn study_text(loaded: &Loaded, law: &LawDeclaration, demonstration: &Demonstration) -> String {
    let mut text = "study example\n".to_owned();
    // The study's own laws and tables; those of the prelude are there anyway.
    for (tree, _) in loaded.trees().filter(|(_, is_prelude)| !is_prelude) {
        let used = tree.items.iter().filter(|item| matches!(item.kind, ItemKind::Law(_) | ItemKind::Table(_)));
        used.for_each(|item| text.push_str(&print_item(item)));
    }
    let (name, fields) = (&law.name.text, &demonstration.fields);
    let is_rotation = match &demonstration.course {
        Course::Harmonic { amplitude, .. } => {
            let unit = amplitude.split_once(' ').map_or("", |(_, unit)| unit);
            Unit::parse(unit.trim()).is_ok_and(|unit| unit.dimension == Dimension::ONE)
        }
        Course::Time { .. } => false,
    };
    let (kind, units) =
        if is_rotation { ("revolute", ["N*m", "deg", "deg/s"]) } else { ("prismatic", ["N", "mm", "mm/s"]) };
    let duration = match &demonstration.course {
        Course::Harmonic { frequency, .. } => format!("{PERIODS} / ({frequency})"),
        Course::Time { duration } => duration.clone(),
    };
    let motion = match &demonstration.course {
        Course::Harmonic { amplitude, frequency } => {
            format!("{{ motion = {amplitude} * sin(2 * pi * {frequency} * t) }}")
        }
        Course::Time { .. } => String::new(),
    };
    // Writing into a String cannot fail.
    let _ = writeln!(text, "body carrier {{ mass = 1 kg, inertia = 1 kg*m^2 }}");
    let _ = writeln!(text, "joint place: {kind}(x) ground -> carrier {motion}");
    if is_load(law) {
        let _ = writeln!(text, "force shown: {name} on place {{ {fields} }}");
        let _ = writeln!(text, "measure load [{}] = shown.{}", units[0], if is_rotation { "torque" } else { "force" });
        let _ = writeln!(text, "measure elongation [{}] = place.position", units[1]);
        let _ = writeln!(text, "measure speed [{}] = place.velocity", units[2]);
    } else {
        let _ = writeln!(text, "signal shown: {name} {{ {fields} }}\nmeasure answer = shown");
    }
    let _ = writeln!(text, "manoeuvre course {{ start = rest, for {duration}, step = {duration} / {SAMPLES} }}");
    text.push_str("solver { tolerance = 1e-7 }\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_are_read_from_remarks() {
        let read = Demonstration::of_remark("A spring.\nExample: `stiffness = 3 N/m,\n more = 1` over 20 mm at 1 Hz");
        let course = Course::Harmonic { amplitude: "20 mm".to_owned(), frequency: "1 Hz".to_owned() };
        assert_eq!(read, Some(Demonstration { fields: "stiffness = 3 N/m,  more = 1".to_owned(), course }));
        let read = Demonstration::of_remark("Example: `lag = 3 ms` over 20 ms").expect("an example");
        assert_eq!(read.course, Course::Time { duration: "20 ms".to_owned() });
        assert_eq!(Demonstration::of_remark("A spring."), None);
    }

    /// A spring's load over its elongation, settled Maxwell loops, torsion in degrees.
    #[test]
    fn characteristics_are_those_of_the_law() {
        let loaded = load_text(
            "empty",
            "study s\ntable twice(x: coordinate) -> load { points = ((-1 m, -2 N), (1, 2)),\n\
            interpolation = linear, extrapolation = linear }\nlaw own(x: coordinate) -> load { = twice(x) }",
        );
        let run = |name: &str, fields: &str, amplitude: &str| {
            let (_, law) = laws(&loaded).into_iter().find(|(_, law)| law.name.text == name).expect("the law");
            let course = Course::Harmonic { amplitude: amplitude.to_owned(), frequency: "2 Hz".to_owned() };
            let shown = characteristic(&loaded, law, &Demonstration { fields: fields.to_owned(), course });
            shown.unwrap_or_else(|(_, findings)| panic!("{findings:?}"))
        };
        let spring = run("spring", "stiffness = 2 N/mm", "10 mm");
        let (elongation, rate) = spring.motion.expect("a motion");
        assert_eq!((spring.value.unit.as_str(), elongation.unit.as_str()), ("N", "mm"));
        assert_eq!(spring.time.len(), SAMPLES + 1);
        let largest = |values: &[f64]| values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        assert!((largest(&elongation.values) - 10.0).abs() < 1e-3);
        assert!((largest(&rate.values) - 10.0 * 4.0 * std::f64::consts::PI).abs() < 1e-3);
        for (x, load) in elongation.values.iter().zip(&spring.value.values) {
            assert!((load + 2.0 * x).abs() < 1e-9);
        }
        let torsion = run("spring", "stiffness = 2 N*m/deg", "10 deg");
        assert!((largest(&torsion.value.values) - 20.0).abs() < 1e-3);
        assert!((largest(&run("own", "", "500 mm").value.values) - 1.0).abs() < 1e-4);
    }

    /// Every law of the prelude comes with an example that runs and shows something.
    #[test]
    fn every_law_of_the_prelude_has_a_picture() {
        let loaded = load_text("empty", "study s");
        let all = laws(&loaded);
        assert!(all.len() > 25, "{}", all.len());
        for (item, law) in all {
            let name = &law.name.text;
            let example = Demonstration::of_remark(&item.documentation).unwrap_or_else(|| panic!("{name}: no example"));
            let shown = characteristic(&loaded, law, &example).unwrap_or_else(|(loaded, findings)| {
                panic!("{name}: {}", crate::diagnostics::render(&findings, &loaded.sources, false))
            });
            let values = &shown.value.values;
            let range = values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
            assert!(values.iter().all(|value| value.is_finite()), "{name}");
            assert!(range.1 > range.0 || name == "external_load", "{name} shows nothing");
        }
    }
}
