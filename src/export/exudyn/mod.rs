//! Exudyn: the file of a body, and beside it a program that joins its interfaces to others.

mod format;
mod interfaces;

pub(super) use format::Exudyn;
