//! `ident fmt FILES`

use super::Failed;
use super::output::{show, write_whole};
use crate::diagnostics::{Sources, render};
use crate::syntax::{NotFormatted, format};
use similar::TextDiff;
use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// Study files; `-` formats standard input to standard output
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Change nothing; show what would change, and fail if there is anything
    #[arg(long)]
    check: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let mut failed = false;
    for path in &arguments.files {
        failed |= one(path, arguments.check).is_err();
    }
    if failed { Err(Failed) } else { Ok(()) }
}

fn one(path: &Path, check: bool) -> Result<(), Failed> {
    let name = path.display().to_string();
    let is_standard = name == "-";
    let text = read(path, is_standard).map_err(|cause| {
        eprintln!("error: cannot read {name}: {cause}");
        Failed
    })?;
    let mut sources = Sources::new();
    let file = sources.add(&name, &text);
    let formatted = format(file, &text).map_err(|cause| {
        match cause {
            NotFormatted::Unreadable(findings) => {
                eprint!("{}", render(&findings, &sources, std::io::stderr().is_terminal()));
            }
            NotFormatted::Unfaithful => {
                eprintln!(
                    "error: {name} would be read otherwise after formatting and is left as it is; please report it"
                );
            }
        }
        Failed
    })?;
    if check {
        if formatted == text {
            return Ok(());
        }
        let diff = TextDiff::from_lines(&text, &formatted);
        show(&diff.unified_diff().context_radius(2).header(&name, "formatted").to_string());
        return Err(Failed);
    }
    if is_standard {
        show(&formatted);
    } else if formatted != text {
        write_whole(path, &formatted)?;
    }
    Ok(())
}

fn read(path: &Path, is_standard: bool) -> std::io::Result<String> {
    if !is_standard {
        return std::fs::read_to_string(path);
    }
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text)?;
    Ok(text)
}
