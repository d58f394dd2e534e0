//! How bodies move: equations of motion, reduced and of all nodes, and the scene, which says what a body is
//! to do. No decisions about terms and modes.

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
