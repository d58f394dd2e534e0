//! Models and their files, as read by the program.

mod interface_names;
mod interface_points;
mod jobs;
mod manifest_settings;
mod memory;
mod nastran_files;
mod plane;
mod shared_doors;
mod split;
mod substructures;
