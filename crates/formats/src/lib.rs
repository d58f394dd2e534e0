//! Files of flexible bodies for other programs, one folder or file per format. `export` holds the code shared
//! by export formats, `import` that shared by import formats; `registry` and `import_registry` list the formats.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod adams;
mod chrono;
#[cfg(feature = "embedded-c")]
mod embedded;
pub mod export;
#[cfg(feature = "hdf5")]
mod exudyn;
mod gltf;
#[cfg(feature = "import")]
pub mod import;
#[cfg(feature = "import")]
mod import_registry;
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

#[cfg(feature = "embedded-c")]
pub use embedded::embedded_markdown;
#[cfg(feature = "import")]
pub use import_registry::{IMPORT_FORMATS, audit_file, find_import_format, import_file, recognise};
pub use registry::{FORMATS, export, export_in_units, find_format, motion_of_losses};
pub use vtk::{PointValues, envelope_vtu, stresses_vtu};
