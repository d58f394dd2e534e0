//! The HDF5 file of MBSim's `ExternalFlexibleFfrBody`.

#[cfg(feature = "import")]
pub(super) mod read;
pub(super) mod write;
