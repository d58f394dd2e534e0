//! Scenes: the scene file, and its simulation.

mod active_nodes;
mod axes;
mod conditions;
mod contradictions;
mod description;
mod driving;
mod effort;
mod equilibrium;
mod errors;
mod excited_rate;
mod extremes;
mod framed_scene;
mod history;
mod inertia_share;
mod instants;
mod load_cases;
mod nodal_point;
mod peak;
mod per_quantity;
mod prepared;
mod read;
mod read_attitude;
mod read_carried;
mod read_cases;
mod read_columns;
mod read_numbers;
mod read_requirements;
mod read_values;
mod recording;
mod requirements;
mod samples;
mod settled;
mod simulate;
mod surroundings;
mod trace;
mod vector_history;

pub use axes::Axes;
pub use description::{
    Carried, CarriedSpin, CaseName, Drive, Initial, Load, ModeStart, Point, Run, Scene, Scheme, SeriesFile,
    Spin,
};
pub use driving::Driving;
pub use effort::fastest_history;
pub use errors::{DeformationDifference, ErrorHistory, Measure, OtherModes, OutputErrors};
pub use errors::{LEAST_REACTION, reaction_errors};
pub use excited_rate::highest_excited_rate;
pub use extremes::{Drift, Extremes};
pub use framed_scene::FramedScene;
pub use history::History;
pub use inertia_share::inertia_share;
pub use instants::{Instant, instants};
pub use load_cases::LoadCases;
pub use nodal_point::{find_nodal_point, nodal_point};
pub use peak::Peak;
pub use per_quantity::PerQuantity;
pub use prepared::{damped, damped_once, ends_a_run};
pub use recording::{Path, Recording, Resolution, Setting};
pub use requirements::{Attachment, AttachmentKind, Limits, MotionRange, Range, Requirements, Tolerance};
pub use samples::{Interpolation, Sample, Samples, Sizes};
pub use settled::unsettled_rate;
pub use simulate::simulate;
pub use surroundings::{body_point, points_of};
pub use trace::{Trace, trace, trace_at};
pub use vector_history::VectorHistory;
