//! `ident law NAME`

use super::Failed;
use super::output::{show, write_whole};
use crate::analyse::{self, Demonstration, LawCourse};
use crate::diagnostics::{Diagnostic, render, similar_name};
use crate::report;
use crate::study::{Loaded, load, load_text};
use crate::syntax::print_item;
use std::io::IsTerminal;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// The law; without one, all laws are listed
    name: Option<String>,
    /// A study whose own laws are meant, too
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
    /// Write the characteristic as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Numbers to draw it with instead of those of its example, e.g. `--fields "stiffness = 3 N/mm"`
    #[arg(long, value_name = "FIELDS")]
    fields: Option<String>,
    /// Amplitude of the motion, a length or an angle with its unit, or the duration of an answer in time
    #[arg(long, value_name = "AMPLITUDE")]
    over: Option<String>,
    /// Frequency of the motion, with its unit; without one (and with `--over`) the answer in time is drawn
    #[arg(long, value_name = "FREQUENCY", requires = "over")]
    at: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let loaded = match &arguments.study {
        Some(path) => load(path),
        None => load_text("none", "study none"),
    };
    if loaded.diagnostics.iter().any(Diagnostic::is_error) {
        return Err(told(&loaded, &loaded.diagnostics));
    }
    let laws = analyse::laws(&loaded);
    let Some(name) = &arguments.name else {
        let width = laws.iter().map(|(_, law)| law.name.text.len()).max().unwrap_or(0);
        for (item, law) in laws {
            let about = item.documentation.replace('\n', " ");
            let first = about.split_once(". ").map_or(about.as_str(), |(first, _)| first);
            show(&format!("{:width$}  {}\n", law.name.text, first.trim_end_matches('.')));
        }
        return Ok(());
    };
    let Some((item, law)) = laws.iter().find(|(_, law)| law.name.text == *name) else {
        eprintln!("error: there is no law `{name}`");
        if let Some(similar) = similar_name(name, laws.iter().map(|(_, law)| law.name.text.as_str())) {
            eprintln!("help: did you mean `{similar}`? `ident law` lists all laws");
        }
        return Err(Failed);
    };
    show(&print_item(item));
    let Some(path) = &arguments.figure else { return Ok(()) };
    let Some(demonstration) = demonstration(arguments, Demonstration::of_remark(&item.documentation)) else {
        eprintln!("error: law `{name}` has no example to draw");
        eprintln!("help: give `--fields`, `--over` and `--at`, or write a line into its remark:");
        eprintln!("      /// Example: `stiffness = 3 N/mm` over 20 mm at 1 Hz");
        return Err(Failed);
    };
    let shown = analyse::characteristic(&loaded, law, &demonstration)
        .map_err(|(example, findings)| told(&example, &findings))?;
    write_whole(path, &report::figure::characteristic(&shown))
}

/// The example with what the arguments replace of it.
fn demonstration(arguments: &Arguments, example: Option<Demonstration>) -> Option<Demonstration> {
    let (fields, course) = match example {
        Some(example) => (Some(example.fields), Some(example.course)),
        None => (None, None),
    };
    let given = arguments.over.clone().map(|over| match arguments.at.clone() {
        Some(frequency) => LawCourse::Harmonic { amplitude: over, frequency },
        None => LawCourse::Time { duration: over },
    });
    Some(Demonstration { fields: arguments.fields.clone().or(fields)?, course: given.or(course)? })
}

fn told(loaded: &Loaded, findings: &[Diagnostic]) -> Failed {
    eprint!("{}", render(findings, &loaded.sources, std::io::stderr().is_terminal()));
    Failed
}
