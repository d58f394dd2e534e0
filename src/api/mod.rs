//! Public interface of the library. It wraps the types of the other crates, so that these can change, and shows arrays
//! as slices.

mod arrays;
mod body;
mod conversion;
mod interface;
mod matrix;
mod measured_run;
mod model;
mod motion;
mod progress;
mod report;
mod scene;
#[cfg(feature = "hdf5")]
mod trade;

pub use arrays::{GeometricStiffness, SourceFile};
pub use body::{FlexBody, Identity};
pub use conversion::{Conversion, ConvertOptions};
pub use flexbody_body::basis::BasisKind as Basis;
pub use flexbody_body::invariants::{BodyFrame, FrameChoice};
pub use flexbody_eigen::Accuracy;
pub use flexbody_model::Coupling;
#[cfg(feature = "hdf5")]
pub use flexbody_study::trade::ReferenceChoice;
pub use interface::{Interface, InterfaceCoordinates};
pub use matrix::Matrix;
pub use measured_run::{MeasuredRun, MotionHistory};
pub use model::{Model, ModelBuilder, SparseMatrix};
pub use motion::{Motion, PointPath};
pub use progress::{Listener, Progress};
pub use report::ReportFormat;
pub use scene::{Scene, Selection};
#[cfg(feature = "hdf5")]
pub use trade::{Trade, TradeOptions};
