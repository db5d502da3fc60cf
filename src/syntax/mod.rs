//! From text to a [`Tree`] and back.
//!
//! *In*: the text of one `.ident` file. *Out*: its [`Tree`] with spans, and diagnostics (several at once; the parser
//! recovers at the next declaration). *Must not happen here*: resolution of names, units or dimensions; reading
//! files. The only module that names pest.

mod build;
mod build_expression;
mod build_law;
mod build_structure;
mod build_study;
mod explain;
mod format;
mod grammar;
mod print;
mod read;
mod scan;
mod split;
mod tree;

pub use format::{NotFormatted, format};
pub use print::{print, print_expression, print_item};
pub use read::parse;
pub use tree::*;
