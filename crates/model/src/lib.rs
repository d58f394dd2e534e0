//! Finite element model of one free body: nodes, degrees of freedom, K, M. Independent of file formats.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod assemble;
mod assembled;
mod body_number;
mod checks;
mod columns;
mod common_units;
mod connections;
mod damping;
mod damping_bands;
mod density;
mod director_blocks;
mod director_mass;
mod drilling;
mod elements;
mod empty_rows;
mod exchanged;
mod fe_model;
mod geometric_stiffness;
mod given_rows;
mod inertial_rows;
mod interface;
mod interface_centre;
mod layout;
mod load_checks;
mod local_mass;
mod magnitude;
mod mass_structure;
mod matrix_checks;
mod node_moments;
mod node_pairs;
mod nodes;
mod raw;
mod recovery;
mod recovery_checks;
mod references;
mod rigid;
mod rigid_motion;
mod rows;
mod separate_bodies;
mod stress;
mod surface;
mod tolerance;
mod unplaced_rows;
mod wording;

pub use body_number::BodyNumber;
pub use checks::{CheckedModel, Plausibility, check};
pub use damping::{Damping, DampingBand, DampingRatios, ratio_at};
pub use damping_bands::{DAMPING_BAND_KEYS, damping_bands};
pub use density::Densities;
pub use director_mass::DirectorMass;
pub use elements::{ElementShape, Elements};
pub use empty_rows::filled_rows;
pub use fe_model::FeModel;
pub use geometric_stiffness::{GeometricStiffness, LoadKind, UnitLoad};
pub use given_rows::{GivenRows, LostRow, NodeAxes, RowMap};
pub use inertial_rows::InertialRows;
pub use interface::{Coupling, InterfaceMotion, NodeSet, Reference};
pub use local_mass::SoundSpeed;
pub use node_moments::{NodeMoments, RigidAcceleration};
pub use nodes::{DofLabel, Nodes};
pub use raw::{RawMatrix, RawModel, RawModes, RawShapes};
pub use recovery::{ModelRecovery, Quantity, RecoveryOperator, RecoveryRow};
pub use rigid::{centre_and_length, extents, rigid_axes, rigid_count, rigid_fields, span};
pub use rows::Rows;
pub use separate_bodies::check_bodies;
pub use surface::{Skin, SurfaceMesh, skin};
