//! The HDF5 file of MBSim's `ExternalFlexibleFfrBody`.

mod format;

pub(in crate::foreign) use format::Mbsim;
