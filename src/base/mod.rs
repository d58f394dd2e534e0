//! What every room may use: errors and the one table of diagnostic codes, units, provenance, progress,
//! memory, and files that appear whole or not at all. Nothing here knows matrices, models or bodies.

pub mod children;
pub mod diagnostic;
pub mod error;
mod exit_code;
mod file_mode;
#[cfg(feature = "hdf5")]
pub(crate) mod hdf5_file;
pub mod memory;
pub(crate) mod numbers;
pub mod output;
pub mod progress;
pub mod provenance;
pub mod read_files;
pub mod units;
