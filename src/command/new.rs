//! `ident new NAME`

use super::Failed;
use super::output::write_whole;
use std::path::{Path, PathBuf};

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// Name of the study: a word of letters, digits and `_`
    name: String,
    /// Folder in which the study's own folder is made
    #[arg(long, value_name = "DIR", default_value = ".")]
    directory: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let name = &arguments.name;
    let is_word = |sign: char| sign.is_alphanumeric() || sign == '_';
    if !name.starts_with(|sign: char| sign.is_alphabetic()) || !name.chars().all(is_word) {
        eprintln!(
            "error: `{name}` is no name for a study: it begins with a letter and has letters, digits and `_` only"
        );
        return Err(Failed);
    }
    let folder = arguments.directory.join(name);
    let path = folder.join(format!("{name}.ident"));
    if folder.exists() {
        eprintln!("error: {} exists already", folder.display());
        return Err(Failed);
    }
    std::fs::create_dir_all(&folder).map_err(|error| {
        eprintln!("error: cannot make {}: {error}", folder.display());
        Failed
    })?;
    write_whole(&path, &text(name))?;
    println!("{}", next_steps(&path));
    Ok(())
}

fn next_steps(path: &Path) -> String {
    let path = path.display();
    format!(
        "wrote {path}\nident check {path}       what the model is\nident simulate {path}    its motion in the manoeuvre"
    )
}

/// A mass on a spring and a damper that is shaken.
fn text(name: &str) -> String {
    include_str!("new.ident").replace("study_name", name)
}

#[cfg(test)]
mod tests {
    use super::text;
    use crate::simulation::{Compiled, Gradient, manoeuvre, simulate};
    use crate::study::{check, load_text};
    use crate::syntax::format;

    /// The study that `ident new` writes is sound, formatted, and oscillates as its numbers say.
    #[test]
    fn the_first_study_checks_and_simulates() {
        let text = text("first");
        assert_eq!(format(0, &text).as_deref(), Ok(text.as_str()));
        let checked = check(&load_text("first.ident", &text), None).unwrap_or_else(|findings| panic!("{findings:?}"));
        let compiled = Compiled::new(checked.study).unwrap_or_else(|findings| panic!("{findings:?}"));
        let theta: Vec<f64> = compiled.study.parameters.iter().map(|parameter| parameter.start).collect();
        let mut record = manoeuvre(&compiled.study, 0);
        record.measures = (0..compiled.study.measures.len()).collect();
        let run = simulate(&compiled, &record, &theta, Gradient::None).unwrap_or_else(|failure| panic!("{failure:?}"));
        // At the end the mass has followed the table; its weight rests on the spring: 10 kg on 4 kN/m.
        let last = |channel: usize| run.channels[channel].last().copied().unwrap_or(f64::NAN);
        let sag = 10.0 * 9.81 / 4000.0;
        assert!((last(0) - (0.010 - sag)).abs() < 3e-3, "{}", last(0));
        assert!((last(1) - 98.1).abs() < 12.0, "{}", last(1));
    }
}
