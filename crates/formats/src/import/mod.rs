//! Shared code of the import formats: the trait, the body described by a file, its audit, and the conversion
//! into a flexible body.

mod audit;
pub(crate) mod digits;
mod format;
#[cfg(feature = "hdf5")]
pub(crate) mod hdf5_arrays;
mod import_body;
pub(crate) mod redundant;

pub use audit::{Audit, audit};
pub use format::{AuditCheck, ImportFormat, ImportedBody, ImportedFile, ImportedFrame};
pub use import_body::{Imported, accept_imported, import_body};
