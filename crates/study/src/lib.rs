//! Study of a body in a scene: the terms and modes that the scene needs, and the cost of accuracy.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

pub mod advice;
mod attached_mass;
pub mod conversion;
pub mod measured_run;
pub mod recipe;
pub mod reference;
#[cfg(feature = "response")]
pub mod response;
pub mod selection;
pub mod selection_request;
pub mod tailoring;
#[cfg(feature = "hdf5")]
pub mod trade;
