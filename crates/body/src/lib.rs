//! From a checked model to a flexible body: bases, the condensation into invariants, lumped comparators, the
//! validated body, and its verification against the model. No files and no motion.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

pub mod basis;
pub mod convert;
pub mod flex_body;
pub mod invariants;
pub mod problems;
mod recounts;
pub mod verification;
