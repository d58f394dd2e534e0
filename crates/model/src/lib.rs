//! Finite element model of one free body: nodes, degrees of freedom, K, M. Independent of file formats.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod assemble;
mod body_number;
mod checks;
mod damping;
mod decimate;
mod density;
mod director_blocks;
mod director_mass;
mod drilling;
mod element_around;
mod fe_model;
mod feature_edges;
mod followers;
mod geometric_stiffness;
mod given_rows;
mod ground;
mod inertial_rows;
mod interface;
mod internal_rows;
mod layout;
mod mass_structure;
mod materials;
mod named_load;
mod neighbours;
mod node_pairs;
mod nodes;
mod raw;
mod raw_matrix;
mod recovery;
mod references;
mod rigid_motion;
mod rounding;
mod rows;
mod separate_bodies;
mod soft_rotations;
mod stress;
mod stress_labels;
mod stress_loads;
mod stress_notes;
mod stress_points;
mod surface;
#[cfg(debug_assertions)]
mod test_rounding;
mod uniform_strains;
mod wording;

pub use body_number::BodyNumber;
pub use checks::{CheckedModel, Plausibility, check};
pub use damping::{DAMPING_BAND_KEYS, Damping, DampingBand, DampingRatios, damping_bands, ratio_at};
pub use density::{Densities, SoundSpeed};
pub use director_mass::{DirectorMass, NodeMoments, RigidAcceleration};
pub use fe_model::FeModel;
pub use followers::{Followers, RawFollowers};
pub use geometric_stiffness::{GeometricStiffness, LoadKind, UnitLoad};
pub use given_rows::{GivenRows, LostRow, NodeAxes, RowMap};
pub use inertial_rows::InertialRows;
pub use interface::{Coupling, InterfaceMotion, NodeSet, Reference};
pub use layout::filled_rows;
pub use named_load::ModelLoad;
pub use nodes::{DofLabel, ElementShape, Elements, Nodes};
pub use raw::{RawModel, RawModes, RawShapes};
pub use raw_matrix::RawMatrix;
pub use recovery::{AnsweredShapes, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow, ShapeSteps};
pub use rows::{Rows, centre_and_length, extents, rigid_axes, rigid_count, rigid_fields, span};
pub use separate_bodies::check_bodies;
pub use soft_rotations::{SoftRotation, SoftRotations};
pub use stress_points::{StressPoint, pascals};
pub use surface::{Skin, SurfaceMesh, skin};
pub use uniform_strains::{STRAIN_NAMES, uniform_strains};
