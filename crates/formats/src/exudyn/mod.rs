//! Exudyn: the file of a body, and an accompanying program that joins its interfaces to others.

mod interfaces;
mod mesh;
pub(super) mod read;
pub(super) mod write;
