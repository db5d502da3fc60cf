//! Models, parts and families mean the same as the study written out by hand.

use ident::diagnostics::render;
use ident::mechanics::{derive, emit_model};
use ident::study::{Study, check, flat_text, load_text};

const BOGIES: &str = r#"
study bogies
gravity = 9.81 m/s^2 along -z
constant axles = 2
input u [mm]
model wheelset(carrier: point) {
  param stiffness: stiffness
  body axle { mass = 1200 kg, point middle = (0 m, 0 m, 0.4 m) }
  joint guide: prismatic(z) ground -> axle
  force primary: spring axle -> carrier { stiffness = stiffness }
}
model bogie(carrier: point) {
  param stiffness: stiffness, damping: damping = 12 kN*s/m
  body frame { mass = 2 t }
  joint lift: prismatic(z) ground -> frame
  force secondary: spring_damper frame -> carrier { stiffness = stiffness, damping = damping }
  for i in 1 .. axles {
    part set[i]: wheelset at frame { stiffness = 2 * stiffness + i * 1 kN/m }
    force rail[i]: spring ground -> set[i].axle { stiffness = (3 - i) * 20 MN/m }
  }
  measure z [mm] = frame.position.z
}
body car { mass = 20 t, point front = (9 m, 0 m, 1 m), point rear = (-9 m, 0 m, 1 m) }
joint heave: prismatic(z) ground -> car
part front: bogie at car.front { stiffness = c_s }
part rear: bogie at car.rear { stiffness = 450 kN/m }
force push: external_load ground -> front.set[1].axle { value = (1 kN/mm) * u }
measure z [mm] = heave.position
identify { c_s in 100 .. 900 kN/m from 400 kN/m }
variant single of base {
  remove rear.set[2].primary
  replace force rear.rail[1]: spring ground -> rear.set[1].axle { stiffness = 1 MN/m }
  add force rear.stay: spring rear.set[2].axle -> rear.frame { stiffness = 3 MN/m }
  identify { rear.stiffness in 100 .. 900 kN/m from 450 kN/m, front.rail[1].stiffness in 1 .. 90 MN/m from 20 MN/m }
}
variant front_only of base { remove rear }
variant other of base {
  replace part rear: wheelset at car.rear { stiffness = 1 MN/m }
  add for k in 1 .. 2 { force stop[k]: spring ground -> front.set[k].axle { stiffness = k * 1 kN/m } }
}
"#;

/// The base study, by hand.
fn written_out() -> String {
    let mut text = String::from(
        "study bogies\ngravity = 9.81 m/s^2 along -z\ninput u [mm]\n\
         body car { mass = 20 t, point front = (9 m, 0 m, 1 m), point rear = (-9 m, 0 m, 1 m) }\n\
         joint heave: prismatic(z) ground -> car\nconstant rear_stiffness = 450 kN/m\n",
    );
    for (part, stiffness) in [("front", "c_s"), ("rear", "rear_stiffness")] {
        text += &format!(
            "body {part}_frame {{ mass = 2 t }}\njoint {part}_lift: prismatic(z) ground -> {part}_frame\n\
             force {part}_secondary: spring_damper {part}_frame -> car.{part} \
             {{ stiffness = {stiffness}, damping = 12 kN*s/m }}\n"
        );
        for i in 1..=2 {
            text += &format!(
                "body {part}_set_{i}_axle {{ mass = 1200 kg }}\n\
                 joint {part}_set_{i}_guide: prismatic(z) ground -> {part}_set_{i}_axle\n\
                 force {part}_set_{i}_primary: spring {part}_set_{i}_axle -> {part}_frame \
                 {{ stiffness = 2 * {stiffness} + {i} kN/m }}\n\
                 force {part}_rail_{i}: spring ground -> {part}_set_{i}_axle {{ stiffness = {} MN/m }}\n",
                (3 - i) * 20
            );
        }
        text += &format!("measure {part}_z [mm] = {part}_frame.position.z\n");
    }
    text + "force push: external_load ground -> front_set_1_axle { value = (1 kN/mm) * u }\n\
            measure z [mm] = heave.position\nidentify { c_s in 100 .. 900 kN/m from 400 kN/m }\n"
}

fn checked(text: &str, variant: Option<&str>) -> Study {
    let loaded = load_text("study", text);
    check(&loaded, variant).unwrap_or_else(|findings| panic!("{}", render(&findings, &loaded.sources, false))).study
}

/// The model as text, its lines sorted, without the signs by which the names differ. The order of factors and terms
/// within a load is that of their first use, and left out of the comparison.
fn model(study: &Study) -> Vec<String> {
    let system = derive(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let text = emit_model(study, &system).replace(['.', '_', '[', ']'], "");
    let ordered = |line: &str| {
        let mut words: Vec<&str> = line.split([' ', '(', ')', '*', '+', '-']).collect();
        words.sort_unstable();
        words.join(" ")
    };
    let mut lines: Vec<String> =
        text.lines().map(|line| if line.contains("load =") { ordered(line) } else { line.to_owned() }).collect();
    lines.sort();
    lines
}

#[test]
fn parts_and_families_are_what_one_would_write_by_hand() {
    assert_eq!(model(&checked(BOGIES, None)), model(&checked(&written_out(), None)));
}

#[test]
fn variants_change_parts() {
    let single = checked(BOGIES, Some("single"));
    let names: Vec<&str> = single.forces.iter().map(|force| force.name.as_str()).collect();
    assert!(!names.contains(&"rear.set[2].primary") && names.contains(&"rear.stay"), "{names:?}");
    let parameters: Vec<&str> = single.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(parameters, ["c_s", "rear.stiffness", "front.rail[1].stiffness"]);
    let front = checked(BOGIES, Some("front_only"));
    assert!(front.bodies.iter().all(|body| !body.name.starts_with("rear")));
    let other = checked(BOGIES, Some("other"));
    let bodies: Vec<&str> = other.bodies.iter().map(|body| body.name.as_str()).collect();
    assert!(bodies.contains(&"rear.axle") && !bodies.contains(&"rear.frame"), "{bodies:?}");
    assert!(other.forces.iter().any(|force| force.name == "stop[2]"));
}

/// One number of a part is one number of the study, and a field of it can be freed alone.
#[test]
fn arguments_are_identified_as_a_whole_or_at_one_place() {
    let base = checked(BOGIES, None);
    assert!(base.constants.iter().any(|constant| constant.path == "rear.stiffness"));
    let one = format!(
        "{BOGIES}\nvariant one of base {{ identify {{ rear.secondary.stiffness in 1 .. 900 kN/m from 400 kN/m }} }}"
    );
    let study = checked(&one, Some("one"));
    let parameter = study.parameters.iter().find(|parameter| parameter.name == "rear.secondary.stiffness");
    let symbol = parameter.expect("the parameter of one place").symbol;
    let depends = |name: &str| {
        let force = study.forces.iter().find(|force| force.name == name).expect("a force");
        study.graph.symbols_of(&[force.load]).contains(&symbol)
    };
    assert!(depends("rear.secondary") && !depends("rear.set[1].primary") && !depends("front.secondary"));
}

/// What a study with parts becomes is shown as a study without.
#[test]
fn the_flat_study_is_text() {
    let loaded = load_text("bogies", BOGIES);
    let text = flat_text(&loaded, Some("single")).unwrap_or_else(|findings| panic!("{findings:?}"));
    assert!(text.contains("force rear.stay: spring rear.set[2].axle -> rear.frame { stiffness = 3 MN/m }"), "{text}");
    assert!(text.contains("stiffness = 2 * rear.stiffness + 1 kN/m"), "{text}");
    assert!(!text.contains("model ") && !text.contains("part ") && !text.contains("for "), "{text}");
    let (_, findings) = ident::syntax::parse(0, &text);
    assert!(findings.is_empty(), "{findings:?}\n{text}");
}

/// Measures, groups, experiments with their files, manoeuvres and criteria in families and parts.
const RIG: &str = r#"
study rig
gravity = 9.81 m/s^2 along -z
model corner(frame: point, u: signal) {
  param stiffness: stiffness
  body wheel { mass = 40 kg }
  joint guide: prismatic(z) ground -> wheel
  force tyre: following_spring on guide { stiffness = 200 kN/m, height = u }
  force strut: spring_damper wheel -> frame { stiffness = stiffness, damping = 2 kN*s/m }
  measure z [mm] = guide.position
  group motion { z }
}
body frame { mass = 400 kg, inertia = 40 kg*m^2, point end[1] = (1 m, 0 m, 0 m), point end[2] = (-1 m, 0 m, 0 m) }
joint float: axes(shift z, turn y) ground -> frame
for i in 1 .. 2 {
  input u[i] [mm] "under corner {i}"
  part corner[i]: corner at frame.end[i], u[i] { stiffness = c }
  measure a[i] [m/s^2] "of end {i}" = frame.end[i].acceleration.z
  group side[i] { a[i], corner[i].motion }
  experiment run[i] estimation {
    data = "data/run_{i}.csv", start = equilibrium
    measures = { a[i], corner[i].z }, columns = { corner[i].z = "z[{i}]" }
  }
  manoeuvre kerb[i] "kerb under corner {i}" { u[i] = 20 mm * smoothstep(t / 20 ms), u[3 - i] = 0 mm, for 1 s, step = 1 ms }
  criterion peak[i] [m/s^2] = max(a[i]) in kerb[i]
}
identify { c in 10 .. 40 kN/m from 25 kN/m }
"#;

#[test]
fn experiments_groups_and_manoeuvres_stand_in_families() {
    let study = checked(RIG, None);
    let names = |all: Vec<&str>| all.join(" ");
    assert_eq!(names(study.experiments.iter().map(|e| e.name.as_str()).collect()), "run[1] run[2]");
    assert_eq!(names(study.manoeuvres.iter().map(|m| m.name.as_str()).collect()), "kerb[1] kerb[2]");
    assert_eq!(names(study.groups.groups.iter().map(|group| group.name.as_str()).collect()), "side[1] side[2]");
    let files: Vec<String> = study.experiments.iter().map(|e| e.data.to_string_lossy().into_owned()).collect();
    assert!(files[0].ends_with("run_1.csv") && files[1].ends_with("run_2.csv"), "{files:?}");
    assert!(study.measures.iter().any(|m| m.name == "a[2]" && m.title == "of end 2"));
}

/// Columns of members of a family are named like them.
#[test]
fn fits_read_the_columns_of_families() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("data")).expect("a folder");
    let path = folder.path().join("rig.ident");
    std::fs::write(&path, RIG).expect("writable");
    for run in 1..=2 {
        let mut text = format!("t [s],u[1] [mm],u[2] [mm],a[{run}] [m/s^2],z[{run}][mm]\n");
        for k in 0..400 {
            let t = f64::from(k) * 5e-3;
            let (u, v) = (5.0 * (20.0 * t).sin(), 3.0 * (31.0 * t).sin());
            text += &format!("{t},{u},{v},{},{}\n", u + v, u - 0.3 * v);
        }
        std::fs::write(folder.path().join(format!("data/run_{run}.csv")), text).expect("writable");
    }
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_ident"))
        .args(["fit", "rig.ident"])
        .current_dir(folder.path())
        .output()
        .expect("ident runs");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}{}", String::from_utf8_lossy(&output.stderr));
    for part in ["side[1]", "side[2]", "corner[2].z"] {
        assert!(told.contains(part), "`{part}` is missing:\n{told}");
    }
}
