//! Public interface of the library. It wraps the types of the other crates, so that these can change, and shows arrays
//! as slices.

mod advice;
mod arrays;
#[cfg(feature = "cluster")]
mod batch;
mod body;
mod check;
mod comparison;
mod conversion;
mod export;
#[cfg(feature = "import")]
mod foreign;
mod interface;
mod matrix;
mod measured_run;
mod model;
mod motion;
mod progress;
mod recovery;
mod report;
mod report_format;
#[cfg(feature = "response")]
mod response;
mod scene;
#[cfg(feature = "hdf5")]
mod trade;
#[cfg(feature = "hdf5")]
mod view;

pub use advice::{Advice, AttachedMass, Ranges};
pub use arrays::{GeometricStiffness, SourceFile};
#[cfg(feature = "cluster")]
pub use batch::{Batch, BatchOptions, BatchedBody};
pub use body::{FlexBody, Identity};
pub use check::Check;
pub use comparison::Comparison;
pub use conversion::{Conversion, ConvertOptions};
pub use export::ExportOptions;
pub use flexbody_body::basis::BasisKind as Basis;
pub use flexbody_body::convert::StressLoads;
pub use flexbody_body::invariants::{BodyFrame, FrameChoice};
pub use flexbody_eigen::Accuracy;
pub use flexbody_input::{Recipe, Step as RecipeStep};
pub use flexbody_model::{Coupling, Quantity, RecoveryRow, StressNodes};
pub use flexbody_report::{ComparisonFormat, ComparisonRow, ModePair, Tolerances};
#[cfg(feature = "hdf5")]
pub use flexbody_study::trade::ReferenceChoice;
#[cfg(feature = "import")]
pub use foreign::Audit;
pub use interface::{Interface, InterfaceCoordinates};
pub use matrix::Matrix;
pub use measured_run::{MeasuredRun, MotionHistory};
pub use model::{Model, ModelBuilder, SparseMatrix};
pub use motion::{Motion, PointPath};
pub use progress::{Listener, Progress};
pub use recovery::{Channels, LoadedHistory, Recovered, RecoveredRows};
pub use report_format::ReportFormat;
#[cfg(feature = "response")]
pub use response::{Response, ResponseOptions, TransferFunction};
pub use scene::{Scene, Selection};
#[cfg(feature = "hdf5")]
pub use trade::{Trade, TradeOptions};
#[cfg(feature = "hdf5")]
pub use view::{RecordedMotion, View};

/// Returns the names of the units of length, mass and time that models, bodies and exports may state.
pub fn unit_names() -> [Vec<&'static str>; 3] {
    flexbody_base::units::UnitSystem::names()
}
