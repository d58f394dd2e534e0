//! The `.fem` file of MBDyn's modal joint.

mod checks;
pub(super) mod read;
pub(super) mod write;
