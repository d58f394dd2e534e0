//! Shared code of the export formats: the trait, frames, losses, containers.

pub(crate) mod arrays;
mod format;
pub(crate) mod frames;
#[cfg(feature = "hdf5")]
pub(crate) mod hdf5_contents;
pub(crate) mod losses;
pub(crate) mod matrices;
pub(crate) mod stresses;

pub use format::{
    AllowedLosses, ExportChecklist, ExportFormat, ExportOptions, Exported, Holding, Loss, Points,
};
pub use frames::{ExportFrame, frames};
