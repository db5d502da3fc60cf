//! Results made readable: terminal text, JSON for programs, one self-contained page, one picture.
//!
//! *In*: an [`Identification`](crate::identify::Identification) or an [`Answer`](crate::diagnose::Answer).
//! *Out*: text (UTF-8) as a `String`; where it goes is the caller's business.
//! *Must not happen here*: files or terminals opened, numbers of the result recomputed or judged anew, requests to the
//! outside from a page.
//!
//! | form | entry |
//! | --- | --- |
//! | terminal | [`terminal::answer`], [`terminal::identification`], [`terminal::comparison`] |
//! | JSON, see `docs/output.md` | [`json::answer`], [`json::identification`], [`json::comparison`] |
//! | page | [`page::answer`], [`page::identification`], [`page::comparison`] |
//! | picture | [`figure::summary`] |

pub mod chart;

pub mod figure;
pub mod json;
pub mod number;
pub mod page;

mod characteristic;
mod surface;
pub mod terminal;
mod words;
