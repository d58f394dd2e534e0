//! Conversion from a checked model to a flexible body, in stages whose results are values.
//!
//! ```text
//! FeModel ─ ModalModel::find ─→ modes in the body frame
//!         ─ condense_linear ──→ I0 and W1, for a scene to decide about the other groups
//!         ─ condense ─────────→ the invariants of the groups that are wanted
//!         ─ finish ───────────→ Conversion: the body, lumped comparators, remarks
//! ```

mod answered;
mod body_modes;
mod conversion;
mod free_basis;
mod lumped;
mod modal_matrices;
mod modal_model;
mod motion_forces;
mod named_loads;
mod node_inertia;
mod recovery;
mod settings;
mod shapes;
mod soft_rotations;
mod stress_estimate;
mod stress_loads;
mod stress_stiffness;

pub use body_modes::{BodyModes, NodesInFrame, interfaces_in_frame, rigid_mass};
pub use conversion::{Conversion, convert, interface_compliance, poor_fits};
pub use lumped::LumpedPipeline;
pub use modal_matrices::{modal_damping, modal_geometric_stiffness, unit_rotations};
pub use modal_model::{Condensation, ModalModel};
pub use node_inertia::unusual_node_inertia;
pub(crate) use recovery::{BodyOfModel, Recovered};
pub use recovery::{recovered_rows, recovery_loads};
pub use settings::{ConvertSettings, Lumping, MeshChoice};
pub use shapes::{RecoveryShapes, ShapeColumn, UNIFORM_STRAIN, load_shapes, recovery_shapes};
pub use stress_loads::StressLoads;
pub(crate) use stress_stiffness::{StressedModes, stress_stiffness};
