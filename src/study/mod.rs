//! What a scene needs of a body, and what accuracy costs there.

#[cfg(feature = "hdf5")]
pub(crate) mod checkpoint;
pub mod reference;
pub mod response;
pub mod selection;
pub mod tailoring;
#[cfg(feature = "hdf5")]
pub mod trade;
