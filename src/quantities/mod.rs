//! Dimensions, units, SI as data.
//!
//! *In*: units as text (`kN*s/m`). *Out*: [`Unit`]s that convert to and from SI, [`Dimension`]s and their algebra, the
//! named types of the language. *Must not happen here*: knowledge of studies, places or expressions.

mod dimension;
mod parse;
mod symbols;
mod types;
mod unit;

pub use dimension::Dimension;
pub use parse::UnitError;
pub use types::{NAMED_TYPES, NamedType, named_type};
pub use unit::{AngleContent, Unit, format_number};
