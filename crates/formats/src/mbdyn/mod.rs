//! The `.fem` file of MBDyn's modal joint.

#[cfg(feature = "import")]
pub(super) mod read;
pub(super) mod write;
