//! The `.fem` file of MBDyn's modal joint.

mod checks;
pub(super) mod import;
mod read;
pub(super) mod write;
