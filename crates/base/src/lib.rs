//! Foundations of all other crates: errors and the table of diagnostic codes, units, provenance, memory, text files,
//! and files that appear whole or not at all. This crate does not depend on matrices, models or bodies.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

pub mod children;
pub mod diagnostic;
pub mod error;
mod exit_code;
mod explanation;
#[cfg(feature = "hdf5")]
pub mod hdf5_file;
pub mod memory;
pub mod named_unit;
pub mod numbers;
pub mod output;
pub mod provenance;
pub mod read_files;
pub mod text;
pub mod units;
