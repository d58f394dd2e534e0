//! Models and their files, as read by the program.

mod deck_warnings;
mod folded_shells;
mod interface_names;
mod interface_points;
mod jobs;
mod local_axes;
mod manifest_settings;
mod memory;
mod nastran_files;
mod offered_stiffness;
mod other_names;
mod pins;
mod plane;
mod shared_doors;
mod split;
mod stated_model;
mod substructures;
