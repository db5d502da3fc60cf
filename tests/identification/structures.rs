//! Structures side by side: the slide's records hide a damper that saturates.

use crate::shipped::{fitted, loaded};
use ident::identify::{Candidate, Fitted, Settings, Structure, structures};
use ident::simulation::{Compiled, Record, prepare};
use ident::study::{self, Role};

const VARIANTS: &str = "
variant saturating of base {
  replace force damper: saturating_damper ground -> slider {
    compression = { slope = d_slide, knee = 0.3 m/s, ratio = share }
    rebound     = { slope = d_slide, knee = 0.3 m/s, ratio = share }
  }
  identify { share in 0.05 .. 1 from 0.8 }
}
variant dry of base {
  replace force damper: coulomb_glide ground -> slider { friction = mu, normal = 100 N, creep = 10 mm/s }
  identify { mu in 0 .. 2 from 0.2 }
}";

fn fit_of(variant: &str) -> (Compiled, Vec<Record>, Fitted) {
    let loaded = loaded("spring_slide").with_text(VARIANTS);
    let study = study::check(&loaded, Some(variant)).expect("a study").study;
    let (records, _) = prepare(&study, &loaded.directory, &[]);
    let compiled = Compiled::new(study).expect("a mechanism");
    let used: Vec<Record> = records.iter().filter(|record| record.role == Role::Estimation).cloned().collect();
    let fit = fitted(&compiled, &used, &Settings::default());
    (compiled, records, fit)
}

fn compared(variants: &[&str]) -> Vec<Structure> {
    let fits: Vec<_> = variants.iter().map(|variant| fit_of(variant)).collect();
    let candidates: Vec<Candidate> =
        fits.iter().map(|(compiled, records, fitted)| Candidate { compiled, fitted, records }).collect();
    structures(&candidates)
}

#[test]
fn the_true_structure_wins_by_every_measure() {
    let result = compared(&["base", "saturating", "dry"]);
    let [base, saturating, dry] = result.as_slice() else { panic!("three structures") };
    assert!(base.likelihood_ratio.is_none() && base.held_out_change.is_none());
    assert!(saturating.bic < base.bic - 10.0 && saturating.aicc < base.aicc - 10.0, "{saturating:?} {base:?}");
    assert!(saturating.likelihood_ratio_p.expect("nested") < 1e-6 && saturating.vuong_z.is_none());
    let (change, low, high) = saturating.held_out_change.expect("held-out records");
    assert!(low <= change && change <= high && high < 0.0, "{low} {change} {high}");
    // Dry friction instead of a damper: neither contains the other, and it is worse.
    assert!(dry.likelihood_ratio_p.is_none() && dry.bic > saturating.bic);
    let z = dry.vuong_z.expect("not nested");
    assert!((z < 0.0) == (dry.bic > base.bic) && (0.0..=1.0).contains(&dry.vuong_p.expect("a p-value")), "{dry:?}");
}

/// Against itself nothing differs; the order of two decides the sign only.
#[test]
fn the_test_of_two_is_antisymmetric() {
    let forward = compared(&["base", "dry"]);
    let backward = compared(&["dry", "base"]);
    let (a, b) = (forward[1].vuong_z.expect("not nested"), backward[1].vuong_z.expect("not nested"));
    assert!((a + b).abs() < 1e-9 * a.abs(), "{a} {b}");
    assert!((forward[1].bic - forward[0].bic + backward[1].bic - backward[0].bic).abs() < 1e-6);
}
