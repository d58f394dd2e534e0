//! From a model to a flexible body: bases, invariants, certified digits, damping, geometric stiffness.

#[path = "../support/mod.rs"]
mod support;

mod accepted;
mod body_units;
mod certified;
mod craig_bampton;
mod craig_bampton_rotations;
mod damping;
mod first_shift;
mod geometric_stiffness;
mod imported_shapes;
mod interface_frame;
mod invariants;
mod lumped_modes;
mod partial_bodies;
mod partial_conversion;
mod residual_vectors;
mod spinning_shaft;
mod statements;
mod stress_relations;
mod turning_nodes;
