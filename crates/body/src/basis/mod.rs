//! Modal bases: shapes that span the deformation of a body, each kind in one file behind [`Basis`].

mod choice;
mod coupled_model;
mod craig_bampton;
mod craig_chang;
mod failure;
mod fixed_interface;
mod free_surface;
mod held_interfaces;
mod imported;
mod interface_rows;
mod massless;
mod modal_basis;
mod pseudo_free_surface;
mod residual_vectors;
mod solved;

pub use choice::BasisChoice;
pub use coupled_model::{CoupledModel, oscillating_responses};
pub use craig_bampton::CraigBampton;
pub use craig_chang::CraigChang;
pub use fixed_interface::{FixedInterface, FreeEstimate};
/// Settings of a mode computation: number and accuracy of the modes, and the factor to use.
pub use flexbody_eigen::EigenSettings as ModeSettings;
pub use free_surface::{FreeSurface, first_eigenvalue_estimate, free_surface, search_plan};
pub use imported::ImportedShapes;
pub use interface_rows::{CoordinatesInModelAxes, InterfaceCoordinates};
pub use modal_basis::{Basis, BasisKind, ModalBasis, Task, Truncation, rigid_modes};
pub use residual_vectors::{
    Loads, UserLoads, free_static_responses, free_static_responses_twice, interface_loads,
};
pub(crate) use residual_vectors::{centrifugal_loads, coupled_static_responses};
pub use solved::{CountElsewhere, SolvedModes};

/// Provenance of an eigenvector of the free body, in [`ModalBasis::provenance`] and in files.
pub const FREE_MODE: &str = "free mode";
