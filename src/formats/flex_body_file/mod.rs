//! The flex-body file: HDF5, one table for writer, reader, validator and documentation; the checkpoint of a search; the file of a simulation.

mod assemble;
mod checkpoint;
mod contents;
mod derived;
mod digest;
mod document;
mod extents;
mod item;
mod names;
mod read;
mod scan;
mod schema;
mod simulation;
mod structure;
mod value;
mod write;

pub use crate::base::output::OutputSlot;
pub use checkpoint::{Checkpoint, read_checkpoint, write_checkpoint};
pub use contents::{NamedArray, NamedAttributes, Numbers, contents};
pub use document::{format_markdown, format_schema};
pub use read::{read, read_with_notes, validate};
pub use simulation::fill_simulation;
pub use structure::structure;
pub use write::{fill_slot, prepare_output, write, write_to};
