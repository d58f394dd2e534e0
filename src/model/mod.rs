//! The finite element model of one free body: nodes, degrees of freedom, K, M. Knows no file format.

mod checks;
mod damping;
mod density;
mod exchanged;
mod fe_model;
mod geometric_stiffness;
mod interface;
mod layout;
mod local_mass;
mod magnitude;
mod mass_structure;
mod node_pairs;
mod nodes;
mod placeless;
mod raw;
mod rigid;
mod rigid_motion;
mod rows;
mod several;

pub use checks::{CheckedModel, Plausibility, check};
pub use damping::{Damping, DampingBand};
pub use density::Densities;
pub use fe_model::FeModel;
pub use geometric_stiffness::{GeometricStiffness, LoadKind, UnitLoad};
pub use interface::{Coupling, InterfaceMotion, NodeSet, Reference};
pub use local_mass::SoundSpeed;
pub use nodes::{DofLabel, Nodes};
pub use raw::{RawMatrix, RawModel, RawShapes};
pub use rigid::{centre_and_length, extents, rigid_count, rigid_fields};
pub use rows::Rows;
pub use several::{BodyNumber, check_bodies};
