//! The `.fem` file of MBDyn's modal joint.

mod body;
mod checks;
mod format;
mod lumped;
mod records;
mod words;

pub(in crate::foreign) use format::Mbdyn;
