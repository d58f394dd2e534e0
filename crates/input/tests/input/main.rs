//! Reading of model files: formats, manifest, names, damage.

#![allow(unreachable_pub)] // tests export nothing

mod bombs;
mod full_arrays;
mod ground;
mod harwell_boeing;
mod input_fuzz;
mod input_hdf5;
mod input_readers;
mod input_tables;
mod labels_of_files;
mod matlab_structs;
mod mesh_files;
mod model_files;
mod node_files;
mod open_matrices;
mod plausibility;
mod rotated_nodes;
