//! `ident explain CODE`

use super::Failed;
use crate::diagnostics::{Code, similar_name};

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// A code as messages show it, e.g. E0201; without one, all codes are listed
    code: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let Some(text) = &arguments.code else {
        for code in Code::ALL {
            println!("{code}  {}", code.title);
        }
        return Ok(());
    };
    match Code::find(text) {
        Some(code) => {
            println!("{code}: {}\n\n{}", code.title, code.explanation.trim_end());
            Ok(())
        }
        None => {
            eprintln!("error: there is no code `{text}`");
            if let Some(similar) = similar_name(text, Code::ALL.iter().map(|code| code.text)) {
                eprintln!("help: did you mean `{similar}`? `ident explain` lists all codes");
            }
            Err(Failed)
        }
    }
}
