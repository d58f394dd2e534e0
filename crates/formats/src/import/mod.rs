//! Shared code of the import formats: the trait, the body described by a file, its audit, and the conversion
//! into a flexible body.

mod accepted;
mod any_body;
mod audit;
mod body;
pub(crate) mod check;
pub(crate) mod digits;
mod format;
#[cfg(feature = "hdf5")]
pub(crate) mod hdf5_arrays;
mod import_body;
mod kind_of_modes;
pub(crate) mod redundant;
#[cfg(feature = "hdf5")]
pub(crate) mod surface;

pub use accepted::accept_imported;
pub use audit::{Audit, audit};
pub use body::{ImportedBody, ImportedFrame};
pub use check::AuditCheck;
pub use format::{ImportFormat, ImportedFile};
pub use import_body::{Imported, import_body};
