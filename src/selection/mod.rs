//! What a body needs in a scene: sizes of the terms, guaranteed bounds of what dropping them does, measured errors, and the decision.

mod bounds;
mod norms;
mod rows;
mod select;
mod significance;
mod situation;
mod trial;
mod variation;
mod warnings;

pub use bounds::{Amplitude, Driven, LoadSizes, ModalLoad, Start};
pub use norms::Norms;
pub use select::{Selection, ruled_out, select};
pub use significance::{Significance, centrifugal_responses, significances};
pub use situation::{Input, Situation};
pub use trial::{Bench, ModeShare, Trial, terms};
pub use variation::{Rotation, Variation};
