//! The parser that pest derives from `grammar/ident.pest`.

#[derive(pest_derive::Parser)]
#[grammar = "../grammar/ident.pest"]
pub(super) struct Grammar;
