//! Terminal text of synthetic results, kept as snapshots.

mod synthetic;

use ident::report::terminal::{self, Colour};

#[test]
fn answer_with_a_named_cause() {
    insta::assert_snapshot!(terminal::answer(&synthetic::drive_axis()));
}

#[test]
fn answer_with_a_group_of_causes() {
    insta::assert_snapshot!(terminal::answer(&synthetic::quarter_vehicle()));
}

#[test]
fn identification_and_comparison() {
    let answer = synthetic::quarter_vehicle();
    insta::assert_snapshot!("identification", terminal::identification(&answer.extended));
    insta::assert_snapshot!("comparison", terminal::comparison(&[answer.base, answer.extended]));
}

#[test]
fn nothing_wrong_needs_neither_cause_nor_extension() {
    let mut answer = synthetic::drive_axis();
    answer.verdict = ident::diagnose::Verdict::NothingWrongFound;
    answer.steps.remove(0);
    answer.extension = None;
    answer.extended = answer.base.clone();
    let text = terminal::answer(&answer);
    assert!(text.contains("NOTHING WRONG FOUND"));
    assert!(!text.contains("Extension") && !text.contains("before") && !text.contains("Cause\n"), "{text}");
}

#[test]
fn colours_only_when_asked_for() {
    let answer = synthetic::drive_axis();
    assert!(!terminal::answer(&answer).contains('\u{1b}'));
    assert!(terminal::answer_in(&answer, Colour::Always).contains("\u{1b}[1;32mCAUSE NAMED\u{1b}[0m"));
}

#[test]
fn missing_and_infinite_numbers_are_named() {
    let mut answer = synthetic::drive_axis();
    answer.extended.parameters[3].interval = None;
    answer.extended.parameters[3].standard_deviation = None;
    answer.extended.bic = f64::NAN;
    let text = terminal::identification(&answer.extended);
    assert!(text.contains("undetermined") && text.contains("BIC not a number"), "{text}");
}
