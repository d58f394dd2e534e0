//! The `.fem` file of MBDyn's modal joint.

pub(super) mod read;
mod records;
pub(super) mod write;
