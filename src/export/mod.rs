//! A body in the formats of other programs: one file per format, `FlexBody` to bytes, behind the registry `FORMATS`.

mod adams_invariants;
mod arrays;
mod chrono;
mod embedded;
mod exudyn;
mod format;
mod frames;
mod hdf5_file;
mod inertia;
mod interface_matrices;
mod json;
mod losses;
mod mat5;
mod mbdyn;
mod mbsim;
mod npz;
mod openradioss;
mod sid;
mod simscape;

pub use embedded::embedded_markdown;
pub use format::{ExportFormat, ExportOptions, Exported, FORMATS, Points, export, find_format};
pub use frames::{ExportFrame, frames};
