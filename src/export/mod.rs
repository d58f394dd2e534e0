//! A body in the formats of other programs: one file per format, `FlexBody` to bytes, behind the registry `FORMATS`.

mod format;
mod frames;
mod losses;
mod sid;

pub use format::{ExportFormat, ExportOptions, Exported, FORMATS, Points, export, find_format};
pub use frames::{ExportFrame, frames};
pub use sid::Sid;
