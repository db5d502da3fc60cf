//! From text to a [`Tree`] and back.
//!
//! *In*: the text of one `.ident` file. *Out*: its [`Tree`] with spans, and diagnostics (several at once; the parser
//! recovers at the next declaration). *Must not happen here*: resolution of names, units or dimensions; reading
//! files. The only module that names pest.

mod tree;

pub use tree::*;
