//! Measured records in CSV files.

mod error;
mod read;
mod sampling;
mod table;

pub use error::DataError;
pub use read::read_table;
pub use sampling::Sampling;
pub use table::{Column, Table};
