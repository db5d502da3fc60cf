//! Effects at places of their own kind against closed solutions: gravity that is not level, friction by what a joint
//! carries.

use crate::run::run;

const GRAVITY: f64 = 9.81;

/// Last value of the only measure; the run takes one second.
fn end(text: &str) -> f64 {
    let common = "study s \"S\"\ngravity = 9.81 m/s^2 along -z\nsolver { tolerance = 1e-9 }\n";
    let channels = run(&format!("{common}{text}"), &[]);
    *channels[0].values().next().and_then(|values| values.last()).expect("a measure")
}

/// A block thrown along a guide on a support that is not level.
#[test]
fn blocks_rub_by_what_their_guides_carry_and_slide_on_slopes() {
    let block = |axis: &str| {
        end(&format!(
            "body block {{ mass = 3 kg }}\njoint guide: prismatic({axis}) ground -> block\n\
             effect slope: tilted_support on gravity.x {{ a = 0.5 m/s^2 }}\n\
             effect rub: bearing_friction on guide {{ mu = 0.1, creep = 0.1 mm/s }}\n\
             measure x [m] = guide.position\n\
             manoeuvre thrown {{ for 1 s, step = 0.5 s, start = rest {{ guide.velocity = 20 m/s }} }}\ncriterion c = max(guide.position) in thrown\n"
        ))
    };
    // Along x gravity's new component drives; across it there is gravity as declared.
    let level = 20.0 + 0.5 * (0.5 - 0.1 * GRAVITY);
    assert!((block("x") - level).abs() < 1e-6, "{} {level}", block("x"));
    // Up a slope of 4 in 5: (0.5, 0, -g) along (0.6, 0, 0.8) and across, along (0.8, 0, -0.6).
    let (along, across) = (0.3 - 0.8 * GRAVITY, 0.4 + 0.6 * GRAVITY);
    let slope = 20.0 + 0.5 * (along - 0.1 * across);
    assert!((block("(0.6, 0, 0.8)") - slope).abs() < 1e-6, "{} {slope}", block("(0.6, 0, 0.8)"));
}

/// A balanced rotor on a vertical axis: the bearing carries its weight, the moment of friction is constant.
#[test]
fn rotors_rub_by_what_their_bearings_carry() {
    let speed = end("body rotor { mass = 5 kg, inertia = 0.02 kg*m^2 }\njoint bearing: revolute(z) ground -> rotor\n\
         effect rub: journal_friction on bearing { mu_r = 0.5 mm, creep = 0.01 rad/s }\nmeasure w [rad/s] = bearing.velocity\n\
         manoeuvre spun { for 1 s, step = 0.5 s, start = rest { bearing.velocity = 50 rad/s } }\ncriterion c = max(bearing.velocity) in spun\n");
    let expected = 50.0 - 0.5e-3 * 5.0 * GRAVITY / 0.02;
    assert!((speed - expected).abs() < 1e-6, "{speed} {expected}");
}
