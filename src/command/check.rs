//! `ident check STUDY`

use super::output::show;
use super::session::Session;
use super::{Failed, Format};
use crate::mechanics::emit_model;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// The study file
    study: PathBuf,
    /// Variant to check; all of them where absent
    #[arg(long)]
    variant: Option<String>,
    /// Form of diagnostics
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let session = Session::open(&arguments.study, arguments.format)?;
    let first = arguments.variant.as_deref().unwrap_or("base");
    let compiled = session.compile(first)?;
    if arguments.variant.is_none() {
        for variant in &compiled.study.variants {
            session.compile(variant)?;
        }
    }
    show(&emit_model(&compiled.study, &compiled.system));
    Ok(())
}
