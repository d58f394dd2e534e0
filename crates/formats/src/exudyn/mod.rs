//! Exudyn: the file of a body, and beside it a program that joins its interfaces to others.

mod interfaces;
mod mesh;
pub(super) mod read;
pub(super) mod write;
