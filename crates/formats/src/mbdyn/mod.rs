//! The `.fem` file of MBDyn's modal joint.

mod checks;
pub(super) mod read;
mod records;
pub(super) mod write;
