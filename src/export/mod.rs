//! A body in the formats of other programs: one file per format, `FlexBody` to bytes, behind the registry `FORMATS`.

mod embedded;
mod format;
mod frames;
mod losses;

pub use embedded::embedded_markdown;
pub use format::{ExportFormat, ExportOptions, Exported, FORMATS, Points, export, find_format};
pub use frames::{ExportFrame, frames};
