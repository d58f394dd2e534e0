//! From a model to a flexible body: bases, invariants, certified digits.

#![allow(unreachable_pub)] // tests export nothing

mod accepted;
mod answered_shapes;
mod beams;
mod carried_groups;
mod certified_invariants;
mod convergence;
mod covariance;
mod craig_bampton;
mod craig_bampton_rotations;
mod deck_names;
mod empty_rows;
mod errata;
mod extremes;
mod first_shift;
mod followers;
mod held_modes;
mod held_node;
mod invariants;
mod lumped_modes;
mod mesh;
mod mode_files;
mod motion_columns;
mod multigrid;
mod nastran;
mod nastran_rows;
mod node_inertia;
mod partial_conversion;
mod plans;
mod precision;
mod real_models;
mod recovery;
mod recovery_of_a_model;
mod residual_vectors;
mod second_shift;
mod single_precision;
mod small_models;
mod soft_rotations;
mod spinning_shaft;
mod stated_ratios;
mod store_body;
mod stress_estimate;
mod stress_stiffness;
mod symmetry;
mod work_counters;
