//! Progress of long work on standard error.

use crate::diagnose::Event;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Mutex;

/// Shows a diagnosis as it goes; silent when not wanted or not on a terminal (indicatif hides itself there).
pub(super) struct Display {
    bar: Mutex<ProgressBar>,
    quiet: bool,
}

impl Display {
    pub(super) fn new(quiet: bool) -> Self {
        Self { bar: Mutex::new(ProgressBar::hidden()), quiet }
    }

    fn begin(&self, length: usize, what: &str) {
        if self.quiet {
            return;
        }
        let bar = ProgressBar::new(length as u64).with_message(what.to_owned());
        if let Ok(style) = ProgressStyle::with_template("{msg:30} {bar:30} {pos}/{len} {elapsed}") {
            bar.set_style(style);
        }
        if let Ok(mut current) = self.bar.lock() {
            current.finish_and_clear();
            *current = bar;
        }
    }

    fn advance(&self) {
        if let Ok(bar) = self.bar.lock() {
            bar.inc(1);
        }
    }

    fn line(&self, text: &str) {
        if self.quiet {
            return;
        }
        if let Ok(bar) = self.bar.lock() {
            bar.suspend(|| eprintln!("{text}"));
        }
    }

    /// Receives an event of the diagnosis.
    pub(super) fn show(&self, event: Event) {
        match event {
            Event::Fitting { variant } => self.line(&format!("fitting {variant}")),
            Event::Fitted { variant, discrepancy } => {
                self.line(&format!("fitted {variant}: discrepancy {discrepancy:.3} %"));
            }
            Event::Screening { candidates } => {
                self.line(&format!("screening {candidates} candidates"));
                self.begin(candidates, "screening");
            }
            Event::Refitting { candidates } => self.begin(candidates, "refitting the most promising"),
            Event::Screened { .. } | Event::Refitted { .. } => self.advance(),
            Event::Accepted { candidate } => self.line(&format!("accepted {candidate}")),
        }
    }

    pub(super) fn end(&self) {
        if let Ok(bar) = self.bar.lock() {
            bar.finish_and_clear();
        }
    }
}
