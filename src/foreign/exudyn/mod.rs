//! The file of Exudyn's `ObjectFFRFreducedOrderInterface`.

mod format;

pub(in crate::foreign) use format::Exudyn;
