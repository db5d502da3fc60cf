//! Units where they stand in a study.

use crate::diagnostics::{Code, Diagnostic};
use crate::quantities::Unit;
use crate::syntax::Name;

/// The unit that was written.
pub(super) fn read_unit(name: &Name) -> Result<Unit, Diagnostic> {
    Unit::parse(&name.text).map_err(|error| {
        let diagnostic = Diagnostic::error(Code::UNKNOWN_UNIT, error.to_string()).label(name.span, "not understood");
        match error.help() {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    })
}
