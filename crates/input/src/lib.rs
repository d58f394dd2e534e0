//! Reads manifests, matrices, tables of nodes and degrees of freedom, and jobs of FE programs. Each matrix format has
//! one file in `matrices` behind [`Reader`] and [`READERS`], each FE program one in `jobs`. The contracts with users are
//! `docs/reference/input.md` and `docs/how_to/from_fe_programs.md`.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod array;
mod bulk_cards;
mod classic_netcdf;
mod digits;
mod element_source;
mod exodus;
mod fe_results;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(not(feature = "hdf5"))]
#[path = "without_hdf5.rs"]
mod hdf5;
mod jobs;
mod manifest;
mod matrices;
mod mesh;
mod mode_files;
mod model_files;
mod node_file;
mod node_files;
mod npy;
mod number_type;
mod read_model;
mod recipes;
mod sets;
mod shapes;
mod stated;
mod tables;

pub use array::Array;
pub use element_source::ElementSource;
pub use fe_results::{PointStresses, read_point_stresses, read_steps};
pub use jobs::{ElementDeck, JobFile, is_job, job_programs};
pub use manifest::read_manifest;
pub use matrices::assemble::check_size;
pub use matrices::operator::OperatorColumns;
pub use matrices::{ArraySource, HEAD, MatrixRole, MatrixSource, READERS, Reader};
pub use model_files::{
    InterfaceNodes, InterfaceSource, LoadSource, MatrixLocation, ModelFiles, ModelSource, NamedLoadSource,
    NodalStressSource, OperatorSource, RecoverySource, Region, StressNodesSource, StressStiffnessSource,
    TableFiles, WithStress, parse_units,
};
pub use read_model::{interface_in_memory, read_matrix, read_model};
pub use recipes::{RECIPES, Recipe, Step};
pub use shapes::{ImportedColumns, read_imported, read_shapes};
pub use stated::parse_damping;
pub use tables::{read_nodal_masses, read_nodes_of_table};
