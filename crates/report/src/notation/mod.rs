//! Notation of reports: numbers and quantities with their units, texts of files, comma-separated values.

pub(crate) mod csv;
pub(crate) mod markup;
pub(crate) mod numbers;
pub(crate) mod units;
