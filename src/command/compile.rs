//! `ident compile STUDY --emit flat|tree|model|equations|latex|tape`

use super::output::show;
use super::session::Session;
use super::{Failed, Format};
use crate::mechanics::{emit_equations, emit_latex, emit_model, emit_tree};
use crate::study::flat_text;
use crate::tape::emit_tape;
use clap::ValueEnum;
use std::path::PathBuf;

#[derive(clap::Args, Debug)]
pub(super) struct Arguments {
    /// The study file
    study: PathBuf,
    /// Variant to compile
    #[arg(long, default_value = "base")]
    variant: String,
    /// What to show
    #[arg(long, value_enum, default_value_t = Emit::Model)]
    emit: Emit,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Emit {
    /// The study with models, families and the variant written out
    Flat,
    /// Spanning tree of bodies and joints
    Tree,
    /// Bodies, joints, force elements, states, measures
    Model,
    /// Equations of motion and measurements
    Equations,
    /// The same as LaTeX, for small models
    Latex,
    /// Instructions of the compiled closures
    Tape,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failed> {
    let session = Session::open(&arguments.study, Format::Text)?;
    if arguments.emit == Emit::Flat {
        let text = flat_text(&session.loaded, Some(&arguments.variant)).map_err(|findings| session.fail(&findings))?;
        show(&text);
        return Ok(());
    }
    let compiled = session.compile(&arguments.variant)?;
    let text = match arguments.emit {
        Emit::Flat => String::new(),
        Emit::Tree => emit_tree(&compiled.study).map_err(|diagnostics| session.fail(&diagnostics))?,
        Emit::Model => emit_model(&compiled.study, &compiled.system),
        Emit::Equations => emit_equations(&compiled.study, &compiled.system),
        Emit::Latex => emit_latex(&compiled.study, &compiled.system),
        Emit::Tape => emit_tape(&compiled.model),
    };
    show(&text);
    Ok(())
}
