//! Motion of bodies: equations of motion, reduced and of all nodes, and the scene, which defines loads,
//! prescribed motion and requirements. No decisions about terms and modes.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

pub mod dynamics;
pub mod integration;
pub mod scene;
