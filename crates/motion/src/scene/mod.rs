//! Scenes: the scene file, and its simulation.

mod carrier_motion;
mod channels;
mod description;
mod envelope;
mod errors;
mod extremes;
mod frame_motion;
mod framed_scene;
mod history;
mod instants;
mod interface_stresses;
mod load_cases;
mod pace;
mod prepared;
mod read;
mod read_cases;
mod read_columns;
mod read_requirements;
mod read_values;
mod recovered;
mod recovery_errors;
mod requests;
mod requirements;
mod row_extremes;
mod row_states;
mod samples;
mod simulate;
mod stress_error;
mod surroundings;
mod trace;

pub use carrier_motion::carrier_accelerations;
pub use channels::Channels;
pub use description::{
    Carried, CarriedSpin, CaseName, Change, Drive, Initial, Load, ModeStart, Point, Run, Scene,
    SceneVariation, Scheme, SeriesFile, Spin, Variations,
};
pub use envelope::{CasePeak, Envelope, PointPeaks, RecoveryEnvelope};
pub use errors::{
    DeformationDifference, ErrorHistory, LEAST_REACTION, Measure, OtherModes, OutputErrors, reaction_errors,
};
pub use extremes::{Drift, Extremes, Peak};
pub use flexbody_model::StressPoint;
pub use frame_motion::{CaseRun, FrameMotion, Omission};
pub use framed_scene::FramedScene;
pub use history::{Axes, History, VectorHistory};
pub use instants::{ExcitedRates, Instant, highest_excited_rate, instants, unsettled_rate};
pub use interface_stresses::stresses_at_rigid_interfaces;
pub use load_cases::LoadCases;
pub use prepared::{damped, damped_once, ends_a_run, fastest_history, find_nodal_point, nodal_point};
pub use recovered::{AmplitudeHistory, IN_MEAN_AXES, LoadHistory, LoadedHistory, MEAN_AXES, RecoveredMotion};
pub use recovery_errors::{RecoveryMeasure, TracedRecoveries};
pub use requests::{Recovered, RecoveryRequest, Simulated, SimulationRequest};
pub use requirements::{
    Attachment, AttachmentKind, Limits, MotionRange, PerQuantity, Range, RecoveryLimit, RecoveryTolerance,
    Requirements, Tolerance,
};
pub use row_extremes::{EnvelopeSearch, ExtremeSearch, PointEnvelope, RowExtreme, RowExtremes};
pub use row_states::{RowLayout, RowMap, RowStates};
pub use samples::{Interpolation, Sample, Samples, Sizes};
pub use simulate::{Path, Recording, Resolution, Setting, simulate, simulate_with_envelope};
pub use stress_error::StressError;
pub use surroundings::{Driving, body_point, points_of};
pub use trace::{MotionHistory, Trace, trace, trace_at};
