//! What a body is to do: the scene file, and its simulation.

mod contradictions;
mod description;
mod errors;
mod history;
mod read;
mod read_carried;
mod read_requirements;
mod recording;
mod requirements;
mod simulate;
mod stage;
mod surroundings;

pub use description::{
    Axes, Carried, CarriedSpin, Drive, Initial, Load, ModeStart, Point, Run, Scene, Scheme, Spin, Translation,
};
pub(crate) use errors::LEAST_REACTION;
pub use errors::{Apart, ErrorHistory, Measure, OtherModes, OutputErrors};
pub use history::History;
pub use read::read_scene;
pub use recording::{Drift, Path, Recording, Resolution, Setting};
pub use requirements::{Attachment, AttachmentKind, Limits, MotionRange, Range, Requirements, Tolerance};
pub(crate) use simulate::damped;
pub use simulate::simulate;
pub use stage::Stage;
pub(crate) use surroundings::points_of;
