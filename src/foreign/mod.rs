//! Flexible-body files of other programs: read, audited, and taken as bodies.

mod body;
mod check;
mod format;
mod sid;

pub use body::{ForeignBody, ForeignFrame};
pub use check::AuditCheck;
pub use format::{FOREIGN_FORMATS, Foreign, ForeignFormat, find_foreign, recognise};
pub use sid::SidFile;
