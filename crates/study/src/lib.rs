//! What a scene needs of a body, and what accuracy costs there.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

#[cfg(feature = "hdf5")]
pub mod reference;
pub mod response;
pub mod selection;
pub mod tailoring;
#[cfg(feature = "hdf5")]
pub mod trade;
