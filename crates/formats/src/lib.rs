//! Files of flexible bodies: our own, and one folder or file for every format of another program. What all
//! formats share that are written stands in `export`, what all share that are read in `import`; `registry`
//! lists them.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod adams;
mod chrono;
mod embedded;
pub mod export;
#[cfg(feature = "hdf5")]
mod exudyn;
mod gltf;
pub mod import;
mod json;
mod mbdyn;
#[cfg(feature = "hdf5")]
mod mbsim;
mod npz;
mod openradioss;
mod picture;
mod registry;
mod sid;
#[cfg(feature = "hdf5")]
mod simscape;
mod vtk;

pub use embedded::embedded_markdown;
pub use registry::{FORMATS, IMPORT_FORMATS, export, find_format, find_import_format, recognise};
