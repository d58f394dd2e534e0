//! Files that are read and the model that they make: readers, manifest, checks, plausibility.

#[path = "../support/mod.rs"]
mod support;

mod bombs;
mod deck_names;
mod empty_rows;
mod general_models;
mod input_fuzz;
mod input_hdf5;
mod input_readers;
mod input_tables;
mod interface_names;
mod interface_points;
mod jobs;
mod manifest_settings;
mod mesh;
mod mesh_files;
mod mode_files;
mod nastran;
mod nastran_files;
mod nastran_rows;
mod node_files;
mod open_matrices;
mod plane;
mod plausibility;
mod rotated_nodes;
mod shared_doors;
mod split;
mod substructures;
