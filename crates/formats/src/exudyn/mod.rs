//! Exudyn: the file of a body, and an accompanying program that joins its interfaces to others.

#[cfg(feature = "import")]
pub(super) mod read;
pub(super) mod write;
