//! What the formats that are read share: the trait, the body as a file has it, its audit, and the way to a flexible body.

mod adopt;
mod audit;
mod body;
pub(crate) mod check;
pub(crate) mod digits;
mod format;
mod free_surface;
#[cfg(feature = "hdf5")]
pub(crate) mod hdf5_arrays;
pub(crate) mod redundant;

pub use adopt::{Adopted, adopt};
pub use audit::{Audit, audit};
pub use body::{ForeignBody, ForeignFrame};
pub use check::AuditCheck;
pub use format::{Foreign, ForeignFormat};
