//! Pages and pictures of synthetic results: self-contained, well-formed, small enough, everything on them.
//!
//! The pages are left in `CARGO_TARGET_TMPDIR` (`target/tmp`) for looking at.

mod synthetic;

use ident::diagnose::Verdict;
use ident::report::page;

const LIMIT: usize = 4_000_000;

fn kept(name: &str, text: &str) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join(name), text).unwrap();
}

/// What makes a browser fetch something, or could: none of it may be there.
fn assert_self_contained(page: &str) {
    for forbidden in [
        "http://",
        "https://",
        "src=",
        "href=",
        "url(",
        "@import",
        "fetch(",
        "XMLHttpRequest",
        "<link",
        "<img",
        "<iframe",
    ] {
        assert!(!page.contains(forbidden), "page contains {forbidden}");
    }
    assert!(page.contains("default-src 'none'"), "the browser is told to refuse requests");
}

/// Tags of the markup outside scripts, styles and comments close in order.
fn assert_well_formed(page: &str) {
    const VOID: [&str; 3] = ["meta", "br", "!doctype"];
    let mut open: Vec<String> = Vec::new();
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        rest = &rest[start + 1..];
        if let Some(comment) = rest.strip_prefix("!--") {
            rest = comment.split_once("-->").expect("comment ends").1;
            continue;
        }
        let (tag, after) = rest.split_once('>').expect("tag ends");
        rest = after;
        let name: String =
            tag.trim_start_matches('/').chars().take_while(|c| !c.is_whitespace() && *c != '/').collect();
        if tag.starts_with('/') {
            assert_eq!(open.pop().as_deref(), Some(name.as_str()), "closing tag <{tag}> in order");
        } else if !tag.ends_with('/') && !VOID.contains(&name.as_str()) {
            if name == "script" || name == "style" {
                rest = rest.split_once(&format!("</{name}>")).expect("script or style ends").1;
            } else {
                open.push(name);
            }
        }
    }
    assert!(open.is_empty(), "unclosed: {open:?}");
}

fn assert_sound(page: &str) {
    assert_self_contained(page);
    assert_well_formed(page);
    assert!(page.len() < LIMIT, "{} bytes", page.len());
    let markup = page.split("<script").next().unwrap();
    assert!(!markup.contains("NaN") && !markup.contains(">inf<"), "non-finite numbers are named in words");
}

#[test]
fn page_of_a_drive_axis() {
    let answer = synthetic::drive_axis();
    let page = page::answer(&answer).unwrap();
    kept("drive_axis.html", &page);
    assert_sound(&page);
    for part in [
        "Cause named",
        "dry friction of 20.3 N",
        "Measured against simulated",
        "missing force [N]",
        "velocity [m/s]",
        "position [m]",
        "Where the discrepancy is",
        "cause and place",
        "stribeck_friction at slide",
        "direction_dependent_damping at slide",
        "viscous and slide_F move together: correlation -0.93",
        "residual [N]",
        "variant with_dry_friction of base",
        "ident diagnose drive_axis.ident --write",
        "end_stop at slide",
    ] {
        assert!(page.contains(part), "page shows {part}");
    }
}

#[test]
fn page_of_a_quarter_vehicle() {
    let page = page::answer(&synthetic::quarter_vehicle()).unwrap();
    kept("quarter_vehicle.html", &page);
    assert_sound(&page);
    for part in
        ["axle acceleration [m/s^2]", "cannot be told apart", "at its bound", "not determined", "at chassis_guide"]
    {
        assert!(page.contains(part), "page shows {part}");
    }
}

#[test]
fn page_of_a_fit_and_of_variants() {
    let answer = synthetic::quarter_vehicle();
    let fit = page::identification(&answer.extended, None).unwrap();
    kept("fit.html", &fit);
    assert_sound(&fit);
    let mut third = answer.extended.clone();
    third.variant = "with_degressive_rate".into();
    let comparison = page::comparison(&[answer.base, answer.extended, third]).unwrap();
    kept("comparison.html", &comparison);
    assert_sound(&comparison);
    assert!(comparison.contains("swatch variant2"));
}

#[test]
fn page_where_nothing_is_wrong_shows_one_simulation() {
    let mut answer = synthetic::drive_axis();
    answer.verdict = Verdict::NothingWrongFound;
    answer.base = answer.extended.clone();
    answer.extension = None;
    answer.steps.clear();
    answer.missing_forces.clear();
    answer.anatomy.clear();
    let page = page::answer(&answer).unwrap();
    assert_sound(&page);
    assert!(
        !page.contains("simulated after") && !page.contains("Ranking of causes") && !page.contains("id=\"extension\"")
    );
}

#[test]
fn text_of_a_study_cannot_break_the_page() {
    let mut answer = synthetic::quarter_vehicle();
    answer.title = "</script><b>&\"".into();
    answer.base.records[0].channels[0].title = "</script><i>".into();
    answer.base.records[0].channels[0].name = "<u>".into();
    answer.base.variant = "</script><u>".into();
    let page = page::answer(&answer).unwrap();
    assert_sound(&page);
    assert!(!page.contains("</script><"), "names are escaped in markup and in data");
}

#[test]
fn gaps_and_non_finite_results_are_shown_as_such() {
    let mut answer = synthetic::drive_axis();
    answer.extended.records[0].channels[0].simulated[100..200].fill(f64::NAN);
    answer.extended.validation_discrepancy = Some(f64::INFINITY);
    answer.extended.bic = f64::NAN;
    answer.missing_forces[0].force.fill(f64::NAN);
    answer.missing_forces[0].explained.clear();
    let page = page::answer(&answer).unwrap();
    assert_sound(&page);
    assert!(page.contains("no finite values to show") && page.contains("infinite"));
}

#[test]
fn many_long_records_are_thinned_and_the_page_says_so() {
    let mut answer = synthetic::drive_axis();
    let record = answer.base.records[0].clone();
    for index in 0..12 {
        let mut copy = record.clone();
        copy.experiment = format!("trajectory {index}");
        answer.base.records.push(copy.clone());
        answer.extended.records.push(copy);
    }
    let page = page::answer(&answer).unwrap();
    assert_sound(&page);
    assert!(page.contains("drawn from the minimum and maximum of every"));
}

#[test]
fn picture_of_a_diagnosis_stands_alone() {
    for (name, answer) in
        [("drive_axis.svg", synthetic::drive_axis()), ("quarter_vehicle.svg", synthetic::quarter_vehicle())]
    {
        let picture = ident::report::figure::summary(&answer);
        kept(name, &picture);
        assert!(picture.starts_with("<svg xmlns=") && picture.len() < 200_000, "{} bytes", picture.len());
        assert_well_formed(&picture);
        // The name space is an identifier, nothing is fetched.
        assert_eq!(picture.matches("http").count(), 1);
        for part in ["missing force [N]", "velocity [m/s]", "residual [", "held-out discrepancy"] {
            assert!(picture.contains(part), "{name} shows {part}");
        }
    }
}
