//! Flexible-body files of other programs: read, audited, and taken as bodies.

mod adopt;
mod audit;
mod body;
mod check;
mod digits;
mod exudyn;
mod format;
mod free_surface;
mod hdf5_arrays;
mod mbdyn;
mod mbsim;
mod redundant;
mod sid;

pub use adopt::{Adopted, adopt};
pub use audit::{Audit, audit};
pub use body::{ForeignBody, ForeignFrame};
pub use check::AuditCheck;
pub use format::{FOREIGN_FORMATS, Foreign, ForeignFormat, find_foreign, recognise};
