//! The HDF5 file of MBSim's `ExternalFlexibleFfrBody`.

pub(super) mod read;
pub(super) mod write;
