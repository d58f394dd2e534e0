//! Files of flexible bodies for other programs, one folder or file per format. `export` holds the code shared
//! by export formats, `import` that shared by import formats; `registry` lists the formats.

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
pub mod shapes;
mod sid;
#[cfg(feature = "hdf5")]
mod simscape;
pub mod stiffening;
mod vtk;

pub use embedded::embedded_markdown;
pub use registry::{
    FORMATS, IMPORT_FORMATS, audit_file, export, export_in_units, find_format, find_import_format,
    import_file, motion_of_losses, recognise,
};
pub use vtk::{PointValues, envelope_vtu, stresses_vtu};
