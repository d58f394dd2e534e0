//! Finite element model of one free body: nodes, degrees of freedom, K, M. Independent of file formats.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod accepted;
mod body_number;
mod checks;
mod damping;
mod description;
mod directors;
mod fe_model;
mod geometric_stiffness;
mod interface;
mod model_data;
mod named_load;
mod nodes;
mod raw_matrix;
mod recovery;
mod rounding;
mod rows;
mod surface;
#[cfg(debug_assertions)]
mod test_rounding;
mod wording;

pub use accepted::Accepted;
pub use body_number::BodyNumber;
pub use checks::density::{Densities, SoundSpeed};
pub use checks::separate_bodies::check_bodies;
pub use checks::uniform_strains::uniform_strains;
pub use checks::{CheckedModel, Plausibility, check};
pub use damping::{DAMPING_BAND_KEYS, Damping, DampingBand, DampingRatios, damping_bands, ratio_at};
pub use description::Description;
pub use directors::director_mass::{DirectorMass, NodeMoments, RigidAcceleration};
pub use directors::followers::{Followers, RawFollowers};
pub use fe_model::FeModel;
pub use fe_model::inertial_rows::InertialRows;
pub use fe_model::layout::filled_rows;
pub use fe_model::raw::{RawModel, RawModes, RawShapes};
pub use fe_model::soft_rotations::{SoftRotation, SoftRotations};
pub use geometric_stiffness::{GeometricStiffness, LoadKind, UnitLoad};
pub use interface::{Coupling, InterfaceMotion, NodeSet, Reference};
pub use model_data::ModelData;
pub use named_load::ModelLoad;
pub use nodes::{DofLabel, ElementShape, Elements, Nodes};
pub use raw_matrix::RawMatrix;
pub use recovery::stress_labels::STRAIN_NAMES;
pub use recovery::stress_nodes::{NodalStress, StressNodes};
pub use recovery::stress_points::{StressPoint, pascals};
pub use recovery::{AnsweredShapes, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow, ShapeSteps};
pub use rows::given_rows::{DependentRow, GivenRows, LostRow, NodeAxes, RowMap};
pub use rows::{Rows, centre_and_length, extents, rigid_axes, rigid_count, rigid_fields, span};
pub use surface::{Skin, SurfaceMesh, skin};
