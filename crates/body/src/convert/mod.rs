//! Conversion from a checked model to a flexible body, in stages whose results are values.
//!
//! ```text
//! FeModel ─ ModalModel::find ─→ modes in the body frame
//!         ─ condense_linear ──→ I0 and W1, for a scene to decide about the other groups
//!         ─ condense ─────────→ the invariants of the groups that are wanted
//!         ─ finish ───────────→ Conversion: the body, lumped comparators, remarks
//! ```

mod body_modes;
mod certificate;
mod condensation;
mod conversion;
mod damping;
mod geometric_stiffness;
mod interface_frame;
mod lumped;
mod modal_model;
mod recovery;
mod remarks;
mod settings;

pub use body_modes::{BodyModes, NodesInFrame, rigid_mass};
pub use condensation::Condensation;
pub use conversion::{Conversion, convert};
pub use damping::modal_damping;
pub use geometric_stiffness::modal_geometric_stiffness;
pub use interface_frame::interfaces_in_frame;
pub use lumped::LumpedPipeline;
pub use modal_model::ModalModel;
pub use remarks::{interface_compliance, poor_fits};
pub use settings::{ConvertSettings, Lumping, MeshChoice};
