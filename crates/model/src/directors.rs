//! Inertia of nodes whose rotations carry mass: vectors that turn with them.

pub(crate) mod director_blocks;
pub(crate) mod director_mass;
pub(crate) mod followers;
pub(crate) mod mass_structure;
