//! The flex-body file: HDF5, one table for writer, reader, validator and documentation; and the file of a motion.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod contents;
mod document;
mod draft;
mod in_units;
mod item;
mod names;
mod per;
#[cfg(feature = "hdf5")]
mod read;
mod recorded_motion;
#[cfg(feature = "hdf5")]
mod recovered;
#[cfg(feature = "hdf5")]
mod scan;
mod schema;
#[cfg(feature = "hdf5")]
mod simulation;
#[cfg(feature = "hdf5")]
mod structure;
mod units;
mod value;
mod version;
#[cfg(feature = "hdf5")]
mod write;

pub use contents::{NamedArray, NamedAttributes, Numbers, contents};
pub use document::{format_markdown, format_schema};
pub use flexbody_base::output::OutputSlot;
pub use in_units::in_units;
#[cfg(feature = "hdf5")]
pub use read::{read, read_with_notes, validate};
pub use recorded_motion::RecordedMotion;
#[cfg(feature = "hdf5")]
pub use recovered::{fill_channels, fill_recovered};
#[cfg(feature = "hdf5")]
pub use simulation::{fill_simulation, read_simulation};
#[cfg(feature = "hdf5")]
pub use structure::structure;
#[cfg(feature = "hdf5")]
pub use write::{fill_slot, prepare_output, write, write_to};
